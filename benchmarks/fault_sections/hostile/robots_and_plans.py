"""Hostile robots, floor plans and test plans."""

from __future__ import annotations

from collections.abc import Iterator

from fault_sections.hostile.good import PLAN, REFUSED, ROBOT, TAKEN, TEST_PLAN, before_tables


def hostile_robots() -> Iterator[tuple[str, str]]:
    def put(old: str, new: str) -> str:
        assert old in ROBOT, old
        return ROBOT.replace(old, new, 1)

    yield "range_min above range_max", put("range_min = 0.1", "range_min = 13.0")
    yield "angle_min above angle_max", put("angle_min = -2.3561945", "angle_min = 3.0")
    yield "angles of 10^9 rad", put("angle_max = 2.3561945", "angle_max = 1e9")
    for beams in ("1000000000", "100000", "0", "true", "36.0"):
        yield f"{beams} beams", put("beams = 360", f"beams = {beams}") + ("\nx = 1\n" if beams == "100000" else "")
    for period in ("1e-300", "1e300", "1e-9", "true", "nan", "0"):
        yield f"a period of {period} s", put("period = 0.1", f"period = {period}")
    for v in ("1e300", "1e9", "true", "nan", "inf", '"0.8"'):
        yield f"v_max = {v}", put("v_max = 0.8", f"v_max = {v}")
    yield "a range of 10^9 m", put("range_max = 12.0", "range_max = 1e9")
    yield "d_base of 10^300 m", put("d_base = 0.5", "d_base = 1e300")
    footprint = "vertices = [[0.35, 0.25], [-0.35, 0.25], [-0.35, -0.25], [0.35, -0.25]]"
    yield (
        "a footprint that crosses itself",
        put(footprint, "vertices = [[-1, -1], [1, -1], [-0.8, 1], [0.9, 1.0], [0, -2]]"),
    )
    yield "a footprint of 10^9 m", put(footprint, "vertices = [[1e9, 1e9], [-1e9, 1e9], [-1e9, -1e9], [1e9, -1e9]]")
    yield "a footprint of 60,000 vertices", put(footprint, f"vertices = [{'[1, 0], [0, 1], [-1, 0],' * 20_000}]")
    yield "a tolerance of true", put("xy = 0.15", "xy = true")
    yield "a preset that is a number", ROBOT + "\n[presets]\nx = 1\n"
    yield "a preset without a number", ROBOT + "\n[presets.x]\nwithout = 3\n"
    yield "a preset without a table", ROBOT + '\n[presets.x]\nwithout = [["lidar"]]\n'
    yield "50,000 presets", ROBOT + "".join(f"\n[presets.p{k}]\nperiod = 0.{k + 1}" for k in range(50_000))
    yield "presets that is a list", ROBOT.replace("title =", "presets = [1]\ntitle =", 1)
    yield "navigators that is a text", ROBOT.replace("title =", 'navigators = "x"\ntitle =', 1).split("[navigators")[0]
    for group, line in (
        ("navigators.move-base.local_costmap", "width = 1e9"),
        ("navigators.move-base.local_costmap", "resolution = 1e-9"),
        ("navigators.move-base.DWAPlannerROS", "vx_samples = 1000000000"),
        ("navigators.move-base.DWAPlannerROS", "sim_granularity = 1e-12"),
        ("navigators.move-base.DWAPlannerROS", "sim_time = 1e9"),
        ("navigators.move-base.move_base", "controller_frequency = 1e300"),
    ):
        head = f"[{group}]"
        yield (
            f"{group}.{line}",
            ROBOT.replace(head, f"{head}\n{line}") if line.split()[0] not in ROBOT else _replaced(ROBOT, line),
        )
    for group, line in (
        ("localisation.amcl", "max_particles = 1000000000"),
        ("localisation.amcl", "laser_max_beams = 1000000000"),
        ("localisation.amcl", "laser_likelihood_max_dist = 1e9"),
        ("localisation.amcl", "min_particles = true"),
        ("mapping", "particles = 1000000000"),
        ("mapping", "delta = 1e-9"),
        ("mapping", "xmax = 1e9"),
        ("mapping", "kernelSize = 1000000000"),
        ("mapping", "iterations = 1000000000"),
        ("mapping", "llsamplestep = 1e-12"),
    ):
        yield f"{group}.{line}", f"{ROBOT}\n[{group}]\n{line}\n"
    yield "a navigator by a path that is none", ROBOT + '\n[navigators."x\\u0000.py:Y"]\na = 1\n'
    yield "a navigator of 100,000 letters", ROBOT + f'\n[navigators."{"x" * 100_000}"]\na = 1\n'


def _replaced(text: str, line: str) -> str:
    key = line.split()[0]
    return "\n".join(line if old.split(" ")[0] == key else old for old in text.splitlines())


def hostile_plans() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    def put(old: str, new: str) -> str:
        assert old in PLAN, old
        return PLAN.replace(old, new, 1)

    yield "a grid of 10^9 cells", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 5000.0, 1000.0]"), REFUSED
    yield "a plan of 10^9 m", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 1e9, 1e9]"), REFUSED
    yield "a plan of 10^300 m", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 1e300, 1e300]"), REFUSED
    yield "a resolution of 10^-9 m", before_tables(PLAN, "resolution = 1e-9"), REFUSED
    yield "5 mm over 300 m", before_tables(put("5.0, 2.2]", "300.0, 300.0]"), "resolution = 0.005"), REFUSED
    yield "a outside", put("a = [1.0, 1.0, 0.0]", "a = [-100.0, 1.0, 0.0]"), REFUSED
    yield "b outside", put("b = [4.0, 1.0, 0.0]", "b = [400.0, 1.0, 0.0]"), REFUSED
    yield "a and b far away", put("a = [1.0, 1.0, 0.0]", "a = [1e9, 1.0, 0.0]").replace("b = [4.0", "b = [2e9"), REFUSED
    yield (
        "a in a wall",
        put("a = [1.0, 1.0, 0.0]", "a = [1.0, -0.1, 0.0]").replace("b = [4.0, 1.0", "b = [4.0, -0.1"),
        REFUSED,
    )
    yield "a is b", put("b = [4.0, 1.0, 0.0]", "b = [1.0, 1.0, 0.0]"), REFUSED
    walls = "".join(
        f'[[walls]]\nname = "w{k}"\nbox = [{k % 200}, {k // 200}, {k % 200 + 0.5}, {k // 200 + 0.5}]\n'
        for k in range(50_000)
    )
    yield "50,000 walls", 'name = "p"\n' + walls, REFUSED
    fewer = "".join(
        f'[[walls]]\nname = "w{k}"\nbox = [{k % 100}, {k // 100}, {k % 100 + 0.5}, {k // 100 + 0.5}]\n'
        for k in range(5_000)
    )
    yield "5,000 walls", 'name = "p"\n' + fewer, TAKEN
    circles = "".join(
        f'[[furniture]]\nname = "f{k}"\nshape = {{ kind = "disc", radius = 50 }}\npose = [50, 50, 0]\n'
        for k in range(9_000)
    )
    yield "9,000 discs of 50 m on one place", PLAN.replace("5.0, 2.2]", "100.0, 100.0]") + circles, TAKEN
    yield (
        "a wall that crosses itself",
        PLAN + '[[walls]]\nname = "x"\nvertices = [[-1, -1], [1, -1], [-0.8, 1], [0.9, 1.0], [0, -2]]\n',
        REFUSED,
    )
    yield (
        "a wall of 60,000 vertices",
        PLAN + f'[[walls]]\nname = "x"\nvertices = [{"[0, 0], [1, 0], [0, 1]," * 20_000}]\n',
        REFUSED,
    )
    yield "a wall that is a line", PLAN + '[[walls]]\nname = "x"\nvertices = [[0, 0], [1, 0], [2, 0]]\n', REFUSED
    yield "an area of 10^9 m", 'name = "p"\narea = [0, 0, 1e9, 1e9]\n', REFUSED
    yield "an area of 10^300 m", 'name = "p"\narea = [-1e300, -1e300, 1e300, 1e300]\n', REFUSED
    yield "a clear area of 10^300 m", before_tables(PLAN, "clear = [-1e300, -1e300, 1e300, 1e300]"), REFUSED
    for name in ("/dev/zero", "x\\u0000", "x" * 5000, ".", "it.toml", "nowhere.yaml"):
        yield f"the map {name[:20]}", before_tables(PLAN, f'map = "{name}"'), REFUSED
    yield (
        "furniture of 10^9 m",
        PLAN + '[[furniture]]\nname = "x"\nshape = { kind = "disc", radius = 1e9 }\npose = [0, 0, 0]\n',
        REFUSED,
    )
    yield "a million beds", PLAN + '[[rooms]]\nname = "r"\nbeds = true\nfloor = [[0, 0, 1, 1]]\n', REFUSED
    yield "a wall of true", PLAN + '[[walls]]\nname = "x"\nbox = [false, false, true, true]\n', REFUSED


def hostile_test_plans() -> Iterator[tuple[str, str]]:
    for rate in ("1e300", "true", "nan", "0", "1e-300"):
        yield f"rate = {rate}", TEST_PLAN.replace("[poses]", f"rate = {rate}\n[poses]")
    for name in ("x\\u0000.csv", "x" * 5000, "/dev/zero", ".", "/dev/tty", "it.toml"):
        yield f"the recording {name[:20]}", TEST_PLAN.replace("note =", f'file = "{name}"\nnote =')
        yield f"the robot {name[:20]}", TEST_PLAN.replace('"tiago"', f'"{name}"')
        yield f"the floor plan {name[:20]}", TEST_PLAN.replace("[poses]", f'floor_plan = "{name}"\n[poses]')
    yield "a pose of 10^300 m", TEST_PLAN.replace("A = [0.0, 0.0, 0.0]", "A = [1e300, 0.0, 0.0]")
    yield "100,000 trials", TEST_PLAN + "[[trial]]\n" * 100_000 + "x = 1\n"
    yield "100,000 legs", TEST_PLAN + '[[legs]]\nname = "l"\n' * 100_000 + "x = 1\n"
    yield "a span backwards", TEST_PLAN.replace("note =", 'file = "x.csv"\nspan = [5, 1]\nnote =')
    yield "a span of 10^300 s", TEST_PLAN.replace("note =", 'file = "x.csv"\nspan = [0, 1e300]\nnote =')
    yield "repetition = true", TEST_PLAN + "repetition = true\n"
    yield "sources that are a number", before_tables(TEST_PLAN, "sources = 3")
    yield (
        "a frame tied by itself",
        TEST_PLAN
        + '[sources.a.frame]\nstatic_poses = [{ file = "it.toml", pose = "A" }]\n[[trial]]\nfile = "it.toml"\n',
    )

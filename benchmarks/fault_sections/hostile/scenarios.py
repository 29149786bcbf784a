"""Hostile scenarios and suites."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

from fault_sections.hostile.good import REFUSED, SCENARIO, SUITE, TAKEN, before_tables, check_of


def _obstacle(*lines: str) -> str:
    return SCENARIO + "\n[[obstacles]]\n" + "\n".join(lines) + "\n"


def hostile_scenarios() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    disc = 'shape = { kind = "disc", radius = 0.2 }'
    for speed in ("true", '"0.5"', "nan", "-1", "0", "1e300", "1e-300", "[0.5]", "2020-01-01"):
        yield f"speed = {speed}", SCENARIO.replace("speed = 0.5", f"speed = {speed}"), REFUSED
    for limit in ("1e300", "1e12", "true", "nan", "inf", "0"):
        yield f"time_limit = {limit}", SCENARIO.replace("time_limit = 60.0", f"time_limit = {limit}"), REFUSED
    for start in ("[1e300, 0, 0]", "[1e9, 0, 0]", "[0, 0, 1e300]", "[true, false, true]", "[0, 0]", "[nan, 0, 0]"):
        yield f"start = {start}", SCENARIO.replace("start = [-2.0, 0.0, 0.0]", f"start = {start}"), REFUSED
    for seed in ("-1", "1.5", "true", "9223372036854775808", "18446744073709551616", '"7"'):
        yield f"seed = {seed}", before_tables(SCENARIO, f"seed = {seed}"), REFUSED
    for field in ("placement_xy", "placement_yaw", "reference_length", "shortest"):
        yield f"{field} = 1e300", before_tables(SCENARIO, f"{field} = 1e300"), REFUSED
    for plan in (
        "",
        "\\u0000",
        "x" * 100_000,
        "x\\u0000.toml",
        "x" * 5000 + ".toml",
        "../" * 3000 + "x.toml",
        "/dev/zero",
        "/dev",
        ".",
    ):
        yield f"floor_plan = {plan[:20]}", SCENARIO.replace('"hall"', f'"{plan}"'), REFUSED
    yield "its own floor plan", SCENARIO.replace('"hall"', '"it.toml"'), REFUSED
    for edge in ("1e9", "1e300", "1e-300", "true"):
        yield (
            f"a square of {edge} m",
            _obstacle('name = "o"', f'shape = {{ kind = "square", edge = {edge} }}', "pose = [0, 1, 0]"),
            REFUSED,
        )
    yield (
        "a disc of 10^9 m",
        _obstacle('name = "o"', 'shape = { kind = "disc", radius = 1e9 }', "pose = [0, 1, 0]"),
        REFUSED,
    )
    for vertices, what in (
        ("[[0, 0], [0.2, 0.2], [0.2, 0], [0, 0.3]]", "crosses itself"),
        ("[[-1, -1], [1, -1], [-0.8, 1], [0.9, 1.0], [0, -2]]", "crosses itself, with a positive area"),
        ("[[0, 0], [0, 0], [0, 0]]", "is a point"),
        ("[[0, 0], [1, 0], [2, 0]]", "is a line"),
        ("[[0, 0], [1e300, 0], [1e300, 1e300]]", "is beyond all measure"),
        ("[" + "[0, 0], [1, 0], [0, 1]," * 20_000 + "]", "has 60,000 vertices"),
        ("[[0, 0], [0.2, 0], [0.1, 0], [0.2, 0.2]]", "goes back on itself"),
    ):
        yield (
            f"an outline that {what}",
            _obstacle('name = "o"', f'shape = {{ kind = "polygon", vertices = {vertices} }}', "pose = [0, 1, 0]"),
            REFUSED,
        )
    for robot in ("nobody", "x" * 100_000, "tiago:" + "y" * 10_000, "x\\u0000.toml", "it.toml", "/dev/zero.toml"):
        yield (
            f"the body of the robot {robot[:20]}",
            _obstacle('name = "o"', f'shape = {{ kind = "robot", robot = "{robot}" }}', "pose = [0, 1, 0]"),
            REFUSED,
        )
    many = "".join(f'[[obstacles]]\nname = "o{k}"\n{disc}\npose = [{0.001 * k}, 1, 0]\n' for k in range(20_000))
    yield "20,000 obstacles", SCENARIO + many, REFUSED
    apart = "".join(
        f'[[obstacles]]\nname = "o{k}"\nshape = {{ kind = "disc", radius = 0.001 }}\npose = [{-2 + 0.01 * (k % 400)}, {1.0 + 0.01 * (k // 400)}, 0]\n'
        for k in range(2_000)
    )
    yield "2,000 obstacles apart", SCENARIO + apart, TAKEN
    moving = "".join(
        f'[[obstacles]]\nname = "o{k}"\n{disc}\nruns = [{{ leg = "there", path = [[0, 1], [0, 900]], speed = 1 }}]\n'
        for k in range(1_000)
    )
    yield "1,000 that move far", SCENARIO + moving, REFUSED
    moved = "".join(
        f'[[obstacles]]\nname = "m{k}"\n{disc}\noscillation = {{ start = [0, 1], velocity = [0, 1], attraction = [0, 1], stiffness = [1, 1] }}\n'
        for k in range(1_000)
    )
    yield "1,000 that oscillate for an hour", SCENARIO.replace("60.0", "3600.0") + moved, REFUSED
    legs = "".join(f'[[legs]]\nname = "l{k}"\ngoal = [2, 0, 0]\ntime_limit = 60\n' for k in range(50_000))
    yield "50,000 legs", SCENARIO + legs, REFUSED
    for far in ("1e9", "1e6", "1e300"):
        yield (
            f"a path of {far} m",
            _obstacle('name = "o"', disc, f'runs = [{{ leg = "there", path = [[0, 1], [{far}, 1]], speed = 1 }}]'),
            REFUSED,
        )
    zigzag = ", ".join("[0, 1], [1, 1]" for _ in range(30_000))
    yield (
        "a path of 60,000 points",
        _obstacle('name = "o"', disc, f'runs = [{{ leg = "there", path = [{zigzag}], speed = 1 }}]'),
        REFUSED,
    )
    runs = ", ".join('{ leg = "there", path = [[0, 1], [1, 1]], speed = 1 }' for _ in range(20_000))
    yield "20,000 runs", _obstacle('name = "o"', disc, f"runs = [{runs}]"), REFUSED
    yield (
        "a path without length",
        _obstacle('name = "o"', disc, 'runs = [{ leg = "there", path = [[0, 1], [0, 1]], speed = 1 }]'),
        REFUSED,
    )
    for delay in ("-1e300", "1e300", "-1e12", "nan"):
        yield (
            f"a delay of {delay} s",
            _obstacle(
                'name = "o"', disc, f'runs = [{{ leg = "there", path = [[0, 1], [1, 1]], speed = 1, delay = {delay} }}]'
            ),
            REFUSED,
        )
    for stiffness in ("1e300", "1e-300", "1e12"):
        yield (
            f"an oscillation of stiffness {stiffness}",
            _obstacle(
                'name = "o"',
                disc,
                f"oscillation = {{ start = [0, 1], velocity = [0, 0], attraction = [0, 1.2], stiffness = [{stiffness}, 1] }}",
            ),
            TAKEN if stiffness == "1e-300" else REFUSED,
        )
    for pace, hold in (("1e300", "[1e-300, 1e-299]"), ("0.5", "[1e300, 1e301]")):
        yield (
            f"pushes held {hold} s",
            _obstacle(
                'name = "o"',
                disc,
                f'motion = {{ kind = "shaken", start = [0, 1], speed = 1, acceleration = 1, attraction = [0, 1], stiffness = [1, 1], damping = 0, push = {pace}, hold = {hold}, seed = 1 }}',
            ),
            TAKEN,
        )
    yield (
        "a patrol of no length",
        _obstacle(
            'name = "o"',
            disc,
            'motion = { kind = "pursuit", start = [0, 1], speed = 1, acceleration = 1, path = [[0, 1], [1e-320, 1]], pace = 1, stiffness = 1, damping = 1 }',
        ),
        TAKEN,
    )
    yield (
        "a patrol of 10^300 m",
        _obstacle(
            'name = "o"',
            disc,
            'motion = { kind = "pursuit", start = [0, 1], speed = 1, acceleration = 1, path = [[0, 1], [1e300, 1]], pace = 1e300, stiffness = 1e300, damping = 1e300 }',
        ),
        REFUSED,
    )
    yield (
        "a drive to 10^300 m",
        _obstacle(
            'name = "o"',
            disc,
            'motion = { kind = "stop-and-go", start = [0, 1], speed = 1, acceleration = 1, region = [-1e300, 1e300], pace = [1, 1], drive = [1, 1], rest = [1, 1], lag = 1e-300, seed = 1 }',
        ),
        REFUSED,
    )
    yield "a disturbance of 10^9 m", SCENARIO + "[disturbance]\nposition = 1e9\n", REFUSED


def _suite_with(name: str, text: str) -> tuple[str, Callable[[Path], list[str]], tuple[int, ...]]:
    return name, check_of(text), REFUSED


def hostile_suites() -> Iterator[tuple[str, Callable[[Path], list[str]], tuple[int, ...]]]:
    top = 'name = "s"\nrobots = ["tiago"]\n'
    inside = SUITE.removeprefix(top)
    for number in ("1000000000", "9223372036854775807", "0", "true", "1.5", '"3"'):

        def run(folder: Path, number: str = number) -> list[str]:
            (folder / "it.toml").write_text(f"{top}repetitions = {number}\n{inside}")
            return ["run", "it.toml", "--no-report", "--workers", "1", "--out", "out"]

        yield f"repetitions = {number}, run", run, REFUSED
        yield _suite_with(f"repetitions = {number}", f"{top}repetitions = {number}\n{inside}")
    speeds = ", ".join(f"{0.001 + k * 1e-6:.6f}" for k in range(100_000))
    yield (
        "100,000 speeds, 1,000 repetitions",
        check_of(f"{top}repetitions = 1000\nspeeds = [{speeds}]\n{inside}"),
        REFUSED,
    )
    yield _suite_with("a speed that is true", f"{top}speeds = [true]\n{inside}")
    for file in ("it.toml", "x\\u0000.toml", "x" * 5000 + ".toml", "/dev/zero", "", ".", "../" * 2000 + "a.toml"):
        yield _suite_with(f"files = {file[:20]}", f'{top}files = ["{file}"]\n')

    def often(folder: Path) -> list[str]:
        (folder / "one.toml").write_text(SCENARIO)
        (folder / "it.toml").write_text(top + "files = [" + '"one.toml",' * 100_000 + "]\n")
        return ["check", "it.toml"]

    yield "one file 100,000 times", often, REFUSED

    def large(folder: Path) -> list[str]:
        (folder / "one.toml").write_text(SCENARIO + "#" + "x" * 3_000_000)
        listed = [f"./{'./' * k}one.toml" for k in range(200)]
        (folder / "it.toml").write_text(f"{top}files = {json.dumps(listed)}\n")
        return ["check", "it.toml"]

    yield "one large file under 200 names", large, REFUSED
    robots = ", ".join(f'"r{k}"' for k in range(50_000))
    yield _suite_with("50,000 robots", f'name = "s"\nrobots = [{robots}]\nx = 1\n{inside}')

    def robot(folder: Path) -> list[str]:
        (folder / "it.toml").write_text(SUITE.replace('"tiago"', '"x\\u0000.toml"'))
        return ["run", "it.toml", "--no-report", "--workers", "1", "--out", "out"]

    yield "a robot with NUL, run", robot, REFUSED
    thousand = "".join(SUITE.removeprefix(top).replace('"t"', f'"t{k}"') for k in range(10_000))
    yield "10,000 scenarios", check_of(top + thousand), TAKEN
    yield _suite_with("the same name twice", top + inside + inside)

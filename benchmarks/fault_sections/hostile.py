"""Hostile files and command lines: each has to be refused with a sentence, or taken, within bounds of time and memory."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from clearway import api  # noqa: F401 - what every command needs is imported before the first is forked
from clearway.campaigns import CampaignPlan, checks, conformance  # noqa: F401
from clearway.mapping import build_map  # noqa: F401
from clearway.recordings.exports import export  # noqa: F401
from clearway.reports import write_report  # noqa: F401
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection
from clearway.trials.store_results import SCHEMA
from fault_sections import Count
from fault_sections.confined import command

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PLANS = ROOT / "src" / "clearway" / "scenarios" / "plans"
SMOKE = 12
"""Of how many attacks a smoke run takes one."""

SCENARIO = """name = "t"
floor_plan = "hall"
start = [-2.0, 0.0, 0.0]
speed = 0.5
[[legs]]
name = "there"
goal = [2.0, 0.0, 0.0]
time_limit = 60.0
"""
ROBOT = (EXAMPLES / "my_robot.toml").read_text()
SUITE = f'name = "s"\nrobots = ["tiago"]\n[[scenario]]\n{SCENARIO.replace("[[legs]]", "[[scenario.legs]]")}'
PLAN = """name = "p"
a = [1.0, 1.0, 0.0]
b = [4.0, 1.0, 0.0]
[[walls]]
name = "south"
box = [0.0, -0.2, 5.0, 0.0]
[[walls]]
name = "north"
box = [0.0, 2.0, 5.0, 2.2]
"""
TEST_PLAN = """[test]
robot = "tiago"
[poses]
A = [0.0, 0.0, 0.0]
[robot]
markers = "robot:"
[[trial]]
note = "not recorded"
"""
KINDS = {"scenario": SCENARIO, "suite": SUITE, "robot": ROBOT, "floor plan": PLAN, "test plan": TEST_PLAN}
MAP = "image: map.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n"
CAMPAIGN: dict[str, Any] = {
    "format": "clearway results", "schema": SCHEMA, "trials": 1, "run": {},
    "plan": CampaignPlan(("hospital",), ("tiago",), selection=Selection(repetitions=1)).to_json(),
}  # fmt: skip

Attack = tuple[str, str, Callable[[Path], list[str]], tuple[int, ...]]
"""Which fault, its name, what lays out the files and gives the command line, the exit codes that are right."""
REFUSED = (1, 2)
TAKEN = (0, 1, 2)


def attacks() -> Iterator[Attack]:
    """Every attack."""
    for kind, good in KINDS.items():
        for name, text in _texts(good):
            yield f"{kind}s, as text", name, _check(text), TAKEN if name in _HARMLESS else REFUSED
    yield from (
        ("kinds of file", name, lay, REFUSED if "beside" not in name else TAKEN) for name, lay in _kinds_of_file()
    )
    yield from (("scenarios", name, _check(text), codes) for name, text, codes in _scenarios())
    yield from (("suites", name, lay, codes) for name, lay, codes in _suites())
    yield from (("robots", name, _check(text), REFUSED) for name, text in _robots())
    yield from (("floor plans", name, _check(text), codes) for name, text, codes in _plans())
    yield from (("test plans", name, _check(text), REFUSED) for name, text in _test_plans())
    yield from (("maps", name, lay, codes) for name, lay, codes in _maps())
    yield from (("campaign.json", name, lay, REFUSED) for name, lay in _campaigns())
    yield from (("command lines", " ".join(a[:60] for a in line[-6:]), _line(line), codes) for line, codes in _lines())


def warm_up() -> None:
    """Check a good file of each kind: what is compiled and imported for it is shared by all that are forked."""
    for file in (*EXAMPLES.glob("*.toml"), *PLANS.glob("*.yaml"), EXAMPLES / "06_score_recordings" / "plan.toml"):
        checks.check_file(file, load_robot("tiago"))


def measure(smoke: bool) -> list[Count]:
    """Try every attack, or one of `SMOKE`."""
    warm_up()
    counts: dict[str, Count] = {}
    for number, (fault, name, lay, codes) in enumerate(attacks()):
        if smoke and number % SMOKE:
            continue
        folder = Path(tempfile.mkdtemp(prefix="hostile-"))
        try:
            line = lay(folder)
            ended = command(*line, within=folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        right = [code for code in codes if code != 1 or line[0] == "check"]  # which lists all that it finds
        counts.setdefault(fault, Count(fault)).add(name, ended.wrong(right))
    return list(counts.values())


def _check(text: str | bytes, name: str = "it.toml") -> Callable[[Path], list[str]]:
    def lay(folder: Path) -> list[str]:
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
        return ["check", name]

    return lay


def _line(arguments: list[str]) -> Callable[[Path], list[str]]:
    return lambda folder: arguments


def _before_tables(good: str, lines: str) -> str:
    return f"{lines}\n{good}"


_HARMLESS = ("a comment of 1 MB", "a byte order mark", "Windows line ends")


def _texts(good: str) -> Iterator[tuple[str, str | bytes]]:
    """What may be wrong with any TOML file."""
    deep = 100_000
    put = _before_tables
    yield "empty", ""
    yield "NUL bytes", b"\0" * 1000
    yield "not UTF-8", good.encode() + b'x = "\xff\xfe"\n'
    yield "UTF-16", good.encode("utf-16")
    yield "a byte order mark", b"\xef\xbb\xbf" + good.encode()
    yield "Windows line ends", good.replace("\n", "\r\n")
    yield "cut in the middle of a line", good[: len(good) // 2] + '"'
    yield "nested arrays", put(good, f"x = {'[' * deep}{']' * deep}")
    yield "nested arrays without an end", put(good, f"x = {'[' * deep}")
    yield "nested inline tables", put(good, f"x = {'{a=' * deep}1{'}' * deep}")
    yield "a dotted key of 100,000 parts", put(good, f"x{'.a' * deep} = 1")
    yield "a dotted key of 900 parts", put(good, f"x{'.a' * 900} = 1")
    yield "a dotted header of 100,000 parts", f"{good}\n[x{'.a' * deep}]\n"
    yield "nested arrays of tables", good + "".join(f"\n[[x{'.a' * k}]]" for k in range(1, 600))
    yield "a number of 5,000 digits", put(good, f"x = {'9' * 5000}")
    yield "a number of 4,000 digits", put(good, f"title = {'9' * 4000}")
    yield "a hexadecimal number of 100,000 digits", put(good, f"x = 0x{'f' * 100_000}")
    yield "a decimal fraction of 100,000 digits", put(good, f"x = 0.{'9' * 100_000}")
    yield "an exponent of 10^9", put(good, "x = 1e1000000000")
    yield "an impossible date", put(good, "x = 2021-02-30")
    yield "an impossible time", put(good, "x = 2021-02-03T25:61:61")
    yield "an impossible time zone", put(good, "x = 2021-02-03T12:00:00+99:99")
    yield "a date of year 0", put(good, "x = 0000-01-01")
    yield "a key of 1 MB", put(good, f"{'k' * 1_000_000} = 1")
    yield "a text of 3 MB for the name", good.replace("name", f'title = "{"x" * 3_000_000}"\nname', 1) + "\nx = 1\n"
    yield "a million keys", "".join(f"k{n} = 1\n" for n in range(400_000)) + good
    yield "a million array elements", put(good, f"x = [{'0,' * 1_000_000}]")
    yield "a million empty arrays", put(good, f"x = [{'[],' * 1_000_000}]")
    yield "half a million tables", good + "\n[[x]]" * 500_000
    yield "a comment of 1 MB", good + "\n# " + "x" * 1_000_000
    yield "a comment of 100 MB", good.encode() + b"\n#" + b"x" * 100_000_000
    yield "a text without an end", put(good, 'x = """' + '\\"""' * 300_000)
    yield "a key twice", put(good, "x = 1\nx = 2")
    yield "a surrogate by escape", put(good, 'x = "\\ud800"')
    yield "a table for every value", good.replace("= ", "= { a = 1 } #")
    yield "a date for every value", good.replace("= ", "= 2020-01-01 #")
    yield "true for every value", good.replace("= ", "= true #")
    yield "inf for every value", good.replace("= ", "= inf #")
    yield "nan for every value", good.replace("= ", "= nan #")
    yield "an empty array for every value", good.replace("= ", "= [] #")
    yield "an empty text for every value", good.replace("= ", '= "" #')
    yield "10^18 for every value", good.replace("= ", "= 1000000000000000000 #")
    yield "a nested array for every value", good.replace("= ", "= [[[[[1]]]]] #")


def _kinds_of_file() -> Iterator[tuple[str, Callable[[Path], list[str]]]]:
    for suffix in ("toml", "yaml"):

        def fifo(folder: Path, suffix: str = suffix) -> list[str]:
            os.mkfifo(folder / f"x.{suffix}")
            return ["check", f"x.{suffix}"]

        def directory(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").mkdir()
            return ["check", f"x.{suffix}"]

        def loop(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").symlink_to(folder / f"x.{suffix}")
            return ["check", f"x.{suffix}"]

        def dangling(folder: Path, suffix: str = suffix) -> list[str]:
            (folder / f"x.{suffix}").symlink_to(folder / "nowhere")
            return ["check", f"x.{suffix}"]

        yield f"a FIFO as {suffix}", fifo
        yield f"a directory as {suffix}", directory
        yield f"a link to itself as {suffix}", loop
        yield f"a link to nothing as {suffix}", dangling
        for device in ("/dev/zero", "/dev/tty", "/dev/null", "/proc/self/mem", "/proc/kmsg"):

            def link(folder: Path, suffix: str = suffix, device: str = device) -> list[str]:
                (folder / f"x.{suffix}").symlink_to(device)
                return ["check", f"x.{suffix}"]

            yield f"{device} as {suffix}", link
        yield f"a name of 5,000 characters as {suffix}", _line(["check", f"{'x' * 5000}.{suffix}"])
        yield f"a path of 5,000 folders as {suffix}", _line(["check", f"{'x/' * 5000}y.{suffix}"])

    def test_plan(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.toml")
        return ["score", "x.toml", "--out", "out"]

    yield "a FIFO as test plan", test_plan

    def sheet(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.toml")
        return ["protocol", "x.toml"]

    yield "a FIFO as suite for a protocol", sheet

    def image(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        os.mkfifo(folder / "map.pgm")
        return ["check", "map.yaml"]

    yield "a FIFO as image", image

    def zero(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP.replace("map.pgm", "/dev/zero"))
        return ["check", "map.yaml"]

    yield "/dev/zero as image", zero

    def campaign(folder: Path) -> list[str]:
        os.mkfifo(folder / "campaign.json")
        return ["report", "."]

    yield "a FIFO as campaign.json", campaign

    def device(folder: Path) -> list[str]:
        (folder / "campaign.json").symlink_to("/dev/zero")
        return ["report", "."]

    yield "/dev/zero as campaign.json", device

    def recording(folder: Path) -> list[str]:
        os.mkfifo(folder / "x.csv")
        return ["import", "x.csv", "--list"]

    yield "a FIFO as recording", recording

    def beside(folder: Path) -> list[str]:
        (folder / "x.csv").write_text("t,x,y\n0,0,0\n1,1,1\n2,2,2\n")
        os.mkfifo(folder / "x.csv.toml")
        return ["import", "x.csv", "--list"]

    yield "a FIFO beside a recording", beside


def _obstacle(*lines: str) -> str:
    return SCENARIO + "\n[[obstacles]]\n" + "\n".join(lines) + "\n"


def _scenarios() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    disc = 'shape = { kind = "disc", radius = 0.2 }'
    for speed in ("true", '"0.5"', "nan", "-1", "0", "1e300", "1e-300", "[0.5]", "2020-01-01"):
        yield f"speed = {speed}", SCENARIO.replace("speed = 0.5", f"speed = {speed}"), REFUSED
    for limit in ("1e300", "1e12", "true", "nan", "inf", "0"):
        yield f"time_limit = {limit}", SCENARIO.replace("time_limit = 60.0", f"time_limit = {limit}"), REFUSED
    for start in ("[1e300, 0, 0]", "[1e9, 0, 0]", "[0, 0, 1e300]", "[true, false, true]", "[0, 0]", "[nan, 0, 0]"):
        yield f"start = {start}", SCENARIO.replace("start = [-2.0, 0.0, 0.0]", f"start = {start}"), REFUSED
    for seed in ("-1", "1.5", "true", "9223372036854775808", "18446744073709551616", '"7"'):
        yield f"seed = {seed}", _before_tables(SCENARIO, f"seed = {seed}"), REFUSED
    for field in ("placement_xy", "placement_yaw", "reference_length", "shortest"):
        yield f"{field} = 1e300", _before_tables(SCENARIO, f"{field} = 1e300"), REFUSED
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
    return name, _check(text), REFUSED


def _suites() -> Iterator[tuple[str, Callable[[Path], list[str]], tuple[int, ...]]]:
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
        _check(f"{top}repetitions = 1000\nspeeds = [{speeds}]\n{inside}"),
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
    yield "10,000 scenarios", _check(top + thousand), TAKEN
    yield _suite_with("the same name twice", top + inside + inside)


def _robots() -> Iterator[tuple[str, str]]:
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


def _plans() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    def put(old: str, new: str) -> str:
        assert old in PLAN, old
        return PLAN.replace(old, new, 1)

    yield "a grid of 10^9 cells", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 5000.0, 1000.0]"), REFUSED
    yield "a plan of 10^9 m", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 1e9, 1e9]"), REFUSED
    yield "a plan of 10^300 m", put("box = [0.0, 2.0, 5.0, 2.2]", "box = [0.0, 2.0, 1e300, 1e300]"), REFUSED
    yield "a resolution of 10^-9 m", _before_tables(PLAN, "resolution = 1e-9"), REFUSED
    yield "5 mm over 300 m", _before_tables(put("5.0, 2.2]", "300.0, 300.0]"), "resolution = 0.005"), REFUSED
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
    yield "a clear area of 10^300 m", _before_tables(PLAN, "clear = [-1e300, -1e300, 1e300, 1e300]"), REFUSED
    for name in ("/dev/zero", "x\\u0000", "x" * 5000, ".", "it.toml", "nowhere.yaml"):
        yield f"the map {name[:20]}", _before_tables(PLAN, f'map = "{name}"'), REFUSED
    yield (
        "furniture of 10^9 m",
        PLAN + '[[furniture]]\nname = "x"\nshape = { kind = "disc", radius = 1e9 }\npose = [0, 0, 0]\n',
        REFUSED,
    )
    yield "a million beds", PLAN + '[[rooms]]\nname = "r"\nbeds = true\nfloor = [[0, 0, 1, 1]]\n', REFUSED
    yield "a wall of true", PLAN + '[[walls]]\nname = "x"\nbox = [false, false, true, true]\n', REFUSED


def _test_plans() -> Iterator[tuple[str, str]]:
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
    yield "sources that are a number", _before_tables(TEST_PLAN, "sources = 3")
    yield (
        "a frame tied by itself",
        TEST_PLAN
        + '[sources.a.frame]\nstatic_poses = [{ file = "it.toml", pose = "A" }]\n[[trial]]\nfile = "it.toml"\n',
    )


def _map(yaml: str, image: bytes | None = b"P5\n4 4\n255\n" + b"\xfe" * 16) -> Callable[[Path], list[str]]:
    def lay(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(yaml)
        if image is not None:
            (folder / "map.pgm").write_bytes(image)
        return ["check", "map.yaml"]

    return lay


def _maps() -> Iterator[tuple[str, Callable[[Path], list[str]], tuple[int, ...]]]:
    bomb = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
        f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(12)
    )
    for name, text in (
        ("anchors in anchors", bomb + MAP),
        ("anchors in anchors as origin", bomb + MAP.replace("[0.0, 0.0, 0.0]", "*m")),
        ("anchors in anchors as resolution", bomb + MAP.replace("resolution: 0.05", "resolution: *m")),
        ("anchors in anchors as image", bomb + MAP.replace("map.pgm", "*m")),
        ("anchors in anchors as mode", bomb + MAP + "mode: *m\n"),
        ("an anchor within itself", "a: &a [*a]\n" + MAP + "mode: *a\n"),
        ("merged maps", "a: &a {x: 1}\n<<: *a\n" + MAP),
        ("nested arrays", f"x: {'[' * 50_000}\n{MAP}"),
        ("closed nested arrays", f"x: {'[' * 5_000}{']' * 5_000}\n{MAP}"),
        ("nested maps", f"x: {'{a: ' * 5_000}1{'}' * 5_000}\n{MAP}"),
        ("nested blocks", "".join(f"{' ' * k}a:\n" for k in range(1000)) + " " * 1000 + "1\n"),
        ("nested lists in blocks", "- " * 20_000 + "1"),
        ("100 MB", MAP + "#" + "x" * 100_000_000),
        ("300,000 entries", MAP + "x: [" + "0," * 300_000 + "]\n"),
        ("20,000 entries in a flow", MAP + "x: {" + "".join(f"a{k}: 0, " for k in range(20_000)) + "}\n"),
        ("a text of 1 MB as mode", MAP + f'mode: "{"x" * 1_000_000}"\n'),
        ("a text of 1 MB as resolution", MAP.replace("0.05", f'"{"x" * 1_000_000}"')),
        ("an origin of 100,000 numbers", MAP.replace("[0.0, 0.0, 0.0]", f"[{'0,' * 100_000}0]")),
        ("a number of 5,000 digits", MAP.replace("0.05", "9" * 5000)),
        ("a number of 4,000 digits", MAP.replace("0.05", "9" * 4000)),
        ("a hexadecimal number of 50,000 digits", MAP.replace("0.05", "0x" + "f" * 50_000)),
        ("a number of base 60 without an end", MAP.replace("0.05", "1" + ":59" * 20_000)),
        ("an impossible date", MAP.replace("0.05", "2021-02-30")),
        ("a Python object", MAP + "mode: !!python/object/apply:os.system ['true']\n"),
        ("a set", MAP + "mode: !!set {a, b}\n"),
        ("binary", MAP + "mode: !!binary AAAA\n"),
        ("a broken tag", MAP + "mode: !<tag:x,2000:y> z\n"),
        ("a directive", "%YAML 9.9\n---\n" + MAP),
        ("two documents", MAP + "---\n" + MAP),
        ("NUL", MAP + "mode: '\0'\n"),
        ("control characters", MAP + "mode: '\x1b[31m'\n"),
        ("true as resolution", MAP.replace("0.05", "true")),
        ("nan as resolution", MAP.replace("0.05", ".nan")),
        ("10^-300 as resolution", MAP.replace("0.05", "1e-300")),
        ("10^300 as resolution", MAP.replace("0.05", "1.0e+300")),
        ("10^300 as origin", MAP.replace("[0.0, 0.0", "[1.0e+300, 0.0")),
        ("a list as key", MAP + "? [a, b]\n: 1\n"),
        ("a list instead of a table", "- 1\n- 2\n"),
        ("nothing", ""),
        ("its own yaml as image", MAP.replace("map.pgm", "map.yaml")),
        ("a folder as image", MAP.replace("map.pgm", ".")),
        ("a name of 5,000 letters as image", MAP.replace("map.pgm", "x" * 5000)),
        ("a name with NUL as image", MAP.replace("map.pgm", '"x\\0y"')),
        ("a number as image", MAP.replace("map.pgm", "7")),
        ("tabs", MAP.replace(": ", ":\t\t")),
        ("a quoted text without an end", MAP + 'mode: "' + "\\" * 100_001),
        ("a billion blanks of indentation", "x:\n" + " " * 3_000_000 + "y"),
    ):
        yield name, _map(text), TAKEN if name in ("tabs", "a billion blanks of indentation") else REFUSED
    for name, image in (
        ("38 bytes of comments", b"P5" + b"#\n" * 18),
        ("1 MB of blanks", b"P5" + b" \n" * 500_000),
        ("1 MB of comments", b"P5" + b"#\n" * 500_000 + b"4"),
        ("comments and blanks in turn", b"P5 " + b" # \n \n" * 30_000 + b"x"),
        ("10^9 cells", b"P5\n100000 100000\n255\n" + b"\xfe" * 100),
        ("10^18 cells", b"P5\n1000000000 1000000000\n255\n"),
        ("5,000 digits", b"P5\n" + b"9" * 5000 + b" 4\n255\n"),
        ("no cells", b"P5\n0 0\n255\n"),
        ("a maximum of 0", b"P5\n4 4\n0\n" + b"\0" * 16),
        ("a maximum of 10^9", b"P5\n4 4\n1000000000\n" + b"\0" * 16),
        ("negative size", b"P5\n-4 -4\n255\n" + b"\0" * 16),
        ("another kind of image", b"P6\n4 4\n255\n" + b"\0" * 48),
        ("cut short", b"P5\n4 4\n255\n" + b"\0" * 15),
        ("a header only", b"P5"),
        ("nothing", b""),
        ("plain, 10^9 cells", b"P2\n100000 100000\n255\n" + b"0 " * 100),
        ("plain, words of 10,000 digits", b"P2\n2 2\n255\n" + (b"9" * 10_000 + b" ") * 4),
        ("plain, words that are none", b"P2\n2 2\n255\n1 x 3 4"),
        ("plain, 1 MB of hashes", b"P2\n2 2\n255\n" + b"#" * 1_000_000),
        ("plain, superscripts", b"P2\n2 2\n255\n\xb2 1 1 1"),
        ("a row of 10^6 cells, each second a wall", b"P5\n1000000 1\n255\n" + b"\x00\xfe" * 500_000),
        ("a board of 10^6 cells", b"P5\n1000 1000\n255\n" + (b"\x00\xfe" * 500 + b"\xfe\x00" * 500) * 500),
        ("16 bit, above its maximum", b"P5\n2 2\n300\n" + b"\xff" * 8),
    ):
        yield name, _map(MAP, image), REFUSED

    def huge(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        with open(folder / "map.pgm", "wb") as f:
            f.write(b"P5\n20000 20000\n255\n")
            f.truncate(400_000_000)
        return ["check", "map.yaml"]

    yield "an image of 400 MB", huge, REFUSED

    def largest(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        (folder / "map.pgm").write_bytes(b"P5\n3000 3000\n255\n" + b"\xfe" * 9_000_000)
        return ["check", "map.yaml"]

    yield "an honest image of 9 million cells", largest, (0,)

    def plain(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        (folder / "map.pgm").write_bytes(b"P2\n2000 2000\n255\n" + b"254 " * 4_000_000)
        return ["check", "map.yaml"]

    yield "an honest plain image of 4 million cells", plain, (0,)


_WRONG_IN_PLANS: tuple[tuple[str, Any], ...] = (
    ("selection.repetitions", 10**9), ("selection.repetitions", "x"), ("selection.repetitions", True),
    ("selection.speeds", ["x"]), ("selection.speeds", [0.6] * 100_000), ("selection.speeds", [k * 1e-6 for k in range(100_000)]),
    ("selection.seeds", [0, 10**12]), ("selection.seeds", ["a", "b"]), ("selection.seeds", [1]), ("selection.scenarios", [3]),
    ("selection.batches", [{}]), ("selection.worlds", ["a"]), ("selection.disturbance", "x"), ("selection.floor_plan", 3),
    ("selection", None), ("robots", [3]), ("robots", [f"r{k}" for k in range(100_000)]), ("navigators", [["a"]]),
    ("navigators", ["hp-st[without=" + "x" * 100_000 + "]"]), ("setups", [3]), ("suites", ["x" * 100_000]), ("options", [1]),
    ("options", {"move-base": 3}), ("seed", "x"), ("decision_limit", "x"), ("localisation", 7), ("tracking", [1]), ("map", 3),
)  # fmt: skip


def _campaigns() -> Iterator[tuple[str, Callable[[Path], list[str]]]]:
    good = json.dumps(CAMPAIGN)
    texts: dict[str, str | bytes] = {
        "nested arrays": good[:-1] + ', "x": ' + "[" * 200_000 + "]" * 200_000 + "}",
        "nested arrays without an end": "[" * 1_000_000,
        "nested objects": '{"a":' * 100_000 + "1" + "}" * 100_000,
        "a number of 5,000 digits": good.replace(": 1,", f": {'9' * 5000},"),
        "10^18 trials": good.replace('"trials": 1', '"trials": 1000000000000000000'),
        "-1 trials": good.replace('"trials": 1', '"trials": -1'),
        "true as trials": good.replace('"trials": 1', '"trials": true'),
        "true as schema": good.replace(f'"schema": {SCHEMA}', '"schema": true'),
        "NaN": good.replace('"trials": 1', '"trials": NaN'),
        "not UTF-8": b'{"format": "\xff"}',
        "100 MB": good.encode() + b" " * 100_000_000,
        "20 million arrays": b'{"x": [' + b"[]," * 20_000_000 + b"0]}",
        "a plan of numbers": json.dumps(CAMPAIGN | {"plan": {"suites": 5, "selection": 5}}),
        "a plan of deep options": good.replace('["hospital"]', "[[[[]]]]"),
        "95 MB of one text": good[:-1] + ', "x": "' + "x" * (95 << 20) + '\U0001f600"}',
        "95 MB of one text of two bytes each": good[:-1] + ', "x": "' + "x" * (95 << 20) + '\u2028"}',
        "20 MB of escapes": good[:-1] + ', "x": "' + '\\"' * (10 << 20) + '\U0001f600"}',
        "95 MB of escapes": good[:-1] + ', "x": "' + '\\"' * (47 << 20) + '\u2028"}',
        "a million long keys": good[:-1]
        + ', "x": {'
        + ",".join(f'"{"k" * 80}{n}": 1' for n in range(1_000_000))
        + "}}",
        "a list": "[]",
        "a run that is a list": good.replace('"run": {}', '"run": [1]'),
        "nothing": "",
        "a surrogate": good.replace("results", "\\ud800"),
    }
    for field, value in _WRONG_IN_PLANS:
        plan = json.loads(json.dumps(CAMPAIGN["plan"]))
        table, _, key = field.rpartition(".")
        (plan[table] if table else plan)[key] = value
        texts[f"{field} = {str(value)[:20]}"] = json.dumps(CAMPAIGN | {"plan": plan})
    for name, text in texts.items():
        for verb in (["report", "."], ["run", "--resume", "."], ["rerun", ".", "--trial", "0"]):

            def lay(folder: Path, text: str | bytes = text, verb: list[str] = verb) -> list[str]:
                (folder / "campaign.json").write_bytes(text if isinstance(text, bytes) else text.encode())
                (folder / ".partial").mkdir()
                return verb

            yield f"{name}, {verb[0]}", lay


def _lines() -> Iterator[tuple[list[str], tuple[int, ...]]]:
    run = [
        "run",
        "hospital",
        "--robot",
        "tiago",
        "--batch",
        "NO",
        "--speed",
        "0.6",
        "--no-report",
        "--workers",
        "1",
        "--out",
        "out",
    ]
    one = [*run, "--repetitions", "1"]
    for value in ("1000000000", "9223372036854775807", "-1", "0", "nan", "1e9", "9" * 5000):
        yield [*run, "--repetitions", value], REFUSED
    for value in ("nan", "-1", "0", "inf", "1e300", "-inf", "x"):
        yield [*one, "--decision-limit", value], REFUSED
        yield [*one, "--budget", value], REFUSED
    for value in (
        "nan",
        "1e300s",
        "0s",
        "-1s",
        "1e9iterations",
        "9" * 5000 + "s",
        "inf s",
        "",
        "1.5iterations",
        "0iterations",
    ):
        yield [*one, "--setup", value], REFUSED
    drawn = ["run", "sar-case1", "--no-report", "--workers", "1", "--out", "out"]
    for value in (
        "0:1000000000000",
        "0:100000000",
        "5:1",
        "-1:5",
        "0:" + "9" * 5000,
        "a:b",
        "0:1:2",
        "\u0661:\u0665",
        "",
        ":",
        "9223372036854775807:9223372036854775809",
        "²:³",
    ):
        yield [*drawn, "--seeds", value], REFUSED
    for value in ("nan", "inf", "-1", "1e300"):
        yield [*drawn, "--disturbance", value], REFUSED
    for value in ("nan", "inf", "-0.5", "1e300"):
        yield [*run, "--speed", value], REFUSED
        yield ["run", "hospital", "--robot", "tiago", "--size", value, "--no-report", "--out", "out"], REFUSED
    for value in ("9223372036854775808", "-1", "1e3", "9" * 5000):
        yield [*one, "--seed", value], REFUSED
    for name in (
        "",
        "x" * 100_000,
        "a\nb",
        "../../etc/passwd",
        "/dev/zero",
        ".toml",
        "x.toml",
        "hospital:",
        "\x1b[31m",
        "/",
        ".",
    ):
        yield ["run", name, "--no-report", "--out", "out"], REFUSED
        yield [*one, "--robot", name], REFUSED
        yield [*one, "--navigator", name], REFUSED
        yield [*one, "--floor-plan", name], REFUSED
        yield [*one, "--map", name], REFUSED
        yield ["check", name], REFUSED
        yield ["report", name], REFUSED if name not in ("",) else TAKEN
        yield ["score", name, "--out", "out"], REFUSED
        yield ["map", name, "--out", "out"], REFUSED
    long = "x" * 5000
    for line in (
        [*one[:-3], long], ["map", "hall", "--out", long], ["import", "x.csv", "--out", long], ["protocol", "hospital", "--out", long],
        ["score", "x.toml", "--out", long], ["run", long], ["map", "hall", "--out", "/proc/x"], ["protocol", "hospital", "--out", "/proc/x"],
    ):  # fmt: skip
        yield line, REFUSED
    yield [*one, "--navigator", "hp-st", "--without", "+".join(["reverse"] * 10_000)], REFUSED
    for name in (
        "hp-st[",
        "hp-st[]",
        "hp-st[x]",
        "hp-st[" + "a=[" * 10_000 + "]",
        "hp-st[x=" + "[" * 100_000 + "]",
        "hp-st[x=" + "9" * 5000 + "]",
        "hp-st[x=NaN]",
        "hp-st" + "[a=1]" * 5000,
        "os:system",
        "builtins:exit",
        "json:loads",
        ":",
        "a:",
        ":b",
        "x.py:Y",
        "..:x",
        "hp-st[without=" + "x" * 10_000 + "]",
    ):
        yield [*one, "--navigator", name], REFUSED
    for verb in (
        ["rerun", ".", "--trial", "0"],
        ["replay", ".", "--trial", "0"],
        ["export", ".", "--trial", "0", "--to", "csv", "--out", "x"],
        ["compare", ".", "."],
        ["report", "."],
        ["run", "--resume", "."],
    ):
        yield verb, REFUSED
    yield ["run", "hospital", "--out", "out", "--workers", "1000000000"], REFUSED
    yield [*one, "--workers", "-1"], REFUSED
    for reliability in ("nan", "1", "0", "-1", "inf", "0.9999999999999999", "1e-300"):
        yield ["samples", "--reliability", reliability], TAKEN if reliability == "1e-300" else REFUSED
        yield (
            ["samples", "--confidence", reliability],
            TAKEN if reliability in ("0.9999999999999999", "1e-300") else REFUSED,
        )
    yield ["samples", "--failures", "1000000000"], REFUSED
    yield ["samples", "--failures", "9" * 5000], REFUSED
    yield ["schema", "x" * 10_000], REFUSED
    yield ["list", "x" * 10_000], REFUSED
    yield ["import", "x" * 5000, "--list"], REFUSED
    yield ["import", "/dev/zero", "--list"], REFUSED
    yield ["import", "/dev/zero", "--out", "out"], REFUSED
    yield ["import", ".", "--list"], REFUSED
    yield ["protocol", "hospital", "--repetitions", "1000000000"], REFUSED
    yield ["protocol", "hospital", "--out", "/dev/full"], REFUSED
    yield ["map", "hall", "--seed", "9223372036854775808"], REFUSED
    yield ["barn", "x"], REFUSED
    yield ["run", "barn", "--worlds", "999999999999999999999", "--out", "out"], REFUSED
    yield ["run", "barn", "--worlds", "-2", "--out", "out"], REFUSED

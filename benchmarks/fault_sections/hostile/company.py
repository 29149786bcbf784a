"""Hostile company in a scenario: people, their tracks in CSV files, other robots, latency, who drives an obstacle; and suites of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from fault_sections.hostile.good import REFUSED, SCENARIO, SUITE, TAKEN, before_tables

RECORDED = SCENARIO + '[[people]]\nname = "p"\nbehaviour = "recorded"\ntrack = "walk.csv"\n'
DISC = 'name = "o"\nshape = { kind = "disc", radius = 0.2 }\nruns = [{ leg = "there", path = [[0, 1], [1, 1]], speed = 1 }]\n'
FIELDS = {
    "radius": ("1e9", "nan", "0", "true"),
    "speed": ("1e300", "nan", "0", "-1", "true"),
    "reaction": ("nan", "-1", "1e9"),
    "loop": ("3",),
    "group": ('"' + "g" * 20_000 + '"', "true"),
    "route": ("[{ at = [1e7, 1] }]", "[{ at = [nan, 1] }]", "[{ at = [1, 1], wait = 1e9 }]", "[" + "{ at = [1, 1] }," * 101 + "]"),
    "behaviour": (
        '""', '"nobody"', '":"', '"a:"', '":b"', '"x.py:Y"', '"../x.py:Y"', '"..:x"', '"/dev/zero:x"', '"/dev/zero.py:x"',
        '"it.toml:Y"', '"os:name"', '"a\\u0000:b"', '"' + "x" * 9_000 + ':y"',
    ),
}  # fmt: skip
"""What is wrong with one who walks by social forces."""
TRACKS = (
    "true", '"it.toml"', '"/dev/zero"', '"."', '""', '"\\u0000"', '"none.csv"', "[]", "[[0, 0, 0]]", "[[nan, 0, 0], [1, 0, 0]]",
    "[[0, 0, 0], [0, 1, 0]]", "[[0, 0, 0], [1e-300, 1e9, 0]]", "[" + "[0, 0, 0]," * 20_000 + "]",
)  # fmt: skip
FILES: dict[str, bytes] = {
    "empty": b"",
    "without a column": b"a,b\n1,2\n",
    "with a column twice": b"t,x,y,x\n0,0,0,0\n1,0,0,0\n",
    "of words": b"t,x,y\na,b,c\n",
    "of NaN": b"t,x,y\nnan,0,0\n1,0,0\n",
    "of infinity": b"t,x,y\n0,0,1\n1,inf,0\n",
    "of one row": b"t,x,y\n0,0,1\n",
    "of short rows": b"t,x,y\n0\n1\n",
    "with NUL": b"t,x,y\n0,0,\0\n",
    "with a quotation that never ends": b't,x,y\n"' + b"0,0,0\n" * 9_000,
    "of quotation marks": b"t,x,y\n" + b'"' * 200_001,
    "with a long number": b"t,x,y\n" + b"9" * 5_000 + b",0,0\n1,0,0\n",
    "of 20,000 rows": b"t,x,y\n" + b"".join(b"%d,0,0\n" % k for k in range(20_000)),
    "of 5,000,000 rows": b"t,x,y\n" + b"1\n" * 5_000_000,
    "of 9,000,000 columns": b"t,x,y\n" + b"," * 9_000_000,
    "with 2,000,000 names": b"t,x,y" + b",c" * 2_000_000 + b"\n0,0,0\n" + b"0,1,0\n" * 1_000,
    "of 14 MB": b"t,x,y\n" + b"0,0,0\n" * 2_400_000,
    "that is no text": b"\xff\xfe\0",
}
"""What may be wrong with the file of a track."""
ROBOTS = {
    "robot": ('""', '"nobody"', '"it.toml"', '"/dev/zero.toml"', '"\\u0000.toml"', '"tiago:' + "x" * 10_000 + '"', "true"),
    "navigator": ('""', '"nobody"', '":"', '"x.py:Y"'),
    "role": ('"x"', "true"),
    "start": ("[1e7, 0, 0]", "[nan, 0, 0]", "[0, 0, 1e9]"),
    "legs": ("[]", "[{}]", "3"),
}  # fmt: skip
OPERATOR = {
    "reaction": ("nan", "3"), "stop_short": ("nan", "-1", "1e9"), "foresight": ("nan", "1e9"), "line_keeping": ("nan", "2"),
    "patience": ("0", "nan", "1e300"), "backing": ("0", "nan"), "acceleration": ("0", "nan"), "kind": ('"x"',), "none": ("1",),
}  # fmt: skip


def hostile_company() -> Iterator[tuple[str, Callable[[Path], list[str]], tuple[int, ...]]]:
    for name, text, codes in _people():
        yield name, _laid(text), codes
    for name, text, codes in _robots():
        yield name, _laid(text), codes
    for what, content in FILES.items():
        yield f"a track {what}", _laid(RECORDED, content), REFUSED
    long = b"t,x,y\n" + b"".join(b"%.1f,%.3f,1\n" % (0.1 * k, 0.001 * (k % 100)) for k in range(10_000))
    yield (
        "500 people with tracks of 10,000 rows",
        _laid(_many(500, 'behaviour = "recorded"\ntrack = "walk.csv"'), long),
        REFUSED,
    )
    one = '[[scenario.people]]\nname = "p{}"\nbehaviour = "recorded"\ntrack = "walk.csv"\n'
    suite = "".join(SUITE.replace('"t"', f'"t{k}"') if k == 0 else _scenario(k) + one.format(0) for k in range(1_000))
    yield "1,000 scenarios with a track of 10,000 rows each", _laid(suite, long), REFUSED


def _laid(text: str, track: bytes = b"") -> Callable[[Path], list[str]]:
    def lay(folder: Path) -> list[str]:
        (folder / "it.toml").write_text(text)
        (folder / "walk.csv").write_bytes(track)
        return ["check", "it.toml"]

    return lay


def _scenario(number: int) -> str:
    return f"[[scenario]]\n{SCENARIO}".replace("[[legs]]", "[[scenario.legs]]").replace('"t"', f'"t{number}"')


def _many(count: int, what: str) -> str:
    people = (f'[[people]]\nname = "p{k}"\n{what}\n' for k in range(count))
    return SCENARIO + "".join(people)


def _people() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    person = SCENARIO + '[[people]]\nname = "p"\nstart = [0.0, 1.0]\n'
    for place in ("1e7", "-1e7", "1e300", "nan", "inf", "true"):
        yield f"somebody at {place}", person.replace("[0.0,", f"[{place},"), REFUSED
    for field, values in FIELDS.items():
        for value in values:
            yield f"somebody whose {field} = {value[:20]}", f"{person}{field} = {value}\n", REFUSED
    for value in ("nan", "1e9", "-1"):
        yield f"somebody who yields_at = {value}", f'{person}behaviour = "still"\nyields_at = {value}\n', REFUSED
    for value in TRACKS:
        text = f'{person}behaviour = "recorded"\ntrack = {value}\n'
        yield f"somebody whose track = {value[:20]}", text, REFUSED
    yield "500 people on a heap", _many(500, "start = [0, 1]"), REFUSED
    yield "40,000 people", _many(40_000, "start = [0, 1]"), REFUSED
    places = "".join(f"{{ at = [{0.1 * (7 * k % 40) - 2:.1f}, {0.1 * (3 * k % 30) - 1.5:.1f}] }}," for k in range(70))
    apart = (
        f'[[people]]\nname = "p{k}"\nstart = [{-2 + 0.08 * (k % 50):.2f}, {0.5 + 0.3 * (k // 50):.2f}]\n'
        for k in range(500)
    )
    yield (
        "500 people of 70 stops each",
        SCENARIO + "".join(f"{one}radius = 0.1\nroute = [{places}]\n" for one in apart),
        TAKEN,
    )
    for value in ("nan", "inf", "-1", "1e300", "true", "101"):
        yield f"latency = {value}", before_tables(SCENARIO, f"latency = {value}"), REFUSED
    for value in ('["x"]', '"all"', "[1]", "[" + '"bias",' * 50_000 + "3]"):
        yield f"ideal = {value[:20]}", before_tables(SCENARIO, f"ideal = {value}"), REFUSED
    for field, values in OPERATOR.items():
        for value in values:
            text = f"{SCENARIO}[[obstacles]]\n{DISC}behaviour = {{ {field} = {value} }}\n"
            yield f"an operator whose {field} = {value}", text, REFUSED


def _robots() -> Iterator[tuple[str, str, tuple[int, ...]]]:
    good = {"start": "[2.0, 1.0, 3.1]", "legs": '[{ name = "a", goal = [-2.0, 1.0, 0.0], time_limit = 60.0 }]'}
    for field, values in ROBOTS.items():
        for value in values:
            role = {"role": '"other"'} if field == "navigator" else {}
            lines = "".join(f"{name} = {what}\n" for name, what in {**good, **role, field: value}.items())
            yield f"a robot whose {field} = {value[:20]}", f'{SCENARIO}[[robots]]\nname = "r"\n{lines}', REFUSED
    lines = "".join(f"{name} = {what}\n" for name, what in good.items())
    yield "a robot with the name of the first", f'{SCENARIO}[[robots]]\nname = "robot 1"\n{lines}', REFUSED
    yield "a robot without a name", before_tables(SCENARIO, 'member = ""'), REFUSED
    for count in (100, 101):
        robots = (f'[[robots]]\nname = "r{k}"\n{lines}' for k in range(count))
        yield f"{count} robots on a heap", SCENARIO + "".join(robots), REFUSED
    legs = "".join(f'{{ name = "l{k}", goal = [0, 0, 0], time_limit = 60 }},' for k in range(300))
    many = (
        f'[[robots]]\nname = "r{k}"\nstart = [{0.9 * (k % 10) - 4:.1f}, {0.6 * (k // 10) - 3:.1f}, 0]\nlegs = [{legs}]\n'
        for k in range(100)
    )
    yield "100 robots of 300 legs", SCENARIO + "".join(many), REFUSED

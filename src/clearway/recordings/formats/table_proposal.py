"""A first guess at what the columns of a plain table are, from their names and first values; for people to correct."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from clearway.recordings.formats.delimited import MISSING, Dialect, is_number, split
from clearway.recordings.formats.table_spec import METRES
from clearway.recordings.times import SECONDS

NOTHING = "none of them look like a time, an x and a y, so nothing is proposed"

_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))
"""A stamp beyond it is UNIX time in this unit: seconds have been 1e9 since 2001."""


_TURN = 6.3
"""A heading beyond it is in degrees; of the first lines, in which nobody turns twice."""
_SLOWEST = 2.0
"""Whole stamps that are as far apart are in milliseconds: nobody samples so slowly."""


def rows_of(lines: Sequence[str], dialect: Dialect, width: int) -> list[list[str]]:
    """The words of a table's first lines of data."""
    body = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    rows = [split(line, dialect.separator) for line in body[dialect.header == "line" :]]
    return [row for row in rows if len(row) == width]


def proposal(columns: Sequence[str], rows: Sequence[Sequence[str]], dialect: Dialect) -> str:
    """A description (`TableSpec` in TOML); empty, where no columns of numbers look like a time, an x and a y.

    Args:
        columns: Their names, "1", "2", ... where the table has none.
        rows: The first lines of data.
    """
    values = {c: [row[i] for row in rows if row[i] not in MISSING] for i, c in enumerate(columns)}
    numbers = [c for c in columns if values[c] and all(is_number(w, dialect.decimal) for w in values[c])]
    dates = [c for c in columns if values[c] and all(re.match(r"\d{4}-\d\d-\d\d[T ]\d\d:", w) for w in values[c])]
    named = dialect.header != "none"

    def like(*words: str, among: Sequence[str] = columns) -> str | None:
        for word in words:
            for c in among:
                plain = c.strip().lower()
                if plain == word or plain.startswith(tuple(word + end for end in " _[(")):
                    return c
        return None

    when = like("time", "t", "timestamp", "stamp", "date", "frame", among=[*numbers, *dates])
    if when is None and columns and columns[0] in {*numbers, *dates}:
        when = columns[0]
    pair = _pair(numbers, when, named)
    if when is None or pair is None:
        return ""
    x, y = pair
    who = like("id", "agent", "body", "name", "person") if named else None
    lines = [
        f"separator = {quoted(dialect.separator)}",
        f"decimal = {quoted(dialect.decimal)}",
        f'header = "{dialect.header}"',
        f'units = "{_unit(x, METRES) or "m"}"  # or mm, cm',
        'up = "z"',
        *([f"id = {quoted(who)}"] if who else []),
        "",
        "[time]",
        f"column = {quoted(when)}",
        *_time(when, when in dates, values[when], dialect),
        "",
        f"[bodies.{'each' if who else 'robot'}]",
        f"x = {quoted(x)}",
        f"y = {quoted(y)}",
    ]
    if four := quaternion_of(x, numbers, alone=True):
        lines.append(f"quaternion = [{', '.join(map(quoted, four))}]  # x, y, z, w")
    elif yaw := like("yaw", "theta", "heading", "psi", among=numbers):
        farthest = max(abs(float(w.replace(dialect.decimal, ".", 1))) for w in values[yaw])
        degrees = re.search(r"deg|\N{DEGREE SIGN}", yaw.lower()) is not None or farthest > _TURN
        lines += [f"yaw = {quoted(yaw)}", 'angle = "deg"  # or rad' if degrees else 'angle = "rad"  # or deg']
    return "\n".join(lines) + "\n"


def _pair(numbers: Sequence[str], when: str | None, named: bool) -> tuple[str, str] | None:
    """Columns whose names differ as x and y do; of nameless ones the first two behind the time."""
    if not named:
        rest = [c for c in numbers if c != when]
        return (rest[0], rest[1]) if len(rest) > 1 else None
    for c in numbers:
        for k, letter in enumerate(c):
            if letter not in "xX":
                continue
            other, fourth = (c[:k] + chr(ord(letter) + n) + c[k + 1 :] for n in (1, -1))
            if other in numbers and fourth not in numbers and when not in (c, other):  # with a w it is a quaternion
                return c, other
    return None


def quaternion_of(x: str, columns: Sequence[str], *, alone: bool) -> tuple[str, str, str, str] | None:
    """The columns of the quaternion (x, y, z, w) that belong to a position's column `x` by their names: `qx` to `qw` beside `x`,
    `cart_qx` beside `cart_x`, `pose.orientation.x` beside `pose.position.x`; None where there are none.

    Args:
        alone: Whether nothing else is in the table, so that names without a prefix are its.
    """
    known = {_bare(c): c for c in reversed(columns)}
    stem = _bare(x)[:-1] if _bare(x).endswith("x") else _bare(x)
    own = [stem + q for q in ("q", "q_", "quat_")]
    for place, turn in (("position", "orientation"), ("pos", "quat"), ("pos", "ori"), ("pos", "rot"), ("pos", "q")):
        own += [stem.replace(place, turn)] if place in stem else []
    own += [stem[:-1] + "q"] if stem.endswith("t") else []  # tx, ty, tz
    bare = ["q", "q_", "quat_", "orientation_", "orientation.", "rot_"] if alone else []
    for q in dict.fromkeys([*own, *bare]):
        if q != stem and all(q + a in known for a in "xyzw"):
            a, b, c, d = (known[q + axis] for axis in "xyzw")
            return a, b, c, d
    return None


def _bare(column: str) -> str:
    """A column's name in lower case, without a unit in brackets."""
    return re.sub(r"\s*[\[(].*$", "", column.strip().lower())


def _time(column: str, date: bool, values: Sequence[str], dialect: Dialect) -> list[str]:
    if date:
        return ['unit = "date"']
    if column.strip().lower().startswith("frame"):
        return ['unit = "frame"', "rate = 100  # frames a second"]
    stamps = [float(w.replace(dialect.decimal, ".", 1)) for w in values]
    by_size = next((unit for least, unit in _EPOCHS if abs(stamps[0]) > least), "s")
    steps = sorted(b - a for a, b in pairwise(stamps))
    if by_size == "s" and steps and steps[len(steps) // 2] >= _SLOWEST and all(x.is_integer() for x in stamps):
        by_size = "ms"
    return [f'unit = "{_unit(column, SECONDS) or by_size}"  # or ms, us, ns, date; frame with rate = 100']


def _unit(column: str, known: dict[str, float]) -> str | None:
    """The unit at the end of a column's name: x_mm, time (ms), x [m]."""
    found = re.search(r"[\s_.\[(]([a-z]+)[\])]?\s*$", column, re.IGNORECASE)
    return found[1].lower() if found and found[1].lower() in known else None


def quoted(text: str) -> str:
    """A text as TOML writes it."""
    escaped = "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c) & 0xFFFF:04x}" for c in text)
    return f'"{escaped}"'

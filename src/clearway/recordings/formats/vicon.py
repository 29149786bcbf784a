"""Vicon Nexus' CSV (and Tracker's, which is alike): blocks of a title, a rate, names, columns, units and numbers.

    Trajectories
    100
    ,,robot:m1,,,robot:m2,,
    Frame,Sub Frame,X,Y,Z,X,Y,Z
    ,,mm,mm,mm,mm,mm,mm
    1,0,44.1628,-276.862,675.697,32.5723,-243.141,676.575

Frame 1 is t = 0. Blocks end at an empty line; those other than `Trajectories`
(markers), `Segments` and `Objects` (bodies), such as `Devices`, are passed over. Separators are `,`, `;` or tabs, numbers
may have decimal commas. An empty cell is a marker that wasn't seen.

Workstation's and iQ's older text is read as well: `TRAJECTORIES`, a rate with its unit (`120,Hz`), `Field #` for
`Frame,Sub Frame`, and no line of units: lengths are millimetres then, as these programs always had them.

RX, RY, RZ of a body are, as the exporting dialogue was set, a rotation vector or Euler angles, and no header says which.
So a heading is given only where all readings of them agree on it: while the body stands nearly upright. RX, RY, RZ, RW
is a quaternion.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.capture import Body, Layout, frames_of, text_format, to_file
from clearway.recordings.formats.capture_fields import rate_of, unique, unit, xyzw
from clearway.recordings.formats.text import (
    Block,
    Lines,
    cells,
    head_text,
    number,
    pass_over,
    write_rows,
    writing,
)
from clearway.recordings.recording import Recording

MARKERS, BODIES = ("trajectories",), ("segments", "objects")
AGREE = 0.01
"""rad; how closely the readings of a body's angles have to agree on its heading."""

_TITLES = (*MARKERS, *BODIES, "devices", "model outputs", "events", "joints", "global angle", "analog", "force plates")
_COUNTED = ("frame", "field #", "field")
_MOST_EMPTY = 100


def sniff(path: Path, head: bytes) -> bool:
    """Whether it begins with the title of a block and a rate."""
    found = [line.strip(' \t,;"') for line in head_text(head[:8192]).splitlines()]
    first = [line for line in found if line][:2]
    return len(first) == 2 and first[0].lower() in _TITLES and _rate(first[1]) is not None


def write(path: Path, recording: Recording) -> None:
    """The markers, as Nexus exports them: in mm, separated by commas. Bodies are left out: see above.

    Raises:
        ClearwayError: there are no markers, they aren't sampled evenly, or the file can't be written.
    """
    points = recording.points
    if points is None or not points.names:
        raise ClearwayError("the recording has no markers; Nexus' trajectories are nothing else", file=path)
    frames, rate = frames_of(points.t, file=path)
    with writing(path) as out:
        n = len(points.names)
        named = "".join(f",{_plain(name)},," for name in points.names)
        axes, units = ",X,Y,Z" * n, ",mm,mm,mm" * n
        head = f"Trajectories\r\n{rate:g}\r\n,{named}\r\nFrame,Sub Frame{axes}\r\n,{units}\r\n"
        out.write(head.encode())
        whole = frames.astype(np.int64)
        write_rows(out, [whole, np.zeros_like(whole), *to_file(points, "z", 0.001, 6)], ",")


def _plain(name: str) -> str:
    return re.sub(r'[,;"\s]+', "_", name)


def _layouts(lines: Lines) -> list[Layout]:
    found: list[Layout] = []
    other: list[str] = []
    for title, layout in _blocks(lines):
        if layout is None:
            other.append(title)
        else:
            found.append(layout)
    if not found:
        there = f"; it has {', '.join(sorted(set(other)))}" if other else ""
        raise ClearwayError(f"has no block 'Trajectories', 'Segments' or 'Objects'{there}", file=lines.file)
    if sum(bool(layout.points) for layout in found) > 1:
        raise ClearwayError("has two blocks of trajectories; only one can be read", file=lines.file)
    names, notes = unique(
        n for layout in found for n in (*(p for p, _ in layout.points), *(b.name for b in layout.bodies))
    )
    left = iter(names)
    found = [
        replace(
            layout,
            points=tuple((next(left), c) for _, c in layout.points),
            bodies=tuple(replace(b, name=next(left)) for b in layout.bodies),
        )
        for layout in found
    ]
    passed = (f"passed over: {', '.join(dict.fromkeys(other))}",) if other else ()
    axes = "axes taken as the file has them, z up, as Nexus captures by default"
    return [replace(found[0], notes=(*found[0].notes, *notes, *passed), axes=axes), *found[1:]]


def _blocks(lines: Lines) -> Iterator[tuple[str, Layout | None]]:
    """The blocks' titles, each with its layout if it holds markers or bodies."""
    empty, found = 0, False
    while (line := lines.next()) is not None:
        title = line.strip(' \t,;"')
        if not title:
            empty += 1
            if empty > _MOST_EMPTY:
                return
            continue
        empty = 0
        if title.lower() not in _TITLES and not (found and re.fullmatch(r"[A-Za-z][A-Za-z _()/-]*", title)):
            raise ClearwayError(f"line {lines.number}: {title[:40]!r} is no block's title", file=lines.file)
        layout, found = _layout(lines, title), True
        yield title, layout
        pass_over(lines)


def _layout(lines: Lines, title: str) -> Layout | None:
    rate_text = lines.next() or ""
    if title.lower() not in (*MARKERS, *BODIES):
        return None
    rate = rate_of(rate_text, file=lines.file, field=f"line {lines.number}", value=_rate(rate_text))
    heads = [lines.next() or "" for _ in range(2)]
    separator = max(",;\t", key=heads[1].count)
    names, axes = (cells(h, separator) for h in heads)
    while axes and not axes[-1]:
        axes.pop()
    lead = 2 if [a.lower() for a in axes[1:2]] == ["sub frame"] else 1
    if not axes or axes[0].lower() not in _COUNTED or len(axes) < lead + 3:
        raise ClearwayError(
            f"line {lines.number}: the columns should be Frame, Sub Frame, X, Y, Z, ... or Field #, X, Y, Z, ...",
            file=lines.file,
        )
    units, note = _units(lines, separator, len(axes))
    names += [""] * (len(axes) - len(names))
    block = Block(
        lines.at, lines.number + 1, len(axes), separator, point=1 if title.lower() in BODIES else 3, ends=True
    )

    def clock(values: FloatArray) -> FloatArray:
        return np.asarray((values[:, 0] - 1) / rate)

    told = tuple(range(lead))
    if title.lower() in MARKERS:
        points = _points(names, axes, lead)
        scale = _scale(units, [i for _, c in points for i in c], lines)
        return Layout(block, told, clock, points, scale=scale, notes=note)
    bodies, more = _bodies(names, axes, units, lead)
    scale = _scale(units, [i for b in bodies for i in b.columns[:3]], lines)
    return Layout(block, told, clock, (), bodies, scale=scale, notes=(*note, *more))


def _rate(text: str) -> float | None:
    """Hz in a cell such as `120`, `120,Hz` or `120 Hz`."""
    return number(re.sub(r"[,;\s]*Hz$", "", text.strip(' \t,;"'), flags=re.IGNORECASE))


def _units(lines: Lines, separator: str, columns: int) -> tuple[list[str], tuple[str, ...]]:
    """The cells of the line of units; millimetres where numbers stand there already, and a note."""
    at, before = lines.at, lines.number
    units = cells(lines.next() or "", separator)
    if not units or number(units[0]) is None:
        return units, ()
    lines.back_to(at, before)
    return ["mm"] * columns, ("no line says its units: taken as millimetres, as Workstation and iQ wrote them",)


def _points(names: list[str], axes: list[str], lead: int) -> tuple[tuple[str, tuple[int, int, int]], ...]:
    found = []
    for i in range(lead, len(axes) - 2, 3):
        if [a.upper() for a in axes[i : i + 3]] == ["X", "Y", "Z"]:
            found.append((names[i] or f"column {i + 1}", (i, i + 1, i + 2)))
    return tuple(found)


def _bodies(names: list[str], axes: list[str], units: list[str], lead: int) -> tuple[tuple[Body, ...], tuple[str, ...]]:
    found: list[Body] = []
    starts = [i for i in range(lead, len(axes)) if names[i]] or [lead]
    for start, stop in zip(starts, [*starts[1:], len(axes)], strict=True):
        at = {a.upper(): start + k for k, a in enumerate(axes[start:stop])}
        if not {"TX", "TY", "TZ"} <= at.keys():
            continue
        name = re.sub(r"^Global Angle\s+", "", names[start]) or f"column {start + 1}"
        position = (at["TX"], at["TY"], at["TZ"])
        if {"RX", "RY", "RZ", "RW"} <= at.keys():
            found.append(Body(name, (*position, at["RX"], at["RY"], at["RZ"], at["RW"]), xyzw))
        elif {"RX", "RY", "RZ"} <= at.keys():
            said = units[at["RX"]].lower() if at["RX"] < len(units) else ""
            turn = _degrees if said.startswith("deg") else _radians if said.startswith("rad") else None
            found.append(Body(name, (*position, at["RX"], at["RY"], at["RZ"]), turn))
        else:
            found.append(Body(name, position))
    note = "a body's angles may be a rotation vector or Euler's: its heading is given where all readings agree on it"
    return tuple(found), (note,) if any(b.turn in (_degrees, _radians) for b in found) else ()


def _scale(units: list[str], columns: list[int], lines: Lines) -> float:
    said = {units[i].strip().lower() if i < len(units) else "" for i in columns}
    if len(said) > 1:
        raise ClearwayError(f"line {lines.number}: several units: {', '.join(sorted(said))}", file=lines.file)
    return unit(said.pop() if said else "", file=lines.file, field=f"line {lines.number}")


def _degrees(values: FloatArray) -> FloatArray | None:
    return _radians(np.deg2rad(values))


def _radians(values: FloatArray) -> FloatArray | None:
    """Orientations (n, 4) where a rotation vector and both orders of Euler angles have one heading, else NaN."""
    out = np.full((len(values), 4), np.nan)
    known = np.isfinite(values).all(axis=1) & (np.abs(values) < 1e3).all(axis=1)
    if not known.any():
        return out
    angles = values[known]
    vector = Rotation.from_rotvec(angles)
    readings = [r.as_matrix() for r in (vector, Rotation.from_euler("XYZ", angles), Rotation.from_euler("xyz", angles))]
    heading = np.array([np.arctan2(r[:, 1, 0], r[:, 0, 0]) for r in readings])
    apart = np.abs((heading[1:] - heading[0] + np.pi) % (2 * np.pi) - np.pi).max(axis=0)
    upright = np.min([r[:, 2, 2] for r in readings], axis=0) > np.cos(0.2)
    agreed = vector.as_quat()
    agreed[~((apart < AGREE) & upright)] = np.nan
    out[known] = agreed
    return out


FORMATS = (text_format("vicon", "Vicon Nexus CSV", (".csv",), sniff, _layouts, write),)

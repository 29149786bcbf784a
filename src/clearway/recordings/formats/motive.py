"""OptiTrack Motive's CSV, format versions 1.2 to 1.25.

The first row is of keys and values (`Format Version,1.23,...,Length Units,Meters,Coordinate Space,Global`); then, above
the columns, rows of types, names, IDs, sometimes parents, and of `Rotation` or `Position`; then `Frame,Time (Seconds)`
and the axes. An empty cell is what wasn't seen.

`Marker` columns are measured. `Rigid Body Marker`, `Bone Marker` and `Marker Constraint` columns are where a body's
definition expects its markers, through any occlusion: they are never read. Quaternions stand as X, Y, Z, W. Euler angles
are in degrees, about the body's own axes, in the order that `Rotation Type` names.

Motive's own frame has y up (docs.optitrack.com, "Data Export: CSV"), and no key says what the export made of it.
`motive` takes y and refuses a file whose markers then climb rather than drive; `motive-z-up` takes z.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.capture import (
    Body,
    Layout,
    by_name_only,
    frames_of,
    text_format,
    to_file,
    track_to_file,
)
from clearway.recordings.formats.capture_fields import euler, rate_of, timestamp, unique, unit, xyzw
from clearway.recordings.formats.text import Block, Lines, cells, head_text, number, write_rows, writing
from clearway.recordings.recording import Recording

EXPECTED = ("rigid body marker", "bone marker", "marker constraint", "rigid body constraint", "bone constraint")
"""Types of columns, in lower case, that say where a marker should be, not where it was seen."""

_MEASURED = ("marker", "unlabeled marker", "unlabelled marker")
_BODIES = ("rigid body", "bone", "rigid body bone")
_STARTED = ("%Y-%m-%d %I.%M.%S.%f %p", "%Y-%m-%d %I.%M.%S %p", "%Y-%m-%d %H.%M.%S.%f", "%Y-%m-%d %H:%M:%S.%f")
_MOST_HEADER = 30


def sniff(path: Path, head: bytes) -> bool:
    """Whether its first cell is `Format Version`."""
    return re.match(r'\s*"?Format Version"?\s*[,;\t]', head_text(head[:512])) is not None


@dataclass(slots=True)
class _Group:
    """Columns of one thing: by (kind, axis), such as ("rotation", "x")."""

    type: str
    name: str
    id: str
    columns: dict[tuple[str, str], int] = field(default_factory=dict)

    def triple(self, kind: str) -> tuple[int, ...] | None:
        found = tuple(self.columns.get((kind, axis), -1) for axis in "xyz")
        return None if -1 in found else found


def _layouts(lines: Lines, up: str) -> list[Layout]:
    file = lines.file
    first = lines.next() or ""
    separator = max(",;\t", key=first.count)
    said = _keys(cells(first, separator))
    if "Format Version" not in said:
        raise ClearwayError("doesn't begin with 'Format Version', as Motive's CSV does", file=file)
    if (space := said.get("Coordinate Space", "Global")).lower() not in ("global", "world"):
        raise ClearwayError(f"{space!r}: export it in global coordinates", file=file, field="Coordinate Space")
    scale = unit(said.get("Length Units", ""), file=file, field="Length Units")
    heads, axes = _heads(lines, separator)
    groups = _groups(heads, axes)
    turn = _turn(said.get("Rotation Type", ""), file)
    points = [(g.name, g.triple("position")) for g in groups if g.type in _MEASURED]
    bodies = [_body(g, turn) for g in groups if g.type in _BODIES and g.triple("position")]
    found = [(name, at) for name, at in points if at is not None]
    names, notes = unique([name for name, _ in found] + [b.name for b in bodies])
    expected = len({(g.name, g.id) for g in groups if g.type in EXPECTED})
    if expected:
        notes = (*notes, f"{expected} markers' expected positions were passed over: they hold through occlusions")
    others = sorted({g.type for g in groups} - {*EXPECTED, *_MEASURED, *_BODIES})
    if others:
        notes = (*notes, f"passed over: {', '.join(others)[:200]}")
    lead, clock, raster = _clock(said, axes, file)
    started = timestamp(said.get("Capture Start Time", ""), _STARTED)
    if started is not None:
        notes = (*notes, "the capture's start names no time zone; taken as UTC")
    turned = "y taken as up and turned to z" if up == "y" else "z taken as up"
    return [
        Layout(
            Block(lines.at, lines.number + 1, len(axes), separator, point=1),
            lead,
            clock,
            tuple((name, (at[0], at[1], at[2])) for name, (_, at) in zip(names, found, strict=False)),
            tuple(replace(b, name=name) for b, name in zip(bodies, names[len(found) :], strict=True)),
            raster=raster,
            scale=scale,
            up=up,
            epoch=started,
            promised=number(said.get("Total Exported Frames", "")),
            notes=notes,
            axes=turned,
        )
    ]


def _keys(row: Sequence[str]) -> dict[str, str]:
    """Keys and values. A note with commas in it shifts the pairs, so known keys are looked for one by one."""
    known = (
        "Format Version",
        "Capture Frame Rate",
        "Export Frame Rate",
        "Capture Start Time",
        "Total Exported Frames",
        "Rotation Type",
        "Length Units",
        "Coordinate Space",
    )
    found = {}
    for key in known:
        at = [i for i, cell in enumerate(row[:-1]) if cell == key]
        if at:
            found[key] = row[at[-1] + 1]
    return found


def _heads(lines: Lines, separator: str) -> tuple[dict[str, list[str]], list[str]]:
    """The rows above the columns by what they are (type, name, id, kind), and the row of axes."""
    above: list[list[str]] = []
    while (line := lines.next()) is not None and lines.number <= _MOST_HEADER:
        row = cells(line, separator)
        if row[0].lower().startswith("frame"):
            break
        if any(row):
            above.append(row)
    else:
        raise ClearwayError("the row of columns (Frame, Time (Seconds), X, Y, Z, ...) is missing", file=lines.file)
    width = max((i + 1 for r in (*above, row) for i, cell in enumerate(r) if cell), default=0)
    row = [*row, *[""] * width][:width]  # the column of a mean error has no axis, and may be the last
    if len(above) < 2 or len(row) < 5:
        raise ClearwayError("the rows of types and names above the columns are missing", file=lines.file)
    named = {label.lower(): r for r in above for label in r[:2] if label.lower() in ("type", "name", "id", "parent")}
    heads = {
        "type": named.get("type", above[0]),
        "name": named.get("name", above[1]),
        "id": named.get("id", above[2] if len(above) > 3 else []),
        "kind": above[-1],
    }
    return heads, row


def _groups(heads: dict[str, list[str]], axes: list[str]) -> list[_Group]:
    def at(row: str, i: int) -> str:
        return heads[row][i] if i < len(heads[row]) else ""

    found: list[_Group] = []
    for i in range(1, len(axes)):
        kind, axis, type_ = at("kind", i).lower(), axes[i].lower(), at("type", i).lower()
        if not type_ or type_ == "type":
            continue
        name, id_ = at("name", i) or f"column {i + 1}", at("id", i)
        last = found[-1] if found else None
        if last is None or (last.type, last.name, last.id) != (type_, name, id_) or (kind, axis) in last.columns:
            last = _Group(type_, name, id_)
            found.append(last)
        last.columns[kind, axis] = i
    return found


def _body(group: _Group, turn: Any) -> Body:
    position, rotation = group.triple("position") or (), group.triple("rotation")
    w = group.columns.get(("rotation", "w"))
    if rotation is None or turn is None:
        return Body(group.name, position)
    if turn is xyzw:
        return Body(group.name, (*position, *rotation, w), xyzw) if w is not None else Body(group.name, position)
    return Body(group.name, (*position, *rotation), turn)


def _turn(said: str, file: Path) -> Any:
    """What makes orientations of the rotation columns."""
    kind = said.strip().upper()
    if not kind:
        return None
    if kind == "QUATERNION":
        return xyzw
    if sorted(kind) != ["X", "Y", "Z"]:
        raise ClearwayError(f"{said[:40]!r} should be Quaternion or an order of axes", file=file, field="Rotation Type")
    return partial(_euler, order=kind)


def _euler(values: FloatArray, order: str) -> FloatArray:
    return euler(values[:, ["XYZ".index(a) for a in order]], order)


def _clock(said: dict[str, str], axes: list[str], file: Path) -> tuple[tuple[int, ...], Any, tuple[int, float] | None]:
    """The lead columns, what makes time of them, and the frames' raster."""
    text = said.get("Export Frame Rate") or said.get("Capture Frame Rate", "")
    rate = number(text)
    time = next((i for i, a in enumerate(axes[:4]) if re.match(r"time( \(|$)", a.lower())), None)
    if time is not None:
        return (0, time), _second, (0, rate) if rate is not None and rate > 0 else None
    return (0,), partial(_counted, rate=rate_of(text, file=file, field="Export Frame Rate", value=rate)), None


def _second(lead: FloatArray) -> FloatArray:
    return lead[:, 1]


def _counted(lead: FloatArray, rate: float) -> FloatArray:
    return np.asarray(lead[:, 0] / rate)


def write(path: Path, recording: Recording, up: str) -> None:
    """Markers and tracks (as rigid bodies, with quaternions), in metres.

    Raises:
        ClearwayError: there are neither, they have different time stamps, they aren't sampled evenly, or the file can't
            be written.
    """
    points, tracks = recording.points, recording.tracks
    if (points is None or not points.names) and not tracks:
        raise ClearwayError("the recording has neither markers nor bodies", file=path)
    stamps = [x.t for x in (points, *tracks.values()) if x is not None]
    if any(len(t) != len(stamps[0]) or not np.array_equal(t, stamps[0]) for t in stamps):
        raise ClearwayError("markers and bodies have different time stamps; one file has one row a frame", file=path)
    frames, rate = frames_of(stamps[0], file=path)
    columns: list[Any] = [frames.astype(np.int64) - 1, np.round(stamps[0], 9)]
    heads: list[tuple[str, str, str, str]] = []
    for name, track in tracks.items():
        position, turned = track_to_file(track, up, 1.0, 7)
        heads += [("Rigid Body", name, "Rotation", a) for a in "XYZW"] + [
            ("Rigid Body", name, "Position", a) for a in "XYZ"
        ]
        columns += [np.round(turned[:, i], 7) for i in range(4)] + [position[:, i] for i in range(3)]
    if points is not None:
        heads += [("Marker", name, "Position", a) for name in points.names for a in "XYZ"]
        columns += to_file(points, up, 1.0, 7)
    started = ""
    if recording.epoch is not None:
        moment = datetime.fromtimestamp(recording.epoch, UTC)
        started = f"Capture Start Time,{moment:%Y-%m-%d %I.%M.%S}.{moment.microsecond // 1000:03d} {moment:%p},"
    n = len(stamps[0])
    types, names, kinds, axes = (",".join(re.sub(r'[,"\r\n]+', "_", h[i]) for h in heads) for i in range(4))
    head = (
        f"Format Version,1.23,Take Name,{path.stem},Take Notes,,Capture Frame Rate,{rate:.6f},"
        f"Export Frame Rate,{rate:.6f},{started}Total Frames in Take,{n},Total Exported Frames,{n},"
        "Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global",
        "",
        f",Type,{types}",
        f",Name,{names}",
        f",ID,{names}",
        f",,{kinds}",
        f"Frame,Time (Seconds),{axes}",
    )
    with writing(path) as out:
        out.write(("\r\n".join(head) + "\r\n").encode())
        write_rows(out, columns, ",")


FORMATS = tuple(
    text_format(
        name, f"OptiTrack Motive CSV, {up} up", suffixes, sniffed, partial(_layouts, up=up), partial(write, up=up)
    )
    for name, up, suffixes, sniffed in (("motive", "y", (".csv",), sniff), ("motive-z-up", "z", (), by_name_only))
)

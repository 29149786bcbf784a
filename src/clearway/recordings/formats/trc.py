"""TRC, "track row column": the text format of Motion Analysis and OpenSim, which several systems export.

    PathFileType  4  (X/Y/Z)  walk.trc
    DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
    100       100         251        2           mm     100           1                   251
    Frame#    Time        R.Heel     (2 empty)   L.Heel
              (2 empty)   X1  Y1  Z1             X2  Y2  Z2

separated by tabs (or commas); an empty line may follow. Time is the file's own. Empty cells are markers that weren't seen, and
so are those at 0, 0, 0, as several programs write them.
Cortex writes trajectories that nobody named behind the named ones, with or without X, Y, Z above them: they are called
`unlabeled 29`. OpenSim 4.0 shifted the two lines of names by a cell against the numbers, and its examples have the third line
spread over more tabs than the second.

No field says which axis is up: capture systems mostly write z, OpenSim wants y. `trc` takes z, says so in its notes, and
refuses a file whose markers then climb rather than drive; `trc-y-up` takes y.
"""

from __future__ import annotations

import re
from collections.abc import Sized
from functools import partial
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.capture import Layout, by_name_only, frames_of, text_format, to_file
from clearway.recordings.formats.capture_fields import rate_of, unique, unit
from clearway.recordings.formats.text import Block, Lines, cells, head_text, number, write_rows, writing
from clearway.recordings.recording import Recording


def sniff(path: Path, head: bytes) -> bool:
    """Whether it begins as a TRC does."""
    return re.match(r"\s*\"?PathFileType\b", head_text(head[:512])) is not None


def write(path: Path, recording: Recording, up: str) -> None:
    """The markers in mm; y up is as OpenSim wants them.

    Raises:
        ClearwayError: there are no markers, they aren't sampled evenly, or the file can't be written.
    """
    points = recording.points
    if points is None or not points.names:
        raise ClearwayError("the recording has no markers; a TRC is nothing else", file=path)
    frames, rate = frames_of(points.t, file=path)
    n, m = len(points.t), len(points.names)
    with writing(path) as out:
        keys = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
        names = "".join(re.sub(r"[\t\r\n\"]+", "_", name) + "\t\t\t" for name in points.names)
        axes = "".join(f"X{i}\tY{i}\tZ{i}\t" for i in range(1, m + 1))
        head = (
            f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
            keys,
            f"{rate:g}\t{rate:g}\t{n}\t{m}\tmm\t{rate:g}\t1\t{n}",
            f"Frame#\tTime\t{names.rstrip(chr(9))}",
            f"\t\t{axes.rstrip(chr(9))}",
            "",
        )
        out.write(("\r\n".join(head) + "\r\n").encode())
        time = np.round(points.t, 9)
        write_rows(out, [frames.astype(np.int64), time, *to_file(points, up, 0.001, 6)], "\t")


def _layouts(lines: Lines, up: str) -> list[Layout]:
    file = lines.file
    if not sniff(file, (lines.next() or "").encode()):
        raise ClearwayError("doesn't begin with 'PathFileType', as a TRC does", file=file)
    keys_line, values_line = lines.next() or "", lines.next() or ""
    names_line, axes_line = lines.next() or "", lines.next() or ""
    separator = "\t" if "\t" in names_line else "," if "," in names_line else ";"
    said = _said(cells(keys_line, separator), cells(values_line, separator))
    names, axes = cells(names_line, separator), cells(axes_line, separator)
    if [n.lower() for n in names[:2]] != ["frame#", "time"]:
        raise ClearwayError(f"line {lines.number - 1}: the columns should be Frame#, Time and markers", file=file)
    rate_text = said.get("DataRate", "")
    rate = rate_of(rate_text, file=file, field="DataRate", value=number(rate_text))
    at, line = _first_row(lines)
    lines.back_to(at, line - 1)
    row = cells(lines.next() or "", separator)
    called, shifted = _called(names, axes, row, file)
    unique_names, notes = unique(called)
    points = tuple((name, (i, i + 1, i + 2)) for name, i in zip(unique_names, _starts(called), strict=True))
    if shifted:
        notes = (*notes, "its names stand a cell beside the numbers, as OpenSim 4.0 wrote them: taken in their order")
    markers, frames = number(said.get("NumMarkers", "")), number(said.get("NumFrames", ""))
    if markers is not None and markers != len(points):
        notes = (*notes, f"the header announces {markers:.0f} markers, there are columns of {len(points)}")
    scale = unit(said.get("Units", ""), file=file, field="Units")
    block = Block(at, line, points[-1][1][2] + 1, separator, surplus=True)
    turned = "y taken as up and turned to z" if up == "y" else "z taken as up: TRC has no field that says so"
    return [
        Layout(
            block,
            (0, 1),
            _time,
            points,
            raster=(0, rate),
            scale=scale,
            up=up,
            promised=frames,
            notes=notes,
            axes=turned,
            zero=True,
        )
    ]


def _said(keys: list[str], values: list[str]) -> dict[str, str]:
    """The header's values by their keys; in some files there are more tabs in one of the lines."""
    there = [k for k in keys if k], [v for v in values if v]
    return dict(zip(*there, strict=True) if len(there[0]) == len(there[1]) else zip(keys, values, strict=False))


def _called(names: list[str], axes: list[str], row: list[str], file: Path) -> tuple[list[str], bool]:
    """What the markers are called, the first of which has the columns 2 to 4, and whether the names stand elsewhere.

    Args:
        names: Cells of the line of names.
        axes: Cells of the line with X1, Y1, Z1, ...
        row: Cells of the first line of numbers.

    Raises:
        ClearwayError: it can't be told whose the numbers are.
    """
    starts = [i for i, a in enumerate(axes) if re.fullmatch(r"[Xx]\d*", a)]
    stand = {i: n for i, n in enumerate(names) if n and i > 1}
    width = len(row) - (not row[-1])  # a tab may end every line
    if starts and starts[0] != 2 and len(stand) == len(starts) and width == 2 + 3 * len(starts):
        return list(stand.values()), True
    filled = max((i + 1 for i, c in enumerate(row) if c), default=0)
    count = max([len(starts), *((i + 1) // 3 for i in stand), (filled - 2) // 3])
    places = _starts(range(count))
    if not starts or starts != places[: len(starts)] or not set(stand) <= set(places):
        raise ClearwayError(f"there are {len(stand)} marker names, but X, Y and Z of {len(starts)}", file=file)
    return [stand.get(i, f"unlabeled {k}") for k, i in enumerate(places, 1)], False


def _starts(markers: Sized) -> list[int]:
    """The columns in which the markers begin."""
    return list(range(2, 2 + 3 * len(markers), 3))


def _time(lead: FloatArray) -> FloatArray:
    return lead[:, 1]


def _first_row(lines: Lines) -> tuple[int, int]:
    """Where the numbers begin: the header may end in an empty line."""
    at, before = lines.at, lines.number
    line = lines.next()
    return (lines.at, lines.number + 1) if line is not None and not line.strip(" \t,;") else (at, before + 1)


FORMATS = tuple(
    text_format(name, title, suffixes, sniffed, partial(_layouts, up=up), partial(write, up=up))
    for name, title, up, suffixes, sniffed in (
        ("trc", "TRC (Motion Analysis, OpenSim), z up", "z", (".trc",), sniff),
        ("trc-y-up", "TRC, y up", "y", (), by_name_only),
    )
)

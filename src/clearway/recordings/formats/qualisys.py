"""Qualisys Track Manager's TSV: markers (`qualisys`) and rigid bodies (`qualisys-6d`).

Lines of a key, a tab and values (`FREQUENCY`, `MARKER_NAMES` or `BODY_NAMES`, ...); then, as the export was set, a line
of column names; then the numbers, after frame and time if these were exported. Lengths are millimetres, as QTM always
writes. A thing at 0, 0, 0, an empty cell and `NULL` are what wasn't seen.

A body's rows are X, Y, Z, roll, pitch, yaw [degrees], residual and Rot[0] to Rot[8]: its rotation matrix, column by
column. The matrix is taken, as what the angles mean can be set in QTM. Older exports have no frame and time before the
line of column names, and may have an empty column between two bodies: where there are names, they say what is what.

QTM's manual discourages using TIME_STAMP for synchronisation: it need not be the first frame's.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.capture import (
    Body,
    Layout,
    frames_of,
    text_format,
    to_file,
    track_to_file,
)
from clearway.recordings.formats.capture_fields import rate_of, timestamp, unique
from clearway.recordings.formats.text import Block, Lines, cells, head_text, number, write_rows, writing
from clearway.recordings.recording import Recording

PER_BODY = 16
"""Columns of a body: position, three angles, residual, matrix."""

_KEY = re.compile(r"[A-Z][A-Z0-9_]+(\s*\t.*)?")
_BEGINS = r"\s*(FILE_VERSION|NO_OF_FRAMES)\t"
_MOST_HEADER = 10_000
_DATES = ("%Y-%m-%d, %H:%M:%S.%f", "%Y-%m-%d, %H:%M:%S", "%Y-%m-%d %H:%M:%S.%f", "%Y-%m-%d %H:%M:%S")


def write(path: Path, recording: Recording) -> None:
    """The markers, with frame and time.

    Raises:
        ClearwayError: there are none, they aren't sampled evenly, or the file can't be written.
    """
    points = recording.points
    if points is None or not points.names:
        raise ClearwayError("the recording has no markers", file=path)
    n, m = len(points.t), len(points.names)
    frames, rate = frames_of(points.t, file=path)
    names = [_plain(name) for name in points.names]
    keys = {
        "NO_OF_FRAMES": str(n),
        "NO_OF_CAMERAS": "0",
        "NO_OF_MARKERS": str(m),
        "FREQUENCY": f"{rate:g}",
        "NO_OF_ANALOG": "0",
        "ANALOG_FREQUENCY": "0",
        "DESCRIPTION": "--",
        **_stamp(recording),
        "DATA_INCLUDED": "3D",
        "MARKER_NAMES": "\t".join(names),
    }
    columns = [frames.astype(np.int64), np.round(points.t, 9), *to_file(points, "z", 0.001, 6)]
    _write(path, keys, [f"{name} {axis}" for name in names for axis in "XYZ"], columns)


def write_bodies(path: Path, recording: Recording) -> None:
    """The tracks as rigid bodies.

    Raises:
        ClearwayError: there are none, they have different time stamps, they aren't sampled evenly, or the file can't be
            written.
    """
    tracks = recording.tracks
    if not tracks:
        raise ClearwayError("the recording has no bodies", file=path)
    t = next(iter(tracks.values())).t
    if any(len(x.t) != len(t) or not np.array_equal(x.t, t) for x in tracks.values()):
        raise ClearwayError("the bodies have different time stamps; one file has one row a frame", file=path)
    frames, rate = frames_of(t, file=path)
    columns: list[Any] = [frames.astype(np.int64), np.round(t, 9)]
    titles: list[str] = []
    for name, track in tracks.items():
        position, turned = track_to_file(track, "z", 0.001, 6)
        seen = np.isfinite(position).all(axis=1)
        known = np.isfinite(turned).all(axis=1) & seen
        angles, matrix = np.zeros((len(t), 3)), np.zeros((len(t), 9))
        if known.any():
            rotation = Rotation.from_quat(turned[known])
            angles[known] = rotation.as_euler("XYZ", degrees=True)
            matrix[known] = rotation.as_matrix().transpose(0, 2, 1).reshape(-1, 9)
        position[~seen] = 0.0
        columns += [position[:, i] for i in range(3)] + [np.round(angles[:, i], 6) for i in range(3)]
        columns += [np.where(seen, 0.0, -1.0), *(np.round(matrix[:, i], 8) for i in range(9))]
        titles += [f"{_plain(name)} X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]
    keys = {
        "NO_OF_FRAMES": str(len(t)),
        "NO_OF_CAMERAS": "0",
        "NO_OF_BODIES": str(len(tracks)),
        "FREQUENCY": f"{rate:g}",
        "NO_OF_ANALOG": "0",
        "ANALOG_FREQUENCY": "0",
        "DESCRIPTION": "--",
        **_stamp(recording),
        "DATA_INCLUDED": "6D",
        "BODY_NAMES": "\t".join(_plain(name) for name in tracks),
    }
    _write(path, keys, titles, columns)


def _sniffed(path: Path, head: bytes, key: str) -> bool:
    """Whether it is QTM's TSV, of markers or of bodies."""
    text = head_text(head)
    return re.match(_BEGINS, text) is not None and re.search(rf"^{key}\b", text, re.MULTILINE) is not None


def _plain(name: str) -> str:
    return re.sub(r"[\t\r\n\"]+", "_", name)


def _stamp(recording: Recording) -> dict[str, str]:
    if recording.epoch is None:
        return {}
    moment = np.datetime64(round(recording.epoch * 1000), "ms").item()
    return {"TIME_STAMP": f"{moment:%Y-%m-%d, %H:%M:%S}.{moment.microsecond // 1000:03d}\t0.00000000"}


def _write(path: Path, keys: dict[str, str], titles: list[str], columns: list[Any]) -> None:
    head = [f"{key}\t{value}" for key, value in keys.items()]
    head.append("\t".join(["Frame", "Time", *titles]))
    with writing(path) as out:
        out.write(("\r\n".join(head) + "\r\n").encode())
        write_rows(out, columns, "\t")


def _layouts(lines: Lines, bodies: bool) -> list[Layout]:
    said, titles, (at, line), first = _header(lines)
    file = lines.file
    key = "BODY_NAMES" if bodies else "MARKER_NAMES"
    if key not in said:
        other = "MARKER_NAMES" if bodies else "BODY_NAMES"
        hint = f", but {other}: read it as {'qualisys' if bodies else 'qualisys-6d'}" if other in said else ""
        raise ClearwayError(f"has no {key}{hint}", file=file)
    if not said[key]:
        raise ClearwayError("names nothing", file=file, field=key)
    names, notes = unique(said[key])
    width = len(first) - (not first[-1])
    named = _named(titles, width, len(names)) if bodies else None
    per = PER_BODY if bodies else 3
    if named is None:
        if bodies and titles is not None and len(titles) - (not titles[-1]) != width:
            titles = None  # they aren't the numbers' own
        lead = _lead(titles, first, per * len(names), file, line)
        starts = [lead + per * i for i in range(len(names))]
        turns = [tuple(range(i + 7, i + 16)) for i in starts]
        columns = lead + per * len(names)
    else:
        starts, turns, lead = [i for i, _ in named], [r for _, r in named], named[0][0]
        columns, per = width, 1
        if without := [name for name, r in zip(names, turns, strict=True) if not r]:
            notes = (*notes, f"no rotation matrix, and so no heading: {', '.join(without)[:200]}")
    rate_text = (said.get("FREQUENCY") or [""])[0]
    timed = lead > 1 and (titles is None or titles[1].lower() == "time")
    rate = number(rate_text)  # with an external time base it may be a word: then time has to be a column
    if not (timed and rate is None):
        rate = rate_of(rate_text, file=file, field="FREQUENCY", value=rate)
    started = timestamp((said.get("TIME_STAMP") or [""])[0], _DATES)
    if started is not None:
        notes = (*notes, "TIME_STAMP names no time zone (taken as UTC), and QTM discourages synchronising by it")
    types = said.get("TRAJECTORY_TYPES", [])
    unmeasured = [n for n, kind in zip(names, types, strict=False) if kind and kind != "Measured"]
    if unmeasured:
        notes = (*notes, f"partly not measured, but filled or calculated by QTM: {', '.join(unmeasured)[:200]}")
    return [
        Layout(
            Block(at, line, columns, "\t", point=per),
            (0, 1) if timed else (0,) if lead else (),
            _time if timed else partial(_counted, rate=rate or 1.0, from_one=bool(lead)),
            () if bodies else tuple((name, (i, i + 1, i + 2)) for name, i in zip(names, starts, strict=True)),
            tuple(
                Body(name, (i, i + 1, i + 2, *turn), _matrix if turn else None)
                for name, i, turn in zip(names, starts, turns, strict=True)
            )
            if bodies
            else (),
            raster=(0, rate) if timed and rate else None,
            scale=0.001,
            zero=True,
            epoch=started,
            promised=number((said.get("NO_OF_FRAMES") or [""])[0]),
            notes=notes,
            axes="axes taken as the file has them, z up, as QTM captures by default",
        )
    ]


def _header(lines: Lines) -> tuple[dict[str, list[str]], list[str] | None, tuple[int, int], list[str]]:
    """Keys with their values, the column names if there are any, where the numbers begin, and the first row of them."""
    said: dict[str, list[str]] = {}
    titles: list[str] | None = None
    while True:
        at, before = lines.at, lines.number
        line = lines.next()
        if line is None or before > _MOST_HEADER:
            raise ClearwayError("has a header, but no frames", file=lines.file)
        row = cells(line, "\t")
        if not any(row):
            continue
        if row[0] == "Frame" or _is_titles(row, said):
            titles = row
        elif titles is None and _KEY.fullmatch(line) and number(row[0]) is None:
            while row and not row[-1]:
                row.pop()
            said.setdefault(row[0], row[1:])
        else:
            return said, titles, (at, before + 1), row


def _is_titles(row: list[str], said: dict[str, list[str]]) -> bool:
    """Whether a line behind the names names columns: older exports don't begin it with `Frame`."""
    axes = {cell.rpartition(" ")[2] for cell in row}
    return bool(said.keys() & {"BODY_NAMES", "MARKER_NAMES"}) and {"X", "Y", "Z"} <= axes and number(row[-1]) is None


def _named(titles: list[str] | None, width: int, count: int) -> list[tuple[int, tuple[int, ...]]] | None:
    """Where each body's X stands and, if it has them, its Rot[0] to Rot[8]; None where no titles say so."""
    last = [t.rpartition(" ")[2] for t in titles or ()]
    while last and not last[-1]:
        last.pop()
    starts = [i for i in range(len(last) - 2) if last[i : i + 3] == ["X", "Y", "Z"]]
    if len(last) != width or len(starts) != count:
        return None
    found = []
    for start, stop in zip(starts, [*starts[1:], len(last)], strict=True):
        at = {t: start + k for k, t in enumerate(last[start:stop])}
        turn = tuple(at[f"Rot[{i}]"] for i in range(9) if f"Rot[{i}]" in at)
        found.append((start, turn if len(turn) == 9 else ()))
    return found


def _lead(titles: list[str] | None, first: list[str], held: int, file: Path, line: int) -> int:
    """How many columns stand before the data: frame, time, a time code."""
    if titles is not None:
        while titles and not titles[-1]:
            titles.pop()
        lead = len(titles) - held
        if not 0 <= lead <= 4:
            raise ClearwayError(f"line {line - 1} names {len(titles)} columns; the header promises {held}", file=file)
        return lead
    count = len(first) - (1 if (len(first) - held) % 2 and not first[-1] else 0)  # a tab may end every line
    if count - held not in (0, 1, 2):
        raise ClearwayError(f"line {line} has {len(first)} columns; the header promises {held}", file=file)
    return count - held


def _time(lead: FloatArray) -> FloatArray:
    return lead[:, 1]


def _counted(lead: FloatArray, rate: float, from_one: bool) -> FloatArray:
    return np.asarray((lead[:, 0] - from_one) / rate)


def _matrix(values: FloatArray) -> FloatArray:
    """Orientations (n, 4) of matrices (n, 9) that are given column by column; NaN where it is none."""
    out = np.full((len(values), 4), np.nan)
    matrix = values.reshape(-1, 3, 3).transpose(0, 2, 1)
    with np.errstate(all="ignore"):
        off = np.abs(matrix @ matrix.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        known = (off < 0.05) & (np.linalg.det(np.where(np.isfinite(matrix), matrix, 0.0)) > 0)
    if known.any():
        out[known] = Rotation.from_matrix(matrix[known]).as_quat()
    return out


FORMATS = tuple(
    text_format(
        name, title, (".tsv",), partial(_sniffed, key=key), partial(_layouts, bodies=key == "BODY_NAMES"), written
    )
    for name, title, key, written in (
        ("qualisys", "Qualisys TSV, markers", "MARKER_NAMES", write),
        ("qualisys-6d", "Qualisys TSV, rigid bodies", "BODY_NAMES", write_bodies),
    )
)

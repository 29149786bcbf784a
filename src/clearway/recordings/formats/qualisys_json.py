"""Qualisys Track Manager's JSON: markers and rigid bodies, each in parts of consecutive frames.

    {"Timebase": {"Frequency": 100, "Range": {"Start": 1, "End": 250}},
     "Markers": [{"Name": "cart - 1", "Parts": [{"Range": {"Start": 1, "End": 90}, "Values": [[x, y, z, residual], ...]}]}],
     "RigidBodies": [{"Name": "cart", "Parts": [{"Range": ..., "Values": [[[x, y, z, residual], [nine numbers]], ...]}]}]}

Lengths are millimetres. Between two parts nothing was seen. Nothing that Qualisys publishes says whether a body's nine numbers are its
rotation matrix row by row or column by column, and the wrong one turns it the other way round. So the body's own
markers decide, which QTM calls `BODY - 1`, `BODY - 2` ...: in the right reading they stay where they are on it. Without them there
is no heading.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.reading import read_bytes
from clearway.recordings.formats.capture_fields import rate_of, unique, wanted_of
from clearway.recordings.formats.format import Format, look_by
from clearway.recordings.formats.text import head_text
from clearway.recordings.recording import Points, Recording, Track, Want

LARGEST = 64 << 20
"""Bytes of a file; what is longer is read as TSV. Ten minutes of ten markers at 100 Hz are 25 MB."""

CELLS = 10_000_000
"""Markers and bodies times frames."""

STAYS = 0.02
"""m; how far a marker may seem to move on its body in the right reading of the matrix."""


def sniff(path: Path, head: bytes) -> bool:
    """Whether it begins as a JSON of QTM does."""
    text = head_text(head).lstrip()
    return text.startswith("{") and '"Parts"' in text and any(f'"{k}"' in text for k in ("Markers", "RigidBodies"))


def read(path: Path, want: Want) -> Recording:
    """Markers and rigid bodies.

    Raises:
        ClearwayError: it is no such file, too large, lacks a wanted name, or a part of it is wrong.
    """
    told = _loaded(path)
    frequency = _of(told, "Timebase", "Frequency", path)
    rate = rate_of(str(frequency), file=path, field="Timebase.Frequency", value=_number(frequency))
    markers = dict(_things(told, "Markers", 3, path))
    bodies = dict(_things(told, "RigidBodies", 12, path))
    if not markers and not bodies:
        raise ClearwayError("holds neither markers nor rigid bodies", file=path)
    for name in sorted(want.names or ()):
        if name not in markers and name not in bodies:
            raise unknown("marker or body", name, (*markers, *bodies), file=path)
    first, n = _frames(told, [*markers.values(), *bodies.values()], path)
    t = np.arange(n) / rate
    inside = np.ones(n, dtype=bool) if want.span is None else (t >= want.span[0]) & (t <= want.span[1])
    if not inside.any():
        raise ClearwayError(f"there is nothing within the span; it runs from 0 to {t[-1]:g} s", file=path)
    notes = ["axes taken as the file has them, z up, as QTM captures by default"]
    tracks: dict[str, Track] = {}
    for name, parts in bodies.items():
        if not want.has(name):
            continue
        values = _laid(parts, first, n, 12)
        own = [_laid(markers[m], first, n, 3) for m in markers if m.startswith(f"{name} - ")]
        orientation, said = _orientation(values, own, name)
        notes += said
        position = np.ascontiguousarray(values[inside, :3])
        tracks[name] = Track(
            "body", "", name, t[inside], position, None if orientation is None else orientation[inside]
        )
    chosen = wanted_of(markers, want)
    if want.names is None and len(chosen) < len(markers):
        notes.append(f"{len(markers) - len(chosen)} unlabelled trajectories were left out; name them to have them")
    points = None
    if chosen:
        xyz = np.stack([_laid(markers[m], first, n, 3)[inside] for m in chosen], axis=1)
        points = Points(tuple(chosen), t[inside], xyz)
    return Recording(path, "qualisys-json", points, tracks, notes=tuple(notes))


def _loaded(path: Path) -> dict[str, Any]:
    try:
        told = json.loads(read_bytes(path, LARGEST))
    except (ValueError, RecursionError) as error:
        raise ClearwayError(f"is not JSON: {str(error)[:200]}", file=path) from error
    if not isinstance(told, dict):
        raise ClearwayError("is JSON, but none of QTM's: it has no Timebase, Markers or RigidBodies", file=path)
    return told


def _of(told: dict[str, Any], key: str, inner: str, path: Path) -> Any:
    inside = told.get(key)
    if not isinstance(inside, dict) or inner not in inside:
        raise ClearwayError("is missing", file=path, field=f"{key}.{inner}")
    return inside[inner]


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and abs(value) < 1e300 else None


Parts = list[tuple[int, FloatArray]]
"""Number of the first frame, and the values (k, width) of it and the next ones: m, NaN where unseen."""


def _things(told: dict[str, Any], key: str, width: int, path: Path) -> Iterator[tuple[str, Parts]]:
    """The markers (width 3) or bodies (12: position, nine numbers), by their names."""
    listed = told.get(key) or []
    if not isinstance(listed, list) or not all(isinstance(x, dict) for x in listed):
        raise ClearwayError("is no list of things with Name and Parts", file=path, field=key)
    names, _ = unique(str(x.get("Name", ""))[:200] or f"{key} {i}" for i, x in enumerate(listed, 1))
    for name, thing in zip(names, listed, strict=True):
        parts = thing.get("Parts") or []
        field = f"{key}, {name}"
        if not isinstance(parts, list) or not all(isinstance(p, dict) for p in parts):
            raise ClearwayError("its Parts are no list of parts", file=path, field=field)
        yield name, [(_start(p, path, field), _values(p.get("Values") or [], width, path, field)) for p in parts]


def _start(part: dict[str, Any], path: Path, field: str) -> int:
    begin = part["Range"].get("Start") if isinstance(part.get("Range"), dict) else None
    if not isinstance(begin, int) or not 0 <= begin < 2**31:
        raise ClearwayError("a part doesn't say its Range.Start, a frame's number", file=path, field=field)
    return begin


def _values(rows: Any, width: int, path: Path, field: str) -> FloatArray:
    try:
        flat = [_row(row, width) for row in rows]
        values = np.array(flat, dtype=np.float64).reshape(len(flat), width)
    except (TypeError, ValueError, IndexError, OverflowError, KeyError) as error:
        what = "[x, y, z, residual]" if width == 3 else "[[x, y, z, residual], [nine numbers]]"
        raise ClearwayError(f"its Values are not all {what}", file=path, field=field) from error
    unseen = ~(np.abs(values[:, :3]) < 1e9).all(axis=1) | (values[:, :3] == 0).all(axis=1)
    values[unseen] = np.nan
    values[:, :3] *= 0.001
    return values


def _row(row: Any, width: int) -> list[float]:
    if width == 3 or row is None:
        return [np.nan] * width if row is None else [np.nan if x is None else x for x in row[:3]]
    position, matrix = row[0], row[1]
    if len(matrix) == 3:  # rows of their own
        matrix = [x for line in matrix for x in line]
    return [np.nan if x is None else x for x in (*position[:3], *matrix[:9])]


def _frames(told: dict[str, Any], things: list[Parts], path: Path) -> tuple[int, int]:
    """The number of the first frame, and how many there are."""
    starts = [start for parts in things for start, _ in parts]
    ends = [start + len(values) for parts in things for start, values in parts]
    if not any(len(values) for parts in things for _, values in parts):
        raise ClearwayError("nothing was seen in any frame", file=path)
    whole = told["Timebase"].get("Range")
    stated = whole.get("Start") if isinstance(whole, dict) else None
    first = min([*starts, *([stated] if isinstance(stated, int) and stated >= 0 else [])])
    n = max(ends) - first
    if n * len(things) > CELLS:
        raise ClearwayError(f"has {n} frames of {len(things)} things, more than are read; export it as TSV", file=path)
    return first, n


def _laid(parts: Parts, first: int, n: int, width: int) -> FloatArray:
    """Values (n, width) of every frame, NaN where none were measured."""
    out = np.full((n, width), np.nan)
    for start, values in parts:
        out[start - first : start - first + len(values)] = values
    return out


def _orientation(values: FloatArray, markers: list[FloatArray], name: str) -> tuple[FloatArray | None, list[str]]:
    """Orientations (n, 4) of the matrices in the columns 3 to 11, in the reading under which the body's markers stay."""
    rows = values[:, 3:].reshape(-1, 3, 3)
    with np.errstate(all="ignore"):
        off = np.abs(rows @ rows.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        known = (off < 0.05) & (np.linalg.det(np.where(np.isfinite(rows), rows, 0.0)) > 0)
    seen = [m - values[:, :3] for m in markers]
    spreads = [_moved(r, known, seen) for r in (rows, rows.transpose(0, 2, 1))]
    best = int(spreads[1] < spreads[0])
    if not known.any() or not spreads[best] < min(STAYS, 0.5 * spreads[1 - best]):
        return None, [
            f"{name}: no heading, as nothing tells whether its matrices stand row by row or column by column; export its"
            " markers with it while it turns, or take the TSV"
        ]
    matrix = (rows, rows.transpose(0, 2, 1))[best]
    q = np.full((len(values), 4), np.nan)
    q[known] = Rotation.from_matrix(matrix[known]).as_quat()
    how = ("row by row", "column by column")[best]
    return q, [f"{name}: its matrices stand {how}: so its markers stay within {1000 * spreads[best]:.1f} mm on it"]


def _moved(matrix: FloatArray, known: Any, seen: list[FloatArray]) -> float:
    """By how much the markers (n, 3) move on a body of these orientations, m, by the largest standard deviation."""
    found = [0.0]
    for m in seen:
        there = known & np.isfinite(m).all(axis=1)
        if there.sum() > 2:
            own = np.einsum("nji,nj->ni", matrix[there], m[there])
            found.append(float(own.std(axis=0).max()))
    return max(found)


FORMATS = (Format("qualisys-json", "Qualisys JSON", (".json",), sniff, read, look_by(read)),)

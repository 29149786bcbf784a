"""TUM trajectories: `t x y z qx qy qz qw` a line, seconds and metres, `#` before a comment (Sturm et al. 2012)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.delimited import Dialect, first_lines, head_of, is_number, pieces, stacked, written
from clearway.recordings.formats.format import Format, look_by
from clearway.recordings.formats.text import encoding_of
from clearway.recordings.recording import Recording, Track, Want
from clearway.recordings.times import SECONDS, in_order, must_be

NAME = "trajectory"
"""As a file's only track is called."""

COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")

EPOCH, LATEST = 1e8, 1e10
"""s; a stamp beyond the first (1973) is taken for UNIX time, and one beyond the second (2286) for none in seconds."""

HOW = "say time = {other} in the test plan's source or in a TOML beside the file"


def sniff(path: Path, head: bytes) -> bool:
    """Whether every line of its beginning has eight numbers, the last four a unit quaternion."""
    lines = [line for line in first_lines(head) if line.strip() and not line.lstrip().startswith("#")]
    rows = [line.split() for line in lines]
    if not rows or any(len(r) != 8 or not all(is_number(w) for w in r) for r in rows):
        return False
    with np.errstate(all="ignore"):
        norms = np.linalg.norm(np.array(rows, dtype=np.float64)[:, 4:], axis=1)
        return bool((np.abs(norms - 1) < 0.02).mean() > 0.5)


def read(path: Path, want: Want) -> Recording:
    """The trajectory of a TUM file, named `trajectory`; t = 0 is its first stamp where stamps are UNIX times.

    Raises:
        ClearwayError: it is no such file, or time goes backwards in it.
    """
    if want.names is not None and (other := sorted(want.names - {NAME})):
        raise unknown("track", other[0], (NAME,), file=path)
    dialect = Dialect(" ", encoding=encoding_of(head_of(path)), header="none", missing=("nan", "NaN"))
    names = [str(i + 1) for i in range(8)]
    unit = want.time or "s"
    cut: list[str] = []
    pieces_of = (_in_seconds(piece, SECONDS[unit]) for piece in _rows(path, dialect, names, cut))
    first = next(pieces_of, np.zeros((0, 8)))
    epoch = float(first[0, 0]) if len(first) and abs(first[0, 0]) > EPOCH else None
    if epoch is not None and epoch > LATEST:
        fits = next((u for u, by in SECONDS.items() if EPOCH < epoch * by / SECONDS[unit] < LATEST), None)
        say = f"; in {fits} it is: {HOW.format(other=repr(fits))}" if fits else ""
        raise ClearwayError(f"the first stamp, {epoch:.0f} s, is no UNIX time{say}", file=path, field="t")
    rows = stacked((_within(piece, epoch or 0.0, want.span) for piece in chain((first,), pieces_of)), 8)
    must_be(
        unit,
        rows[:, 0],
        rows[:, 1:4],
        f"{HOW}, or {{unit}} if that is right",
        file=path,
        field="t",
        said=want.time is not None,
    )
    keep, notes = ordered(rows[:, 0], path, "t")
    rows = rows[keep]
    with np.errstate(over="ignore"):
        far = np.abs(np.linalg.norm(rows[:, 4:], axis=1) - 1) > 0.02
    if len(rows) and (far & rows[:, 4:].any(axis=1)).mean() > 0.5:
        raise ClearwayError("its last four columns are no unit quaternions: it is no TUM trajectory", file=path)
    orientation, more = orientations(rows[:, 4:], rows[:, 1:4])
    track = Track("pose", "", "", rows[:, 0], np.ascontiguousarray(rows[:, 1:4]), orientation)
    return Recording(path, "tum", tracks={NAME: track}, epoch=epoch, notes=(*cut, *notes, *more))


def _in_seconds(piece: FloatArray, seconds: float) -> FloatArray:
    piece[:, 0] *= seconds
    return piece


def _within(piece: FloatArray, epoch: float, span: tuple[float, float] | None) -> FloatArray:
    """Rows on the recording's clock, those within the span; of what has no time the reader complains later."""
    piece[:, 0] -= epoch
    if span is None:
        return piece
    return np.asarray(piece[~(piece[:, 0] < span[0]) & ~(piece[:, 0] > span[1])])


def _rows(path: Path, dialect: Dialect, names: list[str], notes: list[str]) -> Iterator[FloatArray]:
    try:
        for piece in pieces(path, dialect, names, notes=notes):
            yield np.stack([piece[n] for n in names], axis=1)
    except ClearwayError as error:
        raise ClearwayError(
            f"{error.problem}; a TUM trajectory has {len(COLUMNS)} numbers a line: {' '.join(COLUMNS)}", file=path
        ) from error


def ordered(t: FloatArray, path: Path, field: str) -> tuple[Any, tuple[str, ...]]:
    """As `in_order`, for lines of which few can have the stamp of another one.

    Raises:
        ClearwayError: as `in_order`, or most stamps occur more than once.
    """
    keep, notes = in_order(t, file=path, field=field)
    if 2 * len(keep) < len(t):
        raise ClearwayError(
            f"most of its {len(t)} lines have the stamp of another one: several bodies are in it, or the stamps are too coarse",
            file=path,
            field=field,
        )
    return keep, notes


def orientations(q: FloatArray, position: FloatArray) -> tuple[FloatArray | None, tuple[str, ...]]:
    """Unit quaternions (n, 4) xyzw of `q` (n, 4), NaN where it is none, and notes; None where none were measured.

    Args:
        position: (n, 3) m: what is at one and the same heading all the way along has none that was measured.
    """
    with np.errstate(all="ignore"):
        norm = np.linalg.norm(q, axis=1)
        unit = q / norm[:, None]
        bad = ~(np.abs(norm - 1) < 0.02)
    if bad.all() and len(q):
        return None, ("none of its quaternions is one: it has no heading",)
    unit[bad] = np.nan
    notes = [f"{int(bad.sum())} quaternions are not of length 1; taken as unseen"] if bad.any() else []
    seen = unit[~bad]
    far = np.isfinite(position).all(axis=1)
    moved = far.any() and float(np.ptp(position[far], axis=0).max()) > 0.5
    if len(seen) > 2 and moved and (seen == seen[0]).all() and np.abs(seen[0]).max() == 1:
        return None, (*notes, "its quaternion is the same all along though it moves: taken as not measured")
    return unit, tuple(notes)


def write(path: Path, recording: Recording) -> None:
    """The recording's first track as a TUM file; stamps are UNIX times where the recording knows them. Poses that were
    not measured are left out; without a heading the quaternion is that of none: 0 0 0 1.

    Raises:
        ClearwayError: there is no track, or the file can't be written.
    """
    if not recording.tracks:
        raise ClearwayError("there is no track to write", file=path)
    name, track = next(iter(recording.tracks.items()))
    q = track.orientation
    if q is None:
        q = np.tile((0.0, 0.0, 0.0, 1.0), (len(track.t), 1))
    rows: Any = np.column_stack((track.t + (recording.epoch or 0.0), track.position, q))
    rows = rows[np.isfinite(rows).all(axis=1)]
    with written(path) as f:
        f.write(f"# {name}\n# {' '.join(COLUMNS)}\n")
        np.savetxt(f, rows, fmt=["%.9f"] * 4 + ["%.12f"] * 4)


FORMATS = (Format("tum", "TUM trajectory", (".tum",), sniff, read, look_by(read), write),)

"""EuRoC's ground truth: `#timestamp [ns], p_RS_R_x [m], ..., q_RS_w [], q_RS_x [], ...` (Burri et al. 2016), and its kin.

The columns are told by their names, as several sets write them: `p_RS_R_x`, `p_x`, `tx` and `x` are a position, `q_RS_w`, `q_w` and `qw` a
quaternion, which a file of positions (a laser tracker's) lacks. Stamps are whole nanoseconds. The body is what the set calls so: an
inertial sensor or a camera, whose x need not be ahead.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats import beside, table, tum
from clearway.recordings.formats.delimited import Dialect, first_lines, head_of, header_of, pieces, split
from clearway.recordings.formats.format import Format, look_by
from clearway.recordings.formats.text import encoding_of
from clearway.recordings.recording import Recording, Track, Want

NAME = "trajectory"
"""As a file's only track is called."""

HEADER = (
    "#timestamp [ns]",
    "p_RS_R_x [m]",
    "p_RS_R_y [m]",
    "p_RS_R_z [m]",
    "q_RS_w []",
    "q_RS_x []",
    "q_RS_y []",
    "q_RS_z []",
)

_STAMP = re.compile(r"timestamp\s*(\[ns\])?")
_POSITION = re.compile(r"(?:p_(?:[a-z]+_)*|t|t_|)([xyz])\s*(?:\[m\])?")
_QUATERNION = re.compile(r"q_?(?:[a-z]+_)*([wxyz])\s*(?:\[\s*\])?")


def sniff(path: Path, head: bytes) -> bool:
    """Whether a comment of such columns stands before its first line, which begins with nanoseconds, and nobody describes it as a table."""
    if path.name and table.describes_a_table(beside.beside(path)):
        return False
    lines = first_lines(head)
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    comments = [line.lstrip("# \t") for line in lines if line.lstrip().startswith("#")]
    stamp = split(first, ",")[0] if first else ""
    return (
        bool(comments)
        and stamp.isascii()
        and stamp.isdigit()
        and len(stamp) > 12
        and _found(split(comments[-1], ",")) is not None
    )


def _found(header: Sequence[str]) -> dict[str, int] | None:
    """Which column is what, by the names: `t`, `x`, `y`, `z`, and `qw` to `qz` if there are any."""
    names = [n.strip().lower() for n in header]
    if not _STAMP.fullmatch(names[0]):
        return None
    found = {"t": 0}
    for i, name in enumerate(names[1:], 1):
        if m := _POSITION.fullmatch(name):
            found.setdefault(m[1], i)
        elif m := _QUATERNION.fullmatch(name):
            found.setdefault("q" + m[1], i)
    quaternion = {"qw", "qx", "qy", "qz"}
    if not {"x", "y", "z"} <= found.keys() or (found.keys() & quaternion and not quaternion <= found.keys()):
        return None
    return found


def read(path: Path, want: Want) -> Recording:
    """The trajectory, named `trajectory`; t = 0 is its first stamp.

    Raises:
        ClearwayError: it is no such file, or time goes backwards in it.
    """
    if want.names is not None and (other := sorted(want.names - {NAME})):
        raise unknown("track", other[0], (NAME,), file=path)
    dialect = Dialect(",", encoding=encoding_of(head_of(path)), header="comment")
    header = header_of(path, dialect)
    found = _found(header)
    if found is None:
        raise ClearwayError(f"its columns should be named in a comment as {', '.join(HEADER)}", file=path)
    at = {what: header[i] for what, i in found.items()}
    numbers = [c for what, c in at.items() if what != "t"]
    cut: list[str] = []
    stamps, rows = _columns(path, dialect, at["t"], numbers, cut)
    epoch = int(stamps[0]) if len(stamps) else None
    t = (stamps - (epoch or 0)) * 1e-9
    if want.span is not None:
        inside = (t >= want.span[0]) & (t <= want.span[1])
        t, rows = t[inside], rows[inside]
    keep, notes = tum.ordered(t, path, "timestamp")
    value = {what: rows[keep, i] for i, what in enumerate(w for w in at if w != "t")}
    position = np.stack([value[a] for a in "xyz"], axis=1)
    position[~np.isfinite(position).all(axis=1)] = np.nan
    orientation: FloatArray | None = None
    if "qw" in value:
        orientation, more = tum.orientations(np.stack([value["q" + a] for a in "xyzw"], axis=1), position)
        notes += more
    else:
        notes += ("it has no quaternions: no heading",)
    track = Track("pose", "", "", np.ascontiguousarray(t[keep]), position, orientation)
    return Recording(
        path, "euroc", tracks={NAME: track}, epoch=None if epoch is None else epoch * 1e-9, notes=(*cut, *notes)
    )


def _columns(path: Path, dialect: Dialect, stamp: str, numbers: list[str], notes: list[str]) -> tuple[Any, FloatArray]:
    """Stamps (n,) int64 [ns], exact, and the other columns (n, k)."""
    stamps, rows = [np.zeros(0, dtype=np.int64)], [np.zeros((0, len(numbers)))]
    for piece in pieces(path, dialect, numbers, [stamp], notes):
        if piece[stamp].null_count:
            raise ClearwayError("a line has no stamp", file=path, field=stamp)
        try:
            stamps.append(piece[stamp].cast(pa.int64()).to_numpy(zero_copy_only=False).astype(np.int64))
        except (pa.ArrowInvalid, ValueError) as error:
            raise ClearwayError(
                f"its stamps are not all whole numbers of ns: {error}", file=path, field=stamp
            ) from error
        rows.append(np.stack([piece[n] for n in numbers], axis=1))
    return np.concatenate(stamps), np.concatenate(rows)


FORMATS = (Format("euroc", "EuRoC ground truth (CSV)", (), sniff, read, look_by(read)),)

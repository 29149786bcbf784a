"""KITTI poses: twelve numbers a line, the rows of [R | t] of a 3x4 matrix, and the times in a file of their own.

The file has no time: `NAME_times.txt` or `times.txt` beside it, or `../sequences/NAME/times.txt` as the odometry set keeps it, has one
number a line, s. A TOML beside the file (`NAME.txt.toml`) may name it (`times = "stamps.txt"`), or say a constant rate (`rate = 10`, Hz).

As KITTI defines them the poses are those of the left camera in its first frame: x right, y down, z ahead (Geiger et al. 2012). They are
turned so that z is up and the body's own x is ahead. Others write poses of a robot in this form: then say `up = "z"`, and nothing is turned.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats import beside
from clearway.recordings.formats.delimited import Dialect, first_lines, head_of, is_number, pieces, stacked
from clearway.recordings.formats.format import Format, look_by
from clearway.recordings.formats.text import encoding_of
from clearway.recordings.formats.tum import ordered
from clearway.recordings.recording import Recording, Track, Want
from clearway.recordings.times import must_be
from clearway.validation import Table

NAME = "trajectory"
"""As a file's only track is called."""

EPOCH = 1e8
"""s; a time beyond it (1973) is taken for UNIX time."""

_CAMERA = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""From a camera's axes (x right, y down, z ahead) to a robot's (x ahead, y left, z up)."""


class Hints(Table):
    """What a file of KITTI poses doesn't say itself, in a TOML beside it."""

    times: str | None = Field(default=None, description="the file of times, from this one's folder")
    rate: float | None = Field(default=None, gt=0, le=1e6, description="Hz, where there is no file of times")
    up: Literal["-y", "z"] = Field(default="-y", description="-y: a camera's axes, as KITTI's; z: a robot's")


def sniff(path: Path, head: bytes) -> bool:
    """Whether every line of its beginning has twelve numbers, nine of them a rotation."""
    rows = [line.split() for line in first_lines(head) if line.strip()]
    if not rows or any(len(r) != 12 or not all(is_number(w) for w in r) for r in rows):
        return False
    matrix = np.array(rows, dtype=np.float64).reshape(-1, 3, 4)[:, :, :3]
    with np.errstate(all="ignore"):
        return bool((np.abs(matrix @ matrix.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < 0.02).mean() > 0.5)


def read(path: Path, want: Want) -> Recording:
    """The trajectory, named `trajectory`.

    Raises:
        ClearwayError: it is no such file, its times are nowhere, or they are fewer or more than its poses.
    """
    if want.names is not None and (other := sorted(want.names - {NAME})):
        raise unknown("track", other[0], (NAME,), file=path)
    hints = beside.hints(path, Hints)
    cut: list[str] = []
    rows = _numbers(path, 12, cut)
    t, said = _times(path, hints, len(rows), cut)
    epoch = float(t[0]) if len(t) and abs(t[0]) > EPOCH else None
    t = t - (epoch or 0.0)
    must_be("s", t, rows.reshape(-1, 3, 4)[:, :, 3], "write its times in s", file=path, field="times", said=False)
    keep, notes = ordered(t, path, "times")
    t, rows = t[keep], rows[keep]
    if want.span is not None:
        inside = (t >= want.span[0]) & (t <= want.span[1])
        t, rows = t[inside], rows[inside]
    pose = rows.reshape(-1, 3, 4)
    position, matrix = pose[:, :, 3], pose[:, :, :3]
    with np.errstate(all="ignore"):
        known = np.abs(matrix @ matrix.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < 0.02
        known &= np.linalg.det(np.where(np.isfinite(matrix), matrix, 0.0)) > 0
    if len(rows) and not known.any():
        raise ClearwayError("its lines hold no rotation: they are no KITTI poses", file=path)
    q = np.full((len(t), 4), np.nan)
    if known.any():
        turned = Rotation.from_matrix(matrix[known])
        q[known] = (turned if hints.up == "z" else _CAMERA * turned * _CAMERA.inv()).as_quat()
    position = np.where(np.isfinite(position).all(axis=1, keepdims=True), position, np.nan)
    if hints.up == "-y":
        position = position @ _CAMERA.as_matrix().T
        said = (*said, 'a camera\'s axes, as KITTI defines them: z ahead became x, -y became up; else say up = "z"')
    track = Track("pose", "", "", np.ascontiguousarray(t), np.ascontiguousarray(position), q)
    return Recording(path, "kitti", tracks={NAME: track}, epoch=epoch, notes=(*cut, *said, *notes), up=hints.up)


def _times(path: Path, hints: Hints, count: int, cut: list[str]) -> tuple[FloatArray, tuple[str, ...]]:
    """When each pose was taken, s, and where that stands."""
    if hints.rate is not None and hints.times is None:
        return np.arange(count) / hints.rate, (f"{hints.rate:g} poses a second, as stated beside it",)
    usual = (
        path.with_name(f"{path.stem}_times.txt"),
        path.with_name("times.txt"),
        path.parent.parent / "sequences" / path.stem / "times.txt",
    )
    where = (path.parent / hints.times,) if hints.times is not None else usual
    file = next((f for f in where if f.is_file()), None)
    if file is None:
        raise ClearwayError(
            f"has no times, and neither {where[0].name} nor times.txt stands beside it; put one there, or write a rate [Hz] into"
            f" {beside.beside(path).name}: rate = 10",
            file=path,
            field="times",
        )
    t = _numbers(file, 1, cut)[:, 0]
    if len(t) != count:
        said = f" ({'; '.join(cut)})" if cut else ""
        raise ClearwayError(f"has {len(t)} times; {path.name} has {count} poses{said}", file=file)
    return t, (f"times of {file.name}",)


def _numbers(path: Path, width: int, notes: list[str]) -> FloatArray:
    """The lines (n, width) of a file of numbers; of a last one that was cut off the `notes` are told.

    Raises:
        ClearwayError: it can't be read, or a line has other than `width` numbers.
    """
    dialect = Dialect(" ", encoding=encoding_of(head_of(path)), header="none", missing=("nan", "NaN"))
    names = [str(i + 1) for i in range(width)]
    try:
        found = pieces(path, dialect, names, notes=notes)
        return stacked((np.stack([piece[n] for n in names], axis=1) for piece in found), width)
    except ClearwayError as error:
        raise ClearwayError(f"{error.problem}; a line has {width} numbers", file=path) from error


FORMATS = (Format("kitti", "KITTI poses", (), sniff, read, look_by(read)),)

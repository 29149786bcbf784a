"""Motion out of a recording without any plan: what moves in it, cleaned as a plan's would be, as a table for any tool."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.placing import placed
from clearway.recordings import formats
from clearway.recordings.motion.markers import MarkerSet, motion_of_markers, motion_of_track, resolve
from clearway.recordings.motion.motion import Motion, MotionSpec
from clearway.recordings.motion.upright import other_axis
from clearway.recordings.recording import Contents, Recording, Want

LEAST = 3
"""Markers that make a body."""
COLUMNS = ("t", "x", "y", "theta", "v", "omega")
OWN = (
    "x, y and theta are of the markers' own frame, its origin in their middle, and v is its speed whichever way: where "
    "base_link is and where it faces, a test plan says"
)


_UP = "another axis than z seems to be up, {0}: {1}; if so, say which in a TOML beside the file (up = 'y')"


@dataclass(frozen=True, slots=True)
class Found:
    """A body of a recording.

    Attributes:
        name: Its name there.
        motion: Its motion, or None.
        problem: Why it has none.
    """

    name: str
    motion: Motion | None
    problem: str = ""


def cleaning_at(cutoff: str) -> MotionSpec:
    """How to clean, with the low-pass at `cutoff`: `residual`, `none` or Hz.

    Raises:
        ClearwayError: it is something else.
    """
    try:
        return MotionSpec.model_validate({"cutoff": cutoff if cutoff in ("residual", "none") else float(cutoff)})
    except ValueError as error:
        raise ClearwayError(f"{cutoff!r} is none of residual, none, or Hz above 0", field="cutoff") from error


def bodies_of(recording: Recording) -> list[str]:
    """The names of everything that can be seen to move: marker prefixes (`tiago:`), bodies, topics, pairs of frames."""
    points, count = recording.points, Counter[str]()
    if points is not None:
        seen: Any = np.isfinite(points.xyz).any(axis=(0, 2))
        count.update(n[: n.rindex(":") + 1] for n, there in zip(points.names, seen, strict=True) if there and ":" in n)
    return [p for p, n in count.items() if n >= LEAST] + [n for n, t in recording.tracks.items() if len(t.t) > 1]


def motions(
    path: str | Path,
    names: Sequence[str] = (),
    cleaning: MotionSpec | None = None,
    *,
    format: str | None = None,
) -> Iterator[Found]:
    """How bodies of a recording moved, in the recording's own frame.

    Args:
        names: Marker prefixes that end in `:`, markers separated by commas, bodies, topics, `parent->child`; empty:
            everything that is found, where what can't be cleaned comes with its problem.

    Raises:
        ClearwayError: the file can't be read, nothing in it moves, or a named body is not there or can't be cleaned.
    """
    if names:
        held = formats.look(path, format=format)
        sets = {name: _markers(name, held) for name in names}
        wanted = frozenset(n for name, members in sets.items() for n in (members or (name,)))
        recording = formats.read(path, Want(names=wanted), format=format)
    else:
        recording = formats.read(path, format=format)
        listed = () if recording.points is None else recording.points.names
        sets = {n: resolve(listed, n, file=path) if n.endswith(":") else () for n in bodies_of(recording)}
    if not sets:
        raise ClearwayError(
            "shows nothing that moves by itself; name markers with --body 'M1,M2,M3', or see what it holds with --list",
            file=path,
        )
    for name, members in sets.items():
        try:
            yield Found(name, _motion(recording, name, members, cleaning or MotionSpec(), path))
        except ClearwayError as error:
            if names:
                raise
            yield Found(name, None, error.problem)


def _markers(name: str, held: Contents) -> tuple[str, ...]:
    """The markers that `name` stands for; none, if it is a track."""
    markers = [e.name for e in held.entries if e.kind == "marker"]
    tracks = [e.name for e in held.entries if e.kind != "marker"]
    if name in tracks or not markers:
        return ()  # whether it is there, and whether it moves, its reader says
    if name.endswith(":"):
        return resolve(markers, name, file=held.file)
    if "," in name:
        return resolve(markers, [n.strip() for n in name.split(",")], file=held.file)
    raise unknown("body", name, {*tracks, *(n[: n.rindex(":") + 1] for n in markers if ":" in n)}, file=held.file)


def _motion(recording: Recording, name: str, members: tuple[str, ...], cleaning: MotionSpec, path: object) -> Motion:
    if not members:
        if name not in recording.tracks:
            raise unknown("body", name, recording.tracks, file=path)
        track = recording.tracks[name]
        motion = motion_of_track(track, cleaning, None, file=path)
        other = None if recording.up_said else other_axis(track)
        said = () if other is None else (_UP.format(*other),)
        return replace(motion, notes=(*recording.notes, *motion.notes, *said))
    assert recording.points is not None
    motion = motion_of_markers(recording.points, MarkerSet(members), cleaning, None, file=path)
    return replace(
        motion,
        velocity=np.column_stack([_speed(motion), motion.velocity[:, 1]]),
        notes=(*recording.notes, *motion.notes, OWN),
    )


def _speed(motion: Motion) -> FloatArray:
    """(n,) m/s over the floor: nobody knows which way such a body faces, so there is no forward and no backward."""
    if len(motion.t) < 2:
        return np.full(len(motion.t), np.nan)
    x, y = (np.gradient(motion.pose[:, i], motion.t) for i in (0, 1))
    return np.asarray(np.hypot(x, y))


def file_of(path: str | Path, name: str) -> str:
    """A file name for the motion of a body of a recording."""
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in name.replace("->", "-to-")).strip("-.")
    return f"{Path(path).stem}-{plain or 'body'}.csv"


def write_motion(motion: Motion, path: Path) -> None:
    """Write a motion as CSV: t [s], x, y [m], theta [rad, in -pi to pi], v [m/s], omega [rad/s], and of
    markers the residual of the rigid fit [m] in each frame; unknown is empty.

    Raises:
        ClearwayError: the file is there already, or can't be written.
    """
    fitted = [] if motion.residual is None else [motion.residual]
    names = (*COLUMNS, "residual")[: len(COLUMNS) + len(fitted)]
    values = np.round(np.column_stack([motion.t, motion.wrapped, motion.velocity, *fitted]), 6) + 0.0
    table = pa.table({n: pa.array(values[:, i], from_pandas=True) for i, n in enumerate(names)})
    if os.path.exists(path):
        raise ClearwayError("is there already; name another folder", file=path)
    with placed(path.parent) as new, open(new / path.name, "wb") as f:
        f.write((",".join(names) + "\n").encode())
        pyarrow.csv.write_csv(table, f, pyarrow.csv.WriteOptions(include_header=False))


def summary(motion: Motion) -> dict[str, Any]:
    """What can be said of a motion in a line: SI units; gaps by what they were filled from, with the longest, s. The length is
    that of what is known: nothing is counted over a gap that was left open, whether samples lack there or positions."""
    at = motion.pose[:, :2]
    seen: Any = np.isfinite(at).all(axis=1)
    steps = np.hypot(*np.diff(at, axis=0).T) if len(at) > 1 else np.zeros(0)
    q = motion.quality
    for gap in q.gaps:
        if not gap.filled:
            steps[(motion.t[:-1] >= gap.start) & (motion.t[1:] <= gap.end)] = np.nan
    return {
        "samples": len(motion.t),
        "start": float(motion.t[0]) if len(motion.t) else None,
        "end": float(motion.t[-1]) if len(motion.t) else None,
        "rate": q.rate,
        "seen": q.seen,
        "known": float(seen.mean()) if len(seen) else 0.0,
        "length": float(steps[np.isfinite(steps)].sum()),
        "gaps": {
            kind or "open": {"count": len(of), "longest": max((g.end - g.start for g in of), default=0.0)}
            for kind in ("markers", "spline", "")
            if (of := [g for g in q.gaps if g.filled == kind])
        },
        "residual": q.residual,
        "residual_max": q.residual_max,
        "swapped": q.swapped,
        "refused": q.refused,
        "noise": q.noise,
        "cutoff": q.cutoff,
        "notes": list(motion.notes),
    }

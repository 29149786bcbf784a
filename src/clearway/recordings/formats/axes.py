"""Which axis of a file points up, where the file doesn't say: positions and bodies' own axes are turned so that z does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.geometry.shapes import FloatArray
from clearway.recordings.recording import Recording, Track

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
"""An axis of a file, with its sign."""

TURNS: dict[str, tuple[tuple[int, int, int], ...]] = {
    "x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}
"""Proper rotations that take the axis that is up to z."""


def turn_of(axis: str) -> FloatArray:
    """The rotation (3, 3) that takes an axis to z."""
    return np.array(TURNS[axis], dtype=np.float64)


def turned(recording: Recording, axis: str) -> Recording:
    """The recording with `axis` of its file up, whatever its reader took for it. Scans, goals and paths stay as they are: they are
    given on the floor.

    Args:
        recording: What was read.
        axis: The axis of the file that points up.
    """
    if axis == recording.up:
        return recording
    turn = turn_of(axis) @ turn_of(recording.up).T
    points = recording.points and replace(recording.points, xyz=recording.points.xyz @ turn.T)
    tracks = {name: track_turned(track, turn) for name, track in recording.tracks.items()}
    note = f"its {axis} axis is up, as was said: turned to z-up"
    return replace(recording, points=points, tracks=tracks, up=axis, notes=(*recording.notes, note))


def track_turned(track: Track, turn: FloatArray) -> Track:
    """A track whose frame and whose body's own axes are turned by the rotation `turn` (3, 3); speeds and uncertainties that are
    about other axes then are not known any more."""
    orientation = None
    if (q := track.orientation) is not None:
        orientation = np.full_like(q, np.nan)
        known = np.isfinite(q).all(axis=1) & (np.linalg.norm(q, axis=1) > 0.5)
        by = Rotation.from_matrix(turn)
        if known.any():
            orientation[known] = (by * Rotation.from_quat(q[known]) * by.inv()).as_quat()
    ahead, up = (turn[i, i] if abs(turn[i, i]) > 0.5 else np.nan for i in (0, 2))
    twist = None if track.twist is None else track.twist * [ahead, up]
    sigma = None if track.sigma is None else track.sigma * [1.0, abs(up)]
    return replace(track, position=track.position @ turn.T, orientation=orientation, twist=twist, sigma=sigma)


def tracks_turned(recording: Recording, ups: Mapping[str, str]) -> Recording:
    """The recording with single tracks turned, each so that its own axis is up.

    Args:
        recording: What was read, with one axis up throughout.
        ups: Axes of the file, by the names of tracks.
    """
    tracks, notes = dict(recording.tracks), list(recording.notes)
    for name, axis in ups.items():
        if name in tracks and axis != recording.up:
            tracks[name] = track_turned(tracks[name], turn_of(axis) @ turn_of(recording.up).T)
            notes.append(f"{name}: its {axis} axis is up, as was said: turned to z-up")
    return replace(recording, tracks=tracks, notes=tuple(notes))


def of_file(axis: str, up: str) -> str:
    """What an axis of the turned recording, `x`, `y` or `z`, is in a file whose axis `up` was taken as up."""
    at = turn_of(up)["xyz".index(axis)]
    k = int(np.argmax(np.abs(at)))
    return ("-" if at[k] < 0 else "") + "xyz"[k]

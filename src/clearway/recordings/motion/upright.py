"""Whether z is up in a track, by how its body moved: what drives on a floor stays on it, and turns about what is up."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.recordings.recording import Track

LOOKED_AT = 2000
"""Samples that are looked at, evenly over a track."""
RISE = 0.5
"""m; what rises by less may stand on a floor that isn't level."""
FLATTER = 5.0
"""Another axis has to be so many times flatter than z."""
TURNED, STEADY = math.radians(20), math.radians(6)
"""rad; a body that turned by the first against z, and by less than the second against another axis, turned about that one."""


def other_axis(track: Track) -> tuple[str, str] | None:
    """The axis that is up rather than z, and how that is seen; None where nothing speaks against z. Which way along it is not seen.

    Args:
        track: Poses whose z was taken as up.
    """
    step = max(1, len(track.t) // LOOKED_AT)
    position = track.position[::step]
    turned = None if track.orientation is None else _about(track.orientation[::step])
    if turned is not None and turned[2] > TURNED and min(turned[:2]) < STEADY:
        axis = "xy"[int(np.argmin(turned[:2]))]
        lean, other = math.degrees(turned[2]), math.degrees(min(turned[:2]))
        return (
            axis,
            f"it leans by {lean:.0f} degrees with z up, and by {other:.0f} with {axis} up, about which it turned",
        )
    seen = position[np.isfinite(position).all(axis=1)]
    if len(seen) < 3:
        return None
    low, high = np.percentile(seen, (1, 99), axis=0)
    x, y, z = (float(v) for v in high - low)
    if z > RISE and z > FLATTER * min(x, y) and not _upright(turned):
        axis = "x" if x < y else "y"
        return axis, f"it moves by {x:.2f} m and {y:.2f} m over the floor and by {z:.2f} m up and down"
    return None


def _about(orientation: np.ndarray) -> tuple[float, float, float] | None:
    """By how much each axis of the frame turned as seen from the body (95 % of the time), rad; None without headings."""
    with np.errstate(invalid="ignore"):
        known = np.isfinite(orientation).all(axis=1) & (np.linalg.norm(orientation, axis=1) > 0.5)
    if known.sum() < 3:
        return None
    seen = Rotation.from_quat(orientation[known]).inv().as_matrix()  # its columns: the frame's axes in the body's
    usual = np.median(seen, axis=0)
    usual = usual / np.maximum(np.linalg.norm(usual, axis=0), 1e-9)
    off = np.arccos(np.clip((seen * usual).sum(axis=1), -1.0, 1.0))
    x, y, z = (float(v) for v in np.percentile(off, 95, axis=0))
    return x, y, z


def _upright(turned: tuple[float, float, float] | None) -> bool:
    """Whether a body turned about z, and about no other axis."""
    return turned is not None and turned[2] < STEADY and max(turned[:2]) > TURNED

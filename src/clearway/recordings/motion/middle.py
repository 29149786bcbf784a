"""The middle of markers as a track: where somebody is who wears them, without a word of where they sit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.geometry.shapes import FloatArray
from clearway.recordings.recording import Points, Track

Mask = npt.NDArray[np.bool_]
HIDDEN = 1.0
"""s; a marker that is hidden for longer may have turned to the other side of its bearer: where the middle is then is not known."""
OFTEN = 0.5
"""A marker that is seen in a smaller share of the samples in which another is does not count."""


def group_of(marker: str) -> str:
    """Whose marker it is, by its name: what stands before its last colon; without one it stands for itself."""
    return marker.rpartition(":")[0] or marker


def middle_of(points: Points, names: Sequence[str]) -> Track:
    """The track of the markers' middle, without orientation.

    While some are hidden, the middle is where the others say: each is as far from it as before and after, evenly in between.
    Where that is not known for `HIDDEN`, neither is the middle.

    Args:
        points: The capture.
        names: Those of its markers that one thing bears.
    """
    xyz = points.xyz[:, [points.names.index(name) for name in names]]
    seen: Any = np.isfinite(xyz).all(axis=2)
    often = seen.sum(axis=0)
    counts = often >= OFTEN * seen.any(axis=1).sum()
    if not (counts.any() and seen[:, counts].all(axis=1).any()):  # never all together: the one that is seen most
        counts = np.arange(len(names)) == int(often.argmax())
    return Track("body", "", "", points.t, _middle(points.t, xyz[:, counts], seen[:, counts]))


def _middle(t: FloatArray, xyz: FloatArray, seen: Mask) -> FloatArray:
    """(n, 3) m, NaN where unknown, of markers at `xyz` (n, m, 3), of which `seen` (n, m) says which are there."""
    whole = np.flatnonzero(seen.all(axis=1))
    found = np.full((len(t), 3), np.nan)
    if not len(whole):
        return found
    found[whole] = xyz[whole].mean(axis=1)
    part = np.flatnonzero(seen.any(axis=1) & ~seen.all(axis=1))
    after = np.searchsorted(whole, part)
    before, behind = whole[np.maximum(after - 1, 0)], whole[np.minimum(after, len(whole) - 1)]
    part = part[np.minimum(np.abs(t[part] - t[before]), np.abs(t[behind] - t[part])) <= HIDDEN]
    off = xyz[whole] - found[whole, None]
    for k in range(xyz.shape[1]):
        for axis in range(3):
            xyz[part, k, axis] -= np.interp(t[part], t[whole], off[:, k, axis])
    there = np.where(seen[part, :, None], xyz[part], 0.0)
    found[part] = there.sum(axis=1) / seen[part].sum(axis=1)[:, None]
    return found

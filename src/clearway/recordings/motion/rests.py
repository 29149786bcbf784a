"""When a body was at rest, to a fraction of a sample: what legs are found by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion

ARM = 0.3
"""m; turning at omega counts as driving at ARM * omega, about the speed of a robot's rim."""
STILL = 0.02
"""m/s; slower is rest, unless the measurement is noisier."""
NOISY = 0.06
"""m/s; what is faster is motion, however noisy the measurement."""
TWITCH = 0.005
"""m (turning by ARM rad); what leads no farther doesn't end a rest."""
NOISE = 0.02
"""m; nor does what leads four times as far as the pose wanders in the rest, up to this."""
_BLOCK = 0.3  # s; the quietest blocks show the noise
_RAMP = 0.3  # s; an onset lies no farther before the speed is seen to rise


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """A stretch in which the body stood.

    Attributes:
        start: When it begins, s.
        end: When it ends, s.
        pose: (3,) where it stood: x, y [m], theta [rad], NaN where unknown.
        opens: Whether the record begins within it.
        closes: Whether the record ends within it.
    """

    start: float
    end: float
    pose: FloatArray
    opens: bool
    closes: bool

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self.end - self.start


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The seen part of a motion.

    Attributes:
        t: (n,) time, s.
        pose: (n, 3) x, y [m], theta [rad].
        rests: The rests in it.
        stands: The stretches in which it at most turned.
    """

    t: FloatArray
    pose: FloatArray
    rests: tuple[Rest, ...]
    stands: tuple[Rest, ...]


def course(motion: Motion) -> Course:
    """`motion` where it was seen, and its rests.

    Speed falls and rises steadily about a rest: it begins and ends where that line meets zero.

    Raises:
        ClearwayError: the body was seen in fewer than three samples.
    """
    seen = np.isfinite(motion.pose[:, :2]).all(axis=1)
    t, pose = motion.t[seen], motion.pose[seen]
    if len(t) < 3:
        raise ClearwayError(f"the robot is seen in {len(t)} samples; no leg can be found in so few")
    v = _speed(t, pose, motion.velocity[seen])
    omega = motion.velocity[seen, 1]
    return Course(
        t, pose, _rests(t, pose, np.hypot(v, ARM * np.where(np.isfinite(omega), omega, 0.0))), _rests(t, pose, v)
    )


def _rests(t: FloatArray, pose: FloatArray, effort: FloatArray) -> tuple[Rest, ...]:
    low, still = _levels(t, effort)
    n = len(t)
    rests = []
    for first, last in _stretches(t, pose, effort < low):
        start = -_onset(-t[::-1], effort[::-1], n - 1 - first, low, still) if first else float(t[0])
        end = _onset(t, effort, last, low, still) if last < n - 1 else float(t[-1])
        middle = np.median(pose[first : last + 1], axis=0)
        rests.append(Rest(min(start, end), end, middle, first == 0, last == n - 1))
    return tuple(rests)


def _speed(t: FloatArray, pose: FloatArray, velocity: FloatArray) -> Any:
    """(n,) m/s. Where the body slides or is carried sideways, its own v doesn't show it."""
    across = np.hypot(*np.gradient(pose[:, :2], t, axis=0).T)
    v = np.abs(velocity[:, 0])
    return np.where(np.isfinite(v) & (across < 2 * v + 2 * NOISY), v, across)


def _levels(t: FloatArray, effort: FloatArray) -> tuple[float, float]:
    """m/s below which the body rests, by what it shows in its quietest tenth, and at which it doesn't move at all."""
    block = np.floor((t - t[0]) / _BLOCK).astype(np.int64)
    first = np.flatnonzero(np.diff(block, prepend=-1))
    quiet = float(np.percentile(np.maximum.reduceat(effort, first), 10))
    low = float(np.clip(1.5 * quiet, STILL, NOISY))
    return low, float(np.clip(0.5 * quiet, 0.1 * low, 0.3 * low))


def _stretches(t: FloatArray, pose: FloatArray, resting: Any) -> list[tuple[int, int]]:
    """First and last sample of each rest; those that only a twitch parts are one, those that a hole parts from which the
    body came out elsewhere are two."""
    hole = np.diff(t) > 3 * np.median(np.diff(t))
    elsewhere = hole & (_apart(pose[1:], pose[:-1]) > TWITCH)
    edges = np.flatnonzero((np.diff(resting.astype(np.int8)) != 0) | elsewhere) + 1
    bounds = [0, *edges.tolist(), len(t)]
    runs = [(a, b - 1) for a, b in pairwise(bounds) if resting[a]]
    merged: list[tuple[int, int]] = []
    for first, last in runs:
        if merged and t[first] - t[merged[-1][1]] < 1.0:
            before = merged[-1]
            rested = pose[before[0] : before[1] + 1]
            middle = np.median(rested, axis=0)
            noise = min(4.0 * math.sqrt(np.square(_apart(rested, middle)).mean()), NOISE)
            if _apart(pose[before[1] : first + 1], middle).max() < max(TWITCH, noise):
                merged[-1] = before[0], last
                continue
        merged.append((first, last))
    return merged


def _apart(a: Any, b: Any) -> Any:
    """m between poses (..., 3), turning included, as far as it is known."""
    turn = np.nan_to_num(np.abs(np.remainder(a[..., 2] - b[..., 2] + np.pi, 2 * np.pi) - np.pi))
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1]) + ARM * turn


def _onset(t: FloatArray, effort: FloatArray, last: int, low: float, still: float) -> float:
    """When motion began after the resting sample `last`: the speed's rise through `low` and beyond, drawn back to zero,
    but not to before the last sample that stood `still`, as a robot may creep."""
    ahead = slice(last, int(np.searchsorted(t, t[last + 1] + 0.5, side="right")))
    at, e = t[ahead], effort[ahead]
    high = min(4 * low, 0.7 * float(e.max()))
    first = _crossing(at, e, low)
    if high <= 1.2 * low:
        return first
    second = _crossing(at, e, high)
    drawn = first - low * (second - first) / (high - low)
    before = effort[int(np.searchsorted(t, first - _RAMP)) : last + 1]
    stood = np.flatnonzero(before <= still)
    return max(drawn, first - _RAMP, float(t[last + 1 - len(before) + stood[-1]]) if len(stood) else -np.inf)


def _crossing(t: FloatArray, effort: FloatArray, level: float) -> float:
    i = int(np.argmax(effort >= level))
    if i == 0:
        return float(t[0])
    share = (level - effort[i - 1]) / (effort[i] - effort[i - 1])
    return float(t[i - 1] + share * (t[i] - t[i - 1]))

"""How whoever drives a body along a path keeps to it: within a hand's breadth, but through its way points, and turning where it bends."""

from __future__ import annotations

import itertools
import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.scenarios.scenario import RunSpec

_WAVES = ((0.7, 6.0), (0.3, 3.5))
"""Share of the line keeping, and length [m] of the waves in which a hand strays from a line."""
_CLOSE = 1.0
"""Nearer than this to a way point where the path bends the hand comes back to it, m."""
_STRAIGHT = 1e-9
"""A path that turns by less at a way point goes straight on, rad."""
_HANDS = 8
"""So many phases of each wave are tried where any hand is asked about."""
_BEND = 0.5
"""From so far before such a way point until as far beyond it the body turns, m; to half of the way to the next one at most."""


class Line:
    """One run as it is driven.

    Args:
        run: The run.
        stray: The most that its path is left by, m.
        phases: (2,) of the waves in which it is, rad, see `hand`.

    Attributes:
        points: (n, 2) its way points where it bends, m.
        along: (n,) length up to each, m.
        stray: The most that it is left by, m.
        phases: (2,) of the waves in which it is, rad.
        length: m.
    """

    def __init__(self, run: RunSpec, stray: float, phases: FloatArray) -> None:
        points = np.array(run.path, dtype=np.float64)
        points = points[np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 0.0])]
        bends = [abs(_turn(points, k)) > _STRAIGHT for k in range(1, len(points) - 1)]
        self.points = np.ascontiguousarray(points[[True, *bends, True]])
        self.along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        self.stray, self.phases, self.length = stray, phases, float(self.along[-1])

    def pose(self, s: float) -> FloatArray:
        """(3,) at `s` [m] along it."""
        out = np.empty(3)
        pose_on(self.points, self.along, self.stray, self.phases, s, out)
        return out

    def poses(self, s: FloatArray) -> FloatArray:
        """(n, 3) at `s` (n,) [m] along it."""
        out = np.empty((len(s), 3))
        _poses_on(self.points, self.along, self.stray, self.phases, s, out)
        return out


def hand(seed: int, name: str) -> FloatArray:
    """How the hand strays that drives the body of this name in the trial with this seed: (2,) phases."""
    key = stream(seed, f"operator {name}")
    return np.array([math.tau * uniform(key, 0, i) for i in range(len(_WAVES))])


def hands(run: RunSpec, stray: float) -> list[Line]:
    """A run as so many hands drive it that everywhere one of them strays as far as any that leaves the path by `stray` [m] at most."""
    turns = [math.tau * k / _HANDS for k in range(_HANDS)]
    return [
        Line(run, stray / math.cos(math.pi / _HANDS), np.array(phases)) for phases in itertools.product(turns, turns)
    ]


def steepest(stray: float) -> float:
    """How many metres, at most, a hand that strays by `stray` [m] goes aside in a metre."""
    return stray * (sum(share * math.tau / length for share, length in _WAVES) + 1.5 / _CLOSE)


@kernel
def pose_on(points: FloatArray, along: FloatArray, stray: float, phases: FloatArray, s: float, out: FloatArray) -> None:
    """Write the pose at `s` [m] along a path to `out` (3,).

    Args:
        points: As `Line` has it.
        along: The same.
        stray: The same.
        phases: The same.
    """
    k = min(max(int(np.searchsorted(along, s, side="right")) - 1, 0), len(along) - 2)
    span = along[k + 1] - along[k]
    cx, cy = (points[k + 1, 0] - points[k, 0]) / span, (points[k + 1, 1] - points[k, 1]) / span
    off, slope = 0.0, 0.0
    for i in range(2):
        share, length = _WAVES[i]
        rate = math.tau / length
        off += stray * share * math.sin(rate * s + phases[i])
        slope += stray * share * rate * math.cos(rate * s + phases[i])
    heading = math.atan2(cy, cx)
    for end in range(2):  # of the straight piece: where it begins, and where it ends
        corner, way = k + end, 1.0 - 2.0 * end
        if not 0 < corner < len(along) - 1:
            continue
        away = abs(s - along[corner])
        if away < _CLOSE:
            u = away / _CLOSE
            ease = u * u * (3.0 - 2.0 * u)
            off, slope = ease * off, ease * slope + way * 6.0 * u * (1.0 - u) / _CLOSE * off
        bend = min(_BEND, 0.5 * min(along[corner + 1] - along[corner], along[corner] - along[corner - 1]))
        heading -= way * 0.5 * max(1.0 - away / bend, 0.0) * _turn(points, corner)
    out[0] = points[k, 0] + (s - along[k]) * cx - off * cy
    out[1] = points[k, 1] + (s - along[k]) * cy + off * cx
    out[2] = wrap(heading + math.atan(slope))


@kernel
def _poses_on(
    points: FloatArray, along: FloatArray, stray: float, phases: FloatArray, s: FloatArray, out: FloatArray
) -> None:
    for k in range(len(s)):
        pose_on(points, along, stray, phases, s[k], out[k])


@kernel
def _turn(points: FloatArray, k: int) -> float:
    """By how much the path `points` (n, 2) turns to the left at number `k` of them, rad."""
    ax, ay = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
    bx, by = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)

"""Motion through key frames, round after round, as Gazebo's `PoseAnimation` moves a model (gazebo-classic,
`gazebo/common/Animation.cc` and `gazebo/physics/Entity.cc`; ignition-math, `Spline.cc`).

Between two key frames it goes along a cubic, evenly in that cubic's own parameter: a Catmull-Rom spline with tension 0,
whose tangent at a key frame is half the way from the one before to the one after, *whatever the times*. At the first and
the last one it is half the way to the only neighbour, or, where both are at the same place, half the way from the last but
one to the second. So the way is smooth, and the velocity jumps at a key frame whose neighbours lie at unequal times apart.
After the last key frame it begins anew; one that ends elsewhere than it began is there at once. Here such a one is absent for the
last `AWAY` of its round: a trial is a line from sample to sample, and nothing may be taken to have swept the way back.
"""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from clearway.geometry.shapes import FloatArray
from clearway.quantities import Finite, NonNegative
from clearway.reading.limits import POINTS, SECONDS, SPEED
from clearway.validation import Table

CHORD = 5e-4
"""What a line between two knots is off by at most, m: half of what Gazebo moves a model at 1 m/s by in a step of 1 ms."""
SOONEST = 0.01
"""The next key frame comes no sooner, s; DynaBARN's do after 0.03 s at least."""
SHORTEST_ROUND = 1.0
"""s; DynaBARN's take 12 s at least."""
AWAY = 0.1
"""For how long one that begins anew elsewhere is absent before it does, s: at least one sample of the Jackal says so; of a slower robot, an instant between two."""
Keyframe = tuple[Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=SECONDS)], Finite, Finite]


class SplineSpec(Table):
    """Motion through key frames along a Catmull-Rom spline, round after round, as Gazebo's `PoseAnimation` moves a model."""

    kind: Literal["spline"]
    keyframes: tuple[Keyframe, ...] = Field(
        min_length=2,
        max_length=POINTS,
        description="t [s], x [m], y [m]; the first at time 0, a round ends with the last",
    )
    offset: NonNegative = Field(
        default=0.0,
        le=SECONDS,
        description="how long before the trial it passed its first key frame for the first time, s",
    )

    @model_validator(mode="after")
    def _rises(self) -> SplineSpec:
        if self.keyframes[0][0] != 0.0:
            raise ValueError(f"the first key frame is at {self.keyframes[0][0]:g} s; it has to be at time 0")
        for (t0, *a), (t1, *b) in itertools.pairwise(self.keyframes):
            if t1 < t0 + SOONEST:
                raise ValueError(f"a key frame at {t1:g} s after one at {t0:g} s; at least {SOONEST:g} s lie between")
            if math.dist(a, b) > SPEED * (t1 - t0):
                raise ValueError(
                    f"it goes at {math.dist(a, b) / (t1 - t0):.0f} m/s after {t0:g} s; at most {SPEED:g} m/s"
                )
        if self.period < SHORTEST_ROUND:
            raise ValueError(f"a round of {self.period:g} s; it takes at least {SHORTEST_ROUND:g} s")
        return self

    @property
    def period(self) -> float:
        """How long a round takes, s."""
        return self.keyframes[-1][0]

    @property
    def closed(self) -> bool:
        """Whether a round ends where it begins."""
        return self.keyframes[0][1:] == self.keyframes[-1][1:]

    @property
    def start(self) -> tuple[float, float]:
        """Where it is at time 0, m."""
        x, y = position(self, 0.0).tolist()
        return x, y


def position(motion: SplineSpec, t: float) -> FloatArray:
    """(2,) where it is `t` s after the trial began, m."""
    times, cubics = _cubics(motion)
    now = math.fmod(t + motion.offset, motion.period)
    k = min(int(np.searchsorted(times, now, side="right")), len(times) - 1) - 1
    u = (now - times[k]) / (times[k + 1] - times[k])
    here: FloatArray = np.array([1.0, u, u * u, u * u * u]) @ cubics[k]
    return here


def knots(motion: SplineSpec, duration: float) -> FloatArray:
    """(k, 3) t [s], x, y [m] from time 0 on, for `duration` [s] and no less: lines between them keep within `CHORD` of it.

    Where it begins anew elsewhere, a NaN stands for the last `AWAY` of the round.
    """
    once, parts = _round(motion), []
    if not motion.closed:
        leaves = motion.period - AWAY
        there = [leaves, *position(motion, leaves - motion.offset)]
        once = np.concatenate([once[once[:, 0] < leaves], [there, [leaves, math.nan, math.nan]]])
    rounds = math.ceil((motion.offset % motion.period + duration) / motion.period + 1e-9)
    for n in range(rounds + 1):
        moved = once + np.array([n * motion.period - motion.offset % motion.period, 0.0, 0.0])
        parts.append(moved[1:] if n and motion.closed else moved)
    found = np.concatenate(parts)
    first = int(np.searchsorted(found[:, 0], 0.0, side="right")) - 1
    last = int(np.searchsorted(found[:, 0], duration, side="left"))
    return found[max(first, 0) : last + 1]


def _round(motion: SplineSpec) -> FloatArray:
    """(k, 3) the knots of one round from the first key frame to the last."""
    times, cubics = _cubics(motion)
    parts = []
    for k, cubic in enumerate(cubics):
        bend = max(math.hypot(*(2.0 * cubic[2])), math.hypot(*(2.0 * cubic[2] + 6.0 * cubic[3])))  # linear in between
        u = np.linspace(0.0, 1.0, max(1, math.ceil(math.sqrt(bend / (8.0 * CHORD)))) + 1)[:-1]
        way = np.stack([np.ones_like(u), u, u**2, u**3], axis=1) @ cubic
        parts.append(np.column_stack([times[k] + u * (times[k + 1] - times[k]), way]))
    return np.concatenate([*parts, np.array(motion.keyframes[-1:])])


def _cubics(motion: SplineSpec) -> tuple[FloatArray, FloatArray]:
    """Times (n + 1,) of the key frames [s], and the coefficients (n, 4, 2) [m] of the cubics between them, whose parameter
    goes from 0 to 1: of its powers 0 to 3."""
    frames = np.array(motion.keyframes)
    points = frames[:, 1:]
    if motion.closed:
        around = np.concatenate([points[-2:-1], points, points[1:2]])
    else:
        around = np.concatenate([points[:1], points, points[-1:]])
    tangent = 0.5 * (around[2:] - around[:-2])
    p, q, m, n = points[:-1], points[1:], tangent[:-1], tangent[1:]
    return frames[:, 0], np.stack([p, m, 3.0 * (q - p) - 2.0 * m - n, 2.0 * (p - q) + m + n], axis=1)

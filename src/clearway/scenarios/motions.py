"""Ways in which an obstacle may move that no simple model of motion forecasts: what the suite `sar-misspecified` is made of.

Each is a few numbers, which `knots` lays out in time: a function of the numbers alone, known ahead of the trial and
independent of the robot. Between two knots the obstacle moves on a line at constant speed. Motion through given key frames
(`spline`) is laid out the same way.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from clearway.geometry.driven import driven
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.quantities import NonNegative, Point, Positive, Seed, Speed
from clearway.reading.limits import LENGTH, POINTS, SHORTEST, SPEED
from clearway.scenarios import spline
from clearway.scenarios.spline import SplineSpec
from clearway.validation import Table

KNOT = 0.05
"""Time between two knots, s."""

FASTEST = 1e4
"""Of accelerations [m/s^2], stiffness [1/s^2] and damping [1/s]: beyond it nothing moves that is seen at `KNOT`."""
Along = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-SPEED, le=SPEED)]
Stiffness = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=FASTEST)]
Velocity = tuple[Along, Along]
"""m/s."""


def _ascending(between: tuple[float, float]) -> tuple[float, float]:
    if between[0] > between[1]:
        raise ValueError(f"({between[0]:g}, {between[1]:g}) is no range; the smaller number stands first")
    return between


Range = Annotated[tuple[Positive, Positive], AfterValidator(_ascending)]


class _Motion(Table):
    """What every motion has."""

    start: Point = Field(description="where it is at time 0, m")
    velocity: Velocity = Field(default=(0.0, 0.0), description="at time 0, m/s")
    speed: Speed = Field(description="the most that it ever does, m/s")
    acceleration: Positive = Field(le=FASTEST, description="the most that it ever does, m/s^2")

    @model_validator(mode="after")
    def _within_bounds(self) -> _Motion:
        if math.hypot(*self.velocity) > self.speed:
            raise ValueError(f"velocity is {self.velocity}, beyond speed {self.speed:g} m/s")
        return self


class DampedSpec(_Motion):
    """Oscillation that dies away: x'' = stiffness (attraction - x) - damping x' per axis."""

    kind: Literal["damped"]
    attraction: Point = Field(description="m")
    stiffness: tuple[Stiffness, Stiffness] = Field(description="1/s^2")
    damping: NonNegative = Field(le=FASTEST, description="1/s")


class ShakenSpec(_Motion):
    """Damped oscillation that is pushed at random: now here, now there, each push for a while."""

    kind: Literal["shaken"]
    attraction: Point = Field(description="m")
    stiffness: tuple[Stiffness, Stiffness] = Field(description="1/s^2")
    damping: NonNegative = Field(le=FASTEST, description="1/s")
    push: Positive = Field(le=FASTEST, description="the most that it is pushed, uniform in a disc, m/s^2")
    hold: Range = Field(description="how long a push lasts: from, to, uniform, s")
    seed: Seed = Field(description="of the pushes")


class StopAndGoSpec(_Motion):
    """Drives straight towards some place in a square, stops, waits, and drives on towards another one."""

    kind: Literal["stop-and-go"]
    region: Annotated[Point, AfterValidator(_ascending)] = Field(
        description="from, to, on both axes, where the places lie, m"
    )
    pace: Range = Field(description="speed of a drive: from, to, uniform, m/s")
    drive: Range = Field(description="its longest duration: from, to, uniform, s")
    rest: Range = Field(description="duration of a stop: from, to, uniform, s")
    lag: Positive = Field(ge=SHORTEST, description="time constant of starting and stopping, s")
    seed: Seed = Field(description="of all these")


class PursuitSpec(_Motion):
    """Chases a point that patrols a path at constant speed, to its end and back, and lags behind it."""

    kind: Literal["pursuit"]
    path: tuple[Point, ...] = Field(min_length=2, max_length=POINTS, description="way points, m")
    pace: Speed = Field(description="speed of the point, m/s")
    stiffness: Stiffness = Field(description="pull towards the point, 1/s^2")
    damping: NonNegative = Field(le=FASTEST, description="1/s")

    @model_validator(mode="after")
    def _has_length(self) -> PursuitSpec:
        length = sum(math.dist(p, q) for p, q in itertools.pairwise(self.path))
        if length < SHORTEST:
            raise ValueError("the path has no length")
        if length > LENGTH:
            raise ValueError(f"the path is {length:g} m long; at most {LENGTH:g} m are")
        return self


DrivenSpec = Annotated[DampedSpec | ShakenSpec | StopAndGoSpec | PursuitSpec, Field(discriminator="kind")]
"""What is pulled, braked and pushed about."""
MotionSpec = Annotated[DampedSpec | ShakenSpec | StopAndGoSpec | PursuitSpec | SplineSpec, Field(discriminator="kind")]


def knots(motion: MotionSpec, duration: float) -> FloatArray:
    """(k, 3) t [s], x, y [m] from time 0 on, for `duration` [s] and no less, on a line from one to the next; a NaN stands
    between two at one time where it is elsewhere at once."""
    if isinstance(motion, SplineSpec):
        return spline.knots(motion, duration)
    way = states(motion, duration)[:, :2]
    return np.column_stack([KNOT * np.arange(len(way)), way])


def states(motion: DrivenSpec, duration: float) -> FloatArray:
    """(k, 4) x, y [m], v_x, v_y [m/s] every `KNOT` s from time 0 on, for `duration` [s] and no less. A longer one goes on
    where a shorter one ends."""
    count = math.ceil(duration / KNOT - 1e-9)
    still = np.zeros((count, 2))
    target, stiffness, push = still, np.zeros(2), still
    if isinstance(motion, PursuitSpec):
        target, stiffness, damping = _patrol(motion, count), np.full(2, motion.stiffness), motion.damping
    elif isinstance(motion, StopAndGoSpec):
        push, damping = _held(_drives(motion), count) / motion.lag, 1.0 / motion.lag
    else:
        target, stiffness = np.tile(np.array(motion.attraction), (count, 1)), np.array(motion.stiffness)
        damping = motion.damping
        if isinstance(motion, ShakenSpec):
            push = _held(_pushes(motion), count)
    return driven(
        np.array(motion.start), np.array(motion.velocity), target, stiffness, push, damping, motion.speed,
        motion.acceleration, KNOT,
    )  # fmt: skip


def effort(motion: MotionSpec, duration: float) -> float:
    """About what `knots` takes, in comparisons: a piece that is drawn takes as long as 400, a key frame as 100 knots."""
    if isinstance(motion, SplineSpec):
        return 100.0 * len(motion.keyframes) * (1.0 + duration / motion.period)
    shortest = (
        motion.hold[0]
        if isinstance(motion, ShakenSpec)
        else motion.rest[0]
        if isinstance(motion, StopAndGoSpec)
        else math.inf
    )
    return duration / KNOT + 400.0 * duration / max(shortest, KNOT)


def _patrol(motion: PursuitSpec, count: int) -> FloatArray:
    """(count, 2) where the chased point is."""
    path = np.array(motion.path)
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    gone = np.mod(motion.pace * KNOT * np.arange(count), 2.0 * reached[-1])
    gone = np.minimum(gone, 2.0 * reached[-1] - gone)
    return np.stack([np.interp(gone, reached, path[:, k]) for k in range(2)], axis=1)


def _held(pieces: Iterator[tuple[float, float, float]], count: int) -> FloatArray:
    """(count, 2) the vectors of `pieces`, each (duration [s], x, y), one after another."""
    out, k = np.zeros((count, 2)), 0
    while k < count:
        duration, x, y = next(pieces)
        end = k + max(1, round(duration / KNOT))
        out[k:end], k = (x, y), end
    return out


def _draws(seed: int) -> Callable[[int, int, tuple[float, float]], float]:
    """Uniform numbers by piece, index and range."""
    key = stream(seed, "motion")
    return lambda piece, index, between: between[0] + (between[1] - between[0]) * uniform(key, piece, index)


def _pushes(motion: ShakenSpec) -> Iterator[tuple[float, float, float]]:
    drawn, piece = _draws(motion.seed), 0
    while True:
        size = motion.push * math.sqrt(drawn(piece, 1, (0.0, 1.0)))
        angle = drawn(piece, 2, (0.0, math.tau))
        yield drawn(piece, 0, motion.hold), size * math.cos(angle), size * math.sin(angle)
        piece += 1


def _drives(motion: StopAndGoSpec) -> Iterator[tuple[float, float, float]]:
    drawn, piece, (x, y) = _draws(motion.seed), 0, motion.start
    while True:
        dx, dy = drawn(piece, 0, motion.region) - x, drawn(piece, 1, motion.region) - y
        far, pace = max(math.hypot(dx, dy), 1e-9), drawn(piece, 2, motion.pace)
        duration = KNOT * max(1, round(min(drawn(piece, 3, motion.drive), far / pace) / KNOT))
        vx, vy = pace * dx / far, pace * dy / far
        yield duration, vx, vy
        yield drawn(piece, 4, motion.rest), 0.0, 0.0
        x, y, piece = x + vx * duration, y + vy * duration, piece + 1

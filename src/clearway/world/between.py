"""What happened between two samples, where that decides how near a robot came to something that moves.

A trial has a sample for each control period. In between an obstacle may turn and the robot speed up, so that the lines from
sample to sample are off by millimetres. Of a period in which something that moves came as near as in no other before on that
leg, instants in between are kept too: as many as make the lines right. So are those of a period in which something was gone for an
instant and came back elsewhere.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.distance import contains
from clearway.geometry.held import Held
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius, inscribed_radius
from clearway.trials import Body, Instants
from clearway.world.setting import Setting, steps
from clearway.world.tracks import pose_at

OFF = 2e-4
"""By how much a line between two instants may be off, m."""
MARGIN = 0.01
"""Periods that come within this of the nearest so far are kept as well, m: more than the lines of the others are off by."""
_SAME = 1e-9  # s


class Near(NamedTuple):
    """How near a robot and m moving bodies have come to each other on a leg.

    Attributes:
        pivot: How far ahead of base_link the point is whose way `Setting.way` is, m.
        reach: (1 + m,) radius around its origin that no part of the robot and of each moving body leaves, m.
        inner: (m,) sum of the radii of the discs around their origins that the robot and each body hold, m.
        nearest: (2,) the least distance of two edges (a bound from above) and of two origins so far on this leg, m.
    """

    pivot: float
    reach: FloatArray
    inner: FloatArray
    nearest: FloatArray


class Between:
    """Collects these instants of a trial.

    Args:
        setting: Who moves among what; `Setting.way` says where the robot was in the last period.
        pivot: As in `Near`.
        footprint: The robot's, in base_link.
        moving: The bodies that move.

    Attributes:
        near: How near they have come.
    """

    def __init__(self, setting: Held[Setting], pivot: float, footprint: Shape, moving: list[Body]) -> None:
        own, theirs = circumscribed_radius(footprint), [circumscribed_radius(b.shape) for b in moving]
        inner = _held(footprint) + np.array([_held(b.shape) for b in moving], np.float64)
        self.near = Near(pivot, np.array([own, *theirs]), inner, np.full(2, math.inf))
        self._setting = setting
        self._found: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def begin_leg(self) -> None:
        """From now on the nearest of another leg counts."""
        self.near.nearest[:] = math.inf

    def look(self, leg: int, t: float, driven: float) -> None:
        """Keep what is worth it of the period that began at `t` [s] on leg `leg`, of which `driven` [s] were driven."""
        if not len(self.near.inner) or driven <= _SAME:
            return
        found = instants(self._setting, leg, t, driven, *self.near)
        if len(found[0]):
            self._found.append(found)

    def instants(self, end: float) -> Instants | None:
        """All of them up to the `end` [s] of the trial, after which a robot comes to rest; None if there is none."""
        if not self._found or self._found[0][0][0] >= end:
            return None
        t, pose, moving_obstacles = (np.concatenate(column) for column in zip(*self._found, strict=True))
        during = t < end
        return Instants(t[during], pose[during], moving_obstacles[during])


def _held(shape: Shape) -> float:
    """Radius of the disc around its origin that the shape holds, m; where that lies outside, how far from it, negative."""
    inside = isinstance(shape, Circle) or contains(shape.array, 0.0, 0.0)
    return inscribed_radius(shape) if inside else -inscribed_radius(shape)


@kernel
def instants(
    held: Held[Setting],
    leg: int,
    t: float,
    driven: float,
    pivot: float,
    reach: FloatArray,
    inner: FloatArray,
    nearest: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The instants of a period that are to be kept.

    Args:
        leg: Which leg is being driven, as in `Between`.
        t: As in `Between`.
        driven: As in `Between`.
        pivot: As in `Near`.
        reach: As in `Near`.
        inner: As in `Near`.
        nearest: As in `Near`; updated.

    Returns:
        (k,) s, (k, 3) poses of base_link and (k, m, 3) of the moving bodies, NaN while absent; k may be 0.
    """
    m = len(inner)
    times = _times(held, leg, t, driven)
    count = len(times)
    poses, moving = np.empty((count, 3)), np.empty((count, m, 3))
    _places(held, leg, t, pivot, times, poses, moving)
    low, high, origins, gone = math.inf, math.inf, math.inf, False
    for i in range(count):
        for b in range(m):
            d = math.hypot(moving[i, b, 0] - poses[i, 0], moving[i, b, 1] - poses[i, 1])
            if math.isfinite(d):
                low, high = min(low, d - reach[0] - reach[1 + b]), min(high, d - inner[b])
                origins = min(origins, d)
            elif math.isfinite(moving[0, b, 0]) and math.isfinite(moving[-1, b, 0]):
                gone = True  # for an instant: the line between the samples would not know
    record = gone or low < nearest[0] + MARGIN or origins < nearest[1] + MARGIN
    nearest[0], nearest[1] = min(nearest[0], max(high, 0.0)), min(nearest[1], origins)
    if not record:
        return np.empty(0), np.empty((0, 3)), np.empty((0, m, 3))
    kept = _worth_keeping(times, poses, moving, reach)
    return t + times[kept], poses[kept], moving[kept]


@light
def far(setting: Setting, near: Near, leg: int, t: float, driven: float) -> bool:
    """Whether nothing of the period that began at `t` [s], of which `driven` [s] were driven, is worth being kept: nothing can have come
    near enough, by where all were when it began and ended and how fast they are."""
    vehicle, moving, way = setting.vehicle, setting.moving, setting.way
    pivot, reach, nearest = near.pivot, near.reach, near.nearest
    if len(near.inner) == 0 or driven <= _SAME:
        return True
    own = 0.0
    h = vehicle.period / steps(vehicle.period)
    last = math.ceil(driven / h - 1e-6)
    for i in range(last):
        turned = abs(wrap(way[i + 1, 2] - way[i, 2]))
        own += 1.1 * math.hypot(way[i + 1, 0] - way[i, 0], way[i + 1, 1] - way[i, 1]) + turned * abs(pivot)
    x, y = way[0, 0] - pivot * math.cos(way[0, 2]), way[0, 1] - pivot * math.sin(way[0, 2])
    x1, y1 = way[last, 0] - pivot * math.cos(way[last, 2]), way[last, 1] - pivot * math.sin(way[last, 2])
    at = setting.room.here
    for b in range(len(moving.since)):
        speed = moving.tracks.speed[b]
        begin, end = moving.tracks.rows[leg, b, 0], moving.tracks.rows[leg, b, 1]
        there = pose_at(moving.tracks.knots, begin, end, t - moving.since[b], at)
        if not there or speed == math.inf:
            if end > begin:
                return False
            continue
        begun, ended = math.hypot(at[0] - x, at[1] - y), math.hypot(moving.poses[b, 0] - x1, moving.poses[b, 1] - y1)
        together = own + speed * driven  # of which they have come nearer by some, and gone apart again by some
        d = 0.5 * (begun + ended - together) if math.isfinite(ended) else begun - together
        if d - reach[0] - reach[1 + b] < nearest[0] + MARGIN or d < nearest[1] + MARGIN:
            return False
    return True


@kernel
def _times(held: Held[Setting], leg: int, t: float, driven: float) -> FloatArray:
    """Times since the period began at which anything may turn: the ends of the plant's steps, and the knots of the tracks."""
    vehicle, moving = held.value.vehicle, held.value.moving
    n = steps(vehicle.period)
    h = vehicle.period / n
    knots = moving.tracks.knots
    found = [0.0, driven]
    found += [i * h for i in range(1, n) if i * h < driven]
    for b in range(len(moving.since)):
        now = t - moving.since[b]
        begin, end = moving.tracks.rows[leg, b, 0], moving.tracks.rows[leg, b, 1]
        first = begin + np.searchsorted(knots[begin:end, 0], now)
        for k in range(first, end):
            if knots[k, 0] >= now + driven:
                break
            found.append(knots[k, 0] - now)
    times = np.sort(np.array(found))
    new = np.ones(len(times), np.bool_)
    for i in range(1, len(times)):
        new[i] = times[i] > times[i - 1] + _SAME
    times = times[new]
    times[-1] = driven
    return times


@kernel
def _places(
    held: Held[Setting], leg: int, t: float, pivot: float, times: FloatArray, poses: FloatArray, moving: FloatArray
) -> None:
    """Where all were at `times` (c,): into `poses` (c, 3) of base_link and `moving` (c, m, 3)."""
    vehicle, bodies, way = held.value.vehicle, held.value.moving, held.value.way
    n = steps(vehicle.period)
    h = vehicle.period / n
    for i, s in enumerate(times):
        step = min(int((s + _SAME) / h), n - 1)
        span = min(h, times[-1] - step * h)
        if span <= _SAME:
            step, span = step - 1, h
        share = min(max((s - step * h) / span, 0.0), 1.0)
        before, after = way[step], way[step + 1]
        theta = wrap(before[2] + share * wrap(after[2] - before[2]))
        poses[i, 0] = before[0] + share * (after[0] - before[0]) - pivot * math.cos(theta)
        poses[i, 1] = before[1] + share * (after[1] - before[1]) - pivot * math.sin(theta)
        poses[i, 2] = theta
        for b in range(moving.shape[1]):
            begin, end = bodies.tracks.rows[leg, b, 0], bodies.tracks.rows[leg, b, 1]
            pose_at(bodies.tracks.knots, begin, end, t - bodies.since[b] + s, moving[i, b])


@kernel
def _worth_keeping(times: FloatArray, poses: FloatArray, moving: FloatArray, reach: FloatArray) -> np.ndarray:
    """(c,) which of the instants make the lines between the kept ones and the period's ends right."""
    count = len(times)
    kept = np.zeros(count, np.bool_)
    kept[0] = kept[-1] = True
    a = 0
    while a < count - 1:
        b = a + 1
        while not kept[b]:
            b += 1
        worst, most = a, OFF
        for i in range(a + 1, b):
            share = (times[i] - times[a]) / (times[b] - times[a])
            off = _off(poses[a], poses[b], poses[i], share, reach[0])
            for k in range(moving.shape[1]):
                off = max(off, _off(moving[a, k], moving[b, k], moving[i, k], share, reach[1 + k]))
            if off > most:
                worst, most = i, off
        if worst > a:
            kept[worst] = True
        else:
            a = b
    kept[0] = kept[-1] = False  # these are samples
    return kept


@light
def _off(a: FloatArray, b: FloatArray, pose: FloatArray, share: float, reach: float) -> float:
    """How far a point of a body at `pose` (3,) may be from where the line from pose `a` to pose `b` has it, m; inf where it
    is there and the line isn't, or the other way round."""
    if not (math.isfinite(a[0]) and math.isfinite(b[0])):
        return math.inf if math.isfinite(pose[0]) else 0.0
    if not math.isfinite(pose[0]):
        return math.inf
    x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    turned = wrap(a[2] + share * wrap(b[2] - a[2]) - pose[2])
    return math.hypot(pose[0] - x, pose[1] - y) + abs(turned) * reach

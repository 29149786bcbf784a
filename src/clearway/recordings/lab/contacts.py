"""Where a measured clearance says that the robot touched something, or may have.

A clearance is known within its expanded uncertainty U (k = 2, about 95 %): that of both positions, and of both headings
by the lever arm of the outline. At or below U it may have been contact, which a person has to confirm; only an overlap
deeper than U is contact. What shapes themselves are worth, and how far a soft one gives way, isn't known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import linprog

from clearway.contract import PLACED, EventKind
from clearway.errors import ClearwayError
from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, FloatArray, Polygon, Shape, circumscribed_radius
from clearway.trials import Attempt, Body, Event
from clearway.trials.unseen import longest_step

COVERAGE = 2.0
"""k of the expanded uncertainty."""
SURVEYED = 0.02
"""m; walls and furniture of a plan are taken to be surveyed no better."""
FINE, MOST = 0.02, 200
"""m: between two instants that are looked at nothing moves farther; and into how many a step is divided at most."""
APART = 0.5
"""s; two approaches closer in time are one episode."""


def assess(
    attempt: Attempt,
    t: FloatArray,
    pose: FloatArray,
    moving_obstacles: FloatArray,
    sigma: FloatArray | None,
    tie: FloatArray | None = None,
) -> tuple[Event, ...]:
    """Events `contact` (at its first certain instant) and `possible contact` (at the smallest clearance), in order of
    time: at most one per body and episode.

    Bodies without an outline are skipped, and all without a footprint; so are samples in which a pose is unknown, or
    a heading that the outline needs. Where the uncertainty is unknown, only a clearance of zero is a possible contact.

    Args:
        t: (n,) time, s.
        pose: (n, 3) pose of the robot in the map: x, y [m], theta [rad].
        moving_obstacles: (n, m, 3) poses of the bodies without a pose, in their order, NaN where absent.
        sigma: (n, 1 + m, 2) as `Trial.sigma`, NaN or None where unknown.
        tie: (n, 2) as `Trial.tie`: what of it cancels between the robot and a body that the same capture saw.

    Raises:
        ClearwayError: shapes of the arrays that don't go together.
    """
    n, moving = len(t), [b for b in attempt.bodies if b.pose is None]
    moving_obstacles = np.zeros((n, 0, 3)) if moving_obstacles.size == 0 and not moving else moving_obstacles
    if pose.shape != (n, 3) or moving_obstacles.shape != (n, len(moving), 3):
        raise ClearwayError(
            f"poses {pose.shape} of the robot and {moving_obstacles.shape} of moving_obstacles; {(n, 3)} and {(n, len(moving), 3)} go with "
            f"{n} instants and {len(moving)} moving bodies"
        )
    known = np.full((n, 1 + len(moving), 2), np.nan) if sigma is None else sigma
    if known.shape != (n, 1 + len(moving), 2):
        raise ClearwayError(
            f"uncertainties {known.shape}; {(n, 1 + len(moving), 2)} go with poses and moving_obstacles"
        )
    if attempt.footprint is None or n == 0:
        return ()
    common = np.zeros((n, 2)) if tie is None else tie
    fine = _finer(attempt, t, pose, moving_obstacles)
    t, pose, moving_obstacles, known, common = (_at(x, *fine) for x in (t, pose, moving_obstacles, known, common))
    n = len(t)
    robot = _Placed(attempt.footprint, pose, known[:, 0])
    among = _Placed(attempt.footprint, pose, _without(known[:, 0], common))
    events: list[Event] = []
    column = 0
    for index, body in enumerate(attempt.bodies):
        column += body.pose is None
        if not body.outlined:
            continue
        if body.pose is None:
            other = _Placed(body.shape, moving_obstacles[:, column - 1], known[:, column])
        else:
            at = max(body.sigma, SURVEYED) if body.kind not in PLACED and attempt.source == "recorded" else body.sigma
            still = np.zeros((n, 2))
            still[:, 0] = at
            other = _Placed(body.shape, np.broadcast_to(body.pose, (n, 3)), still)
        if body.measured:
            events += _with(among, index, body, replace(other, sigma=_without(other.sigma, common)), t)
        else:
            events += _with(robot, index, body, other, t)
    return tuple(sorted(events, key=lambda e: e.t))


def _finer(attempt: Attempt, t: FloatArray, pose: FloatArray, moving_obstacles: FloatArray) -> tuple[Any, FloatArray]:
    """Where to look, so that between two instants nothing moves by more than `FINE`: samples, and shares of the way to the next
    one (k,). Where nothing is known between two samples, nothing is looked at."""
    assert attempt.footprint is not None
    shapes = [attempt.footprint, *(b.shape for b in attempt.bodies if b.pose is None)]
    far = np.zeros(max(len(t) - 1, 0))
    for shape, way in zip(shapes, (pose, *np.moveaxis(moving_obstacles, 1, 0)), strict=True):
        step = np.diff(way, axis=0)
        turn = np.abs(np.remainder(np.nan_to_num(step[:, 2]) + np.pi, 2 * np.pi) - np.pi)
        far = np.maximum(far, np.nan_to_num(np.hypot(step[:, 0], step[:, 1])) + circumscribed_radius(shape) * turn)
    far[np.diff(t) > longest_step(attempt)] = 0.0
    parts = np.append(np.clip(np.ceil(far / FINE), 1, MOST), 1).astype(int)
    sample = np.repeat(np.arange(len(t)), parts)
    first = np.cumsum(parts) - parts
    return sample, (np.arange(len(sample)) - first[sample]) / parts[sample]


def _at(values: FloatArray, sample: Any, share: FloatArray) -> FloatArray:
    """`values` (n, ...) on the lines from samples to the next ones; angles, the third of poses, the shorter way."""
    low, high = values[sample], values[np.minimum(sample + 1, len(values) - 1)]
    step = high - low
    if values.shape[-1] == 3 and values.ndim > 1:
        step[..., 2] = np.remainder(step[..., 2] + np.pi, 2 * np.pi) - np.pi
    by = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.where(by > 0, low + by * step, low))


def _without(whole: FloatArray, part: FloatArray) -> FloatArray:
    """(n, 2) standard uncertainties that are left of `whole` once their independent `part` is taken out."""
    left: FloatArray = np.sqrt(np.maximum(whole**2 - part**2, 0.0))
    return left


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """A shape with its poses (n, 3) and their standard uncertainties (n, 2)."""

    shape: Shape
    pose: FloatArray
    sigma: FloatArray

    def known(self) -> FloatArray:
        """(n, 3) with the heading of a disc, which doesn't matter, as 0; NaN rows where the outline is nowhere."""
        pose = np.array(self.pose, dtype=np.float64)
        if isinstance(self.shape, Circle):
            pose[:, 2] = 0.0
        pose[~np.isfinite(pose).all(axis=1)] = np.nan
        return pose

    def variance(self) -> Any:
        """(n,) m^2, of the place of its outline."""
        place: Any = self.sigma[:, 0] ** 2
        if isinstance(self.shape, Circle):
            return place
        return place + (self.sigma[:, 1] * circumscribed_radius(self.shape)) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class _Alone:
    """A body as `min_clearance` takes a moving one."""

    shape: Shape
    pose: None = None


def _with(robot: _Placed, index: int, body: Body, other: _Placed, t: FloatArray) -> list[Event]:
    """The events with one body, which is number `index` of the attempt's."""
    way, at = robot.known(), other.known()
    there = np.flatnonzero(np.isfinite(way[:, 0]) & np.isfinite(at[:, 0]))
    if not len(there):
        return []
    expanded = COVERAGE * np.sqrt(robot.variance()[there] + other.variance()[there])
    bound = np.nan_to_num(expanded)
    # what never comes near needs no measuring
    near = np.hypot(*(way[there, :2] - at[there, :2]).T) - bound
    close = near <= circumscribed_radius(robot.shape) + circumscribed_radius(other.shape)
    there, expanded, bound = there[close], expanded[close], bound[close]
    gaps = _gaps(robot.shape, way[there], other.shape, at[there])
    touching = gaps <= bound
    hit, expanded, gaps = there[touching], expanded[touching], gaps[touching]
    if not len(hit):
        return []
    cuts = np.flatnonzero(np.diff(t[hit]) > APART) + 1
    parts = zip(np.split(hit, cuts), np.split(gaps, cuts), np.split(expanded, cuts), strict=True)
    return [_episode(robot, index, body, other, t, *part) for part in parts]


def _gaps(shape: Shape, pose: FloatArray, other: Shape, at: FloatArray) -> FloatArray:
    return min_clearance(shape, pose, [_Alone(other)], np.ascontiguousarray(at[:, None, :]))


def _episode(
    robot: _Placed,
    index: int,
    body: Body,
    other: _Placed,
    t: FloatArray,
    hit: Any,
    gaps: FloatArray,
    expanded: FloatArray,
) -> Event:
    """One approach: contact if anything in it was certain, else the nearest instant."""
    name = f"{body.kind} {body.name!r}"
    worth = float(np.max(expanded)) if np.isfinite(expanded).all() else math.nan
    core = _moved_in(robot.shape, worth) if math.isfinite(worth) else None
    if core is not None:
        shape, centre = core
        deep = np.flatnonzero(gaps <= 0.0)
        way = robot.known()[hit[deep]]
        c, s = np.cos(way[:, 2]), np.sin(way[:, 2])
        way[:, 0] += c * centre[0] - s * centre[1]
        way[:, 1] += s * centre[0] + c * centre[1]
        certain = deep[_gaps(shape, way, other.shape, other.known()[hit[deep]]) <= 0.0]
        if len(certain):
            return Event(
                float(t[hit[certain[0]]]),
                EventKind.CONTACT,
                f"{name}: the outlines overlap by more than {worth:.3f} m (U, k = 2)",
                index,
            )
    i = int(np.argmin(gaps)) if gaps.min() > 0 else int(np.flatnonzero(gaps <= 0)[(gaps <= 0).sum() // 2])
    within = f"+- {expanded[i]:.3f} m (k = 2)" if math.isfinite(expanded[i]) else "of unknown uncertainty"
    start, seconds = t[hit[0]], t[hit[-1]] - t[hit[0]]
    near = f", so near from {start:.2f} s for {seconds:.2f} s" if seconds > 0 else ""
    return Event(
        float(t[hit[i]]), EventKind.POSSIBLE_CONTACT,
        f"{name}: measured clearance {gaps[i]:.3f} m {within}{near}: to be confirmed", index,
    )  # fmt: skip


def _moved_in(shape: Shape, by: float) -> tuple[Shape, tuple[float, float]] | None:
    """A shape about the centre (2,) that lies inside `shape` by at least `by` everywhere; None if nothing does.

    A polygon that is star-shaped as seen from every point of a disc of radius r is scaled towards the disc's centre by
    1 - by / r: what is left lies inside by `by`.
    """
    if isinstance(shape, Circle):
        return (Circle(shape.radius - by), (0.0, 0.0)) if shape.radius > by else None
    v = shape.array
    if len(v) < 3:
        return None
    edge = np.roll(v, -1, axis=0) - v
    length = np.hypot(*edge.T)
    edge, corner, length = edge[length > 0], v[length > 0], length[length > 0]
    outward = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / length[:, None]
    offset = (outward * corner).sum(axis=1)
    # the largest disc in the kernel: max r with outward . c + r <= offset
    found = linprog(
        [0, 0, -1],
        np.hstack([outward, np.ones((len(outward), 1))]),
        offset,
        bounds=[(None, None), (None, None), (0, None)],
    )
    if not found.success or found.x[2] <= by:
        return None
    x, y, r = (float(u) for u in found.x)
    share = 1 - by / r
    return Polygon(tuple((share * (a - x), share * (b - y)) for a, b in shape.vertices)), (x, y)

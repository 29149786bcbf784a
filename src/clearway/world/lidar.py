"""A 2-D lidar: the exact distance along each beam, and what a real sensor makes of it.

Its errors, in the order in which the light meets them:

- **Sweep.** The beams are cast one after another, while the robot and all others move.
- **Legs.** One that looks low sees two legs of a person (`clearway.world.legs`).

- **Mixed pixels.** A beam is no line: its spot covers an angle, and where an edge lies within the spot, light comes back
  from two surfaces. Echoes that lie within half a pulse's length of each other merge into one range in between (Tuley,
  Vandapel, Hebert 2005); of echoes further apart the stronger is told, that of the surface in the middle of the spot.
  So a range is the mean over that part of the spot whose surface lies within the pulse of what its middle hits.
- **Lost returns.** A beam now and then brings nothing back: dark, shiny or slanted spots on a surface.
- **Bias**: one systematic error of all ranges, drawn for the trial within the data sheet's bound.
- **Noise**: the statistical error, normal, independent from beam to beam and from sweep to sweep.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.raycast import Beams, Scene, cast, cast_moving
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normals, uniform
from clearway.robots import Lidar
from clearway.world.legs import Legs, walk
from clearway.world.tracks import Tracks, place

EDGE = 0.1
"""Between neighbouring ranges that differ by less there is no edge, m: it would vanish in the noise."""
STEEP = 6.0
"""Nor between those that differ by no more than the ranges of one surface met at 80 degrees, whose tangent this is."""
GROUPS = 8
"""Neighbouring beams are cast in so many groups, each from one place among bodies at one time, that of its middle; only the robot's
heading is that of each beam. So at the ends of a group a place is wrong by a sixteenth of the way in a sweep: for the 0.2 s of an
LDS-01, 3 mm of a robot at 0.26 m/s and 16 mm of a walker at 1.3 m/s, for the 19 ms of a UST-20LX 2 mm of the latter."""
_TURN = 1e-9
"""Least angle from a beam to the next, rad: of a lidar that turns no faster than its robot turns the other way."""


class Errors(NamedTuple):
    """Of a lidar in a trial.

    Attributes:
        sigma: Standard deviation of a range, m.
        bias: Systematic error of all ranges in this trial, m.
        spot: Half of the angle that a beam's spot covers, in increments.
        pulse: Half a pulse's length: difference in depth up to which two echoes merge, m.
        kept: Logarithm of the probability that a beam's return is not lost.
    """

    sigma: float
    bias: float
    spot: float
    pulse: float
    kept: float


class View(NamedTuple):
    """A lidar, and among what it stands.

    Attributes:
        mount: (3,) its pose in the frame of the robot's state.
        rays: Its beams.
        errors: Its errors in this trial.
        key: The random stream of those that are drawn anew at each sweep.
        still: The bodies that stand, in the map frame.
        movable: The bodies that move, each in its own frame.
        poses: (m, 3) where these are now, NaN if absent.
        room: (2, n) room to work with.
    """

    mount: FloatArray
    rays: Beams
    errors: Errors
    key: np.uint64
    still: Scene
    movable: Scene
    poses: FloatArray
    room: FloatArray


class Trace(NamedTuple):
    """Where a robot was in its last k control periods.

    Attributes:
        begun: (k,) when each of them began, s.
        period: How long each was, s.
        ways: (k, n + 1, 3) its poses at the ends of the n steps of each; before the first of them it stood.
    """

    begun: FloatArray
    period: float
    ways: FloatArray


class Sweep(NamedTuple):
    """A lidar whose beams are cast one after another.

    Attributes:
        lidar: It and what is around it; of its `poses` nothing is heeded.
        trace: Where its robot was.
        time: From the first beam to the last one, s; negative: the last one comes first.
        legs: Of the people among the bodies that move.
        tracks: Of these bodies.
        since: (m,) when the clock of each of them began, s.
        before: (GROUPS, m, 3) where they were as each group was cast, if the leg had not begun by then.
    """

    lidar: View
    trace: Trace
    time: float
    legs: Legs
    tracks: Tracks
    since: FloatArray
    before: FloatArray


@kernel
def hold_sweep(sweep: Sweep) -> Held[Sweep]:
    """`sweep`, as `scan_in_time` takes it."""
    return Held(sweep)


@kernel
def hold(view: View) -> Held[View]:
    """`view`, as `scan` takes it."""
    return Held(view)


def errors_of(lidar: Lidar, increment: float, key: np.uint64) -> Errors:
    """The errors of `lidar`, whose beams lie `increment` rad apart, in the trial of the random stream `key`."""
    return Errors(
        sigma=lidar.sigma,
        bias=lidar.bias * (2.0 * uniform(key, -1, 0) - 1.0),
        spot=0.5 * lidar.divergence / abs(increment) if increment != 0.0 else 0.0,
        pulse=lidar.pulse,
        kept=math.log1p(-lidar.dropout),
    )


@kernel
def scan(ranges: FloatArray, x: float, y: float, theta: float, count: int, held: Held[View]) -> None:
    """One sweep of the lidar into `ranges` (n,), with its errors; inf: no return.

    Args:
        x: Where the robot is in the map, m.
        y: Where the robot is in the map, m.
        theta: Its heading, rad.
        count: Number of control periods so far.
    """
    _scan(ranges, x, y, theta, count, held)


@light
def _scan(ranges: FloatArray, x: float, y: float, theta: float, count: int, held: Held[View]) -> None:
    scan_from(ranges, x, y, theta, count, held.value)


@light
def scan_from(ranges: FloatArray, x: float, y: float, theta: float, count: int, view: View) -> None:
    """`scan` with a lidar that nobody holds."""
    mount, rays, still, movable = view.mount, view.rays, view.still, view.movable
    c, s = math.cos(theta), math.sin(theta)
    sx, sy, st = x + c * mount[0] - s * mount[1], y + s * mount[0] + c * mount[1], theta + mount[2]
    farthest = rays.range_max
    for i in range(len(ranges)):
        ranges[i] = math.inf
    cast(still.segments, still.circles, sx, sy, st, rays.directions, rays.angle_min, rays.increment, farthest, ranges)
    cast_moving(movable.segments, movable.segment_owner, movable.circles, movable.circle_owner, view.poses,
                sx, sy, st, rays.directions, rays.angle_min, rays.increment, farthest, ranges)  # fmt: skip
    err(ranges, count, view)


@kernel
def scan_in_time(
    ranges: FloatArray, stamp: float, leg: int, leg_began: float, count: int, held: Held[Sweep]
) -> None:  # fmt: skip
    """One sweep of the lidar into `ranges` (n,), with its errors, each beam cast at its time; inf: no return.

    Args:
        stamp: The time of the sweep's middle, s.
        leg: Number of the leg that the tracks are in.
        leg_began: When it began, s.
        count: Number of control periods so far.
    """
    sweep = held.value
    view, trace = sweep.lidar, sweep.trace
    mount, rays, still, movable = view.mount, view.rays, view.still, view.movable
    n, farthest = ranges.shape[0], rays.range_max
    groups = min(GROUPS, n)
    begin, step = stamp - 0.5 * sweep.time, sweep.time / max(n - 1, 1)
    bodies = np.empty((len(sweep.since), 3))
    ranges[:] = math.inf
    for g in range(groups):
        first, end = g * n // groups, (g + 1) * n // groups
        t0, t1 = begin + step * first, begin + step * (end - 1)
        middle = 0.5 * (t0 + t1)
        if middle >= leg_began:
            place(sweep.tracks, leg, sweep.since, middle, bodies)
        else:
            bodies[:] = sweep.before[g]
        walk(movable.circles, sweep.legs, sweep.tracks, sweep.since, leg, middle)
        x, y, theta = pose_then(trace, middle)
        start = pose_then(trace, t0)[2]
        turn = wrap(pose_then(trace, t1)[2] - start) / max(end - 1 - first, 1)
        increment = rays.increment + turn
        if abs(increment) < _TURN:
            increment = _TURN
            turn = increment - rays.increment
        directions = np.empty((2, end - first))
        ct, st, c, s = math.cos(turn), math.sin(turn), 1.0, 0.0
        for i in range(end - first):
            dx, dy = rays.directions[0, first + i], rays.directions[1, first + i]
            directions[0, i], directions[1, i] = c * dx - s * dy, s * dx + c * dy
            c, s = c * ct - s * st, s * ct + c * st
        c, s = math.cos(theta), math.sin(theta)
        sx, sy, heading = x + c * mount[0] - s * mount[1], y + s * mount[0] + c * mount[1], start + mount[2]
        angle = rays.angle_min + first * rays.increment
        part = ranges[first:end]
        cast(still.segments, still.circles, sx, sy, heading, directions, angle, increment, farthest, part)
        cast_moving(movable.segments, movable.segment_owner, movable.circles, movable.circle_owner, bodies,
                    sx, sy, heading, directions, angle, increment, farthest, part)  # fmt: skip
    err(ranges, count, view)


@light
def pose_then(trace: Trace, t: float) -> tuple[float, float, float]:
    """Where the robot was at time `t` [s]; a step of the plant, 10 ms, is taken as straight: within v omega (10 ms)^2 / 8."""
    ways = trace.ways
    k = ways.shape[0] - 1
    while k > 0 and t < trace.begun[k]:
        k -= 1
    n = ways.shape[1] - 1
    at = min(max((t - trace.begun[k]) / trace.period, 0.0), 1.0) * n
    i = min(math.floor(at), n - 1)
    a, b, share = ways[k, i], ways[k, i + 1], at - i
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * wrap(b[2] - a[2])


@light
def err(ranges: FloatArray, count: int, view: View) -> None:
    """Give exact `ranges` (n,) the lidar's errors."""
    rays, errors, farthest = view.rays, view.errors, view.rays.range_max
    if errors.spot > 0.0:
        mix(ranges, errors.spot, errors.pulse, STEEP * abs(rays.increment), count, view.key, view.room[0])
    if errors.kept < 0.0:
        lose(ranges, errors.kept, count, view.key)
    noise = view.room[1]
    if errors.sigma > 0.0:
        normals(view.key, count, noise, view.room[0])
    for i in range(ranges.shape[0]):
        if ranges[i] <= farthest:
            r = ranges[i] + errors.bias
            if errors.sigma > 0.0:
                r += errors.sigma * noise[i]
            ranges[i] = r if rays.range_min <= r <= farthest else math.inf
        else:
            ranges[i] = math.inf


@light
def mix(
    ranges: FloatArray, spot: float, pulse: float, steep: float, count: int, key: np.uint64, exact: FloatArray
) -> None:  # fmt: skip
    """Replace ranges (n,) beside edges by what spots of 2 `spot` beams see there.

    Args:
        steep: By how much neighbouring ranges of one surface may differ, as a share of the nearer one.
        exact: (n,) overwritten.
    """
    n = ranges.shape[0]
    for i in range(n):
        exact[i] = ranges[i]
    wide, done = math.ceil(spot), 0  # beams before `done` are as they will be
    for i in range(n - 1):
        step = abs(exact[i + 1] - exact[i])
        if EDGE < step <= pulse and _edge(exact, i, steep):
            for j in range(max(done, i + 1 - wide), min(n, i + 1 + wide)):
                if exact[j] < math.inf:
                    ranges[j] = _over_spot(exact, j, spot, pulse, steep, count, key)
            done = min(n, i + 1 + wide)


@light
def _edge(exact: FloatArray, i: int, steep: float) -> bool:
    """Whether beams i and i + 1 hit two surfaces, or only one of them hits anything."""
    step = abs(exact[i + 1] - exact[i])
    return bool(step > EDGE and step > steep * min(exact[i], exact[i + 1]))


@light
def _over_spot(
    exact: FloatArray, j: int, spot: float, pulse: float, steep: float, count: int, key: np.uint64
) -> float:  # fmt: skip
    """The mean range over the part of beam j's spot that lies within `pulse` of what its middle hits.

    The surface that a beam hits ends half way to the next beam, and at an edge anywhere on that way: the same place for
    every beam whose spot covers it.
    """
    n = exact.shape[0]
    total = weight = 0.0
    begin = j - spot
    for m in range(max(0, j - math.ceil(spot)), min(n, j + math.ceil(spot) + 1)):
        border = m + 0.5
        if m < n - 1 and _edge(exact, m, steep):
            border = m + uniform(key, count, n + m)
        end = min(border, j + spot)
        if end > begin:
            if abs(exact[m] - exact[j]) <= pulse and exact[m] < math.inf:
                total += (end - begin) * exact[m]
                weight += end - begin
            begin = end
    return total / weight


@light
def lose(ranges: FloatArray, kept: float, count: int, key: np.uint64) -> None:
    """Each of `ranges` (n,) becomes inf with probability 1 - exp(kept); one draw for each gap between two lost ones."""
    n = ranges.shape[0]
    i = -1
    for k in range(n):
        gap = math.log(uniform(key, count, 2 * n + k)) / kept
        if gap >= n:
            return
        i += 1 + math.floor(gap)
        if i >= n:
            return
        ranges[i] = math.inf

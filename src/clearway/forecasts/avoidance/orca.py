"""Optimal reciprocal collision avoidance as the rule by which obstacles keep out of each other's way.

What each wants is not told. It is inferred from how it moved: of some wishes, those by which ORCA foretells the velocities that were
seen are the likely ones. With what is likeliest for each, all are moved on together.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.crowds import orca
from clearway.crowds.bodies import nearest, sweep
from clearway.crowds.half_planes import solve
from clearway.crowds.walls import Walls
from clearway.forecasts.avoidance.intents import STARTED, Intents, bodies_of, followed, gathered, wishes_of
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

NEIGHBOURS, DISTANCE, HORIZON, KEPT, DECIDES_EVERY = 10, 10.0, 5.0, 0.01, 0.25
"""ORCA as CrowdNav sets it for people: at most so many are heeded, within so far [m], so long ahead [s], each for so much larger than
it is [m], so often [s]."""

DIRECTIONS = 72
"""In which somebody may wish to go; the best of them and its neighbours are averaged."""
AROUND = 9
"""So many neighbours on either side."""
PACES = (1.0, 0.7, 1.35)
"""At which speeds, m/s: about what people prefer. One more wish is to stand."""
WISHES = len(PACES) * DIRECTIONS + 1
RARE = 1.0
"""A pace but the first is less likely at first, by so much, nats."""
KEEP = 0.9
"""Share of what was known of a wish that counts a period later."""
SPREAD = 0.06
"""Standard deviation of a velocity that is foretold by the right wish, m/s; it counts for no more than `FARTHEST` of them."""
FARTHEST = 6.0


@kernel
def wished(a: int) -> tuple[float, float]:
    """Wish number `a`, m/s."""
    if a == WISHES - 1:
        return 0.0, 0.0
    pace, course = PACES[a // DIRECTIONS], 2.0 * math.pi * (a % DIRECTIONS) / DIRECTIONS
    return pace * math.cos(course), pace * math.sin(course)


@kernel
def learn(
    known: Intents, dt: float, identity: npt.NDArray[np.int64], place: FloatArray, radius: FloatArray, error: FloatArray,
    walls: Walls,
) -> Intents:  # fmt: skip
    """What is known of those who are at `place` (n, 2) now.

    Args:
        known: What was known before; `belief` is how likely each of the `WISHES` is, nats below the likeliest.
        dt: How long before, s; not above 0, or NaN: nothing is learnt from what was.
        identity: (n,) of them.
        place: (n, 2) m.
        radius: (n,) m.
        error: (n,) bound of the error of `place`, m.
    """
    out, was, size = followed(known, dt, identity, place, radius)
    out.belief[:, DIRECTIONS:] = -RARE
    bodies = bodies_of(known.place, known.velocity, size + KEPT)
    order, lines = sweep(bodies.position), np.empty((NEIGHBOURS, 4))
    found, distance, off = np.empty(NEIGHBOURS, np.int64), np.empty(NEIGHBOURS), np.empty(WISHES)
    for i in range(len(was)):
        j = was[i]
        if j < 0:
            continue
        knew = math.isfinite(known.wish[j, 0])
        if not knew and math.hypot(out.velocity[i, 0], out.velocity[i, 1]) < STARTED:
            continue
        near = nearest(j, 1, DISTANCE, bodies, order, found, distance)
        orca.body_lines(j, found[:near], bodies, HORIZON, dt, lines)
        doubt = 2.0 * (error[i] / dt) ** 2  # the velocity's variance, if its bound were the place's deviation
        weigh(lines, near, out.velocity[i], SPREAD * SPREAD + doubt, known.belief[j], off, out.belief[i])
        mean_wish(out.belief[i], out.wish[i])
        if knew:
            straight = math.hypot(out.velocity[i, 0] - known.velocity[j, 0], out.velocity[i, 1] - known.velocity[j, 1])
            out.evidence[i] = gathered(known.evidence[j], straight, off[known.belief[j].argmax()], doubt)
    return out


@kernel
def weigh(
    lines: FloatArray,
    near: int,
    velocity: FloatArray,
    variance: float,
    before: FloatArray,
    off: FloatArray,
    likely: FloatArray,
) -> None:
    """How likely each wish is of somebody who took up `velocity` (2,) [m/s].

    Args:
        lines: (k, 4) what the first `near` others left it.
        near: How many those are.
        velocity: (2,) m/s.
        variance: Of that about what is foretold, m^2/s^2.
        before: (WISHES,) how likely each was.
        off: (WISHES,) written: how far what it foretells is from `velocity`, m/s.
        likely: (WISHES,) written: how likely each is.
    """
    spare = np.empty_like(lines)
    for a in range(WISHES):
        wx, wy = wished(a)
        vx, vy = solve(lines, near, 0, max(math.hypot(wx, wy), STARTED), wx, wy, spare)
        off[a] = math.hypot(vx - velocity[0], vy - velocity[1])
        prior = 0.0 if a < DIRECTIONS else -RARE
        likely[a] = prior + KEEP * (before[a] - prior) - 0.5 * min(off[a] * off[a] / variance, FARTHEST * FARTHEST)
    likely -= likely.max()


@kernel
def mean_wish(likely: FloatArray, wish: FloatArray) -> None:
    """Write to `wish` (2,) [m/s] the mean of the likeliest of all wishes and its neighbours of the same pace."""
    best = int(likely.argmax())
    if best == WISHES - 1:
        wish[:] = 0.0
        return
    pace, course, x, y = best // DIRECTIONS, best % DIRECTIONS, 0.0, 0.0
    for k in range(-AROUND, AROUND + 1):
        a = pace * DIRECTIONS + (course + k) % DIRECTIONS
        wx, wy = wished(a)
        weight = math.exp(likely[a])
        x, y = x + weight * wx, y + weight * wy
    scale = PACES[pace] / math.hypot(x, y)
    wish[0], wish[1] = scale * x, scale * y


@kernel
def move_on(intents: Intents, walls: Walls, radius: FloatArray, step: float, path: FloatArray) -> None:
    """Fill `path` (n, K + 1, 2) with where each will be at instants `step` [s] apart."""
    n, stride = len(radius), max(1, round(DECIDES_EVERY / step))
    velocity, wishes = intents.velocity.copy(), wishes_of(intents, 1.0)
    bodies = bodies_of(intents.place, velocity, radius + KEPT)
    care = orca.Care(np.full(n, DISTANCE), np.full(n, NEIGHBOURS, np.int64), np.full(n, HORIZON), np.full(n, HORIZON))
    path[:, 0] = intents.place
    for j in range(1, path.shape[1]):
        if (j - 1) % stride == 0:
            bodies.position[:], bodies.velocity[:] = path[:, j - 1], velocity
            velocity = orca.velocities(bodies, wishes, care, walls, step * stride)
        path[:, j] = path[:, j - 1] + step * velocity

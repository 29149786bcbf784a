"""Obstacles that keep out of each other's way: a further model of motion, ORCA, for all that move together.

What each wants is not told. It is inferred from how it moved: of some wishes, those by which ORCA foretells the velocities that were
seen are the likely ones. With what is likeliest for each, all are moved on together. How far that is believed, beside the models
that know of one obstacle only, is weighed by how well it foretold velocities, beside constant velocity.

Nobody is expected to see the robot: whoever does makes more room than was foretold.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds import orca
from clearway.crowds.bodies import Bodies, Wishes, nearest, sweep
from clearway.crowds.half_planes import solve
from clearway.crowds.walls import Walls, walls_of
from clearway.forecasts.forecast import Forecast
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
SHARP = 0.03
"""The same where models are weighed, m/s."""
FADE, MOST = 0.9, 6.0
"""Share of what spoke for ORCA that counts a period later, and the most that can, nats."""
STARTED = 0.1
"""Who has not been faster yet shows no wish, m/s."""
FIRST, GROWTH = 0.02, 0.05
"""Standard deviation of a place that is foretold: now, m, and how it grows, m/s."""


class Intents(NamedTuple):
    """What is known of those who move.

    Attributes:
        identity: (n,) int64, as the forecast has it.
        place: (n, 2) where each was perceived last, m.
        velocity: (n, 2) at which it came there, m/s.
        likely: (n, WISHES) how likely each wish is, nats below the likeliest.
        wish: (n, 2) the velocity that it would move at alone, m/s; NaN: nothing is known of that.
        evidence: (n,) for ORCA and against constant velocity, nats.
    """

    identity: npt.NDArray[np.int64]
    place: FloatArray
    velocity: FloatArray
    likely: FloatArray
    wish: FloatArray
    evidence: FloatArray


NOBODY = Intents(
    np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.empty((0, WISHES)), np.empty((0, 2)), np.empty(0)
)
_WALLS = walls_of([])


def avoid(known: Intents, dt: float, forecast: Forecast, least: float) -> Intents:
    """Learn from what a forecast says is there now, and add to its hypotheses where all go if they avoid each other.

    Args:
        known: What was known `dt` [s] ago.
        dt: That time, s; not above 0, or NaN: nothing is learnt from what was.
        forecast: Updated: `path`, `sigma` and `weight`.
        least: A hypothesis less probable than that is left out.
    """
    place = np.ascontiguousarray(forecast.centre[:, 0])
    now = learn(known, dt, forecast.identity, place, forecast.radius, forecast.reach[:, 0].copy())
    path = np.empty((len(place), forecast.path.shape[2], 2))
    move_on(now, _WALLS, forecast.radius, forecast.step, max(1, round(DECIDES_EVERY / forecast.step)), path)
    believe(now, path, least, forecast)
    return now


@kernel
def bodies_of(place: FloatArray, velocity: FloatArray, radius: FloatArray) -> Bodies:
    """Discs that all avoid each other."""
    n = len(radius)
    return Bodies(place.copy(), velocity.copy(), radius + KEPT, np.ones(n, np.int64), np.full(n, 0.5))


@kernel
def wished(a: int) -> tuple[float, float]:
    """Wish number `a`, m/s."""
    if a == WISHES - 1:
        return 0.0, 0.0
    pace, course = PACES[a // DIRECTIONS], 2.0 * math.pi * (a % DIRECTIONS) / DIRECTIONS
    return pace * math.cos(course), pace * math.sin(course)


@kernel
def learn(
    known: Intents, dt: float, identity: npt.NDArray[np.int64], place: FloatArray, radius: FloatArray, error: FloatArray
) -> Intents:
    """What is known of those who are at `place` (n, 2) now.

    Args:
        known: What was known before.
        dt: How long before, s.
        identity: (n,) of them.
        place: (n, 2) m.
        radius: (n,) m.
        error: (n,) bound of the error of `place`, m.
    """
    n, m = len(identity), len(known.identity)
    out = Intents(
        identity.copy(), place.copy(), np.zeros((n, 2)), np.zeros((n, WISHES)), np.full((n, 2), np.nan), np.zeros(n)
    )
    out.likely[:, DIRECTIONS:] = -RARE
    if m == 0 or not dt > 0.0:
        return out
    was, size = np.full(n, -1, np.int64), np.zeros(m)
    for i in range(n):
        for j in range(m):
            if known.identity[j] == identity[i]:
                was[i], size[j] = j, radius[i]
    bodies = bodies_of(known.place, known.velocity, size)
    order, lines = sweep(bodies.position), np.empty((NEIGHBOURS, 4))
    found, distance, off = np.empty(NEIGHBOURS, np.int64), np.empty(NEIGHBOURS), np.empty(WISHES)
    for i in range(n):
        j = was[i]
        if j < 0:
            continue
        out.velocity[i] = (place[i] - known.place[j]) / dt
        knew = math.isfinite(known.wish[j, 0])
        if not knew and math.hypot(out.velocity[i, 0], out.velocity[i, 1]) < STARTED:
            continue
        near = nearest(j, 1, DISTANCE, bodies, order, found, distance)
        orca.body_lines(j, found[:near], bodies, HORIZON, dt, lines)
        doubt = 2.0 * (error[i] / dt) ** 2  # the velocity's variance, if its bound were the place's deviation
        weigh(lines, near, out.velocity[i], SPREAD * SPREAD + doubt, known.likely[j], off, out.likely[i])
        mean_wish(out.likely[i], out.wish[i])
        if knew:
            straight = math.hypot(out.velocity[i, 0] - known.velocity[j, 0], out.velocity[i, 1] - known.velocity[j, 1])
            foretold = off[known.likely[j].argmax()]
            gained = 0.5 * (straight * straight - foretold * foretold) / (SHARP * SHARP + doubt)
            out.evidence[i] = min(max(FADE * known.evidence[j] + gained, -MOST), MOST)
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
def move_on(intents: Intents, walls: Walls, radius: FloatArray, step: float, stride: int, path: FloatArray) -> None:
    """Fill `path` (n, K + 1, 2) with where each will be at instants `step` [s] apart; all decide each `stride` steps."""
    n = len(radius)
    velocity = intents.velocity.copy()
    bodies = bodies_of(intents.place, velocity, radius)
    care = orca.Care(np.full(n, DISTANCE), np.full(n, NEIGHBOURS, np.int64), np.full(n, HORIZON), np.full(n, HORIZON))
    wishes = Wishes(np.arange(n), intents.velocity.copy(), np.full(n, STARTED), np.ones(n, np.int64))
    for i in range(n):
        if math.isfinite(intents.wish[i, 0]):
            wishes.velocity[i] = intents.wish[i]
        wishes.v_max[i] = max(math.hypot(wishes.velocity[i, 0], wishes.velocity[i, 1]), STARTED)
    path[:, 0] = intents.place
    for j in range(1, path.shape[1]):
        if (j - 1) % stride == 0:
            bodies.position[:], bodies.velocity[:] = path[:, j - 1], velocity
            velocity = orca.velocities(bodies, wishes, care, walls, step * stride)
        path[:, j] = path[:, j - 1] + step * velocity


@kernel
def believe(intents: Intents, path: FloatArray, least: float, forecast: Forecast) -> None:
    """Put `path` (n, K + 1, 2) among each one's hypotheses, with the probability that the evidence gives it, for the least
    probable of those."""
    weight, last = forecast.weight, forecast.weight.shape[1] - 1
    for i in range(len(path)):
        share = 1.0 / (1.0 + math.exp(-intents.evidence[i]))
        if not math.isfinite(intents.wish[i, 0]) or share < max(least, 0.5 if last == 0 else 0.0):
            continue
        rest = weight[i, :last].sum()
        weight[i, :last] *= (1.0 - share) / rest if last > 0 else 0.0
        at = last
        while at > 0 and weight[i, at - 1] < share:
            weight[i, at], forecast.path[i, at], forecast.sigma[i, at] = (
                weight[i, at - 1], forecast.path[i, at - 1], forecast.sigma[i, at - 1],
            )  # fmt: skip
            at -= 1
        weight[i, at] = share if last > 0 else 1.0
        for j in range(path.shape[1]):
            forecast.path[i, at, j] = path[i, j]
            forecast.sigma[i, at, j] = FIRST + GROWTH * j * forecast.step

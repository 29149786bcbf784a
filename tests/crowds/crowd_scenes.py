"""Crowds for tests: bodies at random places, mirrored and reordered ones, and how near they come between two steps."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from clearway.crowds.bodies import Bodies, Wishes
from clearway.geometry.shapes import FloatArray

MIRROR = np.array((1.0, -1.0))


def bodies_of(position, velocity=None, radius=0.25) -> Bodies:
    """Bodies that all see each other and avoid in turn."""
    position = np.array(position, np.float64)
    n = len(position)
    velocity = np.zeros((n, 2)) if velocity is None else np.array(velocity, np.float64)
    return Bodies(position, velocity, np.broadcast_to(radius, n).astype(float), np.ones(n, np.int64), np.full(n, 0.5))


def wishes_of(velocity, v_max=1.6) -> Wishes:
    """Everybody decides and sees everybody."""
    velocity = np.array(velocity, np.float64)
    n = len(velocity)
    return Wishes(np.arange(n), velocity, np.full(n, v_max), np.ones(n, np.int64))


def towards(goal: FloatArray, position: FloatArray, speed: float, period: float) -> FloatArray:
    """(n, 2) velocities of `speed` [m/s] to each goal, less in the last step."""
    away = goal - position
    far = np.hypot(*away.T)[:, None]
    return away / np.maximum(far, speed * period) * speed


@st.composite
def crowds(draw, most: int = 12) -> tuple[Bodies, Wishes]:
    """Bodies that do not touch, at places, velocities and wishes without a pattern."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(2, most))
    side = draw(st.sampled_from((2.5, 5.0, 10.0)))
    places = [rng.uniform(-side, side, 2)]
    while len(places) < n:
        place = rng.uniform(-side, side, 2)
        if min(np.hypot(*(place - other)) for other in places) > 0.62:
            places.append(place)
    bodies = bodies_of(places, rng.uniform(-1.2, 1.2, (n, 2)), rng.uniform(0.2, 0.3, n))
    return bodies, wishes_of(rng.uniform(-1.2, 1.2, (n, 2)))


def mirrored(bodies: Bodies, wishes: Wishes) -> tuple[Bodies, Wishes]:
    """The same with y turned around."""
    bodies = bodies._replace(position=bodies.position * MIRROR, velocity=bodies.velocity * MIRROR)
    return bodies, wishes._replace(velocity=wishes.velocity * MIRROR)


def reordered(bodies: Bodies, wishes: Wishes, order: list[int]) -> tuple[Bodies, Wishes]:
    """The same with body `order[k]` at place k."""
    return Bodies(*(a[order].copy() for a in bodies)), Wishes(wishes.who, *(a[order].copy() for a in wishes[1:]))


def least_gap(bodies: Bodies, velocity: FloatArray, period: float) -> float:
    """Smallest gap [m] between any two bodies while they move at `velocity` (n, 2) for a `period` [s]; negative: overlap."""
    first, second = np.triu_indices(len(bodies.radius), 1)
    r = bodies.position[second] - bodies.position[first]
    v = velocity[second] - velocity[first]
    t = np.clip(-(r * v).sum(1) / np.maximum((v * v).sum(1), 1e-12), 0.0, period)
    return float((np.hypot(*(r + t[:, None] * v).T) - bodies.radius[first] - bodies.radius[second]).min())

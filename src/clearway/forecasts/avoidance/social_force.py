"""Social force as the rule by which obstacles keep out of each other's way.

How somebody's velocity changes is the force of the others, which is known, and its drive to what it wants. So a Kalman filter of place,
velocity and wish tells what each wants, as far as the error of the places lets it. How likely it finds these places, beside a
filter of constant velocity, is the evidence. With the wishes all are moved on together.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.crowds import social_force
from clearway.crowds.social_force import MOUSSAID
from clearway.crowds.walls import Walls
from clearway.forecasts.avoidance.intents import STARTED, Intents, bodies_of, followed, gathered, wishes_of
from clearway.forecasts.models import correct, predict
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

LONGEST = 0.1
"""Forces are reckoned anew after that at the latest, s."""
FASTER = 1.3
"""The most that somebody hurries, of the speed that it wants (Helbing, Molnár 1995)."""
USUAL_SPEED = 1.5
"""Standard deviation of a component of velocity at first, m/s."""
AWAY = 0.4
"""The same of a wish about the velocity at first, m/s."""
CHANGE = 0.1
"""The same of what a wish changes by in a second, m/s."""
PUSHED = 10.0
"""Nobody is pushed by more than that, m/s^2: who is seen within others, by an error, would be flung away."""
NOISE = 0.01
"""Of acceleration, by force and at constant velocity, m^2/s^3."""
FORCED, STEADY = 0, 1
"""The filters."""
BELIEFS = 24
"""Mean (2, 2, 3) along x and y of place, velocity and wish by either filter, and covariance (2, 6), see `models.begin`."""
TAU = MOUSSAID.relaxation
_LEAST = 1e-6  # m^2: variance of a place, as elsewhere


@kernel
def learn(
    known: Intents, dt: float, identity: npt.NDArray[np.int64], place: FloatArray, radius: FloatArray, error: FloatArray,
    walls: Walls,
) -> Intents:  # fmt: skip
    """What is known of those who are at `place` (n, 2) now; see `orca.learn`. Places and velocities are those of the filter."""
    out, was, size = followed(known, dt, identity, place, radius)
    force = np.zeros((len(size), 2))
    if len(size) > 0 and dt > 0.0:
        bodies = bodies_of(known.place, known.velocity, size)
        force = social_force.forces(bodies, wishes_of(known, FASTER), np.full(len(size), -1), MOUSSAID, walls)
    move, spread = transitions(dt)
    fit, off = np.zeros(2), np.zeros(2)
    for i in range(len(was)):
        j, r = was[i], 0.25 * error[i] ** 2 + _LEAST  # a bound is about two deviations
        mean, cov = out.belief[i, :12].reshape(2, 2, 3), out.belief[i, 12:].reshape(2, 6)
        if j < 0:
            mean[:, :, 0] = place[i].reshape(2, 1)
            cov[:, 0], cov[:, 3] = r, USUAL_SPEED**2
            cov[FORCED, 4], cov[FORCED, 5] = USUAL_SPEED**2, USUAL_SPEED**2 + AWAY**2
            continue
        out.belief[i] = known.belief[j]
        predict(move, spread, mean, cov)
        share = PUSHED / max(math.hypot(force[j, 0], force[j, 1]), PUSHED)
        for axis in range(2):
            mean[axis, FORCED, 0] += move[FORCED, 0, 2] * TAU * share * force[j, axis]
            mean[axis, FORCED, 1] += move[FORCED, 1, 2] * TAU * share * force[j, axis]
        straight, foretold = miss(place[i], mean[:, STEADY]) / dt, miss(place[i], mean[:, FORCED]) / dt
        correct(0, place[i, 0], place[i, 1], r, mean, cov, fit, off)
        out.place[i], out.velocity[i] = mean[:, FORCED, 0], mean[:, FORCED, 1]
        knew = math.isfinite(known.wish[j, 0])
        if knew or math.hypot(out.velocity[i, 0], out.velocity[i, 1]) >= STARTED:
            out.wish[i] = mean[:, FORCED, 2]
        if knew:
            out.evidence[i] = gathered(known.evidence[j], straight, foretold, 2.0 * (error[i] / dt) ** 2)
    return out


@kernel
def miss(place: FloatArray, mean: FloatArray) -> float:
    """How far a `place` (2,) is from the one that a filter's `mean` (2, 3) tells, m."""
    return math.hypot(place[0] - mean[0, 0], place[1] - mean[1, 0])


@kernel
def transitions(dt: float) -> tuple[FloatArray, FloatArray]:
    """What `dt` [s] does to the filters without a force, see `models.transitions`."""
    move, spread = np.zeros((2, 3, 3)), np.zeros((2, 6))
    for m in range(2):
        spread[m, 0], spread[m, 1], spread[m, 3] = NOISE * dt**3 / 3.0, NOISE * dt**2 / 2.0, NOISE * dt
        move[m, 0, 0], move[m, 0, 1], move[m, 1, 1] = 1.0, dt, 1.0
    fade = math.exp(-dt / TAU)
    way = TAU * (1.0 - fade)
    move[FORCED, 0, 1], move[FORCED, 0, 2] = way, dt - way
    move[FORCED, 1, 1], move[FORCED, 1, 2], move[FORCED, 2, 2] = fade, 1.0 - fade, 1.0
    spread[FORCED, 5] = CHANGE**2 * dt
    return move, spread


@kernel
def move_on(intents: Intents, walls: Walls, radius: FloatArray, step: float, path: FloatArray) -> None:
    """Fill `path` (n, K + 1, 2) with where each will be at instants `step` [s] apart."""
    n, parts = len(radius), max(1, math.ceil(step / LONGEST - 1e-9))
    wishes, alone = wishes_of(intents, FASTER), np.full(n, -1)
    bodies = bodies_of(intents.place, intents.velocity, radius)
    path[:, 0] = intents.place
    for j in range(1, path.shape[1]):
        for _ in range(parts):
            bodies.velocity[:] = social_force.velocities(bodies, wishes, alone, MOUSSAID, walls, step / parts)
            bodies.position[:] += bodies.velocity * (step / parts)
        path[:, j] = bodies.position

"""The headed social force model: people who walk ahead, turn to where they want to go, and step aside only when pushed.

Farina, Fontanelli, Garulli, Giannitrapani, Prattichizzo 2017 ("Walking ahead: the headed social force model"), on the forces of
`social_force`. Drive and forces act along the heading; across it only the forces do, against a strong damping; the heading turns to
the wish, the faster the stronger the drive. Velocities are kept in the body's frame, so that a turn takes nobody's momentum and
makes none. What is linear is solved exactly over a period, in which the forces are held.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.bodies import Bodies, IntArray, Wishes
from clearway.crowds.social_force import SocialForce, forces
from clearway.crowds.walls import Walls
from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray


class Headed(NamedTuple):
    """Parameters of turning and stepping aside.

    Attributes:
        mass: m, by which theirs, which are of newtons, become ours, which are of accelerations, kg.
        sideways: k_o, which part of a force across the heading counts.
        damping: k_d, of motion across the heading, kg/s.
        eagerness: k_lambda, of turning by the drive, rad/s^2 per rad and N.
        ratio: alpha, of the turn's two time constants; not 1.
    """

    mass: float
    sideways: float
    damping: float
    eagerness: float
    ratio: float


FARINA = Headed(75.0, 1.0, 500.0, 0.3, 3.0)
"""The values of the authors' own program; of its masses, 60 to 90 kg, the middle."""


class Facing(NamedTuple):
    """How each decider faces.

    Attributes:
        heading: (k,) rad.
        turn_rate: (k,) rad/s.
    """

    heading: FloatArray
    turn_rate: FloatArray


@kernel
def velocities(
    bodies: Bodies, wishes: Wishes, facing: Facing, group: IntArray, model: SocialForce, headed: Headed, walls: Walls,
    period: float,
) -> tuple[FloatArray, Facing]:  # fmt: skip
    """(k, 2) the velocity [m/s] of each decider a `period` [s] later, at most its v_max, and how it faces then.

    Args:
        group: (n,) int64, to which group each body belongs; negative: to none.
    """
    chosen = forces(bodies, wishes, group, model, walls)
    k = chosen.shape[0]
    heading, turn_rate = np.empty(k), np.empty(k)
    for a in range(k):
        i = wishes.who[a]
        ahead, aside, heading[a], turn_rate[a] = _step(
            bodies.velocity[i, 0], bodies.velocity[i, 1], wishes.velocity[a, 0], wishes.velocity[a, 1],
            chosen[a, 0], chosen[a, 1], facing.heading[a], facing.turn_rate[a], model.relaxation, headed, period,
        )  # fmt: skip
        speed = math.sqrt(ahead * ahead + aside * aside)
        if speed > wishes.v_max[a]:
            ahead, aside = ahead * wishes.v_max[a] / speed, aside * wishes.v_max[a] / speed
        c, s = math.cos(heading[a]), math.sin(heading[a])
        chosen[a, 0], chosen[a, 1] = c * ahead - s * aside, s * ahead + c * aside
    return chosen, Facing(heading, turn_rate)


@light
def _step(
    vx: float, vy: float, wx: float, wy: float, fx: float, fy: float, theta: float, omega: float,
    relaxation: float, headed: Headed, period: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Speeds along and across the heading, heading and turn rate after a period in which the force f is held."""
    c, s = math.cos(theta), math.sin(theta)
    drive_x, drive_y = (wx - vx) / relaxation, (wy - vy) / relaxation
    ahead = c * vx + s * vy + period * (c * (drive_x + fx) + s * (drive_y + fy))
    damping = headed.damping / headed.mass
    rest = (
        headed.sideways * (c * fy - s * fx) / damping
    )  # the speed across the heading at which force and damping are even
    aside = rest + (c * vy - s * vx - rest) * math.exp(-damping * period)

    stiffness = headed.eagerness * headed.mass * math.sqrt(drive_x * drive_x + drive_y * drive_y)
    slow, fast = math.sqrt(stiffness / headed.ratio), math.sqrt(stiffness * headed.ratio)
    if fast * period < 1e-6:  # no drive, no torque
        return ahead, aside, wrap(theta + omega * period), omega
    target = math.atan2(wy, wx) if wx != 0.0 or wy != 0.0 else theta
    off = turn_between(target, theta)
    first = (omega + fast * off) / (fast - slow)  # off(t) = first exp(-slow t) + second exp(-fast t)
    second = off - first
    first, second = first * math.exp(-slow * period), second * math.exp(-fast * period)
    return ahead, aside, wrap(target + first + second), -slow * first - fast * second

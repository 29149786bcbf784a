"""The velocity of one control period: ORCA's; of a differential drive, among those that it can follow (Alonso-Mora et al. 2013)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.bodies import Bodies, nearest, sweep
from clearway.crowds.half_planes import solve
from clearway.crowds.orca import body_lines
from clearway.crowds.orca_walls import near_edges, wall_lines
from clearway.crowds.walls import Walls
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.holonomic import turning_time

LEAST_ERROR = 0.01
"""However near something is, the base may be so far off the velocity that it follows, m: with none it could not turn."""

SIDES = 5
"""Of the polygon of velocities that the base can follow."""


class Rules(NamedTuple):
    """What the navigator goes by.

    Attributes:
        distance: Obstacles whose centres are farther away are overlooked, m.
        neighbours: At most so many are heeded, the nearest.
        horizon: They are avoided for so long, s.
        wall_horizon: Walls are, s.
        tracking_error: How far the base may get off the velocity that it follows, m.
        tracking_time: In which it turns to that velocity, s.
        v_max: Largest speed, m/s.
        omega_max: Largest yaw rate, rad/s.
        period: Control period, s.
        holonomic: Whether the base can take up any velocity.
    """

    distance: float
    neighbours: int
    horizon: float
    wall_horizon: float
    tracking_error: float
    tracking_time: float
    v_max: float
    omega_max: float
    period: float
    holonomic: bool


@kernel
def choose(theta: float, wx: float, wy: float, bodies: Bodies, walls: Walls, rules: Rules) -> tuple[float, float]:
    """The velocity [m/s] nearest to the wish (wx, wy) of the first of `bodies`, a robot that heads for `theta` [rad]."""
    edges, most, n = walls.length.shape[0], rules.neighbours, bodies.radius.shape[0]
    lines, spare = np.empty((edges + SIDES + most, 4)), np.empty((edges + SIDES + most, 4))
    found, distance = np.empty(max(edges, most), np.int64), np.empty(max(edges, most))
    x, y, radius = bodies.position[0, 0], bodies.position[0, 1], bodies.radius[0]
    reach = rules.wall_horizon * rules.v_max + radius + rules.tracking_error
    near = near_edges(x, y, reach, walls, found, distance)
    gap = math.sqrt(distance[0]) - radius if near > 0 else math.inf
    for j in range(1, n):
        between = math.sqrt((bodies.position[j, 0] - x) ** 2 + (bodies.position[j, 1] - y) ** 2)
        gap = min(gap, between - radius - bodies.radius[j])
    # Where little room is left, the radius grows less, and fewer velocities can be followed that well.
    error = LEAST_ERROR if rules.holonomic else max(min(rules.tracking_error, 0.5 * gap), LEAST_ERROR)
    radii = bodies.radius.copy()
    radii[0] += error
    grown = Bodies(bodies.position, bodies.velocity, radii, bodies.layer, bodies.share)
    hard = wall_lines(0, grown, rules.wall_horizon, walls, found[:near], lines)
    if not rules.holonomic:
        followed(theta, error, rules, lines[hard : hard + SIDES])
        hard += SIDES
    near = nearest(0, 1, rules.distance, grown, sweep(grown.position), found[:most], distance[:most])
    body_lines(0, found[:near], grown, rules.horizon, rules.period, lines[hard:])
    return solve(lines, hard + near, hard, rules.v_max, wx, wy, spare)


@kernel
def followed(theta: float, error: float, rules: Rules, lines: FloatArray) -> None:
    """Write to `lines` (SIDES, 4) a convex polygon of velocities that are followed to within `error` [m].

    Up to 90 degrees off the heading a velocity V at the angle a is, for V sin(a) <= sqrt(2) error / t; beyond, for
    V <= error / t, with the time t that the turn takes. What lies within a strip and, backwards, a triangle keeps both.
    """
    side = error / turning_time(0.5 * math.pi, rules.tracking_time, rules.omega_max)
    back = error / turning_time(math.pi, rules.tracking_time, rules.omega_max)
    c, s = math.cos(theta), math.sin(theta)
    long = math.sqrt(side * side + back * back)
    for k in range(SIDES):
        if k == 0:
            px, py, dx, dy = 0.0, -side, 1.0, 0.0
        elif k == 1:
            px, py, dx, dy = rules.v_max, 0.0, 0.0, 1.0
        elif k == 2:
            px, py, dx, dy = 0.0, side, -1.0, 0.0
        elif k == 3:
            px, py, dx, dy = 0.0, side, -back / long, -side / long
        else:
            px, py, dx, dy = 0.0, -side, back / long, -side / long
        lines[k, 0], lines[k, 1] = c * px - s * py, s * px + c * py
        lines[k, 2], lines[k, 3] = c * dx - s * dy, s * dx + c * dy

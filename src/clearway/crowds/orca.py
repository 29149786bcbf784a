"""Optimal reciprocal collision avoidance among discs and polygons.

Van den Berg, Guy, Lin, Manocha 2011 ("Reciprocal n-body collision avoidance"), in the details as their library RVO2 does it:
each body seen forbids a half-plane of velocities, of which the decider takes its share; each edge of a wall that is near
enough forbids one outright. Everybody decides by what it sees now: velocities of a step are found all before one is taken.

Two that meet exactly head on in the middle stand before each other for ever, in this rule as in RVO2: who uses it sees to it
that wishes are never that exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.bodies import Bodies, IntArray, Wishes, nearest, sweep
from clearway.crowds.half_planes import solve
from clearway.crowds.orca_walls import near_edges, wall_lines
from clearway.crowds.walls import Walls
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray


class Care(NamedTuple):
    """How far each decider looks.

    Attributes:
        distance: (k,) bodies whose centres are farther away are overlooked, m.
        neighbours: (k,) int64, at most so many are heeded, the nearest.
        horizon: (k,) bodies are avoided for so long, s.
        wall_horizon: (k,) walls are, s.
    """

    distance: FloatArray
    neighbours: IntArray
    horizon: FloatArray
    wall_horizon: FloatArray


@kernel
def velocities(bodies: Bodies, wishes: Wishes, care: Care, walls: Walls, period: float) -> FloatArray:
    """(k, 2) the next velocity of each decider, m/s.

    Args:
        period: How long it holds, s: those that touch already are to be apart by then.
    """
    k, most = wishes.who.shape[0], 0
    for a in range(k):
        most = max(most, care.neighbours[a])
    edges = walls.length.shape[0]
    lines, spare = np.empty((edges + most, 4)), np.empty((edges + most, 4))
    found, distance = np.empty(max(edges, most), np.int64), np.empty(max(edges, most))
    chosen, sorted_ = np.empty((k, 2)), sweep(bodies.position)
    for a in range(k):
        i = wishes.who[a]
        reach = care.wall_horizon[a] * wishes.v_max[a] + bodies.radius[i]
        near = near_edges(bodies.position[i, 0], bodies.position[i, 1], reach, walls, found, distance)
        hard = wall_lines(i, bodies, care.wall_horizon[a], walls, found[:near], lines)
        m = care.neighbours[a]
        near = nearest(i, wishes.sees[a], care.distance[a], bodies, sorted_, found[:m], distance[:m])
        for n in range(near):
            body_line(i, found[n], bodies, care.horizon[a], period, lines[hard + n])
        chosen[a] = solve(
            lines, hard + near, hard, wishes.v_max[a], wishes.velocity[a, 0], wishes.velocity[a, 1], spare
        )  # fmt: skip
    return chosen


@light
def body_line(i: int, j: int, bodies: Bodies, horizon: float, period: float, line: FloatArray) -> None:
    """Write to `line` (4,) the half-plane of velocities that body `j` leaves to body `i`."""
    position, velocity = bodies.position, bodies.velocity
    rx, ry = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    vx, vy = velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1]
    both, far = bodies.radius[i] + bodies.radius[j], rx * rx + ry * ry
    touching = far <= both * both
    time = period if touching else horizon
    wx, wy = vx - rx / time, vy - ry / time  # from the centre of the cut-off disc
    along = wx * rx + wy * ry
    if touching or (along < 0.0 and along * along > both * both * (wx * wx + wy * wy)):
        w = math.sqrt(wx * wx + wy * wy)
        nx, ny = (wx / w, wy / w) if w > 0.0 else (1.0, 0.0)
        dx, dy = ny, -nx
        ux, uy = (both / time - w) * nx, (both / time - w) * ny
    else:
        leg = math.sqrt(far - both * both)
        if rx * wy - ry * wx > 0.0:
            dx, dy = (rx * leg - ry * both) / far, (rx * both + ry * leg) / far
        else:
            dx, dy = -(rx * leg + ry * both) / far, (rx * both - ry * leg) / far
        onto = vx * dx + vy * dy
        ux, uy = onto * dx - vx, onto * dy - vy
    share = bodies.share[j]
    line[0], line[1] = velocity[i, 0] + share * ux, velocity[i, 1] + share * uy
    line[2], line[3] = dx, dy

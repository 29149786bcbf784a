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

from clearway.crowds.bodies import Bodies, IntArray, Sweep, Wishes, nearest, sort
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


class Scratch(NamedTuple):
    """Room for what k deciders among n bodies work with, see `light`; m is the most that any of them heeds, bodies and edges.

    Attributes:
        order: The bodies from left to right.
        lines: (m, 4) half-planes.
        spare: (m, 4) more.
        found: (m,) int64, who or what is near.
        distance: (m,) how far away, m^2.
    """

    order: Sweep
    lines: FloatArray
    spare: FloatArray
    found: IntArray
    distance: FloatArray


@kernel
def scratch(bodies: int, care: Care, walls: Walls) -> Scratch:
    """Room to work with among so many bodies."""
    m = len(walls.length) + max(care.neighbours.max(), 0)
    return Scratch(
        Sweep(np.empty(bodies, np.int64), np.empty(bodies, np.int64)),
        np.empty((m, 4)), np.empty((m, 4)), np.empty(m, np.int64), np.empty(m),
    )  # fmt: skip


@kernel
def velocities(bodies: Bodies, wishes: Wishes, care: Care, walls: Walls, period: float) -> FloatArray:
    """(k, 2) the next velocity of each decider, m/s.

    Args:
        period: How long it holds, s: those that touch already are to be apart by then.
    """
    chosen = np.empty((len(wishes.who), 2))
    if len(chosen) > 0:
        choose(bodies, wishes, care, walls, period, scratch(len(bodies.radius), care, walls), chosen)
    return chosen


@light
def choose(
    bodies: Bodies, wishes: Wishes, care: Care, walls: Walls, period: float, work: Scratch, chosen: FloatArray
) -> None:  # fmt: skip
    """`velocities`, to `chosen` (k, 2)."""
    order, lines, spare, found, distance = work
    sort(bodies.position, order)
    for a in range(len(chosen)):
        i = wishes.who[a]
        reach = care.wall_horizon[a] * wishes.v_max[a] + bodies.radius[i]
        near = near_edges(bodies.position[i, 0], bodies.position[i, 1], reach, walls, found, distance)
        hard = wall_lines(i, bodies, care.wall_horizon[a], walls, found[:near], lines)
        m = care.neighbours[a]
        near = nearest(i, wishes.sees[a], care.distance[a], bodies, order, found[:m], distance[:m])
        body_lines(i, found[:near], bodies, care.horizon[a], period, lines[hard:])
        chosen[a, 0], chosen[a, 1] = solve(
            lines, hard + near, hard, wishes.v_max[a], wishes.velocity[a, 0], wishes.velocity[a, 1], spare
        )  # fmt: skip


@light
def body_lines(i: int, seen: IntArray, bodies: Bodies, horizon: float, period: float, lines: FloatArray) -> None:
    """Write to the first of `lines` (m, 4) the half-planes of velocities that the bodies `seen` leave to body `i`."""
    position, velocity, radii, shares = bodies.position, bodies.velocity, bodies.radius, bodies.share
    px, py, ix, iy = position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1]
    for n in range(len(seen)):
        j = seen[n]
        rx, ry = position[j, 0] - px, position[j, 1] - py
        vx, vy = ix - velocity[j, 0], iy - velocity[j, 1]
        both, far = radii[i] + radii[j], rx * rx + ry * ry
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
        lines[n, 0], lines[n, 1] = ix + shares[j] * ux, iy + shares[j] * uy
        lines[n, 2], lines[n, 3] = dx, dy

"""The social force model: people are driven to where they want to go, and by what is around them.

Helbing, Molnár 1995 ("Social force model for pedestrian dynamics") in the form of Moussaïd, Perozo, Garnier, Helbing, Theraulaz
2010 ("The walking behaviour of pedestrian social groups and its impact on crowd dynamics"), whose interaction between two is that
of Moussaïd et al. 2009 ("Experimental study of the behavioural mechanisms underlying self-organization in human crowds"). Forces are
per mass, so accelerations. They are summed as whole multiples of 2^-40 m/s^2: in which order bodies are listed changes no bit. Who
feels whom, and what, is computed in loops without branches, which the compiler makes work on several at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.bodies import Bodies, IntArray, Wishes, sweep
from clearway.crowds.elementary import atan2, exp
from clearway.crowds.walls import Walls, parted
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray


class SocialForce(NamedTuple):
    """Parameters, of which those without another source are Moussaïd et al. 2010's.

    Attributes:
        relaxation: tau, in which the wanted velocity is approached, s.
        strength: A, of the interaction between two, m/s^2 (2009).
        span: gamma: the interaction falls by 1/e on gamma times the length of D, m (2009).
        foresight: lambda, weight of the relative velocity in D, s/m (2009).
        turning: n, how narrow the range of directions is in which one turns aside (2009).
        slowing: n', the same for slowing down (2009).
        wall_strength: a, m/s^2.
        wall_span: b, on which a wall's force falls by 1/e, m.
        gaze: beta_1, of slowing down so that the others of the group are seen, 1/s per rad.
        attraction: beta_2, to the centre of a group that is stretched, m/s^2.
        repulsion: beta_3, between those of a group, m/s^2.
        sight: how far to each side one sees without slowing down, rad.
        apart: d_0, nearer than which those of a group repel each other, m.
        breadth: of two people, shoulder to shoulder, m: distances are between centres, less what two bodies are broader.
        reach: bodies farther away are overlooked, m; inf: none is.
    """

    relaxation: float
    strength: float
    span: float
    foresight: float
    turning: float
    slowing: float
    wall_strength: float
    wall_span: float
    gaze: float
    attraction: float
    repulsion: float
    sight: float
    apart: float
    breadth: float
    reach: float


MOUSSAID = SocialForce(
    0.5, 4.5, 0.35, 2.0, 2.0, 3.0, 3.0, 0.1, 4.0, 3.0, 1.0, 0.5 * math.pi, 0.8, 0.6, math.inf
)  # fmt: skip
"""The model as published. `breadth` is ours."""

QUANTUM = 2.0**-40
_LARGEST = 1e5
"""No single force is larger, m/s^2: so that sums of whole multiples of `QUANTUM` stay within 64 bits."""
_FAINT = 16.0
"""What has fallen by 1/e so often counts as nothing: less than 1e-6 m/s^2."""
_BLOCK = 256
"""So many pairs at least are worked on at once, but for the last: few enough to stay at hand."""


@kernel
def velocities(
    bodies: Bodies, wishes: Wishes, group: IntArray, model: SocialForce, walls: Walls, period: float
) -> FloatArray:
    """(k, 2) the velocity [m/s] of each decider a `period` [s] later, at most its v_max.

    Args:
        group: (n,) int64, to which group each body belongs; negative: to none.
    """
    chosen = forces(bodies, wishes, group, model, walls)
    for a in range(chosen.shape[0]):
        i, v_max = wishes.who[a], wishes.v_max[a]
        for c in range(2):
            driving = (wishes.velocity[a, c] - bodies.velocity[i, c]) / model.relaxation
            chosen[a, c] = bodies.velocity[i, c] + (chosen[a, c] + driving) * period
        speed = math.sqrt(chosen[a, 0] * chosen[a, 0] + chosen[a, 1] * chosen[a, 1])
        if speed > v_max:
            chosen[a] *= v_max / speed
    return chosen


@kernel
def forces(bodies: Bodies, wishes: Wishes, group: IntArray, model: SocialForce, walls: Walls) -> FloatArray:
    """(k, 2) what acts on each decider but for its own drive, m/s^2: others, walls, its group."""
    k = wishes.who.shape[0]
    total = np.zeros((k, 2), np.int64)
    m = len(walls.length)
    edge, felt, found = np.empty((5, m)), np.empty((3, m)), np.empty(m, np.int64)
    for e in range(m):
        edge[0, e], edge[1, e], edge[4, e] = walls.vertex[e, 0], walls.vertex[e, 1], walls.length[e]
        edge[2, e], edge[3, e] = walls.direction[e, 0], walls.direction[e, 1]
    _add_others(bodies, wishes, model, total)
    for a in range(k):
        i = wishes.who[a]
        x, y, radius = bodies.position[i, 0], bodies.position[i, 1], bodies.radius[i]
        _add_walls(x, y, radius, walls, edge, model, felt, found, total[a])
        if group[i] >= 0:
            _add_group(i, bodies, group, model, walls, total[a])
    return total.astype(np.float64) * QUANTUM


@kernel
def _add_others(bodies: Bodies, wishes: Wishes, model: SocialForce, total: IntArray) -> None:
    """Add the forces between every two to `total` (k, 2). What acts on one of two is the opposite of what acts on the other."""
    n, most = bodies.radius.shape[0], bodies.radius.shape[0] + _BLOCK
    order, decider = sweep(bodies.position).order, np.full(n, -1)
    for a in range(wishes.who.shape[0]):
        decider[wishes.who[a]] = a
    decider = decider[order]
    disc, layer, sees = np.empty((5, n)), bodies.layer[order], np.zeros(n, np.int64)
    x, y, vx, vy, radius = disc[0], disc[1], disc[2], disc[3], disc[4]
    fastest = broadest = 0.0
    for k in range(n):  # from left to right
        i = order[k]
        x[k], y[k], radius[k] = bodies.position[i, 0], bodies.position[i, 1], bodies.radius[i]
        vx[k], vy[k] = bodies.velocity[i, 0], bodies.velocity[i, 1]
        fastest, broadest = max(fastest, math.sqrt(vx[k] * vx[k] + vy[k] * vy[k])), max(broadest, radius[k])
        if decider[k] >= 0:
            sees[k] = wishes.sees[decider[k]]
    seen, faint, one, other = np.empty((5, n)), np.empty(n), np.empty(most, np.int64), np.empty(most, np.int64)
    pair, push, count = np.empty((5, most)), np.empty((2, most), np.int64), 0
    for k in range(n):
        speed = math.sqrt(vx[k] * vx[k] + vy[k] * vy[k])
        reach = _FAINT * model.span * (1.0 + model.foresight * (speed + fastest)) + radius[k] + broadest
        end = np.searchsorted(x, x[k] + min(reach, model.reach), side="right")
        _relate(k, end, disc, layer, sees, model, seen, faint)
        before = count
        for m in range(k + 1, end):  # without branches, as who is felt is hard to guess
            other[count] = m
            count += faint[m] < _FAINT
        for p in range(before, count):
            one[p], m = k, other[p]
            for row in range(5):
                pair[row, p] = seen[row, m]
        if count < _BLOCK and k < n - 1:
            continue
        _interact(count, pair, model, push)
        for p in range(count):
            here, there, px, py = one[p], other[p], push[0, p], push[1, p]
            a, b = decider[here], decider[there]
            if layer[there] & sees[here] != 0:
                total[a, 0] += px
                total[a, 1] += py
            if layer[here] & sees[there] != 0:
                total[b, 0] -= px
                total[b, 1] -= py
        count = 0


@light
def _relate(
    k: int, end: int, disc: FloatArray, layer: IntArray, sees: IntArray, model: SocialForce, seen: FloatArray,
    faint: FloatArray,
) -> None:  # fmt: skip
    """Write how disc `k` sees those from the next one on and before `end`.

    Args:
        disc: (5, n) x, y, vx, vy, radius, from left to right.
        layer, sees: (n,) of each, the layers that it is on and looks at.
        seen: (5, n) written: where the other is [m], D, the relative velocity and the direction to it in one, and d / B, never less than -16.
        faint: (n,) written: how often the force has fallen by 1/e at least, as 2 (1 - cos theta) is at most theta^2; inf where
            neither looks at the other; NaN for who is in the same place, or where D is nothing.
    """
    gamma, foresight, breadth, reach = model.span, model.foresight, model.breadth, model.reach
    least, per_gamma = min(model.turning, model.slowing), 1.0 / gamma
    x0, y0, vx0, vy0, radius0 = disc[0, k], disc[1, k], disc[2, k], disc[3, k], disc[4, k]
    on, layer0, sees0 = slice(k + 1, end), layer[k], sees[k]
    x, y, vx, vy, radius = disc[0, on], disc[1, on], disc[2, on], disc[3, on], disc[4, on]
    rx, ry, dx, dy, near = seen[0, on], seen[1, on], seen[2, on], seen[3, on], seen[4, on]
    layers, looks, fallen = layer[on], sees[on], faint[on]
    for m in range(len(x)):
        px, py = x[m] - x0, y[m] - y0
        centres = math.sqrt(px * px + py * py)
        per_centres = 1.0 / centres
        ux, uy = foresight * (vx0 - vx[m]) + px * per_centres, foresight * (vy0 - vy[m]) + py * per_centres
        length = math.sqrt(ux * ux + uy * uy)
        per_length, narrow = 1.0 / length, least * gamma * length
        d = centres - max(radius0 + radius[m] - breadth, 0.0)
        rx[m], ry[m], dx[m], dy[m], near[m] = px, py, ux, uy, max(d * per_length * per_gamma, -_FAINT)
        cosine = (ux * px + uy * py) * per_length * per_centres
        felt = (layers[m] & sees0 | layer0 & looks[m] != 0) & (centres <= reach)
        fallen[m] = near[m] + 2.0 * narrow * narrow * (1.0 - cosine) if felt else math.inf


@light
def _interact(count: int, pair: FloatArray, model: SocialForce, push: IntArray) -> None:
    """Write what one of two feels by the other: slower along D, and aside (Moussaïd et al. 2009, equations 3 to 6).

    Args:
        count: How many pairs there are.
        pair: (5, m) as `seen` of `_relate`.
        push: (2, m) written, in `QUANTUM`.
    """
    gamma, turning, slowing, strength = model.span, model.turning, model.slowing, model.strength
    rx, ry, dx, dy, near = pair[0, :count], pair[1, :count], pair[2, :count], pair[3, :count], pair[4, :count]
    fx, fy = push[0, :count], push[1, :count]
    for p in range(len(rx)):
        length, across = math.sqrt(dx[p] * dx[p] + dy[p] * dy[p]), dx[p] * ry[p] - dy[p] * rx[p]
        theta = atan2(across, dx[p] * rx[p] + dy[p] * ry[p])  # from D to the direction in which the other is
        turned = gamma * length * theta
        slower = strength / length * exp(-near[p] - (slowing * turned) * (slowing * turned))
        aside = strength / length * exp(-near[p] - (turning * turned) * (turning * turned))
        aside = (aside if across > 0.0 else -aside) if across != 0.0 else 0.0
        fx[p], fy[p] = quanta(aside * dy[p] - slower * dx[p]), quanta(-aside * dx[p] - slower * dy[p])


@light
def _add_walls(
    x: float, y: float, radius: float, walls: Walls, edge: FloatArray, model: SocialForce, felt: FloatArray,
    found: IntArray, total: IntArray,
) -> None:  # fmt: skip
    """Add what walls do to a disc at (x, y): each place of a wall to which it is nearer than to those beside it.

    Args:
        edge: (5, m) x and y of each vertex and direction, and the length, of `walls`.
        felt: (3, m) room to work with.
        found: (m,) the same.
    """
    span, strength, near, count = model.wall_span, model.wall_strength, 0, 0
    reach = radius + 2.0 * _FAINT * span  # twice: those of many posts add up
    vx, vy, dx, dy, length = edge[0], edge[1], edge[2], edge[3], edge[4]
    aside, rx, ry = felt[0], felt[1], felt[2]
    for k in range(len(vx)):
        px, py = x - vx[k], y - vy[k]
        side, along = dx[k] * py - dy[k] * px, px * dx[k] + py * dy[k]
        faced = (along > -reach) & ((along <= 0.0) | (along < length[k]) & (side <= 0.0))
        aside[k] = abs(side) if faced else math.inf
    for k in range(len(vx)):  # without branches, as which are near is hard to guess
        found[near] = k
        near += aside[k] < reach
    for p in range(near):
        k = found[p]
        px, py = x - vx[k], y - vy[k]
        if px * dx[k] + py * dy[k] <= 0.0:  # the corner, if the edge before ends there as well
            j = walls.preceding[k]
            if (x - vx[j]) * dx[j] + (y - vy[j]) * dy[j] < length[j]:
                continue
            rx[count], ry[count] = px, py
        else:
            side = dx[k] * py - dy[k] * px
            rx[count], ry[count] = -side * dy[k], side * dx[k]
        count += 1
    fx, fy = rx[:count], ry[:count]
    for p in range(len(fx)):
        d = math.sqrt(fx[p] * fx[p] + fy[p] * fy[p])
        force = strength * exp((radius - d) / span) / d
        force = force if (d > 0.0) & (d < reach) else 0.0
        fx[p], fy[p] = force * fx[p], force * fy[p]
    for p in range(count):
        total[0] += quanta(fx[p])
        total[1] += quanta(fy[p])


@light
def _add_group(i: int, bodies: Bodies, group: IntArray, model: SocialForce, walls: Walls, total: IntArray) -> None:
    """Add what its group does to body `i`: those of it that no wall parts it from, as it would be drawn to the others through one."""
    x, y, size = bodies.position[i, 0], bodies.position[i, 1], 0
    cx, cy = 0, 0
    for j in range(group.shape[0]):
        if group[j] != group[i] or j == i:
            continue
        if parted(x, y, bodies.position[j, 0], bodies.position[j, 1], walls):
            continue
        size += 1
        rx, ry = bodies.position[j, 0] - x, bodies.position[j, 1] - y
        cx += quanta(rx)
        cy += quanta(ry)
        d = math.sqrt(rx * rx + ry * ry)
        if 0.0 < d < model.apart:
            total[0] -= quanta(model.repulsion * rx / d)
            total[1] -= quanta(model.repulsion * ry / d)
    if size == 0:
        return
    ox, oy = cx * QUANTUM / size, cy * QUANTUM / size  # to the centre of the others
    away = math.sqrt(ox * ox + oy * oy)
    if away == 0.0:
        return
    if away * size / (size + 1) > 0.5 * size:  # from the centre of all
        total[0] += quanta(model.attraction * ox / away)
        total[1] += quanta(model.attraction * oy / away)
    vx, vy = bodies.velocity[i, 0], bodies.velocity[i, 1]
    turn = abs(atan2(vx * oy - vy * ox, vx * ox + vy * oy)) - model.sight
    if turn > 0.0:
        total[0] -= quanta(model.gaze * turn * vx)
        total[1] -= quanta(model.gaze * turn * vy)


@kernel
def quanta(value: float) -> int:
    """`value` in whole multiples of `QUANTUM`."""
    return int(np.rint(min(max(value, -_LARGEST), _LARGEST) / QUANTUM))

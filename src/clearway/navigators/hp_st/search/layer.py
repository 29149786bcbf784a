"""One layer of the search: the children of its nodes, and those of them that stay."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.motion import ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import (
    STEPS,
    Base,
    Nearby,
    PredictedObstacles,
    belts_of,
    collision_risks,
    near,
)
from clearway.navigators.hp_st.environment.field import Field, look_at
from clearway.navigators.hp_st.guarantee.stopping import Halting, StepEnd, stopping_risk
from clearway.navigators.hp_st.search.costs import SearchCosts, faces, to_go, worth
from clearway.navigators.hp_st.search.manoeuvres import to_manoeuvre
from clearway.navigators.hp_st.search.tree import COST, OMEGA, THETA, TOTAL, IntArray, Tree, V, X, Y
from clearway.robots.drive_limits import DriveLimits, immediate, possible

SECTORS = 17
"""Eight directions from the start in two rings, and what has hardly left it."""

V_TOLD, OMEGA_TOLD, V_END, OMEGA_END, V_MEAN, OMEGA_MEAN = range(0, 6 * STEPS, STEPS)
TURN, DX, DY, COS, SIN, FAR, ALONG, LEFT, RISK = range(6 * STEPS, 15 * STEPS, STEPS)
"""Where in `Children.step` begins what is known of each of them: v and omega that are told, at its end and on the mean; by how much it
turns and leads along x and y; the heading there; how far the goal is from there, how far ahead that way leads, and how long it takes; and what the step risks, see `collision_risks`."""

_HEADINGS = 16
_PER_PLACE = 3 * _HEADINGS


class Problem(NamedTuple):
    """What is searched for.

    Attributes:
        start: (5,) x, y, theta, v, omega.
        base: What the base can do, and its outline.
        obstacles: What stands, and what is foreseen to move.
        field: The way to the goal past what stands.
        area: (4,) where the robot's centre may be.
        costs: What counts.
        controls: (C, 2) v and omega that are tried, as shares of the limits.
        hint: (k, 2) v [m/s] and omega [rad/s] of the last plan, layer by layer: its nodes are among those that are tried.
    """

    start: FloatArray
    base: Base
    obstacles: PredictedObstacles
    field: Field
    area: FloatArray
    costs: SearchCosts
    controls: FloatArray
    hint: FloatArray


class Children(NamedTuple):
    """Room for the M children of a layer's nodes. Those that lie in one cell are rivals; a table knows who holds which.

    Attributes:
        node: (M, 7), see the columns.
        origin: (M,) whose child it is.
        command: (M, 2) the v and omega told that led there.
        cell: (M,) in which it lies.
        slot: (M,) of the table, where that cell is entered.
        sector: (M,) in which it lies, seen from the start.
        owner: (a power of 2,) the table: which child holds a cell, open addressing; -1: none.
        step: (15 STEPS,) the steps from a node, see `V_TOLD`: all are driven at once, on vector registers.
    """

    node: FloatArray
    origin: npt.NDArray[np.int32]
    command: FloatArray
    cell: npt.NDArray[np.int32]
    slot: npt.NDArray[np.int32]
    sector: IntArray
    owner: npt.NDArray[np.int32]
    step: FloatArray


class Front(NamedTuple):
    """Where the search stands.

    Attributes:
        hinted: The node of the layer, or the child of it, that follows the hint; -1: none.
        best: What the best arrival counts so far, s; inf: there is none.
    """

    hinted: int
    best: float


@kernel
def room_for(most: int) -> Children:
    """Room for `most` children."""
    size = 1
    while size < 2 * most:
        size *= 2
    return Children(
        np.empty((most, 7)), np.empty(most, np.int32), np.empty((most, 2)), np.empty(most, np.int32),
        np.empty(most, np.int32), np.empty(most, np.int64), np.full(size, -1, np.int32), np.zeros(15 * STEPS),
    )  # fmt: skip


@light
def expand(
    problem: Problem, tree: Tree, k: int, first: float, front: Front, children: Children, nearby: Nearby
) -> tuple[int, Front]:
    """The children of the nodes of layer `k`: of those that lie in one cell the best.

    Args:
        problem: What the search is asked.
        tree: What was found so far; its best arrival is updated.
        k: The layer.
        first: How far the goal is from the start, in metres.
        front: Where the search stands.
        children: Room for them, filled.
        nearby: Room for what a node can meet, filled.

    Returns:
        How many there are, and where the search stands.
    """
    # taken out of their tuples once: inside the loop that would cost more than the sums
    start, base, obstacles, field, area, costs, controls, hint = problem
    distance, hidden, corner, resolution, target = field
    limits, foot = base.limits, base.foot
    low, high, yaw = limits.v_min, limits.v_max, limits.omega_max
    faster, slower = limits.acceleration, limits.deceleration
    margin, soft = costs.margin, costs.soft
    dt, yaw_change_cost, pace = costs.step, costs.yaw_change_cost, costs.pace
    reach, per_high = costs.reach, 1.0 / high
    fall = slower if costs.stop else math.inf
    coupled = limits.wheelbase > 0.0 or limits.v_y_max > 0.0
    poised = len(costs.manoeuvres) > 0
    nodes, count, goal = tree.nodes, tree.count, tree.goal
    child, origin, command, cell, slot, sector, owner, step = children

    mask, half = len(owner) - 1, 2 * len(count)
    fastest, halt = max(high, -low), costs.halt * dt * costs.discount ** (k * dt)
    braking = 0.5 * fastest * fastest / slower + margin if halt > 0.0 else 0.0
    halting = Halting(base, obstacles.reach, margin, dt / costs.stride, dt)
    per_cell, wide = 2.0 / (fastest * dt), 2 * half + 1
    found, next_hinted, best_goal = 0, -1, front.best
    weight = costs.contact_cost * costs.discount ** (k * dt)
    nearness = costs.near * dt / weight  # what stands will not be gone later: that is not to be put off
    begun, ended = k * dt, (k + 1) * dt
    near_start = (0.3 * ended * fastest) ** 2
    moving = belts_of(obstacles, k * costs.stride, costs.stride, costs.union, costs.ahead, nearby.belts)
    for b in range(count[k]):
        x0, y0, theta0 = nodes[k, b, X], nodes[k, b, Y], nodes[k, b, THETA]
        v0, w0, cost0 = nodes[k, b, V], nodes[k, b, OMEGA], nodes[k, b, COST]
        cos0, sin0 = math.cos(theta0), math.sin(theta0)
        far, ux, uy = look_at(distance, hidden, corner, resolution, target, x0, y0)
        gx, gy = target[0] - x0, target[1] - y0
        off = math.atan2(cos0 * uy - sin0 * ux, cos0 * ux + sin0 * uy)
        inside = _inside(area, x0, y0)
        s, m = near(moving, x0, y0, foot.circumscribed + fastest * dt + braking, soft, nearby)
        extra = 2 if b == front.hinted and k < len(hint) else 1
        steps = 0
        for c in range(len(controls) + 1 + extra):
            if c < len(controls):
                v_goal = controls[c, 0] * (high if controls[c, 0] >= 0.0 else -low)
                w_goal = controls[c, 1] * yaw
            elif c == len(controls):  # turn into the way at once
                v_goal, w_goal = high, min(max(off / dt, -yaw), yaw)
            elif c == len(controls) + 1:  # the same backwards
                if low == 0.0:
                    continue
                v_goal, w_goal = low, min(max(wrap(off + math.pi) / dt, -yaw), yaw)
            else:
                v_goal, w_goal = hint[k, 0], hint[k, 1]
            if coupled:
                v_goal, w_goal, _ = possible(limits, v_goal, w_goal, 0.0)
            step[V_TOLD + steps], step[OMEGA_TOLD + steps] = v_goal, w_goal
            steps += 1
        _velocities(step, steps, limits, v0, w0, dt)
        _arcs(step, steps, cos0, sin0, dt)
        for c in range(steps):
            x, y = x0 + step[DX + c], y0 + step[DY + c]
            step[FAR + c], ux, uy = look_at(distance, hidden, corner, resolution, target, x, y)
            step[ALONG + c] = ux * step[COS + c] + uy * step[SIN + c]
        _times_to_go(step, steps, low, high, yaw, faster, fall)
        collision_risks(
            nearby, s, m, foot, margin, soft, nearness, theta0, step[DX : DX + steps], step[DY : DY + steps],
            step[TURN : TURN + steps], step[RISK : RISK + steps],
        )  # fmt: skip
        for c in range(steps):
            dx, dy, turn, left = step[DX + c], step[DY + c], step[TURN + c], step[LEFT + c]
            x, y, v_end, w_end = x0 + dx, y0 + dy, step[V_END + c], step[OMEGA_END + c]
            if inside and not _inside(area, x, y):
                continue
            cost = cost0 + yaw_change_cost * abs(w_end - w0)
            cost += costs.reverse_cost * dt if step[V_MEAN + c] < 0.0 else 0.0
            if poised:
                left = max(
                    left,
                    to_manoeuvre(costs.manoeuvres, target, costs.heading, x, y, theta0 + turn) * per_high,
                )
            total = worth(costs, first, ended, step[FAR + c], left) + cost
            if total >= best_goal and pace == 0.0:
                continue
            theta = wrap(theta0 + turn)
            i = int((x - start[X]) * per_cell + (half + 0.5))
            j = int((y - start[Y]) * per_cell + (half + 0.5))
            if i < 0 or j < 0 or i >= wide or j >= wide:
                continue
            place = (i * wide + j) * _PER_PLACE + _attitude(theta, v_end)
            at = (place * 40503 >> 4) & mask
            rival = owner[at]
            while rival >= 0 and cell[rival] != place:
                at = (at + 1) & mask
                rival = owner[at]
            follows = extra == 2 and c == steps - 1
            if rival >= 0 and child[rival, TOTAL] <= total and not follows:
                continue
            risk = step[RISK + c]
            if risk < 0.0:
                continue
            cost += weight * risk
            total += weight * risk
            if halt > 0.0:
                late = halt * stopping_risk(nearby, s, m, halting, StepEnd(theta0 + turn, dx, dy, v_end, w_end))
                cost += late
                total += late
            left = _arrival(gx, gy, dx, dy, far, v_end, reach, fall, per_high)
            arrives = left >= 0.0 and (not poised or faces(costs, theta))
            if arrives:
                total = worth(costs, first, ended if fall < math.inf else begun, 0.0, left) + cost
            if total >= best_goal and (arrives or pace == 0.0):
                continue
            if rival >= 0 and not follows:
                if child[rival, TOTAL] <= total:
                    continue
                n = rival
            else:
                n = found
                cell[n], slot[n] = place, at
                if rival < 0:
                    owner[at] = n
                found += 1
            child[n, X], child[n, Y], child[n, THETA], child[n, V], child[n, OMEGA] = x, y, theta, v_end, w_end
            child[n, COST], child[n, TOTAL] = cost, total
            origin[n], command[n, 0], command[n, 1] = b, step[V_TOLD + c], step[OMEGA_TOLD + c]
            sector[n] = _sector(x - start[X], y - start[Y], near_start)
            if follows:
                next_hinted = n
            if arrives:
                best_goal = total
                goal[0], goal[1], goal[2] = k + 1.0, float(n), total
    return found, Front(next_hinted, best_goal)


@light
def _velocities(step: FloatArray, count: int, limits: DriveLimits, v0: float, w0: float, dt: float) -> None:
    """How fast a base that drives `v0` and `w0` is at the end of each of the first `count` steps, and on the mean."""
    car, free = limits.wheelbase > 0.0, immediate(limits)
    faster, slower = limits.acceleration, limits.deceleration
    turn_faster, turn_slower = limits.angular_acceleration, limits.angular_deceleration
    for i in range(_whole(count)):
        v_goal, w_goal = step[V_TOLD + i], step[OMEGA_TOLD + i]
        if free and not car:
            v_end, v, w_end, w = v_goal, v_goal, w_goal, w_goal
        else:
            v_end, v = ramp(v0, v_goal, faster, slower, dt)
            w_end, w = ramp(w0, w_goal, turn_faster, turn_slower, dt)
        if car:  # the wheels are steered in less than a step
            bent = w_goal / v_goal if v_goal != 0.0 else (w0 / v0 if v0 != 0.0 else 0.0)
            w_end, w = bent * v_end, bent * v
        step[V_END + i], step[OMEGA_END + i], step[V_MEAN + i], step[OMEGA_MEAN + i] = v_end, w_end, v, w


@light
def _arcs(step: FloatArray, count: int, cos0: float, sin0: float, dt: float) -> None:
    """Where the first `count` steps from a heading, of which `cos0` and `sin0` are told, lead: arcs, by series, as half their turn is small."""
    for i in range(_whole(count)):
        h = 0.5 * step[OMEGA_MEAN + i] * dt
        h2 = h * h
        wave = 1.0 - h2 * (1.0 / 6.0 - h2 * (1.0 / 120.0 - h2 / 5040.0))  # sin h / h
        ch, sh = 1.0 - h2 * (0.5 - h2 * (1.0 / 24.0 - h2 / 720.0)), wave * h
        chord = step[V_MEAN + i] * dt * wave
        c2, s2 = ch * ch - sh * sh, 2.0 * sh * ch
        step[TURN + i] = 2.0 * h
        step[DX + i], step[DY + i] = chord * (cos0 * ch - sin0 * sh), chord * (sin0 * ch + cos0 * sh)
        step[COS + i], step[SIN + i] = cos0 * c2 - sin0 * s2, sin0 * c2 + cos0 * s2


@light
def _times_to_go(step: FloatArray, count: int, low: float, high: float, turn: float, rate: float, fall: float) -> None:
    """How long it takes to the goal from where the first `count` steps end, see `to_go`."""
    for i in range(_whole(count)):
        step[LEFT + i] = to_go(low, high, turn, rate, fall, step[FAR + i], step[ALONG + i], step[V_END + i])


@light
def _whole(count: int) -> int:
    """So many steps fill whole vector registers; what is made of those beyond `count`, nobody reads."""
    return (count + 3) // 4 * 4


@light
def _arrival(
    gx: float, gy: float, dx: float, dy: float, far: float, v: float, reach: float, fall: float, per_high: float
) -> float:
    """How much longer it takes to the goal at (gx, gy) once a step by (dx, dy), at whose end it drives `v`, has come
    within `reach` of it, s; -1: it does not. One that has to brake (`fall` is finite) has to be able to stop there; time
    counts from the end of its step, else from the start, where the goal was `far` away."""
    share = min(max((gx * dx + gy * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
    if not (gx - share * dx) ** 2 + (gy - share * dy) ** 2 <= reach * reach:
        return -1.0
    if fall < math.inf:
        rest = math.sqrt((gx - dx) ** 2 + (gy - dy) ** 2)
        return abs(v) / fall + rest * per_high if rest <= reach and v * v <= 2.0 * fall * reach else -1.0
    return max(far - reach, 0.0) * per_high


@light
def _attitude(theta: float, v: float) -> int:
    """One of `_PER_PLACE`: by heading, and by direction of travel."""
    turned = min(int((theta + math.pi) * (_HEADINGS / (2.0 * math.pi))), _HEADINGS - 1)
    return turned * 3 + (0 if v < -0.02 else (1 if v < 0.02 else 2))


@kernel
def keep_best(tree: Tree, k: int, children: Children, found: int, beam: int, quota: int, hinted: int) -> int:
    """Fill layer `k` + 1 with those of the first `found` children that stay, and forget all of them.

    Args:
        tree: Its layer, its count and its best arrival are written.
        k: The layer before.
        children: The children of that layer.
        found: So many of them there are.
        beam: So many of the best stay.
        quota: So many of the best of each sector stay.
        hinted: This one stays, too; -1: none.

    Returns:
        The node that this one became; -1: none.
    """
    child, sector, nodes, goal = children.node, children.sector, tree.nodes, tree.goal
    for n in range(found):
        children.owner[children.slot[n]] = -1
    limit = np.full(SECTORS, math.inf)
    if found > beam:
        limit[:] = _limits(child, sector, found, beam, quota)
    m, became = 0, -1
    for turn in range(2):  # first those that must be kept: the hint's node and an arrival
        for n in range(found):
            arrival = goal[0] == k + 1.0 and float(n) == goal[1]
            if (n == hinted or arrival) != (turn == 0) or m >= nodes.shape[1]:
                continue
            if turn == 1 and child[n, TOTAL] > limit[sector[n]]:
                continue
            for i in range(7):
                nodes[k + 1, m, i] = child[n, i]
            tree.parent[k + 1, m] = children.origin[n]
            tree.control[k + 1, m, 0], tree.control[k + 1, m, 1] = children.command[n, 0], children.command[n, 1]
            if n == hinted:
                became = m
            if arrival:
                goal[0], goal[1] = -2.0 - k, float(m)
            m += 1
    if goal[0] <= -2.0:
        goal[0] = -1.0 - goal[0]
    tree.count[k + 1] = m
    return became


@light
def _sector(dx: float, dy: float, near2: float) -> int:
    """In which of `SECTORS` a place lies, seen from the start."""
    if dx * dx + dy * dy < near2:
        return SECTORS - 1
    steep = abs(dy) > abs(dx)
    ring = 8 if dx * dx + dy * dy > 4.9 * near2 else 0
    return ring + (4 if dx < 0.0 else 0) + (2 if dy < 0.0 else 0) + (1 if steep else 0)


@light
def _nth_smallest(values: FloatArray, n: int) -> float:
    """The element that stands at `n` once `values`, which are re-ordered, are sorted: Hoare's quickselect.

    NumPy's partition would do, but Numba compiles it anew, with a sort and a search for what is unique, in each process.
    """
    first, last = 0, len(values) - 1
    while first < last:
        pivot, i, j = values[(first + last) // 2], first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if n <= j:
            last = j
        elif n >= i:
            first = i
        else:
            break
    return float(values[n])


@kernel
def _limits(child: FloatArray, sector: IntArray, found: int, beam: int, quota: int) -> FloatArray:
    """(SECTORS,) up to which total a child of each sector stays: the best `beam`, and of each sector the best `quota`."""
    totals = np.empty(found)
    for n in range(found):
        totals[n] = child[n, TOTAL]
    whole = _nth_smallest(totals.copy(), beam - 1)
    limits = np.full(SECTORS, whole)
    if quota > 0:
        best, have = np.empty((SECTORS, quota)), np.zeros(SECTORS, np.int64)
        for n in range(found):
            total, g = totals[n], sector[n]
            if have[g] == quota and total >= best[g, quota - 1]:
                continue
            at = min(have[g], quota - 1)
            while at > 0 and best[g, at - 1] > total:
                best[g, at] = best[g, at - 1]
                at -= 1
            best[g, at] = total
            have[g] = min(have[g] + 1, quota)
        for g in range(SECTORS):
            if have[g] > 0:
                limits[g] = max(whole, best[g, have[g] - 1])
    return limits


@light
def _inside(area: FloatArray, x: float, y: float) -> bool:
    return bool(area[0] <= x <= area[2] and area[1] <= y <= area[3])

"""Ways through space and time: a beam search over the robot's own motions, layer by layer.

All nodes of a layer lie at the same instant, so obstacles are where their forecasts say for that instant and no belt
covers what is past. A node's children are arcs that the base can drive in one step. A child is worth the time that has
gone, the time that it still takes to the goal past what stands (`field`), and what it risks: the probability of contact
with each forecast obstacle on the way, in seconds that we'd give to avoid it. Of the children of a layer the best of
each cell of (x, y, heading, direction of travel) stays, of these the best `beam`, and the best of each sector around the
start: ways to all sides, and those that wait, thus stay in play while another looks better. At a tenth of the nodes that
finds as cheap ways among obstacles as the best alone would.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.contact import BELT, Base, PredictedObstacles, belts_of, collision_risk, near
from clearway.navigators.hp_st.field import Field, look_at
from clearway.robots.drive_limits import immediate

IntArray = npt.NDArray[np.int64]

X, Y, THETA, V, OMEGA, COST, TOTAL = range(7)
"""Columns of a node: pose, speeds, what it cost so far beyond time, and that with time and time to go, s."""

_HEADINGS = 16
_SECTORS = 17
"""Eight directions from the start in two rings, and what has hardly left it."""
_SHARE = 20
"""Of each sector a node is kept for each so many of the beam, and at least one."""


class SearchCosts(NamedTuple):
    """What the search weighs.

    Attributes:
        step: s of a layer. stride: instants of the obstacles in it. contact_cost: s that a contact is worth. discount: factor on that
        per second ahead, as there is time to think again. margin: kept from what stands, m. soft: from that on nearness costs, m. near: s per s at the margin.
        yaw_change_cost: s per rad/s of change of the yaw rate. reverse_cost: s per s of reversing. reach: radius around the goal that
        ends the way, m. union: so many of the first instants count at any time (0: each at its own), the belts of a
        planner that is blind to time. stop: whether it has to stop at the goal. pace: m/s of the reference
        that is tracked where time to go doesn't count, see `worth`; 0: it counts. sectors: whether of each sector some
        nodes are kept; if not, as many more of the best.
    """

    step: float
    stride: int
    contact_cost: float
    discount: float
    margin: float
    soft: float
    near: float
    yaw_change_cost: float
    reverse_cost: float
    reach: float
    union: int
    stop: bool
    pace: float
    sectors: bool


class Tree(NamedTuple):
    """What was found.

    Attributes:
        nodes: (L + 1, B, 7), see the columns. parent: (L + 1, B). control: (L + 1, B, 2) the v and omega told that led there.
        count: (L + 1,) nodes in each layer. goal: (3,) layer, node, and time of the best arrival within the layers
        (-1: none).
    """

    nodes: FloatArray
    parent: IntArray
    control: FloatArray
    count: IntArray  # type: ignore[assignment]  # a tuple's method of that name isn't missed
    goal: FloatArray


@kernel
def time_to_go(base: Base, far: float, cos_off: float, v: float, stop: bool) -> float:
    """How long it takes to a goal `far` [m] away past what stands, s, forwards or backwards, whichever is faster.

    Args:
        cos_off: cosine of the angle between the heading and the way. v: speed now, m/s. stop: whether it has to stop there.
        A turn by a at full speed on an arc loses (a - sin a) / turn; what is lost to speeding up and braking is added.
    """
    limits = base.limits
    fall = limits.deceleration if stop else math.inf
    return _to_go(limits.v_min, limits.v_max, limits.omega_max, limits.acceleration, fall, far, cos_off, v)


@kernel
def _to_go(
    low: float, high: float, turn: float, rate: float, fall: float, far: float, cos_off: float, v: float
) -> float:
    cos_off = min(max(cos_off, -1.0), 1.0)
    a = abs(cos_off)  # Abramowitz and Stegun 4.4.45: within 7e-5 rad, at a third of the time
    off = math.sqrt(1.0 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - a * 0.0187293)))
    if cos_off < 0.0:
        off = math.pi - off
    lost = off - math.sqrt(1.0 - a * a)
    best = _along(high, rate, fall, far, v) + lost / turn
    if low < 0.0:
        best = min(best, _along(-low, rate, fall, far, -v) + (math.pi - 2.0 * off + lost) / turn)
    return best


@kernel
def _along(high: float, rate: float, fall: float, far: float, v: float) -> float:
    """The same on a line, for one who drives towards the goal with `v`, at most with `high`."""
    lost = 0.0
    if fall < math.inf:
        stop = 0.5 * v * v / fall
        if v > 0.0 and stop > far:  # beyond it, and back
            return v / fall + math.sqrt(2.0 * (stop - far) * (1.0 / rate + 1.0 / fall))
        if v < high and far < 0.5 * (high * high - v * abs(v)) / rate + 0.5 * high * high / fall:  # never that fast
            top2 = max((far + 0.5 * v * abs(v) / rate) / (0.5 / rate + 0.5 / fall), 0.0)
            top = math.sqrt(top2)
            return max(top - v, 0.0) / rate + top / fall
        lost = 0.5 * high / fall
    if rate < math.inf:
        lost += max(high - v, 0.0) ** 2 / (2.0 * rate * high)
    return far / high + lost


@kernel
def worth(costs: SearchCosts, first: float, t: float, far: float, left: float) -> float:
    """What it counts to be `far` [m] from the goal `t` [s] from now, s.

    With time to go that is the time gone and that `left` [s]. Without (`SearchCosts.pace` > 0) it is what tracking a reference
    counts, as in paper B: how far the place is, either way, from one that goes at the pace from `first` [m] on.
    """
    if costs.pace > 0.0:
        return abs(far - max(first - costs.pace * t, 0.0)) / costs.pace
    return t + left


@kernel
def nodes_of(beam: int) -> int:
    """How many nodes a layer has at most: the best `beam`, and a share for each sector."""
    return beam + _SECTORS * max(1, beam // _SHARE)


@kernel
def search(
    start: FloatArray, base: Base, obstacles: PredictedObstacles, field: Field, area: FloatArray, costs: SearchCosts, layers: int, beam: int,
    controls: FloatArray, hint: FloatArray,
) -> Tree:  # fmt: skip
    """Search from `start` (5,) x, y, theta, v, omega.

    Args:
        area: (4,) where the robot's centre may be. controls: (C, 2) v and omega as shares of the limits. hint: (k, 2)
            v [m/s] and omega [rad/s] layer by layer of the last plan: its nodes are among those that are tried.
    """
    quota = max(1, beam // _SHARE)
    size = nodes_of(beam)
    if not costs.sectors:
        beam, quota = size, 0
    nodes, parent = np.empty((layers + 1, size, 7)), np.zeros((layers + 1, size), np.int64)
    control, count = np.zeros((layers + 1, size, 2)), np.zeros(layers + 1, np.int64)
    goal = np.array((-1.0, -1.0, math.inf))
    # taken out of their tuples once: inside the loop that would cost more than the sums
    distance, hidden, corner, resolution, target = (
        field.distance,
        field.hidden,
        field.origin,
        field.resolution,
        field.goal,
    )
    limits = base.limits
    low, high, yaw = limits.v_min, limits.v_max, limits.omega_max
    faster, slower = limits.acceleration, limits.deceleration
    turn_faster, turn_slower = limits.angular_acceleration, limits.angular_deceleration
    vertices, rim, outer = base.foot.vertices, base.foot.radius, base.foot.circumscribed
    margin, soft = costs.margin, costs.soft
    stride, dt, yaw_change_cost, pace = costs.stride, costs.step, costs.yaw_change_cost, costs.pace
    free, reach, per_high = immediate(limits), costs.reach, 1.0 / high
    fall = slower if costs.stop else math.inf

    nodes[0, 0, :5] = start
    nodes[0, 0, COST] = 0.0
    nodes[0, 0, TOTAL] = 0.0
    count[0] = 1
    first, _, _ = look_at(distance, hidden, corner, resolution, target, start[X], start[Y])
    fastest = max(high, -low)
    per_cell = 2.0 / (fastest * dt)
    half = layers * 2 + 2
    wide = 2 * half + 1
    most = size * (len(controls) + 3)
    child, origin, command = np.empty((most, 7)), np.empty(most, np.int32), np.empty((most, 2))
    cell, slot, sector = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int64)
    mask = 1
    while mask < 2 * most:
        mask *= 2
    owner = np.full(mask, -1, np.int32)  # the children by the cell that they are in: open addressing
    mask -= 1
    belts = np.empty((len(obstacles.radius) * (len(obstacles.at) + 1), BELT))
    stills, moving_obstacles = np.empty((len(obstacles.still), 3)), np.empty((len(belts), BELT))
    hinted = 0  # the node that follows the hint, while it lasts
    best_goal = math.inf
    for k in range(layers):
        found = 0
        weight = costs.contact_cost * costs.discount ** (k * dt)
        nearness = costs.near * dt / weight  # what stands will not be gone later: that is not to be put off
        next_hinted = -1
        begun, ended = k * dt, (k + 1) * dt
        near_start = (0.3 * ended * fastest) ** 2
        moving = belts_of(obstacles, k * stride, stride, costs.union, belts)
        for b in range(count[k]):
            x0, y0, theta0, v0, w0 = (
                nodes[k, b, X],
                nodes[k, b, Y],
                nodes[k, b, THETA],
                nodes[k, b, V],
                nodes[k, b, OMEGA],
            )
            cost0 = nodes[k, b, COST]
            cos0, sin0 = math.cos(theta0), math.sin(theta0)
            far, ux, uy = look_at(distance, hidden, corner, resolution, target, x0, y0)
            gx, gy = target[0] - x0, target[1] - y0
            off = math.atan2(cos0 * uy - sin0 * ux, cos0 * ux + sin0 * uy)
            inside = _inside(area, x0, y0)
            s, m = near(obstacles.still, belts, moving, x0, y0, outer + fastest * dt, soft, stills, moving_obstacles)
            extra = 2 if b == hinted and k < len(hint) else 1
            for c in range(len(controls) + 1 + extra):
                if c < len(controls):
                    v_goal = controls[c, 0] * (high if controls[c, 0] >= 0.0 else -low)
                    w_goal = controls[c, 1] * yaw
                elif c == len(controls):  # turn into the way at once
                    v_goal, w_goal = high, min(max(off / dt, -yaw), yaw)
                elif c == len(controls) + 1:
                    if low == 0.0:
                        continue
                    v_goal, w_goal = low, min(max(wrap(off + math.pi) / dt, -yaw), yaw)
                else:
                    v_goal, w_goal = hint[k, 0], hint[k, 1]
                if free:
                    v_end, v, w_end, w = v_goal, v_goal, w_goal, w_goal
                else:
                    v_end, v = ramp(v0, v_goal, faster, slower, dt)
                    w_end, w = ramp(w0, w_goal, turn_faster, turn_slower, dt)
                # the arc, by series: half the turn of a step is small
                h = 0.5 * w * dt
                h2 = h * h
                wave = 1.0 - h2 * (1.0 / 6.0 - h2 * (1.0 / 120.0 - h2 / 5040.0))  # sin h / h
                ch, sh = 1.0 - h2 * (0.5 - h2 * (1.0 / 24.0 - h2 / 720.0)), wave * h
                chord = v * dt * wave
                dx, dy = chord * (cos0 * ch - sin0 * sh), chord * (sin0 * ch + cos0 * sh)
                x, y = x0 + dx, y0 + dy
                if inside and not _inside(area, x, y):
                    continue
                c2, s2 = ch * ch - sh * sh, 2.0 * sh * ch
                cost = cost0 + yaw_change_cost * abs(w_end - w0) + (costs.reverse_cost * dt if v < 0.0 else 0.0)
                far1, ux, uy = look_at(distance, hidden, corner, resolution, target, x, y)
                along = ux * (cos0 * c2 - sin0 * s2) + uy * (sin0 * c2 + cos0 * s2)
                left = _to_go(low, high, yaw, faster, fall, far1, along, v_end)
                total = worth(costs, first, ended, far1, left) + cost
                if total >= best_goal and pace == 0.0:
                    continue
                theta = wrap(theta0 + 2.0 * h)
                i = int((x - start[X]) * per_cell + (half + 0.5))
                j = int((y - start[Y]) * per_cell + (half + 0.5))
                if i < 0 or j < 0 or i >= wide or j >= wide:
                    continue
                turned = min(int((theta + math.pi) * (_HEADINGS / (2.0 * math.pi))), _HEADINGS - 1)
                place = ((i * wide + j) * _HEADINGS + turned) * 3 + (0 if v_end < -0.02 else (1 if v_end < 0.02 else 2))
                at = (place * 40503 >> 4) & mask
                rival = owner[at]
                while rival >= 0 and cell[rival] != place:
                    at = (at + 1) & mask
                    rival = owner[at]
                follows = c == len(controls) + 2
                if rival >= 0 and child[rival, TOTAL] <= total and not follows:
                    continue
                risk = collision_risk(
                    stills, s, moving_obstacles, m, vertices, rim, outer, margin, soft, nearness, theta0, dx, dy, 2.0 * h
                )  # fmt: skip
                if risk < 0.0:
                    continue
                cost += weight * risk
                total += weight * risk
                # the goal on the way
                share = min(max((gx * dx + gy * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
                arrives = (gx - share * dx) ** 2 + (gy - share * dy) ** 2 <= reach * reach
                if arrives and fall < math.inf:  # it has to be able to stop there, and does
                    rest = math.sqrt((gx - dx) ** 2 + (gy - dy) ** 2)
                    arrives = rest <= reach and v_end * v_end <= 2.0 * fall * reach
                    if arrives:
                        total = worth(costs, first, ended, 0.0, abs(v_end) / fall + rest * per_high) + cost
                elif arrives:
                    total = worth(costs, first, begun, 0.0, max(far - reach, 0.0) * per_high) + cost
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
                origin[n], command[n, 0], command[n, 1] = b, v_goal, w_goal
                sector[n] = _sector(x - start[X], y - start[Y], near_start)
                if follows:
                    next_hinted = n
                if arrives:
                    best_goal = total
                    goal[0], goal[1], goal[2] = k + 1.0, float(n), total
        for n in range(found):
            owner[slot[n]] = -1
        keep = min(found, size)
        limit = np.full(_SECTORS, math.inf)
        if found > beam:
            limit[:] = _limits(child, sector, found, beam, quota)
        m = 0
        hinted = -1
        for turn in range(2):  # first those that must be kept: the hint's node and an arrival
            for n in range(found):
                arrival = goal[0] == k + 1.0 and float(n) == goal[1]
                if (n == next_hinted or arrival) != (turn == 0) or m >= keep:
                    continue
                if turn == 1 and child[n, TOTAL] > limit[sector[n]]:
                    continue
                for i in range(7):
                    nodes[k + 1, m, i] = child[n, i]
                parent[k + 1, m] = origin[n]
                control[k + 1, m, 0], control[k + 1, m, 1] = command[n, 0], command[n, 1]
                if n == next_hinted:
                    hinted = m
                if arrival:
                    goal[0], goal[1] = -2.0 - k, float(m)
                m += 1
        if goal[0] <= -2.0:
            goal[0] = -1.0 - goal[0]
        count[k + 1] = m
        if m == 0:
            break
    return Tree(nodes, parent, control, count, goal)


@kernel
def _sector(dx: float, dy: float, near2: float) -> int:
    """In which of `_SECTORS` a place lies, seen from the start."""
    if dx * dx + dy * dy < near2:
        return _SECTORS - 1
    steep = abs(dy) > abs(dx)
    ring = 8 if dx * dx + dy * dy > 4.9 * near2 else 0
    return ring + (4 if dx < 0.0 else 0) + (2 if dy < 0.0 else 0) + (1 if steep else 0)


@kernel
def _limits(child: FloatArray, sector: IntArray, found: int, beam: int, quota: int) -> FloatArray:
    """(_SECTORS,) up to which total a child of each sector stays: the best `beam`, and of each sector the best `quota`."""
    totals = np.empty(found)
    for n in range(found):
        totals[n] = child[n, TOTAL]
    whole = np.partition(totals, beam - 1)[beam - 1]
    limits = np.full(_SECTORS, whole)
    if quota > 0:
        best, have = np.empty((_SECTORS, quota)), np.zeros(_SECTORS, np.int64)
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
        for g in range(_SECTORS):
            if have[g] > 0:
                limits[g] = max(whole, best[g, have[g] - 1])
    return limits


@kernel
def _inside(area: FloatArray, x: float, y: float) -> bool:
    return bool(area[0] <= x <= area[2] and area[1] <= y <= area[3])


@kernel
def leaf(tree: Tree) -> tuple[int, int]:
    """Layer and index of the best end: an arrival, or the best node of the last layer."""
    last = len(tree.count) - 1
    while last > 0 and tree.count[last] == 0:
        last -= 1
    best, at = math.inf, -1
    for b in range(tree.count[last]):
        if tree.nodes[last, b, TOTAL] < best:
            best, at = tree.nodes[last, b, TOTAL], b
    if tree.goal[0] >= 0.0 and tree.goal[2] <= best:
        return int(tree.goal[0]), int(tree.goal[1])
    return last, at


@kernel
def trace(tree: Tree, layer: int, index: int) -> tuple[FloatArray, FloatArray]:
    """States (k + 1, 5) and commands (k, 2), layer by layer, of the way that ends in a node."""
    states, inputs = np.empty((layer + 1, 5)), np.empty((layer, 2))
    for k in range(layer, -1, -1):
        states[k] = tree.nodes[k, index, :5]
        if k > 0:
            inputs[k - 1] = tree.control[k, index]
            index = tree.parent[k, index]
    return states, inputs

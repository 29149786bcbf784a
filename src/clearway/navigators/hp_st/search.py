"""Ways through space and time: a beam search over the robot's own motions, layer by layer.

All nodes of a layer lie at the same instant, so obstacles are where their forecasts say for that instant and no belt
covers what is past. A node's children are arcs that the base can drive in one step. A child is worth the time that has
gone, the time that it still takes to the goal past what stands (`field`), and what it risks: the probability of contact
with each forecast obstacle on the way, in seconds that we'd give to avoid it. Of the children of a layer the best of
each cell of (x, y, heading, direction of travel) stays, of these the best `beam`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.footprint import Footprint, gap
from clearway.geometry.motion import ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.field import Field, look_at

IntArray = npt.NDArray[np.int64]

X, Y, THETA, V, OMEGA, COST, TOTAL = range(7)
"""Columns of a node: pose, speeds, what it cost so far beyond time, and that with time and time to go, s."""

_HEADINGS = 16
_FAR = 3.5  # standard deviations beyond which a contact is not counted with
_PER = 32  # entries of the table below per standard deviation
_TAIL = np.array([0.5 * math.erfc((i / _PER - _FAR) * math.sqrt(0.5)) for i in range(int(2 * _FAR * _PER) + 2)])
"""Probability of being less than z standard deviations away, from z = -_FAR on."""


class Base(NamedTuple):
    """What the base can do, and its outline.

    Attributes:
        low, high: m/s. turn: rad/s. rates: (4,) growth and decline of |v| [m/s^2] and |omega| [rad/s^2]; may be inf.
    """

    low: float
    high: float
    turn: float
    rates: FloatArray
    foot: Footprint


class Crowd(NamedTuple):
    """Obstacles as the search sees them.

    Attributes:
        still: (s, 3) x, y, R. at: (K + 1, m, 2) centres of the hypotheses at the instants. spread: (K + 1, m) standard
        deviation of each, m. chance: (m,) of each hypothesis. radius: (m,) m.
    """

    still: FloatArray
    at: FloatArray
    spread: FloatArray
    chance: FloatArray
    radius: FloatArray


class Wishes(NamedTuple):
    """What the search weighs.

    Attributes:
        step: s of a layer. stride: instants of the crowd in it. fear: s that a contact is worth. fade: factor on that per second ahead, as there is time to
        think again. margin: kept from what stands, m. soft: from that on nearness costs, m. near: s per s at the margin.
        swing: s per rad/s of change of the yaw rate. back: s per s of reversing. reach: radius around the goal that
        ends the way, m. union: so many of the first instants count at any time (0: each at its own), the belts of a
        planner that is blind to time. stop: whether it has to stop at the goal.
    """

    step: float
    stride: int
    fear: float
    fade: float
    margin: float
    soft: float
    near: float
    swing: float
    back: float
    reach: float
    union: int
    stop: bool = False


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
    count: IntArray
    goal: FloatArray


@kernel
def time_to_go(base: Base, far: float, cos_off: float, v: float, stop: bool) -> float:
    """How long it takes to a goal `far` [m] away past what stands, s, forwards or backwards, whichever is faster.

    Args:
        cos_off: cosine of the angle between the heading and the way. v: speed now, m/s. stop: whether it has to stop there.
        A turn by a at full speed on an arc loses (a - sin a) / turn; what is lost to speeding up and braking is added.
    """
    fall = base.rates[1] if stop else math.inf
    return _to_go(base.low, base.high, base.turn, base.rates[0], fall, far, cos_off, v)


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
def search(
    start: FloatArray, base: Base, crowd: Crowd, field: Field, area: FloatArray, wishes: Wishes, layers: int, beam: int,
    controls: FloatArray, hint: FloatArray,
) -> Tree:  # fmt: skip
    """Search from `start` (5,) x, y, theta, v, omega.

    Args:
        area: (4,) where the robot's centre may be. controls: (C, 2) v and omega as shares of the limits. hint: (k, 2)
            v [m/s] and omega [rad/s] layer by layer of the last plan: its nodes are among those that are tried.
    """
    nodes, parent = np.empty((layers + 1, beam, 7)), np.zeros((layers + 1, beam), np.int64)
    control, count = np.zeros((layers + 1, beam, 2)), np.zeros(layers + 1, np.int64)
    goal = np.array((-1.0, -1.0, math.inf))
    dt = wishes.step
    nodes[0, 0, :5] = start
    nodes[0, 0, COST] = 0.0
    nodes[0, 0, TOTAL] = 0.0
    count[0] = 1
    cell = 0.5 * max(base.high, -base.low) * dt
    half = layers * 2 + 2
    wide = 2 * half + 1
    owner = np.full(wide * wide * _HEADINGS * 3, -1, np.int32)
    most = beam * (len(controls) + 3)
    child, origin, command = np.empty((most, 7)), np.empty(most, np.int64), np.empty((most, 2))
    place = np.empty(most, np.int64)
    near_still, near_moving = (
        np.empty(len(crowd.still), np.int64),
        np.empty(2 * len(crowd.radius) * (len(crowd.at) + 1), np.int64),
    )
    # taken out of their tuples once: inside the loop that would cost more than the sums
    distance, hidden, origin_, resolution, target = (
        field.distance,
        field.hidden,
        field.origin,
        field.resolution,
        field.goal,
    )
    low, high, yaw, rates = base.low, base.high, base.turn, base.rates
    vertices, rim, outer = base.foot.vertices, base.foot.radius, base.foot.circumscribed
    still, at, spread, chance, radius = crowd.still, crowd.at, crowd.spread, crowd.chance, crowd.radius
    margin, soft, nearness = wishes.margin, wishes.soft, wishes.near * wishes.step / wishes.fear
    stride = wishes.stride
    free, reach2 = rates.min() == math.inf, wishes.reach**2
    fall = rates[1] if wishes.stop else math.inf
    hinted = 0  # the node that follows the hint, while it lasts
    best_goal = math.inf
    for k in range(layers):
        found = 0
        weight = wishes.fear * wishes.fade ** (k * dt)
        next_hinted = -1
        for b in range(count[k]):
            node = nodes[k, b]
            x0, y0, theta0 = node[X], node[Y], node[THETA]
            cos0, sin0 = math.cos(theta0), math.sin(theta0)
            far, ux, uy = look_at(distance, hidden, origin_, resolution, target, x0, y0)
            off = math.atan2(cos0 * uy - sin0 * ux, cos0 * ux + sin0 * uy)
            inside = _inside(area, x0, y0)
            stills, movers = neighbours(crowd, base, wishes, k * stride, x0, y0, near_still, near_moving)
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
                    v_end, v = ramp(node[V], v_goal, rates[0], rates[1], dt)
                    w_end, w = ramp(node[OMEGA], w_goal, rates[2], rates[3], dt)
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
                cost = node[COST] + wishes.swing * abs(w_end - node[OMEGA]) + (wishes.back * dt if v < 0.0 else 0.0)
                far1, ux, uy = look_at(distance, hidden, origin_, resolution, target, x, y)
                along = ux * (cos0 * c2 - sin0 * s2) + uy * (sin0 * c2 + cos0 * s2)
                total = (k + 1) * dt + _to_go(low, high, yaw, rates[0], fall, far1, along, v_end) + cost
                if total >= best_goal:
                    continue
                theta = wrap(theta0 + 2.0 * h)
                i = int(math.floor((x - start[0]) / cell + 0.5)) + half
                j = int(math.floor((y - start[1]) / cell + 0.5)) + half
                if i < 0 or j < 0 or i >= wide or j >= wide:
                    continue
                t = int((theta + math.pi) / (2.0 * math.pi) * _HEADINGS) % _HEADINGS
                s = 0 if v_end < -0.02 else (1 if v_end < 0.02 else 2)
                slot = ((i * wide + j) * _HEADINGS + t) * 3 + s
                rival = owner[slot]
                follows = c == len(controls) + 2
                if rival >= 0 and child[rival, TOTAL] <= total and not follows:
                    continue
                risk = meet(
                    still, at, spread, chance, radius, vertices, rim, outer, margin, soft, nearness, stride, near_still,
                    stills, near_moving, movers, x0, y0, theta0, dx, dy, 2.0 * h,
                )  # fmt: skip
                if risk < 0.0:
                    continue
                cost += weight * risk
                total += weight * risk
                # the goal on the way
                gx, gy = target[0] - x0, target[1] - y0
                share = min(max((gx * dx + gy * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
                arrives = (gx - share * dx) ** 2 + (gy - share * dy) ** 2 <= reach2
                if arrives and fall < math.inf:  # it has to be able to stop there, and does
                    left = math.sqrt((target[0] - x) ** 2 + (target[1] - y) ** 2)
                    arrives = left <= wishes.reach and v_end * v_end <= 2.0 * fall * wishes.reach
                    if arrives:
                        total = (k + 1) * dt + cost + abs(v_end) / fall + left / high
                elif arrives:
                    total = k * dt + cost + max(far - wishes.reach, 0.0) / high
                if total >= best_goal:
                    continue
                if rival >= 0 and not follows:
                    if child[rival, TOTAL] <= total:
                        continue
                    n = rival
                else:
                    n = found
                    if rival < 0:
                        owner[slot] = n
                    place[n] = slot
                    found += 1
                child[n, X], child[n, Y], child[n, THETA], child[n, V], child[n, OMEGA] = x, y, theta, v_end, w_end
                child[n, COST], child[n, TOTAL] = cost, total
                origin[n], command[n, 0], command[n, 1] = b, v_goal, w_goal
                if follows:
                    next_hinted = n
                if arrives:
                    best_goal = total
                    goal[0], goal[1], goal[2] = k + 1.0, float(n), total
        for n in range(found):
            owner[place[n]] = -1
        keep = min(found, beam)
        limit = math.inf
        if found > beam:
            limit = np.partition(child[:found, TOTAL].copy(), beam - 1)[beam - 1]
        m = 0
        hinted = -1
        for turn in range(2):  # first those that must be kept: the hint's node and an arrival
            for n in range(found):
                arrival = goal[0] == k + 1.0 and float(n) == goal[1]
                if (n == next_hinted or arrival) != (turn == 0) or m >= keep or (turn == 1 and child[n, TOTAL] > limit):
                    continue
                nodes[k + 1, m] = child[n]
                parent[k + 1, m] = origin[n]
                control[k + 1, m] = command[n]
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
def _inside(area: FloatArray, x: float, y: float) -> bool:
    return area[0] <= x <= area[2] and area[1] <= y <= area[3]


@kernel
def neighbours(
    crowd: Crowd, base: Base, wishes: Wishes, k: int, x: float, y: float, still: IntArray, moving: IntArray
) -> tuple[int, int]:
    """What a robot at (x, y) can meet in the step from instant k on, into `still` (indices) and `moving` (pairs of
    instant and index): how many of each."""
    own = base.foot.circumscribed + max(base.high, -base.low) * wishes.step
    n = 0
    for i in range(len(crowd.still)):
        reach = crowd.still[i, 2] + own + wishes.soft
        if (crowd.still[i, 0] - x) ** 2 + (crowd.still[i, 1] - y) ** 2 < reach * reach:
            still[n] = i
            n += 1
    first, last = k, k
    if wishes.union > 0:
        first, last = 0, min(wishes.union, len(crowd.at) - 1) - wishes.stride
    m = 0
    for at in range(first, last + 1, wishes.stride):
        end = at + wishes.stride
        for i in range(len(crowd.radius)):
            ax, ay, bx, by = crowd.at[at, i, 0], crowd.at[at, i, 1], crowd.at[end, i, 0], crowd.at[end, i, 1]
            reach = crowd.radius[i] + own + _FAR * crowd.spread[end, i] + 0.5 * math.hypot(bx - ax, by - ay)
            if (0.5 * (ax + bx) - x) ** 2 + (0.5 * (ay + by) - y) ** 2 < reach * reach:
                moving[2 * m], moving[2 * m + 1] = at, i
                m += 1
    return n, m


@kernel
def meet(
    still: FloatArray, at: FloatArray, spread: FloatArray, chance: FloatArray, radius: FloatArray, vertices: FloatArray,
    rim: float, outer: float, margin: float, soft: float, nearness: float, stride: int, near_still: IntArray,
    stills: int, near_moving: IntArray, movers: int, x0: float, y0: float, theta: float, dx: float, dy: float, turn: float,
) -> float:  # fmt: skip
    """Risk of one step of a robot: probability of contact with what moves, and what nearness to what stands costs; -1:
    it runs into what stands."""
    long2 = max(dx * dx + dy * dy, 1e-12)
    risk = 0.0
    for n in range(stills):
        i = near_still[n]
        cx, cy, body = still[i, 0] - x0, still[i, 1] - y0, still[i, 2]
        reach = body + outer + soft
        share = min(max((cx * dx + cy * dy) / long2, 0.0), 1.0)
        ex, ey = cx - share * dx, cy - share * dy
        d2 = ex * ex + ey * ey
        if d2 >= reach * reach:
            continue
        room = _room(vertices, rim, theta + share * turn, ex, ey, d2) - body
        if room < margin or len(vertices) > 1:  # a body that turns may come nearest with a corner, at the end
            then = _room(vertices, rim, theta + turn, cx - dx, cy - dy, (cx - dx) ** 2 + (cy - dy) ** 2) - body
            room = min(room, then)
            if room < margin:
                now = _room(vertices, rim, theta, cx, cy, cx * cx + cy * cy) - body
                if then <= now or now >= margin:  # out of the margin it may go
                    return -1.0
        if room < soft:
            risk += nearness * (1.0 - max(room, 0.0) / soft) ** 2
    for n in range(movers):
        k, i = near_moving[2 * n], near_moving[2 * n + 1]
        ax, ay = at[k, i, 0] - x0, at[k, i, 1] - y0
        ux, uy = at[k, i, 0] - at[k + stride, i, 0] + dx, at[k, i, 1] - at[k + stride, i, 1] + dy
        sigma = spread[k + stride, i]
        reach = radius[i] + outer + _FAR * sigma
        share = min(max((ax * ux + ay * uy) / max(ux * ux + uy * uy, 1e-12), 0.0), 1.0)
        ex, ey = ax - share * ux, ay - share * uy
        d2 = ex * ex + ey * ey
        if d2 >= reach * reach:
            continue
        room = _room(vertices, rim, theta + share * turn, ex, ey, d2) - radius[i]
        risk += chance[i] * _TAIL[int(max(room / sigma + _FAR, 0.0) * _PER)]
    return risk


@kernel
def _room(vertices: FloatArray, rim: float, theta: float, ex: float, ey: float, d2: float) -> float:
    """From the footprint at a heading to a point that lies at (ex, ey) from it; d2: that distance squared."""
    if len(vertices) == 1:
        return math.sqrt(d2) - rim
    return gap(vertices, rim, 0.0, 0.0, theta, ex, ey)


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

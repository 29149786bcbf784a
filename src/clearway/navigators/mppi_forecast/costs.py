"""What a sample costs, in seconds: until it arrives, for contact that has to be expected, for nearness, for effort.

Numbers in brackets are those of DECISIONS.md beside this file.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.footprint import Footprint, gap
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.mppi.functions import Floats
from clearway.navigators.common.mppi.samples import Samples

_FAR = 3.5  # standard deviations beyond which a contact is not counted with
_NO_WAY = 1e3  # m


class People(NamedTuple):
    """Who moves: discs, by hypotheses.

    Attributes:
        at: (T + 1, m, 2) centre of each hypothesis at the steps, m.
        spread: (T + 1, m) standard deviation of it along either axis, m.
        chance: (m,) probability of each hypothesis.
        radius: (m,) of the obstacle, m.
        obstacle: (m,) whose it is; those of one obstacle stand together.
    """

    at: FloatArray
    spread: FloatArray
    chance: FloatArray
    radius: FloatArray
    obstacle: npt.NDArray[np.int64]


class Floor(NamedTuple):
    """What stands, and the way past it, on one grid.

    Attributes:
        clearance: (rows, columns) from a cell's centre to what stands, m.
        distance: (rows, columns) way to the goal, m; inf: there is none.
        origin: (2,) corner of cell (0, 0), m.
        resolution: Edge of a cell, m.
        goal: (2,) m.
        area: (4,) x_min, y_min, x_max, y_max that the robot's place keeps to, m.
    """

    clearance: FloatArray
    distance: FloatArray
    origin: FloatArray
    resolution: float
    goal: FloatArray
    area: FloatArray


class Body(NamedTuple):
    """The robot.

    Attributes:
        foot: Its outline.
        rim: (k, 2) points of that, close together, m; of a disc its centre alone.
        deceleration: m/s^2; inf: it stops at once.
        lateral_deceleration: m/s^2; inf likewise.
        top: Its top speed, m/s.
    """

    foot: Footprint
    rim: FloatArray
    deceleration: float
    lateral_deceleration: float
    top: float


class Weights(NamedTuple):
    """What counts how much; see `parameters`.

    Attributes:
        dt: Of a step, s.
        contact: s/s.
        discount: Factor for each second ahead.
        margin: m.
        soft: m.
        near: s/s.
        effort: s/s.
        reverse: s/s.
        reach: Within which of the goal it is to come to rest, m.
        deviation: (3,) of the noise of v [m/s], v_y [m/s] and omega [rad/s].
    """

    dt: float
    contact: float
    discount: float
    margin: float
    soft: float
    near: float
    effort: float
    reverse: float
    reach: float
    deviation: FloatArray


def people_of(forecast: Forecast, own: float, most: float, count: int) -> People:
    """What `forecast` says of its first `count` instants.

    Args:
        own: Standard deviation of the robot's own place, m.
        most: No place counts as less certain, m.
    """
    who, which = np.nonzero(forecast.weight > 0.0)
    spread = np.minimum(np.hypot(forecast.sigma[who, which, :count], own), most)
    return People(
        np.ascontiguousarray(forecast.path[who, which, :count].transpose(1, 0, 2)), np.ascontiguousarray(spread.T),
        forecast.weight[who, which], forecast.radius[who], who,
    )  # fmt: skip


@kernel
def judge(
    samples: Samples, start: FloatArray, people: People, floor: Floor, body: Body, weights: Weights, costs: Floats
) -> None:
    """Fill `costs` (B,) [s] of `samples` that begin at the pose `start` (3,).

    A sample costs (7)
        T_arrive + sum over steps of dt (C gamma^t P_t + near + effort + reverse),
    where T_arrive is when it can come to rest at the goal, or the horizon and the time that the way still takes at top speed from its
    last place; and P_t the probability of contact at that step (8).
    """
    dt, contact, discount, margin, soft, near, effort, reverse, reach, deviation = weights
    steps, batch = samples.x.shape
    total, free = np.zeros(batch), np.empty(batch)
    arrived = np.zeros(batch, np.bool_)
    x0, y0 = np.full(batch, np.float32(start[0])), np.full(batch, np.float32(start[1]))
    area, goal = floor.area, floor.goal
    for t in range(steps):
        x, y, yaw = samples.x[t], samples.y[t], samples.yaw[t]
        v, v_y, omega = samples.vx[t + 1], samples.vy[t + 1], samples.wz[t + 1]
        before, before_y, turned = samples.vx[t], samples.vy[t], samples.wz[t]
        _meet(x0, y0, x, y, yaw, people, t, body.foot, free)
        fade = contact * discount ** ((t + 1) * dt)
        for b in range(batch):
            room = _room_left(floor, body, soft, x[b], y[b], yaw[b])
            out = x[b] < area[0] or y[b] < area[1] or x[b] > area[2] or y[b] > area[3]
            if room < margin or out:
                free[b] = 0.0
            cost = fade * (1.0 - free[b])
            if room < soft:
                cost += near * (1.0 - max(room, 0.0) / soft) ** 2
            if v[b] < 0.0:
                cost += reverse
            changed = ((v[b] - before[b]) / deviation[0]) ** 2 + ((omega[b] - turned[b]) / deviation[2]) ** 2
            cost += effort * (changed + ((v_y[b] - before_y[b]) / deviation[1]) ** 2)
            if not arrived[b]:
                cost += 1.0
                arrived[b] = _resting(x[b], y[b], yaw[b], v[b], v_y[b], body, goal) <= reach
            total[b] += dt * cost
        x0, y0 = x, y
    for b in range(batch):
        if not arrived[b]:
            total[b] += max(way_left(floor, x0[b], y0[b]) - reach, 0.0) / body.top
        costs[b] = np.float32(total[b])


@kernel
def _meet(
    x0: Floats, y0: Floats, x: Floats, y: Floats, yaw: Floats, people: People, t: int, foot: Footprint, free: FloatArray
) -> None:  # fmt: skip
    """Fill `free` (B,) with the probability that nobody is met in step `t` (8).

    Of one hypothesis it is that of a centre beyond the line that touches the robot's outline at the nearest instant of the step, at
    most the true one's complement; hypotheses of an obstacle exclude each other, obstacles are independent.
    """
    at, spread, chance, radius, obstacle = people
    batch = len(x)
    free[:] = 1.0
    left, right, low, high = x[0], x[0], y[0], y[0]
    for b in range(batch):
        left, right = min(left, min(x0[b], x[b])), max(right, max(x0[b], x[b]))
        low, high = min(low, min(y0[b], y[b])), max(high, max(y0[b], y[b]))
    hit, last = np.zeros(batch), -1
    vertices, rim, outer = foot.vertices, foot.radius, foot.circumscribed
    for m in range(len(chance)):
        ox, oy, mx, my = at[t, m, 0], at[t, m, 1], at[t + 1, m, 0] - at[t, m, 0], at[t + 1, m, 1] - at[t, m, 1]
        sigma, size = spread[t + 1, m], radius[m]
        reach = size + outer + _FAR * sigma
        if (
            max(ox, ox + mx) + reach < left or min(ox, ox + mx) - reach > right
            or max(oy, oy + my) + reach < low or min(oy, oy + my) - reach > high
        ):  # fmt: skip
            continue
        if obstacle[m] != last and last >= 0:
            _take(free, hit)
        last = obstacle[m]
        scale = math.sqrt(0.5) / sigma
        for b in range(batch):
            ax, ay = ox - x0[b], oy - y0[b]
            ux, uy = mx - (x[b] - x0[b]), my - (y[b] - y0[b])
            share = min(max(-(ax * ux + ay * uy) / max(ux * ux + uy * uy, 1e-12), 0.0), 1.0)
            ex, ey = ax + share * ux, ay + share * uy
            d2 = ex * ex + ey * ey
            if d2 >= reach * reach:
                continue
            room = math.sqrt(d2) - rim if len(vertices) == 1 else gap(vertices, rim, 0.0, 0.0, yaw[b], ex, ey)
            room -= size
            if room < _FAR * sigma:
                hit[b] += chance[m] * 0.5 * math.erfc(room * scale)
    if last >= 0:
        _take(free, hit)


@kernel
def _take(free: FloatArray, hit: FloatArray) -> None:
    """One obstacle's hypotheses are together: `hit` becomes 0 again."""
    for b in range(len(free)):
        free[b] *= max(1.0 - hit[b], 0.0)
        hit[b] = 0.0


@kernel
def _room_left(floor: Floor, body: Body, soft: float, x: float, y: float, yaw: float) -> float:
    """From the outline at a pose to what stands, m; exact only below `soft` [m]."""
    clearance, origin, h = floor.clearance, floor.origin, floor.resolution
    rim, foot = body.rim, body.foot
    room = _between(clearance, origin, h, x, y) - foot.circumscribed
    if len(rim) == 1 or room >= soft:
        return room
    c, s, room = math.cos(yaw), math.sin(yaw), math.inf
    for k in range(len(rim)):
        px, py = x + c * rim[k, 0] - s * rim[k, 1], y + s * rim[k, 0] + c * rim[k, 1]
        room = min(room, _between(clearance, origin, h, px, py))
    return room - foot.radius


@kernel
def _resting(x: float, y: float, yaw: float, v: float, v_y: float, body: Body, goal: FloatArray) -> float:
    """How far from the goal one comes to rest that brakes at this pose, m."""
    way, aside = 0.5 * v * abs(v) / body.deceleration, 0.5 * v_y * abs(v_y) / body.lateral_deceleration
    c, s = math.cos(yaw), math.sin(yaw)
    return math.hypot(x + way * c - aside * s - goal[0], y + way * s + aside * c - goal[1])


@kernel
def way_left(floor: Floor, x: float, y: float) -> float:
    """The way to the goal from (x, y), m."""
    return _between(floor.distance, floor.origin, floor.resolution, x, y)


@kernel
def _between(values: FloatArray, origin: FloatArray, h: float, x: float, y: float) -> float:
    """Between the centres of cells, those left out that have no finite value."""
    rows, columns = values.shape
    a = max(min((x - origin[0]) / h - 0.5, columns - 1.001), 0.0)
    b = max(min((y - origin[1]) / h - 0.5, rows - 1.001), 0.0)
    j, i = int(a), int(b)
    s, t = a - j, b - i
    i1, j1 = min(i + 1, rows - 1), min(j + 1, columns - 1)  # a map may be one cell wide
    v00, v01, v10, v11 = values[i, j], values[i, j1], values[i1, j], values[i1, j1]
    found = (1.0 - t) * ((1.0 - s) * v00 + s * v01) + t * ((1.0 - s) * v10 + s * v11)
    if found < math.inf:
        return float(found)
    total, weight = 0.0, 0.0
    for k in range(4):
        value = values[i1 if k // 2 else i, j1 if k % 2 else j]
        share = (t if k // 2 else 1.0 - t) * (s if k % 2 else 1.0 - s)
        if value < math.inf:
            total, weight = total + share * value, weight + share
    return float(total / weight) if weight > 1e-9 else _NO_WAY

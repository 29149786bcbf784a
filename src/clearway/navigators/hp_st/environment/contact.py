"""What a step of the robot risks: contact with what stands, which is excluded, and with what moves, by probability."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import inlined, kernel, light
from clearway.geometry.footprint import Footprint, gap
from clearway.geometry.shapes import FloatArray
from clearway.robots.drive_limits import DriveLimits

BEYOND = 3.5
"""Standard deviations beyond which a contact is not counted with."""
STEPS = 32
"""Room for so many steps from one place."""
_PER = 32  # entries of the table below per standard deviation
_TAIL = np.array([0.5 * math.erfc((i / _PER - BEYOND) * math.sqrt(0.5)) for i in range(int(2 * BEYOND * _PER) + 2)])
"""Probability of being less than z standard deviations away, from z = -BEYOND on."""

BELT = 10
AT_X, AT_Y, BY_X, BY_Y, RADIUS, SIGMA, CHANCE, WIDEST, AROUND, WHICH = range(BELT)
"""Columns of `belts_of`."""


class Base(NamedTuple):
    """The robot's base.

    Attributes:
        limits: What it can do at the set speed; `v_min` is 0 for one that may not reverse.
        foot: Its outline in base_link.
    """

    limits: DriveLimits
    foot: Footprint


def slowed(base: Base, top: float) -> Base:
    """The same base, driven at `top` [m/s] at most."""
    limits = base.limits
    return base._replace(limits=limits._replace(v_max=min(limits.v_max, top), v_min=max(limits.v_min, -top)))


class PredictedObstacles(NamedTuple):
    """Obstacles as the search sees them: a disc for each hypothesis of each, at each instant of the forecast.

    Attributes:
        still: (s, 3) x, y and radius of what stands, in metres.
        at: (K + 1, m, 2) centres of the hypotheses at the instants, in metres.
        spread: (K + 1, m) standard deviation of each centre along either axis, in metres.
        chance: (m,) probability of each hypothesis.
        radius: (m,) radius of the obstacle of each hypothesis, in metres.
        reach: (K + 1, m) how far from where it is expected a certificate lets it be after so many instants, in metres.
    """

    still: FloatArray
    at: FloatArray
    spread: FloatArray
    chance: FloatArray
    radius: FloatArray
    reach: FloatArray


@kernel
def predicted_obstacles(forecast: Forecast, spread: FloatArray) -> PredictedObstacles:
    """The forecast as the search sees it.

    Args:
        forecast: What is expected of the obstacles.
        spread: (3,) standard deviation of the robot's own place [m], its growth [m/s], and the most that counts [m].
    """
    n, most, instants = forecast.path.shape[0], forecast.path.shape[1], forecast.path.shape[2]
    m = 0
    for i in range(n):
        for h in range(most):
            if forecast.weight[i, h] > 0.0:
                m += 1
    at, sigma, chance, radius = np.empty((instants, m, 2)), np.empty((instants, m)), np.empty(m), np.empty(m)
    reach = np.empty((instants, m))
    path, doubt, weight, size = forecast.path, forecast.sigma, forecast.weight, forecast.radius
    j = 0
    for i in range(n):
        for h in range(most):
            if not weight[i, h] > 0.0:
                continue
            chance[j], radius[j] = weight[i, h], size[i]
            for k in range(instants):
                at[k, j, 0], at[k, j, 1] = path[i, h, k, 0], path[i, h, k, 1]
                own = spread[0] + spread[1] * k * forecast.step
                sigma[k, j] = min(math.sqrt(doubt[i, h, k] ** 2 + own * own), spread[2])
                reach[k, j] = forecast.reach[i, k]
            j += 1
    return PredictedObstacles(forecast.still, at, sigma, chance, radius, reach)


@light
def belts_of(
    obstacles: PredictedObstacles, k: int, stride: int, union: int, ahead: int, belts: FloatArray
) -> int:  # fmt: skip
    """What moves from instant k to k + `stride`, into `belts` (M, BELT).

    Columns: where each begins, by how much it moves (x, y) [m], radius, standard deviation [m], probability, and the
    radius around it, then around its middle, that hold all that counts, m; and which hypothesis it is. After the last instant nothing
    moves on.

    Args:
        obstacles: As the search sees them.
        k: The first instant.
        stride: How many instants later it ends.
        union: So many of the first instants count at any time, the belts of a planner that is blind to time; 0: each
            counts at its own.
        ahead: Of so many instants beyond the last one its reach counts, too; 0: it does not.
        belts: (M, BELT), filled; there must be room for one a hypothesis, with `union` for one at each instant.

    Returns:
        How many there are.
    """
    at, spread, radius, chance = obstacles.at, obstacles.spread, obstacles.radius, obstacles.chance
    top = len(at) - 1
    first, last = k, k
    if union > 0:
        first, last = 0, max(min(union, top) - stride, 0)
    m = 0
    for a in range(first, last + 1, stride):
        begin, end = min(a, top), min(a + stride, top)
        for i in range(len(radius)):
            dx, dy = at[end, i, 0] - at[begin, i, 0], at[end, i, 1] - at[begin, i, 1]
            sigma = spread[end, i]
            belts[m, AT_X], belts[m, AT_Y], belts[m, BY_X], belts[m, BY_Y] = at[begin, i, 0], at[begin, i, 1], dx, dy
            belts[m, RADIUS], belts[m, SIGMA], belts[m, CHANCE] = radius[i], sigma, chance[i]
            belts[m, WIDEST] = radius[i] + BEYOND * sigma
            belts[m, AROUND] = belts[m, WIDEST] + (0.5 + ahead / stride) * math.sqrt(dx * dx + dy * dy)
            if ahead > 0:
                belts[m, AROUND] += obstacles.reach[min(ahead, top), i]
            belts[m, WHICH] = i
            m += 1
    return m


class Nearby(NamedTuple):
    """Room for what the robot may meet in a step.

    Attributes:
        standing: (4, s) x, y and radius of what stands anywhere, in metres; and to work with.
        belts: (M, BELT) what moves in this step, anywhere; see `belts_of`.
        stills: (3, s) x and y, from where the robot begins, and radius of what stands within reach, in metres.
        moving: (M, BELT) what moves within reach, as `belts` has it; x and y from where the robot begins.
        steps: (4, STEPS) to work with, of each step.
    """

    standing: FloatArray
    belts: FloatArray
    stills: FloatArray
    moving: FloatArray
    steps: FloatArray


@kernel
def room_around(obstacles: PredictedObstacles) -> Nearby:
    """Room for all of `obstacles`."""
    s, most = len(obstacles.still), len(obstacles.radius) * (len(obstacles.at) + 1)
    standing = np.empty((4, s))
    standing[:3] = obstacles.still.T
    return Nearby(
        standing, np.empty((most, BELT)), np.empty((3, s + 1)), np.empty((most, BELT)), np.empty((4, STEPS))
    )  # fmt: skip


@light
def near(count: int, x: float, y: float, own: float, soft: float, nearby: Nearby) -> tuple[int, int]:
    """What a robot at (x, y) can meet in a step, into `nearby.stills` and `nearby.moving`.

    Args:
        count: So many rows of `nearby.belts` are filled.
        x: Where the robot is, in metres.
        y: Where the robot is, in metres.
        own: Its circumscribed radius and the longest way in a step together, in metres.
        soft: What stands counts within that distance, in metres.
        nearby: What stands, and the belts; its `stills` and `moving` are filled.

    Returns:
        How many of each.
    """
    standing, belts, stills, moving, _ = nearby
    n, m = 0, 0
    all_x, all_y, radius, beyond = standing[0], standing[1], standing[2], standing[3]
    for i in range(len(beyond)):
        dx, dy, reach = all_x[i] - x, all_y[i] - y, radius[i] + own + soft
        beyond[i] = dx * dx + dy * dy - reach * reach
    for i in range(len(beyond)):
        stills[0, n] = i
        n += beyond[i] < 0.0  # no branch: nobody can foretell it
    for j in range(n):
        i = int(stills[0, j])
        stills[0, j], stills[1, j], stills[2, j] = all_x[i] - x, all_y[i] - y, radius[i]
    for i in range(count):
        dx, dy = belts[i, AT_X] - x, belts[i, AT_Y] - y
        mx, my = dx + 0.5 * belts[i, BY_X], dy + 0.5 * belts[i, BY_Y]
        reach = belts[i, AROUND] + own
        if mx * mx + my * my < reach * reach:
            moving[m, AT_X], moving[m, AT_Y] = dx, dy
            for j in range(BY_X, BELT):
                moving[m, j] = belts[i, j]
            m += 1
    return n, m


@light
def collision_risks(
    nearby: Nearby, n: int, m: int, foot: Footprint, margin: float, soft: float, nearness: float, theta: float,
    dx: FloatArray, dy: FloatArray, turn: FloatArray, risk: FloatArray,
) -> None:  # fmt: skip
    """Write the risk of each of some steps: probability of contact with what moves, and what nearness to what stands costs; -inf: it
    hits that.

    Of a round robot all steps are looked at together, without branches, so that the loops run on vector registers.

    Args:
        nearby: What it can meet, as `near` fills it; its `steps` are written.
        n: So many stand.
        m: So many move.
        foot: The robot's outline.
        margin: Distance that is kept from what stands, in metres.
        soft: Distance below which nearness to what stands costs, in metres.
        nearness: What it costs at no distance.
        theta: Heading at the steps' start, in radians.
        dx: (k,) how far each step leads along x, in metres.
        dy: (k,) how far it leads along y, in metres.
        turn: (k,) by how much it turns, in radians.
        risk: (k,) written.
    """
    rim, outer, disc = foot.radius, foot.circumscribed, len(foot.vertices) == 1
    _, _, stills, moving, steps = nearby
    k = len(risk)
    per, tight, hit, deep = steps[0, :k], steps[1, :k], steps[2, :k], steps[3, :k]
    for c in range(k):
        per[c], tight[c], risk[c] = 1.0 / max(dx[c] * dx[c] + dy[c] * dy[c], 1e-12), 0.0, 0.0
    for i in range(n):
        cx, cy, body = stills[0, i], stills[1, i], stills[2, i]
        for c in range(k):
            share = min(max((cx * dx[c] + cy * dy[c]) * per[c], 0.0), 1.0)
            ex, ey = cx - share * dx[c], cy - share * dy[c]
            room = math.sqrt(ex * ex + ey * ey) - outer - body
            tight[c] += room < margin
            lack = max(1.0 - max(room, 0.0) / soft, 0.0)
            risk[c] += nearness * lack**2
    for c in range(k):
        if n > 0 and (tight[c] > 0.0 or not disc):
            risk[c] = _still_risk(nearby, n, foot, margin, soft, nearness, theta, dx[c], dy[c], turn[c])
    if not disc:
        for c in range(k):
            if risk[c] >= 0.0:
                risk[c] = _moving_risk(moving, m, foot, theta, dx[c], dy[c], turn[c], risk[c])
        return
    for j in range(m):
        ax, ay, bx, by, body = moving[j, AT_X], moving[j, AT_Y], moving[j, BY_X], moving[j, BY_Y], moving[j, RADIUS]
        sigma, chance, reach = moving[j, SIGMA], moving[j, CHANCE], moving[j, WIDEST] + outer
        for c in range(k):
            _, _, _, d2 = _nearest(ax, ay, dx[c] - bx, dy[c] - by)
            room = math.sqrt(d2) - rim - body
            hits = d2 < reach * reach and room < BEYOND * sigma
            hit[c] = chance if hits else 0.0
            deep[c] = _place_in_tail(room / sigma) if hits else 0.0
        for c in range(k):
            risk[c] += hit[c] * _TAIL[int(deep[c])]


@light
def _still_risk(
    nearby: Nearby, n: int, foot: Footprint, margin: float, soft: float, nearness: float, theta: float,
    dx: float, dy: float, turn: float,
) -> float:  # fmt: skip
    """What nearness of one step to the `n` that stand costs, by the robot's outline; -inf: it hits one."""
    vertices, rim, outer, stills = foot.vertices, foot.radius, foot.circumscribed, nearby.stills
    per, risk = 1.0 / max(dx * dx + dy * dy, 1e-12), 0.0
    for i in range(n):
        cx, cy, body = stills[0, i], stills[1, i], stills[2, i]
        share = min(max((cx * dx + cy * dy) * per, 0.0), 1.0)
        ex, ey = cx - share * dx, cy - share * dy
        d2 = ex * ex + ey * ey
        if max(math.sqrt(d2) - outer - body, 0.0) / soft >= 1.0:
            continue
        room = room_to(vertices, rim, theta + share * turn, ex, ey, d2) - body
        if room < margin or len(vertices) > 1:  # a body that turns may come nearest with a corner, at the end
            then = room_to(vertices, rim, theta + turn, cx - dx, cy - dy, (cx - dx) ** 2 + (cy - dy) ** 2) - body
            room = min(room, then)
            if room < margin:
                now = room_to(vertices, rim, theta, cx, cy, cx * cx + cy * cy) - body
                if then <= now or now >= margin:  # out of the margin it may go
                    return -math.inf
        if room < soft:
            risk += nearness * (1.0 - max(room, 0.0) / soft) ** 2
    return risk


@light
def _moving_risk(
    moving: FloatArray, m: int, foot: Footprint, theta: float, dx: float, dy: float, turn: float, risk: float
) -> float:
    """`risk`, and the probability that a robot that is no disc touches one of the `m` that move in a step."""
    for j in range(m):
        share, ex, ey, d2 = _nearest(moving[j, AT_X], moving[j, AT_Y], dx - moving[j, BY_X], dy - moving[j, BY_Y])
        reach, sigma = moving[j, WIDEST] + foot.circumscribed, moving[j, SIGMA]
        if d2 < reach * reach:
            room = gap(foot.vertices, foot.radius, 0.0, 0.0, theta + share * turn, ex, ey) - moving[j, RADIUS]
            if room < BEYOND * sigma:  # beside a polygon there is more room than around its circumscribed circle
                risk += moving[j, CHANCE] * tail(room / sigma)
    return risk


@inlined
def _nearest(ax: float, ay: float, ux: float, uy: float) -> tuple[float, float, float, float]:
    """When in a step something that begins at (ax, ay), and past which the robot moves by (ux, uy) [m], comes nearest, as a share of it; where
    it is then, seen from the robot [m], and how far away, squared."""
    share = min(max((ax * ux + ay * uy) / max(ux * ux + uy * uy, 1e-300), 0.0), 1.0)
    ex, ey = ax - share * ux, ay - share * uy
    return share, ex, ey, ex * ex + ey * ey


@light
def tail(z: float) -> float:
    """Probability of being less than `z` standard deviations away; `z` is below `BEYOND`."""
    return float(_TAIL[int(_place_in_tail(z))])


@inlined
def _place_in_tail(z: float) -> float:
    return max(z + BEYOND, 0.0) * _PER


@light
def room_to(vertices: FloatArray, rim: float, theta: float, ex: float, ey: float, d2: float) -> float:
    """Distance [m] of the footprint, heading `theta`, to a point at (ex, ey) from its origin, sqrt(`d2`) away."""
    if len(vertices) == 1:
        return math.sqrt(d2) - rim
    return gap(vertices, rim, 0.0, 0.0, theta, ex, ey)

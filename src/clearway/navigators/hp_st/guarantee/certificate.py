"""The certificate of a plan: until it is at rest, the robot touches nothing, whatever the assumptions allow to happen.

Everything is decided by conservative advancement (Mirtich 1996): a gap of g metres that closes by no more than r metres
a second stays open for g / r seconds. So a certificate holds at all times, not at samples; it errs on the safe side only,
by `TOUCH`. Passive safety (Bouraine, Fraichard, Salhi, Autonomous Robots 32:267, 2012): moving obstacles count while the
robot moves; what isn't perceived may come from beyond the rim of sight. docs/guarantee.md says what follows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel, light
from clearway.geometry.footprint import Footprint, gap
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.sight import Sight, sees
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube, drive, room, stands, tube
from clearway.robots.drive_limits import DriveLimits

TOUCH = 1e-4
"""A gap below this counts as contact, m: advancement comes close to zero, but never there."""

SOON = 15
"""Most plans conflict within so many periods; to bound all of a long one takes the square of its length."""

CLEAR, AREA, UNSEEN = -1, -2, -3
"""What a plan conflicts with, beside i (a standing obstacle) and s + i (one that moves): nothing, the area, the unseen."""


class Rules(NamedTuple):
    """What else a certificate assumes and demands.

    Attributes:
        acceleration: Bound on that of moving obstacles, for what they do between the forecast's instants, in m/s^2;
            inf: there is none, and the bound of their speed alone counts.
        area: (4,) x_min, y_min, x_max, y_max of where the robot's centre may be, in metres; +-inf: anywhere. A robot
            that is outside already may come no farther out.
        sight: The sector about the present pose in which everything has been perceived.
        unseen: Speed at which something unperceived may come from beyond the sector's rim, in m/s.
        looked: How long before the plan begins that look was, in seconds.
        eye: (3,) the pose from which that look was, in the plan's frame; NaN: where the plan begins.
        turning: Whether a round base that only turns on the spot counts as one that stands: its outline stays where it is.
    """

    acceleration: float
    area: FloatArray
    sight: Sight
    unseen: float
    looked: float = 0.0
    eye: FloatArray = np.full(3, math.nan)
    turning: bool = False


class Safety(NamedTuple):
    """What a certificate assumes of the robot.

    Attributes:
        limits: Limits of the base.
        period: Control period in seconds.
        disturbance: (5,) bounds, see `tube.tube`.
        start: (3,) bounds on the error of the perceived pose, see `tube.tube`.
    """

    limits: DriveLimits
    period: float
    disturbance: FloatArray
    start: FloatArray


class Verdict(NamedTuple):
    """Whether a plan is certified.

    Attributes:
        ok: Whether it is.
        which: With what it conflicts first: CLEAR, AREA, UNSEEN or the index of an obstacle, those that stand first.
        time: When, in seconds from the plan's start; inf: never.
    """

    ok: bool
    which: int
    time: float


@light
def certify(plan: Plan, tube: Tube, period: float, body: Footprint, forecast: Forecast, rules: Rules) -> Verdict:
    """Whether the tube around the footprint along `plan` stays clear of everything until the plan's end.

    Args:
        plan: It starts at the instant of the forecast and should end at rest.
        tube: The tube about it.
        period: Control period in seconds.
        body: The footprint.
        forecast: Of it the sets count (`still`, `centre`, `reach`, `speed`), not the probabilities.
        rules: What else is assumed and demanded.

    Returns:
        The conflict that comes first.
    """
    which, first, still = CLEAR, math.inf, forecast.still
    for i in range(still.shape[0]):
        t = _to_still(plan, tube, period, body, still[i, 0], still[i, 1], still[i, 2], first)
        if t < first:
            which, first = i, t
    for i in range(forecast.radius.shape[0]):
        t = _to_moving(plan, tube, period, body, forecast, i, rules, first)
        if t < first:
            which, first = still.shape[0] + i, t
    t = _leaves(plan, tube, period, rules.area)
    if t < first:
        which, first = AREA, t
    t = _beyond(plan, tube, period, body, rules)
    if t < first:
        which, first = UNSEEN, t
    return Verdict(which == CLEAR, which, first)


@kernel
def stopped_after(plan: Plan, k: int, limits: DriveLimits, period: float) -> Plan:
    """The first `k` periods of `plan`, then the hardest braking to rest that `limits` allow, and one period at rest.

    Without bounds on the acceleration that one period is all: the robot stands from its start on, but is still disturbed
    in it, as it moved before.
    """
    velocity = plan.velocities[k]
    longest = max(abs(velocity[0]) / limits.deceleration, abs(velocity[1]) / limits.angular_deceleration)
    commands = np.zeros((k + math.ceil(longest / period - 1e-9) + 1, 2))
    for j in range(k):
        commands[j, 0], commands[j, 1] = plan.commands[j, 0], plan.commands[j, 1]
    start = np.empty(5)
    for i in range(3):
        start[i] = plan.states[0, i]
    start[3], start[4] = plan.velocities[0, 0], plan.velocities[0, 1]
    return drive(start, commands, limits, period)


@kernel
def longest_certified(
    plan: Plan, body: Footprint, forecast: Forecast, rules: Rules, safety: Safety, standing: bool, least: int
) -> tuple[int, Plan, Tube]:
    """The largest k >= `least` such that the first k periods of `plan`, then the hardest braking, are certified.

    Args:
        plan: M periods of motion.
        body: The footprint.
        forecast: Where the obstacles will be, see `certify`.
        rules: What else is assumed and demanded.
        safety: What is assumed of the robot.
        standing: Whether the base stands now, and did in the period before.
        least: 0: braking at once is an answer as well; 1: it takes at least one period of the plan.

    Returns:
        k, -1 if there is none; the plan so stopped (for -1 the last one that was tried); and its tube.
    """
    n = len(plan.inputs)
    k, soon = min(n, SOON), n > SOON
    while True:
        whole = stopped_after(plan, k, safety.limits, safety.period)
        about = tube(whole, room(whole, safety.limits), safety.period, safety.disturbance, safety.start, standing)
        verdict = certify(whole, about, safety.period, body, forecast, rules)
        # a conflict on the common part stays one for every k beyond it: the tube does not depend on what follows
        free = n if verdict.ok else int(verdict.time / safety.period + 1e-9)
        if soon and free >= k:
            k = n
        elif verdict.ok:
            return k, whole, about
        else:
            k = min(k - 1, free)
            if k < least:
                return -1, whole, about
        soon = False


@light
def _rests(plan: Plan, j: int, body: Footprint, rules: Rules) -> bool:
    """Whether the outline stays where it is all through period `j` of `plan`, as far as the rules ask."""
    turns = rules.turning and body.lever == 0.0 and plan.inputs[j, 0] == 0.0 and plan.swings[j, 0] == 0.0
    return bool(turns or stands(plan, j))


@light
def _to_still(
    plan: Plan, tube: Tube, period: float, body: Footprint, ox: float, oy: float, size: float, deadline: float
) -> float:
    """When the tube may first touch the disc of radius `size` around (ox, oy), before `deadline` [s]; inf: not."""
    for j in range(len(plan.inputs)):
        if j * period >= deadline:
            break
        v, w = plan.inputs[j, 0], plan.inputs[j, 1]
        x, y, theta = plan.states[j, 0], plan.states[j, 1], plan.states[j, 2]
        off = size + tube.around[j]
        reach = body.circumscribed + off + abs(v) * period + TOUCH
        if (x - ox) ** 2 + (y - oy) ** 2 > reach * reach:
            continue
        off += body.lever * min(2.0, tube.turned[j])
        rate = abs(v) + abs(w) * body.lever
        t = 0.0
        while t <= period:
            px, py, turned = arc(x, y, theta, v, w, t)
            g = gap(body.vertices, body.radius, px, py, turned, ox, oy) - off
            if not g > TOUCH:  # NaN is no certificate
                return j * period + t
            if rate <= 0.0:
                break
            t += g / rate
    return math.inf


@light
def _to_moving(
    plan: Plan, tube: Tube, period: float, body: Footprint, forecast: Forecast, i: int, rules: Rules, deadline: float
) -> float:
    """When the tube may first touch moving obstacle `i` while the robot moves, before `deadline` [s]; inf: not."""
    step, speed, acceleration = forecast.step, forecast.speed[i], rules.acceleration
    last = forecast.centre.shape[1] - 1
    sag = acceleration * step * step / 8.0
    for j in range(len(plan.inputs)):
        v, w = plan.inputs[j, 0], plan.inputs[j, 1]
        t, end = j * period, (j + 1) * period
        if j * period >= deadline:
            break
        if _rests(plan, j, body, rules):
            continue
        x, y, theta = plan.states[j, 0], plan.states[j, 1], plan.states[j, 2]
        plain = forecast.radius[i] + tube.around[j]
        turned = body.lever * min(2.0, tube.turned[j])
        while t <= end:
            px, py, pt = arc(x, y, theta, v, w, t - j * period)
            k = min(int(t / step), last)
            rate = abs(v)
            # the centre is within the disc of the instant before, grown by the way that it can have gone since
            cx, cy, since = forecast.centre[i, k, 0], forecast.centre[i, k, 1], t - k * step
            g = math.hypot(px - cx, py - cy) - body.circumscribed - forecast.reach[i, k] - speed * since - plain
            if g > (rate + speed) * (end - t):
                break
            rate += abs(w) * body.lever
            off = plain + turned
            g = gap(body.vertices, body.radius, px, py, pt, cx, cy) - forecast.reach[i, k] - speed * since - off
            open_for = 0.0
            if k < last:
                nx, ny, left = forecast.centre[i, k + 1, 0], forecast.centre[i, k + 1, 1], (k + 1) * step - t
                near = gap(body.vertices, body.radius, px, py, pt, nx, ny) - forecast.reach[i, k + 1]
                g = max(g, near - speed * left - off)
                if acceleration < math.inf:  # between: on the line that joins the two discs, but for the sag
                    s = since / step
                    grown = forecast.reach[i, k + 1] - forecast.reach[i, k]
                    line = gap(body.vertices, body.radius, px, py, pt, cx + s * (nx - cx), cy + s * (ny - cy))
                    line -= forecast.reach[i, k] + s * grown + sag + off
                    closing = rate + (math.hypot(nx - cx, ny - cy) + max(0.0, grown)) / step
                    g = max(g, line)
                    if line > 0.0:
                        open_for = min(line / closing, left) if closing > 0.0 else left
            if not g > TOUCH:
                return t
            open_for = max(open_for, g / (rate + speed)) if rate + speed > 0.0 else end - t
            t += max(open_for, 1e-6)
    return math.inf


@light
def _leaves(plan: Plan, tube: Tube, period: float, area: FloatArray) -> float:
    """When the robot's centre may first leave `area` (4,); s, at the start of that period; inf: not."""
    x0, y0, r0 = plan.states[0, 0], plan.states[0, 1], tube.radius[0]
    low_x, low_y = min(area[0], x0 - r0), min(area[1], y0 - r0)
    high_x, high_y = max(area[2], x0 + r0), max(area[3], y0 + r0)
    for j in range(len(plan.inputs)):
        ax, ay, bx, by = plan.states[j, 0], plan.states[j, 1], plan.states[j + 1, 0], plan.states[j + 1, 1]
        off = tube.around[j] + _bow(plan.inputs[j, 0], plan.inputs[j, 1], period)
        inside_x = min(ax, bx) - off >= low_x and max(ax, bx) + off <= high_x
        inside_y = min(ay, by) - off >= low_y and max(ay, by) + off <= high_y
        if not (inside_x and inside_y):
            return j * period
    return math.inf


@light
def _beyond(plan: Plan, tube: Tube, period: float, body: Footprint, rules: Rules) -> float:
    """When the robot may first touch what nobody has seen, or drives where it doesn't look; s, at the start of that
    period; inf: not.

    The unseen that moves starts at the rim of what is seen, and counts while the robot moves; the unseen that stands
    is at the rim at any time. What is beside the sector may touch the robot already, as part of its own outline lies
    there: all that can be asked is that it doesn't drive that way.
    """
    sight, unseen = rules.sight, rules.unseen
    x0, y0, theta = plan.states[0, 0], plan.states[0, 1], plan.states[0, 2]
    if math.isfinite(rules.eye[0]):
        x0, y0, theta = rules.eye[0], rules.eye[1], rules.eye[2]
    x = x0 + math.cos(theta) * sight.x - math.sin(theta) * sight.y
    y = y0 + math.sin(theta) * sight.x + math.cos(theta) * sight.y
    shifted = tube.radius[0] + body.circumscribed + min(2.0, tube.heading[0]) * math.hypot(sight.x, sight.y)
    for j in range(len(plan.inputs)):
        before = math.hypot(plan.states[j, 0] - x, plan.states[j, 1] - y)
        after = math.hypot(plan.states[j + 1, 0] - x, plan.states[j + 1, 1] - y)
        out = max(before, after) + _bow(plan.inputs[j, 0], plan.inputs[j, 1], period) + tube.around[j]
        out += shifted
        still = _rests(plan, j, body, rules)
        if not out < sight.range - (0.0 if still else unseen * ((j + 1) * period + rules.looked)):
            return j * period
        if not still and not _looks(plan, j, theta, sight, tube.turned[j]):
            return j * period
    return math.inf


@light
def _looks(plan: Plan, j: int, theta: float, sight: Sight, doubt: float) -> bool:
    """Whether the way that is driven in period `j` leads where the robot looked with the heading `theta` [rad]; the heading
    errs by `doubt` [rad]."""
    first = last = plan.inputs[j, 0]
    if plan.swings[j, 0] > 0.0:
        first, last = plan.velocities[j, 0], plan.velocities[j + 1, 0]
    for heading in (plan.states[j, 2] - theta, plan.states[j + 1, 2] - theta):
        if max(first, last) > 0.0 and not sees(sight, heading, doubt):
            return False
        if min(first, last) < 0.0 and not sees(sight, heading + math.pi, doubt):
            return False
    return True


@light
def _bow(v: float, w: float, period: float) -> float:
    """How far [m] a period's arc bulges from its chord at most."""
    return abs(v * w) * period * period / 8.0

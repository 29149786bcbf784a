"""Contact that no step can jump over.

It is found by conservative advancement (Mirtich 1996): a gap of d metres that closes at no more than r m/s stays open for d / r
seconds, so nothing has to be looked at before. For what stands still the gap is kept across steps, as the reading of the robot's
odometer at which it has to be looked at next; that counts the metres that no point of its footprint can have exceeded.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import light
from clearway.geometry.distance import gap
from clearway.geometry.motion import slide
from clearway.geometry.packing import to_box, transform
from clearway.geometry.shapes import FloatArray
from clearway.world.setting import NEXT_CHECK, ODOMETER, Moving, Room, Still, Vehicle, X, Y
from clearway.world.tracks import knot_at, on_line, pose_at

TOUCH = 1e-5
"""A gap below this is contact, m: conservative advancement comes close, but never to zero."""
_LOOK = 0.1  # m: nearer than this to a body's box, its true outline is measured


class Step(NamedTuple):
    """The way in one step of the plant: an arc, and a displacement that grows evenly over the control period.

    Attributes:
        x: Where it begins, without displacement, m.
        y: The same.
        theta: The heading there, rad.
        v: Mean forward speed, m/s.
        v_y: Mean speed to the left, m/s.
        omega: Mean yaw rate, rad/s.
        push: (5,) displacement per time in x, y [m/s] and heading [rad/s]; the rest is not for the way.
        since: For how long the displacement has been growing, s.
        duration: How long it takes, s.
        advance: What the robot's origin does not exceed, m/s.
        rate: What no point of its footprint exceeds, m/s.
    """

    x: float
    y: float
    theta: float
    v: float
    v_y: float
    omega: float
    push: FloatArray
    since: float
    duration: float
    advance: float
    rate: float


@light
def meet_still(state: FloatArray, step: Step, vehicle: Vehicle, still: Still, room: Room) -> tuple[float, int]:
    """When in `step` the robot touches something that stands [s], and which; its whole duration and -1 if nothing.

    Args:
        state: What it says of the next check is updated.
    """
    due, boxes, points, first, radius = (
        still.due,
        still.boxes,
        still.shapes.points,
        still.shapes.first,
        still.shapes.radius,
    )
    outline, rim, reach, rate, robot = vehicle.outline, vehicle.rim, vehicle.reach, step.rate, room.outline
    until, hit = step.duration, -1
    for b in range(due.shape[0]):
        if due[b] > state[ODOMETER] + rate * until:
            continue
        s = max(0.0, (due[b] - state[ODOMETER]) / rate) if rate > 0.0 else 0.0
        body = points[first[b] : first[b + 1]]
        while s <= until:
            x, y, theta = displaced(step, s)
            d = to_box(boxes, b, x, y) - reach
            if d < _LOOK:
                transform(outline, x, y, theta, robot)
                d = gap(robot, rim, body, radius[b])
                if d <= TOUCH:
                    until, hit = s, b
                    break
            due[b] = state[ODOMETER] + rate * s + d
            if rate <= 0.0:
                break
            s += d / rate
    state[NEXT_CHECK] = math.inf
    for b in range(due.shape[0]):
        state[NEXT_CHECK] = min(state[NEXT_CHECK], due[b])
    return until, hit


@light
def meet_moving(
    state: FloatArray,
    step: Step,
    vehicle: Vehicle,
    moving: Moving,
    m: int,
    leg: int,
    t: float,
    until: float,
    room: Room,
) -> tuple[float, bool]:
    """When in `step`, but not after `until` [s], the robot touches body `m`, and whether it does.

    Args:
        leg: As for `plant.drive_period`.
        t: The same.
    """
    knots, here, robot = moving.tracks.knots, room.here, room.outline
    outline, rim, reach, radius, reaches = (
        vehicle.outline,
        vehicle.rim,
        vehicle.reach,
        moving.shapes.radius,
        moving.shapes.reach,
    )
    h, now = step.duration, t - moving.since[m] + step.since
    begin, end = moving.tracks.rows[leg, m, 0], moving.tracks.rows[leg, m, 1]
    moving.slack[m] = 0.0
    if pose_at(knots, begin, end, now, here):
        apart = math.hypot(here[0] - state[X], here[1] - state[Y]) - reaches[m] - reach
        closing = (step.advance + moving.tracks.speed[m]) * h
        if apart > closing:
            moving.slack[m] = apart - closing
            return until, False
    first, last = moving.shapes.first[m], moving.shapes.first[m + 1]
    shape, body = moving.shapes.points[first:last], room.shapes[first:last]
    knot, s = max(knot_at(knots, begin, end, now), begin), 0.0
    while knot < end - 1 and s <= until:  # from knot to knot it moves on a line
        s, over = max(s, knots[knot, 0] - now), knots[knot + 1, 0] - now
        lasts, turn = knots[knot + 1, 0] - knots[knot, 0], wrap(knots[knot + 1, 3] - knots[knot, 3])
        dx, dy = knots[knot + 1, 1] - knots[knot, 1], knots[knot + 1, 2] - knots[knot, 2]
        knot += 1
        if not (over > s and math.isfinite(dx)):  # one instant, or it is absent
            continue
        relative = step.rate + (math.hypot(dx, dy) + abs(turn) * reaches[m]) / lasts
        while s <= min(until, over):
            on_line(knots, knot - 1, now + s, here)
            x, y, theta = displaced(step, s)
            transform(outline, x, y, theta, robot)
            transform(shape, here[0], here[1], here[2], body)
            d = gap(robot, rim, body, radius[m])
            if d <= TOUCH:
                return s, True
            if relative <= 0.0:
                break
            s += d / relative
        s = min(s, over)  # the next line begins with a look
    return until, False


@light
def displaced(step: Step, s: float) -> tuple[float, float, float]:
    """The pose `s` [s] after the beginning of `step`."""
    push = step.push
    x, y, theta = slide(step.x, step.y, step.theta, step.v, step.v_y, step.omega, s)
    if push[0] == 0.0 and push[1] == 0.0 and push[2] == 0.0:
        return x, y, theta
    since = step.since + s
    return x + since * push[0], y + since * push[1], wrap(theta + since * push[2])

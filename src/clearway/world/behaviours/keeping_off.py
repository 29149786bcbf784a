"""How people keep off each other, robots and things, whatever the rule by which they walk wants."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.bodies import Bodies
from clearway.crowds.social_force import QUANTUM, quanta
from clearway.crowds.walls import Walls
from clearway.crowds.ways import Room, room_at
from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray

BESIDE = 0.3
"""A person leaves a robot so much room beyond its circumscribed disc where there is, and a thing beyond its discs, m: what people leave to
what stands on either side when they walk between (Hackney, Vallis, Cinelli 2013)."""
TOUCH = 0.07
"""Nearer than this nobody walks up to a robot's disc, m: who has less to either side, of a shoulder's width of 0.5 m, turns the shoulders
(Warren, Whang 1987)."""
IN_TIME = 0.5
"""Nobody nears a robot so fast that they would meet sooner, s (tau of Moussaïd, Helbing, Theraulaz 2011)."""
SLIM = 0.6
"""Nobody is moved nearer to what stands, or to somebody else, than this share of the radius of each: two who turn the shoulders, of 0.5 m,
brush past each other chest to chest, 0.3 m from middle to middle."""
PRESSING = 62.5
"""Acceleration of two who touch, for each metre that their discs overlap, 1/s^2 (Moussaïd, Helbing, Theraulaz 2011: 5000 kg/s^2, and 80 kg
for a radius of 0.25 m)."""


FAR = 1e6
"""There, in x and y, is a body that isn't, m."""
_ROUNDS = 8
"""So often, at most, somebody's step is mended who nears a robot or a thing too fast, the worst of them first."""


class Walker(NamedTuple):
    """Somebody who is about to take a step.

    Attributes:
        me: Which of the bodies that is.
        x: Where it is, m.
        y: The same.
        heading: Where it looks, rad.
        sees: The layers that it looks at, or-ed.
        v_max: The most that it walks at, m/s.
    """

    me: int
    x: float
    y: float
    heading: float
    sees: int
    v_max: float


class Around(NamedTuple):
    """What people keep off who take a step at one instant.

    Attributes:
        bodies: The n that move: the m people and others, of which things are far away, as their discs come next, then robots.
        bound: (m, 3) where each of the m will be when it decides anew, m and rad; NaN: nobody knows.
        free: (m,) whether each decides at this instant too; it is bound for where it is.
        age: (n,) how old what is seen of each is, s.
        room: What stands leaves so much.
        walls: What stands.
        limits: (2 n, 3) room to work with.
    """

    bodies: Bodies
    bound: FloatArray
    free: npt.NDArray[np.bool_]
    age: FloatArray
    room: Room
    walls: Walls
    limits: FloatArray


@light
def keep_off(walker: Walker, velocity: FloatArray, bodily: bool, around: Around, dt: float) -> None:
    """Have a walker take no step into what stands or into somebody, whatever it wants, nor up against a thing, or a robot that it sees.

    Args:
        walker: Who it is.
        velocity: (2,) at which it would walk, m/s; updated.
        bodily: Whether it is pressed off those whom it touches.
        around: What is there.
        dt: Until its next decision, s.
    """
    if bodily:
        press_off(walker, velocity, around, dt)
    hold_off(walker, velocity, around, dt)
    stop_short(walker, velocity, around, dt)
    stay_on_floor(walker, velocity, around, dt)


@light
def press_off(walker: Walker, velocity: FloatArray, around: Around, dt: float) -> None:
    """Have a walker pressed off those whom it touches: forces know no bodies. In which order people are listed changes no bit. Arguments as
    for `keep_off`."""
    bodies, px, py = around.bodies, 0, 0
    for i in range(len(around.free)):
        touching = bodies.radius[i] + bodies.radius[walker.me]
        dx, dy = bodies.position[i, 0] - walker.x, bodies.position[i, 1] - walker.y
        if _minds(walker, i, dx, dy, touching, bodies):
            distance = max(math.hypot(dx, dy), 1e-9)
            press = PRESSING * max(touching - distance, 0.0) * dt / distance
            px, py = px + quanta(press * dx), py + quanta(press * dy)
    velocity[0], velocity[1] = velocity[0] - px * QUANTUM, velocity[1] - py * QUANTUM
    _no_faster(velocity, walker.v_max)


@light
def stop_short(walker: Walker, velocity: FloatArray, around: Around, dt: float) -> None:
    """Slow a walker down so far that it takes no more than half of the room that is left to anybody who takes a step as well, and no more
    than the room to the way that somebody who has decided still goes. Arguments as for `keep_off`."""
    slower, bodies, bound = 1.0, around.bodies, around.bound
    for i in range(len(around.free)):
        if bodies.position[i, 0] == FAR:
            continue
        slim = SLIM * (bodies.radius[i] + bodies.radius[walker.me])
        dx, dy = bodies.position[i, 0] - walker.x, bodies.position[i, 1] - walker.y
        goes_x, goes_y = bound[i, 0] - bodies.position[i, 0], bound[i, 1] - bodies.position[i, 1]
        goes_x, goes_y = (goes_x, goes_y) if math.isfinite(goes_x) else (0.0, 0.0)
        if not _minds(walker, i, dx, dy, slim + 2.0 * walker.v_max * dt + abs(goes_x) + abs(goes_y), bodies):
            continue
        along = -(goes_x * dx + goes_y * dy) / max(goes_x * goes_x + goes_y * goes_y, 1e-12)
        along = min(max(along, 0.0), 1.0)  # of what it still goes, where it comes nearest
        dx, dy = dx + along * goes_x, dy + along * goes_y
        distance = max(math.hypot(dx, dy), 1e-9)
        share = 0.5 if around.free[i] else 1.0
        onto = (velocity[0] * dx + velocity[1] * dy) / distance
        most = max(share * (distance - slim) / dt, 0.0)
        slower = min(slower, most / onto) if onto > most else slower
    velocity[0], velocity[1] = slower * velocity[0], slower * velocity[1]


@light
def stay_on_floor(walker: Walker, velocity: FloatArray, around: Around, dt: float) -> None:
    """Slow a walker down so far that nowhere on its step there is less room to what stands, up to a cell, than `SLIM` leaves it, or than it
    has now; who is in a cell of a wall doesn't step through that. Arguments as for `keep_off`."""
    room, length = around.room, math.hypot(velocity[0], velocity[1]) * dt
    here = room_at(room, walker.x, walker.y)
    if here == 0.0 and _through(around.walls, walker, velocity[0] * dt, velocity[1] * dt):
        velocity[0] = velocity[1] = 0.0
        return
    least, gone, well = min(here, SLIM * around.bodies.radius[walker.me]), 0.0, 0.0
    while well < length:
        gone = min(well + max(min(here, room.told) - least - 1.5 * room.resolution, 0.5 * room.resolution), length)
        share = gone / length * dt
        here = room_at(room, walker.x + share * velocity[0], walker.y + share * velocity[1])
        if here < least:
            velocity[0], velocity[1] = well / length * velocity[0], well / length * velocity[1]
            return
        well = gone


@light
def _through(walls: Walls, walker: Walker, dx: float, dy: float) -> bool:
    """Whether a step by (dx, dy) [m] leads into a wall, or through it; who is in it may step out."""
    for k in range(len(walls.length)):
        ax, ay = walls.vertex[k, 0] - walker.x, walls.vertex[k, 1] - walker.y
        ex, ey = walls.direction[k, 0] * walls.length[k], walls.direction[k, 1] * walls.length[k]
        across = dx * ey - dy * ex
        if across < 0.0 and 0.0 <= (ax * ey - ay * ex) / across <= 1.0 and 0.0 <= (ax * dy - ay * dx) / across <= 1.0:
            return True
    return False


@light
def _minds(walker: Walker, i: int, dx: float, dy: float, reach: float, bodies: Bodies) -> bool:
    """Whether body `i`, that is (dx, dy) [m] away from a walker, is another that it sees and in `reach` [m]."""
    return bool(i != walker.me and max(abs(dx), abs(dy)) <= reach and walker.sees & bodies.layer[i] != 0)


@light
def _no_faster(velocity: FloatArray, v_max: float) -> None:
    """Scale the `velocity` (2,) down to `v_max` [m/s]."""
    speed = math.hypot(velocity[0], velocity[1])
    if speed > v_max:
        velocity[0], velocity[1] = v_max / speed * velocity[0], v_max / speed * velocity[1]


@light
def hold_off(walker: Walker, velocity: FloatArray, around: Around, dt: float) -> None:
    """Have somebody near a robot, or a thing, no faster than lets them meet `IN_TIME` from now, or at the next decision if that is later,
    wherever it has braked since it was seen; and make room for one that is before its eyes and comes on faster. Arguments as for `keep_off`."""
    bodies, limits, count = around.bodies, around.limits, 0
    in_time = max(IN_TIME, dt)
    for j in range(len(around.free), len(bodies.radius)):
        x, y = bodies.position[j, 0] - walker.x, bodies.position[j, 1] - walker.y
        drives_x, drives_y = bodies.velocity[j, 0], bodies.velocity[j, 1]
        meet = bodies.radius[walker.me] + bodies.radius[j] - BESIDE + TOUCH
        reach = meet + (2.0 * walker.v_max + math.hypot(drives_x, drives_y)) * (in_time + around.age[j])
        if not _minds(walker, j, x, y, reach, bodies):
            continue
        wx, wy = around.age[j] * drives_x, around.age[j] * drives_y
        back = min(max((x * wx + y * wy) / max(wx * wx + wy * wy, 1e-12), 0.0), 1.0)
        near_x, near_y = x - back * wx, y - back * wy
        distance = max(math.hypot(near_x, near_y), 1e-9)
        _limit(limits, count, near_x / distance, near_y / distance, max((distance - meet) / in_time, 0.0))
        count += 1
        away, onto = max(math.hypot(x, y), 1e-9), drives_x * x + drives_y * y
        if onto < 0.0 and math.cos(walker.heading) * x + math.sin(walker.heading) * y > 0.0:
            _limit(limits, count, x / away, y / away, max((away - meet) / in_time + onto / away, -walker.v_max))
            count += 1
    for _ in range(_ROUNDS):
        worst, excess = -1, 1e-12
        for k in range(count):
            over = velocity[0] * limits[k, 0] + velocity[1] * limits[k, 1] - limits[k, 2]
            if over > excess or (worst >= 0 and over == excess and _before(limits[k], limits[worst])):
                worst, excess = k, over
        if worst < 0:
            break
        velocity[0], velocity[1] = velocity[0] - excess * limits[worst, 0], velocity[1] - excess * limits[worst, 1]
    _no_faster(velocity, walker.v_max)  # who steps back goes on sideways too
    slower = 1.0
    for k in range(count):  # between two of them there may be no way on
        onto = velocity[0] * limits[k, 0] + velocity[1] * limits[k, 1]
        slower = min(slower, limits[k, 2] / onto) if onto > limits[k, 2] >= 0.0 else slower
    velocity[0], velocity[1] = slower * velocity[0], slower * velocity[1]


@light
def _limit(limits: FloatArray, k: int, x: float, y: float, most: float) -> None:
    limits[k, 0], limits[k, 1], limits[k, 2] = x, y, most


@light
def _before(limit: FloatArray, other: FloatArray) -> bool:
    """Which of two that are exceeded by as much is mended first: by the way they point, not by their places in a file."""
    return bool(limit[0] < other[0] or (limit[0] == other[0] and limit[1] < other[1]))

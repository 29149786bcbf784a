"""How people keep off each other, robots and things, whatever the rule by which they walk wants."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.crowds.bodies import Bodies
from clearway.crowds.social_force import QUANTUM, quanta
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


class Walker(NamedTuple):
    """Somebody who is about to take a step.

    Attributes:
        me: Which of the bodies that is.
        x: Where it is, m.
        y: The same.
        sees: The layers that it looks at, or-ed.
        v_max: The most that it walks at, m/s.
    """

    me: int
    x: float
    y: float
    sees: int
    v_max: float


@light
def press_off(walker: Walker, velocity: FloatArray, bodies: Bodies, people: int, dt: float) -> None:
    """Have a walker pressed off those whom it touches: forces know no bodies. In which order people are listed changes no bit.

    Args:
        walker: Who it is.
        velocity: (2,) at which it would walk, m/s; updated.
        bodies: Everything that moves, of which those before number `people` are people.
        people: The same.
        dt: Until the next decision, s.
    """
    px = py = 0
    for i in range(people):
        touching = bodies.radius[i] + bodies.radius[walker.me]
        dx, dy, distance = _to(walker, i, touching, bodies)
        press = PRESSING * max(touching - distance, 0.0) * dt / distance
        px, py = px + quanta(press * dx), py + quanta(press * dy)
    velocity[0], velocity[1] = velocity[0] - px * QUANTUM, velocity[1] - py * QUANTUM
    _no_faster(velocity, walker.v_max)


@light
def stop_short(walker: Walker, velocity: FloatArray, bodies: Bodies, people: int, dt: float) -> None:
    """Slow a walker down so far that it takes no more than half of the room that is left to anybody in a step.

    Args:
        walker: As `press_off` has it.
        velocity: The same.
        bodies: The same.
        people: The same.
        dt: The same.
    """
    slower = 1.0
    for i in range(people):
        slim = SLIM * (bodies.radius[i] + bodies.radius[walker.me])
        dx, dy, distance = _to(walker, i, slim + 2.0 * walker.v_max * dt, bodies)
        onto, most = (velocity[0] * dx + velocity[1] * dy) / distance, max(0.5 * (distance - slim) / dt, 0.0)
        slower = min(slower, most / onto) if onto > most else slower
    velocity[0], velocity[1] = slower * velocity[0], slower * velocity[1]


@light
def _to(walker: Walker, i: int, reach: float, bodies: Bodies) -> tuple[float, float, float]:
    """The way from a walker to body `i` and how long it is, m; of itself, one that it overlooks, or one out of `reach` [m]: no way, inf."""
    dx, dy = bodies.position[i, 0] - walker.x, bodies.position[i, 1] - walker.y
    if i == walker.me or max(abs(dx), abs(dy)) > reach or not walker.sees & bodies.layer[i]:
        return 0.0, 0.0, math.inf
    return dx, dy, max(math.hypot(dx, dy), 1e-9)


@light
def _no_faster(velocity: FloatArray, v_max: float) -> None:
    """Scale the `velocity` (2,) down to `v_max` [m/s]."""
    faster = max(math.hypot(velocity[0], velocity[1]) / v_max, 1.0)
    velocity[0] /= faster
    velocity[1] /= faster


class Sighting(NamedTuple):
    """A robot, or a disc of a thing, as somebody sees it.

    Attributes:
        to: (x, y) from the person to where it is by now if it has driven on, m.
        drives: (vx, vy) of it when it was seen, m/s.
        reaction: How long ago that was, s.
        apart: How far from middle to middle the person would leave it, m.
    """

    to: tuple[float, float]
    drives: tuple[float, float]
    reaction: float
    apart: float


@light
def hold_off(velocity: FloatArray, heading: float, robot: Sighting, dt: float, v_max: float) -> None:
    """Have somebody near a robot no faster than lets them meet `IN_TIME` from now, or at the next decision if that is later, wherever it has
    braked since it was seen; and make room for one that is before its eyes and comes on faster.

    Args:
        velocity: (2,) of the person, m/s; updated.
        heading: Where the person looks, rad.
        robot: What the person sees.
        dt: Until the next decision, s.
        v_max: The most that the person walks at, m/s.
    """
    to, drives, reaction, apart = robot
    wx, wy = reaction * drives[0], reaction * drives[1]
    back = min(max((to[0] * wx + to[1] * wy) / max(wx * wx + wy * wy, 1e-12), 0.0), 1.0)
    x, y = to[0] - back * wx, to[1] - back * wy
    in_time, meet = max(IN_TIME, dt), apart - BESIDE + TOUCH
    _near(velocity, x, y, max((math.hypot(x, y) - meet) / in_time, 0.0))
    away, onto = math.hypot(to[0], to[1]), drives[0] * to[0] + drives[1] * to[1]
    if onto < 0.0 and math.cos(heading) * to[0] + math.sin(heading) * to[1] > 0.0:
        _near(velocity, to[0], to[1], max((away - meet) / in_time + onto / max(away, 1e-9), -v_max))
        _no_faster(velocity, v_max)  # who steps back goes on sideways too


@light
def _near(velocity: FloatArray, x: float, y: float, most: float) -> None:
    """Take from the `velocity` (2,) what is more than `most` [m/s] towards (x, y)."""
    distance = max(math.hypot(x, y), 1e-9)
    excess = (velocity[0] * x + velocity[1] * y) / distance - most
    if excess > 0.0:
        velocity[0] -= excess * x / distance
        velocity[1] -= excess * y / distance

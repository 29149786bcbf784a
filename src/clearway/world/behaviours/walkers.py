"""People who walk along routes and keep out of each other's way by one rule.

All of a crowd decide at once, each by what it sees: the others where they are, robots where they were a reaction time ago, on as
they drove then. Ways round what stands come from the floor; the rule keeps the shoulders off it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.ways import Room, room_at
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.people import PersonSpec
from clearway.world.behaviours.behaviour import GLANCE, PERIOD, STEPPING, Cast, Scene
from clearway.world.behaviours.routes import Routes
from clearway.world.behaviours.wishes import speed_of
from clearway.world.tracks import pose_at

FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
BESIDE = 0.1
"""A person leaves a robot so much room beyond its circumscribed disc where there is, m."""
TOUCH = 0.03
"""Nearer than this nobody walks up to a robot's disc, m."""
TURNING = 4.0
"""The most that a person turns, rad/s."""


class Rule(Protocol):
    """By which a crowd walks."""

    def __call__(self, bodies: Bodies, wishes: Wishes, heading: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """The next velocities (k, 2) [m/s] and headings (k,) [rad] of a crowd.

        Args:
            bodies: Everything that moves; robots are behind the others.
            wishes: What the crowd wants.
            heading: (k,) rad, now.

        Returns:
            No headings: a person turns to where it walks.
        """


class Walkers:
    """A crowd that walks by one rule.

    Args:
        cast: Who they are, and where.
        rule: By which they walk.
    """

    def __init__(self, cast: Cast, rule: Rule) -> None:
        people = cast.people
        preferred = np.array([speed_of(person, cast.seed) for person in people])
        self.members, self._rule, self._radius = cast.members, rule, cast.radius
        self._who = np.array(cast.members, np.int64)
        self._share, self._room = np.where(cast.decides, 0.5, 1.0), cast.room
        self._routes = Routes(people, preferred, cast.room, cast.seed)
        self.speed = FASTER * preferred
        self._own = np.array([person.radius for person in people])
        self._at = np.array([(*person.start, course_of(person)) for person in people], np.float64)
        self._velocity = np.zeros((len(people), 2))
        self._reactions = sorted({person.reaction for person in people if person.sees_robots})
        self._sees = np.array([1 | (2 << self._reactions.index(p.reaction) if p.sees_robots else 0) for p in people])

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Walk on from `t` to `until` [s]."""
        wished = self._routes.wishes(t, self._at, self._velocity)
        robots = seen_robots(scene, t, self._reactions)
        bodies = everybody(scene.moving, scene.before, self._who, self._velocity, self._radius, self._share, robots)
        heading = self._at[:, 2].copy()
        chosen, headings = self._rule(bodies, Wishes(self._who, wished, self.speed, self._sees), heading)
        if headings is None:
            headings = heading
            turning = TURNING * (until - t)
        else:
            turning = -1.0
        walk(
            self._at, chosen, headings, turning, bodies, len(self._radius), self._sees, self._own, self._room, until - t
        )
        self._velocity = chosen
        return self._at.copy()


class Robots(NamedTuple):
    """The robots as people see them, each once for each reaction time.

    Attributes:
        position: (r, 2) m.
        velocity: (r, 2) m/s.
        radius: (r,) of the disc around each, with the room that is left it, m.
        layer: (r,) int64, the layer of those who react so.
    """

    position: FloatArray
    velocity: FloatArray
    radius: FloatArray
    layer: npt.NDArray[np.int64]


def seen_robots(scene: Scene, t: float, reactions: Sequence[float]) -> Robots:
    """The robots at time `t` [s]: where they were each of `reactions` [s] ago, on as they drove then."""
    count = len(reactions) * len(scene.robots)
    found = Robots(np.empty((count, 2)), np.empty((count, 2)), np.empty(count), np.empty(count, np.int64))
    i = 0
    for k, reaction in enumerate(reactions):
        for robot in scene.robots:
            track = robot.track
            glance(track.knots, track.count, t - reaction, reaction, found.position[i], found.velocity[i])
            found.radius[i], found.layer[i] = robot.shape.reach[0] + BESIDE, 2 << k
            i += 1
    return found


@kernel
def glance(knots: FloatArray, count: int, t: float, ahead: float, position: FloatArray, velocity: FloatArray) -> None:
    """Where something will be `ahead` [s] after time `t` [s], as it drives then, by the track `knots` (count, 4).

    Args:
        knots: As `Laid` has them.
        count: The same.
        t: When it is looked at, s.
        ahead: How long it is taken to drive on, s.
        position: (2,) m; written.
        velocity: (2,) m/s; written.
    """
    now, before, first, last = np.empty(3), np.empty(3), knots[0, 0], knots[count - 1, 0]
    pose_at(knots, 0, count, min(max(t, first), last), now)
    pose_at(knots, 0, count, min(max(t - GLANCE, first), last), before)
    for c in range(2):
        velocity[c] = (now[c] - before[c]) / GLANCE
        position[c] = now[c] + ahead * velocity[c]


@kernel
def everybody(
    moving: FloatArray, before: FloatArray, who: npt.NDArray[np.int64], velocity: FloatArray, radius: FloatArray, share: FloatArray,
    robots: Robots,
) -> Bodies:  # fmt: skip
    """Everything that moves: the moving bodies, then the robots; nobody counts on a robot to step aside.

    Args:
        moving: (m, 3) poses now, NaN where one is absent: that one is far away.
        before: (m, 3) the same `PERIOD` ago.
        who: (k,) which of them know how fast they are.
        velocity: (k, 2) that, m/s.
        radius: (m,) m.
        share: (m,) see `Bodies`.
        robots: The robots.
    """
    m, r = len(moving), len(robots.radius)
    out = Bodies(np.empty((m + r, 2)), np.empty((m + r, 2)), np.empty(m + r), np.ones(m + r, np.int64), np.ones(m + r))
    for i in range(m):
        there = math.isfinite(moving[i, 0])
        for c in range(2):
            out.position[i, c] = moving[i, c] if there else 1e6
            moved = (moving[i, c] - before[i, c]) / PERIOD
            out.velocity[i, c] = moved if math.isfinite(moved) else 0.0
        out.radius[i], out.share[i] = radius[i], share[i]
    for k in range(len(who)):
        out.velocity[who[k]] = velocity[k]
    for j in range(r):
        out.position[m + j], out.velocity[m + j] = robots.position[j], robots.velocity[j]
        out.radius[m + j], out.layer[m + j] = robots.radius[j], robots.layer[j]
    return out


@kernel
def walk(
    at: FloatArray, chosen: FloatArray, headings: FloatArray, turning: float, bodies: Bodies, first: int, sees: npt.NDArray[np.int64],
    radius: FloatArray, room: Room, dt: float,
) -> None:  # fmt: skip
    """Take each person a step further; never into what stands, whatever pushes, nor up against a robot that it sees.

    Args:
        at: (k, 3) poses; updated.
        chosen: (k, 2) velocities by the rule, m/s; updated to those that are walked.
        headings: (k,) by the rule, rad.
        turning: The most that a person turns, rad, who faces where it walks; negative: the rule says where it faces.
        bodies: Everything that moves.
        first: From which of them on they are robots.
        sees: (k,) the layers that each looks at.
        radius: (k,) of each, m.
        room: Where what stands leaves how much.
        dt: How long the step takes, s.
    """
    for k in range(len(at)):
        for j in range(first, len(bodies.radius)):
            if sees[k] & bodies.layer[j]:
                hold_off(chosen[k], bodies.position[j] - at[k, :2], radius[k] + bodies.radius[j], dt)
        x, y = at[k, 0] + chosen[k, 0] * dt, at[k, 1] + chosen[k, 1] * dt
        if room_at(room, x, y) < min(room_at(room, at[k, 0], at[k, 1]), 0.6 * radius[k]):
            chosen[k] = 0.0
            x, y = at[k, 0], at[k, 1]
        at[k, 0], at[k, 1] = x, y
        if turning < 0.0:
            at[k, 2] = headings[k]
        elif math.hypot(chosen[k, 0], chosen[k, 1]) > STEPPING:
            turn = wrap(math.atan2(chosen[k, 1], chosen[k, 0]) - at[k, 2])
            at[k, 2] = wrap(at[k, 2] + min(max(turn, -turning), turning))


@kernel
def hold_off(velocity: FloatArray, to: FloatArray, apart: float, dt: float) -> None:
    """Take from the `velocity` (2,) [m/s] what would within `dt` [s] bring somebody up against a robot whose middle is `to` (2,) [m]
    away, and from which the person wants `apart` [m] from middle to middle."""
    distance = math.hypot(to[0], to[1])
    most = max((distance - apart + BESIDE - TOUCH) / dt, 0.0)
    onto = (velocity[0] * to[0] + velocity[1] * to[1]) / max(distance, 1e-9)
    if onto > most:
        velocity -= (onto - most) / max(distance, 1e-9) * to


def course_of(person: PersonSpec) -> float:
    """Where a person looks at first: to the first place of the route."""
    if not person.route:
        return 0.0
    (x, y), (gx, gy) = person.start, person.route[0].at
    return math.atan2(gy - y, gx - x)

"""People who walk along routes and keep out of each other's way by one rule.

All of a crowd decide at once, each by what it sees: the others where they are, robots where they were a reaction time ago, on as
they drove then. Ways round what stands come from the floor; the rule keeps the shoulders off it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.ways import Ways, room_at, way_point, ways_to
from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.scenarios.people import PersonSpec
from clearway.world.behaviours.behaviour import GLANCE, PERIOD, STEPPING, Cast, Scene
from clearway.world.behaviours.wishes import speed_of

AHEAD = 4.0
"""How far along the way a person looks for the place to head for, m."""
FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
ARRIVED = 0.3
"""So near to a place of the route the next one is walked to, m."""
STOPPING = 1.0
"""Who comes to stay somewhere slows down so as to be there in no less than this, s."""
BESIDE = 0.1
"""A person leaves a robot so much room beyond its circumscribed disc where there is, m."""
TOUCH = 0.03
"""Nearer than this nobody walks up to a robot's disc, m."""
HELD_UP, PATIENCE, SIDESTEP, ASIDE = 0.3, 1.0, 1.0, 2.0
"""Who comes no faster than this share of the preferred speed for so long, s, heads so far to the right, rad, for so long, s:
those who give way to each other exactly would stand for ever."""
STRAYING = 0.02
"""By how much a person's course errs at most, rad: two who want exactly through each other would stand for ever."""
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


@dataclass(slots=True, eq=False)
class _Person:
    """Where one is on the route.

    Attributes:
        spec: Who it is.
        speed: Preferred, m/s.
        key: Of what is drawn for this person.
        ways: To a place (x, y) [m], for somebody of a radius [m].
        stop: To which place of the route, as a number.
        until: Stands until this time, s.
        moved: When it last came on, s.
        aside: Heads to the right until this time, s.
        held: The place (x, y) where the person stays while it does not walk, m.
    """

    spec: PersonSpec
    speed: float
    key: np.uint64
    ways: Callable[[tuple[float, float], float], Ways]
    held: tuple[float, float]
    stop: int = 0
    until: float = -math.inf
    moved: float = 0.0
    aside: float = -math.inf

    def wish(self, t: float, count: int, x: float, y: float, pace: float) -> tuple[float, float]:
        """The velocity (m/s) that it would walk at alone, at (x, y) [m] at time `t` [s], the decision number `count`; `pace`:
        how fast it walks now, m/s."""
        route = self.spec.route
        while self.stop < len(route) and t >= self.until and math.dist(route[self.stop].at, (x, y)) <= ARRIVED:
            self.held, self.until = route[self.stop].at, t + route[self.stop].wait
            self.stop += 1
            if self.stop == len(route) and self.spec.loop:
                self.stop = 0
                break
        walks = self.stop < len(route) and t >= self.until
        place = route[self.stop].at if walks else self.held
        tx, ty, _ = way_point(self.ways(place, self.spec.radius), x, y, AHEAD)
        stays = not walks or route[self.stop].wait > 0.0 or (self.stop == len(route) - 1 and not self.spec.loop)
        left = math.hypot(tx - x, ty - y)
        speed = min(self.speed, left / STOPPING) if stays and (tx, ty) == place else self.speed
        course = math.atan2(ty - y, tx - x) + STRAYING * (2.0 * uniform(self.key, 1, count) - 1.0)
        if pace >= HELD_UP * speed:
            self.moved = t
        elif t > self.moved + PATIENCE:
            self.aside = t + ASIDE
        if t < self.aside:
            course -= SIDESTEP
        return speed * math.cos(course), speed * math.sin(course)


class Walkers:
    """A crowd that walks by one rule.

    Args:
        cast: Who they are, and where.
        rule: By which they walk.
    """

    def __init__(self, cast: Cast, rule: Rule) -> None:
        people, room, seed = cast.people, cast.room, cast.seed
        self.members, self._rule, self._radius = cast.members, rule, cast.radius
        self._share = np.where(cast.decides, 0.5, 1.0)
        self._room = room
        ways = lru_cache(2 * len(people))(lambda place, radius: ways_to(np.array(place), room, radius))
        self._people = [_Person(p, speed_of(p, seed), stream(seed, f"person {p.name}"), ways, p.start) for p in people]
        preferred = np.array([p.speed for p in self._people])
        self.speed = FASTER * preferred
        self._at = np.array([(*p.start, _course(p)) for p in people], np.float64)
        self._velocity = np.zeros((len(people), 2))
        self._reactions = sorted({p.reaction for p in people if p.sees_robots})
        self._sees = np.array([1 | (2 << self._reactions.index(p.reaction) if p.sees_robots else 0) for p in people])
        self._count = 0

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Walk on from `t` to `until` [s]."""
        who, dt = np.array(self.members, np.int64), until - t
        pace = np.hypot(*self._velocity.T).tolist()
        wished = [
            p.wish(t, self._count, x, y, v)
            for p, (x, y, _), v in zip(self._people, self._at.tolist(), pace, strict=True)
        ]
        bodies = self._bodies(t, scene)
        chosen, headings = self._rule(
            bodies, Wishes(who, np.array(wished), self.speed, self._sees), self._at[:, 2].copy()
        )
        self._count += 1
        for k, person in enumerate(self._people):
            self._hold_off(k, chosen[k], bodies, dt)
            step = chosen[k] * dt
            here, there = (room_at(self._room, *(self._at[k, :2] + s)) for s in (np.zeros(2), step))
            if there < min(here, 0.6 * person.spec.radius):  # never into what stands, whatever pushes
                chosen[k] = 0.0
            self._at[k, :2] += chosen[k] * dt
            if headings is not None:
                self._at[k, 2] = headings[k]
            elif math.hypot(*chosen[k]) > STEPPING:
                turn = wrap(math.atan2(chosen[k, 1], chosen[k, 0]) - self._at[k, 2])
                self._at[k, 2] = wrap(self._at[k, 2] + min(max(turn, -TURNING * dt), TURNING * dt))
        self._velocity = chosen
        return self._at.copy()

    def _hold_off(self, k: int, velocity: FloatArray, bodies: Bodies, dt: float) -> None:
        """Take from the `velocity` (2,) of person `k` what would bring it up against a robot that it sees, whatever pushes."""
        for j in range(len(self._radius), len(bodies.radius)):
            if self._sees[k] & bodies.layer[j]:
                hold_off(
                    velocity, bodies.position[j] - self._at[k, :2], self._people[k].spec.radius + bodies.radius[j], dt
                )

    def _bodies(self, t: float, scene: Scene) -> Bodies:
        """Everything that moves: the moving bodies, then each robot once for each reaction time."""
        there = np.isfinite(scene.moving[:, 0])
        position = np.where(there[:, None], scene.moving[:, :2], 1e6)  # who is absent is far away
        velocity = np.nan_to_num((scene.moving[:, :2] - scene.before[:, :2]) / PERIOD)
        velocity[list(self.members)] = self._velocity
        seen, moved, radius, layer = [position], [velocity], [self._radius], [np.ones(len(position), np.int64)]
        for k, reaction in enumerate(self._reactions):
            for robot in scene.robots:
                now, before = robot.track.at(t - reaction), robot.track.at(t - reaction - GLANCE)
                v = (now[:2] - before[:2]) / GLANCE
                seen.append((now[:2] + reaction * v)[None])
                moved.append(v[None])
                radius.append(robot.shape.reach + BESIDE)
                layer.append(np.array([2 << k], np.int64))
        share = np.concatenate([self._share, np.ones(len(seen) - 1)])  # nobody counts on a robot to step aside
        return Bodies(np.concatenate(seen), np.concatenate(moved), np.concatenate(radius), np.concatenate(layer), share)


def hold_off(velocity: FloatArray, to: FloatArray, apart: float, dt: float) -> None:
    """Take from the `velocity` (2,) [m/s] what would within `dt` [s] bring somebody up against a robot whose middle is `to` (2,) [m]
    away, and from which the person wants `apart` [m] from middle to middle."""
    distance = math.hypot(*to)
    most = (distance - apart + BESIDE - TOUCH) / dt
    onto = float(velocity @ to) / max(distance, 1e-9)
    if onto > max(most, 0.0):
        velocity -= (onto - max(most, 0.0)) / max(distance, 1e-9) * to


def _course(person: PersonSpec) -> float:
    """Where a person looks at first: to the first place of the route."""
    if not person.route:
        return 0.0
    (x, y), (gx, gy) = person.start, person.route[0].at
    return math.atan2(gy - y, gx - x)

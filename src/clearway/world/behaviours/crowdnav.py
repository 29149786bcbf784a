"""People as CrowdNav moves them, so that its test cases come out as they do there.

Chen, Liu, Kreiss, Alahi 2019 ("Crowd-robot interaction: crowd-aware robot navigation with attention-based deep reinforcement
learning"), by the code that they published. It differs from the behaviour `orca` in that nobody is like a person: all decide at once
and seldom, want straight to their goals and never stray, see everything as it is now, and take a robot for one of their kind.
"""

from __future__ import annotations

import numpy as np

from clearway.crowds import orca
from clearway.crowds.bodies import Bodies, Wishes
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import PERIOD, STEPPING, Cast, Scene
from clearway.world.behaviours.walkers import course_of, glance
from clearway.world.behaviours.wishes import speed_of

DECIDES_EVERY = 0.25
"""Time from a decision to the next, s; in between everybody walks straight on."""
KEPT = 0.01
"""By so much each takes itself and all others for larger, m."""
SLOWING = 1.0
"""Who is nearer to its goal than the way of this time slows down so as to be there no sooner, s."""
_SAME = 1e-9  # s


class CrowdNav:
    """A crowd that walks by ORCA as CrowdNav runs it: ten neighbours within 10 m, 5 s ahead, half of the avoiding.

    Args:
        cast: Who they are, and where.
    """

    def __init__(self, cast: Cast) -> None:
        people, k = cast.people, len(cast.people)
        self.members, self.speed = cast.members, np.array([speed_of(person, cast.seed) for person in people])
        self._who, self._walls, self._radius = np.array(cast.members, np.int64), cast.walls, cast.radius + KEPT
        self._goal = np.array([person.route[0].at if person.route else person.start for person in people])
        self._sees = np.array([3 if person.sees_robots else 1 for person in people], np.int64)
        self._care = orca.Care(np.full(k, 10.0), np.full(k, 10, np.int64), np.full(k, 5.0), np.full(k, 5.0))
        self._at = np.array([(*person.start, course_of(person)) for person in people], np.float64)
        self._velocity = np.zeros((k, 2))
        self._next = 0.0

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Walk on from `t` to `until` [s]; decide first where it is time to."""
        if t >= self._next - _SAME:
            self._next += DECIDES_EVERY
            wishes = Wishes(self._who, self._wished(), self.speed, self._sees)
            self._velocity = orca.velocities(self._bodies(t, scene), wishes, self._care, self._walls, DECIDES_EVERY)
            goes = np.hypot(*self._velocity.T) > STEPPING
            self._at[goes, 2] = np.arctan2(self._velocity[goes, 1], self._velocity[goes, 0])
        self._at[:, :2] += (until - t) * self._velocity
        return self._at.copy()

    def _wished(self) -> FloatArray:
        """(k, 2) the velocities at which they would walk alone, m/s."""
        to = self._goal - self._at[:, :2]
        away = np.hypot(*to.T)
        wanted: FloatArray = to * np.minimum(self.speed / np.maximum(away, 1e-12), 1.0 / SLOWING)[:, None]
        return wanted

    def _bodies(self, t: float, scene: Scene) -> Bodies:
        """Everything that moves at time `t` [s], as they see it; robots are behind the others, in a layer of their own."""
        m, robots = len(scene.moving), scene.robots
        n = m + len(robots)
        there = np.isfinite(scene.moving[:, :1])
        position, velocity, radius = np.empty((n, 2)), np.zeros((n, 2)), np.empty(n)
        position[:m] = np.where(there, scene.moving[:, :2], 1e6)
        velocity[:m] = np.nan_to_num((scene.moving[:, :2] - scene.before[:, :2]) / PERIOD)
        velocity[self._who] = self._velocity
        radius[:m] = self._radius
        for j, robot in enumerate(robots, start=m):
            glance(robot.track.knots, robot.track.count, t, 0.0, position[j], velocity[j])
            radius[j] = robot.shape.reach[0] + KEPT
        layer = np.where(np.arange(n) < m, 1, 2)
        return Bodies(position, velocity, radius, layer, np.full(n, 0.5))

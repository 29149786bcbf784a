"""People who stand, and may step aside."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import ABSENT, GLANCE, Cast, Scene
from clearway.world.behaviours.keeping_off import BESIDE
from clearway.world.behaviours.surroundings import step_of

_THERE = 1e-6  # m


class Still:
    """People who stand, each of whom may step aside for a robot that comes near: across its course, as far as there is room.

    The first time by half a metre at least, wherever it goes; afterwards again and again, where they stand in its way.

    Args:
        cast: Who they are.
    """

    ASIDE, PACE = 0.5, 0.5  # m, m/s

    def __init__(self, cast: Cast) -> None:
        self.members, self._cast = cast.members, cast
        self.speed = np.full(len(cast.people), self.PACE)
        self._at = np.array([(*person.start, 0.0) for person in cast.people])
        self._aside: list[FloatArray | None] = [None] * len(cast.people)

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They are there from time 0 on, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Stand, or step aside, from `t` to `until` [s]."""
        for k in range(len(self._at)):
            aside = self._aside[k]
            if aside is None or math.dist(self._at[k, :2], aside) <= _THERE:
                aside = self._aside[k] = self._steps_aside(k, t, scene)
            left = self._at[k, :2] - aside if aside is not None else ABSENT[:2]
            if math.hypot(*left) > _THERE:
                velocity = -left * min(self.PACE / math.hypot(*left), 1.0 / (until - t))
                step_of(self._cast, k, self._at[k], velocity, self.PACE, t, scene)
        return self._at.copy()

    def _steps_aside(self, k: int, t: float, scene: Scene) -> FloatArray | None:
        """(2,) where person `k` steps for a robot that comes near, or has stepped; None: there was no need."""
        spec, found = self._cast.people[k], self._aside[k]
        for robot in scene.robots if spec.yields_at is not None and spec.sees_robots else ():
            assert spec.yields_at is not None
            now, before = robot.track.at(t - spec.reaction), robot.track.at(t - spec.reaction - GLANCE)
            course, away = now[:2] - before[:2], self._at[k, :2] - now[:2]
            reach = float(robot.shape.reach[0]) + spec.radius
            if math.hypot(*away) - reach < spec.yields_at and float(course @ away) > 0.0:
                across = np.array((-course[1], course[0])) / math.hypot(*course)
                beside = float(across @ away)
                lacks = reach + BESIDE - abs(beside)
                if self._aside[k] is None or lacks > _THERE:
                    found = self._at[k, :2] + math.copysign(max(self.ASIDE, lacks), beside) * across
        return found

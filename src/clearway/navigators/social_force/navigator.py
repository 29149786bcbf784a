"""The navigator `social-force`: what drives and pushes a pedestrian, on a robot, on the way that the map gives.

Helbing, Molnár 1995 in the form of Moussaïd et al. 2009, 2010 (`clearway.crowds.social_force`). What moves acts as another
pedestrian does, what stands as a wall does. The base follows the velocity at which drive and forces are even.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.crowds.bodies import Wishes
from clearway.crowds.social_force import forces
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.crowd_navigator import CrowdNavigator
from clearway.navigators.common.route import Seen, with_others
from clearway.navigators.social_force.parameters import Parameters
from clearway.robots import DriveLimits


class SocialForceNavigator(CrowdNavigator[Parameters]):
    """Navigates by the social force model.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters = Parameters

    def _prepare(self, limits: DriveLimits, period: float) -> None:
        self._model = self._parameters.model()

    def _velocity(self, pose: FloatArray, velocity: FloatArray, others: Seen, wish: FloatArray) -> tuple[float, float]:
        vx, vy = wish + self._model.relaxation * self._force(pose, velocity, others, wish)
        speed, v_max = math.hypot(vx, vy), self._limits.v_max
        return (vx * v_max / speed, vy * v_max / speed) if speed > v_max else (vx, vy)

    def _force(self, pose: FloatArray, velocity: FloatArray, others: Seen, wish: FloatArray) -> FloatArray:
        """What acts on the robot, m/s^2."""
        moving = Seen(others.discs[others.moving], others.moving[others.moving])
        bodies = with_others(pose, velocity, self._radius, moving, 1.0)
        wishes = Wishes(np.zeros(1, np.int64), wish[None], np.full(1, self._limits.v_max), np.ones(1, np.int64))
        force = forces(bodies, wishes, np.full(len(bodies.radius), -1), self._model, self._walls)[0]
        standing = others.discs[~others.moving]
        if len(standing):
            nearest = standing[np.argmin(np.hypot(*(standing[:, :2] - pose[:2]).T) - standing[:, 4])]
            away = pose[:2] - nearest[:2]
            centres = max(float(np.hypot(*away)), 1e-9)
            gap = min(max(centres - nearest[4] - self._radius, -0.2), 10.0)
            force = force + self._model.wall_strength * math.exp(-gap / self._model.wall_span) * away / centres
        return np.asarray(force)

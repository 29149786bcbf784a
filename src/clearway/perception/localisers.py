"""The two localisers that estimate nothing: `truth` and `odometry`. They show what localisation costs."""

from __future__ import annotations

import numpy as np

from clearway.contract import Sensing, Task
from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray
from clearway.robots import Robot


class Truth:
    """Knows the true pose: what a perfect localisation would say."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def update(self, sensing: Sensing) -> FloatArray:
        """The true pose (3,), map frame."""
        return sensing.truth.copy()


class Odometry:
    """Dead reckoning from the place where the robot was put: it keeps the placement's error and drifts."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Begin at `task.start`."""
        self._start = np.asarray(task.start, dtype=np.float64)

    def update(self, sensing: Sensing) -> FloatArray:
        """The dead-reckoned pose (3,), moved into the map frame."""
        return compose(self._start, sensing.odom_pose)

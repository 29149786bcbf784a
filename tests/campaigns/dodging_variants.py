"""A navigator with ingredients and guarantees, for the tests of ablations: what it leaves out makes it worse."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Need, Observation, Task
from clearway.robots import Robot


class Tries:
    """Drives straight at the goal; with `waits` it stands while an obstacle is near and ahead; it doubts its luck."""

    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    INGREDIENTS: ClassVar[tuple[str, ...]] = ("waits", "speed")
    GUARANTEES: ClassVar[tuple[str, ...]] = ("passive", "none")

    def __init__(self, without: str = "", guarantee: str = "none") -> None:
        self._without, self._guarantee = without.split("+"), guarantee

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self._v = min(task.speed_limit, robot.drive.v_max) * (0.5 if "speed" in self._without else 1.0)

    def step(self, o: Observation) -> Command:
        assert o.obstacles is not None
        dx, dy = o.goal.pose[:2] - o.pose[:2]
        error = math.remainder(math.atan2(dy, dx) - o.pose[2], math.tau)
        v = self._v if abs(error) < 0.3 else 0.0
        for (x, y), radius in zip(o.obstacles.position - o.pose[:2], o.obstacles.radius, strict=True):
            near = math.hypot(x, y) - radius < 0.6
            ahead = abs(math.remainder(math.atan2(y, x) - o.pose[2], math.tau)) < 1.0
            if near and ahead and "waits" not in self._without:
                v = 0.0
        violated = ("obstacle 1: too near",) if v == 0.0 else ()
        return Command(v, max(-1.5, min(1.5, 3.0 * error)), violated=violated)


class Knows(Tries):
    """A reference: told the truth, of which it makes nothing."""

    privileged: ClassVar[bool] = True

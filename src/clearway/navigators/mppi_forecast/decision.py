"""One decision: sample about the last plan, judge, take the weighted mean."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.crowds.ways import Ways
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.mppi.functions import Floats
from clearway.navigators.common.mppi.noise import draw_noise
from clearway.navigators.common.mppi.weights import softmax, weighted_mean
from clearway.navigators.mppi_forecast.costs import Body, Floor, People, Weights, judge
from clearway.navigators.mppi_forecast.rollout import Drawn, keep_to, make_room, roll_out
from clearway.robots import DriveLimits


class Settings(NamedTuple):
    """What stays the same in a trial.

    Attributes:
        steps: T.
        batch: K, samples.
        hold: Steps between two points of the noise.
        period: Of control, s.
        temperature: lambda, s.
        ahead: How far along its way the sample that keeps to it heads, m.
        limits: Of the base.
        body: The robot.
        weights: What counts how much.
    """

    steps: int
    batch: int
    hold: int
    period: float
    temperature: float
    ahead: float
    limits: DriveLimits
    body: Body
    weights: Weights


class Sampler:
    """Model predictive path integral control.

    Args:
        settings: See there.
        key: Of the noise, 32 bits: the same key, the same decisions.

    Attributes:
        plan: (3, T) v, v_y [m/s] and omega [rad/s] in each step.
        samples: Those of the last decision.
        costs: (K,) theirs, s.
    """

    def __init__(self, settings: Settings, key: np.uint64) -> None:
        self._settings, self._key = settings, key
        steps, batch = settings.steps, settings.batch
        self.samples = make_room(steps, batch)
        self.costs: Floats = np.zeros(batch, np.float32)
        self.plan: Floats = np.zeros((3, steps), np.float32)
        self._go: Floats = np.zeros((3, steps), np.float32)
        points = (steps - 1) // settings.hold + 2
        self._drawn = Drawn(*(np.zeros((points, batch), np.float32) for _ in range(3)))
        self._spare: Floats = np.zeros((points, batch), np.float32)
        self._draws = 0

    def rest(self) -> None:
        """Forget the plan."""
        self.plan[:] = 0.0

    def decide(
        self, start: FloatArray, speed: FloatArray, people: People, ways: Ways, area: FloatArray, reach: float
    ) -> FloatArray:  # fmt: skip
        """The command (3,) v, v_y [m/s] and omega [rad/s] of this control period.

        Args:
            start: (3,) pose of the robot.
            speed: (3,) v, v_y, omega that it has.
            people: Who moves.
            ways: To its goal.
            area: (4,) that it keeps to, m.
            reach: Within which of the goal it is to come to rest, m.
        """
        s, dt, samples = self._settings, self._settings.weights.dt, self.samples
        share = np.float32(s.period / dt)  # (6): what was planned, from this period on
        self.plan[:, :-1] += share * (self.plan[:, 1:] - self.plan[:, :-1])
        keep_to(ways, s.ahead, start, s.limits, dt, self._go)
        self._draw()
        roll_out(samples, self._drawn, s.hold, self.plan, self._go, start, speed, s.limits, dt)
        floor = Floor(ways.room.clearance, ways.distance, ways.room.origin, ways.room.resolution, ways.goal, area)
        judge(samples, start, people, floor, s.body, s.weights._replace(reach=reach), self.costs)
        weights = softmax(self.costs, np.float32(s.temperature))  # (4)
        for axis, controls in enumerate((samples.cvx, samples.cvy, samples.cwz)):  # (5)
            weighted_mean(self.plan[axis], controls, weights)
        return self.plan[:, 0].astype(np.float64)

    def _draw(self) -> None:
        """Noise of the next decision (2)."""
        drawn, (v, v_y, omega) = self._drawn, self._settings.weights.deviation.tolist()
        draw_noise(drawn.v, drawn.omega, self._key, self._draws, v, omega)
        self._draws += 1
        if self._settings.limits.v_y_max > 0.0:
            draw_noise(drawn.v_y, self._spare, self._key, self._draws, v_y, 0.0)
            self._draws += 1

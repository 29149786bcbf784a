"""The navigator `oracle`: plans with the truth of the future, drives with feedback."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from clearway.clairvoyant.extremals import fastest
from clearway.clairvoyant.moving_discs import Scene
from clearway.clairvoyant.space_time import scene_of
from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Task
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.inputs import finite
from clearway.navigators.oracle.following import evade, foresee, on_way, steer
from clearway.robots import Robot
from clearway.tuning import TunedOn

MARGINS = (0.06, 0.03, 0.01, 0.0)
"""Kept from obstacles beyond the robot's radius, m: the largest that leaves a way."""

PACE = 0.98
"""Share of the top speed that a way is planned with: the rest makes good what disturbance and turning cost."""

DRIFT = 0.06
"""Off the way by more than this, m, a new one is sought."""

RENEW = 1.5
"""After this long a new one is sought anyway, s."""

RETRY = 1.0
"""After a search without result, s."""

_SAMPLE = 0.05  # s, of the forecast
_AHEAD = 20.0  # s, that a way may take at least; it is asked for twice that at a time
_DETOUR = 1.3  # times the straight way's time, that a way may take
_FAMILIES = 150  # so much is looked at in one search
_LOOK = 2.0  # s, that the drive is foreseen


class Oracle:
    """Knows where every obstacle will be (`Task.obstacle_oracle`), seeks the fastest way through space and time for a point at
    nearly full speed, and follows it; seeks again when it drifts off or foresees contact. It has no map: what isn't in
    the forecast doesn't exist for it.
    """

    needs: ClassVar[frozenset[Need]] = frozenset()
    privileged: ClassVar[bool] = True
    tuned_on: ClassVar[tuple[TunedOn, ...]] = ()

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """See `clearway.contract.Navigator`.

        Raises:
            ClearwayError: the task has no forecast.
        """
        if task.obstacle_oracle is None:
            raise ClearwayError(
                "the navigator 'oracle' needs Task.obstacle_oracle, the true future of the obstacles, and was given None; "
                "only a run in a simulated world can give it, to navigators with privileged = True",
                field="task.obstacle_oracle",
            )
        self._task, self._forecast = task, task.obstacle_oracle
        self._radius = circumscribed_radius(robot.shape)
        self._limits = robot.limits(task.speed_limit)
        self._approach = Approach(self._limits, task.period)
        self._way: FloatArray | None = None
        self._sought, self._since, self._searches = -math.inf, 0.0, 0
        self._ahead = _AHEAD
        self._scenes: list[Scene] = []
        self._pose = np.asarray(task.start, dtype=np.float64)
        self._status = ""

    def step(self, observation: Observation) -> Command:
        """See `clearway.contract.Navigator`.

        Raises:
            ValueError: the pose is not finite.
        """
        pose, goal, t = finite("pose", observation.pose), observation.goal, observation.t
        t += self._task.latency.sensing  # it plans on what is true now
        if self._approach.set_out(goal):
            self._way, self._sought, self._scenes = None, -math.inf, []
        self._pose = pose
        arrived = self._approach.reached(pose, observation.velocity)
        if self._approach.stopping:
            return self._turn(arrived)
        if not self._scenes or t > self._since + self._ahead:
            self._look_ahead(goal, t)
        command = self._follow(pose, t)
        if command is None:
            self._seek(pose, t)
            command = self._follow(pose, t)
        return command or self._evade(pose, t)

    def diagnostics(self) -> Diagnostics:
        """The way ahead, and the obstacles as they are planned with."""
        lines = {} if self._way is None else {"plan": np.ascontiguousarray(self._way[:, 1:])}
        return Diagnostics(polylines=lines, status=self._status, iterations=self._searches)

    def _turn(self, arrived: bool) -> Command:
        """At the goal: nothing but its heading is left."""
        most = self._limits.omega_max
        omega = min(max(self._approach.turn / 0.5, -most), most)
        return self._command(0.0, omega, "arrived" if arrived else "turning", arrived)

    def _follow(self, pose: FloatArray, t: float) -> Command | None:
        """The next command along the way; None if there is none, it is old, or it won't do any more."""
        way = self._way
        if way is None or not self._scenes:
            return None
        fresh = t - self._sought < 1e-9
        if not fresh and (t - self._sought > RENEW or t > way[-1, 0] + 0.5):
            return None
        x, y = on_way(way, t)
        if not fresh and math.hypot(x - pose[0], y - pose[1]) > DRIFT:
            return None
        v, omega = steer(way, t, pose[0], pose[1], pose[2], self._limits, self._task.period)
        _, contact = foresee(
            self._scenes[-1], way, t, pose, self._limits, self._task.period, _LOOK, np.array([v, omega]), 0.0
        )
        return None if contact < _LOOK else self._command(v, omega, "following")

    def _seek(self, pose: FloatArray, t: float) -> None:
        """A new way from here, with as much margin as there is room for."""
        if self._way is None and t - self._sought < RETRY:
            return
        self._sought, self._way = t, None
        for scene in self._scenes:
            self._searches += 1
            self._way = fastest(scene, pose[:2].copy(), t, t + self._ahead, _FAMILIES)
            if self._way is not None:
                return

    def _evade(self, pose: FloatArray, t: float) -> Command:
        way = self._way if self._way is not None else np.array([[t, pose[0], pose[1]]])
        v, omega = evade(self._scenes[-1], way, t, pose, self._limits, self._task.period)
        return self._command(v, omega, "evading" if self._way is not None else "no path")

    def _look_ahead(self, goal: Goal, t: float) -> None:
        """Ask for the next stretch of the future."""
        straight = math.dist(goal.pose[:2], self._pose[:2]) / (PACE * self._limits.v_max)
        self._since, self._ahead = t, max(_AHEAD, _DETOUR * straight)
        first = math.floor(t / _SAMPLE)
        count = round(2.0 * self._ahead / _SAMPLE) + 1
        samples = np.array([self._forecast((first + k) * _SAMPLE) for k in range(count)])
        samples = samples.reshape(len(samples), -1, 4)
        there = np.isfinite(samples).all(axis=2) & (samples[:, :, 3] > 0.5)
        at = np.where(there[:, :, None], samples[:, :, :2], np.nan)
        still = there.all(axis=0) & (
            np.abs(samples[:, :, :2] - samples[:1, :, :2]).max(axis=(0, 2), initial=0.0) < 1e-9
        )
        moves = there.any(axis=0) & ~still
        radius = np.nanmax(np.where(np.isfinite(samples[:, :, 2]), samples[:, :, 2], 0.0), axis=0)
        before = np.repeat(at[:1, moves], first, axis=0)  # the clock of a scene begins at 0; what was doesn't matter
        moving = np.concatenate([before, at[:, moves]])
        self._scenes = []
        for margin in MARGINS:
            grown = radius + self._radius + margin
            static = np.column_stack([samples[0, still, :2], grown[still]])
            self._scenes.append(
                scene_of(
                    goal.pose[:2], 0.3 * goal.xy_tolerance, PACE * self._limits.v_max, static, moving, grown[moves],
                    _SAMPLE, self._task.area,
                )
            )  # fmt: skip

    def _command(self, v: float, omega: float, status: str, arrived: bool = False) -> Command:
        self._status = status
        return Command(float(v), float(omega), arrived, status=status)

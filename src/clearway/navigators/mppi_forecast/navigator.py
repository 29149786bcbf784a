"""The navigator `mppi-forecast`: model predictive path integral control among forecasts of who moves.

G. Williams, P. Drews, B. Goldfain, J. M. Rehg, E. A. Theodorou, "Information-theoretic model predictive control: theory and
applications to autonomous driving", IEEE T-RO 34(6), 2018; with a probability of contact among several obstacles as its cost, as
in E. Trevisan, K. A. Mustafa, G. Notten, X. Wang, J. Alonso-Mora, "Dynamic risk-aware MPPI for mobile robots in crowds via
efficient Monte Carlo approximations", 2025 (arXiv 2506.21205). Numbers in brackets here and in its files are those of DECISIONS.md.

It is known to fail where the mean of good samples is none (somebody comes straight at it and left and right cost the same: it goes
in between) and where the way to the goal is not told by what it is given (a trap deeper than its horizon reaches); the tests of it show both.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Need, Observation, Obstacles, Status, Task
from clearway.forecasts.forecast import Forecast, later
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.footprint import Footprint, footprint
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.frame import OdometryFrame
from clearway.navigators.common.inputs import area_of, finite, own
from clearway.navigators.common.motion import braked, stop_and_turn
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.common.route import Route, seen, unmapped
from clearway.navigators.common.route import later as gone_on
from clearway.navigators.mppi_forecast.costs import Body, Weights, people_of
from clearway.navigators.mppi_forecast.decision import Sampler, Settings
from clearway.navigators.mppi_forecast.parameters import Parameters
from clearway.robots import DriveKind, DriveLimits, Robot, possible
from clearway.tuning import TunedOn

CLOSE, FACED = 0.25, 0.3
"""Shares of the goal's tolerances, of distance and heading, within which it comes to rest: the estimate errs."""

_APART = 0.15  # m, between two points of an outline


class MppiForecast(Parametrised[Parameters]):
    """Model predictive path integral control among forecasts of who moves.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"map", "obstacles"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        TunedOn("crowd", ("crowdnav-disc",), draws=range(300, 330), note="how sure forecasts are taken to be"),
        TunedOn("sar-case1", ("rescue",), draws=range(300, 322)),
        TunedOn("sar-case2", ("rescue",), draws=range(300, 310)),
        TunedOn("sar-case3", ("rescue",), draws=range(310, 322)),
        TunedOn("sar-stress", ("rescue",), draws=range(300, 322)),
    )

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial; `rng` gives the key of all noise."""
        p = self._p = self.read_parameters(robot)
        limits = self._limits = robot.limits(task.speed_limit)
        self._components = 3 if limits.kind == "omnidirectional" else 2
        foot = footprint(robot.planner_shape)
        stride = max(1, round(p.step / task.period))
        dt = stride * task.period
        steps = max(2, round(p.horizon / dt))
        self._settings = Settings(
            steps, p.samples, max(1, round(p.hold / dt)), task.period, p.temperature, p.ahead, limits,
            Body(foot, _rim(foot), limits.deceleration, limits.lateral_deceleration, limits.v_max),
            Weights(
                dt, p.contact_cost, p.discount, p.margin, p.soft, p.near, p.effort, p.reverse_cost, 0.0,
                _deviation(p, limits, foot),
            ),
        )  # fmt: skip
        self._sampler = Sampler(self._settings, np.uint64(rng.integers(2**32)))
        self._ahead = Ahead(task.latency, limits)
        self._expected = ForecastParameters(velocities=robot.camera is None, avoidance=p.avoidance)
        self._forecaster = Forecaster(self._expected, task.period, dt, steps + math.ceil(self._ahead.time / dt - 1e-9))
        self._drifts, self._base_link = robot.camera is None, robot.drive.base_link
        self._mapped, self._area = task.map is not None, area_of(task)
        self._route = Route(task, foot.circumscribed + p.margin, limits, p.ahead)
        self._approach = Approach(limits, task.period, CLOSE, FACED)
        self._shown = Diagnostics()

    def step(self, observation: Observation) -> Command:
        """Decide for one control period, for the time at which the command is followed.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        given, velocity = finite("pose", observation.pose), finite("velocity", observation.velocity, self._components)
        finite("goal.pose", observation.goal.pose)
        pose, velocity = self._ahead.state(observation.t, given, velocity)
        command = self._decide(observation, given, pose, velocity)
        self._ahead.decided(observation.t, velocity[:2], command.v, command.omega)
        return command

    def _decide(self, observation: Observation, given: FloatArray, pose: FloatArray, velocity: FloatArray) -> Command:
        """The command for a robot at `pose` with `velocity` when it follows it; now it is at `given`."""
        goal, settings = observation.goal, self._settings
        if self._approach.set_out(goal):
            self._sampler.rest()
        obstacles = unmapped(own(observation).obstacles, self._mapped)
        forecast = self._forecast(observation, given, obstacles)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            self._sampler.rest()
            return self._stop(velocity, arrived)
        others = gone_on(seen(obstacles, self._mapped), self._ahead.time)
        ways = self._route.ways(observation.t, pose, goal, others)
        people = people_of(forecast, self._p.own_spread, self._p.most_spread, settings.steps + 1)
        v, omega = velocity[:2].tolist()
        speed = np.array((v, velocity[2] if self._components > 2 else 0.0, omega))
        v, v_y, omega = self._sampler.decide(pose, speed, people, ways, self._area, CLOSE * goal.xy_tolerance).tolist()
        v, omega, v_y = possible(self._limits, v, omega, v_y)
        self._show(pose, obstacles, forecast)
        return Command(v, omega, arrived=False, status=Status.TRACKING, v_y=v_y)

    def _forecast(self, observation: Observation, given: FloatArray, obstacles: Obstacles) -> Forecast:
        """Who moves, from the time on at which the command is followed, in the map."""
        if not self._drifts:
            found, _ = self._forecaster.update(observation.t, obstacles)
        else:  # tracked where the robot's own place does not jump
            frame = OdometryFrame(given, self._base_link(finite("odom_pose", observation.odom_pose)))
            found, _ = self._forecaster.update(observation.t, frame.obstacles(obstacles))
            path = frame.back(found.path.reshape(-1, 2)).reshape(found.path.shape)
            found = found._replace(path=path)
        return later(found, self._ahead.time, self._expected.acceleration)

    def _stop(self, velocity: FloatArray, arrived: bool) -> Command:
        """Brake at the goal and turn to its heading on the spot."""
        limits, period = self._limits, self._settings.period
        v, omega = stop_and_turn(self._approach.turn, velocity[0], velocity[1], limits, period)
        v_y = 0.0
        if self._components > 2:
            v_y = braked(velocity[2], limits.lateral_deceleration, period)
            v, omega, v_y = possible(limits, v, omega, v_y)
        return Command(v, omega, arrived=arrived, status=self._approach.status, v_y=v_y)

    def _show(self, pose: FloatArray, obstacles: Obstacles, forecast: Forecast) -> None:
        samples = self._sampler.samples
        kept = np.column_stack((samples.x[:, 0], samples.y[:, 0])).astype(np.float64)
        best = int(self._sampler.costs.argmin())
        found = np.column_stack((samples.x[:, best], samples.y[:, best])).astype(np.float64)
        last = np.column_stack((forecast.path[:, 0, -1], forecast.radius))
        self._shown = Diagnostics(
            {"plan": np.vstack((pose[:2], kept)), "best sample": np.vstack((pose[:2], found))},
            {"obstacles": np.column_stack((obstacles.position, obstacles.radius)), "forecast": last},
            status=Status.TRACKING,
            iterations=len(self._sampler.costs),
        )

    def diagnostics(self) -> Diagnostics:
        """The last plan and the best of its samples, obstacles, and where those that move are expected at the horizon."""
        return self._shown


def _deviation(p: Parameters, limits: DriveLimits, foot: Footprint) -> FloatArray:
    """(3,) standard deviations of the noise; a disc that moves to all sides gains nothing by turning."""
    top, omega = p.noise * limits.v_max, min(p.noise_omega, limits.omega_max)
    if limits.v_y_max > 0.0 and len(foot.vertices) == 1 and not foot.vertices.any():
        omega = 1e-6
    return np.array((top, p.noise * max(limits.v_y_max, 1e-6), omega))


def _rim(foot: Footprint) -> FloatArray:
    """(k, 2) points along the outline, m."""
    corners = foot.vertices
    if len(corners) == 1:
        return corners
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        n = max(1, math.ceil(float(np.hypot(*(b - a))) / _APART))
        points += [a + k / n * (b - a) for k in range(n)]
    return np.array(points)

"""One decision of MPPI: sample about the last control sequence, judge, take the weighted mean, check, shift.

Behaviour after nav2_mppi_controller/src/optimizer.cpp and src/noise_generator.cpp (Williams et al., "Information-theoretic
model predictive control", T-RO 2018, is the method).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.mppi.functions import Floats
from clearway.navigators.common.mppi.noise import draw_noise
from clearway.navigators.common.mppi.samples import make_samples
from clearway.navigators.nav2.controllers.mppi.critics.goal import GoalAngleCritic, GoalCritic
from clearway.navigators.nav2.controllers.mppi.critics.obstacles import CostCritic, ObstaclesCritic
from clearway.navigators.nav2.controllers.mppi.critics.path import PathAlignCritic, PathAngleCritic, PathFollowCritic
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Critic, Rollouts
from clearway.navigators.nav2.controllers.mppi.critics.velocity import (
    ConstraintCritic,
    PreferForwardCritic,
    TwirlingCritic,
    VelocityDeadbandCritic,
)
from clearway.navigators.nav2.controllers.mppi.parameters import (
    CriticGroup,
    MPPIParameters,
    ValidatorParameters,
    turning_radius,
)
from clearway.navigators.nav2.controllers.mppi.rollout import (
    Delays,
    Limits,
    roll_out,
    trajectory_of,
)
from clearway.navigators.nav2.controllers.mppi.update import Update, hold_now, shift, update_controls
from clearway.navigators.nav2.controllers.mppi.validator import TrajectoryValidator
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import CostView, NoValidControl, Tolerances, Velocity

_SAME_PERIOD = 1e-6

_CRITICS: dict[str, Callable[..., Critic]] = {
    "ConstraintCritic": ConstraintCritic,
    "CostCritic": CostCritic,
    "GoalAngleCritic": GoalAngleCritic,
    "GoalCritic": GoalCritic,
    "ObstaclesCritic": ObstaclesCritic,
    "PathAlignCritic": PathAlignCritic,
    "PathAngleCritic": PathAngleCritic,
    "PathFollowCritic": PathFollowCritic,
    "PreferForwardCritic": PreferForwardCritic,
    "TwirlingCritic": TwirlingCritic,
    "VelocityDeadbandCritic": VelocityDeadbandCritic,
}


def make_critics(parameters: MPPIParameters, spaces: Mapping[str, Group]) -> tuple[Critic, ...]:
    """The critics that are enabled, in the order of the list."""
    made = []
    for name in parameters.critics:
        group = spaces[name]
        assert isinstance(group, CriticGroup)
        if group.enabled:
            made.append(_CRITICS[name](group, parameters))
    return tuple(made)


class Optimizer:
    """`mppi::Optimizer`."""

    def __init__(
        self, parameters: MPPIParameters, spaces: Mapping[str, Group], model: str, frequency: float, key: np.uint64
    ) -> None:
        """
        Args:
            parameters: The controller's.
            spaces: Those of the namespaces inside it, by name.
            model: Plug-in of the motion model.
            frequency: Of the controller server, Hz.
            key: Of its random numbers, 32 bits.

        Raises:
            ClearwayError: a control period is longer than a time step.
        """
        p = self._parameters = parameters
        self._period, self._dt = np.float32(1.0 / frequency), np.float32(p.model_dt)
        self._holonomic = model == "mppi::OmniMotionModel"
        self._radius = np.float32(turning_radius(p, spaces, model))
        shifts = _shifts(float(self._period), p.model_dt)
        stds = (p.vx_std, p.vy_std, p.wz_std)
        gamma = np.array([p.gamma / std**2 if std > 0.0 else 0.0 for std in stds], np.float32)
        self._update = Update(
            np.float32(p.temperature), gamma, self._dt, self._period, self._radius, p.sgf_order, shifts, self._holonomic
        )
        self._base = _limits(p)
        self._limits = self._base
        validator = spaces.get("TrajectoryValidator")
        self._validator = TrajectoryValidator(
            validator if isinstance(validator, ValidatorParameters) else ValidatorParameters(), self._dt, p.time_steps
        )
        self.critics = make_critics(p, spaces)
        self._key, self._draws = key, 0
        self.samples = make_samples(p.time_steps, p.batch_size)
        self.noise: tuple[Floats, Floats, Floats] = (
            np.zeros_like(self.samples.vx), np.zeros_like(self.samples.vx), np.zeros_like(self.samples.vx)
        )  # fmt: skip
        self.costs: Floats = np.zeros(p.batch_size, np.float32)
        late = [
            math.floor(float(np.float32(d) / self._dt) + 0.5)
            for d in (p.model_delay_vx, p.model_delay_vy, p.model_delay_wz)
        ]
        self._delays = Delays(np.array(late), np.zeros((3, max(1, *late)), np.float32))
        self.control: Floats = np.zeros((3, p.time_steps), np.float32)
        self._history: Floats = np.zeros((4, 3), np.float32)
        self._last: FloatArray = np.zeros(3)
        self._failures = 0
        self.trajectory: Floats = np.empty((0, 3), np.float32)
        self.reset()

    def reset(self) -> None:
        """Begin anew, standing; a speed limit stays."""
        self.control[:] = 0.0
        self._history[:] = 0.0
        self._delays.commands[:] = 0.0
        self._last = np.zeros(3)
        self.costs[:] = 0.0
        if not self._parameters.regenerate_noises:
            self._draw()

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """Scale all limits of speed to a limit in m/s or in per cent of the greatest; 0 takes it off."""
        base = self._base
        if limit == 0.0:
            self._limits = self._limits._replace(vx_max=base.vx_max, vx_min=base.vx_min, vy=base.vy, wz=base.wz)
            return
        ratio = limit / 100.0 if percentage else limit / float(base.vx_max)
        self._limits = self._limits._replace(
            vx_max=np.float32(base.vx_max * ratio),
            vx_min=np.float32(base.vx_min * ratio),
            vy=np.float32(base.vy * ratio),
            wz=np.float32(base.wz * ratio),
        )

    def decide(
        self, pose: FloatArray, velocity: Velocity, path: FloatArray, tolerances: Tolerances, view: CostView
    ) -> Velocity:
        """The command for one control period (evalControl); arguments as `Controller.compute` has them.

        Raises:
            NoValidControl: all samples collide, or what comes of them does, after all tries.
        """
        rollouts = Rollouts(self.samples, pose, path, tolerances, view, self._dt, self._holonomic, self._radius)
        start, speed = pose.astype(np.float32), self._speed(velocity)
        self.costs[:] = 0.0
        failed = False
        while True:
            for _ in range(self._parameters.iteration_count):
                failed = self._iterate(rollouts, start, speed, failed)
            self.trajectory = trajectory_of(self.control, start, self._dt, self._holonomic)
            if not failed and self._validator.clear(self.trajectory, view, rollouts.frame):
                break
            self.reset()
            self._failures += 1
            if self._failures > self._parameters.retry_attempt_limit:
                self._failures = 0
                raise NoValidControl("all samples collide" if failed else "the trajectory that comes out collides")
        self._failures = 0
        return self._send()

    def _iterate(self, rollouts: Rollouts, start: Floats, speed: Floats, failed: bool) -> bool:
        """One round of sampling and judging; whether all samples collide, or did before: then no critic is asked any more."""
        hold_now(self.control, speed, self._limits, self._update)
        if self._parameters.regenerate_noises:
            self._draw()
        roll_out(
            self.samples, self.noise, self.control, start, speed, self._limits, self._delays, self._dt, self._holonomic,
            self._parameters.clamp_raw_controls,
        )  # fmt: skip
        for critic in self.critics:
            if failed:
                break
            failed = critic.score(rollouts, self.costs)
        update_controls(self.control, self.costs, self._history, self.samples, speed, self._limits, self._update)
        return failed

    def _send(self) -> Velocity:
        sent = self.control[:, 1 if self._update.shift else 0].astype(np.float64)
        commands = self._delays.commands
        commands[:, :-1] = commands[:, 1:]
        commands[:, -1] = sent
        self._last = sent
        if self._update.shift:
            shift(self.control, self._holonomic)
        return Velocity(float(sent[0]), float(sent[1]) if self._holonomic else 0.0, float(sent[2]))

    def _speed(self, velocity: Velocity) -> Floats:
        """(3,) float32, the velocity at which the command begins to act: on the way from the measured to the last command."""
        if self._parameters.open_loop:
            return self._last.astype(np.float32)
        measured, limits, dt = np.array(velocity, float), self._limits, float(self._period)
        low = measured + dt * np.array([limits.ax_min, limits.ay_min, -limits.az_max], float)
        high = measured + dt * np.array([limits.ax_max, limits.ay_max, limits.az_max], float)
        speed = np.minimum(np.maximum(self._last, low), high)
        if not self._holonomic:
            speed[1] = 0.0
        return speed.astype(np.float32)

    def _draw(self) -> None:
        p, (vx, vy, wz) = self._parameters, self.noise
        draw_noise(vx, wz, self._key, self._draws, p.vx_std, p.wz_std)
        self._draws += 1
        if self._holonomic:
            draw_noise(vy, self.samples.vy, self._key, self._draws, p.vy_std, 0.0)
            self._draws += 1


def _limits(p: MPPIParameters) -> Limits:
    values = (p.vx_max, p.vx_min, p.vy_max, p.wz_max, abs(p.ax_max), -abs(p.ax_min), p.ay_max, -abs(p.ay_min), p.az_max)
    return Limits(*(np.float32(v) for v in values))


def _shifts(period: float, dt: float) -> bool:
    """Whether a control period is a time step, so that the sequence moves on by one each time (setOffset).

    Raises:
        ClearwayError: it is longer.
    """
    step = float(np.float32(dt))
    if period + _SAME_PERIOD < step:
        return False
    if abs(period - step) < _SAME_PERIOD:
        return True
    raise ClearwayError(
        f"is {dt:g} s, shorter than a control period of {period:g} s (one over controller_frequency), which Nav2 refuses; "
        "make it as long, or longer",
        field="model_dt",
    )

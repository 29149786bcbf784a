"""The navigator `hp-st`: forecast, search through space and time, track, certify; once per period."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Obstacles, Task
from clearway.forecasts.forecaster import Forecaster, PerfectForecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.footprint import footprint
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.certificate import Rules, Safety
from clearway.navigators.hp_st.decision import STATUSES, STOPPED, STORED, Memory, Settings, Thought, decide
from clearway.navigators.hp_st.field import Field, make_field
from clearway.navigators.hp_st.parameters import (
    GUARANTEES,
    INGREDIENTS,
    guarantee_from,
    ingredients_from,
    parameters_of,
)
from clearway.navigators.hp_st.search import Base, Wishes
from clearway.navigators.hp_st.tube import drive
from clearway.navigators.hp_st.violations import Watch
from clearway.robots import Robot

ARRIVAL, REACH = 0.7, 0.6
"""Shares of the goal's tolerance: it says that it has arrived within the first, and plans to come within the second."""

CONTROLS = np.array(
    [(1, 0), (1, 1), (1, -1), (1, 0.4), (1, -0.4), (0.5, 0), (0.5, 1), (0.5, -1), (0, 0), (0, 1), (0, -1),
     (-1, 0), (-1, 1), (-1, -1), (-0.5, 0)], dtype=np.float64,
)  # fmt: skip
"""What a step of the search tries, as shares of the limits of v and omega."""


class HpSt:
    """Heuristic plan through space and time, tracked by a tube MPC, with a certificate before each step.

    Args:
        guarantee: `passive`: only what is certified is driven, so that it never moves at a contact while the assumptions
        hold (docs/guarantee.md); `none`: best success. without: ingredients to leave out (INGREDIENTS), such as
        reverse+candidates. parameters: any field of `parameters.Parameters`.

    Raises:
        ClearwayError: an option that does not exist, or a parameter out of its range.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    privileged: ClassVar[bool] = False
    INGREDIENTS: ClassVar[tuple[str, ...]] = INGREDIENTS
    GUARANTEES: ClassVar[tuple[str, ...]] = GUARANTEES

    def __init__(self, guarantee: str = "passive", without: Collection[str] | str = (), **parameters: float) -> None:
        self._guarantee, self._without = guarantee_from(guarantee), ingredients_from(without)
        self._chosen = parameters
        parameters_of(None, **parameters)  # tells of a wrong one at once
        self._thought: Thought | None = None

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: a parameter in the robot's file is wrong.
        """
        p = parameters_of(robot, **self._chosen)
        d, without = robot.drive, self._without
        layers = p.short if "horizon" in without else p.layers
        stride = max(1, round(p.step / task.period))
        periods = layers * stride
        top = min(d.v_max, task.speed_limit)
        low = max(d.v_min, -task.speed_limit) if p.reverse and "reverse" not in without else 0.0
        rates = np.array((d.acceleration, d.deceleration, d.angular_acceleration, d.angular_deceleration))
        self._p, self._period = p, task.period
        self._base = Base(low, top, d.omega_max, rates, footprint(robot.shape))
        self._settings = Settings(
            period=task.period, periods=periods, layers=layers, narrow=p.narrow, wide=p.wide, calm=p.calm,
            controls=CONTROLS if low < 0.0 else CONTROLS[:11].copy(),
            candidates=1 if "candidates" in without else p.candidates, apart=p.apart, keep=p.keep, rounds=p.rounds,
            effort=p.effort, heading_weight=p.heading_weight,
            spread=np.array((p.own_spread, p.own_growth, p.most_spread)),
            certified=self._guarantee == "passive" and "certificate" not in without, to_go="time-to-go" not in without,
        )  # fmt: skip
        self._wishes = Wishes(
            stride * task.period, stride, p.fear, p.fade, p.margin, p.soft, p.near, p.swing, p.back, 0.1,
            0 if "time-aware" not in without else periods,
        )  # fmt: skip
        self._area = np.array(task.area or (-math.inf, -math.inf, math.inf, math.inf), np.float64)
        disturbance = np.array(
            (p.disturbance_position, p.disturbance_heading, p.disturbance_velocity, p.disturbance_turn,
             float(p.disturbed_at_rest))
        )  # fmt: skip
        start = np.array((p.pose_error, p.pose_error, p.heading_error))
        limits = np.array((low, top, *rates[:2], d.omega_max, *rates[2:]))
        sees = (
            robot.camera.range
            if robot.camera
            else min(robot.lidar.range_max, p.scan_range)
            if robot.lidar
            else math.inf
        )
        self._rules = Rules(p.obstacle_acceleration, self._area, float(sees), p.unseen_speed)
        self._safety = Safety(limits, task.period, disturbance, start)
        self._watch = Watch(limits, task.period, disturbance, start)
        known = ForecastParameters(
            speed=p.obstacle_speed, acceleration=p.obstacle_acceleration, memory=p.memory,
            constant_velocity_only="forecast" in without, velocities=robot.camera is None,
        )  # fmt: skip
        self._forecaster = self._make_forecaster(task, known, periods)
        self._memory = Memory(np.zeros((periods, 2)), np.zeros(2), np.zeros(2))
        self._goal: Goal | None = None
        self._field: Field | None = None
        self._known = b""
        self._thought, self._forecast = None, None
        self._stored: tuple[Thought, int] | None = None

    def _make_forecaster(
        self, task: Task, parameters: ForecastParameters, count: int
    ) -> Forecaster | PerfectForecaster:
        return Forecaster(parameters, task.period, task.period, count)

    def step(self, observation: Observation) -> Command:
        """Decide for one control period.

        Raises:
            ValueError: the pose or the goal is not finite.
        """
        pose, goal = _finite("pose", observation.pose), _finite("goal.pose", observation.goal.pose)
        memory, seen = self._memory, observation.obstacles
        if observation.goal is not self._goal:
            self._goal = observation.goal
            memory.age[1] = 0.0
        violated = self._watch.seen(observation.t, pose, observation.velocity)
        self._forecast, more = self._forecaster.update(observation.t, _NOTHING if seen is None else seen)
        self._see(goal, pose)
        assert self._field is not None
        wishes = self._wishes._replace(reach=REACH * observation.goal.xy_tolerance)
        thought = self._thought = decide(
            self._settings, self._base, memory, self._forecast, self._field, self._area, wishes, self._rules,
            self._safety, pose,
        )  # fmt: skip
        v, omega = self._commit(thought, pose)
        self._watch.told(observation.t, pose, v, omega)
        arrived = math.hypot(pose[0] - goal[0], pose[1] - goal[1]) <= ARRIVAL * observation.goal.xy_tolerance
        return Command(v, omega, arrived, status=STATUSES[thought.status], violated=violated + more)

    def _commit(self, thought: Thought, pose: FloatArray) -> tuple[float, float]:
        """The command of this period, and what is remembered for the next."""
        memory = self._memory
        if thought.status in (STORED, STOPPED):
            v, omega = self._remainder(pose)
            memory.age[1] = 0.0
        else:
            v, omega = thought.commands[0].tolist()
            if self._settings.certified:
                self._stored = thought, 1
            memory.plan[:-1] = thought.commands[1:]
            memory.plan[-1] = thought.commands[-1]
            memory.age[1] = 1.0
        moved = memory.velocity.any() or v != 0.0 or omega != 0.0
        memory.age[0] = 0.0 if moved else memory.age[0] + 1.0
        plan = drive(np.concatenate((pose, memory.velocity)), np.array([[v, omega]]), self._safety.limits, self._period)
        memory.velocity[:] = plan.velocities[1]
        return v, omega

    def _remainder(self, pose: FloatArray) -> tuple[float, float]:
        """The next command of the last certified plan, which ends at rest; rest, if there is none left."""
        if self._stored is None:
            return 0.0, 0.0
        thought, k = self._stored
        plan = thought.stored
        if k >= len(plan.commands):
            return 0.0, 0.0
        self._stored = thought, k + 1
        off = pose - plan.states[k]
        off[2] = math.remainder(off[2], 2.0 * math.pi)
        v, omega = (plan.commands[k] + thought.tube.gains[k] @ off).tolist()
        return v, omega

    def _see(self, goal: FloatArray, pose: FloatArray) -> None:
        """Distances to the goal, anew where what stands or the goal has changed."""
        assert self._forecast is not None
        still = self._forecast.still
        area = self._area
        if not np.isfinite(area).all():
            low, high = np.minimum(pose[:2], goal[:2]) - 4.0, np.maximum(pose[:2], goal[:2]) + 4.0
            area = np.array((*np.floor(low), *np.ceil(high)))
        key = still.tobytes() + goal.tobytes() + area.tobytes()
        if key != self._known:
            discs = still.copy()
            discs[:, 2] += self._base.foot.circumscribed + self._p.margin
            self._field, self._known = make_field(goal, discs, area), key

    def diagnostics(self) -> Diagnostics:
        """Polylines `plan`, `way 1`, ...; circles `obstacles`; the tube along the certified plan."""
        return Diagnostics()


class HpStForesight(HpSt):
    """HP-ST with perfect forecasts of what it has seen: a reference, told the truth."""

    privileged: ClassVar[bool] = True

    def _make_forecaster(
        self, task: Task, parameters: ForecastParameters, count: int
    ) -> Forecaster | PerfectForecaster:
        assert task.forecast is not None
        return PerfectForecaster(parameters, task.forecast, task.period, count)


_NOTHING = Obstacles(
    np.zeros((0, 2)),
    np.zeros((0, 2)),
    np.zeros(0),
    np.zeros(0),
    np.zeros(0),
    np.zeros(0, np.int64),
    np.zeros(0, np.bool_),
)


def _finite(name: str, pose: FloatArray) -> FloatArray:
    pose = np.array(pose, dtype=np.float64)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ValueError(f"the observation's {name} is {pose.tolist()}; three finite numbers (m, m, rad) are needed")
    return pose

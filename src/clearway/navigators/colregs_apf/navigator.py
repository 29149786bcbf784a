"""COLREGS APF: artificial potential fields that keep the rules of the road at sea (Lyu & Yin 2019), as paper B's rival.

Each control period: who has to do what (`encounters`), the force along a predicted course (`force`), and a command
along its mean. No search and no budget: it takes what it takes, well under a millisecond.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

import numpy as np

from clearway.contract import Command, Diagnostics, Need, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.colregs_apf.encounters import CLEAR, WORDS, IntArray, follow
from clearway.navigators.colregs_apf.force import Pace, course, levels, roll_out, situation, steer
from clearway.navigators.colregs_apf.parameters import Parameters
from clearway.navigators.colregs_apf.retuned import recall
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.inputs import area_of, finite, own
from clearway.navigators.common.parametrised import Parametrised
from clearway.robots import Robot
from clearway.tuning import TunedOn

STATUS = (*WORDS, "emergency")
FIELD_CELLS, FIELD_SIZE = 60, 9.0
"""The potential that diagnostics show: cells a side, and how wide, m."""
SHOWN_STEPS = 40
"""How many periods of following the force diagnostics show."""


_CASES = ("sar-case1", "sar-case2")
_FIXED = tuple(TunedOn(suite, ("rescue",), draws=range(10_000, 10_050), note="gains") for suite in _CASES)
_RETUNED = tuple(TunedOn(suite, ("rescue",), seeds=(0,), note="gains of each scenario's own") for suite in _CASES)


class ColregsApf(Parametrised[Parameters]):
    """Navigates by COLREGS-constrained artificial potential fields.

    Args:
        gains: `fixed`, those in `stand_ins.toml` (or the robot's file), chosen once on other scenarios; `retuned`,
            those found for the very scenario where there are some (`sar-case1`, `sar-case2`), as paper B did by hand,
            else `fixed`.
        options: Any field of `Parameters`, which overrides the robot's file and the stand-ins.

    Attributes:
        tuned_on: On what the gains were chosen; of retuned ones this is another.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})

    def __init__(self, gains: Literal["fixed", "retuned"] = "fixed", **options: Any) -> None:
        if gains not in ("fixed", "retuned"):
            raise ClearwayError(f"{gains!r} is wrong: 'fixed' or 'retuned'", field="gains")
        self._retuned = gains == "retuned"
        self.tuned_on = (*_RETUNED, *_FIXED) if self._retuned else _FIXED
        super().__init__(**options)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything. Nothing is drawn from `rng`."""
        self._robot, self._parameters = robot, self.read_parameters(robot)
        self._gains = self._parameters.gains()
        self._radius = circumscribed_radius(robot.shape)
        limits = robot.limits(min(self._parameters.speed or math.inf, task.speed_limit))
        self._pace = Pace(limits, self._parameters.turn_gain, task.period)
        self._area = area_of(task)
        self._unrecognised = self._retuned
        self._encounters = (np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
        self._approach = Approach(limits, task.period)
        self._seen: Observation | None = None

    def step(self, observation: Observation) -> Command:
        """Decide for one control period.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        pose, velocity = finite("pose", observation.pose), finite("velocity", observation.velocity, 2)
        goal = observation.goal
        self._aim = finite("goal.pose", goal.pose)[:2]
        self._seen = observation = own(observation)
        self._look(observation)
        code = situation(pose, self._discs, self._kinds, self._radius, self._gains.d_safe)
        self._approach.set_out(goal)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            direction = pose[2] + self._approach.turn
            v, omega = steer(direction, pose[2], velocity[0], velocity[1], 0.0, self._pace)
            return Command(v, omega, arrived=arrived, status=STATUS[code])
        _, mean = self._predict(self._parameters.horizon)
        if not mean.any():
            return Command(0.0, 0.0, arrived=False, status=STATUS[code])
        direction = course(
            pose, mean, self._discs, self._kinds, self._sides, self._radius, self._gains, self._pace.limits.v_max
        )
        d_g = math.hypot(self._aim[0] - pose[0], self._aim[1] - pose[1])
        v, omega = steer(direction, pose[2], velocity[0], velocity[1], d_g, self._pace)
        return Command(v, omega, arrived=False, status=STATUS[code])

    def diagnostics(self) -> Diagnostics:
        """The potential around the robot, where the force leads, and whom it meets."""
        o = self._seen
        if o is None:
            return Diagnostics()
        path, _ = self._predict(SHOWN_STEPS)
        moving = self._discs[:, 5] != 0.0
        near = self._radius + self._discs[:, 4] + self._gains.d_safe
        rings = np.column_stack((self._discs[:, :2], near))
        met = rings[self._kinds != CLEAR] + (0.0, 0.0, self._gains.rho_0)
        code = situation(o.pose, self._discs, self._kinds, self._radius, self._gains.d_safe)
        return Diagnostics(
            polylines={"plan": path[:, :2].copy()},
            circles={"emergency": rings[moving], "risk": met},
            field=self._field(o),
            status=STATUS[code],
        )

    def _look(self, observation: Observation) -> None:
        """Take in the obstacles and follow the encounters with those that move."""
        discs, identity = _discs(observation.obstacles)
        if self._unrecognised and len(discs) and observation.obstacles is not None:
            self._unrecognised = False
            tuned = recall(observation.obstacles) or {}
            self._gains = Parameters.read(self._robot, **(self._options | tuned)).gains()
        self._discs = discs
        targets = discs.copy()
        targets[:, 4] += self._radius + self._gains.d_safe
        self._kinds, self._sides = follow(
            observation.pose, observation.velocity, targets, identity, self._gains.rho_0, *self._encounters
        )
        on = self._kinds != CLEAR
        self._encounters = (identity[on], self._kinds[on], self._sides[on])

    def _predict(self, steps: int) -> tuple[FloatArray, FloatArray]:
        assert self._seen is not None
        o = self._seen
        return roll_out(
            o.pose, o.velocity, self._aim, self._discs, self._kinds, self._sides, self._area, self._radius,
            self._gains, self._pace, steps, self._parameters.w1,
        )  # fmt: skip

    def _field(self, o: Observation) -> OccupancyGrid:
        """The potential, 0 at its least to 100 at three times the attraction's range over what is shown."""
        resolution = FIELD_SIZE / FIELD_CELLS
        corner = o.pose[:2] - 0.5 * FIELD_SIZE
        heading = np.array((math.cos(o.pose[2]), math.sin(o.pose[2])))
        vx, vy = o.velocity[0] * heading
        values = levels(
            corner, resolution, FIELD_CELLS, vx, vy, self._aim, self._discs, self._kinds, self._sides,
            self._area, self._radius, self._gains,
        )  # fmt: skip
        top = 3.0 * self._gains.epsilon * min(self._gains.goal_cap, FIELD_SIZE) * FIELD_SIZE
        shown = np.clip(100.0 * (values - values.min()) / top, 0.0, 100.0)
        return OccupancyGrid(shown.astype(np.int8), resolution, (float(corner[0]), float(corner[1])))


class RetunedColregsApf(ColregsApf):
    """`ColregsApf(gains="retuned")` under a name of its own, so that both can run in one campaign."""

    def __init__(self) -> None:
        super().__init__("retuned")


def _discs(obstacles: Obstacles | None) -> tuple[FloatArray, IntArray]:
    """(n, 6) x, y, vx, vy, radius with its error, whether it moves; and identities. What isn't finite is left out."""
    if obstacles is None or not len(obstacles):
        return np.empty((0, 6)), np.empty(0, np.int64)
    discs = np.column_stack(
        (
            obstacles.position,
            np.nan_to_num(obstacles.velocity, nan=0.0, posinf=0.0, neginf=0.0),
            obstacles.radius + np.nan_to_num(obstacles.error, nan=0.0, posinf=0.0),
            obstacles.moving,
        )
    ).astype(np.float64)
    good = np.isfinite(discs).all(1)
    return np.ascontiguousarray(discs[good]), np.ascontiguousarray(obstacles.identity[good])

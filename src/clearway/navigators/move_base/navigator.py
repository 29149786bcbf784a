"""move_base: the node that ties costmaps, global planner, local planner and recoveries together.

    PLANNING --plan--> CONTROLLING --goal reached--> arrived
        ^   \\             |  no command: replan; none for controller_patience, or oscillating: v
        |    `--no plan for planner_patience--> CLEARING --all recoveries tried--> gave up
        `-------------------- next recovery -------'

In ROS the planner has a thread of its own. Here it runs at the end of a control period, so that the controller gets
a plan one period after it was asked for. Behaviour read from ros-planning/navigation, move_base/src/move_base.cpp.
"""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Task
from clearway.errors import unknown
from clearway.geometry.frames import compose, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.costmap import Costmap, refuse_without_map
from clearway.navigators.common.costmaps.plans import local_plan, to_frame
from clearway.navigators.common.inputs import finite, own
from clearway.navigators.common.rates import EARLY, Rate
from clearway.navigators.move_base.parameters import ClearCostmapRecovery, Parameters
from clearway.navigators.move_base.planners import make_global_planner, make_local_planner
from clearway.navigators.move_base.recovery import Rotation, clear_costmap, recovery_behaviors
from clearway.navigators.move_base.ros import read as read_ros
from clearway.navigators.move_base.ros import yaml_files
from clearway.robots import DriveKind, Robot, possible
from clearway.tuning import TunedOn

LOCAL_PLANNERS = ("base_local_planner/TrajectoryPlannerROS", "dwa_local_planner/DWAPlannerROS")

_SLIP = 1e-3
"""s by which each period of the planner's thread is longer than asked for (waking up). Without it a planner at the
controller's rate would hand over a plan in every control period, and ROS's TrajectoryPlannerROS, which forgets that it
has arrived whenever a plan comes, would never arrive."""

_ORIGIN = np.zeros(3)
_NOWHERE: FloatArray = np.empty((0, 3))


class State(StrEnum):
    """move_base's state."""

    PLANNING = "planning"
    CONTROLLING = "controlling"
    CLEARING = "clearing"


class Trigger(StrEnum):
    """What led to recovery."""

    PLANNING = "Failed to find a valid plan. Even after executing recovery behaviors."
    CONTROLLING = "Failed to find a valid control. Even after executing recovery behaviors."
    OSCILLATION = "Robot is oscillating. Even after executing recovery behaviors."


class MoveBase:
    """ROS 1's move_base, with parameters from the robot's file (`[navigators.move-base]`), or from its own ROS package.

    Args:
        base_local_planner: Overrides the file's, by its ROS name or the part behind the slash.
        params: Folder of the robot's own ROS 1 files (`costmap_common_params.yaml`, `dwa_local_planner_params.yaml`, ...), or several
            folders and files joined by `+`; nothing of the robot's file then holds, and where they are silent ROS's defaults do.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"map", "scan"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        TunedOn("barn", ("jackal",), draws=range(0), note="how meter_scoring is read; all else is the vendors'"),
    )

    def __init__(self, base_local_planner: str | None = None, params: str | None = None) -> None:
        names = {name.rpartition("/")[2]: name for name in LOCAL_PLANNERS} | {name: name for name in LOCAL_PLANNERS}
        if base_local_planner is not None and base_local_planner not in names:
            raise unknown("local planner", base_local_planner, names)
        self._local_name = None if base_local_planner is None else names[base_local_planner]
        self._place = None if params is None else str(params)

    @classmethod
    def files(cls, params: str | None = None, **_: object) -> tuple[Path, ...]:
        """The user's files whose content decides what it does: all that may be read, whichever robot drives."""
        return () if params is None else yaml_files(str(params))

    def read_parameters(self, robot: Robot) -> Parameters:
        """What it would drive `robot` with.

        Raises:
            ClearwayError: One of them is wrong.
        """
        return Parameters.read(robot) if self._place is None else read_ros(self._place, robot.name)

    def check_without_map(self, robot: Robot) -> None:
        """
        Raises:
            ClearwayError: A costmap with which it would drive `robot` has a static layer.
        """
        p = self.read_parameters(robot)
        refuse_without_map(p.global_costmap, "global_costmap")
        refuse_without_map(p.local_costmap, "local_costmap")

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: a parameter in the robot's file is wrong, or a static layer has no map.
        """
        self._parameters = p = self.read_parameters(robot)
        self._settings = s = p.move_base
        shape = robot.planner_shape
        self._global = Costmap(p.global_costmap, p.global_costmap.outline(shape), task.map, "global_costmap")
        self._local = Costmap(p.local_costmap, p.local_costmap.outline(shape), task.map, "local_costmap")
        self._global_rate, self._local_rate = (
            Rate(p.global_costmap.update_frequency),
            Rate(p.local_costmap.update_frequency),
        )
        self._control_rate = Rate(s.controller_frequency)
        self._planner = make_global_planner(p)
        self._controller = make_local_planner(p, self._local.footprint, self._local_name, robot.limits().v_y_max > 0.0)
        self._controller.reset()
        self._behaviors = recovery_behaviors(s)
        self._speed_limit = task.speed_limit
        self._limits = robot.limits(task.speed_limit)
        self._goal: Goal | None = None
        self._active = False
        self._plan = self._latest = _NOWHERE  # in the global costmap's frame
        self._begin = 0
        self._new_plan = False
        self._trajectory: FloatArray = np.empty((0, 2))
        self._oscillation_pose = np.zeros(2)
        self._last_plan = self._last_control = self._last_progress = 0.0
        self._retries = 0
        self._run_planner = self._woken = False
        self._next_plan = -math.inf
        self._state, self._trigger = State.PLANNING, Trigger.PLANNING
        self._recovery = 0
        self._rotation: Rotation | None = None
        self._v = self._omega = self._v_y = 0.0  # as last published: the base holds it until the next
        self._arrived = False
        self._gave_up: str | None = None
        self._status = ""

    def step(self, observation: Observation) -> Command:
        """Decide for one control period."""
        o = own(observation)
        self._odom = compose(o.pose, relative(o.odom_pose, _ORIGIN))  # pose of the odom frame in the map
        self._map = relative(self._odom, _ORIGIN)  # pose of the map frame in the odom frame
        self._sense(o)
        if o.goal is not self._goal:
            self._accept(o)
        if self._active and self._control_rate.due(o.t):
            self._execute(o)
        if self._active:
            self._think(o)
        limits = self._limits
        v = min(max(self._v, limits.v_min), limits.v_max)
        omega = min(max(self._omega, -limits.omega_max), limits.omega_max)
        if limits.v_y_max > 0.0:
            v, omega, v_y = possible(limits, self._v, self._omega, self._v_y)
            return Command(v, omega, arrived=self._arrived, gave_up=self._gave_up, v_y=v_y)
        return Command(v, omega, arrived=self._arrived, gave_up=self._gave_up)

    def diagnostics(self) -> Diagnostics:
        """The global and the local plan, and what it is doing."""
        polylines: dict[str, FloatArray] = {}
        if self._goal is not None:
            plan = self._plan[self._begin :, :2]
            polylines["global plan"] = plan if self._frame_of(self._global) == "map" else to_frame(plan, self._odom)
            local = self._trajectory
            polylines["local plan"] = local if self._frame_of(self._local) == "map" else to_frame(local, self._odom)
        return Diagnostics(polylines=polylines, status=self._status)

    @staticmethod
    def _frame_of(costmap: Costmap) -> str:
        return costmap.parameters.global_frame

    def _pose_in(self, costmap: Costmap, o: Observation) -> FloatArray:
        return o.pose if self._frame_of(costmap) == "map" else o.odom_pose

    def _sense(self, o: Observation) -> None:
        """Bring the costmaps up to date, each at its own rate."""
        for costmap, rate in ((self._local, self._local_rate), (self._global, self._global_rate)):
            due = rate.due(o.t)
            pose = self._pose_in(costmap, o)
            if o.scan is not None and (due or costmap.keeps_scans):
                costmap.buffer(o.t, o.scan, pose)
            if due:
                costmap.update(pose, _ORIGIN if self._frame_of(costmap) == "map" else self._odom)

    def _accept(self, o: Observation) -> None:
        """A new goal: plan at once; the costmaps stay."""
        self._goal = o.goal
        goal = finite("goal.pose", o.goal.pose)
        self._goal_pose = goal if self._frame_of(self._global) == "map" else compose(self._map, goal)
        if not self._active:
            self._stop()
        self._active, self._arrived, self._gave_up = True, False, None
        self._recovery, self._state, self._rotation = 0, State.PLANNING, None
        self._run_planner = self._woken = True
        self._last_control = self._last_plan = self._last_progress = o.t
        self._retries = 0

    def _execute(self, o: Observation) -> None:
        """One control cycle (MoveBase::executeCycle)."""
        s = self._settings
        position = self._pose_in(self._global, o)[:2]
        if self._rotation is not None:
            self._rotate(o)
            return
        if math.hypot(*(position - self._oscillation_pose)) >= s.oscillation_distance:
            self._last_progress, self._oscillation_pose = o.t, position.copy()
            if self._trigger is Trigger.OSCILLATION:
                self._recovery = 0
        if self._new_plan:
            self._new_plan = False
            self._plan, self._begin = self._latest, 0
            self._controller.set_plan()
            if self._trigger is Trigger.PLANNING:
                self._recovery = 0
        self._status = self._state.value
        match self._state:
            case State.PLANNING:
                self._run_planner = self._woken = True
            case State.CONTROLLING:
                self._control(o)
            case State.CLEARING:
                self._recover(o)

    def _control(self, o: Observation) -> None:
        s = self._settings
        same = self._frame_of(self._global) == self._frame_of(self._local)
        frame = _ORIGIN if same else self._map if self._frame_of(self._global) == "map" else self._odom
        pose = self._pose_in(self._local, o)
        goal = compose(frame, self._plan[-1])
        if self._controller.goal_reached(pose, o.velocity, goal):
            self._end(arrived=True)
            return
        if s.oscillation_timeout > 0 and self._last_progress + s.oscillation_timeout < o.t - EARLY:
            self._stop()
            self._state, self._trigger = State.CLEARING, Trigger.OSCILLATION
        costmap = self._local
        reach = max(costmap.cost.shape) * costmap.resolution / 2
        plan, self._begin = local_plan(
            self._plan, self._begin, self._pose_in(self._global, o), frame, reach, self._controller.prune_plan
        )
        if len(plan):
            result = self._controller.compute(
                pose, o.velocity, plan, goal, costmap.cost, costmap.origin, costmap.resolution, self._speed_limit
            )
            if result.ok:
                self._last_control = o.t
                self._v, self._omega, self._v_y = result.v, result.omega, result.v_y
                self._trajectory = result.trajectory
                if self._trigger is Trigger.CONTROLLING:
                    self._recovery = 0
                return
        self._stop()
        if o.t > self._last_control + s.controller_patience + EARLY:
            self._state, self._trigger = State.CLEARING, Trigger.CONTROLLING
        else:
            self._last_plan, self._retries = o.t, 0
            self._state = State.PLANNING
            self._run_planner = self._woken = True

    def _recover(self, o: Observation) -> None:
        """Start the next recovery, or give up."""
        if not self._settings.recovery_behavior_enabled or self._recovery >= len(self._behaviors):
            self._end(gave_up=self._trigger.value)
            return
        behavior = self._behaviors[self._recovery]
        self._status = f"recovery: {behavior.name}"
        if not isinstance(behavior, ClearCostmapRecovery):
            self._rotation = Rotation(behavior, self._parameters, float(self._pose_in(self._local, o)[2]))
            self._rotate(o)
            return
        maps = {"both": (self._global, self._local), "global": (self._global,), "local": (self._local,)}
        for costmap in maps[behavior.affected_maps]:
            pose = self._pose_in(costmap, o)
            if clear_costmap(behavior, costmap, pose[0], pose[1]) and behavior.force_updating:
                costmap.update(pose, _ORIGIN if self._frame_of(costmap) == "map" else self._odom)
        self._recovered(o)

    def _rotate(self, o: Observation) -> None:
        assert self._rotation is not None
        rate = self._rotation.step(self._pose_in(self._local, o), self._local)
        if rate is None:
            self._rotation = None
            self._recovered(o)
        else:
            self._v, self._omega, self._v_y = 0.0, rate, 0.0

    def _recovered(self, o: Observation) -> None:
        """After a recovery: try to plan again."""
        self._last_progress = self._last_plan = o.t
        self._retries = 0
        self._state = State.PLANNING
        self._recovery += 1

    def _think(self, o: Observation) -> None:
        """The planner's thread: plan if it is due or was woken."""
        s = self._settings
        if not self._run_planner or not (s.planner_frequency <= 0 or self._woken or o.t >= self._next_plan - EARLY):
            return
        period = 1.0 / s.planner_frequency if s.planner_frequency > 0 else 0.0
        start = o.t if self._woken or o.t - self._next_plan > period else self._next_plan
        self._woken = False
        plan = self._planner.plan(self._global, self._pose_in(self._global, o), self._goal_pose)
        if plan is not None:
            self._latest, self._new_plan = plan, True
            self._last_plan, self._retries = o.t, 0
            self._state = State.CONTROLLING
            if s.planner_frequency <= 0:
                self._run_planner = False
        elif self._state is State.PLANNING:
            self._retries += 1
            late = o.t > self._last_plan + s.planner_patience + EARLY
            if late or 0 <= s.max_planning_retries < self._retries:
                self._state, self._trigger = State.CLEARING, Trigger.PLANNING
                self._run_planner = False
                self._stop()
        self._next_plan = start + period + _SLIP

    def _stop(self) -> None:
        self._v = self._omega = self._v_y = 0.0
        self._trajectory = self._trajectory[:0]

    def _end(self, *, arrived: bool = False, gave_up: str | None = None) -> None:
        """The goal is done with, one way or the other (MoveBase::resetState)."""
        self._stop()
        self._active = self._run_planner = False
        self._state, self._recovery, self._trigger = State.PLANNING, 0, Trigger.PLANNING
        self._arrived, self._gave_up = arrived, gave_up
        self._status = "arrived" if arrived else "gave up"

"""Trajectory rollout as ROS's older TrajectoryPlannerROS does it (Gerkey and Konolige 2008), `dwa` true or false.

Behaviour after base_local_planner/src/trajectory_planner_ros.cpp and the state that trajectory_planner.cpp keeps,
for a differential base; the search is in `rollout_search`.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import CostArray, make_scene
from clearway.navigators.move_base.local_planners.goal import slow_down, turn_rate
from clearway.navigators.move_base.local_planners.interface import LocalResult
from clearway.navigators.move_base.local_planners.mapgrid import Room, make_room
from clearway.navigators.move_base.local_planners.parameters import TrajectoryParameters
from clearway.navigators.move_base.local_planners.rollout_search import BLOCKED, NO_WAY, Rollout, search

_STANDING = 1e-2  # m/s and rad/s; fixed in trajectory_planner_ros.cpp
_NOTHING: FloatArray = np.empty((0, 2))


class TrajectoryPlanner:
    """`base_local_planner/TrajectoryPlannerROS`."""

    def __init__(self, parameters: TrajectoryParameters, polygon: FloatArray, period: float) -> None:
        """
        Args:
            polygon: (m, 2) padded outline in base_link, m.
            period: One over the controller's frequency, s.
        """
        self._parameters = parameters
        self._polygon = np.ascontiguousarray(polygon, dtype=np.float64)
        self._period = period
        self._room: Room | None = None
        self.reset()

    @property
    def prune_plan(self) -> bool:
        """Whether the plan behind the robot is to be forgotten."""
        return self._parameters.prune_plan

    def reset(self) -> None:
        """Forget everything: a new trial."""
        self._latched = self._reached = self._turning = False
        self._turned_right = self._turned_left = False
        self._no_left = self._no_right = False
        self._escaping = False
        self._turned_at = np.zeros(2)
        self._escaped_at = np.zeros(3)

    def set_plan(self) -> None:
        """A new plan: the latch is dropped."""
        self._latched = self._reached = False

    def goal_reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        """Whether the last `compute` found the robot at the goal, turned to it (it need not stand: as in ROS)."""
        return self._reached

    def compute(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        plan: FloatArray,
        goal: FloatArray,
        cost: CostArray,
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
    ) -> LocalResult:
        """Stop and turn where the plan's stretch ends within tolerance, else the best rollout. See `LocalPlanner.compute`."""
        p = self._parameters
        end = plan[-1]
        if self._latched or math.hypot(end[0] - pose[0], end[1] - pose[1]) <= p.xy_goal_tolerance:
            self._latched = self._latched or p.latch_xy_goal_tolerance
            if abs(wrap(end[2] - pose[2])) <= p.yaw_goal_tolerance:
                self._turning = self._latched = False
                self._reached = True
                return LocalResult(0.0, 0.0, True, _NOTHING)
            v, w = self._final_command(pose, velocity, wrap(end[2] - pose[2]))
            # The real one searches here too, for the grids' sake, and its state moves on with what it finds.
            *_, legal = self._search(pose, velocity, (v, w), plan, cost, origin, resolution, speed_limit)
            return LocalResult(v, w, True, _NOTHING) if legal else LocalResult(0.0, 0.0, False, _NOTHING)
        total, v, w, points, _ = self._search(pose, velocity, (0.0, 0.0), plan, cost, origin, resolution, speed_limit)
        if total < 0.0:
            return LocalResult(0.0, 0.0, False, _NOTHING)
        return LocalResult(v, w, True, points[:, :2].copy())

    def _final_command(self, pose: FloatArray, velocity: FloatArray, difference: float) -> tuple[float, float]:
        """(v, omega) at the goal's place: brake, then turn in place."""
        p = self._parameters
        standing = abs(velocity[0]) <= _STANDING and abs(velocity[1]) <= _STANDING
        if not self._turning and not standing:
            return (
                slow_down(float(velocity[0]), p.acc_lim_x * self._period),
                slow_down(float(velocity[1]), p.acc_lim_theta * self._period),
            )
        self._turning = True
        low, high = p.least_goal_turn, p.max_rotational_vel
        return 0.0, turn_rate(difference, float(velocity[1]), p.acc_lim_theta, self._period, low, high)

    def _search(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        check: tuple[float, float],
        plan: FloatArray,
        cost: CostArray,
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
    ) -> tuple[float, float, float, FloatArray, bool]:
        """`search`, and what it means for the flags against oscillation and for the escape (createTrajectories)."""
        self._room = make_room(cost.shape, self._room)
        scene = make_scene(cost, origin, resolution, self._polygon)
        settings = self.window(resolution, speed_limit)
        total, speeds, points, backing, legal = search(
            settings, pose, velocity, np.array(check), plan, scene, self._room
        )
        v, w = float(speeds[0]), float(speeds[1])
        p = self._parameters
        if not backing and not v > 0.0:
            if w < 0.0:
                self._no_left = self._no_left or self._turned_right
                self._turned_right = True
            elif w > 0.0:
                self._no_right = self._no_right or self._turned_left
                self._turned_left = True
            self._turned_at = pose[:2].copy()
        if math.hypot(pose[0] - self._turned_at[0], pose[1] - self._turned_at[1]) > p.oscillation_reset_dist:
            self._turned_right = self._turned_left = self._no_left = self._no_right = False
        if backing and not self._escaping and total > NO_WAY:
            self._escaped_at = pose.copy()
            self._escaping = True
        moved = math.hypot(pose[0] - self._escaped_at[0], pose[1] - self._escaped_at[1])
        if moved > p.escape_reset_dist or abs(wrap(pose[2] - self._escaped_at[2])) > p.escape_reset_theta:
            self._escaping = False
        if backing and total == BLOCKED:
            total = 1.0  # backs up even where that seems blocked
        return total, v, w, points, legal

    def window(self, resolution: float, speed_limit: float) -> Rollout:
        """The parameters and the state of one cycle; the forward speed is capped (m/s)."""
        p = self._parameters
        per_cell = resolution if p.meter_scoring and p.meter_scoring_honoured else 1.0
        return Rollout(
            max_vel_x=min(p.max_vel_x, speed_limit),
            min_vel_x=p.min_vel_x,
            max_vel_theta=p.max_vel_theta,
            min_vel_theta=p.min_vel_theta,
            min_in_place=p.min_in_place_vel_theta,
            backup=p.escape_vel,
            acc_lim_x=p.acc_lim_x,
            acc_lim_theta=p.acc_lim_theta,
            period=self._period,
            dwa=p.dwa,
            vx_samples=p.vx_samples,
            vtheta_samples=p.vtheta_samples,
            sim_time=p.sim_time,
            sim_granularity=p.sim_granularity,
            angular_sim_granularity=p.angular_sim_granularity,
            path_bias=p.path_bias * per_cell,
            goal_bias=p.goal_bias * per_cell,
            occ_scale=p.occdist_scale,
            lookahead=p.heading_lookahead,
            heading_scoring=p.heading_scoring,
            heading_time=p.heading_scoring_timestep,
            attractor=p.simple_attractor,
            escaping=self._escaping,
            no_right=self._no_right,
            no_left=self._no_left,
        )

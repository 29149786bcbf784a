"""The dynamic window approach as ROS's DWAPlannerROS does it (Fox, Burgard, Thrun 1997).

Behaviour after dwa_local_planner/src/dwa_planner{,_ros}.cpp; the end game is in `goal`, the search in `dwa_search`.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import CostArray, make_scene
from clearway.navigators.common.oscillation import Oscillation
from clearway.navigators.move_base.local_planners.dwa_search import Window, motion_cost, search
from clearway.navigators.move_base.local_planners.goal import StopAndTurn
from clearway.navigators.move_base.local_planners.interface import LocalResult
from clearway.navigators.move_base.local_planners.mapgrid import Room, make_room
from clearway.navigators.move_base.local_planners.parameters import DWAParameters

_NOTHING: FloatArray = np.empty((0, 2))


class DWAPlanner:
    """`dwa_local_planner/DWAPlannerROS`."""

    def __init__(
        self, parameters: DWAParameters, polygon: FloatArray, period: float, sideways: bool = False, latch: bool = False
    ) -> None:
        """
        Args:
            parameters: As the robot's file has them.
            polygon: (m, 2) padded outline in base_link, m.
            period: One over the controller's frequency, s.
            sideways: Whether the base moves to its sides as well.
            latch: Whether a robot that was at the goal's place only turns, even if pushed away.
        """
        self._parameters, self._sideways = parameters, sideways
        self._polygon = np.ascontiguousarray(polygon, dtype=np.float64)
        self._period = period
        self._room: Room | None = None
        self._oscillation = Oscillation(parameters.oscillation_reset_dist, parameters.oscillation_reset_angle)
        self._finish = StopAndTurn(parameters, period, latch)

    @property
    def prune_plan(self) -> bool:
        """Whether the plan behind the robot is to be forgotten."""
        return self._parameters.prune_plan

    def reset(self) -> None:
        """Forget everything: a new trial."""
        self._oscillation.clear()
        self._finish.reset()

    def set_plan(self) -> None:
        """A new plan: latch and oscillation flags are dropped."""
        self._oscillation.clear()
        self._finish.unlatch()

    def goal_reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        """At the goal's place (or latched there), turned to it, and standing."""
        return self._finish.reached(pose, velocity, goal)

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
        """Stop and turn at the goal's place; before it, the best sample. See `LocalPlanner.compute`."""
        window = self.window(resolution, speed_limit, math.hypot(plan[-1, 0] - pose[0], plan[-1, 1] - pose[1]))
        scene = make_scene(cost, origin, resolution, self._polygon)
        if self._finish.at_place(pose, goal):
            v, w, u = self._finish.command(pose, velocity, goal)
            self._oscillation.clear()  # as the real one does in every check of such a command
            if (v, w, u) != (0.0, 0.0, 0.0) and motion_cost(window, pose, velocity, v, w, u, scene) < 0.0:
                return LocalResult(0.0, 0.0, False, _NOTHING)
            return LocalResult(v, w, True, _NOTHING, u)
        self._room = make_room(cost.shape, self._room)
        total, v, w, u, points = search(window, self._oscillation.signs, pose, velocity, plan, scene, self._room)
        if total < 0.0:
            return LocalResult(0.0, 0.0, False, _NOTHING)
        self._oscillation.update(pose, v, w, self._parameters.min_vel_trans, u)
        return LocalResult(v, w, True, points[:, :2].copy(), u)

    def window(self, resolution: float, speed_limit: float, goal_distance: float) -> Window:
        """The parameters of one cycle: forward speed capped (m/s), nothing asked of the nose close to the goal."""
        p = self._parameters
        path_bias = resolution * p.path_distance_bias
        far = goal_distance**2 > p.forward_point_distance**2 * p.cheat_factor
        return Window(
            max_vel_trans=min(p.max_vel_trans, speed_limit),
            min_vel_trans=p.min_vel_trans,
            max_vel_x=min(p.max_vel_x, speed_limit),
            min_vel_x=p.min_vel_x,
            max_vel_y=min(p.max_vel_y, speed_limit) if self._sideways else 0.0,
            min_vel_y=max(p.min_vel_y, -speed_limit) if self._sideways else 0.0,
            max_vel_theta=p.max_vel_theta,
            min_vel_theta=p.min_vel_theta,
            acc_lim_x=p.acc_lim_x,
            acc_lim_y=p.acc_lim_y,
            acc_lim_theta=p.acc_lim_theta,
            period=self._period,
            vx_samples=p.vx_samples,
            vy_samples=p.vy_samples,
            vth_samples=p.vth_samples,
            use_dwa=p.use_dwa,
            sim_time=p.sim_time,
            sim_granularity=p.sim_granularity,
            angular_sim_granularity=p.angular_sim_granularity,
            path_bias=path_bias,
            align_bias=path_bias if far else 0.0,
            goal_bias=resolution * p.goal_distance_bias,
            occ_scale=p.occdist_scale,
            twirl_scale=p.twirling_scale,
            sum_scores=p.sum_scores,
            nose=p.forward_point_distance,
            scaling_speed=p.scaling_speed,
            max_scaling_factor=p.max_scaling_factor,
        )

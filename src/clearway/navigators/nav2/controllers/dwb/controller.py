"""Nav2's DWB controller: samples velocities, lets critics judge where each leads, and takes the cheapest.

Behaviour after nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp and dwb_critics/src; the work is in `search`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import make_scene
from clearway.navigators.common.oscillation import Oscillation
from clearway.navigators.nav2.controllers.dwb import critics as kinds
from clearway.navigators.nav2.controllers.dwb import parameters as given
from clearway.navigators.nav2.controllers.dwb.generator import Axis, Kinematics
from clearway.navigators.nav2.controllers.dwb.search import search
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.path_handler import path_length
from clearway.navigators.nav2.seams import CostView, NoValidControl, Tolerances, Velocity

_NOWHERE: FloatArray = np.empty((0, 2))

_AT_THE_END = 1.0
"""A path longer than this isn't at the goal's place, m: Nav2 looks for its parameter under a name that no file has."""

_KINDS: dict[type[Group], int] = {
    given.RotateToGoalCritic: kinds.ROTATE_TO_GOAL,
    given.OscillationCritic: kinds.OSCILLATION,
    given.BaseObstacleCritic: kinds.BASE_OBSTACLE,
    given.ObstacleFootprintCritic: kinds.OBSTACLE_FOOTPRINT,
    given.TwirlingCritic: kinds.TWIRLING,
    given.PreferForwardCritic: kinds.PREFER_FORWARD,
    given.PathDistCritic: kinds.PATH_DIST,
    given.PathAlignCritic: kinds.PATH_ALIGN,
    given.GoalDistCritic: kinds.GOAL_DIST,
    given.GoalAlignCritic: kinds.GOAL_ALIGN,
}

_AGGREGATIONS = {"last": kinds.LAST, "sum": kinds.SUM, "product": kinds.PRODUCT}


class ResettingOscillation(Oscillation):
    """DWB's: a direction is open again after a time as well."""

    def __init__(self, p: given.OscillationCritic) -> None:
        super().__init__(p.oscillation_reset_dist, p.oscillation_reset_angle)
        self._p = p
        self._least = math.inf if p.x_only_threshold < 0.0 else p.x_only_threshold
        self._now = self._closed_at = 0.0
        self._closed_from = self._since

    def debrief(self, now: float, pose: FloatArray, command: Velocity) -> None:
        """Note the command that was chosen at `now` [s] and `pose`."""
        self._now = now
        self.update(pose, command.v_x, command.omega, self._least, command.v_y)

    def _moved_on(self, moved: FloatArray) -> bool:
        if self._since is not self._closed_from:  # a direction was closed just now
            self._closed_from, self._closed_at = self._since, self._now
        p = self._p
        far, angle, time = p.oscillation_reset_dist, p.oscillation_reset_angle, p.oscillation_reset_time
        return bool(
            (far >= 0.0 and moved[0] ** 2 + moved[1] ** 2 > far**2)
            or (angle >= 0.0 and abs(wrap(float(moved[2]))) > angle)
            or (time >= 0.0 and self._now - self._closed_at > time)
        )


class DWB:
    """`dwb_core::DWBLocalPlanner`, a `Controller`."""

    def __init__(self, parameters: given.DWBParameters, critics: Mapping[str, Group], period: float) -> None:
        """
        Args:
            parameters: As the file has them.
            critics: The critics' own, in the file's order.
            period: One over the controller server's frequency, s.
        """
        self._parameters = parameters
        self._full = self._kinematics = make_kinematics(parameters, period)
        groups = list(critics.values())
        self._critics = kinds.Critics(
            np.array([_KINDS[type(g)] for g in groups], np.int64),
            np.array([g.scale for g in groups if isinstance(g, given.Critic)]),
            np.array([_values(g) for g in groups]),
        )
        self._oscillations = {
            i: ResettingOscillation(g) for i, g in enumerate(groups) if isinstance(g, given.OscillationCritic)
        }
        self._rotating = [i for i, g in enumerate(groups) if isinstance(g, given.RotateToGoalCritic)]
        self.reset()

    @property
    def trajectory(self) -> FloatArray:
        """See `Controller`."""
        return self._trajectory

    def reset(self) -> None:
        """See `Controller`."""
        self._at_place = self._turns = False
        self._trajectory = _NOWHERE
        for oscillation in self._oscillations.values():
            oscillation.clear()

    def set_plan(self, path: FloatArray) -> None:
        """See `Controller`: the critics forget that they were at the goal, and what they forbade."""
        self.reset()

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """See `Controller`: all limits shrink alike; a limit above the full speed leaves them as they are."""
        full = self._full
        if limit == 0.0:
            self._kinematics = full
        elif percentage or limit < full.max_speed:
            share = limit / 100.0 if percentage else limit / full.max_speed
            self._kinematics = full._replace(
                x=full.x._replace(high=full.x.high * share),
                y=full.y._replace(high=full.y.high * share),
                w=full.w._replace(low=full.w.low * share, high=full.w.high * share),
                max_speed=full.max_speed * share,
            )

    def compute(
        self,
        now: float,
        pose: FloatArray,
        velocity: Velocity,
        path: FloatArray,
        goal: FloatArray,
        tolerances: Tolerances,
        view: CostView,
    ) -> Velocity:
        """See `Controller`."""
        self._watch_goal(pose, velocity, path, goal)
        values = self._critics.values
        for i, oscillation in self._oscillations.items():
            values[i] = oscillation.signs
        scene = make_scene(view.cost, view.origin, view.resolution, view.footprint)
        measured = np.array(velocity)
        cost, found, self._trajectory = search(self._kinematics, self._critics, scene, pose, measured, goal, path)
        command = Velocity(*found.tolist())
        for oscillation in self._oscillations.values():
            oscillation.debrief(now, pose, command)
        if cost < 0.0:
            raise NoValidControl("no trajectory is legal")
        return command

    def _watch_goal(self, pose: FloatArray, velocity: Velocity, path: FloatArray, goal: FloatArray) -> None:
        """Tell RotateToGoal whether it is at the goal's place, and whether it has stood there."""
        if not self._rotating:
            return
        p = self._parameters
        squared = (pose[0] - goal[0]) ** 2 + (pose[1] - goal[1]) ** 2
        if not self._at_place:
            self._at_place = bool(squared <= p.xy_goal_tolerance**2) and path_length(path) <= _AT_THE_END
        speed = velocity.v_x**2 + velocity.v_y**2
        self._turns = self._turns or (self._at_place and speed <= p.trans_stopped_velocity**2)
        mode = kinds.ROTATING if self._turns else kinds.SLOWING if self._at_place else kinds.FAR_FROM_GOAL
        for i in self._rotating:
            self._critics.values[i, 0], self._critics.values[i, 1] = mode, speed
            self._critics.values[i, 4] = goal[2]


def _values(group: Group) -> tuple[float, ...]:
    """What a critic goes by, see `Critics.values`."""
    match group:
        case given.RotateToGoalCritic():
            return 0.0, 0.0, group.slowing_factor, group.lookahead_time, 0.0, 0.0
        case given.BaseObstacleCritic():
            return (float(kinds.SUM if group.sum_scores else kinds.LAST), 0.0, 0.0, 0.0, 0.0, 0.0)
        case given.PreferForwardCritic():
            return group.penalty, group.strafe_x, group.strafe_theta, group.theta_scale, 0.0, 0.0
        case given.MapGridCritic():
            nose = (
                group.forward_point_distance
                if isinstance(group, given.PathAlignCritic | given.GoalAlignCritic)
                else 0.0
            )
            return float(_AGGREGATIONS[group.aggregation_type]), nose, -1.0, -1.0, 0.0, 0.0
    return (0.0,) * 6


def make_kinematics(p: given.DWBParameters, period: float) -> Kinematics:
    """What the compiled part needs of the parameters."""
    limited = p.trajectory_generator_name == given.LIMITED
    return Kinematics(
        x=Axis(p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, p.vx_samples),
        y=Axis(p.min_vel_y, p.max_vel_y, p.acc_lim_y, p.decel_lim_y, p.vy_samples),
        w=Axis(-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta, p.vtheta_samples),
        min_speed=p.min_speed_xy,
        max_speed=p.max_speed_xy,
        min_turn=p.min_speed_theta,
        reach=(period if p.sim_period is None else p.sim_period) if limited else p.sim_time,
        at_once=limited,
        sim_time=p.sim_time,
        time_step=p.time_granularity if p.discretize_by_time else 0.0,
        linear_step=p.linear_granularity,
        angular_step=p.angular_granularity,
        twice=p.include_last_point,
        first_step=p.limit_vel_cmd_in_traj,
    )

"""Nav2's rotation shim: turns in place towards the path before another controller follows it, and to the goal's heading after.

Behaviour after nav2_rotation_shim_controller/src/nav2_rotation_shim_controller.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import NO_INFORMATION, Scene, make_scene
from clearway.navigators.nav2.controllers.parameters import RotationShimParameters
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.seams import Controller, CostView, Tolerances, Velocity

_NOWHERE: FloatArray = np.empty((0, 2))


class RotationShim:
    """`nav2_rotation_shim_controller::RotationShimController`, a `Controller` around another."""

    def __init__(self, parameters: RotationShimParameters, primary: Controller, period: float) -> None:
        """
        Args:
            parameters: As the file has them.
            primary: Follows the path once the robot is turned to it.
            period: One over the controller server's frequency, s.
        """
        self._parameters, self._primary, self._period = parameters, primary, period
        self._goal: FloatArray | None = None
        self._goal_changed, self._towards_path = True, False
        self.reset()

    @property
    def trajectory(self) -> FloatArray:
        """See `Controller`: the primary's; empty while the robot turns in place."""
        return _NOWHERE if self._turns else self._primary.trajectory

    def reset(self) -> None:
        """See `Controller`: whether it was turning to the path, and for which goal, it keeps."""
        self._last_omega, self._turns = 0.0, False
        self._primary.reset()

    def set_plan(self, path: FloatArray) -> None:
        """See `Controller`."""
        goal = path[-1].copy()
        self._goal_changed = self._goal_changed or self._goal is None or not np.array_equal(self._goal, goal)
        self._goal = goal
        self._primary.set_plan(path)

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """See `Controller`: the primary's; turns are not limited."""
        self._primary.set_speed_limit(limit, percentage)

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
        p = self._parameters
        self._turns = False
        turn: float | None = None
        if p.rotate_to_goal_heading and tolerances.there:
            turn = self._turn(turn_between(float(pose[2]), float(goal[2])), pose, velocity, view)
        if turn is None and (not p.rotate_to_heading_once or self._towards_path or self._goal_changed):
            self._goal_changed = False
            turn = self._turn_to_path(pose, velocity, path, view)
        if turn is None:
            self._towards_path = False
            command = self._primary.compute(now, pose, velocity, path, goal, tolerances, view)
        else:
            self._turns = True
            command = Velocity(0.0, 0.0, turn)
        self._last_omega = command.omega
        return command

    def _turn_to_path(self, pose: FloatArray, velocity: Velocity, path: FloatArray, view: CostView) -> float | None:
        """The yaw rate towards the path; None where the robot is turned to it, or can't be."""
        p = self._parameters
        if len(path) < 2:
            return None
        far = np.hypot(path[1:, 0] - path[0, 0], path[1:, 1] - path[0, 1]) >= p.forward_sampling_distance
        x, y, yaw = path[1 + int(np.argmax(far))] if far.any() else path[-1]
        towards = yaw if p.use_path_orientations else math.atan2(y - pose[1], x - pose[0])
        angle = turn_between(float(pose[2]), float(towards))
        threshold = p.angular_disengage_threshold if self._towards_path else p.angular_dist_threshold
        if abs(angle) <= threshold:
            return None
        self._towards_path = True
        return self._turn(angle, pose, velocity, view)

    def _turn(self, angle: float, pose: FloatArray, velocity: Velocity, view: CostView) -> float | None:
        """The yaw rate that turns by `angle`; None where the footprint would hit something."""
        p = self._parameters
        now = velocity.omega if p.closed_loop else self._last_omega
        sign = 1.0 if angle > 0.0 else -1.0
        reach = p.max_angular_accel * self._period
        rate = max(now - reach, min(sign * p.rotate_to_heading_angular_vel, now + reach))
        stoppable = math.sqrt(2.0 * p.max_angular_accel * abs(angle))
        if abs(rate) > stoppable:
            rate = sign * stoppable
        scene = make_scene(view.cost, view.origin, view.resolution, view.footprint)
        limit = abs(angle) - p.angular_dist_threshold
        free = _free_turn(
            scene, pose, rate, limit, p.simulate_ahead_time, self._period, p.max_cost_threshold, view.tracks_unknown
        )
        return rate if free else None


@kernel
def _free_turn(
    scene: Scene, pose: FloatArray, rate: float, limit: float, ahead: float, period: float, most: float, tracks: bool
) -> bool:
    """Whether a turn at `rate` costs less than `most` under the footprint, for `ahead` seconds or the angle `limit`.

    As in the source the angle is signed, so that a turn to the left ends where it has come half around.
    """
    time = 0.0
    while time < ahead:
        time += period
        yaw = pose[2] + rate * time
        if turn_between(yaw, pose[2]) >= limit:
            break
        cost = cost_at_pose(scene.cost, scene.frame, scene.polygon, pose[0], pose[1], yaw)
        if cost >= most or (cost == NO_INFORMATION and tracks):
            return False
    return True

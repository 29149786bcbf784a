"""Parameters of Nav2's regulated pure pursuit and of its rotation shim."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.plugins import group_of, named
from clearway.quantities import Finite, NonNegative, Positive


class RegulatedPurePursuitParameters(Group):
    """`nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController` (src/parameter_handler.cpp)."""

    max_linear_vel: NonNegative = Field(
        default=0.5, description="speed at which a straight and free path is followed, m/s"
    )
    desired_linear_vel: NonNegative | None = Field(
        default=None, description="old name of max_linear_vel, which it overrides, m/s"
    )
    min_linear_vel: Finite = Field(default=-0.5, description="least speed of the dynamic window, m/s")
    max_angular_vel: Finite = Field(default=2.5, description="largest yaw rate of the dynamic window, rad/s")
    min_angular_vel: Finite = Field(default=-2.5, description="least yaw rate of the dynamic window, rad/s")
    max_linear_accel: NonNegative = Field(default=2.5, description="of the dynamic window, m/s^2")
    max_linear_decel: Finite = Field(default=-2.5, description="of the dynamic window, m/s^2")
    max_angular_accel: NonNegative = Field(
        default=3.2, description="of the dynamic window and of turns in place, rad/s^2"
    )
    max_angular_decel: Finite = Field(default=-3.2, description="of the dynamic window, rad/s^2")
    use_dynamic_window: bool = Field(
        default=False, description="whether a command is the best that can be reached in one period"
    )
    lookahead_dist: NonNegative = Field(
        default=0.6, description="how far along the path the point lies that is aimed at, m"
    )
    use_velocity_scaled_lookahead_dist: bool = Field(
        default=False, description="whether that is the speed times lookahead_time"
    )
    min_lookahead_dist: NonNegative = Field(default=0.3, description="then at least, m")
    max_lookahead_dist: NonNegative = Field(default=0.9, description="then at most, m")
    lookahead_time: NonNegative = Field(default=1.5, description="see use_velocity_scaled_lookahead_dist, s")
    use_fixed_curvature_lookahead: bool = Field(
        default=False, description="whether the curvature is that of a point at curvature_lookahead_dist"
    )
    curvature_lookahead_dist: NonNegative = Field(default=0.6, description="how far along the path that point lies, m")
    interpolate_curvature_after_goal: bool = Field(
        default=False,
        description="whether that point may lie beyond the path's end; only with use_fixed_curvature_lookahead",
    )
    use_regulated_linear_velocity_scaling: bool = Field(default=True, description="whether curves are driven slower")
    regulated_linear_scaling_min_radius: NonNegative = Field(
        default=0.9, description="of a curve that is driven at full speed, m"
    )
    regulated_linear_scaling_min_speed: NonNegative = Field(
        default=0.25, description="least speed to which curves and obstacles slow the robot, m/s"
    )
    use_cost_regulated_linear_velocity_scaling: bool = Field(
        default=True, description="whether the robot drives slower near obstacles"
    )
    cost_scaling_dist: NonNegative = Field(
        default=0.6, description="distance from obstacles that is driven at full speed, m"
    )
    cost_scaling_gain: NonNegative = Field(default=1.0, description="share of the speed that is left there")
    inflation_cost_scaling_factor: Finite = Field(
        default=3.0, description="the inflation layer's cost_scaling_factor, 1/m; 0 or below: no slower near obstacles"
    )
    min_approach_linear_velocity: NonNegative = Field(
        default=0.05, description="least speed on the way to the path's end, m/s"
    )
    approach_velocity_scaling_dist: NonNegative = Field(
        default=0.6, description="length of the path that is left from which the robot slows down, m"
    )
    use_rotate_to_heading: bool = Field(
        default=True, description="whether the robot turns in place to the path and, at the goal's place, to the goal"
    )
    rotate_to_heading_angular_vel: NonNegative = Field(default=1.8, description="at which it turns in place, rad/s")
    rotate_to_heading_min_angle: NonNegative = Field(
        default=0.785, description="from the path from which on it turns in place, rad"
    )
    allow_reversing: bool = Field(default=False, description="whether a point behind the robot is driven to backwards")
    use_cancel_deceleration: bool = Field(
        default=False, description="whether the robot slows down when it is cancelled"
    )
    cancel_deceleration: NonNegative = Field(default=3.2, description="then by, m/s^2")
    use_collision_detection: bool = Field(
        default=True, description="whether a command that leads into an obstacle is refused"
    )
    max_allowed_time_to_collision_up_to_carrot: NonNegative = Field(
        default=1.0,
        description="how far ahead a command is looked at, up to the distance of the point that is aimed at, s",
    )
    min_distance_to_obstacle: Finite = Field(
        default=-1.0, description="how far ahead a command is looked at, at least, m; 0 or below: by time alone"
    )
    allow_obstacle_checking_beyond_goal: bool = Field(
        default=False,
        description="whether it is looked at beyond the path's end; only with use_velocity_scaled_lookahead_dist",
    )

    IGNORED: ClassVar[dict[str, str]] = {"transform_tolerance": "there are no transforms to wait for"}
    MISSING: ClassVar[dict[str, str]] = {
        "max_robot_pose_search_dist": "that of the path handler",
        "stateful": "that of the goal checker",
    }

    @property
    def full_speed(self) -> float:
        """The speed on a straight and free path, m/s, from whichever name was set."""
        return self.max_linear_vel if self.desired_linear_vel is None else self.desired_linear_vel


class RotationShimParameters(Group):
    """`nav2_rotation_shim_controller::RotationShimController` (src/parameter_handler.cpp)."""

    angular_dist_threshold: Positive = Field(
        default=0.785, description="from the path from which on the robot turns in place, rad"
    )
    angular_disengage_threshold: Positive = Field(
        default=0.785 / 2.0, description="from the path up to which it then turns, rad"
    )
    forward_sampling_distance: Positive = Field(
        default=0.5, description="how far ahead the path's direction is taken, m"
    )
    rotate_to_heading_angular_vel: Positive = Field(default=1.8, description="at which it turns, rad/s")
    max_angular_accel: Positive = Field(default=3.2, description="rad/s^2")
    max_cost_threshold: Positive = Field(
        default=254.0, description="cost under the footprint from which on it can't turn"
    )
    simulate_ahead_time: NonNegative = Field(default=1.0, description="how far ahead the turn is looked at, s")
    rotate_to_goal_heading: bool = Field(
        default=False, description="whether it turns in place at the goal's place, too"
    )
    rotate_to_heading_once: bool = Field(
        default=False, description="whether it turns to the path only after the goal has changed"
    )
    closed_loop: bool = Field(
        default=True, description="whether it accelerates from the measured yaw rate; else from the commanded one"
    )
    use_path_orientations: bool = Field(
        default=False, description="whether it turns to the path's heading; else to where the path lies"
    )

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its primary controller, under `primary_controller`; up to kilted that is the plug-in's name itself."""
        name = cls.beside(table)
        if name is not None:
            return {name: group_of("controller", table[name], name)}
        return named("controller", table, ("primary_controller",), "primary_controller")

    @classmethod
    def beside(cls, table: dict[str, Any]) -> str | None:
        """Its primary controller, where a plug-in's name stands for it."""
        return "primary_controller" if isinstance(table.get("primary_controller"), str) else None

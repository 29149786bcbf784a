"""Parameters of the two local planners, under ROS's own names and defaults (noetic).

A name that the real planner does not read is accepted only where a public file of a robot holds it, and says so.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from clearway.navigators.common.costmaps.parameters import Group
from clearway.quantities import Finite, NonNegative, Positive, Whole


class DWAParameters(Group):
    """dwa_local_planner/cfg/DWAPlanner.cfg and base_local_planner's generic limits.

    Only an omnidirectional base strafes: elsewhere the y velocities and their samples are accepted and have no effect.
    """

    max_vel_trans: NonNegative = Field(default=0.55, description="m/s")
    min_vel_trans: NonNegative = Field(default=0.1, description="m/s; slower samples are dropped unless they turn fast")
    max_vel_x: Finite = Field(default=0.55, description="m/s")
    min_vel_x: Finite = Field(default=0.0, description="m/s; negative allows reverse")
    max_vel_y: Finite = Field(default=0.0, description="m/s; of an omnidirectional base only")
    min_vel_y: Finite = Field(default=0.0, description="m/s; of an omnidirectional base only")
    max_vel_theta: NonNegative = Field(default=1.0, description="rad/s")
    min_vel_theta: NonNegative = Field(default=0.4, description="rad/s")
    acc_lim_x: NonNegative = Field(default=2.5, description="m/s^2")
    acc_lim_y: NonNegative = Field(default=2.5, description="m/s^2; of an omnidirectional base only")
    acc_lim_theta: NonNegative = Field(default=3.2, description="rad/s^2")
    acc_lim_trans: NonNegative = Field(default=0.1, description="m/s^2; read by nothing in the real planner either")
    acc_lim_th: NonNegative | None = Field(
        default=None,
        description="rad/s^2; in PAL's public file, not a name that DWAPlanner.cfg reads: acc_lim_theta keeps its value",
    )
    xy_goal_tolerance: Positive = Field(default=0.1, description="m; in a robot's file by default its goal_checker's")
    yaw_goal_tolerance: Positive = Field(
        default=0.1, description="rad; in a robot's file by default its goal_checker's"
    )
    latch_xy_goal_tolerance: bool = Field(
        default=False, description="not read here by the real planner since Melodic, but in move_base's own group"
    )
    trans_stopped_vel: NonNegative = Field(default=0.1, description="m/s at or below which the robot stands")
    theta_stopped_vel: NonNegative = Field(default=0.1, description="rad/s at or below which the robot stands")
    prune_plan: bool = Field(default=False, description="drop the plan's beginning once it is over 1 m behind")
    use_dwa: bool = Field(
        default=True, description="sample what is reachable in one period; else what is in sim_time, and accelerate"
    )
    sim_time: Positive = Field(le=60.0, default=1.7, description="s, horizon of a rollout")
    sim_granularity: Positive = Field(ge=0.001, default=0.025, description="m between checked points")
    angular_sim_granularity: Positive = Field(ge=0.001, default=0.1, description="rad between checked points")
    path_distance_bias: NonNegative = Field(default=0.6, description="weight per metre from the plan")
    goal_distance_bias: NonNegative = Field(default=0.8, description="weight per metre from the local goal")
    occdist_scale: NonNegative = Field(default=0.01, description="weight of the highest cost on the way")
    twirling_scale: NonNegative = Field(default=0.0, description="weight per rad/s of turning")
    sum_scores: bool = Field(default=False, description="add costs up along the way instead of taking the highest")
    stop_time_buffer: NonNegative = Field(default=0.2, description="s; read by nothing in the real planner either")
    oscillation_reset_dist: NonNegative = Field(default=0.05, description="m")
    oscillation_reset_angle: NonNegative = Field(default=0.2, description="rad")
    forward_point_distance: Finite = Field(default=0.325, description="m from the centre to the nose that is scored")
    cheat_factor: NonNegative = Field(default=1.0, description="the nose is not scored nearer than sqrt of it noses")
    scaling_speed: NonNegative = Field(default=0.25, description="m/s from which the footprint grows")
    max_scaling_factor: NonNegative = Field(default=0.2, description="how much the footprint has grown at full speed")
    vx_samples: Whole = Field(le=1000, default=3, ge=0, description="0 counts as 1; the real one takes at least 2")
    vy_samples: Whole = Field(le=1000, default=10, ge=0, description="of an omnidirectional base only")
    vth_samples: Whole = Field(le=1000, default=20, ge=0, description="0 counts as 1; the real one takes at least 2")
    vtheta_samples: Whole | None = Field(
        le=1000,
        default=None,
        description="in PAL's public file, not a name that DWAPlanner.cfg reads: vth_samples keeps its value",
    )
    controller_frequency: Positive | None = Field(default=None, description="Hz; default: move_base's")


class TrajectoryParameters(Group):
    """base_local_planner/cfg/BaseLocalPlanner.cfg, and what trajectory_planner_ros.cpp reads beside it.

    Where the two have different defaults for one name, the .cfg's holds: dynamic_reconfigure sets it last.
    `max_rotational_vel` bounds the final turn only; the rollouts are bounded by `max_vel_theta`.
    """

    acc_lim_x: NonNegative = Field(default=2.5, description="m/s^2")
    acc_lim_y: NonNegative = Field(default=2.5, description="m/s^2; of an omnidirectional base only")
    acc_lim_theta: NonNegative = Field(default=3.2, description="rad/s^2")
    max_vel_x: NonNegative = Field(default=0.55, description="m/s")
    min_vel_x: NonNegative = Field(default=0.0, description="m/s")
    max_vel_theta: NonNegative = Field(default=1.0, description="rad/s")
    min_vel_theta: Annotated[float, Field(le=0, allow_inf_nan=False)] = Field(default=-1.0, description="rad/s")
    min_in_place_vel_theta: NonNegative = Field(default=0.4, description="rad/s")
    min_in_place_rotational_vel: NonNegative | None = Field(
        default=None,
        description="rad/s; old name of min_in_place_vel_theta, which only the turn at the goal reads (rollouts do not)",
    )
    max_rotational_vel: NonNegative = Field(default=1.0, description="rad/s, of the turn at the goal")
    escape_vel: Finite = Field(default=-0.1, description="m/s, backing out when nothing else is legal")
    holonomic_robot: bool = Field(
        default=False,
        description="only false: what it tries of y velocities is not built; DWAPlannerROS has them (ROS: true)",
    )
    xy_goal_tolerance: Positive = Field(default=0.10, description="m; in a robot's file by default its goal_checker's")
    yaw_goal_tolerance: Positive = Field(
        default=0.05, description="rad; in a robot's file by default its goal_checker's"
    )
    latch_xy_goal_tolerance: bool = Field(default=False, description="once at the goal, only turn, even if pushed away")
    prune_plan: bool = Field(default=True, description="drop the plan's beginning once it is over 1 m behind")
    sim_time: Positive = Field(le=60.0, default=1.7, description="s, horizon of a rollout")
    sim_granularity: Positive = Field(ge=0.001, default=0.025, description="m between checked points")
    angular_sim_granularity: Positive = Field(
        ge=0.001, default=0.025, description="rad/s of the sample per checked point"
    )
    vx_samples: Whole = Field(le=1000, default=20, ge=1)
    vtheta_samples: Whole = Field(le=1000, default=20, ge=1)
    path_distance_bias: NonNegative = Field(default=0.6, description="weight per cell (or metre) from the plan")
    goal_distance_bias: NonNegative = Field(default=0.8, description="weight per cell (or metre) from the local goal")
    pdist_scale: NonNegative | None = Field(
        default=None, description="old name of path_distance_bias, used if that is not set"
    )
    gdist_scale: NonNegative | None = Field(
        default=None, description="old name of goal_distance_bias, used if that is not set"
    )
    occdist_scale: NonNegative = Field(default=0.01, description="weight of the highest cost on the way")
    meter_scoring: bool = Field(
        default=False, description="meant to make the two biases count per metre; see meter_scoring_honoured"
    )
    meter_scoring_honoured: bool = Field(
        default=False,
        description="not a ROS parameter: let meter_scoring mean what it says. The real TrajectoryPlanner is given it but"
        " never stores it (kinetic to noetic), so its biases count per cell whatever the file says",
    )
    heading_lookahead: Finite = Field(
        default=0.325, description="m ahead of the robot that turns in place are compared at"
    )
    heading_scoring: bool = Field(
        default=False, description="score the heading at heading_scoring_timestep instead of the end"
    )
    heading_scoring_timestep: NonNegative = Field(default=0.1, description="s")
    simple_attractor: bool = Field(default=False, description="goal distance is the squared distance to the plan's end")
    dwa: bool = Field(default=False, description="sample what is reachable in one period, else in sim_time")
    oscillation_reset_dist: NonNegative = Field(default=0.05, description="m")
    escape_reset_dist: NonNegative = Field(default=0.10, description="m")
    escape_reset_theta: NonNegative = Field(default=math.pi / 2, description="rad")
    stop_time_buffer: NonNegative = Field(default=0.2, description="s; read by nothing in the real planner either")
    controller_frequency: Positive | None = Field(default=None, description="Hz; default: move_base's")

    @model_validator(mode="after")
    def _differential(self) -> TrajectoryParameters:
        if self.holonomic_robot:
            raise ValueError(
                "holonomic_robot must be false: DWAPlannerROS has y velocities, this planner has none here"
            )
        return self

    @property
    def path_bias(self) -> float:
        """The path's weight, from whichever name was set."""
        old = self.pdist_scale if "path_distance_bias" not in self.model_fields_set else None
        return self.path_distance_bias if old is None else old

    @property
    def least_goal_turn(self) -> float:
        """The least yaw rate of the turn at the goal, from whichever name was set, rad/s."""
        old = self.min_in_place_rotational_vel if "min_in_place_vel_theta" not in self.model_fields_set else None
        return self.min_in_place_vel_theta if old is None else old

    @property
    def goal_bias(self) -> float:
        """The goal's weight, from whichever name was set."""
        old = self.gdist_scale if "goal_distance_bias" not in self.model_fields_set else None
        return self.goal_distance_bias if old is None else old

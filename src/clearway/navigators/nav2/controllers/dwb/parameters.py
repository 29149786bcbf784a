"""Parameters of Nav2's DWB controller, of its generators of trajectories and of its critics (nav2_dwb_controller)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from clearway.errors import shown
from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.plugins import PLUGINS, group_of, twice
from clearway.quantities import Finite, NonNegative, Positive, Whole

_DRAWN = "nobody looks at it"
_PATH_HANDLER = "prune_distance of the path handler"

MOST_SAMPLES = 100_000
"""Most velocities that are tried in a control period."""

_CRITICS = tuple(name.partition("::")[2] for name in PLUGINS["DWB critic"])
LIMITED = "dwb_plugins::LimitedAccelGenerator"

_Decel = Annotated[float, Field(strict=True, allow_inf_nan=False, le=0.0)]


def _aggregation(text: str) -> str:
    if text.lower() not in ("last", "sum", "product"):
        raise ValueError(f"is {shown(text)}; it is one of last, sum, product")
    return text.lower()


class Critic(Group):
    """What all critics have."""

    scale: NonNegative = Field(default=1.0, description="weight")

    IGNORED: ClassVar[dict[str, str]] = {"class": "the critic's own name, or that of its class, which is read"}


class RotateToGoalCritic(Critic):
    """`dwb_critics::RotateToGoalCritic`: at the goal's place slow down, then turn only (rotate_to_goal.cpp)."""

    slowing_factor: NonNegative = Field(default=5.0, description="cost of the squared speed, s^2/m^2")
    lookahead_time: Finite = Field(
        default=-1.0, description="the heading is that after so long, s; negative: that at the end"
    )


class OscillationCritic(Critic):
    """`dwb_critics::OscillationCritic`: no to and fro (oscillation.cpp)."""

    oscillation_reset_dist: Finite = Field(
        default=0.05, description="from which on both ways are open again, m; negative: never"
    )
    oscillation_reset_angle: Finite = Field(default=0.2, description="likewise, rad; negative: never")
    oscillation_reset_time: Finite = Field(default=-1.0, description="likewise, s; negative: never")
    x_only_threshold: Finite = Field(
        default=0.05, description="speed forwards up to which turning and strafing count, m/s; negative: they always do"
    )


class BaseObstacleCritic(Critic):
    """`dwb_critics::BaseObstacleCritic`: costs under the robot's centre (base_obstacle.cpp)."""

    sum_scores: bool = Field(default=False, description="whether they are added up; else that of the last point counts")


class ObstacleFootprintCritic(BaseObstacleCritic):
    """`dwb_critics::ObstacleFootprintCritic`: costs under the robot's outline (obstacle_footprint.cpp)."""


class MapGridCritic(Critic):
    """What critics have that count cells (map_grid.cpp)."""

    aggregation_type: Annotated[str, AfterValidator(_aggregation)] = Field(
        default="last", description="which points of a trajectory count: last, sum, product"
    )


class PathDistCritic(MapGridCritic):
    """`dwb_critics::PathDistCritic`: distance from the path (path_dist.cpp)."""


class GoalDistCritic(MapGridCritic):
    """`dwb_critics::GoalDistCritic`: distance from the path's last point on the local costmap (goal_dist.cpp)."""


class PathAlignCritic(MapGridCritic):
    """`dwb_critics::PathAlignCritic`: distance of the nose from the path (path_align.cpp)."""

    forward_point_distance: Finite = Field(default=0.325, description="how far ahead the nose is, m")


class GoalAlignCritic(MapGridCritic):
    """`dwb_critics::GoalAlignCritic`: distance of the nose from a point beyond the path's last one (goal_align.cpp)."""

    forward_point_distance: Finite = Field(default=0.325, description="how far ahead the nose is, and that point, m")


class TwirlingCritic(Critic):
    """`dwb_critics::TwirlingCritic`: turning (twirling.cpp)."""


class PreferForwardCritic(Critic):
    """`dwb_critics::PreferForwardCritic`: anything but driving straight ahead (prefer_forward.cpp)."""

    penalty: NonNegative = Field(default=1.0, description="of driving backwards or sideways")
    strafe_x: Finite = Field(default=0.1, description="slower forwards than this is sideways, m/s")
    strafe_theta: Finite = Field(default=0.2, description="unless it turns as fast as this, rad/s")
    theta_scale: NonNegative = Field(default=10.0, description="cost of turning, s/rad")


class DWBParameters(Group):
    """`dwb_core::DWBLocalPlanner` (dwb_core/src/dwb_local_planner.cpp, dwb_plugins/src)."""

    critics: tuple[str, ...] = Field(
        min_length=1, description="names of its critics, with or without `Critic` at the end"
    )
    trajectory_generator_name: Literal[
        "dwb_plugins::StandardTrajectoryGenerator", "dwb_plugins::LimitedAccelGenerator"
    ] = Field(
        default="dwb_plugins::StandardTrajectoryGenerator",
        description="whether a trajectory speeds up on its way, or has its velocity at once",
    )
    min_vel_x: Finite = Field(default=0.0, description="m/s")
    max_vel_x: Finite = Field(default=0.0, description="m/s")
    min_vel_y: Finite = Field(default=0.0, description="m/s")
    max_vel_y: Finite = Field(default=0.0, description="m/s")
    max_vel_theta: NonNegative = Field(default=0.0, description="rad/s")
    min_speed_xy: Finite = Field(
        default=0.0, description="slower samples are dropped if they turn slowly as well, m/s; negative: none"
    )
    max_speed_xy: Finite = Field(default=0.0, description="faster samples are dropped, m/s; negative: none")
    min_speed_theta: Finite = Field(default=0.0, description="see min_speed_xy, rad/s; negative: none is dropped")
    acc_lim_x: NonNegative = Field(default=0.0, description="m/s^2")
    acc_lim_y: NonNegative = Field(default=0.0, description="m/s^2")
    acc_lim_theta: NonNegative = Field(default=0.0, description="rad/s^2")
    decel_lim_x: _Decel = Field(default=0.0, description="m/s^2")
    decel_lim_y: _Decel = Field(default=0.0, description="m/s^2")
    decel_lim_theta: _Decel = Field(default=0.0, description="rad/s^2")
    vx_samples: Whole = Field(default=20, ge=0, le=1000, description="speeds forwards, at least 2")
    vy_samples: Whole = Field(
        default=5, ge=0, le=1000, description="speeds to the left, at least 2 where there is a choice"
    )
    vtheta_samples: Whole = Field(default=20, ge=0, le=1000, description="yaw rates, at least 2")
    sim_time: Positive = Field(default=1.7, le=60.0, description="how far ahead a trajectory leads, s")
    sim_period: Positive | None = Field(
        default=None, description="LimitedAccelGenerator: the time to reach a sample, s; by default the control period"
    )
    discretize_by_time: bool = Field(default=False, description="whether points are time_granularity apart")
    time_granularity: Positive = Field(default=0.5, ge=0.001, description="s")
    linear_granularity: Positive = Field(default=0.5, ge=0.001, description="else at most so far apart, m")
    angular_granularity: Positive = Field(default=0.025, ge=0.001, description="and turned by so much, rad")
    include_last_point: bool = Field(default=True, description="whether the last point counts twice")
    limit_vel_cmd_in_traj: bool = Field(
        default=False, description="whether the command is what is reached in the first step; else the sample"
    )
    xy_goal_tolerance: NonNegative = Field(default=0.25, description="RotateToGoal: how near the goal's place is, m")
    trans_stopped_velocity: NonNegative = Field(
        default=0.25, description="RotateToGoal: no faster it stands there, m/s"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "debug_trajectory_details": _DRAWN,
        "short_circuit_trajectory_evaluation": "it saves time in Nav2; the choice is the same",
        "default_critic_namespaces": "there are Nav2's own critics",
        "transform_tolerance": "there are no transforms to wait for",
        "publish_evaluation": _DRAWN,
        "publish_local_plan": _DRAWN,
        "publish_trajectories": _DRAWN,
        "publish_cost_grid_pc": _DRAWN,
        "publish_global_plan": _DRAWN,
        "publish_transformed_plan": _DRAWN,
        "publish_input_params": _DRAWN,
        "marker_lifetime": _DRAWN,
    }
    MISSING: ClassVar[dict[str, str]] = {
        "prune_plan": _PATH_HANDLER,
        "prune_distance": _PATH_HANDLER,
        "forward_prune_distance": _PATH_HANDLER,
        "shorten_transformed_plan": _PATH_HANDLER,
        "stateful": "stateful of the goal checker",
    }
    OFFERED: ClassVar[tuple[str, ...]] = (*(name.removesuffix("Critic") for name in _CRITICS), *_CRITICS)

    @model_validator(mode="after")
    def _few_enough(self) -> DWBParameters:
        samples = max(2, self.vx_samples) * max(2, self.vtheta_samples)
        if self.max_vel_y > self.min_vel_y:
            samples *= max(2, self.vy_samples)
        if samples > MOST_SAMPLES:
            raise ValueError(
                f"vx_samples, vy_samples and vtheta_samples are {samples} velocities together; {MOST_SAMPLES} at most"
            )
        return self

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its critics."""
        found: Readers = {}
        listed = table.get("critics", ())
        for name in listed:
            space = table.get(name, {})
            kind = str(space.get("class", name) if isinstance(space, dict) else name)
            kind = kind if "Critic" in kind else f"{kind}Critic"
            found[name] = group_of("DWB critic", kind if ":" in kind else f"dwb_critics::{kind}", "critics")
        return found | twice(listed, "critics")

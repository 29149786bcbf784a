"""Parameters of `nav2_mppi_controller::MPPIController` and of all its parts, under Nav2's names and with the defaults of `main`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from clearway.errors import ClearwayError, shown, unknown
from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.plugins import twice
from clearway.quantities import Finite, NonNegative, Positive, Whole

_DRAWN = "nothing is drawn while it drives"
_PATH_HANDLER = "of jazzy's own path handler; main has it as a plug-in of the controller server, `FeasiblePathHandler`"


class CriticGroup(Group):
    """What every critic has."""

    enabled: bool = Field(default=True, description="whether it is asked")
    cost_power: Whole = Field(default=1, ge=0, le=20, description="power of its weighted cost; 0 counts as 1")


class ConstraintParameters(CriticGroup):
    """`ConstraintCritic` (src/critics/constraint_critic.cpp)."""

    cost_weight: Finite = Field(default=4.0, description="per m driven beyond the limits of speed")


class GoalParameters(CriticGroup):
    """`GoalCritic` (src/critics/goal_critic.cpp)."""

    cost_weight: Finite = Field(default=5.0, description="per m of mean distance from the goal")
    threshold_to_consider: NonNegative = Field(
        default=1.4, description="only where the path that is left is shorter, m"
    )


class GoalAngleParameters(CriticGroup):
    """`GoalAngleCritic` (src/critics/goal_angle_critic.cpp)."""

    cost_weight: Finite = Field(default=3.0, description="per rad of mean angle to the goal's heading")
    threshold_to_consider: NonNegative = Field(
        default=0.5, description="only where the path that is left is shorter, m"
    )
    symmetric_yaw_tolerance: bool = Field(default=False, description="whether the opposite heading is as good")


class PreferForwardParameters(CriticGroup):
    """`PreferForwardCritic` (src/critics/prefer_forward_critic.cpp)."""

    cost_weight: Finite = Field(default=5.0, description="per m driven backwards")
    threshold_to_consider: NonNegative = Field(default=0.5, description="only where the path that is left is longer, m")


class TwirlingParameters(CriticGroup):
    """`TwirlingCritic` (src/critics/twirling_critic.cpp)."""

    cost_weight: Finite = Field(default=10.0, description="per rad/s of mean yaw rate")


class VelocityDeadbandParameters(CriticGroup):
    """`VelocityDeadbandCritic` (src/critics/velocity_deadband_critic.cpp)."""

    cost_weight: Finite = Field(default=35.0, description="per m or rad that the speeds fall short")
    deadband_velocities: tuple[Finite, Finite, Finite] = Field(
        default=(0.0, 0.0, 0.0), description="least speeds of x, y, yaw that the base follows, m/s, m/s, rad/s"
    )


class CostParameters(CriticGroup):
    """`CostCritic` (src/critics/cost_critic.cpp)."""

    cost_weight: Finite = Field(default=3.81, description="of the mean cost, as a share of 254")
    consider_footprint: bool = Field(
        default=False, description="whether the outline is checked; else the inscribed circle"
    )
    critical_cost: Finite = Field(
        default=300.0, description="what a point counts instead of its cost, near a collision"
    )
    near_collision_cost: Whole = Field(
        default=253, ge=0, le=255, description="cost from which on a point is near a collision"
    )
    collision_cost: Finite = Field(default=1_000_000.0, description="what a sample counts that collides")
    near_goal_distance: NonNegative = Field(
        default=0.5, description="length of the path left below which cost doesn't count, m"
    )
    trajectory_point_step: Whole = Field(default=2, ge=1, description="every how manyth point is looked at")

    IGNORED: ClassVar[dict[str, str]] = {"inflation_layer_name": "a costmap has one inflation layer here"}


class ObstaclesParameters(CriticGroup):
    """`ObstaclesCritic` (src/critics/obstacles_critic.cpp)."""

    consider_footprint: bool = Field(
        default=False, description="whether the outline is checked; else the inscribed circle"
    )
    repulsion_weight: Finite = Field(default=1.5, description="per m of mean nearness within the inflation's radius")
    critical_weight: Finite = Field(default=20.0, description="per m of nearness within the margin, summed up")
    collision_cost: Finite = Field(default=100_000.0, description="what a sample counts as critical that collides")
    collision_margin_distance: Finite = Field(
        default=0.1, description="distance from obstacles below which it is critical, m"
    )
    near_goal_distance: NonNegative = Field(
        default=0.5, description="length of the path left below which nothing repels, m"
    )

    IGNORED: ClassVar[dict[str, str]] = {"inflation_layer_name": "a costmap has one inflation layer here"}


class PathAlignParameters(CriticGroup):
    """`PathAlignCritic` (src/critics/path_align_critic.cpp)."""

    cost_weight: Finite = Field(default=10.0, description="per m of mean distance from the path")
    max_path_occupancy_ratio: NonNegative = Field(
        default=0.07, description="share of blocked points above which it is silent"
    )
    offset_from_furthest: Whole = Field(default=20, ge=0, description="points that a sample must get along the path")
    trajectory_point_step: Whole = Field(default=4, ge=1, description="every how manyth point is looked at")
    threshold_to_consider: NonNegative = Field(default=0.5, description="only where the path that is left is longer, m")
    use_path_orientations: bool = Field(default=False, description="whether headings count, a rad like a m")


class PathFollowParameters(CriticGroup):
    """`PathFollowCritic` (src/critics/path_follow_critic.cpp)."""

    cost_weight: Finite = Field(default=5.0, description="per m from a sample's end to the point ahead")
    offset_from_furthest: Whole = Field(
        default=6, ge=0, description="points between the furthest that a sample gets to and it"
    )
    threshold_to_consider: NonNegative = Field(default=1.4, description="only where the path that is left is longer, m")


class PathAngleParameters(CriticGroup):
    """`PathAngleCritic` (src/critics/path_angle_critic.cpp)."""

    cost_weight: Finite = Field(default=2.2, description="per rad between a sample's last heading and the point ahead")
    offset_from_furthest: Whole = Field(
        default=4, ge=0, description="points between the furthest that a sample gets to and it"
    )
    threshold_to_consider: NonNegative = Field(default=0.5, description="only where the path that is left is longer, m")
    max_angle_to_furthest: NonNegative = Field(default=0.785398, description="angle now above which it speaks, rad")
    mode: Literal[0, 1, 2] = Field(
        default=0, description="0: ahead, 1: ahead or astern, 2: ahead or astern as the path's own headings say"
    )


CRITICS: dict[str, type[CriticGroup]] = {
    "ConstraintCritic": ConstraintParameters,
    "CostCritic": CostParameters,
    "GoalAngleCritic": GoalAngleParameters,
    "GoalCritic": GoalParameters,
    "ObstaclesCritic": ObstaclesParameters,
    "PathAlignCritic": PathAlignParameters,
    "PathAngleCritic": PathAngleParameters,
    "PathFollowCritic": PathFollowParameters,
    "PreferForwardCritic": PreferForwardParameters,
    "TwirlingCritic": TwirlingParameters,
    "VelocityDeadbandCritic": VelocityDeadbandParameters,
}


class MotionModelParameters(Group):
    """`mppi::DiffDriveMotionModel` and `mppi::OmniMotionModel` (include/nav2_mppi_controller/motion_models.hpp): nothing to set."""

    plugin: str = Field(
        default="mppi::DiffDriveMotionModel", description="mppi::DiffDrive-, Omni- or AckermannMotionModel"
    )


class AckermannParameters(MotionModelParameters):
    """`mppi::AckermannMotionModel`; in jazzy's files the namespace `AckermannConstraints`."""

    min_turning_r: Positive = Field(default=0.2, description="least turning radius, m")


class ValidatorParameters(Group):
    """`mppi::DefaultOptimalTrajectoryValidator` (include/nav2_mppi_controller/optimal_trajectory_validator.hpp)."""

    plugin: Literal["mppi::DefaultOptimalTrajectoryValidator"] = Field(
        default="mppi::DefaultOptimalTrajectoryValidator", description="what looks at the result before it is sent"
    )
    collision_lookahead_time: NonNegative = Field(default=2.0, description="how far ahead it looks, s")
    consider_footprint: bool = Field(
        default=False, description="whether the outline is checked; else the inscribed circle"
    )


class VisualizerParameters(Group):
    """`TrajectoryVisualizer`: nothing of it means anything here."""

    IGNORED: ClassVar[dict[str, str]] = {"trajectory_step": _DRAWN, "time_step": _DRAWN}


MOTION_MODELS: dict[str, type[MotionModelParameters]] = {
    "mppi::DiffDriveMotionModel": MotionModelParameters,
    "mppi::OmniMotionModel": MotionModelParameters,
    "mppi::AckermannMotionModel": AckermannParameters,
}
_OF_JAZZY = ("DiffDrive", "Omni", "Ackermann")
_CAR_OF_JAZZY = "AckermannConstraints"
_BY_DEFAULT = "diff_drive"


class MPPIParameters(Group):
    """`nav2_mppi_controller::MPPIController` (src/controller.cpp, optimizer.cpp, noise_generator.cpp, critic_manager.cpp)."""

    motion_model: str = Field(
        default=_BY_DEFAULT, description="namespace that names its plug-in; as in jazzy also DiffDrive, Omni, Ackermann"
    )
    critics: tuple[str, ...] = Field(default=(), description="names of critics, in the order in which they are asked")
    model_dt: Positive = Field(
        default=0.05, ge=0.001, le=10.0, description="time step of a sample, s; no shorter than a control period"
    )
    time_steps: Whole = Field(default=56, ge=2, le=10_000, description="time steps of a sample")
    batch_size: Whole = Field(default=1000, ge=1, le=1_000_000, description="samples of an iteration")
    iteration_count: Whole = Field(default=1, ge=1, le=1000, description="iterations of a decision")
    temperature: Positive = Field(default=0.3, description="how much dearer samples count, in costs")
    gamma: NonNegative = Field(default=0.015, description="weight of departing from the last control sequence")
    vx_max: Finite = Field(default=0.5, description="m/s forwards")
    vx_min: Finite = Field(default=-0.35, description="m/s, negative: backwards")
    vy_max: NonNegative = Field(default=0.5, description="m/s to either side, of an omnidirectional base only")
    wz_max: NonNegative = Field(default=1.9, description="rad/s to either side")
    ax_max: Finite = Field(default=3.0, description="gaining speed, m/s^2; its sign doesn't count")
    ax_min: Finite = Field(default=-3.0, description="losing speed, m/s^2; counts as negative")
    ay_max: Finite = Field(default=3.0, description="gaining speed sideways, m/s^2")
    ay_min: Finite = Field(default=-3.0, description="losing speed sideways, m/s^2; counts as negative")
    az_max: NonNegative = Field(default=3.5, description="rad/s^2")
    vx_std: Positive = Field(default=0.2, description="standard deviation of the sampled vx, m/s")
    vy_std: Positive = Field(default=0.2, description="of the sampled vy, m/s")
    wz_std: NonNegative = Field(default=0.4, description="of the sampled wz, rad/s")
    model_delay_vx: NonNegative = Field(default=0.0, le=60.0, description="how late the base acts on vx, s")
    model_delay_vy: NonNegative = Field(default=0.0, le=60.0, description="on vy, s")
    model_delay_wz: NonNegative = Field(default=0.0, le=60.0, description="on wz, s")
    clamp_raw_controls: bool = Field(
        default=False, description="whether a sampled control is cut to what the base can follow"
    )
    retry_attempt_limit: Whole = Field(
        default=1, ge=0, le=1000, description="tries after a failed one, from standing anew"
    )
    regenerate_noises: bool = Field(
        default=False, description="whether each iteration draws anew; else only a reset does"
    )
    open_loop: bool = Field(default=False, description="whether the last command is taken for the robot's velocity")
    sgf_order: Whole = Field(default=2, description="order of the smoothing filter, 1 or 2; anything else counts as 2")
    reset_period: Positive | None = Field(
        default=None, description="humble's: a silence after which it begins anew, s (there 1.0); main has none"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "visualize": _DRAWN,
        "critic_index_to_visualize": _DRAWN,
        "verbose": "nobody reads the log",
        "publish_optimal_trajectory": "there are no topics here",
        "transform_tolerance": "there are no transforms to wait for",
    }
    MISSING: ClassVar[dict[str, str]] = {
        "PathAlignLegacyCritic": "PathAlignCritic (the legacy one is in humble only)",
        "prune_distance": _PATH_HANDLER,
        "max_robot_pose_search_dist": _PATH_HANDLER,
        "enforce_path_inversion": _PATH_HANDLER,
        "inversion_xy_tolerance": _PATH_HANDLER,
        "inversion_yaw_tolerance": _PATH_HANDLER,
    }
    OFFERED: ClassVar[tuple[str, ...]] = tuple(CRITICS)
    JAZZY: ClassVar[dict[str, Any]] = {"motion_model": "DiffDrive"}

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its critics, its motion model, validator and visualiser."""
        found: Readers = {
            "TrajectoryValidator": ValidatorParameters,
            "TrajectoryVisualizer": VisualizerParameters,
        }
        if _CAR_OF_JAZZY in table:  # it stands in files of bases that are no cars, too
            found[_CAR_OF_JAZZY] = AckermannParameters
        found |= _motion_model(table)
        listed = table.get("critics", ())
        for name in listed:
            if name in CRITICS:
                found[name] = CRITICS[name]
            elif name in cls.MISSING:
                found[name] = ClearwayError(
                    f"asks for {name!r}, which is not built; closest is {cls.MISSING[name]}", field="critics"
                )
            else:
                found[name] = unknown("critic", str(name), CRITICS, field="critics")
        return found | twice(listed, "critics")


def _motion_model(table: dict[str, Any]) -> Readers:
    """The namespace of the motion model, and what reads it; nothing does where it is none of the three, or nothing says which."""
    name = table.get("motion_model", _BY_DEFAULT)
    space = table.get(name, {})
    if name in _OF_JAZZY:
        return {_CAR_OF_JAZZY if name == "Ackermann" else name: MOTION_MODELS[f"mppi::{name}MotionModel"]}
    plugin = space.get("plugin") if isinstance(space, dict) else None
    if plugin is None and "motion_model" not in table:
        plugin = "mppi::DiffDriveMotionModel"
    if plugin not in MOTION_MODELS:
        wrong = ClearwayError(
            f"is {shown(plugin)}; write the motion model's plug-in there, one of {', '.join(MOTION_MODELS)}",
            field=f"{name}.plugin",
        )
        return {str(name): wrong}
    return {str(name): MOTION_MODELS[plugin]}


def motion_model_of(parameters: MPPIParameters, spaces: Mapping[str, Group]) -> str:
    """The motion model's plug-in, once all is read."""
    name = parameters.motion_model
    if name in _OF_JAZZY:
        return f"mppi::{name}MotionModel"
    space = spaces.get(name)
    return space.plugin if isinstance(space, MotionModelParameters) else "mppi::DiffDriveMotionModel"


def turning_radius(parameters: MPPIParameters, spaces: Mapping[str, Group], plugin: str) -> float:
    """The least turning radius of a car, m; 0 for another motion model."""
    space = spaces.get(_CAR_OF_JAZZY if parameters.motion_model in _OF_JAZZY else parameters.motion_model)
    return (
        space.min_turning_r
        if plugin == "mppi::AckermannMotionModel" and isinstance(space, AckermannParameters)
        else 0.0
    )

"""Parameters of Nav2's servers, those of their plug-ins apart (nav2_controller, nav2_planner, nav2_behaviors, nav2_bt_navigator)."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.plugins import named
from clearway.quantities import Finite, NonNegative, Positive, Whole

_TOPIC = "there are no topics here"
_FRAMES = "there are no transforms to wait for"
_WAITING = "nothing has to be waited for: whoever is asked answers at once"
_GROOT = "nobody watches the tree from outside"

PROGRESS = {"progress_checker": "nav2_controller::SimpleProgressChecker"}
GOAL = {"goal_checker": "nav2_controller::SimpleGoalChecker"}
CONTROLLER = {"FollowPath": "nav2_mppi_controller::MPPIController"}
HANDLER = {"PathHandler": "nav2_controller::FeasiblePathHandler"}
PLANNER = {"GridBased": "nav2_navfn_planner::NavfnPlanner"}
SMOOTHER = {"simple_smoother": "nav2_smoother::SimpleSmoother"}
BEHAVIORS = {
    "spin": "nav2_behaviors::Spin",
    "backup": "nav2_behaviors::BackUp",
    "drive_on_heading": "nav2_behaviors::DriveOnHeading",
    "wait": "nav2_behaviors::Wait",
}


class ControllerServer(Group):
    """`controller_server` (nav2_controller/src/parameter_handler.cpp)."""

    NOTES: ClassVar[dict[str, str]] = {
        "controller_frequency": "at most one command in a control period of the robot, however high it is"
    }

    controller_frequency: Positive = Field(default=20.0, description="Hz (at most one command per control period)")
    min_x_velocity_threshold: NonNegative = Field(
        default=0.0001, description="below it a measured speed counts as none, m/s"
    )
    min_y_velocity_threshold: NonNegative = Field(default=0.0001, description="likewise sideways, m/s")
    min_theta_velocity_threshold: NonNegative = Field(default=0.0001, description="likewise turning, rad/s")
    failure_tolerance: Finite = Field(
        default=0.0, description="how long a controller may find no command, s; 0: it may not, -1: as long as it likes"
    )
    publish_zero_velocity: bool = Field(default=True, description="whether the robot is stopped when following ends")
    search_window: NonNegative = Field(
        default=2.0, description="how far ahead along the path its nearest pose is looked for, m"
    )
    progress_checker_plugins: tuple[str, ...] = Field(
        default=tuple(PROGRESS),
        description="names of progress checkers; without any the robot may stand as long as it likes",
    )
    goal_checker_plugins: tuple[str, ...] = Field(default=tuple(GOAL), description="names of goal checkers")
    controller_plugins: tuple[str, ...] = Field(default=tuple(CONTROLLER), description="names of controllers")
    path_handler_plugins: tuple[str, ...] = Field(default=tuple(HANDLER), description="names of path handlers")

    IGNORED: ClassVar[dict[str, str]] = {
        "costmap_update_timeout": "the local costmap is never late",
        "speed_limit_topic": _TOPIC,
        "odom_topic": _TOPIC,
        "odom_duration": "the velocity is the robot's odometry as it comes",
    }
    JAZZY: ClassVar[dict[str, Any]] = {"FollowPath.plugin": "dwb_core::DWBLocalPlanner"}
    RENAMED: ClassVar[dict[str, str]] = {
        "progress_checker_plugin": "progress_checker_plugins",
        "goal_checker_plugin": "goal_checker_plugins",
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its plug-ins: progress checkers, goal checkers, controllers, path handlers."""
        roles = {
            "progress checker": ("progress_checker_plugins", PROGRESS),
            "goal checker": ("goal_checker_plugins", GOAL),
            "controller": ("controller_plugins", CONTROLLER),
            "path handler": ("path_handler_plugins", HANDLER),
        }
        found: Readers = {}
        for role, (field, usual) in roles.items():
            found |= named(role, table, table.get(field, tuple(usual)), field, usual)
        return found


class PlannerServer(Group):
    """`planner_server` (nav2_planner/src/parameter_handler.cpp)."""

    planner_plugins: tuple[str, ...] = Field(default=tuple(PLANNER), description="names of planners")
    allow_partial_planning: bool = Field(
        default=False,
        description="whether a path through several goals may end at one before the last, if it leads no further",
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "expected_planner_frequency": "only warns when planning takes longer",
        "costmap_update_timeout": "the global costmap is never late",
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its planners."""
        return named("planner", table, table.get("planner_plugins", tuple(PLANNER)), "planner_plugins", PLANNER)


class SmootherServer(Group):
    """`smoother_server` (nav2_smoother/src/nav2_smoother.cpp)."""

    smoother_plugins: tuple[str, ...] = Field(default=tuple(SMOOTHER), description="names of smoothers")

    IGNORED: ClassVar[dict[str, str]] = {
        "costmap_topic": "paths are smoothed on the global costmap",
        "footprint_topic": "a path is checked with the global costmap's footprint",
        "robot_base_frame": "the robot has one frame",
        "transform_tolerance": _FRAMES,
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its smoothers."""
        return named("smoother", table, table.get("smoother_plugins", tuple(SMOOTHER)), "smoother_plugins", SMOOTHER)


class Spin(Group):
    """`nav2_behaviors::Spin`; its limits are the server's."""


class DriveOnHeading(Group):
    """`nav2_behaviors::DriveOnHeading` and `nav2_behaviors::BackUp` (plugins/drive_on_heading.hpp)."""

    acceleration_limit: Finite = Field(default=2.5, description="m/s^2; its sign doesn't count")
    deceleration_limit: Finite = Field(default=-2.5, description="m/s^2; its sign doesn't count")
    minimum_speed: NonNegative = Field(default=0.1, description="m/s")


class Wait(Group):
    """`nav2_behaviors::Wait`."""


class AssistedTeleop(Group):
    """`nav2_behaviors::AssistedTeleop`: read, as it stands in Nav2's own file, and never called: nobody holds a joystick."""


class BehaviorServer(Group):
    """`behavior_server` (nav2_behaviors/src/behavior_server.cpp, plugins/spin.cpp)."""

    cycle_frequency: Positive = Field(default=10.0, description="Hz (at most one command per control period)")
    behavior_plugins: tuple[str, ...] = Field(default=tuple(BEHAVIORS), description="names of behaviours")
    simulate_ahead_time: NonNegative = Field(
        default=2.0, description="how far ahead a behaviour looks for a collision, s"
    )
    max_rotational_vel: NonNegative = Field(default=1.0, description="of a spin, rad/s")
    min_rotational_vel: NonNegative = Field(default=0.4, description="of a spin, rad/s")
    rotational_acc_lim: NonNegative = Field(default=3.2, description="of a spin, rad/s^2")

    IGNORED: ClassVar[dict[str, str]] = {
        "local_costmap_topic": _TOPIC,
        "global_costmap_topic": _TOPIC,
        "local_footprint_topic": _TOPIC,
        "global_footprint_topic": _TOPIC,
        "costmap_topic": _TOPIC,
        "footprint_topic": _TOPIC,
        "local_frame": "a behaviour drives in the local costmap's frame",
        "global_frame": "a behaviour drives in the local costmap's frame",
        "robot_base_frame": "the robot has one frame",
        "transform_tolerance": _FRAMES,
        "transform_timeout": _FRAMES,
        "projection_time": "nobody holds a joystick",
        "simulation_time_step": "nobody holds a joystick",
        "cmd_vel_teleop": "nobody holds a joystick",
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its behaviours."""
        return named("behavior", table, table.get("behavior_plugins", tuple(BEHAVIORS)), "behavior_plugins", BEHAVIORS)


TREE = "navigate_to_pose_w_replanning_and_recovery.xml"


class BtNavigator(Group):
    """`bt_navigator` (nav2_bt_navigator/src/bt_navigator.cpp, nav2_behavior_tree/.../bt_action_server_impl.hpp)."""

    bt_loop_duration: Whole = Field(default=10, ge=1, description="period of the tree's ticks, ms")
    default_nav_to_pose_bt_xml: str = Field(
        default=TREE, min_length=1, description="the tree: a file, or by its file's name one that ships with Nav2"
    )
    goal_reached_tol: Finite = Field(
        default=0.25,
        description="distance to the goal up to which the tree's node GoalReached says yes, m; its sign doesn't count",
    )
    filter_duration: NonNegative = Field(default=0.3, description="over which the tree takes the mean of the speed, s")

    IGNORED: ClassVar[dict[str, str]] = {
        "global_frame": "goals are given in the map",
        "robot_base_frame": "the robot has one frame",
        "transform_tolerance": _FRAMES,
        "odom_topic": _TOPIC,
        "default_server_timeout": _WAITING,
        "default_cancel_timeout": _WAITING,
        "wait_for_service_timeout": _WAITING,
        "always_reload_bt_xml": "the tree is read once",
        "bt_log_idle_transitions": "nobody reads the log",
        "bt_search_directories": "trees that ship with Nav2 are here by their file's name; any other is found beside the file",
        "plugin_lib_names": "the nodes of the trees that ship with Nav2 are all there",
        "error_code_name_prefixes": "errors have no codes here",
        "error_code_names": "errors have no codes here",
        "goal_blackboard_id": "its name is seen by nobody",
        "goals_blackboard_id": "its name is seen by nobody",
        "path_blackboard_id": "its name is seen by nobody",
        "default_nav_through_poses_bt_xml": "a robot is given one goal at a time here",
        "navigators": "there is one navigator, to one pose",
        "navigate_to_pose": _GROOT,
        "navigate_through_poses": "a robot is given one goal at a time here",
        "enable_groot_monitoring": _GROOT,
        "groot_zmq_publisher_port": _GROOT,
        "groot_zmq_server_port": _GROOT,
        "allow_navigator_preemption": "there is one navigator, to one pose",
        "navigator_preemption_timeout": "there is one navigator, to one pose",
    }
    RENAMED: ClassVar[dict[str, str]] = {"default_bt_xml_filename": "default_nav_to_pose_bt_xml"}

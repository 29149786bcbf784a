"""Who moves: kinematics, limits, footprint, sensors. One TOML file a robot."""

from clearway.robots.drive_limits import DriveKind, DriveLimits, immediate, possible
from clearway.robots.drive_spec import DriveSpec
from clearway.robots.robot import (
    Camera,
    GoalChecker,
    LatencySpec,
    Lidar,
    Odometry,
    Robot,
    Tolerances,
    load_robot,
    overridden,
    robot_names,
)
from clearway.robots.tables import RobotTable

__all__ = [
    "Camera",
    "DriveKind",
    "DriveLimits",
    "DriveSpec",
    "GoalChecker",
    "LatencySpec",
    "Lidar",
    "Odometry",
    "Robot",
    "RobotTable",
    "Tolerances",
    "immediate",
    "load_robot",
    "overridden",
    "possible",
    "robot_names",
]

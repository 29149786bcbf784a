"""Who moves: kinematics, limits, footprint, sensors. One TOML file a robot."""

from clearway.robots.drive_limits import DriveLimits, immediate
from clearway.robots.robot import (
    Camera,
    DriveSpec,
    GoalChecker,
    LatencySpec,
    Lidar,
    Odometry,
    Robot,
    Tolerances,
    load_robot,
    robot_names,
)
from clearway.robots.tables import RobotTable

__all__ = [
    "Camera",
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
    "robot_names",
]

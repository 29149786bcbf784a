"""Who moves: kinematics, limits, footprint, sensors. One TOML file a robot."""

from clearway.robots.robot import Camera, DriveLimits, Lidar, Odometry, Robot, Tolerances, load_robot, robot_names
from clearway.robots.tables import RobotTable

__all__ = [
    "Camera",
    "DriveLimits",
    "Lidar",
    "Odometry",
    "Robot",
    "RobotTable",
    "Tolerances",
    "load_robot",
    "robot_names",
]

"""Who moves: kinematics, limits, footprint, sensors. One TOML file a robot."""

from clearway.robots.robot import Camera, Drive, Lidar, Odometry, Robot, Tolerances, load_robot, robot_names

__all__ = ["Camera", "Drive", "Lidar", "Odometry", "Robot", "Tolerances", "load_robot", "robot_names"]

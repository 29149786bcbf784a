"""A robot's own ROS 1 files, as they lie in its package: found, read, and told of."""

from clearway.navigators.move_base.ros.files import is_ros_folder, yaml_files
from clearway.navigators.move_base.ros.parameters import read, table

__all__ = ["is_ros_folder", "read", "table", "yaml_files"]

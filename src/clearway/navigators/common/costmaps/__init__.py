"""Layered costmaps as ROS has them, footprints on them, and what of a plan lies within one."""

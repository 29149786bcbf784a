"""Names of ROS 1's move_base (ros-planning/navigation, noetic) that are not read here, and why."""

from __future__ import annotations

_NOBODY = "nobody looks at it"
_TOPIC = "there are no topics: the sensor is the robot's lidar, the map is the one that it is given"
_FRAMES = "there are no transforms to wait for"
_FLAT = "a lidar sees at its own height, and what it sees is marked"

MOVE_BASE = {
    "shutdown_costmaps": "the costmaps are kept while nothing is driven",
    "make_plan_clear_costmap": "nobody asks for a plan alone",
    "make_plan_add_unreachable_goal": "nobody asks for a plan alone",
    "restore_defaults": "nothing is set while it drives",
    "robot_base_frame": "the robot has one frame",
    "global_frame": "goals are given in the map",
    "controller_lock": "nothing else drives the robot",
}
COSTMAP = {
    "map_type": "the layers say it",
    "static_map": "the layers say it",
    "robot_base_frame": "the robot has one frame",
    "map_topic": _TOPIC,
    "publish_frequency": _NOBODY,
    "always_send_full_costmap": _NOBODY,
    "map_vis_z": _NOBODY,
    "transform_tolerance": _FRAMES,
    "unknown_cost_value": "the map says which cells are unknown",
    "publish_voxel_map": _NOBODY,
    "origin_z": _FLAT,
    "z_resolution": _FLAT,
    "z_voxels": _FLAT,
    "unknown_threshold": _FLAT,
    "mark_threshold": _FLAT,
    "max_obstacle_height": _FLAT,
    "min_obstacle_height": _FLAT,
}
LAYER = {
    "map_topic": _TOPIC,
    "subscribe_to_updates": _TOPIC,
    "first_map_only": _TOPIC,
    "unknown_cost_value": "the map says which cells are unknown",
    "publish_voxel_map": _NOBODY,
    "origin_z": _FLAT,
    "z_resolution": _FLAT,
    "z_voxels": _FLAT,
    "unknown_threshold": _FLAT,
    "mark_threshold": _FLAT,
    "max_obstacle_height": _FLAT,
    "min_obstacle_height": _FLAT,
    "transform_tolerance": _FRAMES,
}
SOURCE = {
    "topic": _TOPIC,
    "sensor_frame": _FRAMES,
    "data_type": "the sensor is the robot's lidar",
    "expected_update_rate": "the lidar never falls silent",
    "min_obstacle_height": _FLAT,
    "max_obstacle_height": _FLAT,
}
LOCAL_PLANNER = {
    "publish_traj_pc": _NOBODY,
    "publish_cost_grid": _NOBODY,
    "publish_cost_grid_pc": _NOBODY,
    "global_frame_id": _FRAMES,
    "odom_topic": _TOPIC,
    "restore_defaults": "nothing is set while it drives",
    "penalize_negative_x": "read by nothing in the real planner either",
    "acc_limit_trans": "read by nothing in the real planner either",
}
GLOBAL_PLANNER = {
    "visualize_potential": _NOBODY,
    "publish_potential": _NOBODY,
    "publish_scale": _NOBODY,
    "planner_window_x": "read by nothing in the real planner either",
    "planner_window_y": "read by nothing in the real planner either",
    "planner_costmap_publish_frequency": _NOBODY,
}
RENAMED = {
    "max_trans_vel": "max_vel_trans",
    "min_trans_vel": "min_vel_trans",
    "max_rot_vel": "max_vel_theta",
    "min_rot_vel": "min_vel_theta",
    "max_vel_rot": "max_vel_theta",
    "min_vel_rot": "min_vel_theta",
    "rot_stopped_vel": "theta_stopped_vel",
    "acc_lim_th": "acc_lim_theta",
    "vtheta_samples": "vth_samples",
}
"""Names of DWAPlannerROS in older versions, which noetic does not read, and what they are called now."""

LAYERS = {
    "costmap_2d::StaticLayer": "static_layer",
    "costmap_2d::ObstacleLayer": "obstacle_layer",
    "costmap_2d::VoxelLayer": "obstacle_layer",
    "costmap_2d::InflationLayer": "inflation_layer",
}
"""Layers that are built, by what plays their part."""

CLOSEST = {
    "range_sensor_layer::RangeSensorLayer": "costmap_2d::ObstacleLayer, with the lidar",
    "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer": "costmap_2d::VoxelLayer",
    "rtabmap_ros::StaticLayer": "costmap_2d::StaticLayer",
    "social_navigation_layers::ProxemicLayer": "nothing: no layer knows people",
    "social_navigation_layers::PassingLayer": "nothing: no layer knows people",
    "teb_local_planner/TebLocalPlannerROS": "dwa_local_planner/DWAPlannerROS",
    "eband_local_planner/EBandPlannerROS": "dwa_local_planner/DWAPlannerROS",
    "pal_local_planner/PalLocalPlannerROS": "dwa_local_planner/DWAPlannerROS",
    "carrot_planner/CarrotPlanner": "global_planner/GlobalPlanner",
    "sbpl_lattice_planner/SBPLLatticePlanner": "global_planner/GlobalPlanner",
    "SBPLLatticePlanner": "global_planner/GlobalPlanner",
    "move_slow_and_clear/MoveSlowAndClear": "clear_costmap_recovery/ClearCostmapRecovery",
}
"""Plug-ins that are not built, and what is closest."""

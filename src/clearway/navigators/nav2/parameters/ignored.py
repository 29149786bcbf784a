"""What of a Nav2 file has no meaning here, whole nodes and the names that every node has."""

from __future__ import annotations

_LOCALISER = "where the robot is, Clearway's own localiser says"

EVERYWHERE = {
    "use_sim_time": "there is one clock",
    "introspection_mode": "nobody looks into the node",
    "service_introspection_mode": "nobody looks into the node",
    "enable_stamped_cmd_vel": "there are no topics here",
    "allow_parameter_qos_overrides": "there are no topics here",
    "qos_overrides": "there are no topics here",
    "use_realtime_priority": "nothing competes for the processor",
    "action_server_result_timeout": "a result is taken at once",
    "bond_heartbeat_period": "no node can fail on its own",
    "bond_timeout": "no node can fail on its own",
    "autostart_node": "all that is read is started",
    "start_type_description_service": "nobody looks into the node",
    "warn_on_missing_params": "what a file leaves out has its default",
    "strict_param_loading": "what a file leaves out has its default",
}
"""Names that every node of Nav2 has."""

AMCL = {
    "alpha1": "odom_alpha1",
    "alpha2": "odom_alpha2",
    "alpha3": "odom_alpha3",
    "alpha4": "odom_alpha4",
    "alpha5": "odom_alpha5",
    "robot_model_type": "odom_model_type",
    "min_particles": "min_particles",
    "max_particles": "max_particles",
    "pf_err": "kld_err",
    "pf_z": "kld_z",
    "update_min_d": "update_min_d",
    "update_min_a": "update_min_a",
    "resample_interval": "resample_interval",
    "laser_model_type": "laser_model_type",
    "laser_max_range": "laser_max_range",
    "laser_min_range": "laser_min_range",
    "max_beams": "laser_max_beams",
    "z_hit": "laser_z_hit",
    "z_short": "laser_z_short",
    "z_max": "laser_z_max",
    "z_rand": "laser_z_rand",
    "sigma_hit": "laser_sigma_hit",
    "lambda_short": "laser_lambda_short",
    "laser_likelihood_max_dist": "laser_likelihood_max_dist",
    "recovery_alpha_slow": "recovery_alpha_slow",
    "recovery_alpha_fast": "recovery_alpha_fast",
}
"""Names of nav2_amcl and what the robot's file calls them, under [localisation.amcl]."""

NODES = {
    "amcl": _LOCALISER,
    "amcl_map_client": _LOCALISER,
    "amcl_rclcpp_node": _LOCALISER,
    "slam_toolbox": _LOCALISER,
    "ekf_filter_node": _LOCALISER,
    "map_server": "the map is that of the floor plan, or the one that is granted",
    "map_saver": "maps are built by `clearway map`",
    "keepout_filter_mask_server": "there are no zones on the maps here",
    "keepout_costmap_filter_info_server": "there are no zones on the maps here",
    "speed_filter_mask_server": "there are no zones on the maps here",
    "speed_costmap_filter_info_server": "there are no zones on the maps here",
    "filter_mask_server": "there are no zones on the maps here",
    "costmap_filter_info_server": "there are no zones on the maps here",
    "lifecycle_manager": "all that is read is started",
    "lifecycle_manager_navigation": "all that is read is started",
    "lifecycle_manager_localization": "all that is read is started",
    "waypoint_follower": "a robot is given one goal at a time here",
    "smoother_server": "the behaviour tree has no path smoothed but by its planner",
    "route_server": "the behaviour tree asks for no route",
    "docking_server": "there are no docks",
    "following_server": "there is nobody to follow",
    "loopback_simulator": "Clearway simulates",
    "robot_state_publisher": "the robot is Clearway's",
    "bt_navigator_navigate_through_poses_rclcpp_node": "the tree asks no ROS node",
    "bt_navigator_navigate_to_pose_rclcpp_node": "the tree asks no ROS node",
    "bt_navigator_rclcpp_node": "the tree asks no ROS node",
    "controller_server_rclcpp_node": "there is one node a server",
    "planner_server_rclcpp_node": "there is one node a server",
    "local_costmap_client": "there is one node a costmap",
    "local_costmap_rclcpp_node": "there is one node a costmap",
    "global_costmap_client": "there is one node a costmap",
    "global_costmap_rclcpp_node": "there is one node a costmap",
}
"""Nodes that are ignored as a whole."""

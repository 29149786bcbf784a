"""Global planners over a costmap by a potential: NavFn and ROS 1's GlobalPlanner."""

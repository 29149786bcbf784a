#!/usr/bin/env bash
# make.sh NAVIGATION2 PYTHON: builds the recorders from a checkout of ros-navigation/navigation2 and records anew.
# Needs g++ and Eigen (Debian: g++, libeigen3-dev; recorded with 12.2 and 3.4.0), and Clearway installed for PYTHON.
set -euo pipefail
nav2=$(realpath "$1") python=$2 here=$(realpath "$(dirname "$0")") build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
mkdir -p "$build/ros/nav2_mppi_controller/tools"
cp "$here/ros.hpp" "$build/ros/"
cp "$here/parameters_handler.hpp" "$build/ros/nav2_mppi_controller/tools/"
# Every header of ROS that is asked for is the one that stands in for all of them.
for header in angles/angles.h builtin_interfaces/msg/time.hpp \
  geometry_msgs/msg/{accel_stamped,point,pose,pose_stamped,twist,twist_stamped}.hpp nav_msgs/msg/{path,trajectory}.hpp \
  nav2_costmap_2d/{costmap_2d,exceptions,footprint,inflation_layer,inflation_layer_interface}.hpp \
  nav2_msgs/msg/critics_stats.hpp nav2_ros_common/{lifecycle_node,node_utils,tf2_factories}.hpp \
  nav2_util/{geometry_utils,odometry_utils,path_utils,robot_utils}.hpp pluginlib/{class_list_macros,class_loader}.hpp \
  rclcpp/{parameter_value,rclcpp}.hpp rclcpp_lifecycle/lifecycle_node.hpp std_msgs/msg/bool.hpp tf2/utils.hpp \
  tf2_geometry_msgs/tf2_geometry_msgs.hpp visualization_msgs/msg/marker_array.hpp; do
  mkdir -p "$build/ros/$(dirname "$header")"
  echo '#include "ros.hpp"' >"$build/ros/$header"
done
# These are Nav2's own.
mkdir -p "$build/ros/nav2_core"
cp "$nav2"/nav2_core/include/nav2_core/{controller,goal_checker,controller_exceptions}.hpp "$build/ros/nav2_core/"
cp "$nav2"/nav2_costmap_2d/include/nav2_costmap_2d/{footprint_collision_checker,cost_values}.hpp "$build/ros/nav2_costmap_2d/"
mkdir -p "$build/ros/nav2_costmap_2d/costmap_filters"
cp "$nav2"/nav2_costmap_2d/include/nav2_costmap_2d/costmap_filters/filter_values.hpp "$build/ros/nav2_costmap_2d/costmap_filters/"
cp "$nav2"/nav2_util/include/nav2_util/{controller_utils,line_iterator,parameter_handler}.hpp "$build/ros/nav2_util/"
for header in ros cost_values footprint_collision_checker; do
  echo "#include \"$([ $header = ros ] || echo nav2_costmap_2d/)$header.hpp\""
done | sed '1i #pragma once' >"$build/ros/nav2_costmap_2d/costmap_2d_ros.hpp"
compile() { g++ -std=c++17 -O2 -w -I"$build/ros" -I/usr/include/eigen3 "$@" "$nav2/nav2_costmap_2d/src/footprint_collision_checker.cpp" -lpthread; }
mppi=$nav2/nav2_mppi_controller pursuit=$nav2/nav2_regulated_pure_pursuit_controller
compile -I"$mppi/include" "$here/mppi.cpp" "$mppi"/src/{optimizer,noise_generator,critic_manager,motion_models}.cpp \
  "$mppi"/src/critics/*.cpp "$mppi"/src/trajectory_validators/*.cpp -o "$build/mppi"
compile -I"$pursuit/include" "$here/pursuit.cpp" "$pursuit"/src/*.cpp "$nav2/nav2_util/src/controller_utils.cpp" -o "$build/pursuit"
PYTHONPATH="$here/../..${PYTHONPATH:+:$PYTHONPATH}" "$python" "$here/make.py" "$build"

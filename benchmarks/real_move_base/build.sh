#!/usr/bin/env bash
# Builds the real move_base from its sources on Debian 12, as root, with Debian's own packages of ROS 1, and the recorder beside it:
# 7 minutes of one core.
#   bash build.sh FOLDER [SOURCE]     SOURCE: a clone of ros-planning/navigation, or where to clone it from
set -euo pipefail
folder=$(realpath -m "${1:?bash build.sh FOLDER [SOURCE]}")
here=$(realpath "$(dirname "$0")")
source=${2:-https://github.com/ros-planning/navigation}
apt-get update -qq
apt-get install -y -qq --no-install-recommends g++ make cmake git ros-core-dev catkin python3-rospy python3-rosmaster \
  python3-actionlib python3-dynamic-reconfigure python3-move-base-msgs python3-nav-msgs python3-std-srvs python3-tf2-ros \
  python3-tf2-geometry-msgs libtf2-ros-dev libtf2-geometry-msgs-dev libtf2-sensor-msgs-dev libactionlib-dev libmap-msgs-dev \
  libmove-base-msgs-dev liblaser-geometry-dev libdynamic-reconfigure-config-init-mutex-dev libangles-dev pluginlib-dev \
  libclass-loader-dev libnodelet-dev libbondcpp-dev libdiagnostic-updater-dev liborocos-bfl-dev libeigen3-dev \
  libyaml-cpp-dev libbullet-dev zlib1g-dev libsdl1.2-dev libsdl-image1.2-dev
mkdir -p "$folder/src"
[ -d "$folder/src/navigation" ] || git clone -q "$source" "$folder/src/navigation"
git -C "$folder/src/navigation" checkout -q 9ad644198e132d0e950579a3bc72c29da46e60b0
ln -sfn "$here/recorder" "$folder/src/recorder"
cd "$folder"
env -u PYTHONPATH PATH=/usr/sbin:/usr/bin:/sbin:/bin catkin_make_isolated --install \
  -DCMAKE_BUILD_TYPE=Release -DCATKIN_ENABLE_TESTING=OFF -DPYTHON_EXECUTABLE=/usr/bin/python3 -j1

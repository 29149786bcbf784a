"""Nav2's layered costmaps, on the pieces that they share with ROS 1's (`navigators/common/costmaps`)."""

"""What a simulated ROS robot says and hears, whatever carries it: ROS 2's DDS or Zenoh (`live/ros2/`), ROS 1's TCPROS (`live/ros1/`)."""

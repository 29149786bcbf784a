"""ROS 2 without ROS: its messages, topics and actions over DDS, by Eclipse Cyclone DDS (the extra `ros2`)."""

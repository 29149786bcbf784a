"""ROS 1 without ROS: its master's and nodes' XML-RPC, its topics over TCP (TCPROS), move_base's action, by the standard library."""

"""move_base's local planners: the dynamic window, and the trajectory roll-out that it comes from."""

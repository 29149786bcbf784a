"""The scene of `world_speed.py`, as each of those that are compared has it."""

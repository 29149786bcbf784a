"""What a step of the robot may meet: what stands, what moves, what is out of sight, and how far it is to the goal past it."""

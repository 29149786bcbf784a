"""What the robot makes of its sensing: localisers (truth, odometry, AMCL) and mapping."""

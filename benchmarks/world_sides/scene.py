"""What the scene is made of, in SI units."""

HALF, LANE_END, RADIUS, PERIOD, BEAMS, RANGE, SIGMA = 5.0, 4.5, 0.2, 0.1, 180, 10.0, 0.01
V, OMEGA = 0.3, 1.0
WORLDS, EPISODE = 16, 600  # of a learner: how many side by side, and periods in an episode
LANES = [((1 if i % 2 else -1) * (1.2 + 0.45 * (i // 2)), 0.5 + 0.05 * i) for i in range(16)]  # y [m], speed [m/s]

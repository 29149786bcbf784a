"""HP+TMPC in a control loop of your own, without the simulator: observation in, command out."""

import math

import numpy as np

from clearway.contract import Goal, Observation, Obstacles, Task
from clearway.navigators import HpTmpc
from clearway.robots import load_robot

robot = load_robot("rescue")  # or the path of your robot's file
goal = Goal(pose=np.array([5.0, 0.0, 0.0]), xy_tolerance=0.2, yaw_tolerance=math.inf)
navigator = HpTmpc()
navigator.reset(Task(robot.period, speed_limit=1.0, start=np.zeros(3)), robot, np.random.default_rng(0))

pose, velocity, t, nearest = np.zeros(3), np.zeros(2), 0.0, math.inf
while math.dist(pose[:2], goal.pose[:2]) > goal.xy_tolerance:
    walker = np.array([[2.5, 1.8 - 0.4 * t]])  # from your tracker: someone crosses the way
    seen = Obstacles(
        position=walker, velocity=np.array([[0.0, -0.4]]), radius=np.array([0.35]), error=np.array([0.01]),
        velocity_error=np.array([0.1]), identity=np.array([7]), moving=np.array([True]),
    )  # fmt: skip
    command = navigator.step(Observation(t, pose, velocity, pose, goal, obstacles=seen))
    velocity = np.array([command.v, command.omega])  # to your robot; here it does as it is told
    v, turn = robot.period * command.v, robot.period * command.omega
    pose = pose + np.array([v * math.cos(pose[2] + turn / 2), v * math.sin(pose[2] + turn / 2), turn])
    t, nearest = t + robot.period, min(nearest, math.dist(pose[:2], walker[0]) - 0.35 - 0.25)
print(f"arrived after {t:.1f} s; the walker was never nearer than {nearest:.2f} m ({command.status})")

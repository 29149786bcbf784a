"""An own navigator in twenty lines: drive to the goal, give way to what stands ahead.

clearway check examples/02_own_navigator.py:Careful
clearway run hospital --navigator examples/02_own_navigator.py:Careful --navigator move-base --batch NO
"""

import math

import numpy as np

from clearway.contract import Command, Observation, Task
from clearway.robots import Robot


class Careful:
    needs = frozenset({"scan"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.v_max = min(task.speed_limit, robot.drive.v_max)
        self.omega_max = min(1.0, robot.drive.omega_max)

    def step(self, observation: Observation) -> Command:
        x, y, theta = observation.pose
        goal, scan = observation.goal, observation.scan
        distance = math.hypot(goal.pose[0] - x, goal.pose[1] - y)
        near = distance < 0.5 * goal.xy_tolerance
        towards = goal.pose[2] if near else math.atan2(goal.pose[1] - y, goal.pose[0] - x)
        error = math.remainder(towards - theta, math.tau)
        bearings = scan.angle_min + scan.angle_increment * np.arange(scan.ranges.size)
        ahead = scan.ranges[np.abs(bearings) < 0.5].min(initial=math.inf)
        free = max(0.0, ahead - 0.6)  # stops half a metre before whatever is ahead
        v = 0.0 if near else min(self.v_max, distance, free) * max(0.0, math.cos(error))
        return Command(v, max(-self.omega_max, min(self.omega_max, 2.0 * error)))

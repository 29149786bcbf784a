"""Says whether two robots can both end where they are to, as each stays there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius, inscribed_radius
from clearway.robots import Robot
from clearway.scenarios.crowd import Standing
from clearway.scenarios.scenario import Scenario

FREE = 0.5
"""A heading with a tolerance beyond this is taken for free, rad."""
DIRECTIONS = 32
"""In so many directions one of two is moved away from the other."""


class End(NamedTuple):
    """Where a robot is to end.

    Attributes:
        name: Of the robot.
        shape: Its outline; where its heading is free, the disc about its origin that the outline holds in any case.
        pose: (3,) x, y [m], theta [rad] of its last goal.
        xy: How far from there it may come to rest, m.
        yaw: How far turned, rad.
    """

    name: str
    shape: Shape
    pose: FloatArray
    xy: float
    yaw: float

    @classmethod
    def of(cls, scenario: Scenario, robot: Robot) -> End:
        """That of a scenario's own robot, which is `robot`."""
        leg = scenario.legs[-1]
        xy, yaw = leg.tolerances(robot.tolerances)
        if leg.arrival == "measured":  # at any speed and in any heading; it comes to rest behind
            xy, yaw = xy + min(scenario.speed, robot.drive.v_max) ** 2 / (2.0 * robot.drive.deceleration), math.inf
        shape, turn = (robot.shape, yaw) if yaw <= FREE else (Circle(inscribed_radius(robot.shape)), 0.0)
        return cls(scenario.member, shape, np.array(leg.goal), xy, turn)

    def leaves_room(self, other: End) -> bool:
        """Whether the `other` can be where it is to end, too; in their favour, wherever both may be within their tolerances."""
        if math.dist(self.pose[:2], other.pose[:2]) > circumscribed_radius(self.shape) + circumscribed_radius(
            other.shape
        ):
            return True
        far = (self.xy + other.xy) / math.cos(math.pi / DIRECTIONS)  # a polygon around the circle of all directions
        angle = np.arange(DIRECTIONS) * math.tau / DIRECTIONS
        away = np.column_stack([far * np.cos(angle), far * np.sin(angle), np.zeros(DIRECTIONS)])
        turns = np.column_stack([np.zeros((3, 2)), (-1.0, 0.0, 1.0)])
        poses = np.concatenate([self.pose + away + self.yaw * turn for turn in turns])
        there = [Standing(other.name, other.shape, other.pose + other.yaw * turn) for turn in turns]
        nothing = np.zeros((len(poses), 0, 3))
        return any(min_clearance(self.shape, poses, [one], nothing).max() > 0.0 for one in there)

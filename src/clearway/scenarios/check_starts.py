"""Says what touches what as a trial begins, however its robots are placed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance, min_clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius
from clearway.robots import Robot, load_robot
from clearway.scenarios.crowd import Standing
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.scenario import Scenario

HEADINGS = 5
"""In so many headings a robot that may be turned is looked at."""


@dataclass(frozen=True, eq=False)
class Placed:
    """What is there at time 0.

    Attributes:
        called: Its name in a sentence.
        shape: In its own frame.
        pose: (3,) x, y [m], theta [rad] in the map.
        xy: How far from there it may be placed, m.
        yaw: How far turned, rad.
    """

    called: str
    shape: Shape
    pose: FloatArray
    xy: float = 0.0
    yaw: float = 0.0

    @property
    def turned(self) -> FloatArray:
        """(n, 3) its poses in some of the headings in which it may be."""
        return self.pose + np.linspace(-self.yaw, self.yaw, HEADINGS if self.yaw else 1)[:, None] * (0.0, 0.0, 1.0)

    @cached_property
    def loose(self) -> float:
        """How far each of its points may lie from where it is in one of these, m."""
        return self.xy + 2.0 * circumscribed_radius(self.shape) * math.sin(
            min(self.yaw / (HEADINGS - 1), math.pi) / 2.0
        )

    @cached_property
    def within(self) -> tuple[float, float, float]:
        """A disc in which it is, however it is placed: x, y, radius [m]."""
        return float(self.pose[0]), float(self.pose[1]), circumscribed_radius(self.shape) + self.loose


def robot_placed(scenario: Scenario, robot: Robot) -> Placed:
    """A scenario's own robot, which is `robot`, at its start."""
    turn = 0.0 if isinstance(robot.shape, Circle) else scenario.placement_yaw
    return Placed(robot.name, robot.shape, np.array(scenario.start), scenario.placement_xy, turn)


def robots_placed(scenario: Scenario, robot: Robot) -> list[Placed]:
    """The same, then the scenario's other robots, those that can be had."""
    found = [robot_placed(scenario, robot)]
    for spec, own in zip(scenario.robots, scenario.members()[1:], strict=True):
        with suppress(ClearwayError):  # is told of its field
            other = robot if spec.robot is None else load_robot(spec.robot)
            found.append(replace(robot_placed(own, other), called=repr(spec.name)))
    return found


def person_placed(person: PersonSpec) -> Placed | None:
    """Somebody at time 0; None: who was recorded is not there."""
    at = np.array((*person.start, 0.0))
    if person.behaviour == "recorded":
        t, x, y = np.array(person.track).T
        if not t[0] <= 0.0 <= t[-1]:
            return None
        at = np.array((np.interp(0.0, t, x), np.interp(0.0, t, y), 0.0))
    return Placed(repr(person.name), Circle(person.radius), at)


def met(one: Placed, others: Sequence[Placed]) -> tuple[Placed, str] | None:
    """The first of `others` that `one` touches at time 0, with what is to be said of it: nothing where it does wherever robots are
    placed. None: it touches none."""
    x, y, radius = one.within
    for other in others:
        there_x, there_y, reach = other.within
        if math.hypot(x - there_x, y - there_y) > radius + reach:
            continue  # as most are
        gap = clearance(one.shape, one.pose, other.shape, other.pose)
        if gap <= 0.0:
            return other, ""
        if _least_gap(one, other) <= one.loose + other.loose:
            return other, f", as placement_xy and placement_yaw may have it: {gap:.3g} m are between them"
    return None


def _least_gap(one: Placed, other: Placed) -> float:
    turned = [Standing(other.called, other.shape, pose) for pose in other.turned]
    return float(min_clearance(one.shape, one.turned, turned, np.zeros((len(one.turned), 0, 3))).min())

"""What stands and moves around the robot in a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.contract import BodyKind
from clearway.geometry.shapes import Circle
from clearway.robots import Robot
from clearway.scenarios.plan import Fixture
from clearway.scenarios.scenario import ObstacleSpec, Scenario
from clearway.trials import Body
from clearway.world.behaviours.wishes import wish_of


def bodies_of(
    fixtures: Sequence[Fixture], scenario: Scenario, robots: Sequence[Robot] = (), member: int = 0
) -> tuple[Body, ...]:
    """Everything that a robot can hit: the plan's fixtures, the scenario's obstacles in their order, its people, its robots.

    Args:
        fixtures: The plan's.
        scenario: The test.
        robots: Of its own robot and of its other `robots`, in their order; default: it has none.
        member: Which of these the robot is that can hit all that.
    """
    fixed = [Body(f.name, BodyKind(f.kind), f.shape, np.array(f.pose, dtype=np.float64)) for f in fixtures]
    people = [
        Body(p.name, BodyKind.PERSON, Circle(p.radius), None, wish=wish_of(p, scenario.seed)) for p in scenario.people
    ]
    others = [
        Body(name, BodyKind.ROBOT, robot.shape, None)
        for i, (name, robot) in enumerate(zip(scenario.names(), robots, strict=False))
        if i != member
    ]
    return (*fixed, *(_body(o) for o in scenario.obstacles), *people, *others)


def moving_obstacles_of(scenario: Scenario) -> tuple[ObstacleSpec, ...]:
    """The moving ones among the scenario's obstacles: those without a pose."""
    return tuple(o for o in scenario.obstacles if o.pose is None)


def _body(obstacle: ObstacleSpec) -> Body:
    shape = obstacle.shape.shape()
    if obstacle.pose is None:
        return Body(obstacle.name, BodyKind.MOVING_OBSTACLE, shape, None)
    return Body(obstacle.name, BodyKind.OBSTACLE, shape, np.array(obstacle.pose, dtype=np.float64))

"""Which behaviour a scenario's word stands for."""

from __future__ import annotations

import math

from clearway.robots import load_robot
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.scenario import ObstacleSpec, RobotBodySpec, Scenario
from clearway.world.behaviours.behaviour import Behaviour
from clearway.world.behaviours.operator import Operator


def behaviours_of(scenario: Scenario) -> dict[int, Behaviour]:
    """A behaviour for each moving obstacle of `scenario` that decides, by its place among the moving ones."""
    moving = [o for o in scenario.obstacles if o.pose is None]
    return {m: _operator(o, o.behaviour, scenario) for m, o in enumerate(moving) if o.behaviour is not None}


def _operator(obstacle: ObstacleSpec, spec: OperatorSpec, scenario: Scenario) -> Behaviour:
    if isinstance(obstacle.shape, RobotBodySpec):  # its own base's limits, where they are known
        drive = load_robot(obstacle.shape.robot).drive
        own = {"acceleration": drive.acceleration, "deceleration": drive.deceleration}
        spec = spec.model_copy(update={name: value for name, value in own.items() if math.isfinite(value)})
    runs = {leg.name: [run for run in obstacle.runs if run.leg == leg.name] for leg in scenario.legs}
    return Operator(spec, obstacle.shape.shape(), runs, scenario.seed, obstacle.name)

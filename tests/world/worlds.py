"""A robot, a scenario and pilots that the tests of the world share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clearway.contract import Command, Decision, Sensing, Task
from clearway.geometry.shapes import FloatArray, Shape
from clearway.robots import Robot
from clearway.scenarios.scenario import Scenario
from clearway.trials import Body, Trial
from clearway.world import simulate_in
from clearway.world.bodies import bodies_of
from clearway.world.tracks import Tracks, stack, tracks

DRIVE = {
    "v_max": 2.0, "v_min": -1.0, "acceleration": 0.5, "deceleration": 2.0,
    "omega_max": 2.0, "angular_acceleration": 1.0, "angular_deceleration": 4.0,
}  # fmt: skip
SILENT = {"translation_per_metre": 0.0, "rotation_per_metre": 0.0, "rotation_per_radian": 0.0}


def make_robot(**changes: Any) -> Robot:
    table: dict[str, Any] = {
        "name": "test", "title": "Test", "d_base": 0.5, "footprint": {"kind": "circle", "radius": 0.25}, "period": 0.1,
        "drive": DRIVE, "odometry": SILENT, "tolerances": {"xy": 0.1, "yaw": 0.2},
        "lidar": {"beams": 91, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.05, "range_max": 10.0, "sigma": 0.0},
    }  # fmt: skip
    return Robot.model_validate(table | changes)


def make_scenario(**changes: Any) -> Scenario:
    table: dict[str, Any] = {
        "name": "test", "floor_plan": "nowhere", "start": (0.0, 0.0, 0.0), "speed": 1.0,
        "legs": [{"name": "forth", "goal": (3.0, 0.0, 0.0), "time_limit": 30.0}],
        "placement_xy": 0.0, "placement_yaw": 0.0, "seed": 5,
    }  # fmt: skip
    return Scenario.model_validate(table | changes)


class Pilot:
    """Decides by a function of the sensing; believes the truth."""

    def __init__(self, rule: Callable[[Sensing], Command]) -> None:
        self.rule, self.seen, self.task = rule, list[Sensing](), None

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.seen, self.task = [], task

    def decide(self, sensing: Sensing) -> Decision:
        self.seen.append(sensing)
        return Decision(self.rule(sensing), sensing.truth)


def constant(v: float, omega: float = 0.0) -> Pilot:
    return Pilot(lambda _: Command(v, omega))


def steer(sensing: Sensing) -> Command:
    """Straight at the goal, then turn."""
    x, y, theta = sensing.truth
    goal = sensing.goal.pose
    distance = math.hypot(goal[0] - x, goal[1] - y)
    if distance < 0.9 * sensing.goal.xy_tolerance:
        return Command(0.0, 1.5 * math.remainder(goal[2] - theta, 2 * math.pi))
    error = math.remainder(math.atan2(goal[1] - y, goal[0] - x) - theta, 2 * math.pi)
    return Command(min(1.0, distance) * max(0.0, math.cos(error)), 2.0 * error)


def body(shape: Shape, x: float, y: float, theta: float = 0.0, name: str = "thing", kind: str = "wall") -> Body:
    return Body(name, kind, shape, np.array([x, y, theta]))


def moving_obstacle(shape: Shape, name: str = "moving obstacle") -> Body:
    return Body(name, "moving obstacle", shape, None)


def run(
    pilot: Pilot, bodies: Sequence[Body] = (), scenario: Scenario | None = None, robot: Robot | None = None,
    knots: Sequence[FloatArray] | None = None, **more: Any,
) -> Trial:  # fmt: skip
    """A trial among `bodies`; the moving obstacles follow `knots`, one table each, in every leg, else the scenario's runs."""
    scenario = scenario or make_scenario()
    way: Tracks
    if knots is not None:
        way = stack([list(knots) for _ in scenario.legs])
    else:
        way = tracks([o for o in scenario.obstacles if o.pose is None], [leg.name for leg in scenario.legs])
    return simulate_in(
        bodies, way, scenario, robot or make_robot(), pilot, navigator="test", localisation="truth", **more
    )


def run_among(walls: Sequence[Body], pilot: Pilot, scenario: Scenario, robot: Robot) -> Trial:
    """A trial of `scenario` with its people, among `walls`, wherever its floor plan is."""
    way = tracks(
        [o for o in scenario.obstacles if o.pose is None],
        [leg.name for leg in scenario.legs],
        0.0,
        len(scenario.people),
    )
    bodies = [*walls, *bodies_of((), scenario)]
    return simulate_in(bodies, way, scenario, robot, pilot, navigator="test", localisation="truth")

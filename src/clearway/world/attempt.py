"""What a trial in simulation attempts, robot by robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.robots import Robot
from clearway.scenarios.scenario import Scenario
from clearway.trials import Attempt, Body, Labels, Leg

SHARP = 0.005
"""Relative error up to which a clairvoyant's limit is one to compare with."""


def attempt_of(
    scenario: Scenario,
    robot: Robot,
    bodies: Sequence[Body],
    *,
    navigator: str,
    localisation: str,
    privileged: bool = False,
    setup: str | None = None,
    tracking: str = "",
    run: str = "",
) -> Attempt:
    """What a trial in simulation attempts.

    Args:
        scenario: The test.
        robot: Who is to do it.
        bodies: What it can hit, as `clearway.world.bodies` has it.
        navigator: Who decides, by name.
        localisation: How the robot knows where it is, by name.
        privileged: Whether the navigator is told the truth about the obstacles' future.
        setup: The name of the bound on its thinking, None without one.
        tracking: How obstacles are followed, by name; empty if they aren't.
        run: The simulation that it shares with other robots, see `run_of`; empty: none.
    """
    optimal = scenario.optimal if scenario.optimal is not None and scenario.optimal.error <= SHARP else None
    legs: list[Leg] = []
    at = np.array(scenario.start, dtype=np.float64)
    for spec in scenario.legs:
        goal = np.array(spec.goal, dtype=np.float64)
        xy, yaw = spec.tolerances(robot.tolerances)
        told = spec.tolerances(robot.planner_tolerances)
        legs.append(Leg(spec.name, at, goal, xy, yaw, spec.scored, spec.time_limit, *told))
        at = goal
    return Attempt(
        labels=Labels(speed=scenario.speed, setup=setup, **scenario.labels.model_dump()),
        robot=robot.name,
        navigator=navigator,
        localisation=localisation,
        footprint=robot.shape,
        legs=tuple(legs),
        bodies=tuple(bodies),
        speed_limit=scenario.speed,
        period=robot.period,
        reference_length=scenario.reference_length,
        floor_plan=scenario.floor_plan,
        scenario=scenario.name,
        seed=scenario.seed,
        privileged=privileged,
        tracking=tracking,
        optimal_time=None if optimal is None else optimal.time,
        shortest_path=scenario.shortest,
        limits=robot.limits(scenario.speed),
        run=run,
        member=scenario.member if run else "",
        sight=robot.camera.range if robot.camera else robot.lidar.range_max if robot.lidar else None,
    )


def run_of(scenario: Scenario, robots: Sequence[Robot], navigators: Sequence[str], setup: str | None) -> str:
    """What the trials of all robots of `scenario` share, readable; empty if it has one only.

    Args:
        scenario: The test.
        robots: All of its robots.
        navigators: Who drives each, by name.
        setup: The name of the bound on the thinking, None without one.
    """
    if not scenario.robots:
        return ""
    tested = dict.fromkeys((robots[k].name, navigators[k]) for k in scenario.tested())
    who = "/".join((robots[0].name, navigators[0]))
    if len({navigator for _, navigator in tested}) > 1:
        who = "+".join(f"{robot}={navigator}" for robot, navigator in tested)
    return "/".join([scenario.labels.suite, scenario.name, who, *([setup] if setup else [])])


def placed(start: FloatArray, scenario: Scenario) -> FloatArray:
    """Where the robot truly stands: uniformly within the placement error of its start, drawn from the seed."""
    key = stream(scenario.seed, "placement")
    radius = scenario.placement_xy * math.sqrt(uniform(key, 0, 0))
    angle = 2.0 * math.pi * uniform(key, 0, 1)
    turn = scenario.placement_yaw * (2.0 * uniform(key, 0, 2) - 1.0)
    error = (radius * math.cos(angle), radius * math.sin(angle), turn)
    return np.array([a + b for a, b in zip(start.tolist(), error, strict=True)])

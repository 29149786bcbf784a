"""Which behaviour a scenario's words stand for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.crowds.walls import walls_of
from clearway.crowds.ways import Room, room_of
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.geometry.packing import pack
from clearway.geometry.rasterise import outline, rasterise
from clearway.geometry.shapes import FloatArray, Shape
from clearway.robots import load_robot
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.scenario import ObstacleSpec, RobotBodySpec, Scenario
from clearway.trials import Body
from clearway.world.behaviours.behaviour import Behaviour
from clearway.world.behaviours.crowd import Still, Walkers, orca_rule, social_force_rule
from clearway.world.behaviours.operator import Operator

CELL = 0.1
"""Edge of the cells of people's floor, m."""
MARGIN = 2.0
"""People's floor ends so far beyond everything that stands and everywhere that they go, m."""


def behaviours_of(scenario: Scenario, bodies: Sequence[Body]) -> list[Behaviour]:
    """The behaviours of all moving bodies of `scenario` that decide: obstacles that somebody drives, then people.

    Args:
        scenario: The test.
        bodies: All that the robot can hit there; the moving ones are the scenario's moving obstacles, then its people.
    """
    moving = [o for o in scenario.obstacles if o.pose is None]
    found: list[Behaviour] = [
        _operator(o, o.behaviour, m, scenario) for m, o in enumerate(moving) if o.behaviour is not None
    ]
    return [*found, *_people(scenario, bodies, [o.behaviour is not None for o in moving])] if scenario.people else found


def _operator(obstacle: ObstacleSpec, spec: OperatorSpec, member: int, scenario: Scenario) -> Behaviour:
    if isinstance(obstacle.shape, RobotBodySpec):  # its own base's limits, where they are known
        drive = load_robot(obstacle.shape.robot).drive
        own = {"acceleration": drive.acceleration, "deceleration": drive.deceleration}
        spec = spec.model_copy(update={name: value for name, value in own.items() if math.isfinite(value)})
    runs = {leg.name: [run for run in obstacle.runs if run.leg == leg.name] for leg in scenario.legs}
    return Operator(spec, obstacle.shape.shape(), runs, scenario.seed, member, obstacle.name)


def _people(scenario: Scenario, bodies: Sequence[Body], driven: list[bool]) -> list[Behaviour]:
    people, first = scenario.people, len(driven)
    standing = [(b.shape, b.pose) for b in bodies if b.pose is not None]
    radius = pack([b.shape for b in bodies if b.pose is None]).reach
    decides = [*driven, *(True for _ in people)]
    walls = walls_of([_ground(*body) for body in standing])
    room = _room(people, standing)
    groups = {name: k for k, name in enumerate(dict.fromkeys(p.group for p in people if p.group))}
    group_of = [*(-1 for _ in driven), *(groups.get(p.group, -1) for p in people)]
    found: list[Behaviour] = [Still(first + i, p) for i, p in enumerate(people) if p.behaviour == "still"]
    for name in ("orca", "social-force"):
        of = [i for i, p in enumerate(people) if p.behaviour == name]
        if not of:
            continue
        reactions = len({people[i].reaction for i in of})
        rule = orca_rule(walls, len(of)) if name == "orca" else social_force_rule(walls, group_of, reactions)
        members, walkers = [first + i for i in of], [people[i] for i in of]
        found.append(Walkers(members, walkers, radius, decides, rule, room, scenario.seed))
    return found


def _room(people: Sequence[PersonSpec], standing: Sequence[tuple[Shape, FloatArray]]) -> Room:
    """The room that what stands leaves, everywhere that `people` go and a little beyond."""
    places = np.array([q for p in people for q in (p.start, *(stop.at for stop in p.route))])
    everything = np.concatenate([places, *(outline(shape, pose) for shape, pose in standing)])
    low, high = everything.min(axis=0) - MARGIN, everything.max(axis=0) + MARGIN
    columns, rows = (np.ceil((high - low) / CELL).astype(int) + 1).tolist()
    origin = float(low[0]), float(low[1])
    taken = rasterise(standing, (rows, columns), CELL, origin)
    return room_of(OccupancyGrid(np.where(taken, OCCUPIED, FREE).astype(np.int8), CELL, origin), CELL)


def _ground(shape: Shape, pose: FloatArray) -> FloatArray:
    """The outline of what stands, counter-clockwise; a disc by few corners, outside of it."""
    points = outline(shape, pose, sides=12)
    return np.asarray(points)

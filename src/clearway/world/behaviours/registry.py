"""Which behaviour a scenario's words stand for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from clearway.crowds.walls import walls_of
from clearway.crowds.ways import Room, room_of
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.geometry.packing import pack
from clearway.geometry.rasterise import outline, rasterise
from clearway.geometry.shapes import FloatArray, Shape, row_of_discs
from clearway.robots import load_robot
from clearway.scenarios.behaviours import BEHAVIOURS, OperatorSpec, find_behaviour
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.people_floor import CELL, MARGIN, floor_size, places_of
from clearway.scenarios.scenario import ObstacleSpec, RobotBodySpec, Scenario
from clearway.trials import Body
from clearway.world.behaviours.behaviour import Behaviour, Cast, CompiledBehaviour, Things
from clearway.world.behaviours.foreign import Foreign
from clearway.world.behaviours.operator import Operator

BULGE = 0.1
"""The discs as which people see what moves stick out of it by so much at most, m."""


def behaviours_of(scenario: Scenario, bodies: Sequence[Body]) -> list[Behaviour | CompiledBehaviour]:
    """The behaviours of all moving bodies of `scenario` that decide: obstacles that somebody drives, then people.

    Args:
        scenario: The test.
        bodies: All that the robot can hit there; the moving ones are the scenario's moving obstacles, then its people.
    """
    specs, moving = [o for o in scenario.obstacles if o.pose is None], [b for b in bodies if b.pose is None]
    found: list[Behaviour | CompiledBehaviour] = [
        _operator(o, o.behaviour, m, scenario, moving) for m, o in enumerate(specs) if o.behaviour is not None
    ]
    return [*found, *_people(scenario, bodies)]


def _operator(
    obstacle: ObstacleSpec, spec: OperatorSpec, member: int, scenario: Scenario, moving: Sequence[Body]
) -> Behaviour:
    if isinstance(obstacle.shape, RobotBodySpec):  # its own base's limits, where they are known
        drive = load_robot(obstacle.shape.robot).drive
        own = {"acceleration": drive.acceleration, "deceleration": drive.deceleration}
        spec = spec.model_copy(update={name: value for name, value in own.items() if math.isfinite(value)})
    runs = {leg.name: [run for run in obstacle.runs if run.leg == leg.name] for leg in scenario.legs}
    return Operator(spec, obstacle.shape.shape(), runs, scenario.seed, member, obstacle.name, moving)


def _people(scenario: Scenario, bodies: Sequence[Body]) -> Iterator[Behaviour | CompiledBehaviour]:
    if not scenario.people:
        return
    people, moving = scenario.people, [b for b in bodies if b.pose is None]
    first = len(moving) - len(people)
    standing = [(b.shape, b.pose) for b in bodies if b.pose is not None]
    groups = {name: k for k, name in enumerate(dict.fromkeys(p.group for p in people if p.group))}
    everybody = Cast(
        members=tuple(range(first, first + len(people))),
        people=people,
        radius=pack([b.shape for b in moving]).reach,
        things=_things([b.shape for b in moving[:first]]),
        group=np.array([*(-1 for _ in range(first)), *(groups.get(p.group, -1) for p in people)], np.int64),
        walls=walls_of([outline(*body, sides=12) for body in standing]),  # a disc by few corners, outside of it
        room=_room(people, standing),
        seed=scenario.seed,
    )
    for name, every in dict.fromkeys((p.behaviour, p.decides_every) for p in people):
        of = [i for i, p in enumerate(people) if (p.behaviour, p.decides_every) == (name, every)]
        cast = replace(everybody, members=tuple(first + i for i in of), people=tuple(people[i] for i in of))
        made = find_behaviour(name)
        yield made(cast) if name in BEHAVIOURS.shipped else Foreign(name, made, cast)


def _things(shapes: Sequence[Shape]) -> Things:
    """The first of all moving bodies, which have these shapes."""
    rows = [row_of_discs(shape, BULGE) for shape in shapes]
    of = np.repeat(np.arange(len(rows)), [len(row) for row in rows])
    return Things(np.concatenate([np.zeros((0, 3)), *rows]), of.astype(np.int64))


def _room(people: Sequence[PersonSpec], standing: Sequence[tuple[Shape, FloatArray]]) -> Room:
    """The room that what stands leaves, everywhere that `people` go and a little beyond."""
    places = tuple(place for person in people for place in places_of(person))
    return _room_among(places, tuple((shape, tuple(pose.tolist())) for shape, pose in standing))


@lru_cache(maxsize=16)
def _room_among(
    places: tuple[tuple[float, float], ...], still: tuple[tuple[Shape, tuple[float, ...]], ...]
) -> Room:  # fmt: skip
    """The same around these `places` [m], kept for other trials on the same floor."""
    standing = [(shape, np.array(pose)) for shape, pose in still]
    everything = np.concatenate([np.array(places), *(outline(shape, pose) for shape, pose in standing)])
    low, high = everything.min(axis=0) - MARGIN, everything.max(axis=0) + MARGIN
    origin = float(low[0]), float(low[1])
    taken = rasterise(standing, floor_size(low, high), CELL, origin)
    return room_of(OccupancyGrid(np.where(taken, OCCUPIED, FREE).astype(np.int8), CELL, origin), CELL)

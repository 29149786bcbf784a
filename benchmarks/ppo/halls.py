"""Halls that are drawn: rooms of any size, what stands in them and who goes through, none of a suite's places. Where `ppo` learns for TIAGo.

    clearway run benchmarks/ppo/halls.py:HALLS --robot tiago --navigator ppo --seeds 0:200

As in a test, the robot drives from one place to another, turns there and drives back, at a set speed. Most of what stands is near its way, now and
then as a pair; who goes through is blind, and would often meet the robot. A way that the robot
fits through is always there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from clearway.geometry.shapes import circumscribed_radius, inscribed_radius
from clearway.quantities import PoseSpec
from clearway.robots import Robot
from clearway.scenarios.scenario import (
    DiscSpec,
    LabelSpec,
    LegSpec,
    ObstacleSpec,
    RectangleSpec,
    RunSpec,
    Scenario,
    SquareSpec,
)
from clearway.scenarios.suite import Selection, Suite, scenario_seed, without_drawing
from clearway.scenarios.way import room_for, widest_way

PLAN, MIDDLE = "arena", (7.0, 7.0)
"""An empty floor and its middle, m: the room's walls are obstacles."""
LENGTHS, WIDTHS = (5.0, 12.0), (3.0, 8.0)
"""Of rooms, m."""
SPEEDS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)
"""That are set, m/s: few, as a learner's scenario is checked once for each."""
SIZES = (0.03, 1.0)
"""Across what stands, m; the logarithm is uniform."""
STANDING, MOVING = 6, (0.6, 0.3, 0.1)
"""How many places something stands at, at most; how likely none, one, two go through."""
APART = (0.3, 1.5)
"""Between the two of a pair, m."""
WALL, ROOM, SPARE = 0.2, 0.3, 0.1
"""How thick walls are; what is free about start and goal beyond the robot; by how much more it would fit through, m."""
_Way = tuple[np.ndarray, np.ndarray]


def build(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
    """One of each of `Selection.seeds`, else the first hundred."""
    return [_scenario(robot, draw, seed) for draw in range(*(selection.seeds or (0, 100)))]


def _scenario(robot: Robot, draw: int, seed: int) -> Scenario:
    name = f"hall-{draw}"
    rng = np.random.default_rng([draw, *b"halls"])
    while True:
        size, (a, b) = _room(robot, rng)
        standing = _standing(robot, rng, size, (a, b))
        if _fits(robot, size, (a, b), standing):
            break
    speed, heading = float(rng.choice(SPEEDS)), math.atan2(*(b - a)[::-1])
    goals = {"forth": (b, heading), "turn": (b, heading + math.pi), "back": (a, heading + math.pi)}
    drive, turn = 3.0 * math.dist(a, b) / speed + 20.0, 3.0 * math.pi / robot.drive.omega_max + 20.0
    moving = _moving(robot, rng, size, (a, b), standing, speed)
    return Scenario(
        name=name,
        floor_plan=PLAN,
        start=_pose(a, heading + rng.uniform(-0.5, 0.5)),
        legs=tuple(
            LegSpec(name=leg, goal=_pose(*goal), time_limit=turn if leg == "turn" else drive)
            for leg, goal in goals.items()
        ),
        speed=speed,
        obstacles=(*_walls(size), *standing, *moving),
        labels=LabelSpec(batch="drawn", configuration="hall"),
        localisation="truth",
        seed=scenario_seed(seed, name),
    )


def _room(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, _Way]:
    """Its size and the ends of the robot's way."""
    near = circumscribed_radius(robot.shape) + ROOM
    while True:
        size = rng.uniform(*np.transpose((LENGTHS, WIDTHS)))
        a, b = (np.array(MIDDLE) + rng.uniform(-1.0, 1.0, 2) * (size / 2 - near) for _ in range(2))
        if 3.0 < math.dist(a, b) < 7.0:
            return size, (a, b)


def _standing(robot: Robot, rng: np.random.Generator, size: np.ndarray, way: _Way) -> list[ObstacleSpec]:
    (a, b), near = way, circumscribed_radius(robot.shape) + ROOM
    standing: list[ObstacleSpec] = []
    for shape, place, turn in _things(rng, size, (a, b)):
        reach = circumscribed_radius(shape.shape())
        inside = bool((np.abs(place - MIDDLE) < size / 2 - reach - 0.01).all())
        if inside and min(math.dist(place, a), math.dist(place, b)) > reach + near and all(
            math.dist(place, other.pose[:2]) > reach + circumscribed_radius(other.shape.shape()) for other in standing if other.pose
        ):  # fmt: skip
            standing.append(ObstacleSpec(name=f"thing {len(standing)}", shape=shape, pose=_pose(place, turn)))
    return standing


def _fits(robot: Robot, size: np.ndarray, way: _Way, standing: list[ObstacleSpec]) -> bool:
    bodies = [(o.shape.shape(), np.array(o.pose)) for o in (*_walls(size), *standing)]
    (x0, y0), (x1, y1) = MIDDLE - size / 2 - WALL, MIDDLE + size / 2 + WALL
    room = room_for(bodies, (x0, y0, x1, y1), inscribed_radius(robot.shape) + SPARE)
    return widest_way(room, [(x, y) for x, y in way]) == [None]


def _things(
    rng: np.random.Generator, size: np.ndarray, way: _Way
) -> Iterator[tuple[DiscSpec | SquareSpec | RectangleSpec, np.ndarray, float]]:
    a, b = way
    for _ in range(rng.integers(STANDING + 1)):
        edge = math.exp(rng.uniform(*np.log(SIZES)))
        shape: DiscSpec | SquareSpec | RectangleSpec = (
            DiscSpec(kind="disc", radius=edge / 2),
            SquareSpec(kind="square", edge=edge),
            RectangleSpec(kind="rectangle", length=edge, width=rng.uniform(0.05, 1.5)),
        )[rng.integers(3)]
        turn = rng.uniform(-math.pi, math.pi)
        place = np.array(MIDDLE) + rng.uniform(-0.5, 0.5, 2) * size
        if rng.random() < 0.8:  # near its way
            place = a + rng.uniform(0.1, 0.9) * (b - a) + rng.normal(0.0, 0.3, 2)
        off = np.zeros(2)
        if rng.random() < 0.4:
            angle, across = rng.uniform(-math.pi, math.pi), 2 * circumscribed_radius(shape.shape())
            off = (across + rng.uniform(*APART)) / 2 * np.array((math.cos(angle), math.sin(angle)))
            yield shape, place - off, turn
        yield shape, place + off, turn


def _moving(
    robot: Robot, rng: np.random.Generator, size: np.ndarray, way: _Way, standing: list[ObstacleSpec], speed: float
) -> Iterator[ObstacleSpec]:
    """Who goes through: from wall to wall, past what stands, on the way forth and again on the way back."""
    for k in range(rng.choice(len(MOVING), p=MOVING)):
        radius, runs = rng.uniform(0.15, 0.4), []
        for leg, (a, b) in (("forth", way), ("back", way[::-1])):
            for _ in range(20):
                share, angle, pace = rng.uniform(0.1, 0.9), rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 1.0)
                meet, along = a + share * (b - a), np.array((math.cos(angle), math.sin(angle)))
                ends = [meet + sign * _to_wall(meet, sign * along, size, radius + 0.05) * along for sign in (-1, 1)]
                if (
                    min(math.dist(end, place) for end in ends for place in (a, b)) > 1.5
                    and math.dist(*ends) > 2.5
                    and all(
                        _past(ends, o.pose) > radius + circumscribed_radius(o.shape.shape()) + 0.02 for o in standing
                    )
                ):
                    delay = share * math.dist(a, b) / speed - math.dist(ends[0], meet) / pace + rng.normal(0.0, 2.0)
                    path = tuple(tuple(end.tolist()) for end in ends)
                    runs.append(RunSpec(leg=leg, path=path, speed=pace, delay=max(delay, 0.0)))
                    break
        if runs:
            yield ObstacleSpec(name=f"body {k}", shape=DiscSpec(kind="disc", radius=radius), runs=tuple(runs))


def _to_wall(place: np.ndarray, along: np.ndarray, size: np.ndarray, short: float) -> float:
    """How far it is from `place` along the unit vector `along` to where a disc would touch a wall, m."""
    room = size / 2 - short - np.sign(along) * (place - MIDDLE)
    return max(float((room / np.maximum(np.abs(along), 1e-9)).min()), 0.0)


def _past(ends: list[np.ndarray], pose: PoseSpec | None) -> float:
    """How near a straight way comes to something, m."""
    assert pose is not None
    a, b = ends
    share = np.clip((pose[:2] - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return math.dist(a + share * (b - a), pose[:2])


def _walls(size: np.ndarray) -> Iterator[ObstacleSpec]:
    for k, (axis, sign) in enumerate(((0, -1), (0, 1), (1, -1), (1, 1))):
        place, edges = np.array(MIDDLE), size + 2 * WALL
        place[axis] += sign * (size[axis] + WALL) / 2
        edges[axis] = WALL
        if axis:
            edges[0] = size[0] - 0.001  # what touches is refused
        shape = RectangleSpec(kind="rectangle", length=edges[0], width=edges[1])
        yield ObstacleSpec(name=f"wall {k}", shape=shape, pose=_pose(place, 0.0))


def _pose(place: np.ndarray, heading: float) -> PoseSpec:
    return float(place[0]), float(place[1]), math.remainder(heading, math.tau)


HALLS = Suite(
    "halls",
    "Drawn halls",
    "Forth and back in a room that is drawn, among what stands there and goes through",
    batches=("drawn",),
    configurations=("hall",),
    make=build,
    robots=("tiago",),
    generator=without_drawing(build),
)

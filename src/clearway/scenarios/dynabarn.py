"""The suite `dynabarn`: the 60 worlds of moving cylinders of the BARN Challenge (DynaBARN), with its task.

Source: `Daffan/the-barn-challenge` (MIT), `run.py`: worlds 300 to 359, start (11, 0, 3.14), goal 20 m straight ahead; the clock
starts once the robot has moved 0.1 m; success within 1 m of the goal by the true position, failure on contact or after
100 s. Nothing stands on the floor, and there is no map. The cylinders go through key frames on rails, round after round, from
the start of the simulation on, by Gazebo's own interpolation: see `spline`. The score is BARN's with 20 m; the runner
takes the goal's x less the start's x, -31 m, which makes no score.

When the robot starts depends on how long its software takes to come up, so it is drawn from the seed, one time for all the
cylinders of a world. The runner waits until nothing touches the robot at its start, and so does the draw.
"""

from __future__ import annotations

import gzip
import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.robots import Robot
from clearway.scenarios.barn import PLACEMENT, SPEED, course
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import DiscSpec, LabelSpec, ObstacleSpec, Scenario
from clearway.scenarios.spline import SplineSpec, position
from clearway.scenarios.suite import Selection, Suite, draw, refuse_speeds, scenario_seed

START = (11.0, 0.0, 3.14)
GOAL = (-9.0, 0.0, 0.0)
"""As the runner sends it; the heading never matters, as a run ends before."""
ARRIVAL = 1.0
"""Radius around the goal within which a run ends, m."""
LENGTH = 20.0
"""The way that the score is reckoned by, m: straight from the start to the goal."""
REPETITIONS = 10
WAIT = 1.0
"""After which the runner looks again whether something touches the robot at its start, s."""
FREE = 0.05
"""Gap at the start below which it counts as touched, m: the robot is placed within 0.01 m and 0.01 rad."""
KINDS = ("easy", "medium", "hard")
NUMBERS = range(300, 360)
EDGE = 14.0
"""Of the floor, from its middle, m: no cylinder leaves it."""


@dataclass(frozen=True, slots=True)
class World:
    """One world.

    Attributes:
        number: As BARN's runner counts it.
        kind: `easy`, `medium` or `hard`.
        cylinders: All that moves there, under its names in DynaBARN, at the start of the simulation.
    """

    number: int
    kind: str
    cylinders: tuple[ObstacleSpec, ...]

    def after(self, begun: float) -> tuple[ObstacleSpec, ...]:
        """The cylinders `begun` s later."""
        later = (o.motion.model_copy(update={"offset": begun}) for o in self.cylinders if o.motion is not None)
        return tuple(o.model_copy(update={"motion": m}) for o, m in zip(self.cylinders, later, strict=True))


@cache
def worlds() -> dict[int, World]:
    """DynaBARN's 60 worlds by number."""
    raw = gzip.decompress((resources.files("clearway.scenarios") / "dynabarn_worlds" / "worlds.jsonl.gz").read_bytes())
    found = [_world(json.loads(line)) for line in raw.decode().splitlines()]
    return {world.number: world for world in sorted(found, key=lambda w: w.number)}


def _world(table: dict[str, Any]) -> World:
    cylinders = tuple(
        ObstacleSpec(
            name=c["name"],
            shape=DiscSpec(kind="disc", radius=c["radius"]),
            motion=SplineSpec(kind="spline", keyframes=tuple((float(t), x, y) for t, x, y in c["keyframes"])),
        )
        for c in table["cylinders"]
    )
    (kind,) = table["kinds"]
    return World(table["world"], kind, cylinders)


def floor() -> FloorPlan:
    """The floor of all these worlds: nothing stands on it, and there is no map."""
    return FloorPlan("dynabarn", "DynaBARN, open floor", (), None, None, None, None, (-EDGE, -EDGE, EDGE, EDGE))


def build(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
    """Every selected world with its repetitions; `selection.speeds` sets the speed (default 0.5 m/s)."""
    if selection.floor_plan is not None:
        raise ClearwayError(
            "the worlds of the suite 'dynabarn' are all on one open floor; select them by number", field="floor_plan"
        )
    for number in selection.worlds:
        if number not in worlds():
            raise ClearwayError(f"no world {number} in the suite 'dynabarn'; it has 300 to 359", field="worlds")
    refuse_speeds(selection.speeds, robot)
    return [
        _scenario(robot, world, speed, repetition, seed)
        for world in worlds().values()
        if not selection.worlds or world.number in selection.worlds
        for speed in selection.speeds or (SPEED,)
        for repetition in range(1, (selection.repetitions or REPETITIONS) + 1)
    ]


def _scenario(robot: Robot, world: World, speed: float, repetition: int, seed: int) -> Scenario:
    name = f"dynabarn-{world.number}-v{speed:g}-r{repetition}"
    own = scenario_seed(seed, name)
    return Scenario(
        name=name,
        floor_plan="dynabarn",
        start=START,
        legs=(course(GOAL, ARRIVAL),),
        speed=speed,
        obstacles=world.after(_begun(robot, world, own)),
        labels=LabelSpec(
            suite="dynabarn", batch=world.kind, configuration=f"world-{world.number}", repetition=repetition
        ),
        reference_length=LENGTH,
        localisation="odometry",
        placement_xy=PLACEMENT,
        placement_yaw=PLACEMENT,
        seed=own,
    )


def _begun(robot: Robot, world: World, seed: int) -> float:
    """For how long the cylinders have been going when the robot starts, s: drawn over the longest of their rounds, and then
    so many times `WAIT` later as it takes until none touches the robot.

    Raises:
        ClearwayError: it never becomes free for this robot.
    """
    ways = [(o.shape.shape(), o.motion) for o in world.cylinders if isinstance(o.motion, SplineSpec)]
    begun, where = draw(seed, "since when the cylinders go") * max(m.period for _, m in ways), np.array(START)
    for _ in range(1000):
        there = [np.array([*position(motion, begun), 0.0]) for _, motion in ways]
        if all(clearance(robot.shape, where, s, p) > FREE for (s, _), p in zip(ways, there, strict=True)):
            return begun
        begun += WAIT
    raise ClearwayError(f"{robot.name!r} never has room at the start of world {world.number}", field="robot")


DYNABARN = Suite(
    name="dynabarn",
    title="DynaBARN, moving cylinders",
    description="60 worlds of moving cylinders for a Jackal without a map, under the BARN Challenge's task and outcome rules",
    batches=KINDS,
    configurations=tuple(f"world-{n}" for n in NUMBERS),
    make=build,
    family="barn",
    robots=("jackal:wide",),
    report=(),
    floor_plans={"dynabarn": floor},
    source="DynaBARN's worlds are those of Nair et al. (2022), under the task and rules of the BARN Challenge: 20 m across an open floor past cylinders that go"
    " to and fro and mind nobody. No results of others on them are public.",
)

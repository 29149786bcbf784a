"""The suites `dynabarn` and `dynabarn-held-out`: the 60 worlds of moving cylinders of the BARN Challenge (DynaBARN), with its task, and
60 of the same kind on another geometry.

Source: `Daffan/the-barn-challenge` (MIT), `run.py`: worlds 300 to 359, start (11, 0, 3.14), goal 20 m straight ahead; the clock
starts once the robot has moved 0.1 m; success within 1 m of the goal by the true position, failure on contact or after
100 s. Nothing stands on the floor, and there is no map. The cylinders go through key frames on rails, round after round, from
the start of the simulation on, by Gazebo's own interpolation: see `spline`. The score is BARN's with 20 m; the runner
takes the goal's x less the start's x, -31 m, which makes no score.

When the robot starts depends on how long its software takes to come up, so it is drawn from the seed, one time for all the
cylinders of a world. The runner waits until nothing touches the robot at its start, and so does the draw.

`Selection.seeds` draws other worlds, see `dynabarn_draws`; so are the frozen ones of `dynabarn-held-out`, from numbers of their own.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.robots import Robot
from clearway.scenarios import dynabarn_draws
from clearway.scenarios.barn import PLACEMENT, SPEED, course
from clearway.scenarios.dynabarn_draws import HELD_OUT, PUBLISHED, Geometry, Keyframes, Kind
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import DiscSpec, LabelSpec, ObstacleSpec, Scenario
from clearway.scenarios.spline import SplineSpec, position
from clearway.scenarios.suite import (
    Generator,
    Selection,
    Suite,
    draw,
    draw_label,
    refuse_speeds,
    scenario_seed,
    selected_seeds,
)

ARRIVAL = 1.0
"""Radius around the goal within which a run ends, m."""
REPETITIONS = 10
"""Of a frozen world; one that is drawn from a seed runs once."""
WAIT = 1.0
"""After which the runner looks again whether something touches the robot at its start, s."""
FREE = 0.05
"""Gap at the start below which it counts as touched, m: the robot is placed within 0.01 m and 0.01 rad."""
KINDS = tuple(kind.name for kind in PUBLISHED.kinds)
FIRST = {PUBLISHED.suite: 300, HELD_OUT.suite: 400}
"""The number of the first world of a suite, as BARN's runner counts them; the held-out ones follow behind."""
EACH = 20
"""Frozen worlds of a kind."""


@dataclass(frozen=True, slots=True)
class World:
    """One world.

    Attributes:
        stem: Of the names of its scenarios.
        label: Of its configuration.
        kind: `easy`, `medium` or `hard`.
        cylinders: All that moves there, under its names in DynaBARN, at the start of the simulation.
    """

    stem: str
    label: str
    kind: str
    cylinders: tuple[ObstacleSpec, ...]

    def after(self, begun: float) -> tuple[ObstacleSpec, ...]:
        """The cylinders `begun` s later."""
        later = (o.motion.model_copy(update={"offset": begun}) for o in self.cylinders if o.motion is not None)
        return tuple(o.model_copy(update={"motion": m}) for o, m in zip(self.cylinders, later, strict=True))


@cache
def worlds(suite: str = PUBLISHED.suite) -> dict[int, World]:
    """The 60 frozen worlds of a suite by number."""
    if suite == HELD_OUT.suite:
        kinds = [kind for kind in HELD_OUT.kinds for _ in range(EACH)]
        drawn = ((n, k, dynabarn_draws.draw(HELD_OUT, k, n, "frozen")) for n, k in enumerate(kinds, FIRST[suite]))
        return {n: _frozen(suite, n, k.name, _cylinders(ways, HELD_OUT.radius)) for n, k, ways in drawn}
    raw = gzip.decompress((resources.files("clearway.scenarios") / "dynabarn_worlds" / "worlds.jsonl.gz").read_bytes())
    found = [_published(json.loads(line)) for line in raw.decode().splitlines()]
    return dict(sorted(found))


def _published(table: dict[str, Any]) -> tuple[int, World]:
    cylinders = tuple(
        _cylinder(c["name"], c["radius"], ((float(t), x, y) for t, x, y in c["keyframes"])) for c in table["cylinders"]
    )
    (kind,) = table["kinds"]
    return table["world"], _frozen(PUBLISHED.suite, table["world"], kind, cylinders)


def _frozen(suite: str, number: int, kind: str, cylinders: tuple[ObstacleSpec, ...]) -> World:
    return World(f"{suite}-{number}", f"world-{number}", kind, cylinders)


def _cylinders(ways: Sequence[Keyframes], radius: float) -> tuple[ObstacleSpec, ...]:
    return tuple(_cylinder(f"cylinder-{i}", radius, way) for i, way in enumerate(ways, 1))


def _cylinder(name: str, radius: float, way: Iterable[tuple[float, float, float]]) -> ObstacleSpec:
    motion = SplineSpec(kind="spline", keyframes=tuple(way))
    return ObstacleSpec(name=name, shape=DiscSpec(kind="disc", radius=radius), motion=motion)


def floor(geometry: Geometry) -> FloorPlan:
    """The floor of all worlds of a suite: nothing stands on it, and there is no map."""
    x, y = geometry.edge
    return FloorPlan(geometry.suite, geometry.title, (), None, None, None, None, (-x, -y, x, y))


def build(
    robot: Robot,
    selection: Selection,
    seed: int,
    geometry: Geometry,
    drawn: Callable[[Geometry, Kind, int], Sequence[Keyframes]],
) -> list[Scenario]:
    """Every selected world with its repetitions, or those that `drawn` gives for `selection.seeds`; `selection.speeds` sets the speed
    (default 0.5 m/s).

    Raises:
        ClearwayError: another floor plan or a world is selected that the suite has not, or a speed that is beyond the robot.
    """
    suite = geometry.suite
    if selection.floor_plan is not None:
        raise ClearwayError(
            f"the worlds of the suite {suite!r} are all on one open floor; select them by number", field="floor_plan"
        )
    if selection.seeds is not None and selection.worlds:
        raise ClearwayError("worlds that are drawn from seeds have no numbers", field="worlds")
    numbers = _numbers(suite)
    for number in selection.worlds:
        if number not in numbers:
            raise ClearwayError(
                f"no world {number} in the suite {suite!r}; it has {numbers[0]} to {numbers[-1]}", field="worlds"
            )
    refuse_speeds(selection.speeds, robot)
    repetitions = selection.repetitions or (REPETITIONS if selection.seeds is None else 1)
    return [
        _scenario(robot, geometry, world, speed, repetition, seed)
        for world in _chosen(selection, geometry, drawn)
        for speed in selection.speeds or (SPEED,)
        for repetition in range(1, repetitions + 1)
    ]


def _numbers(suite: str) -> range:
    return range(FIRST[suite], FIRST[suite] + EACH * len(KINDS))


def _chosen(
    selection: Selection, geometry: Geometry, drawn: Callable[[Geometry, Kind, int], Sequence[Keyframes]]
) -> Iterator[World]:
    if selection.seeds is None:
        found = worlds(geometry.suite)
        yield from (w for n, w in found.items() if not selection.worlds or n in selection.worlds)
        return
    for _, kind, seed in _calls(selection, geometry):
        cylinders = _cylinders(drawn(geometry, kind, seed), geometry.radius)
        yield World(f"{geometry.suite}-{kind.name}-{draw_label(seed)}", draw_label(seed), kind.name, cylinders)


def _calls(selection: Selection, geometry: Geometry) -> list[tuple[Geometry, Kind, int]]:
    """What `dynabarn_draws.draw` is to be called with for the `selection`."""
    kinds = [k for k in geometry.kinds if not selection.batches or k.name in selection.batches]
    return [(geometry, k, s) for k in kinds for s in selected_seeds(selection, f"{geometry.suite}-{k.name}-seed-")]


def _scenario(robot: Robot, geometry: Geometry, world: World, speed: float, repetition: int, seed: int) -> Scenario:
    name = f"{world.stem}-v{speed:g}-r{repetition}"
    own = scenario_seed(seed, name)
    return Scenario(
        name=name,
        floor_plan=geometry.suite,
        start=geometry.start,
        legs=(course(geometry.goal, ARRIVAL),),
        speed=speed,
        obstacles=world.after(_begun(robot, geometry, world, own)) if world.cylinders else (),
        labels=LabelSpec(batch=world.kind, configuration=world.label, repetition=repetition),
        reference_length=geometry.length,
        localisation="odometry",
        placement_xy=PLACEMENT,
        placement_yaw=PLACEMENT,
        seed=own,
    )


def _begun(robot: Robot, geometry: Geometry, world: World, seed: int) -> float:
    """For how long the cylinders have been going when the robot starts, s: drawn over the longest of their rounds, and then
    so many times `WAIT` later as it takes until none touches the robot.

    Raises:
        ClearwayError: it never becomes free for this robot.
    """
    ways = [(o.shape.shape(), o.motion) for o in world.cylinders if isinstance(o.motion, SplineSpec)]
    begun, where = draw(seed, "since when the cylinders go") * max(m.period for _, m in ways), np.array(geometry.start)
    for _ in range(1000):
        there = [np.array([*position(motion, begun), 0.0]) for _, motion in ways]
        if all(clearance(robot.shape, where, s, p) > FREE for (s, _), p in zip(ways, there, strict=True)):
            return begun
        begun += WAIT
    raise ClearwayError(f"{robot.name!r} never has room at the start of {world.stem!r}", field="robot")


def _read(rows: list[list[list[float]]]) -> tuple[Keyframes, ...]:
    return tuple(tuple((t, x, y) for t, x, y in way) for way in rows)


def _suite(geometry: Geometry, title: str, description: str, source: str) -> Suite:
    make = partial(build, geometry=geometry)
    outlines = partial(make, drawn=lambda *_: ())
    generator = Generator(partial(_calls, geometry=geometry), dynabarn_draws.draw, outlines, read=_read)
    return Suite(
        geometry.suite,
        title,
        description,
        batches=KINDS,
        configurations=tuple(f"world-{n}" for n in _numbers(geometry.suite)),
        make=partial(make, drawn=generator),
        family="barn",
        robots=("jackal:wide",),
        report=(),
        floor_plans={geometry.suite: partial(floor, geometry)},
        generator=generator,
        source=source,
    )


DYNABARN = _suite(
    PUBLISHED,
    "DynaBARN, moving cylinders",
    "60 worlds of moving cylinders for a Jackal without a map, under the BARN Challenge's task and outcome rules",
    "DynaBARN's worlds are those of Nair et al. (2022), under the task and rules of the BARN Challenge: 20 m across an open floor past cylinders that go"
    " to and fro and mind nobody. No results of others on them are public.",
)
HELD_OUT_DYNABARN = _suite(
    HELD_OUT,
    "DynaBARN, held out",
    "DynaBARN's rule on another geometry (floor, numbers, radius and speeds of the cylinders), on which nothing was chosen",
    "DynaBARN, held out, is the rule by which the worlds of Nair et al. (2022) were made, on a floor of our own, 16 m across, with thinner and slower"
    " cylinders in other numbers, on which nothing was chosen, and of which nothing is published.",
)

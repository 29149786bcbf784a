"""The suites `barn` and `barn-2022`: static obstacle courses of the BARN Challenge, with its task, timing and outcomes.

Source: `Daffan/the-barn-challenge` (MIT), `run.py` and `test.sh`: start (-2.25, 3.0, 1.57), goal 10 m further along
+y; the clock starts once the robot has moved 0.1 m; success within 1 m of the goal by the true position, failure on
contact or after 100 s. The official test set is every sixth world, ten runs each. There is no map.

The published runs of move_base (`res/dwa_out.txt`, March 2022) were driven under an older `run.py` (commit 3f77441):
start (-2, 3, 1.57), success within 0.5 m. The file itself shows it: its last column is 2 x time / (length of the
reference path), which fits the length from (-2, 3) only. `barn-2022` is that task, for comparing with those runs.
"""

from __future__ import annotations

import gzip
import itertools
import json
import math
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle
from clearway.quantities import PoseSpec
from clearway.robots import Robot
from clearway.scenarios.plan import Fixture, FloorPlan
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import Section, Selection, Suite, refuse_speeds, scenario_seed

RADIUS = 0.075
"""Of every cylinder, m."""


@dataclass(frozen=True, slots=True)
class BarnTask:
    """What BARN's runner asks of the robot.

    Attributes:
        start: Its start: x, y [m], theta [rad].
        goal: The goal as the runner sends it: x, y [m], theta [rad]. The heading never matters, as a run ends before.
        arrival: Radius around the goal within which a run ends, m.
    """

    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    arrival: float


TASKS = {
    "barn": BarnTask((-2.25, 3.0, 1.57), (-2.25, 13.0, 0.0), 1.0),
    "barn-2022": BarnTask((-2.0, 3.0, 1.57), (-2.0, 13.0, 0.0), 0.5),
}
"""By suite: BARN's present rules, and those that its published runs were driven under."""
PUBLISHED_TASK = "barn-2022"
"""The suite whose task is that of the published runs."""
START, GOAL = TASKS["barn"].start, TASKS["barn"].goal
CLOCK_STARTS_AFTER = 0.1
TIME_LIMIT = 100.0
SPEED = 0.5
"""Set speed of the published runs, m/s; the Jackal itself can do 2 (select `--speed 2`)."""
REPETITIONS = {"official": 10, "other": 1}
PLACEMENT = 0.01
"""m and rad; the runner places the robot exactly, and Gazebo's settling and timing make its runs differ."""


@dataclass(frozen=True, slots=True)
class World:
    """One course.

    Attributes:
        number: Its number in BARN.
        cylinders: Centres x, y of its cylinders, m.
        path: BARN's reference path without start and goal: points x, y, m.
    """

    number: int
    cylinders: tuple[tuple[float, float], ...]
    path: tuple[tuple[float, float], ...]

    @property
    def official(self) -> bool:
        """Whether it belongs to BARN's official test set."""
        return self.number % 6 == 0

    @property
    def reference_length(self) -> float:
        """Length of start + path + goal [m] under the present rules: BARN's `path_length`."""
        return self.length(TASKS["barn"])

    def length(self, task: BarnTask) -> float:
        """Length of the task's start + path + its goal [m]."""
        points = (task.start[:2], *self.path, task.goal[:2])
        return sum(math.dist(p, q) for p, q in itertools.pairwise(points))


@dataclass(frozen=True, slots=True)
class PublishedRun:
    """One published run of the real move_base.

    Attributes:
        world: Number of the world.
        success: Whether it arrived in time without a collision.
        collided: Whether it collided.
        timed_out: Whether it took too long.
        time: How long it took, s.
        ratio: BARN's score of then, 2 x time / reference length.
    """

    world: int
    success: bool
    collided: bool
    timed_out: bool
    time: float
    ratio: float


@cache
def worlds() -> dict[int, World]:
    """BARN's 150 even-numbered worlds by number."""
    raw = gzip.decompress((resources.files("clearway.scenarios") / "barn_worlds" / "worlds.jsonl.gz").read_bytes())
    found = {}
    for line in raw.decode().splitlines():
        table = json.loads(line)
        cylinders, path = (tuple((float(x), float(y)) for x, y in table[key]) for key in ("cylinders", "path"))
        found[table["world"]] = World(table["world"], cylinders, path)
    return dict(sorted(found.items()))


@cache
def published_runs() -> tuple[PublishedRun, ...]:
    """The runs of move_base with TrajectoryPlannerROS (`dwa: true`) at 0.5 m/s that BARN publishes (`res/dwa_out.txt`)."""
    text = (resources.files("clearway.scenarios") / "barn_worlds" / "dwa_reference.txt").read_text("utf-8")
    rows = (line.split() for line in text.splitlines() if line.strip())
    return tuple(PublishedRun(int(r[0]), r[1] == "1", r[2] == "1", r[3] == "1", float(r[4]), float(r[5])) for r in rows)


def world_plan(number: int) -> FloorPlan:
    """The world as a floor plan: cylinders only, no map."""
    world = worlds()[number]
    disc = Circle(RADIUS)
    fixtures = tuple(
        Fixture(f"cylinder-{i}", "wall", disc, np.array([x, y, 0.0])) for i, (x, y) in enumerate(world.cylinders)
    )
    points = np.array([*world.cylinders, START[:2], GOAL[:2]])
    (x0, y0), (x1, y1) = points.min(0) - 1.0, points.max(0) + 1.0
    bounds = (float(x0), float(y0), float(x1), float(y1))
    return FloorPlan(f"barn-{number}", f"BARN world {number}", fixtures, None, None, None, None, bounds)


def build(robot: Robot, selection: Selection, seed: int, suite: str = "barn") -> list[Scenario]:
    """Every selected world with its repetitions; `selection.speeds` sets the speed (default 0.5 m/s)."""
    if selection.floor_plan is not None:
        raise ClearwayError(
            f"the worlds of the suite {suite!r} are its floor plans; select them by number instead", field="floor_plan"
        )
    for number in selection.worlds:
        if number not in worlds():
            raise ClearwayError(
                f"no world {number} in the suite {suite!r}; it has the even numbers 0 to 298", field="worlds"
            )
    refuse_speeds(selection.speeds, robot)
    chosen = [w for w in worlds().values() if not selection.worlds or w.number in selection.worlds]
    ordered = sorted(chosen, key=lambda w: (not w.official, w.number))
    return [
        _scenario(suite, world, speed, repetition, seed)
        for world in ordered
        for speed in selection.speeds or (SPEED,)
        for repetition in range(1, (selection.repetitions or REPETITIONS[_batch(world)]) + 1)
    ]


def _batch(world: World) -> str:
    return "official" if world.official else "other"


def course(goal: PoseSpec, arrival: float) -> LegSpec:
    """A world's one leg by the challenge's rules: to within `arrival` [m] of `goal` by the true position, with any heading."""
    return LegSpec(
        name="course",
        goal=goal,
        xy_tolerance=arrival,
        yaw_tolerance=math.inf,
        time_limit=TIME_LIMIT,
        arrival="measured",
        clock_starts_after=CLOCK_STARTS_AFTER,
    )


def _scenario(suite: str, world: World, speed: float, repetition: int, seed: int) -> Scenario:
    task = TASKS[suite]
    name = f"{suite}-{world.number}-v{speed:g}-r{repetition}"
    return Scenario(
        name=name,
        floor_plan=f"barn-{world.number}",
        start=task.start,
        legs=(course(task.goal, task.arrival),),
        speed=speed,
        labels=LabelSpec(
            suite=suite, batch=_batch(world), configuration=f"world-{world.number}", repetition=repetition
        ),
        reference_length=world.length(task),
        localisation="odometry",
        placement_xy=PLACEMENT,
        placement_yaw=PLACEMENT,
        seed=scenario_seed(seed, name),
    )


FLOOR_PLANS = {f"barn-{number}": partial(world_plan, number) for number in range(0, 300, 2)}
"""BARN's 150 even-numbered worlds."""

BARN = Suite(
    name="barn",
    title="BARN navigation courses",
    description="150 static obstacle courses for a Jackal without a map, under BARN's own task, timing and outcome rules",
    batches=("official", "other"),
    configurations=tuple(f"world-{n}" for n in range(0, 300, 2)),
    make=build,
    family="barn",
    robots=("jackal",),
    report=(Section.PUBLISHED_BARN_RUNS,),
    floor_plans=FLOOR_PLANS,
)

BARN_2022 = Suite(
    name=PUBLISHED_TASK,
    title="BARN navigation courses, task of the published runs",
    description="the courses of the suite barn under the task of BARN's published runs of move_base (March 2022):"
    " start at x = -2, arrival within 0.5 m",
    batches=BARN.batches,
    configurations=BARN.configurations,
    make=partial(build, suite=PUBLISHED_TASK),
    family=BARN.family,
    robots=BARN.robots,
    report=BARN.report,
    floor_plans=FLOOR_PLANS,
)

"""Says what is wrong with a scenario, and with any file that a user writes or brings."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance, min_clearance
from clearway.geometry.oscillator import trajectory
from clearway.geometry.shapes import FloatArray, Shape, circumscribed_radius, inscribed_radius, rectangle
from clearway.reading import read_toml
from clearway.reading.limits import DRAWN
from clearway.robots import Robot, load_robot
from clearway.scenarios import motions
from clearway.scenarios.check_places import (
    at_text,
    extent_text,
    first_hit,
    fleet_errors,
    is_inside,
    people_errors,
    place_problem,
    robot_errors,
    widest,
)
from clearway.scenarios.check_starts import Placed, met, person_placed, robots_placed
from clearway.scenarios.crowd import Crowd, Standing, Work
from clearway.scenarios.family import Family, Path_, load_families, put, scenario_from
from clearway.scenarios.files import (
    SuiteSpec,
    floor_plan_schema,
    kind_of,
    load_scenario,
    parse,
    robot_schema,
    scenario_schema,
    scenarios_of,
    suite_schema,
)
from clearway.scenarios.floor_plan_files import FloorPlanSpec
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.line_keeping import Line, hands
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import LONGEST_SWING, ObstacleSpec, OscillationSpec, RunSpec, Scenario
from clearway.scenarios.suite import refuse_many
from clearway.scenarios.way import CELL

__all__ = [
    "check_family",
    "check_file",
    "check_scenario",
    "floor_plan_schema",
    "load_scenario",
    "robot_schema",
    "scenario_schema",
    "suite_schema",
]

STEP = 0.05
"""How densely a moving obstacle's path is checked against what stands in it, m (of an oscillation: s)."""
MEETING = 10
"""To see whether two touch as the trial begins takes so many comparisons' time."""
ROBOT = "tiago"
"""The robot that a scenario is checked for if none is named."""


@lru_cache(maxsize=8)
def _fixtures(plan: FloorPlan) -> Crowd:
    return Crowd.of([Standing(f.name, f.shape, f.pose) for f in plan.fixtures])


def check_scenario(scenario: Scenario, robot: Robot) -> list[ClearwayError]:
    """Everything about `scenario` that would make it meaningless for `robot`; empty if there is nothing.

    Contact is exact; whether the robot fits through is judged on a grid of 0.05 m in the robot's favour.
    """
    try:
        plan = load_floor_plan(scenario.floor_plan)
    except ClearwayError as error:
        return [ClearwayError(str(error), field="floor_plan")]
    fixtures = _fixtures(plan)
    static = [
        (i, Standing(o.name, _shape(o), np.array(o.pose)))
        for i, o in enumerate(scenario.obstacles)
        if o.pose is not None
    ]
    placed = Crowd.of([s for _, s in static])
    if placed.drawn() > DRAWN:
        covers = (
            f"what stands covers {placed.drawn():.3g} cells of {CELL} m, one on top of the other; at most {DRAWN:,}"
        )
        return [ClearwayError(covers, field="obstacles")]
    standing = fixtures.and_others(placed)
    found = list(_static(static, plan, standing))
    robots = robots_placed(scenario, robot)
    people = [here for person in scenario.people if (here := person_placed(person)) is not None]
    found += robot_errors(scenario, robot, plan, standing)
    try:
        work = Work()
        found += _moving_obstacles(scenario, robots, people, standing, work)
        found += _swinging(scenario, [*robots, *people], fixtures, work)
    except ClearwayError as error:
        return [*found, error]
    fleet = list(fleet_errors(scenario, robot, plan, standing))
    if not any(error.field and error.field.endswith(".robot") for error in fleet):
        fleet += people_errors(scenario, robot, plan, standing)
    found += fleet
    return found


def check_file(path: str | Path, robot: Robot | None = None) -> list[ClearwayError]:
    """Everything that is wrong with a file: scenario, suite, robot, floor plan (TOML) or ROS map (yaml).

    Args:
        path: The file; its keys say which kind it is.
        robot: The robot for which scenarios are checked; default: TIAGo.
    """
    path = Path(path)
    robot = robot or load_robot(ROBOT)
    try:
        if path.suffix in (".yaml", ".yml"):
            load_floor_plan(str(path))
            return []
        table = read_toml(path)
        kind = kind_of(table)
        model, wrong = parse(kind, table, path)
        if model is None:
            return wrong
        if kind is Scenario:
            families = load_families(path)
            return _in(
                path,
                check_scenario(load_scenario(path), robot) or [e for f in families for e in check_family(f, robot)],
            )
        if isinstance(model, SuiteSpec):
            return list(_tests(model, path, robot))
        if isinstance(model, FloorPlanSpec):
            return _in(path, check_plan(load_floor_plan(str(path)), robot))
        return list(_presets(path, table))
    except ClearwayError as error:
        return [error]


def check_family(family: Family, robot: Robot) -> list[ClearwayError]:
    """Ranges at neither end of which the scenario makes sense for the robot, all else as it stands."""
    found = []
    for variable in family.variables:
        why = [_at(family, variable.path, value, robot) for value in (variable.low, variable.high)]
        if all(why):
            ends = f"neither end of the range [{variable.low:g}, {variable.high:g}] makes sense"
            found.append(ClearwayError(f"{ends}: {why[0]}", field=f"family.{variable.name}"))
    return found


def _at(family: Family, path: Path_, value: float, robot: Robot) -> str:
    """What is wrong with the scenario with that value there; empty if nothing is."""
    table = copy.deepcopy(family.table)
    put(table, path, value)
    try:
        problems = check_scenario(scenario_from(table), robot)
    except ClearwayError as error:  # other fields may hang on it, and vary too
        return "" if error.field != ".".join(map(str, path)) else error.problem
    return problems[0].problem if problems else ""


def _tests(spec: SuiteSpec, path: Path, robot: Robot) -> Iterator[ClearwayError]:
    """What is wrong with the tests that are made of a suite's scenarios, or that they are too many."""
    scenarios = scenarios_of(spec, path)
    refuse_many(len(scenarios) * max(1, len(spec.speeds)) * spec.repetitions, spec.name)
    slowest = {"speed": min(spec.speeds)} if spec.speeds else {}  # what makes sense at that does at all of them
    for scenario in scenarios:
        for error in check_scenario(scenario.model_copy(update=slowest), robot):
            yield ClearwayError(error.problem, file=path, field=f"scenario {scenario.name!r}: {error.field}")


def _in(path: Path, errors: Sequence[ClearwayError]) -> list[ClearwayError]:
    return [ClearwayError(e.problem, file=path, field=e.field) for e in errors]


def _presets(path: Path, table: dict[str, dict[str, object]]) -> Iterator[ClearwayError]:
    for preset in ["", *(f":{name}" for name in table.get("presets", {}))]:
        try:
            load_robot(f"{path}{preset}")
        except ClearwayError as error:
            yield error


def check_plan(plan: FloorPlan, robot: Robot) -> list[ClearwayError]:
    """Everything that is wrong with a plan's line A-B and the area that it promises to keep clear; empty if nothing is.

    Args:
        plan: The floor plan.
        robot: Who is to stand at A and at B and to get from one to the other.
    """
    found, fixtures = [], _fixtures(plan)
    ends = [(name, pose) for name, pose in (("a", plan.a), ("b", plan.b)) if pose is not None]
    for name, pose in ends:
        if problem := place_problem(
            name.upper(), (float(pose[0]), float(pose[1]), float(pose[2])), robot, plan, fixtures
        ):
            found.append(ClearwayError(problem, field=name))
    if ends and not found:
        bodies = tuple((s.shape, (float(s.pose[0]), float(s.pose[1]), float(s.pose[2]))) for s in fixtures.members)
        needed = inscribed_radius(robot.shape)
        places = tuple((float(pose[0]), float(pose[1])) for _, pose in ends)
        for width in widest(bodies, plan.bounds, places, needed):
            if width is not None:
                text = f"{robot.name} is {2 * needed:.2f} m wide, but the widest way from A to B is about {width:.2f} m"
                found.append(ClearwayError(text, field="b"))
    if plan.clear is not None:
        x0, y0, x1, y1 = plan.clear
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0])
        area = rectangle(x1 - x0, y1 - y0)
        found += [
            ClearwayError(f"{f.name!r} stands in the area that is to be clear", field="clear")
            for f in plan.fixtures
            if clearance(area, middle, f.shape, f.pose) <= 0
        ]
    return found


def _static(static: Sequence[tuple[int, Standing]], plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    before = len(standing.members) - len(static)
    for n, (i, here) in enumerate(static):
        if not is_inside(here.pose.tolist(), plan):
            problem = f"{at_text(here.pose)} is outside the floor plan {extent_text(plan)}"
        elif hit := first_hit(here.shape, here.pose, standing, before + n):
            problem = f"{here.name!r} at {at_text(here.pose)} overlaps {hit!r}"
        else:
            continue
        yield ClearwayError(problem, field=f"obstacles.{i}.pose")


def _moving_obstacles(
    scenario: Scenario, robots: Sequence[Placed], people: Sequence[Placed], standing: Crowd, work: Work
) -> Iterator[ClearwayError]:
    legs = {leg.name: k for k, leg in enumerate(scenario.legs)}
    for i, obstacle in enumerate(scenario.obstacles):
        for j, run in enumerate(obstacle.runs):
            field = f"obstacles.{i}.runs.{j}"
            shape = _shape(obstacle)
            stray = 0.0 if obstacle.behaviour is None else obstacle.behaviour.line_keeping
            near = standing.near(np.array(run.path), circumscribed_radius(shape) + 1.1 * stray)
            lines = hands(run, stray) if near and stray > 0.0 else []
            work.add((_length(run) / STEP + len(run.path)) * (1 + len(near) * (1 + len(lines))), f"{field}.path")
            way = _sampled_path(run)
            poses = np.concatenate([way, *map(_sampled, lines)])
            gaps = min_clearance(shape, poses, near, np.zeros((len(poses), 0, 3))) if near else None
            if gaps is not None and gaps.min() <= 0:
                where = poses[int(gaps.argmin())]
                hit = first_hit(shape, where, standing)
                whoever = f", as a hand that keeps the line within {stray:g} m may drive it" if lines else ""
                yield ClearwayError(
                    f"{obstacle.name!r} would run into {hit!r} at {at_text(where)}{whoever}", field=f"{field}.path"
                )
            if -run.delay * run.speed >= _length(run):
                continue
            begin = way[min(int(max(0.0, -run.delay) * run.speed / STEP), len(way) - 1)]
            if leg := legs[run.leg]:
                there = [replace(robots[0], pose=np.array(scenario.legs[leg - 1].goal), xy=0.0, yaw=0.0)]
            elif run.delay <= 0.0 and obstacle.behaviour is None:  # an operator waits until nobody is in the place
                there = [*robots, *people]
            else:
                there = [*robots]
            work.add(len(there) * MEETING, f"{field}.path")
            if (touched := met(Placed(repr(obstacle.name), shape, begin), there)) is not None:
                who, how = touched
                yield ClearwayError(
                    f"{obstacle.name!r} touches {who.called} when it appears at {at_text(begin)}{how}; give it a longer run-up",
                    field=f"{field}.path",
                )


def _swinging(scenario: Scenario, there: Sequence[Placed], fixtures: Crowd, work: Work) -> Iterator[ClearwayError]:
    """What oscillates passes through other obstacles, as in paper B, but not through walls, and begins in nobody who is `there`."""
    seconds = sum(leg.time_limit for leg in scenario.legs)
    for i, obstacle in enumerate(scenario.obstacles):
        motion = obstacle.lasting
        if motion is None:
            continue
        shape, field = _shape(obstacle), f"obstacles.{i}.{'oscillation' if obstacle.oscillation else 'motion'}"
        work.add(len(there) * MEETING, field)
        if (touched := met(Placed(repr(obstacle.name), shape, np.array([*motion.start, 0.0])), there)) is not None:
            who, how = touched
            yield ClearwayError(
                f"{obstacle.name!r} at {at_text(motion.start)} touches {who.called} at the start {at_text(who.pose)}{how}",
                field=f"{field}.start",
            )
        if seconds > LONGEST_SWING:
            yield ClearwayError(
                f"the legs may take {seconds:g} s together; with something that oscillates, at most {LONGEST_SWING:g}",
                field="legs.time_limit",
            )
            return
        if not fixtures.members:
            continue
        work.add(
            5 * seconds / STEP + (0 if isinstance(motion, OscillationSpec) else motions.effort(motion, seconds)), field
        )
        if isinstance(motion, OscillationSpec):
            start, velocity = np.array(motion.start), np.array(motion.velocity)
            attraction, stiffness = np.array(motion.attraction), np.array(motion.stiffness)
            count = math.ceil(seconds / STEP)
            states = trajectory(start, velocity, attraction, stiffness, STEP, count)
            way = np.column_stack([STEP * np.arange(count + 1), states[:, :2]])
        else:
            way = motions.knots(motion, seconds)
            way = way[np.isfinite(way[:, 1])]
        near = fixtures.near(way[:, 1:], circumscribed_radius(shape))
        if not near:
            continue
        work.add(len(way) * len(near), field)
        poses = np.column_stack([way[:, 1:], np.zeros(len(way))])
        gaps = min_clearance(shape, poses, near, np.zeros((len(poses), 0, 3)))
        if gaps.min() <= 0:
            first = int((gaps <= 0).argmax())
            hit = first_hit(shape, poses[first], fixtures)
            yield ClearwayError(
                f"{obstacle.name!r} would swing into {hit!r} at {at_text(poses[first])} after {way[first, 0]:.1f} s",
                field=field,
            )


def _shape(obstacle: ObstacleSpec) -> Shape:
    return obstacle.shape.shape()


def _sampled_path(run: RunSpec) -> FloatArray:
    """Poses (n, 3) every `STEP` along the path, heading along it."""
    parts = []
    for (x0, y0), (x1, y1) in itertools.pairwise(run.path):
        n = max(1, math.ceil(math.dist((x0, y0), (x1, y1)) / STEP))
        s = np.linspace(0.0, 1.0, n + 1)
        heading = np.full(n + 1, math.atan2(y1 - y0, x1 - x0))
        parts.append(np.stack([x0 + s * (x1 - x0), y0 + s * (y1 - y0), heading], axis=1))
    return np.concatenate(parts)


def _sampled(line: Line) -> FloatArray:
    """The same as a hand drives it."""
    return line.poses(np.linspace(0.0, line.length, math.ceil(line.length / STEP) + 1))


def _length(run: RunSpec) -> float:
    return sum(math.dist(p, q) for p, q in itertools.pairwise(run.path))

"""Says what is wrong with where those start and go who drive and walk in a scenario."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius, inscribed_radius
from clearway.quantities import PoseSpec
from clearway.robots import Robot, load_robot
from clearway.scenarios.check_ends import End
from clearway.scenarios.check_starts import Placed, met, person_placed, robot_placed, robots_placed
from clearway.scenarios.crowd import Crowd, Standing
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.people_floor import floor_errors
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.way import CELL, Room, room_for, widest_way


def robot_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """Where a robot starts and goes: inside of the plan, with room to stand, in time, on ways that it fits through.

    Args:
        scenario: With the start and the legs of this robot.
        robot: It.
        plan: The floor plan.
        standing: Everything that stands.
    """
    staying = standing.and_others(_staying(scenario.people))
    starts = [scenario.start, *(leg.goal for leg in scenario.legs)]
    problems = {"start": _start_problem(scenario, robot, plan, standing)} | {
        f"legs.{i}.goal": place_problem(f"the goal {leg.name!r}", leg.goal, robot, plan, staying)
        for i, leg in enumerate(scenario.legs)
    }
    yield from (ClearwayError(problem, field=field) for field, problem in problems.items() if problem)
    yield from _time_limits(scenario, robot, starts)
    alone = first_hit(robot.shape, np.array(scenario.start), staying) is None  # else that is said of the people
    if alone and not any(problems.values()):
        yield from _ways(scenario, robot, plan, starts, staying.members)


def fleet_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """The same of a scenario's other robots, and whether robots start in each other, or are to end there."""
    own = scenario.members()
    placed = [replace(robot_placed(own[0], robot), called=repr(scenario.member))]
    ends = [End.of(own[0], robot)]
    for i, (spec, alone) in enumerate(zip(scenario.robots, own[1:], strict=True)):
        try:
            other = robot if spec.robot is None else load_robot(spec.robot)
        except ClearwayError as error:
            yield ClearwayError(str(error), field=f"robots.{i}.robot")
            continue
        for found in robot_errors(alone, other, plan, standing):
            yield ClearwayError(found.problem, field=f"robots.{i}.{found.field}")
        here = replace(robot_placed(alone, other), called=repr(spec.name))
        if (hit := met(here, placed)) is not None:
            who, how = hit
            problem = f"{spec.name!r} at {at_text(spec.start)} would stand in {who.called}{how}"
            yield ClearwayError(problem, field=f"robots.{i}.start")
        placed.append(here)
        if spec.role != "tested":  # a robot that is may come before it
            continue
        end = End.of(alone, other)
        for first in ends:
            if not end.leaves_room(first):
                yield ClearwayError(
                    f"{spec.name!r} and {first.name!r} can't both end there: at {at_text(end.pose)} and {at_text(first.pose)}, within"
                    f" {end.xy:g} and {first.xy:g} m, one would stand in the other, which stays where it has ended",
                    field=f"robots.{i}.legs.{len(spec.legs) - 1}.goal",
                )
                break
        ends.append(end)


def people_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """Where people start and go: inside of the plan, with room to stand, on ways that they fit through, while the trial lasts."""
    yield from floor_errors(scenario.people, standing)
    bodies = tuple((s.shape, (float(s.pose[0]), float(s.pose[1]), float(s.pose[2]))) for s in standing.members)
    placed = robots_placed(scenario, robot)
    robots, over = placed[:], _longest(scenario)
    going: dict[float, list[tuple[int, list[tuple[float, float]]]]] = {}
    for i, person in enumerate(scenario.people):
        shape, places = Circle(person.radius), [person.start, *(stop.at for stop in person.route)]
        fields = [f"people.{i}.start", *(f"people.{i}.route.{k}.at" for k in range(len(person.route)))]
        fits, recorded = True, person.behaviour == "recorded"
        for field, place in zip(fields, places, strict=True):
            pose, what = (*place, 0.0), f"{person.name!r} at {at_text((*place, 0.0))}"
            hit = None if not is_inside(pose, plan) else first_hit(shape, np.array(pose), standing)
            if not is_inside(pose, plan):
                yield ClearwayError(f"{what} is outside the floor plan {extent_text(plan)}", field=field)
            elif hit:
                yield ClearwayError(f"{what} would stand in {hit!r}", field=field)
            fits = fits and hit is None and is_inside(pose, plan)
        if recorded and (when := _missed(person.track, over)):
            yield ClearwayError(f"{when}; times count from its beginning", field=f"people.{i}.track")
        if (here := person_placed(person)) is not None:
            if (touched := met(here, robots if recorded else placed)) is not None:
                who, how = touched
                yield ClearwayError(
                    f"{person.name!r} at {at_text(here.pose)} would stand in {who.called}{how}",
                    field=f"people.{i}.track" if recorded else fields[0],
                )
            if not recorded:  # who was is minded by others who were
                placed.append(here)
        if fits and person.route:
            going.setdefault(math.floor(person.radius / CELL) * CELL, []).append((i, places))
    for radius, some in going.items():  # once for all of about one size, in their favour
        every = tuple(place for _, places in some for place in places)
        widths = iter((None, *widest(bodies, plan.bounds, every, radius)))
        for i, places in some:
            for k, width in enumerate(itertools.islice(widths, len(places))):
                if k and width is not None:
                    person = scenario.people[i]
                    yield ClearwayError(
                        f"{person.name!r} is {2 * person.radius:.2f} m wide, but the widest way there is about {width:.2f} m",
                        field=f"people.{i}.route.{k - 1}.at",
                    )


def _staying(people: Sequence[PersonSpec]) -> Crowd:
    """Those of the people who never go from where they are, whatever comes."""
    never = [p for p in people if p.behaviour == "still" and (p.yields_at is None or not p.sees_robots)]
    return Crowd.of([Standing(p.name, Circle(p.radius), np.array((*p.start, 0.0))) for p in never])


def _missed(track: Sequence[tuple[float, float, float]], over: float) -> str:
    """When a recorded person comes or goes of whom a trial that is over by then [s] sees nothing; empty: it sees something."""
    (begins, *_), (ends, *_) = track[0], track[-1]
    if begins - over > 1e-6:
        return f"begins at {begins:g} s; the trial is over by {over:g} s"
    return f"ends at {ends:g} s, before the trial begins" if ends < 0.0 else ""


def _longest(scenario: Scenario) -> float:
    """By when the trials of all robots are over, s; a leg whose clock starts late may take its limit twice."""
    every = (scenario.legs, *(robot.legs for robot in scenario.robots))
    return max(sum(leg.time_limit * (2.0 if leg.clock_starts_after > 0.0 else 1.0) for leg in legs) for legs in every)


def place_problem(what: str, pose: PoseSpec, robot: Robot, plan: FloorPlan, standing: Crowd) -> str | None:
    """Why `robot` can't stand at `pose`, which is called `what`; None if it can."""
    if not is_inside(pose, plan):
        return f"{what} {at_text(pose)} is outside the floor plan {extent_text(plan)}"
    if hit := first_hit(robot.shape, np.array(pose), standing):
        return f"{robot.name} at {what} {at_text(pose)} would stand in {hit!r}"
    return None


def _start_problem(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> str | None:
    """The same of a scenario's start, however the robot is placed there."""
    here = robot_placed(scenario, robot)
    if problem := place_problem("the start", scenario.start, robot, plan, standing):
        return problem
    near = standing.near(here.pose[None, :2], circumscribed_radius(robot.shape) + here.loose)
    if hit := met(here, [Placed(repr(s.name), s.shape, s.pose) for s in near]):
        who, how = hit
        return f"{robot.name} at the start {at_text(here.pose)} would stand in {who.called}{how}"
    return None


def _time_limits(scenario: Scenario, robot: Robot, starts: Sequence[PoseSpec]) -> Iterator[ClearwayError]:
    speed = min(scenario.speed, robot.drive.v_max)
    for i, leg in enumerate(scenario.legs):
        least = max(0.0, math.dist(starts[i][:2], leg.goal[:2]) - leg.tolerances(robot.tolerances)[0]) / speed
        if least > leg.time_limit:
            yield ClearwayError(
                f"{leg.time_limit:g} s can't do: the straight way takes {least:.1f} s at {speed:g} m/s",
                field=f"legs.{i}.time_limit",
            )


def _ways(
    scenario: Scenario, robot: Robot, plan: FloorPlan, starts: Sequence[PoseSpec], standing: Sequence[Standing]
) -> Iterator[ClearwayError]:
    needed = inscribed_radius(robot.shape)
    bodies = tuple((s.shape, (float(s.pose[0]), float(s.pose[1]), float(s.pose[2]))) for s in standing)
    widths = widest(bodies, plan.bounds, tuple(p[:2] for p in starts), needed)
    for i, (leg, width) in enumerate(zip(scenario.legs, widths, strict=True)):
        if width is not None:
            yield ClearwayError(
                f"{robot.name} is {2 * needed:.2f} m wide, but the widest way to the goal {leg.name!r} is about {width:.2f} m",
                field=f"legs.{i}.goal",
            )


@lru_cache(maxsize=1024)
def widest(
    bodies: tuple[tuple[Shape, PoseSpec], ...],
    bounds: tuple[float, float, float, float],
    points: tuple[tuple[float, float], ...],
    needed: float,
) -> tuple[float | None, ...]:
    """`widest_way`, once for all the tests of a suite in which the same things stand."""
    return tuple(widest_way(_room(bodies, bounds, needed), points))


@lru_cache(maxsize=4)  # grids are large
def _room(bodies: tuple[tuple[Shape, PoseSpec], ...], bounds: tuple[float, float, float, float], needed: float) -> Room:
    """`room_for`, once for all robots and people of one size among the same things."""
    return room_for([(shape, np.array(pose)) for shape, pose in bodies], bounds, needed)


def first_hit(shape: Shape, pose: FloatArray, standing: Crowd, first: int | None = None) -> str | None:
    """Name of what `shape` at `pose` touches, of the `first` that stand."""
    near = standing.near(pose[None, :2], circumscribed_radius(shape), first)
    return next((s.name for s in near if clearance(shape, pose, s.shape, s.pose) <= 0), None)


def is_inside(pose: Sequence[float], plan: FloorPlan) -> bool:
    x0, y0, x1, y1 = plan.bounds
    return x0 <= pose[0] <= x1 and y0 <= pose[1] <= y1


def at_text(pose: Sequence[float] | FloatArray) -> str:
    return f"({pose[0]:g}, {pose[1]:g})"


def extent_text(plan: FloorPlan) -> str:
    x0, y0, x1, y1 = plan.bounds
    return f"{plan.name!r} (x {x0:g} to {x1:g}, y {y0:g} to {y1:g})"

"""Says what is wrong with where those start and go who drive and walk in a scenario."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius, inscribed_radius
from clearway.quantities import PoseSpec
from clearway.robots import Robot, load_robot
from clearway.scenarios.crowd import Crowd, Standing
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.way import CELL, Room, room_for, widest_way

_Placed = tuple[str, Shape, FloatArray]
"""A robot or a person at its start: its name, its shape, its pose (3,)."""


def robot_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """Where a robot starts and goes: inside of the plan, with room to stand, in time, on ways that it fits through.

    Args:
        scenario: With the start and the legs of this robot.
        robot: It.
        plan: The floor plan.
        standing: Everything that stands.
    """
    fits, starts = True, [scenario.start, *(leg.goal for leg in scenario.legs)]
    for i, pose in enumerate(starts):
        field, what = (
            ("start", "the start") if i == 0 else (f"legs.{i - 1}.goal", f"the goal {scenario.legs[i - 1].name!r}")
        )
        problem = place_problem(what, pose, robot, plan, standing)
        if problem is not None:
            fits = False
            yield ClearwayError(problem, field=field)
    yield from _time_limits(scenario, robot, starts)
    if fits:
        yield from _ways(scenario, robot, plan, starts, standing.members)


def fleet_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """The same of a scenario's other robots, and whether robots start in each other."""
    placed: list[_Placed] = [(scenario.member, robot.shape, np.array(scenario.start))]
    for i, (spec, own) in enumerate(zip(scenario.robots, scenario.members()[1:], strict=True)):
        try:
            other = robot if spec.robot is None else load_robot(spec.robot)
        except ClearwayError as error:
            yield ClearwayError(str(error), field=f"robots.{i}.robot")
            continue
        for found in robot_errors(own, other, plan, standing):
            yield ClearwayError(found.problem, field=f"robots.{i}.{found.field}")
        start = np.array(spec.start)
        for name, shape, at in placed:
            if _overlap(other.shape, start, shape, at):
                problem = f"{spec.name!r} at {at_text(spec.start)} would stand in {name!r}"
                yield ClearwayError(problem, field=f"robots.{i}.start")
                break
        placed.append((spec.name, other.shape, start))


def people_errors(scenario: Scenario, robot: Robot, plan: FloorPlan, standing: Crowd) -> Iterator[ClearwayError]:
    """Where people start and go: inside of the plan, with room to stand, on ways that they fit through."""
    bodies = tuple((s.shape, (float(s.pose[0]), float(s.pose[1]), float(s.pose[2]))) for s in standing.members)
    placed: list[_Placed] = [(robot.name, robot.shape, np.array(scenario.start))]
    placed += [
        (r.name, robot.shape if r.robot is None else load_robot(r.robot).shape, np.array(r.start))
        for r in scenario.robots
    ]
    going: dict[float, list[tuple[int, list[tuple[float, float]]]]] = {}
    for i, person in enumerate(scenario.people):
        shape, places = Circle(person.radius), [person.start, *(stop.at for stop in person.route)]
        fields = [f"people.{i}.start", *(f"people.{i}.route.{k}.at" for k in range(len(person.route)))]
        fits = True
        for field, place in zip(fields, places, strict=True):
            pose, what = (*place, 0.0), f"{person.name!r} at {at_text((*place, 0.0))}"
            hit = None if not is_inside(pose, plan) else first_hit(shape, np.array(pose), standing)
            if not is_inside(pose, plan):
                yield ClearwayError(f"{what} is outside the floor plan {extent_text(plan)}", field=field)
            elif hit:
                yield ClearwayError(f"{what} would stand in {hit!r}", field=field)
            fits = fits and hit is None and is_inside(pose, plan)
        if person.behaviour == "recorded":
            yield from _met_at_once(scenario, i, placed)
            continue
        start = np.array((*person.start, 0.0))
        for name, other, at in placed:
            if _overlap(shape, start, other, at):
                yield ClearwayError(
                    f"{person.name!r} at {at_text((*person.start, 0.0))} would stand in {name!r}", field=fields[0]
                )
                break
        placed.append((person.name, shape, start))
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


def _met_at_once(scenario: Scenario, i: int, placed: Sequence[_Placed]) -> Iterator[ClearwayError]:
    """Where somebody who was recorded is in a robot when the trial begins; the others were minded when it was recorded."""
    person, robots = scenario.people[i], placed[: 1 + len(scenario.robots)]
    t, x, y = np.array(person.track).T
    if not t[0] <= 0.0 <= t[-1]:
        return
    at = np.array((np.interp(0.0, t, x), np.interp(0.0, t, y), 0.0))
    for name, other, there in robots:
        if _overlap(Circle(person.radius), at, other, there):
            yield ClearwayError(f"{person.name!r} at {at_text(at)} would stand in {name!r}", field=f"people.{i}.track")
            return


def _overlap(shape: Shape, pose: FloatArray, other: Shape, there: FloatArray) -> bool:
    """Whether `shape` at `pose` (3,) touches the `other` at `there` (3,); most are far apart."""
    apart = math.hypot(pose[0] - there[0], pose[1] - there[1])
    return (
        apart <= circumscribed_radius(shape) + circumscribed_radius(other) + 1e-6
        and clearance(shape, pose, other, there) <= 0.0
    )


def place_problem(what: str, pose: PoseSpec, robot: Robot, plan: FloorPlan, standing: Crowd) -> str | None:
    """Why `robot` can't stand at `pose`, which is called `what`; None if it can."""
    if not is_inside(pose, plan):
        return f"{what} {at_text(pose)} is outside the floor plan {extent_text(plan)}"
    if hit := first_hit(robot.shape, np.array(pose), standing):
        return f"{robot.name} at {what} {at_text(pose)} would stand in {hit!r}"
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

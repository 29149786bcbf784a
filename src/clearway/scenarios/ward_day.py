"""The suites `ward-day` and `ward-day-held-out`: a robot does its rounds while staff, patients and visitors go about theirs.

Every task is a way there and the way back, through doors and a corridor in which a bed or a wheelchair is pushed. People differ from
repetition to repetition, the same way in every campaign; `Selection.seeds` draws others. Nothing of it is recorded or published: it is ours.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import partial

import numpy as np

from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle
from clearway.quantities import PoseSpec
from clearway.robots import Robot
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.scenario import LabelSpec, LegSpec, ObstacleSpec, RectangleSpec, RunSpec, Scenario
from clearway.scenarios.suite import (
    Section,
    Selection,
    Suite,
    draw,
    refuse_floor_plan,
    refuse_speeds,
    scenario_seed,
    variations,
    without_drawing,
)
from clearway.scenarios.ward_floors import HELD_OUT, RADIUS, WARD, Place, Ward
from clearway.scenarios.ward_people import people

REPETITIONS = 3
PATIENCE, LONGER = 90.0, 3.0
"""s that a leg may take beside so many times what the straight way takes at the set speed."""
DELAY = 10.0
"""What is pushed comes into the corridor up to so long after a leg begins, s."""
CLEAR = 0.05
"""Room between the robot and who stands where it starts, at least, m."""
_PUSHED = (
    None,
    ("bed", RectangleSpec(kind="rectangle", length=2.1, width=0.96), 0.7, 0.4),
    ("wheelchair", RectangleSpec(kind="rectangle", length=1.1, width=0.7), 0.9, 0.6),
)
"""Name, outline, speed [m/s] and acceleration [m/s^2]; one after the other by the number of the repetition, or the seed."""


def build(robot: Robot, selection: Selection, seed: int, ward: Ward) -> Sequence[Scenario]:
    """Every task with every number of people, or with those of the selected batches, at `selection.speeds`, in each variation."""
    refuse_floor_plan(selection.floor_plan, ward.name, ward.plan)
    refuse_speeds(selection.speeds, robot)
    numbers = {f"people-{n}": n for n in ward.numbers}
    numbers |= {b: int(b[7:]) for b in selection.batches if re.fullmatch("people-(0|[1-9][0-9]{0,8})", b)}
    made = []
    for batch in selection.batches or numbers:
        if batch not in numbers:
            continue  # the caller complains of it
        for task in ward.tasks:
            if selection.configurations and task not in selection.configurations:
                continue
            for speed in selection.speeds or (ward.speed,):
                for label, repetition, key in variations(selection, REPETITIONS):
                    name = f"{batch}-{task}-v{speed:g}-{label}"
                    if not selection.scenarios or name in selection.scenarios:
                        labels = LabelSpec(batch=batch, configuration=task, repetition=repetition)
                        own = scenario_seed(seed, name)
                        made.append(_scenario(ward, robot, name, numbers[batch], speed, labels, f"{task} {key}", own))
    return made


def _scenario(
    ward: Ward, robot: Robot, name: str, number: int, speed: float, labels: LabelSpec, key: str, seed: int
) -> Scenario:
    start, end = ward.tasks[labels.configuration]
    limit = round(PATIENCE + LONGER * math.dist(start[:2], end[:2]) / speed, 1)
    return Scenario(
        name=name,
        floor_plan=ward.plan,
        start=start,
        legs=(_leg("forth", end, limit), _leg("back", start, limit)),
        speed=speed,
        obstacles=_pushed(ward, key) if number else (),
        people=people(ward, number, key, partial(_is_free, robot, start)),
        labels=labels,
        seed=seed,
    )


def _is_free(robot: Robot, start: PoseSpec, place: Place) -> bool:
    """Whether nobody who stands at `place` touches the robot; most robots are small enough to leave all of them."""
    return clearance(robot.shape, np.array(start), Circle(RADIUS), np.array((*place, 0.0))) > CLEAR


def _leg(name: str, goal: PoseSpec, limit: float) -> LegSpec:
    return LegSpec(name=name, goal=goal, yaw_tolerance=math.inf, time_limit=limit)


def _pushed(ward: Ward, key: str) -> tuple[ObstacleSpec, ...]:
    """A bed, a wheelchair or nothing; once on either leg."""
    what = _PUSHED[int(key[-1]) % len(_PUSHED)]
    if what is None:
        return ()
    name, shape, speed, acceleration = what
    runs = tuple(
        RunSpec(leg=leg, path=path, speed=speed, delay=round(DELAY * draw(k, f"{ward.name} pushed {key}"), 2))
        for k, (leg, path) in enumerate(zip(("forth", "back"), ward.pushed, strict=True))
    )
    who = OperatorSpec(acceleration=acceleration, deceleration=0.8, line_keeping=0.05)
    return (ObstacleSpec(name=name, shape=shape, behaviour=who, runs=runs),)


def _suite(ward: Ward, title: str, description: str) -> Suite:
    make = partial(build, ward=ward)
    return Suite(
        ward.name,
        title,
        description,
        batches=tuple(f"people-{n}" for n in ward.numbers),
        configurations=tuple(ward.tasks),
        make=make,
        family="ward-day",
        robots=("tiago", "hosbot"),
        report=(Section.BY_NUMBER,),
        generator=without_drawing(make),
        source="A day in a hospital ward, of our own making: tasks, people and their ways are taken from no paper, patients walk as slowly as"
        " measured in hospitals (Peel, Kuys, Klein 2013). The batches are numbers of people. No figures of others stand beside it.",
    )


WARD_DAY = _suite(
    WARD,
    "A day in a ward",
    "A robot's errands through a hospital ward, there and back, among 0 to 40 people who go about theirs; a bed or wheelchair is pushed past",
)
HELD_OUT_WARD_DAY = _suite(
    HELD_OUT,
    "A day in a ward, held out",
    "the same on another floor plan, with other numbers of people, at another speed, on which nothing was chosen",
)

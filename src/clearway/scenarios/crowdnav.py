"""The suites `crowd` and `crowd-held-out`: the benchmark of CrowdNav, and the same at another density.

Chen, Liu, Kreiss, Alahi 2019 ("Crowd-robot interaction: crowd-aware robot navigation with attention-based deep reinforcement
learning") by the code that they published (vita-epfl/CrowdNav at 20d6780): a robot crosses an open floor among five people, who come
from a circle and want to its other side, or cross a square from left to right or back. Its 500 test cases are drawn by numpy's legacy
generator, whose stream is frozen, from the seeds 1000 to 1499. Which reading was chosen where stands in DECISIONS.md beside this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius
from clearway.robots import Robot
from clearway.scenarios.people import PersonSpec, StopSpec
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import (
    Generator,
    Published,
    Selection,
    Suite,
    draw_label,
    refuse_floor_plan,
    refuse_speeds,
    scenario_seed,
    selected_seeds,
)

CASES = 500
"""Test cases of each batch."""
TEST, TRAINING = 1000, 2000
"""The seeds of CrowdNav's test cases begin at the one, those of its training at the other; other draws are from the latter."""
RADIUS, SPEED, COMFORT = 0.3, 1.0, 0.2
"""Of people and robot: radius [m], preferred speed [m/s], room between two of them that is kept where they start and end [m]."""
TIME_LIMIT = 24.0
"""A step that begins at 24 s or later ends a case as a timeout, s; CrowdNav's time limit of 25 s is counted so."""
FLOOR = "crowd-floor"
MOST = 2**32 - TRAINING
"""Seeds that are drawn from are below this: what the generator takes."""

_Crossing = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Geometry:
    """How large a crossing is, and how many cross.

    Attributes:
        people: How many.
        radius: Of the circle, on which the robot's start and goal lie, m.
        width: Of the square, m.
    """

    people: int
    radius: float
    width: float


PUBLISHED = Geometry(5, 4.0, 10.0)
DENSER = Geometry(8, 5.0, 10.0)


def crossings(rule: str, seed: int, geometry: Geometry = PUBLISHED) -> tuple[_Crossing, ...]:
    """Where each of the people starts and wants to: x, y, x, y [m].

    Args:
        rule: `circle` or `square`.
        seed: Of numpy's legacy generator.
        geometry: How large, how many.
    """
    draws = np.random.RandomState(seed)
    taken: list[_Crossing] = [(0.0, -geometry.radius, 0.0, geometry.radius)]  # the robot's
    for _ in range(geometry.people):
        cross = _across_circle if rule == "circle" else _across_square
        taken.append(cross(draws.random_sample, geometry, taken))
    return tuple(taken[1:])


def _across_circle(draw: Callable[[], float], geometry: Geometry, taken: Sequence[_Crossing]) -> _Crossing:
    """From a place near the circle to the one opposite, clear of where others start and where they want to."""
    while True:
        angle = draw() * np.pi * 2
        dx, dy = (draw() - 0.5) * SPEED, (draw() - 0.5) * SPEED
        x, y = float(geometry.radius * np.cos(angle) + dx), float(geometry.radius * np.sin(angle) + dy)
        if _free(x, y, [(o[0], o[1]) for o in taken]) and _free(x, y, [(o[2], o[3]) for o in taken]):
            return x, y, -x, -y


def _across_square(draw: Callable[[], float], geometry: Geometry, taken: Sequence[_Crossing]) -> _Crossing:
    """From one half of the square to the other; starts clear of starts, ends of ends."""
    side, width = (-1 if draw() > 0.5 else 1), geometry.width
    ends: list[tuple[float, float]] = []
    for end, sign in ((0, side), (2, -side)):
        while True:
            x, y = draw() * width * 0.5 * sign, (draw() - 0.5) * width
            if _free(x, y, [(o[end], o[end + 1]) for o in taken]):
                ends.append((x, y))
                break
    return (*ends[0], *ends[1])


def _free(x: float, y: float, places: Sequence[tuple[float, float]]) -> bool:
    return all(math.hypot(x - px, y - py) >= 2 * RADIUS + COMFORT for px, py in places)


@dataclass(frozen=True, slots=True)
class Batch:
    """One way to run the cases.

    Attributes:
        name: Its name.
        rule: As for `crossings`.
        seen: Whether people see the robot.
    """

    name: str
    rule: str
    seen: bool


BATCHES = tuple(
    Batch(f"{rule}-{how}", rule, how == "visible") for rule in ("circle", "square") for how in ("invisible", "visible")
)


def build(
    robot: Robot,
    selection: Selection,
    seed: int,
    suite: str,
    geometry: Geometry,
    draw: Callable[[str, int, Geometry], Sequence[_Crossing] | None],
) -> list[Scenario]:
    """The test cases of each batch, or what `draw` gives for `selection.seeds`; at `selection.speeds` (default: 1 m/s, or what the
    robot can do), `selection.repetitions` times, each with other noise of the robot's sensors.

    Raises:
        ClearwayError: another floor plan is selected, or a speed that is beyond the robot.
    """
    refuse_floor_plan(selection.floor_plan, suite, FLOOR)
    refuse_speeds(selection.speeds, robot)
    return [
        _scenario(batch, label, people, robot, speed, repetition, seed, geometry)
        for batch in _chosen(selection)
        for label, people in _people(batch, selection, geometry, draw)
        for speed in selection.speeds or (min(SPEED, robot.drive.v_max),)
        for repetition in range(1, (selection.repetitions or 1) + 1)
    ]


def _chosen(selection: Selection) -> list[Batch]:
    return [batch for batch in BATCHES if not selection.batches or batch.name in selection.batches]


def _people(
    batch: Batch,
    selection: Selection,
    geometry: Geometry,
    draw: Callable[[str, int, Geometry], Sequence[_Crossing] | None],
) -> list[tuple[str, Sequence[_Crossing] | None]]:
    """Labels, and where people go."""
    if selection.seeds is not None:
        return [(draw_label(s), draw(batch.rule, TRAINING + s, geometry)) for s in _seeds(batch, selection)]
    cases = ((f"case-{k}", TEST + k) for k in range(CASES))
    asked = selection.configurations
    return [(label, crossings(batch.rule, s, geometry)) for label, s in cases if not asked or label in asked]


def _seeds(batch: Batch, selection: Selection) -> Sequence[int]:
    """The seeds to draw from.

    Raises:
        ClearwayError: one is beyond the generator.
    """
    if selection.seeds is not None and selection.seeds[1] > MOST:
        raise ClearwayError(f"this suite draws from seeds below {MOST:,}", field="seeds")
    return selected_seeds(selection, f"{batch.name}-seed-")


def _calls(selection: Selection, geometry: Geometry) -> list[tuple[str, int, Geometry]]:
    """What `crossings` is to be called with for the `selection`."""
    found = ((b.rule, TRAINING + s, geometry) for b in _chosen(selection) for s in _seeds(b, selection))
    return list(dict.fromkeys(found))


def _scenario(
    batch: Batch, label: str, people: Sequence[_Crossing] | None, robot: Robot, speed: float, repetition: int, seed: int,
    geometry: Geometry,
) -> Scenario:  # fmt: skip
    name = f"{batch.name}-{label}-v{speed:g}-r{repetition}"
    way = LegSpec(
        name="way", goal=(0.0, geometry.radius, math.pi / 2), xy_tolerance=circumscribed_radius(robot.shape),
        yaw_tolerance=math.inf, time_limit=TIME_LIMIT, arrival="measured",
    )  # fmt: skip
    return Scenario(
        name=name,
        floor_plan=FLOOR,
        start=(0.0, -geometry.radius, math.pi / 2),
        legs=(way,),
        speed=speed,
        people=tuple(
            PersonSpec(
                name=f"person {i}", start=(x, y), route=(StopSpec(at=(gx, gy)),), speed=SPEED, radius=RADIUS,
                behaviour="crowdnav", sees_robots=batch.seen,
            )
            for i, (x, y, gx, gy) in enumerate(people or (), 1)
        ),
        labels=LabelSpec(batch=batch.name, configuration=label, repetition=repetition),
        reference_length=2 * geometry.radius,
        localisation="truth",
        tracking="difference",
        placement_xy=0.0,
        placement_yaw=0.0,
        seed=scenario_seed(seed, name),
    )  # fmt: skip


def floor() -> FloorPlan:
    """An open floor, larger than any crossing."""
    box = (-10.0, -10.0, 10.0, 10.0)
    return FloorPlan(FLOOR, "Open floor, 20 m x 20 m", (), None, None, None, None, box, area=box)


_CODE = "ORCA, the authors' code run again"
FIGURES = (
    Published("circle-invisible", "ORCA, as the authors print it", CASES, 0.43, 0.57, 10.86),
    Published("circle-invisible", _CODE, CASES, 0.426, 0.568, 10.86),
    Published("circle-visible", _CODE, CASES, 1.0, 0.0, 10.02),
    Published("square-invisible", _CODE, CASES, 0.738, 0.258, 9.12),
    Published("square-visible", _CODE, CASES, 1.0, 0.0, 8.90),
)
"""How CrowdNav's own ORCA robot fares."""


def _suite(
    name: str, title: str, description: str, source: str, geometry: Geometry, published: tuple[Published, ...] = ()
) -> Suite:
    outlines = partial(build, suite=name, geometry=geometry, draw=lambda rule, seed, geometry: None)
    generator = Generator(
        partial(_calls, geometry=geometry), crossings, outlines, read=lambda rows: tuple(tuple(row) for row in rows)
    )
    return Suite(
        name,
        title,
        description,
        batches=tuple(batch.name for batch in BATCHES),
        configurations=tuple(f"case-{k}" for k in range(CASES)),
        make=partial(build, suite=name, geometry=geometry, draw=generator),
        family="crowd",
        robots=("crowdnav-disc",),
        report=(),
        floor_plans={FLOOR: floor} if geometry is PUBLISHED else {},
        generator=generator,
        source=source,
        published=published,
    )


CROWD = _suite(
    "crowd",
    "CrowdNav's benchmark",
    "8 m across an open floor among five people who cross it as well, who see the robot or not: CrowdNav's 500 test cases",
    "CrowdNav's benchmark is that of Chen, Liu, Kreiss and Alahi (2019), by their code: 8 m across an open floor among five people who cross"
    " it as well, who see the robot or not, and of whom it is told everything without error.",
    PUBLISHED,
    FIGURES,
)
HELD_OUT = _suite(
    "crowd-held-out",
    "CrowdNav's benchmark, held out",
    "CrowdNav's rule at a density on which nothing was chosen: eight people, 10 m across",
    "CrowdNav's benchmark, held out, is the rule of Chen, Liu, Kreiss and Alahi (2019) with eight people and 10 m to go: a density of our own, on"
    " which nothing was chosen, and of which nothing is published.",
    DENSER,
)

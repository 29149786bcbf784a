"""The suites `meeting-points` and `meeting-points-held-out`: what several robots have always been tried on.

All robots start at once; each knows its own goal and the floor, none talks to another. Antipodal circle and swap, corridor and doorway, two
crossing streams; 2 to 32 robots. Every repetition moves the starts a little, the same way in every campaign; `Selection.seeds` draws others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius
from clearway.geometry.streams import stream, uniform
from clearway.quantities import PoseSpec
from clearway.robots import Robot, load_robot
from clearway.scenarios.meeting_places import (
    GEOMETRY,
    HELD_OUT,
    MOST,
    PLANS,
    SIZES,
    Geometry,
    Place,
    floor_plans,
    goal,
    plan_name,
    size_of,
    starts,
)
from clearway.scenarios.scenario import LabelSpec, LegSpec, RobotSpec, Scenario
from clearway.scenarios.suite import Section, Selection, Suite, scenario_seed, variations, without_drawing

NUMBERS = (2, 4, 8, 16, 32)
REPETITIONS = 3
PATIENCE = 30.0
"""s that everybody has beside three times the way and three times a robot's length for each that has to pass."""


def build(robot: Robot, selection: Selection, seed: int, geometry: Geometry) -> Sequence[Scenario]:
    """Every batch with every number of robots, or with that of the team, at `selection.speeds`, in each of its variations."""
    if selection.floor_plan is not None:
        raise ClearwayError(f"the suite {geometry.name!r} brings its own floor plans", field="floor_plan")
    team = [robot] if not selection.team else [load_robot(name) for name in dict.fromkeys(selection.team)]
    if len(selection.team) > MOST:
        raise ClearwayError(
            f"{len(selection.team)} robots are more than the floors of the suite {geometry.name!r} hold; at most {MOST}",
            field="team",
        )
    size = size_of(max(2.0 * circumscribed_radius(one.shape) for one in team))
    if size > SIZES[-1]:
        raise ClearwayError(
            f"the suite {geometry.name!r} has floors for robots of up to {SIZES[-1]:g} m; one here takes {size:g} m",
            field="robots",
        )
    slowest = min(one.drive.v_max for one in team)
    made = []
    for batch in selection.batches or PLANS:
        if batch not in PLANS:
            continue  # the caller complains of it
        for number in (len(selection.team),) if selection.team else NUMBERS:
            for speed in selection.speeds or (geometry.speed,):
                for label, repetition, key in variations(selection, REPETITIONS):
                    name = f"{batch}-{number}-v{speed:g}-{label}"
                    if not selection.scenarios or name in selection.scenarios:
                        places = _Places(geometry, batch, number, max(size, SIZES[0]), min(speed, slowest), key)
                        labels = LabelSpec(batch=batch, configuration=str(number), repetition=repetition)
                        made.append(_scenario(places, name, speed, labels, scenario_seed(seed, name)))
    return made


@dataclass(frozen=True, slots=True)
class _Places:
    """Where and how fast the robots of one scenario drive.

    Attributes:
        geometry: Distances.
        batch: What they do.
        robots: How many there are.
        size: Of the floor, m.
        speed: Of the slowest, m/s.
        key: By what their starts are drawn.
    """

    geometry: Geometry
    batch: str
    robots: int
    size: float
    speed: float
    key: str

    def ways(self) -> list[tuple[PoseSpec, LegSpec]]:
        """Of each robot its start and its leg."""
        key = stream(0, f"{self.geometry.name} {self.batch} {self.robots} {self.key}")
        found = []
        for k, (x, y) in enumerate(starts(self.geometry, self.batch, self.robots)):
            moved = [self.geometry.jitter * (2.0 * uniform(key, k, axis) - 1.0) for axis in range(2)]
            start = (x + moved[0], y + moved[1])
            found.append(self._way(start, goal(self.geometry, self.batch, start, k, self.robots)))
        return found

    def _way(self, start: Place, end: Place) -> tuple[PoseSpec, LegSpec]:
        heading = round(math.atan2(end[1] - start[1], end[0] - start[0]), 4)
        a, b = ((round(self.size * x, 3), round(self.size * y, 3), heading) for x, y in (start, end))
        limit = PATIENCE + 3.0 * (math.dist(a[:2], b[:2]) + self.robots * self.size) / self.speed
        return a, LegSpec(name="way", goal=b, yaw_tolerance=math.inf, time_limit=round(limit, 1))


def _scenario(places: _Places, name: str, speed: float, labels: LabelSpec, seed: int) -> Scenario:
    (start, leg), *others = places.ways()
    return Scenario(
        name=name,
        floor_plan=plan_name(places.geometry, places.batch, places.size),
        start=start,
        legs=(leg,),
        speed=speed,
        robots=tuple(RobotSpec(name=f"robot {k}", start=s, legs=(g,)) for k, (s, g) in enumerate(others, 2)),
        labels=labels,
        reference_length=math.dist(start[:2], leg.goal[:2]),
        localisation="truth",
        seed=seed,
    )


def _suite(geometry: Geometry, title: str, description: str) -> Suite:
    make = partial(build, geometry=geometry)
    return Suite(
        geometry.name,
        title,
        description,
        batches=tuple(PLANS),
        configurations=tuple(map(str, NUMBERS)),
        make=make,
        family="meeting-points",
        robots=("tiago",),
        report=(Section.BY_NUMBER,),
        several=True,
        floor_plans=floor_plans(geometry),
        generator=without_drawing(make),
        source="Antipodal circle, swap, crossing, corridor and doorway are what several robots have always been tried on (van den Berg, Guy, Lin, Manocha 2011;"
        " Alonso-Mora et al. 2013; Helbing, Molnár 1995; Helbing et al. 2005); sizes and rooms are ours, so no figures of others stand beside it.",
    )


MEETING_POINTS = _suite(
    GEOMETRY,
    "Meeting points",
    "2 to 32 robots exchange sides: antipodal circle, swap, crossing streams, a corridor, a doorway",
)
HELD_OUT_MEETING_POINTS = _suite(
    HELD_OUT,
    "Meeting points, held out",
    "the same on another geometry (radius, widths, distances, speed), on which nothing was chosen",
)

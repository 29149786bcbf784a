"""The suite `hospital`: the protocol of Rondoni et al. 2024 (paper A), section "Benchmarking protocol" and Table 1.

Four batches of growing complexity between A and B, d_AB = 5 m apart, each driven forth and back, three times:
NO (no obstacle), SO (static), MO (moving), CE (both). For one robot and navigator 9 + 252 + 27 + 48 = 336 trials.
Where the paper leaves something open, the reading chosen stands in docs/decisions.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from clearway.errors import ClearwayError
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_plan
from clearway.scenarios.scenario import (
    LabelSpec,
    LegSpec,
    ObstacleSpec,
    PoseSpec,
    Scenario,
)
from clearway.scenarios.suite import Selection, Suite

D_AB = 5.0
"""Distance of A and B, m (paper A)."""
SPEEDS = (0.2, 0.6, 1.0)
"""Set speeds v_0, v_1, v_2, m/s (paper A)."""
SIZES = (0.03, 0.15, 0.30, 0.60)
"""Edges of the square obstacles S_1 ... S_4, m (paper A)."""
GAPS = (1.0, 1.5, 2.0)
"""Edge-to-edge distances d_1, d_2, d_3 of double obstacles, in multiples of d_base (paper A)."""
REPETITIONS = 3
CONFIGURATIONS = {
    "NO": ("free",),
    "SO": ("single", "parallel", "perpendicular"),
    "MO": ("passing", "crossing", "overtaking"),
    "CE": ("complex",),
}

RUN_UP = 1.0
"""How far beyond A and B a passing mover starts and ends, m."""
CROSSING_REACH = 2.5
"""How far to either side of A-B a crossing mover starts and ends, m."""
CROSSING_BEFORE = 1.0
"""How far before the static obstacle the mover of CE crosses, m."""
OVERTAKING_BEHIND = 2.0
"""How far behind the robot an overtaking mover starts, m."""
OVERTAKING_ROOM = 0.2
"""Free space between an overtaking mover's disc and the robot's, m."""
TIMING = 0.5
"""A mover's start varies by this much either way, s."""


def build(robot: Robot, selection: Selection) -> list[Scenario]:
    """Every scenario of the protocol for `robot`; seeds are still zero."""
    plan = selection.plan or "hall"
    line = _Line(plan)
    repetitions = selection.repetitions or REPETITIONS
    return [
        _scenario(robot, line, plan, *test, repetition)
        for test in _tests(robot, line)
        for repetition in range(1, repetitions + 1)
    ]


class _Line:
    """A-B of a plan: maps a place (along, across), measured from the middle, and a heading into the plan."""

    def __init__(self, plan: str) -> None:
        place = load_plan(plan)
        if place.a is None or place.b is None:
            raise ClearwayError(f"the floor plan {plan!r} has no line from a to b, which the protocol needs")
        length = float(np.hypot(*(place.b - place.a)[:2]))
        if abs(length - D_AB) > 1e-6:
            raise ClearwayError(f"the floor plan {plan!r} has a and b {length:.3f} m apart; the protocol has {D_AB} m")
        self._x, self._y = (float(v) for v in (place.a[:2] + place.b[:2]) / 2)
        self.heading = float(place.a[2])

    def point(self, along: float, across: float) -> tuple[float, float]:
        c, s = math.cos(self.heading), math.sin(self.heading)
        return round(self._x + c * along - s * across, 9), round(self._y + s * along + c * across, 9)

    def pose(self, along: float, across: float, heading: float) -> PoseSpec:
        return (*self.point(along, across), math.remainder(self.heading + heading, math.tau))


Test = tuple[LabelSpec, float, tuple[ObstacleSpec, ...]]
"""Labels without repetition, set speed, obstacles without their timing."""


def _tests(robot: Robot, line: _Line) -> Iterator[Test]:
    for v in SPEEDS:
        yield LabelSpec(suite="hospital", batch="NO", configuration="free"), v, ()


def _scenario(
    robot: Robot,
    line: _Line,
    plan: str,
    labels: LabelSpec,
    speed: float,
    obstacles: tuple[ObstacleSpec, ...],
    repetition: int,
) -> Scenario:
    parts = [labels.batch]
    if len(CONFIGURATIONS[labels.batch]) > 1:
        parts.append(labels.configuration)
    parts.append(f"v{speed:g}")
    for letter, value in (("o", labels.obstacle_speed), ("s", labels.size), ("d", labels.gap)):
        if value is not None:
            parts.append(f"{letter}{value:g}")
    parts.append(f"r{repetition}")
    return Scenario(
        name="-".join(parts),
        plan=plan,
        start=line.pose(-D_AB / 2, 0.0, 0.0),
        legs=_legs(robot, line, speed),
        speed=speed,
        obstacles=obstacles,
        labels=labels.model_copy(update={"repetition": repetition}),
        reference_length=D_AB,
    )


def _legs(robot: Robot, line: _Line, speed: float) -> tuple[LegSpec, ...]:
    """Forth, the turn at B (not scored), back; each may take three times its nominal time and 20 s."""
    drive = 3 * D_AB / min(speed, robot.drive.v_max) + 20
    turn = 3 * math.pi / robot.drive.omega_max + 20
    return (
        LegSpec(name="forth", goal=line.pose(D_AB / 2, 0.0, 0.0), time_limit=drive),
        LegSpec(name="turn", goal=line.pose(D_AB / 2, 0.0, math.pi), time_limit=turn, scored=False),
        LegSpec(name="back", goal=line.pose(-D_AB / 2, 0.0, math.pi), time_limit=drive),
    )


HOSPITAL = Suite(
    name="hospital",
    title="Hospital benchmark",
    description="Paper A's protocol: no, static, moving obstacles and both, forth and back over 5 m at three speeds",
    batches=tuple(CONFIGURATIONS),
    configurations=tuple(c for names in CONFIGURATIONS.values() for c in names),
    make=build,
)

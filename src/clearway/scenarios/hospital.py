"""The suites `hospital` and `hospital-held-out`, and both with `-blind`: the protocol of Rondoni et al. 2024 (paper A), section "Benchmarking
protocol" and Table 1, with the paper's numbers, and with others on which nothing was chosen.

Four batches of growing complexity between A and B, d_AB = 5 m apart, each driven forth and back, three times:
NO (no obstacle), SO (static), MO (moving), CE (both). With the paper's numbers that makes 9 + 252 + 27 + 48 = 336 trials for
one robot and navigator. The moving obstacle is the other robot, which in the paper somebody drives with a joystick; in the suites with
`-blind` nobody looks where it goes. Where the paper leaves something open, the reading chosen stands in DECISIONS.md beside this file.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius
from clearway.quantities import PoseSpec
from clearway.robots import Robot, load_robot
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import LabelSpec, LegSpec, ObstacleSpec, RobotBodySpec, RunSpec, Scenario, SquareSpec
from clearway.scenarios.suite import Section, Selection, Suite, draw, scenario_seed

D_AB = 5.0
"""Distance of A and B, m (paper A)."""
CONFIGURATIONS = {
    "NO": ("free",),
    "SO": ("single", "parallel", "perpendicular"),
    "MO": ("passing", "crossing", "overtaking"),
    "CE": ("complex",),
}

RUN_UP = 1.0
"""How far beyond A and B a passing moving obstacle starts and ends, m."""
CROSSING_REACH = 2.5
"""How far to either side of A-B a crossing moving obstacle starts and ends, m."""
CROSSING_BEFORE = 1.0
"""How far before the static obstacle the moving obstacle of CE crosses, m."""
OVERTAKING_BEHIND = 2.0
"""How far behind the robot an overtaking moving obstacle starts, m."""
OVERTAKING_ROOM = 0.2
"""Free space between an overtaking moving obstacle's disc and the robot's, m."""
TIMING = 0.5
"""A moving obstacle's start varies by this much either way, s."""
OPERATOR = OperatorSpec()
"""Who drives the moving obstacles, with a joystick."""


@dataclass(frozen=True, slots=True)
class Protocol:
    """The numbers of the protocol: what makes a suite of it.

    Attributes:
        floor_plan: Where it runs unless the selection names another plan with a line of 5 m.
        speeds: Set speeds without moving obstacles, m/s.
        among_moving: Set speeds among moving obstacles, m/s.
        obstacle_speeds: Speeds of a passing and a crossing moving obstacle, m/s.
        overtaking: Set speed and the overtaking moving obstacle's speed, m/s.
        sizes: Edges of the square obstacles, m.
        gaps: Edge-to-edge distances of double obstacles, in multiples of d_base.
        repetitions: How many of each test, unless the selection says otherwise.
        operator: Who drives the moving obstacles; None: nobody looks, they run as on rails.
    """

    floor_plan: str
    speeds: tuple[float, ...]
    among_moving: tuple[float, ...]
    obstacle_speeds: tuple[float, ...]
    overtaking: tuple[float, float]
    sizes: tuple[float, ...]
    gaps: tuple[float, ...]
    repetitions: int = 3
    operator: OperatorSpec | None = OPERATOR


PAPER_A = Protocol(
    floor_plan="hall",
    speeds=(0.2, 0.6, 1.0),
    among_moving=(0.2, 0.6),
    obstacle_speeds=(0.2, 0.6),
    overtaking=(0.2, 1.0),
    sizes=(0.03, 0.15, 0.30, 0.60),
    gaps=(1.0, 1.5, 2.0),
)
"""Paper A's: v_0, v_1, v_2; S_1 to S_4; d_1 to d_3."""
BETWEEN = Protocol(
    floor_plan="ward",
    speeds=(0.4, 0.8),
    among_moving=(0.4, 0.8),
    obstacle_speeds=(0.4, 0.8),
    overtaking=(0.4, 0.8),
    sizes=(0.09, 0.225, 0.45, 0.75),
    gaps=(1.25, 1.75, 2.25),
)
"""Halfway between paper A's numbers; of sizes and gaps also one above, as far as the last half step."""


def build(robot: Robot, selection: Selection, seed: int, protocol: Protocol) -> list[Scenario]:
    """Every scenario of the protocol for `robot`, on the selection's plan and with its repetitions."""
    plan = selection.floor_plan or protocol.floor_plan
    line = _Line(plan)
    return [
        _scenario(robot, line, plan, test, repetition, seed, protocol.operator)
        for test in _tests(protocol)
        for repetition in range(1, (selection.repetitions or protocol.repetitions) + 1)
    ]


class _Line:
    """A-B of a plan: maps a place (along, across), measured from the middle, and a heading into the plan."""

    def __init__(self, plan: str) -> None:
        place = load_floor_plan(plan)
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


def _tests(protocol: Protocol) -> Iterator[tuple[LabelSpec, float]]:
    """Labels (without repetition) and set speed of each test, in the order of the paper: of its own 112."""

    def label(batch: str, configuration: str, **at: float) -> LabelSpec:
        return LabelSpec(batch=batch, configuration=configuration, **at)

    for v in protocol.speeds:
        yield label("NO", "free"), v
    for v in protocol.speeds:
        for size in protocol.sizes:
            yield label("SO", "single", size=size), v
            for configuration, gap in itertools.product(("parallel", "perpendicular"), protocol.gaps):
                yield label("SO", configuration, size=size, gap=gap), v
    meetings = list(itertools.product(protocol.among_moving, protocol.obstacle_speeds))
    for configuration, (v, moving) in itertools.product(("passing", "crossing"), meetings):
        yield label("MO", configuration, obstacle_speed=moving), v
    v, moving = protocol.overtaking
    yield label("MO", "overtaking", obstacle_speed=moving), v
    for (v, moving), size in itertools.product(meetings, protocol.sizes):
        yield label("CE", "complex", obstacle_speed=moving, size=size), v


def _scenario(
    robot: Robot,
    line: _Line,
    plan: str,
    test: tuple[LabelSpec, float],
    repetition: int,
    seed: int,
    operator: OperatorSpec | None,
) -> Scenario:
    labels, speed = test
    name = _name(labels, speed, repetition)
    own_seed = scenario_seed(seed, name)
    return Scenario(
        name=name,
        floor_plan=plan,
        start=line.pose(-D_AB / 2, 0.0, 0.0),
        legs=_legs(robot, line, speed),
        speed=speed,
        obstacles=(*_static(robot, line, labels), *_moving(robot, line, labels, speed, own_seed, operator)),
        labels=labels.model_copy(update={"repetition": repetition}),
        reference_length=D_AB,
        seed=own_seed,
    )


def _name(labels: LabelSpec, speed: float, repetition: int) -> str:
    several = len(CONFIGURATIONS[labels.batch]) > 1
    values = (("v", speed), ("o", labels.obstacle_speed), ("s", labels.size), ("d", labels.gap))
    parts = [labels.batch, *([labels.configuration] if several else [])]
    parts += [f"{letter}{value:g}" for letter, value in values if value is not None]
    return "-".join([*parts, f"r{repetition}"])


def _static(robot: Robot, line: _Line, labels: LabelSpec) -> list[ObstacleSpec]:
    """The square obstacles: one at the midpoint, or two about it, `gap * d_base` apart edge to edge."""
    if labels.size is None:
        return []
    square = SquareSpec(kind="square", edge=labels.size)
    if labels.gap is None:
        return [ObstacleSpec(name="square", shape=square, pose=line.pose(0.0, 0.0, 0.0))]
    off = (labels.gap * robot.d_base + labels.size) / 2
    places = ((-off, 0.0), (off, 0.0)) if labels.configuration == "parallel" else ((0.0, -off), (0.0, off))
    return [
        ObstacleSpec(name=f"square {i}", shape=square, pose=line.pose(*place, 0.0)) for i, place in enumerate(places, 1)
    ]


def _moving(
    robot: Robot, line: _Line, labels: LabelSpec, speed: float, seed: int, operator: OperatorSpec | None
) -> list[ObstacleSpec]:
    """The other robot on its path, once for each scored leg, turned by pi about the midpoint for the way back."""
    if labels.obstacle_speed is None:
        return []
    other = "hosbot" if robot.name.partition(":")[0] == "tiago" else "tiago"
    path, until, after = _path(robot, load_robot(other), labels, speed)
    meeting = math.dist(path[0], until) / labels.obstacle_speed
    runs = []
    for leg, sign in (("forth", 1), ("back", -1)):
        timing = TIMING * (2 * draw(seed, f"timing {leg}") - 1)
        where = tuple(line.point(sign * x, sign * y) for x, y in path)
        runs.append(RunSpec(leg=leg, path=where, speed=labels.obstacle_speed, delay=round(after - meeting + timing, 6)))
    body = RobotBodySpec(kind="robot", robot=other)
    return [ObstacleSpec(name=other, shape=body, runs=tuple(runs), behaviour=operator)]


Point = tuple[float, float]


def _path(robot: Robot, other: Robot, labels: LabelSpec, speed: float) -> tuple[tuple[Point, Point], Point, float]:
    """The moving obstacle's way on leg `forth` (along, across; from the midpoint), the point that it times and when it is there [s]."""
    match labels.configuration:
        case "passing":
            return (
                ((D_AB / 2 + RUN_UP, 0.0), (-D_AB / 2 - RUN_UP, 0.0)),
                (0.0, 0.0),
                undisturbed(robot, speed, D_AB / 2),
            )
        case "crossing":
            return ((0.0, CROSSING_REACH), (0.0, -CROSSING_REACH)), (0.0, 0.0), undisturbed(robot, speed, D_AB / 2)
        case "complex":
            x = -CROSSING_BEFORE
            return ((x, CROSSING_REACH), (x, -CROSSING_REACH)), (x, 0.0), undisturbed(robot, speed, D_AB / 2 + x)
        case _:  # overtaking, in the lane to the left
            y = circumscribed_radius(robot.shape) + circumscribed_radius(other.shape) + OVERTAKING_ROOM
            start = (-D_AB / 2 - OVERTAKING_BEHIND, y)
            return (start, (D_AB / 2 + OVERTAKING_BEHIND, y)), start, TIMING


def undisturbed(robot: Robot, speed: float, distance: float) -> float:
    """Seconds that the robot needs for `distance` [m] from rest, straight, at the set speed and its acceleration."""
    v, a = min(speed, robot.drive.v_max), robot.drive.acceleration
    ramp = v * v / (2 * a)
    return math.sqrt(2 * distance / a) if distance < ramp else v / a + (distance - ramp) / v


def _legs(robot: Robot, line: _Line, speed: float) -> tuple[LegSpec, ...]:
    """Forth, the turn at B (not scored), back; each may take three times its nominal time and 20 s."""
    drive = 3 * D_AB / min(speed, robot.drive.v_max) + 20
    turn = 3 * math.pi / robot.drive.omega_max + 20
    return (
        LegSpec(name="forth", goal=line.pose(D_AB / 2, 0.0, 0.0), time_limit=drive),
        LegSpec(name="turn", goal=line.pose(D_AB / 2, 0.0, math.pi), time_limit=turn, scored=False),
        LegSpec(name="back", goal=line.pose(-D_AB / 2, 0.0, math.pi), time_limit=drive),
    )


def _suite(
    name: str,
    title: str,
    description: str,
    protocol: Protocol,
    report: tuple[Section, ...] = (Section.MANOEUVRING_SPACE,),
) -> Suite:
    return Suite(
        name,
        title,
        description,
        batches=tuple(CONFIGURATIONS),
        configurations=tuple(c for names in CONFIGURATIONS.values() for c in names),
        make=partial(build, protocol=protocol),
        family="hospital",
        robots=("hosbot", "tiago"),
        report=report,
    )


HOSPITAL = _suite(
    "hospital",
    "Hospital navigation benchmark",
    "Paper A's protocol: no, static, moving obstacles and both, forth and back over 5 m at three speeds",
    PAPER_A,
    (Section.PAPER_A, Section.MANOEUVRING_SPACE),
)
BLIND = _suite(
    "hospital-blind",
    "Hospital navigation benchmark, blind movers",
    "Paper A's protocol, made harder: the moving robot runs as on rails, timed to meet the tested one",
    replace(PAPER_A, operator=None),
)
HELD_OUT = _suite(
    "hospital-held-out",
    "Hospital navigation benchmark, held out",
    "Paper A's protocol in the ward with sizes, gaps and speeds between the paper's, on which nothing was chosen",
    BETWEEN,
)
HELD_OUT_BLIND = _suite(
    "hospital-held-out-blind",
    "Hospital navigation benchmark, held out, blind movers",
    "The held-out protocol, made harder: the moving robot runs as on rails, timed to meet the tested one",
    replace(BETWEEN, operator=None),
)

"""A scenario: one test, complete and ready to run. A suite makes many; a user writes one as TOML.

Everything is in the floor plan's frame (map), SI units, radians.
"""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from clearway.geometry.shapes import Circle, Polygon, Shape, rectangle
from clearway.geometry.streams import stream
from clearway.quantities import (
    AngleSpread,
    AngleTolerance,
    Distance,
    Duration,
    Finite,
    Length,
    NonNegative,
    Point,
    PoseSpec,
    Positive,
    Seed,
    Speed,
    Vertices,
    Whole,
)
from clearway.reading.limits import LEGS, LENGTH, OBSTACLES, PEOPLE, POINTS, ROBOTS, RUNS, SECONDS
from clearway.robots import Robot, Tolerances, load_robot
from clearway.robots.ideal import RobotError
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.motions import MotionSpec, Stiffness, Velocity
from clearway.scenarios.people import PersonSpec
from clearway.validation import Table


class SquareSpec(Table):
    """A square, centred on its pose."""

    kind: Literal["square"]
    edge: Length = Field(description="m")

    def shape(self) -> Shape:
        return rectangle(self.edge, self.edge)


class RectangleSpec(Table):
    """A rectangle, centred on its pose."""

    kind: Literal["rectangle"]
    length: Length = Field(description="along x, m")
    width: Length = Field(description="along y, m")

    def shape(self) -> Shape:
        return rectangle(self.length, self.width)


class DiscSpec(Table):
    """A disc."""

    kind: Literal["disc"]
    radius: Length = Field(description="m")

    def shape(self) -> Shape:
        return Circle(self.radius)


class OutlineSpec(Table):
    """A simple polygon, counter-clockwise, in its own frame."""

    kind: Literal["polygon"]
    vertices: Vertices = Field(description="m")

    def shape(self) -> Shape:
        return Polygon(self.vertices)


class RobotBodySpec(Table):
    """The footprint of another robot."""

    kind: Literal["robot"]
    robot: str = Field(description="name or file of the robot")

    def shape(self) -> Shape:
        return load_robot(self.robot).shape


ShapeSpec = Annotated[SquareSpec | RectangleSpec | DiscSpec | OutlineSpec | RobotBodySpec, Field(discriminator="kind")]


class RunSpec(Table):
    """One pass of a moving obstacle along a line at constant speed, during one leg; it is absent outside its passes."""

    leg: str = Field(description="name of the leg during which it moves")
    path: tuple[Point, ...] = Field(
        min_length=2, max_length=POINTS, description="way points, m; its heading follows the path"
    )
    speed: Speed = Field(description="m/s")
    delay: Finite = Field(
        default=0.0, ge=-SECONDS, le=SECONDS, description="s after the leg begins; negative: already under way"
    )

    @model_validator(mode="after")
    def _has_length(self) -> RunSpec:
        length = sum(math.dist(p, q) for p, q in itertools.pairwise(self.path))
        if length == 0.0:
            raise ValueError("the path has no length")
        if length > LENGTH:
            raise ValueError(f"the path is {length:g} m long; at most {LENGTH:g} m are")
        return self


LONGEST_SWING = 3600.0
"""An oscillation is laid out for this long at most, s."""


class OscillationSpec(Table):
    """Motion about a fixed point of attraction: paper B, eqs. 6-7, per axis x'' = stiffness (attraction - x)."""

    start: Point = Field(description="where it is at time 0, m")
    velocity: Velocity = Field(description="at time 0, m/s")
    attraction: Point = Field(description="m")
    stiffness: tuple[Stiffness, Stiffness] = Field(description="alpha and beta, 1/s^2")


class ObstacleSpec(Table):
    """An obstacle of the test: static with a `pose`, or moving with `runs`, by an `oscillation` or another `motion`."""

    name: str = Field(min_length=1)
    shape: ShapeSpec
    pose: PoseSpec | None = Field(default=None, description="where a static one stands: m, m, rad")
    runs: tuple[RunSpec, ...] = Field(default=(), max_length=RUNS, description="when and where a moving one moves")
    behaviour: OperatorSpec | None = Field(
        default=None, description="who drives it along its runs; default: nobody, it runs blindly as on rails"
    )
    oscillation: OscillationSpec | None = Field(default=None, description="how one moves that is always there")
    motion: MotionSpec | None = Field(default=None, description="how one moves that is always there, less regularly")

    @property
    def lasting(self) -> OscillationSpec | MotionSpec | None:
        """How one moves that is always there, and whose time runs on from leg to leg; None for any other."""
        return self.oscillation or self.motion

    @model_validator(mode="after")
    def _static_or_moving(self) -> ObstacleSpec:
        given = [f for f in ("pose", "runs", "oscillation", "motion") if getattr(self, f)]
        if len(given) > 1:
            raise ValueError(f"the obstacle {self.name!r} has {' and '.join(given)}; leave all but one of them out")
        if not given:
            raise ValueError(
                f"the obstacle {self.name!r} needs one of these: a pose (static), runs (moving), an oscillation (moving),"
                " a motion (moving)"
            )
        if self.behaviour is not None and not self.runs:
            raise ValueError(f"the obstacle {self.name!r} has no runs along which an operator could drive it")
        return self


class DisturbanceSpec(Table):
    """Bounded disturbance of the robot's motion (paper B, assumption A2), drawn anew each control period from the seed."""

    position: Distance = Field(description="the most that it is moved in a control period: uniform in a disc, m")
    heading: NonNegative = Field(
        default=0.0, description="the most that it is turned in a control period, uniform, rad"
    )
    velocity: NonNegative = Field(
        default=0.0, description="the most that v deviates from what the base drives, uniform, m/s"
    )
    turn: NonNegative = Field(default=0.0, description="the same for omega, rad/s")
    at_rest: bool = Field(default=True, description="whether it also moves a robot that stands")


class OptimalSpec(Table):
    """What a clairvoyant could do at best: holonomic, with unlimited acceleration up to the set speed, undisturbed,
    knowing every obstacle's future. A bound for every robot that is not pushed, reached by none whose base is limited."""

    time: Positive = Field(description="shortest time to the goal, s")
    path: Positive = Field(description="length of that way, m")
    error: NonNegative = Field(description="bound on the relative error of `time` by discretisation")


class LegSpec(Table):
    """One goal."""

    name: str = Field(min_length=1, description="unique in its scenario")
    goal: PoseSpec = Field(description="m, m, rad")
    xy_tolerance: Length | None = Field(
        default=None, description="m, of the test, and what a planner is told; default: the robot's file says both"
    )
    yaw_tolerance: AngleTolerance | None = Field(
        default=None, description="rad, the same of the heading; inf: it is free"
    )
    scored: bool = Field(default=True, description="whether it counts for the indicators")
    time_limit: Duration = Field(description="s")
    arrival: Literal["declared", "measured"] = Field(
        default="declared",
        description="who ends the leg: the robot, which calls its goal reached and stands, or a judge by its true position within xy_tolerance, at any speed",
    )
    clock_starts_after: Distance = Field(
        default=0.0, description="the leg's clock starts when it has moved this far, m"
    )

    def tolerances(self, usual: Tolerances) -> tuple[float, float]:
        """Of the place [m] and the heading [rad, inf where it is free]: its own, else the `usual` ones of a robot."""
        return self.xy_tolerance or usual.xy, self.yaw_tolerance or usual.yaw


class RobotSpec(Table):
    """One more robot, which decides as the tested one does."""

    name: str = Field(min_length=1, description="unique in its scenario")
    start: PoseSpec = Field(description="m, m, rad")
    legs: tuple[LegSpec, ...] = Field(min_length=1, max_length=LEGS, description="its goals, one after another")
    role: Literal["tested", "other"] = Field(
        default="tested",
        description="whether it has a trial of its own in the results, or is only there for the others",
    )
    robot: str | None = Field(default=None, description="name or file; default: the robot under test")
    navigator: str | None = Field(
        default=None, description="who drives it, if it is an `other`; default: the navigator under test"
    )

    @model_validator(mode="after")
    def _tested_by_whom(self) -> RobotSpec:
        if self.role == "tested" and self.navigator is not None:
            raise ValueError(
                f'the robot {self.name!r} is tested, so the run says who drives it; one with a navigator of its own has role = "other"'
            )
        return self


class LabelSpec(Table):
    """Where the scenario stands in its suite; see `clearway.trials.Labels`."""

    suite: str = "own"
    family: str = Field(default="own", description="what its suite shares with its like")
    batch: str = Field(default="own", description="what the report groups by")
    configuration: str = Field(default="own", description="the same test at other speeds has the same configuration")
    obstacle_speed: NonNegative | None = Field(default=None, description="m/s")
    size: Positive | None = Field(default=None, description="edge of the static obstacles, m")
    gap: Positive | None = Field(default=None, description="between double obstacles, in multiples of d_base")
    repetition: Whole = Field(default=1, ge=1)


class Scenario(Table):
    """One test."""

    name: str = Field(min_length=1, description="unique in its suite")
    floor_plan: str = Field(description="a shipped name, or the path of a plan or of a ROS map's yaml")
    start: PoseSpec = Field(description="m, m, rad")
    legs: tuple[LegSpec, ...] = Field(min_length=1, max_length=LEGS, description="goals, one after another")
    speed: Speed = Field(description="set speed, caps the robot's, m/s")
    obstacles: tuple[ObstacleSpec, ...] = Field(default=(), max_length=OBSTACLES)
    people: tuple[PersonSpec, ...] = Field(default=(), max_length=PEOPLE, description="who walks there")
    member: str = Field(default="robot 1", min_length=1, description="the robot's name, where there are more `robots`")
    robots: tuple[RobotSpec, ...] = Field(default=(), max_length=ROBOTS, description="who else drives there")
    labels: LabelSpec = LabelSpec()
    reference_length: Length | None = Field(default=None, description="of one leg, m: paper A's d_AB, BARN's path")
    localisation: Literal["truth", "odometry", "amcl"] = Field(
        default="amcl", description="unless the run says otherwise"
    )
    tracking: Literal["difference", "kalman"] = Field(
        default="kalman",
        description="how a robot with a camera follows obstacles, unless the run says otherwise; by a lidar alone `kalman`",
    )
    disturbance: DisturbanceSpec | None = Field(default=None, description="of the robot's motion; default: none")
    latency: NonNegative = Field(
        default=1.0, le=100, description="factor on the robot's latency: 0 for a world without, 1 as its file has it"
    )
    ideal: tuple[RobotError, ...] = Field(
        default=(), description="errors of the robots, their sensors and motors, that are left out"
    )
    optimal: OptimalSpec | None = Field(
        default=None, description="the best that is possible, where somebody has searched"
    )
    shortest: Length | None = Field(
        default=None, description="lower bound on the path to the goal past what stands, whatever moves; m"
    )
    livelock: bool = Field(
        default=False, description="whether a robot that has not come 0.5 m away from where it was 20 s ago has failed"
    )
    placement_xy: Distance = Field(
        default=0.02, description="the robot is placed within this of its start, uniformly, m"
    )
    placement_yaw: AngleSpread = Field(default=0.03, description="the same for its heading, rad")
    seed: Seed = Field(
        default=0,
        description="of sensor noise, odometry and placement; one seed, one course of events (a suite draws its own)",
    )

    @model_validator(mode="after")
    def _consistent(self) -> Scenario:
        legs = [leg.name for leg in self.legs]
        obstacles, people = [o.name for o in self.obstacles], [p.name for p in self.people]
        robots = self.names() if self.robots else []
        every = [("legs", legs), ("obstacles", obstacles), ("people", people), ("robots", robots)]
        every += [(f"legs of the robot {r.name!r}", [leg.name for leg in r.legs]) for r in self.robots]
        for kind, names in every:
            if twice := sorted({n for n in names if names.count(n) > 1}):
                raise ValueError(f"two {kind} have the name {twice[0]!r}")
        for a, b in itertools.combinations((("an obstacle", obstacles), ("a person", people), ("a robot", robots)), 2):
            if both := sorted(set(a[1]) & set(b[1])):
                raise ValueError(f"{a[0]} and {b[0]} have the name {both[0]!r}")
        for obstacle in self.obstacles:
            for run in obstacle.runs:
                if run.leg not in legs:
                    raise ValueError(
                        f"the obstacle {obstacle.name!r} runs on a leg {run.leg!r}; legs: {', '.join(legs)}"
                    )
        return self

    def names(self) -> list[str]:
        """Of its robots: its own one, then the others."""
        return [self.member, *(robot.name for robot in self.robots)]

    def tested(self) -> list[int]:
        """Which of these have trials of their own."""
        return [0, *(k for k, robot in enumerate(self.robots, start=1) if robot.role == "tested")]

    def followed(self, robot: Robot) -> str:
        """How `robot` follows obstacles here unless it is told otherwise: what differences are taken of, paper B's camera tells."""
        return "kalman" if robot.camera is None else self.tracking

    def members(self) -> list[Scenario]:
        """What each of its robots is to do: its own one, then its other `robots`, whose noise is their own."""
        if not self.robots:
            return [self]
        rest = {"robots": (), "optimal": None, "shortest": None, "reference_length": None}
        found = [self.model_copy(update={"robots": ()})]
        for robot in self.robots:
            seed = int(stream(self.seed, f"robot {robot.name}") >> np.uint64(1))
            own = {"member": robot.name, "start": robot.start, "legs": robot.legs, "seed": seed}
            found.append(self.model_copy(update=rest | own))
        return found

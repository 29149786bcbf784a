"""The robot model and how it is read from a TOML file.

A robot's file holds one table per part and a `[sources]` table that says where each value comes from. A preset
(`[presets.NAME]`) overrides some values, and takes away the parts that its `without` names: `tiago` is the robot,
`hosbot:vendor` the robot with its preset `vendor`, `rescue:lidar` the robot without its camera.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from clearway.errors import ClearwayError, nearest, unknown
from clearway.geometry.shapes import Circle, Polygon, Shape, circumscribed_radius, inscribed_radius
from clearway.given import given
from clearway.quantities import (
    Angle,
    Delay,
    Distance,
    Length,
    NonNegative,
    Point,
    PoseSpec,
    Positive,
    PositiveAngle,
    Rate,
    Vertices,
    Whole,
)
from clearway.reading import read_toml
from clearway.reading.limits import PRESETS
from clearway.robots.drive_limits import DriveLimits
from clearway.robots.drive_spec import DriveSpec
from clearway.robots.part import Part
from clearway.stand_ins import FILE as STAND_INS
from clearway.validation import first_problem

FARTHEST = 10.0
"""m from base_link that a footprint may reach and a lidar stand at: what is beyond was meant in centimetres, or is no robot among people."""


LEGS_END = 0.78
"""m above the floor: up to there a lidar sees people's legs. Crotch height of women, the lower one (Gordon et al. 2014, ANSUR II)."""


class CircleSpec(Part):
    """A round footprint."""

    kind: Literal["circle"] = "circle"
    radius: Length = Field(description="m")

    def shape(self) -> Shape:
        return Circle(self.radius)


def _around_base_link(vertices: tuple[Point, ...]) -> tuple[Point, ...]:
    """The same, if base_link lies within: the disc about it that is free of the outline is taken for one that the robot fills."""
    p = np.array(vertices)
    q = np.roll(p, -1, axis=0)
    turns = np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], (p * q).sum(axis=1)).sum()
    if turns < math.pi and (away := inscribed_radius(Polygon(vertices))) > 1e-6:
        (x0, y0), (x1, y1) = p.min(axis=0), p.max(axis=0)
        raise ValueError(
            f"x from {x0:g} to {x1:g} and y from {y0:g} to {y1:g} m leave base_link, which is [0, 0] here, {away:.2g} m outside; it is to "
            "lie within, so measure from there"
        )
    return vertices


class PolygonSpec(Part):
    """A polygonal footprint around base_link, counter-clockwise."""

    kind: Literal["polygon"] = "polygon"
    vertices: Annotated[Vertices, AfterValidator(_around_base_link)] = Field(
        description="m, in base_link, which lies within"
    )

    def shape(self) -> Shape:
        return Polygon(self.vertices)


FootprintSpec = Annotated[CircleSpec | PolygonSpec, Field(discriminator="kind")]


class Lidar(Part):
    """A 2-D lidar and its errors, as data sheets give them (`clearway.world.lidar` says what each does)."""

    beams: Whole = Field(ge=1, le=100_000)
    angle_min: Angle = Field(description="rad, first beam")
    angle_max: Angle = Field(description="rad, last beam")
    range_min: Distance = Field(description="m")
    range_max: Length = Field(description="m")
    sigma: NonNegative = Field(description="statistical error: standard deviation of a range, m")
    bias: NonNegative = Field(
        default=0.0,
        description="bound on the systematic error that all ranges of a trial share, drawn for it evenly within, m",
    )
    divergence: NonNegative = Field(
        default=0.0,
        description="angle that a beam's spot covers, rad: where an edge lies within it, the range falls in between",
    )
    pulse: Rate = Field(
        default=math.inf, description="half the length of a light pulse, m: echoes nearer to each other merge into one"
    )
    dropout: float = Field(
        default=0.0, ge=0, lt=1, description="probability that a beam which hits something brings no return"
    )
    mount: PoseSpec = Field(default=(0.0, 0.0, 0.0), description="pose in base_link: m, m, rad")
    sweep: Delay = Field(
        default=0.0,
        description="from the first beam to the last one, s; a scan's stamp is its middle. `--latency` scales it too",
    )
    clockwise: bool = Field(default=False, description="whether a sweep begins with the last beam")
    height: Distance | None = Field(
        default=None, description="above the floor, m: a low one sees two legs of a person; default: it is not known"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Lidar:
        if self.range_min >= self.range_max:
            raise ValueError(f"range_min {self.range_min:g} must lie below range_max {self.range_max:g}")
        if self.angle_min > self.angle_max:
            raise ValueError(f"angle_min {self.angle_min:g} must not lie above angle_max {self.angle_max:g}")
        return self

    @property
    def sees_legs(self) -> bool:
        """Whether it looks so low that of people it sees legs."""
        return self.height is not None and self.height < LEGS_END


class Camera(Part):
    """Sees obstacles as discs within a circle around the robot (paper B's perception field, assumptions A1 and A3)."""

    range: Length = Field(description="radius of the perception field, m; an obstacle that reaches into it is seen")
    error: NonNegative = Field(description="bound on the error of a moving obstacle's perceived position, m")


class Odometry(Part):
    """Wheel odometry's errors: systematic ones, drawn for a trial from normal distributions of the standard deviations
    given, a drift that grows with motion, and noise of the measured velocities, which does not add up."""

    translation_per_metre: NonNegative = Field(description="drift, m per sqrt(m) travelled")
    rotation_per_metre: NonNegative = Field(description="drift, rad per sqrt(m) travelled")
    rotation_per_radian: NonNegative = Field(description="drift, rad per sqrt(rad) turned")
    scale: NonNegative = Field(default=0.0, description="systematic: relative error of distances (the wheels' radius)")
    turn_scale: NonNegative | None = Field(
        default=None, description="systematic: relative error of turns (the wheels' track); default: as `scale`"
    )
    curvature: NonNegative = Field(
        default=0.0, description="systematic: turn imagined per metre driven (unequal wheels), rad/m"
    )
    gyro: bool = Field(
        default=False,
        description="whether its turns are a gyroscope's: `drive.turn_slip_ratio` does not deceive it; all else is as for wheels",
    )
    speed_noise: NonNegative | None = Field(
        default=None,
        description="noise of measured speed and yaw rate, as a share of each; default: what the drift makes of it",
    )
    yaw_rate_noise: NonNegative = Field(
        default=0.0, description="with `speed_noise`: further noise of a measured yaw rate, rad/s per m/s"
    )

    @property
    def turning(self) -> float:
        """Standard deviation of the relative error of turns."""
        return self.scale if self.turn_scale is None else self.turn_scale

    def velocity_errors(self, v: float, omega: float, period: float) -> tuple[float, float]:
        """Standard deviations of measured v [m/s] and omega [rad/s] over a `period` [s] in which these are `v`, `omega`."""
        if self.speed_noise is None:
            rotation = self.rotation_per_metre**2 * abs(v) + self.rotation_per_radian**2 * abs(omega)
            noise_v, noise_w = self.translation_per_metre * math.sqrt(abs(v) / period), math.sqrt(rotation / period)
        else:
            noise_v, noise_w = self.speed_noise * v, math.hypot(self.speed_noise * omega, self.yaw_rate_noise * v)
        return math.hypot(self.scale * v, noise_v), math.hypot(self.turning * omega, self.curvature * v, noise_w)


class LatencySpec(Part):
    """How late the robot senses and acts. A test may scale all of it (`--latency`)."""

    sensing: Delay = Field(
        default=0.0, description="how old a scan, an odometry message and a picture are when the navigator gets them, s"
    )
    command: Delay = Field(default=0.0, description="from the decision until the wheels follow it, s")
    jitter: Delay = Field(
        default=0.0, description="the most that either is longer than that, drawn evenly for each message, s"
    )


class Tolerances(Part):
    """What a test judges the end of a leg by."""

    xy: Length = Field(description="m")
    yaw: PositiveAngle = Field(description="rad")


class GoalChecker(Part):
    """Within what the robot's planners are to bring it to a goal, in nav2's words; tighter than the test's tolerances, they
    leave room for what the robot cannot know."""

    xy_goal_tolerance: Length | None = Field(default=None, description="m; default: the test's")
    yaw_goal_tolerance: PositiveAngle | None = Field(default=None, description="rad; default: the test's")


class Robot(Part):
    """A robot: everything that the world, the perception and the navigators need to know of it."""

    name: str = Field(min_length=1)
    title: str = Field(description="as it is printed")
    d_base: Length = Field(description="paper A's d_base: the gaps between double obstacles are multiples of it, m")
    footprint: FootprintSpec = Field(description="contact shape, in base_link")
    planner_footprint: FootprintSpec | None = Field(
        default=None, description="what its planner believes; default: the footprint"
    )
    period: Positive = Field(ge=0.001, le=10.0, description="control period, s")
    drive: DriveSpec
    lidar: Lidar | None = None
    camera: Camera | None = Field(default=None, description="sees obstacles as discs; default: none")
    odometry: Odometry
    latency: LatencySpec = LatencySpec()
    tolerances: Tolerances = Field(description="what a test judges the end of a leg by")
    goal_checker: GoalChecker = Field(
        default=GoalChecker(),
        description="what the robot's planners are told of a goal; default: the test's tolerances",
    )
    navigators: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="parameters by navigator, checked by it"
    )
    localisation: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="parameters by localiser, checked by it"
    )
    mapping: dict[str, Any] = Field(default_factory=dict, description="parameters of the mapper, checked by it")
    conditions: dict[str, str] = Field(default_factory=dict, description="for the report: make, load, floor, software")
    sources: dict[str, str] = Field(
        default_factory=dict, description="dotted field (or a prefix of it) -> where its value comes from"
    )
    presets: dict[str, dict[str, Any]] = Field(
        default_factory=dict,
        max_length=PRESETS,
        description="named overrides of the above; `without`: names of parts to take away",
    )

    @field_validator("sources", mode="before")
    @classmethod
    def _dotted(cls, sources: object) -> object:
        """`drive.v_max = "..."` without quotes is a table within `sources` to TOML; a dotted field was meant."""
        return dict(_dotted(sources)) if isinstance(sources, Mapping) else sources

    @model_validator(mode="after")
    def _of_a_robots_size(self) -> Robot:
        for name, footprint in (("footprint", self.footprint), ("planner_footprint", self.planner_footprint)):
            if footprint is not None and (reach := circumscribed_radius(footprint.shape())) > FARTHEST:
                raise ValueError(
                    f"the {name} reaches {reach:.1f} m from base_link; metres are meant, at most {FARTHEST:g}"
                )
        if self.lidar is not None and (reach := math.hypot(*self.lidar.mount[:2])) > FARTHEST:
            raise ValueError(f"the lidar is {reach:.1f} m from base_link; metres are meant, at most {FARTHEST:g}")
        return self

    @model_validator(mode="after")
    def _over_when_it_arrives(self) -> Robot:
        if self.lidar is not None and self.lidar.sweep > 2.0 * self.latency.sensing:
            raise ValueError(
                f"half of lidar.sweep, {0.5 * self.lidar.sweep:g} s, is more than latency.sensing, {self.latency.sensing:g} s:"
                " a scan would arrive before its last beam; its stamp is its middle"
            )
        return self

    @model_validator(mode="after")
    def _of_values_that_it_has(self) -> Robot:
        values = self.model_dump(exclude={"sources"})
        for field in self.sources:
            value, names = values, field.split(".")
            for k, name in enumerate(names):
                if not isinstance(value, Mapping) or not value:  # a part that it hasn't, or a preset takes away
                    break
                if name not in value:
                    close = nearest(name, [str(known) for known in value])
                    meant = f"; did you mean {'.'.join([*names[:k], close])!r}?" if close else ""
                    raise ValueError(f"sources names {field!r}, which is no value of this robot{meant}")
                value = value[name]
        return self

    @property
    def shape(self) -> Shape:
        """The contact shape."""
        return self.footprint.shape()

    @property
    def planner_shape(self) -> Shape:
        """The shape that its own planner keeps clear of obstacles."""
        return (self.planner_footprint or self.footprint).shape()

    def limits(self, speed: float = math.inf) -> DriveLimits:
        """What its base can do where no more than `speed` [m/s] is allowed either way."""
        return self.drive.limits().capped(speed)

    @property
    def planner_tolerances(self) -> Tolerances:
        """What its planners are told of a goal."""
        told, judged = self.goal_checker, self.tolerances
        return Tolerances(xy=told.xy_goal_tolerance or judged.xy, yaw=told.yaw_goal_tolerance or judged.yaw)

    def source(self, field: str) -> str | None:
        """Where the value of the dotted `field` comes from: the entry of `sources` that is its longest prefix."""
        parts = field.split(".")
        for n in range(len(parts), 0, -1):
            if found := self.sources.get(".".join(parts[:n])):
                return found
        return None


RESCUE = "rescue"
"""Paper B's robot, of which hardly anything was published: all of it is in the file of stand-ins."""


def robot_names() -> list[str]:
    """Names of the robots that come with Clearway."""
    folder = resources.files("clearway.robots")
    files = [f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")]
    return sorted([*files, RESCUE])


def load_robot(which: str) -> Robot:
    """Read a robot: a shipped name or a path to a TOML file, with `:PRESET` behind it if wanted.

    Raises:
        ClearwayError: no such robot or preset, or a field that is wrong; the message names file and field.
    """
    if (handed := given(which)) is not None:
        robot: Robot = handed.thing
        return robot
    path, preset = _locate(which)
    return _load(path, preset, path.stat().st_mtime_ns)  # read again once it has changed


@lru_cache(maxsize=64)
def _load(path: Path, preset: str | None, changed: int) -> Robot:
    table = dict(read_toml(path))
    if path == STAND_INS:
        table = dict(table["robot"])
    if preset is not None:
        presets = table.get("presets", {})
        if not isinstance(presets, dict) or not all(isinstance(changes, dict) for changes in presets.values()):
            raise ClearwayError("must be a table of tables", file=path, field="presets")
        if preset not in presets:
            raise unknown("preset", preset, presets, file=path)
        changes = dict(presets[preset])
        without = changes.pop("without", ())
        if not isinstance(without, list | tuple) or not all(isinstance(part, str) for part in without):
            raise ClearwayError("must be a list of names", file=path, field=f"presets.{preset}.without")
        for part in without:
            if part not in table:
                raise ClearwayError(f"there is no {part!r} to take away", file=path, field=f"presets.{preset}.without")
            del table[part]
        table = overridden(table, changes) | {"name": f"{table.get('name', path.stem)}:{preset}"}
    try:
        return Robot.model_validate(table)
    except ValidationError as error:
        problem = first_problem(error, Robot, file=path)
        if preset is not None and problem.field and _holds(changes, problem.field.split(".")):
            raise ClearwayError(problem.problem, file=path, field=f"presets.{preset}.{problem.field}") from error
        raise problem from error


def _holds(table: Mapping[str, Any], names: Sequence[str]) -> bool:
    """Whether something stands in a table, or in those within it, under these names."""
    inside = table.get(names[0])
    return names[0] in table and (len(names) == 1 or (isinstance(inside, Mapping) and _holds(inside, names[1:])))


def _locate(which: str) -> tuple[Path, str | None]:
    shipped = robot_names()
    if which.endswith(".toml"):
        name, preset = which, None
    else:
        name, _, rest = which.rpartition(":") if ":" in which else (which, "", "")
        preset = rest or None
    if name == RESCUE:
        return STAND_INS, preset
    if name in shipped:
        return Path(str(resources.files("clearway.robots") / f"{name}.toml")), preset
    path = Path(name)
    if name.endswith(".toml"):
        if os.path.isfile(path):
            return path, preset
        raise ClearwayError("no such file", file=path)
    raise unknown("robot", name, shipped)


def _dotted(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """What stands in tables within each other, by dotted names."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _dotted(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def overridden(table: Mapping[str, Any], by: Mapping[str, Any]) -> dict[str, Any]:
    """Tables within each other, those of `table` where `by` doesn't say otherwise."""
    merged = dict(table)
    for key, value in by.items():
        old = merged.get(key)
        replace = isinstance(value, dict) and value.get("kind") is not None  # a shape is replaced whole
        merged[key] = (
            overridden(old, value) if isinstance(old, dict) and isinstance(value, dict) and not replace else value
        )
    return merged

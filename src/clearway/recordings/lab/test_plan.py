"""The test plan: one TOML that says what was done in the lab and which file is which trial. SI units, radians, map frame.

Everything that a recording can't tell by itself stands here, and may be left out: then the indicators that need it
are not computable. Paths are relative to the plan's own folder. docs/how-to/score-recordings.md walks through one.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field, ValidationError, model_validator

from clearway.errors import ClearwayError, nearest, unknown
from clearway.geometry.shapes import Shape
from clearway.quantities import AngleTolerance, Finite, NonNegative, PoseSpec, Positive, Whole
from clearway.reading.limits import LEGS, OBSTACLES, SCENARIOS
from clearway.recordings.lab.source_spec import Point, SourceSpec, Span, StretchSpec, VideoSpec
from clearway.recordings.motion.motion import MotionSpec
from clearway.robots import load_robot
from clearway.scenarios.scenario import RobotBodySpec, ShapeSpec
from clearway.validation import Table, problems


class TestSpec(Table):
    """What was tested."""

    __test__ = False  # not one of pytest's

    suite: str = Field(
        default="own", description="`hospital` for paper A's protocol; results are compared within a suite"
    )
    robot: str | None = Field(default=None, description="name or TOML file: its footprint, tolerances and limits")
    navigator: str = Field(default="recorded", description="what drove it, for the tables")
    localisation: str = Field(default="recorded", description="how it knew where it was, for the tables")
    floor_plan: str | None = Field(
        default=None, description="drawn behind the paths: a name, a plan or a ROS map's yaml"
    )
    ticks: str | None = Field(
        default=None,
        description="the operators' table (CSV, or JSON of the sheet's page): trial, start, touched, person helped, remark",
    )
    xy_tolerance: Positive | None = Field(default=None, description="at a goal, m; default: the robot's")
    yaw_tolerance: AngleTolerance | None = Field(default=None, description="rad; default: the robot's; inf: free")
    reference_length: Positive | None = Field(default=None, description="of one leg, m: paper A's d_AB")
    rate: Positive = Field(
        default=100.0,
        ge=0.01,
        le=1e6,
        description="samples kept a second at most, Hz; a faster capture is thinned after filtering",
    )


class ConditionsSpec(Table):
    """What a report has to say about a test; of the plan, and of a single trial where it differs."""

    place: str = ""
    operator: str = Field(default="", description="who tested")
    date: str = ""
    floor: str = Field(default="", description="surface")
    load: str = ""
    software: str = Field(default="", description="the robot's, with version")
    capture: str = Field(default="", description="the measuring system")


class BodySpec(Table):
    """A thing that was measured or placed: the robot, an obstacle."""

    source: str | None = Field(default=None, description="of [sources]; default: the first")
    kind: Literal["obstacle", "person"] = Field(
        default="obstacle", description="person: its distance from the robot has indicators of its own"
    )
    shape: ShapeSpec | None = Field(
        default=None, description="default: of the robot, its footprint; of a person, a disc of 0.25 m; else unknown"
    )
    markers: tuple[str, ...] | str | None = Field(
        default=None, description="its marker set: names, or a prefix ending in `:`"
    )
    track: str | None = Field(
        default=None,
        description="instead of markers: a body, topic or `parent->child` of the file; of an obstacle also `cart*`: every body or topic "
        "that fits and that no other names",
    )
    coordinates: dict[str, Point] | None = Field(default=None, description="of its markers in base_link, m")
    offset: PoseSpec | None = Field(default=None, description="base_link's pose in the track's frame: m, m, rad")
    static: StretchSpec | None = Field(
        default=None, description="the body at rest on a known pose: ties markers to base_link"
    )
    straight: StretchSpec | None = Field(default=None, description="a straight drive forward: gives the heading")
    turn: StretchSpec | None = Field(
        default=None, description="a turn in place: base_link is its centre, instead of where `static` says"
    )
    heading: Literal["measured", "travel"] = Field(default="measured", description="travel: it looks where it goes")
    uncertainty: NonNegative = Field(
        default=0.005, description="standard uncertainty of the position on which it was placed, m"
    )

    outline: NonNegative = Field(
        default=0.002,
        description="standard uncertainty of its outline and of the outline's place on it, m; counts for clearances",
    )

    visits: bool | None = Field(
        default=None,
        description="of a moving obstacle: before its first sample and after its last it was not there (true), or was there and "
        "not seen (false); default: true of people",
    )

    @property
    def measured(self) -> bool:
        """Whether the plan says how it is seen in a recording."""
        return any(way is not None for way in (self.markers, self.coordinates, self.track))

    @model_validator(mode="after")
    def _one_way(self) -> BodySpec:
        if self.markers is not None and self.track is not None:
            raise ValueError("say markers or track, not both")
        if isinstance(self.markers, str) and not self.markers.endswith(":"):
            raise ValueError(f"{self.markers!r} is neither a list of markers nor a prefix that ends in ':'")
        return self


class LegPlanSpec(Table):
    """One goal of a trial."""

    name: str = Field(min_length=1)
    start: str | PoseSpec | None = Field(
        default=None, description="a pose of [poses], or x, y, theta; default: the last goal"
    )
    goal: str | PoseSpec | None = Field(default=None, description="the same; default: unknown")
    scored: bool = True
    time_limit: Positive | None = Field(default=None, description="s")
    span: Span | None = Field(
        default=None, description="when it was driven, s on the first source's clock; default: found"
    )
    reached: bool = Field(default=True, description="whether it ended at its goal; only read where a span is given")


class PlacedSpec(Table):
    """An obstacle in one trial."""

    body: str = Field(description="of [bodies]")
    pose: PoseSpec | None = Field(default=None, description="where it was placed: m, m, rad; default: it was measured")


class RecordedTrialSpec(ConditionsSpec):
    """One attempt. Without a file, and unless `attempted = false`, it counts as attempted and not recorded."""

    file: str = Field(default="", description="of the first source")
    files: dict[str, str] = Field(default_factory=dict, description="of other sources, by name")
    video: str = Field(default="", description="its file; default: as [video] says")
    video_offset: Finite | None = Field(default=None, description="as of [video], where it differs, s")
    span: Span | None = Field(default=None, description="of the trial in the first file, s; default: all of it")
    attempted: bool = Field(default=True, description="false: not yet done; a file makes it attempted")
    recorded: bool = Field(default=True, description="false: it was driven and has no file, not even of a folder's")
    batch: str = "own"
    configuration: str = "own"
    speed: Positive | None = Field(default=None, description="set speed, m/s")
    obstacle_speed: NonNegative | None = Field(default=None, description="m/s")
    size: Positive | None = Field(default=None, description="edge of the static obstacles, m")
    gap: Positive | None = Field(default=None, description="in multiples of d_base")
    repetition: Whole = Field(default=1, ge=1)
    obstacles: tuple[PlacedSpec, ...] = Field(default=(), max_length=OBSTACLES)
    legs: tuple[LegPlanSpec, ...] = Field(default=(), max_length=LEGS, description="default: the plan's")
    contact: bool | None = Field(default=None, description="observed by the operator; default: not said")
    contact_at: tuple[Finite, ...] = Field(
        default=(), max_length=LEGS, description="when it touched something, s on the first source's clock"
    )
    intervention: bool = Field(default=False, description="a person had to help")
    intervention_at: tuple[Finite, ...] = Field(default=(), max_length=LEGS, description="when, the same")
    stopped: bool = Field(default=False, description="emergency stop")
    aborted: bool = False
    start: str = Field(default="", description="when it was started, as the operator noted it")
    note: str = ""

    @property
    def touched(self) -> bool | None:
        """Whether it touched something, as the operator saw it; None: not said."""
        return True if self.contact_at else self.contact

    @property
    def helped(self) -> int | None:
        """How often a person helped; None: not said."""
        said = self.intervention or "intervention" in self.model_fields_set
        return len(self.intervention_at) or (int(self.intervention) if said else None)

    @model_validator(mode="after")
    def _agree(self) -> RecordedTrialSpec:
        for name in ("contact", "intervention"):
            if name in self.model_fields_set and getattr(self, name) is False and getattr(self, f"{name}_at"):
                raise ValueError(f"{name} is false, and {name}_at says when there was one")
        return self


class TestPlan(Table):
    """A test plan."""

    __test__: ClassVar = False  # it is not one of pytest's, whatever its name

    test: TestSpec = TestSpec()
    conditions: ConditionsSpec = ConditionsSpec()
    poses: dict[str, PoseSpec] = Field(default_factory=dict, description="named poses in the map, such as A and B")
    sources: dict[str, SourceSpec] = Field(
        default_factory=lambda: {"capture": SourceSpec()},
        min_length=1,
        description="the first is the measurement, others are tied to it",
    )
    video: VideoSpec | None = None
    robot: BodySpec = BodySpec()
    people: str | None = Field(
        default=None,
        min_length=1,
        description="tracks that are people, such as `person*`, and those who wear markers so named (`person1:head`, `person1:left`): all "
        "that a trial's file holds are in it; what else is known of them stands in [bodies.people]",
    )
    movers: str | None = Field(
        default=None, min_length=1, description="the same of other obstacles; their shape stands in [bodies.movers]"
    )
    bodies: dict[str, BodySpec] = Field(default_factory=dict, description="obstacles, by name")
    motion: MotionSpec = MotionSpec()
    legs: tuple[LegPlanSpec, ...] = Field(
        default=(), max_length=LEGS, description="of every trial that names none of its own"
    )
    trials: tuple[RecordedTrialSpec, ...] = Field(
        min_length=1, max_length=SCENARIOS, alias="trial", description="one [[trial]] an attempt"
    )

    def files_of(self, trial: RecordedTrialSpec) -> dict[str, str]:
        """A trial's files by source, the first source's first; empty if it was not recorded."""
        first = next(iter(self.sources))
        given = ({first: trial.file} if trial.file else {}) | {n: f for n, f in trial.files.items() if f}
        return {name: given[name] for name in self.sources if name in given}

    def legs_of(self, trial: RecordedTrialSpec) -> tuple[LegPlanSpec, ...]:
        """A trial's legs: the plan's, with what the trial says of those that it names; or legs of its own."""
        own = {leg.name: leg for leg in trial.legs}
        if trial.legs and not set(own) <= {leg.name for leg in self.legs}:
            return trial.legs
        changed = {name: {f: getattr(leg, f) for f in leg.model_fields_set} for name, leg in own.items()}
        legs = tuple(leg.model_copy(update=changed.get(leg.name, {})) for leg in self.legs)
        return legs or (LegPlanSpec(name="drive"),)

    @model_validator(mode="after")
    def _names(self) -> TestPlan:
        known: dict[str, Mapping[str, object]] = {"sources": self.sources, "bodies": self.bodies, "poses": self.poses}
        wrong = tuple(
            unknown(_KINDS[where], name, known[where], field=field)
            for field, where, name in self._references()
            if isinstance(name, str) and name not in known[where]
        )
        wrong += tuple(self._misspelt_legs())
        if wrong:
            raise _Unknown(wrong)
        return self

    def _misspelt_legs(self) -> Iterator[ClearwayError]:
        """Legs of trials that are none of the plan's, though they have the names of some, or nearly."""
        known = {leg.name for leg in self.legs}
        for i, trial in enumerate(self.trials):
            names = [leg.name for leg in trial.legs]
            for j, name in enumerate(names):
                if name not in known and (known & set(names) or nearest(name, known, 0.75)):
                    yield unknown("leg", name, known, field=f"trial.{i}.legs.{j}.name")

    def _references(self) -> list[tuple[str, str, object]]:
        """Every name that stands for something elsewhere in the plan: its field, where that has to be, the name."""
        bodies = {"robot": self.robot, **{f"bodies.{name}": body for name, body in self.bodies.items()}}
        found: list[tuple[str, str, object]] = []
        for name, source in self.sources.items():
            found += [
                (f"sources.{name}.frame.static_poses.{i}.pose", "poses", h.pose)
                for i, h in enumerate(source.frame.static_poses)
            ]
        for name, body in bodies.items():
            found.append((f"{name}.source", "sources", body.source))
            if body.static is not None:
                found.append((f"{name}.static.pose", "poses", body.static.pose))
        for i, trial in enumerate(self.trials):
            found += [(f"trial.{i}.files", "sources", name) for name in trial.files]
            found += [(f"trial.{i}.obstacles.{j}.body", "bodies", o.body) for j, o in enumerate(trial.obstacles)]
        several = [("legs", self.legs), *((f"trial.{i}.legs", t.legs) for i, t in enumerate(self.trials))]
        for field, legs in several:
            for i, leg in enumerate(legs):
                found += [(f"{field}.{i}.start", "poses", leg.start), (f"{field}.{i}.goal", "poses", leg.goal)]
        return found


_KINDS = {"sources": "source", "bodies": "body", "poses": "pose"}


class _Unknown(ValueError):
    """Names of a plan that stand for nothing in it."""

    def __init__(self, found: tuple[ClearwayError, ...]) -> None:
        super().__init__(str(found[0]))
        self.found = found


def problems_in(error: ValidationError, file: Path) -> list[ClearwayError]:
    """Everything that pydantic finds wrong with a plan, each trial by its number."""
    wrong = [e.get("ctx", {}).get("error") for e in error.errors(include_url=False)]
    found = [e for w in wrong if isinstance(w, _Unknown) for e in w.found] or problems(error, TestPlan)
    return [by_number(e, file) for e in found]


def by_number(error: ClearwayError, file: object = None) -> ClearwayError:
    """The error with its trial named by the number that plan and run sheet print, from 1; and its file, if it has none.

    `trial.1.span` becomes `trial no. 2: span`.
    """
    field = error.field and re.sub(
        r"^trial\.(\d+)(\.|$)", lambda m: f"trial no. {int(m[1]) + 1}" + (": " if m[2] else ""), error.field
    )
    return ClearwayError(error.problem, file=error.file if error.file is not None else file, field=field)


def at(index: int, field: str) -> str:
    """The dotted path of a trial's field."""
    return f"trial.{index}.{field}"


def source_of(plan: TestPlan, body: BodySpec) -> str:
    """The source that measures a body."""
    return body.source or next(iter(plan.sources))


def without_coordinates(names: Sequence[str], body: BodySpec) -> str | None:
    """What is wrong with a body's coordinates, if its marker set in a file, `names`, has more markers than those."""
    known = body.coordinates or {}
    lacking = [name for name in names if name not in known]
    if body.coordinates is None or not lacking:
        return None
    listed = ", ".join(lacking[:8]) + (f" and {len(lacking) - 8} more" if len(lacking) > 8 else "")
    if len(lacking) == len(names):
        return f"none of these is a marker of the file, which has {listed}; write the names as they stand there"
    return f"the file also has {listed}, without coordinates; list the markers that have some (markers = [...]), or add these"


def is_test_plan(contents: dict[str, Any]) -> bool:
    """Whether a TOML file's contents are a test plan's: no other file has such tables (a robot's [sources] say where its values are from)."""
    sources = contents.get("sources")
    tables = (
        isinstance(sources, dict) and any(isinstance(v, dict) for v in sources.values()) and "drive" not in contents
    )
    return tables or bool({"trial", "test"} & set(contents))


def seen_from(folder: Path, name: str) -> str:
    """A robot (with its preset) or floor plan as a plan in `folder` names it: a file's path, if there is one, else the name."""
    path, colon, preset = name.partition(".toml:")
    file = folder / (path + ".toml" if colon else name)
    if not os.path.isfile(file):
        return name
    return f"{file}:{preset}" if colon else str(file)


def shape_of(spec: ShapeSpec, folder: Path) -> Shape:
    """The shape that a plan in `folder` describes.

    Raises:
        ClearwayError: it is an unknown robot's.
    """
    if isinstance(spec, RobotBodySpec):
        return load_robot(seen_from(folder, spec.robot)).shape
    return spec.shape()

"""Writes the test plan of a whole suite before anything was driven, so that only what the lab knows is left to fill in."""

from __future__ import annotations

import itertools
import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.placing import placed
from clearway.quantities import PoseSpec
from clearway.reading import parse_toml, read_toml
from clearway.recordings.lab.test_plan import TestPlan, is_test_plan
from clearway.recordings.protocol.lab_trials import bare, bodies_of, described, scenarios, setup, walk, when, who_drives
from clearway.recordings.protocol.line import Line
from clearway.recordings.protocol.toml_text import toml_value
from clearway.robots import Robot, load_robot
from clearway.scenarios.scenario import LegSpec, ObstacleSpec, RobotBodySpec, Scenario, ShapeSpec
from clearway.scenarios.suites import Selection


def skeleton(
    suite: str = "hospital",
    robot: str = "tiago",
    selection: Selection | None = None,
    *,
    seed: int = 0,
    folder: Path | None = None,
    ticks: str | None = None,
    drawn: bool = False,
) -> str:
    """The test plan of a suite as TOML: everything that is known before the tests; `load_test_plan` accepts it as it is.

    Args:
        suite: Its name or file.
        robot: Its name, preset or file.
        selection: Which part of the suite.
        seed: Seed of the suite, which shifts when moving obstacles start.
        folder: Where the plan will stand, if not here; files that it names are written as seen from there.
        ticks: The operators' table, if there is to be one.
        drawn: Whether the trials stand in an order by lot, as `scenarios` has it.

    Raises:
        ClearwayError: an unknown suite, robot or selection, or a suite with several floor plans or tolerances.
    """
    chosen = scenarios(suite, robot, selection, seed, drawn=drawn)
    floors = list(dict.fromkeys(s.floor_plan for s in chosen))
    if len(floors) > 1:
        raise ClearwayError(
            f"the suite {suite!r} takes place on {len(floors)} floor plans, such as {floors[0]!r} and {floors[1]!r}; "
            "a test plan has one",
            field="suite",
        )
    said = suite.endswith(".toml") or (selection is not None and selection.floor_plan is not None)
    floor = floors[0] if said else None
    return _Writer(load_robot(robot), robot, chosen, floor, folder or Path(), ticks, drawn=drawn).text(suite)


def parsed(text: str) -> TestPlan:
    """A skeleton as the plan that `load_test_plan` would read."""
    return TestPlan.model_validate(parse_toml(text))


def is_plan_file(name: str) -> bool:
    """Whether `name` is a test plan's file, not a suite's."""
    return name.endswith(".toml") and os.path.isfile(name) and is_test_plan(read_toml(Path(name)))


def refuse_existing(*paths: Path | None) -> None:
    """Refuse to write where there is something: a plan or a sheet may have been filled in."""
    for path in paths:
        if path is not None and os.path.exists(path):
            raise ClearwayError("is there already, and may have been filled in; name another file", file=path)


def write_new(path: str | Path, text: str) -> None:
    """Write a file that must not be there yet.

    Raises:
        ClearwayError: it is, or can't be written.
    """
    path = Path(path)
    refuse_existing(path)
    if not os.path.isdir(path.parent):
        raise ClearwayError("cannot be written: there is no such folder", file=path)
    with placed(path.parent) as new:
        (new / path.name).write_text(text, encoding="utf-8")


class _Writer:
    """Puts a list of scenarios into words and TOML."""

    def __init__(
        self,
        robot: Robot,
        name: str,
        chosen: Sequence[Scenario],
        floor: str | None,
        folder: Path,
        ticks: str | None,
        *,
        drawn: bool,
    ) -> None:
        self.robot, self.robot_name, self.scenarios, self.floor = robot, name, chosen, floor
        self.folder, self.ticks, self.drawn = folder, ticks, drawn
        first = chosen[0]
        self.line = Line(first.start, first.legs[0].goal)
        self.poses = _named_poses(chosen)
        self.legs = Counter(self.leg_lines(s) for s in chosen).most_common(1)[0][0]

    def text(self, suite: str) -> str:
        parts = [
            self.head(suite),
            self.test(),
            _CONDITIONS,
            self.places(),
            self.capture(),
            self.things(),
            self.trials(),
        ]
        return "\n".join(parts)

    def head(self, suite: str) -> str:
        counts = {"trial": len(self.scenarios), "set-up": len(list(itertools.groupby(self.scenarios, setup)))}
        trials, setups = (f"{n} {what}{'s' * (n != 1)}" for what, n in counts.items())
        order = (_BY_LOT if self.drawn else _GROUPED).format(setups=setups)
        return _HEAD.format(trials=trials, suite=suite, robot=self.robot.title or self.robot.name, order=order)

    def test(self) -> str:
        tolerances = {leg.tolerances(self.robot.tolerances) for s in self.scenarios for leg in s.legs}
        if len(tolerances) > 1:
            raise ClearwayError(
                "the goals of this suite differ in their tolerances, and a test plan has one for all; select a part",
                field="suite",
            )
        xy, yaw = next(iter(tolerances))
        lengths = {s.reference_length for s in self.scenarios}
        length = next(iter(lengths)) if len(lengths) == 1 else None
        lines = [
            "[test]",
            f"suite = {_toml(self.scenarios[0].labels.suite)}",
            f"robot = {_toml(self.file(self.robot_name))}  # gives the footprint and the limits",
            'navigator = "recorded"  # what drove it, such as "move_base"',
            'localisation = "recorded"  # how it knew where it was, such as "amcl"',
        ]
        if self.floor is None:
            lines.append('# floor_plan = "lab.yaml"  # or ROS map: what stands in it counts as obstacles')
        else:
            lines.append(f"floor_plan = {_toml(self.file(self.floor))}  # what stands in it counts as obstacles")
        if self.ticks is not None:
            lines.append(f"ticks = {_toml(self.ticks)}  # what is ticked on the page of the run sheet")
        lines += [f"xy_tolerance = {_toml(xy)}  # at a goal, m", f"yaw_tolerance = {_toml(yaw)}  # rad"]
        if length is not None:
            lines.append(f"reference_length = {_toml(length)}  # of one leg, m")
        return "\n".join([*lines, ""])

    def places(self) -> str:
        lines = [
            "# Places in the map: x [m], y [m], heading [rad]. The origin is wherever these numbers put it.",
            "[poses]",
        ]
        lines += [f"{name} = {_toml(pose)}" for pose, name in self.poses.items()]
        lines += ["", "# What the robot has to do in each trial, unless the trial says otherwise; time limits in s."]
        for leg in self.legs:
            lines += ["[[legs]]", *(f"{k} = {v}" for k, v in leg), ""]
        return "\n".join(lines)

    def capture(self) -> str:
        a, b = self.line.a, self.line.b
        c, s = math.cos(self.line.heading), math.sin(self.line.heading)
        third = ((a[0] + b[0]) / 2 - 2 * s, (a[1] + b[1]) / 2 + 2 * c)
        prefix = f"{_kind_of_robot(self.robot)}:"
        return _CAPTURE.format(
            a=_toml(a[:2]), b=_toml(b[:2]), c=_toml(third), prefix=_toml(prefix), example=_toml(prefix + "front_left"),
            pose=self.pose(a), other=self.pose(b),
        )  # fmt: skip

    def things(self) -> str:
        """[bodies]: each obstacle once."""
        things: dict[str, ObstacleSpec] = {}
        for s in self.scenarios:
            things |= {name: o for name, o in bodies_of(s) if name not in things}
        if not things:
            return ""
        lines = [_BODIES]
        for name, o in things.items():
            lines += [f"[bodies.{name}]", f"shape = {self.shape(o.shape)}"]
            if o.pose is None:
                lines += _MOVER.format(
                    markers=_toml(name + ":"), file=_toml(f"static_{name}.csv"), pose=self.pose(self.line.a),
                    example=_toml(f"{name}:front_left"),
                ).splitlines()  # fmt: skip
            lines.append("")
        return "\n".join(lines)

    def shape(self, shape: ShapeSpec) -> str:
        values = shape.model_dump()
        if isinstance(shape, RobotBodySpec):
            values["robot"] = self.file(shape.robot)
        return _toml(values)

    def trials(self) -> str:
        lines = [_TRIALS]
        total, now = len(self.scenarios), None
        for i, scenario in enumerate(self.scenarios, 1):
            if (here := setup(scenario)) != now:
                now = here
                lines += self.set_up(scenario)
            lines += self.trial(i, total, scenario)
        return "\n".join(lines)

    def set_up(self, scenario: Scenario) -> list[str]:
        at = scenario.labels
        lines = [f"# ---- {at.batch} {at.configuration} ".ljust(100, "-")]
        for name, o in bodies_of(scenario):
            if o.pose is not None:
                lines.append(f"# Put {name} {self.line.words(o.pose)}.")
            for run in o.runs:
                ends = " to ".join(f"({self.line.words(p)})" for p in (run.path[0], run.path[-1]))
                lines.append(f"# Drive {name} on leg {run.leg} from {ends}.")
            if o.oscillation is not None:
                lines.append(f"# {name} swings about {self.line.words(o.oscillation.attraction)}.")
            if o.motion is not None:
                lines.append(f"# {name} moves from {self.line.words(o.motion.start)} on ({o.motion.kind}).")
        if driven := who_drives(scenario):
            lines.append(f"# {driven}")
        lines += [f"# Walk {walk(self.line, person)}." for person in scenario.people]
        if not scenario.obstacles and not scenario.people:
            lines.append("# No obstacle.")
        return [*lines, ""]

    def trial(self, number: int, total: int, scenario: Scenario) -> list[str]:
        at = scenario.labels
        lines = [f"[[trial]]  # {number} of {total}: {described(scenario)}, repetition {at.repetition}"]
        placed = bodies_of(scenario)
        for name, o in placed:
            starts = "; ".join(f"{r.leg}: {when(r)}" for r in o.runs)
            lines += [f"# {name} drives at {o.runs[0].speed:g} m/s and starts {starts}"] if o.runs else []
        lines += _OPERATOR
        labels = {
            "batch": at.batch, "configuration": at.configuration, "speed": scenario.speed,
            "obstacle_speed": at.obstacle_speed, "size": at.size, "gap": at.gap, "repetition": at.repetition,
        }  # fmt: skip
        lines += [f"{k} = {_toml(v)}" for k, v in labels.items() if v is not None]
        if placed:
            items = [{"body": name} | ({} if o.pose is None else {"pose": o.pose}) for name, o in placed]
            lines.append(f"obstacles = {_toml(items)}")
        if (legs := self.leg_lines(scenario)) != self.legs:
            lines.append(f"legs = [{', '.join(self.other_legs(legs))}]")
        return [*lines, ""]

    def other_legs(self, legs: tuple[tuple[tuple[str, str], ...], ...]) -> list[str]:
        """A trial's legs as inline tables: of a leg that the plan has too, what differs."""
        usual = {leg[0]: dict(leg) for leg in self.legs}
        changed = []
        for leg in legs:
            known = usual.get(leg[0], {})
            fields = [(k, v) for k, v in leg if k == "name" or known.get(k) != v]
            if len(fields) > 1 or not known:
                changed.append("{ " + ", ".join(f"{k} = {v}" for k, v in fields) + " }")
        return changed

    def leg_lines(self, scenario: Scenario) -> tuple[tuple[tuple[str, str], ...], ...]:
        """Key and TOML value of each leg's fields."""
        return tuple(
            tuple(self.leg_fields(leg, scenario.start if i == 0 else None)) for i, leg in enumerate(scenario.legs)
        )

    def leg_fields(self, leg: LegSpec, start: PoseSpec | None) -> Iterable[tuple[str, str]]:
        yield "name", _toml(leg.name)
        if start is not None:
            yield "start", self.pose(start)
        yield "goal", self.pose(leg.goal)
        if not leg.scored:
            yield "scored", "false"
        yield "time_limit", _toml(round(leg.time_limit, 2))

    def pose(self, pose: PoseSpec) -> str:
        return _toml(self.poses.get(pose, pose))

    def file(self, name: str) -> str:
        """A name, or a file as it is seen from the plan's folder."""
        path, colon, preset = name.partition(".toml:")
        file = path + ".toml" if colon else name
        if not os.path.isfile(file):
            return name
        seen = Path(os.path.relpath(file, self.folder)).as_posix()
        return f"{seen}:{preset}" if colon else seen


def _kind_of_robot(robot: Robot) -> str:
    return bare(robot.name.partition(":")[0])


def _named_poses(chosen: Sequence[Scenario]) -> dict[PoseSpec, str]:
    """A and B, and the same places facing elsewhere, where all scenarios share them; others stand as numbers."""
    first = chosen[0]
    ways = {(s.start, *(leg.goal for leg in s.legs)) for s in chosen}
    if len(ways) > 1:
        return {}
    named: dict[PoseSpec, str] = {}
    letters = iter("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
    for pose in (first.start, *(leg.goal for leg in first.legs)):
        if pose in named:
            continue
        same = [n for p, n in named.items() if p[:2] == pose[:2]]
        named[pose] = f"{same[0]}_turned" if len(same) == 1 else next(letters, f"P{len(named)}")
    return named


def _toml(value: Any) -> str:
    return toml_value(_rounded(value))


def _rounded(value: Any) -> Any:
    """To what a lab can tell apart, without the last digits of a sum."""
    if isinstance(value, float):
        return round(value, 8) + 0.0
    if isinstance(value, Mapping):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, list | tuple) else value


_HEAD = """\
# Test plan: {trials} of the suite {suite} with {robot}.
#
# What is left to fill in: [conditions]; the marker names; the names of the files, here as proposals and in each trial.
# Files are seen from this file's folder. Lengths are metres, angles radians, times seconds.
# A line that begins with # is a remark; take the # away where you want what stands behind it.
#
{order} The number behind [[trial]] is the one on the run sheet.
#
# `clearway check` says what is missing or wrong in this file, `clearway score` makes the results of it.
"""

_GROUPED = """\
# Order: batch by batch as in the suite; within a batch all trials among the same obstacles stand together, speeds and
# repetitions one after another, so that obstacles are carried as rarely as possible ({setups} in all). You may
# drive in another order."""

_BY_LOT = """\
# Order: every test once before any is repeated, each time in an order drawn by lot ({setups} in all), so that a verdict may be
# asked for after every trial. Keep it: a trial that is driven out of turn waits for those before it."""

_CONDITIONS = """\
# What the report has to say about the tests. A trial may have these fields too, where it differs.
[conditions]
place = ""
operator = ""  # who tested
date = ""
floor = ""  # surface, such as "linoleum, dry"
load = ""  # on the robot, such as "none" or "10 kg on top"
software = ""  # the robot's, with its version
capture = ""  # the measuring system, such as "Vicon Vero, 8 cameras, 100 Hz"
"""

_CAPTURE = """\
# The measuring system.
[sources.capture]
# format = "vicon"  # only where the file isn't recognised; `clearway list formats` shows all
# files = "captures/{{number:03d}}*"  # instead of a name in each trial: how they are called, or the folder in which they lie

# How the system's own frame lies in the map: three markers on the floor, on A, on B, and 2 m to the left of the middle
# (from A towards B), recorded once. Fill in the file and the markers' names.
[sources.capture.frame]
file = "survey.csv"
surveyed = [
  {{ marker = "floor:A", at = {a} }},
  {{ marker = "floor:B", at = {b} }},
  {{ marker = "floor:C", at = {c} }},
]
# Other ways, instead of `file` and `surveyed`: the system's frame is the map's, or the robot stood on known poses
# (needs the markers' coordinates below).
# same = true
# static_poses = [{{ file = "static_A.csv", pose = {pose} }}, {{ file = "static_B.csv", pose = {other} }}]

# The robot's own log, if there is one: take the # away, and add to each trial: files = {{ robot = "NAME" }}
# [sources.robot]
# estimate = "/amcl_pose"  # where the robot believed to be
# odometry = "/odom"  # by its speed the two clocks are tied

# The robot's markers: a list of names, or a prefix that all of its markers have. They are tied to the robot's own frame
# (x forward, y left, origin between the wheels) by the robot at rest on A, facing B, and by a straight drive forward.
[robot]
markers = {prefix}
static = {{ file = "static_A.csv", pose = {pose} }}
straight = {{ file = "straight.csv" }}
# Or, instead of `static` and `straight`, where the markers sit on the robot, m: x forward, y left, z up. Of every marker
# that `markers` names: write a list there, if you measured only some.
# coordinates = {{ {example} = [0.2, 0.2, 0.3] }}
"""

_BODIES = """\
# Obstacles. One that stands is taken to be where its trial puts it, by shape and pose. If it has markers, and shall be
# where they were seen: markers = "NAME:" here, and take its pose out of the trials.
"""

_MOVER = """\
# It moves. Its marker set, as for the robot; it is tied to its shape by a recording of it at rest on A, facing B, where the
# sheet asks for it. Without a tie MDO and collisions with it can't be told.
markers = {markers}
static = {{ file = {file}, pose = {pose} }}
# Or, instead of `static`, where its markers sit on it, m: x forward, y left, z up; of a robot from its base_link, else from
# the middle.
# coordinates = {{ {example} = [0.2, 0.2, 0.3] }}
# visits = true  # it is driven out of the cameras' sight once it has passed; else it is taken to be near, and not seen
"""

_TRIALS = """\
# The trials. In each: file = "NAME" of its recording. More trials in one file: give each its span = [start, end] in s.
# `attempted = false` may stay where a file is filled in: a recorded trial counts as attempted, whatever it says. A trial
# that was driven but not recorded: attempted = true. It counts as attempted.
# intervention: a person had to help. stopped: emergency stop. aborted: broken off. note: whatever is worth knowing.
# contact: take the # away and say true if the robot touched something, false if you watched and it did not.
"""

_OPERATOR = (
    'file = ""', "attempted = false",
    "# contact = false", "intervention = false", "stopped = false", "aborted = false", 'note = ""',
)  # fmt: skip

"""The printable run sheet of a test plan: what the people in the lab do, trial by trial, and tick off. A4, one file."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from jinja2 import Environment, PackageLoader, StrictUndefined

from clearway.quantities import PoseSpec
from clearway.recordings.lab.captures import file_names
from clearway.recordings.lab.test_plan import BodySpec, RecordedTrialSpec, TestPlan
from clearway.recordings.protocol.lab_trials import key, setting, walk, who_drives
from clearway.recordings.protocol.line import Line, metres
from clearway.recordings.protocol.sketch import Sketch, place, sketch
from clearway.scenarios.scenario import RunSpec, Scenario

OWN = {
    "NO": "no obstacle",
    "SO": "static obstacles",
    "MO": "a moving obstacle",
    "CE": "complex environment: static obstacles and a moving one",
}
"""Paper A's batches, for people."""
TURNING, STARTING = 1.0, 1.0
"""rad/s and s, for an estimate of the time: how fast robots turn on the spot, what speeding up and braking adds to a leg."""

TICKS = ("driven", "contact", "help", "stop", "abort")
"""Headings of the boxes: attempted, contact, intervention, stopped, aborted."""


@dataclass(frozen=True, slots=True)
class Placement:
    """An obstacle that has to be put somewhere.

    Attributes:
        number: Its number in the sketch.
        name: Its name.
        where: Where it goes, in words for people.
    """

    number: int
    name: str
    where: str


@dataclass(frozen=True, slots=True)
class Row:
    """One trial.

    Attributes:
        number: Its number in the plan.
        speed: Set speed, m/s, as text; empty where the plan has none.
        obstacle_speed: Speed of the moving obstacles, m/s, as text; empty where nobody knows one.
        starts: When moving obstacles start, for each way (forth, back, ...).
        repetition: Which repetition it is, from 1.
        file: The file that the trial's recording goes to.
    """

    number: int
    speed: str
    obstacle_speed: str
    starts: tuple[str, ...]
    repetition: int
    file: str


@dataclass(frozen=True, slots=True)
class Group:
    """Trials among the same obstacles.

    Attributes:
        title: What the trials have in common.
        placements: What has to be put where.
        ways: How the moving obstacles are driven, a sentence each.
        driven: What who drives them does about the robot.
        walks: How people walk, a sentence each.
        legs: The leg in which each of these ways is driven.
        sketch: Where everything stands; None where nothing is to be drawn.
        rows: The trials.
        moving: Whether obstacles move.
        new_batch: Whether a batch of the protocol begins with it.
    """

    title: str
    placements: tuple[Placement, ...]
    ways: tuple[str, ...]
    driven: str
    walks: tuple[str, ...]
    legs: tuple[str, ...]
    sketch: Sketch | None
    rows: tuple[Row, ...]
    moving: bool
    new_batch: bool


def sheet_of(plan: TestPlan, scenarios: Iterable[Scenario] = ()) -> str:
    """The run sheet of a plan, as one HTML page to print.

    Args:
        plan: The test plan.
        scenarios: Where the trials come from (`protocol.scenarios`), found again by their labels; they know how moving
            obstacles are to be driven.
    """
    line = _line(plan)
    return page(
        "run_sheet.html",
        plan=plan,
        line=line,
        groups=groups_of(plan, scenarios),
        ticks=TICKS,
        trials=len(plan.trials),
        driving=_driving(plan),
        things=_things(plan),
        batches={b: OWN.get(b, "") for b in dict.fromkeys(t.batch for t in plan.trials)},
        gaps=any(t.gap is not None for t in plan.trials),
        checklist=_checklist(plan, line),
        metres=metres,
        poses=_poses(plan, line),
    )


def page(template: str, **what: object) -> str:
    """A page of this room, filled in."""
    environment = Environment(
        loader=PackageLoader("clearway.recordings.protocol"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(template).render(**what)


def groups_of(plan: TestPlan, scenarios: Iterable[Scenario] = ()) -> list[Group]:
    """The trials, those among the same obstacles together.

    Args:
        plan: The test plan.
        scenarios: Where the trials come from.
    """
    known = {key(s.labels, s.speed): s for s in scenarios}
    return list(_groups(_with_names(plan), known, _line(plan)))


def _with_names(plan: TestPlan) -> TestPlan:
    """The plan with the file names that its sources give to the trials."""
    named = zip(plan.trials, file_names(plan), strict=True)
    return plan.model_copy(update={"trials": tuple(t.model_copy(update={"file": name}) for t, name in named)})


def _line(plan: TestPlan) -> Line | None:
    """From where the first leg starts to its goal."""
    legs = plan.legs or plan.trials[0].legs
    if not legs:
        return None
    ends = [plan.poses.get(p) if isinstance(p, str) else p for p in (legs[0].start, legs[0].goal)]
    return None if ends[0] is None or ends[1] is None else Line(ends[0], ends[1])


def _poses(plan: TestPlan, line: Line | None) -> list[tuple[str, str, str, str]]:
    """Name, place, heading, and the plan's numbers."""
    if line is None:
        return []
    return [
        (name, line.words(p), _facing(line, p), f"{metres(p[0])}, {metres(p[1])}, {p[2]:.4g}")
        for name, p in plan.poses.items()
    ]


def _facing(line: Line, pose: PoseSpec) -> str:
    degrees = line.turned(pose[2])
    if abs(degrees) < 0.01:
        return "along A to B"
    return "along B to A" if abs(abs(degrees) - 180) < 0.01 else f"turned {degrees:g}° from A to B"


def _checklist(plan: TestPlan, line: Line | None) -> list[str]:
    """What has to be recorded before the trials, from the stretches that the plan names."""
    found = []
    for spec in plan.sources.values():
        marked = "; ".join(s.marker if line is None else f"{s.marker} {line.words(s.at)}" for s in spec.frame.surveyed)
        if marked:
            found.append(f"The floor's markers, 5 s{_named(spec.frame.file)}: {marked}")
        found += [f"The robot at rest, 10 s, on {_place(h.pose)}{_named(h.file)}" for h in spec.frame.static_poses]
    for name, body in {"The robot": plan.robot, **plan.bodies}.items():
        if body.static is not None:
            facing = "" if line is None else _looking(plan, line, body.static.pose)
            found.append(
                f"{name} at rest, 10 s, on {_place(body.static.pose)}{facing}{_named(body.static.file)}, as exactly as it can "
                "be put"
            )
        if body.straight is not None:
            found.append(
                f"{name} driving straight forward for 2 m or more, as slowly as it can{_named(body.straight.file)}"
            )
    found.append("Every marker of every body is seen, everywhere on the floor where something will move")
    found.append(
        "After the first trial, its file filled in: \N{LEFT DOUBLE QUOTATION MARK}clearway check PLAN\N{RIGHT DOUBLE QUOTATION MARK} "
        "finds nothing wrong, and DE of \N{LEFT DOUBLE QUOTATION MARK}clearway score PLAN\N{RIGHT DOUBLE QUOTATION MARK} is what a "
        "tape on the floor says, to within a centimetre; or the above has to be done anew"
    )
    return found


def _looking(plan: TestPlan, line: Line, pose: str | PoseSpec | None) -> str:
    """Where something on a pose of the plan has to look."""
    at = plan.poses.get(pose) if isinstance(pose, str) else pose
    return "" if at is None else f", looking {_facing(line, at)}"


def _named(file: str | None) -> str:
    return f" ({file})" if file else ""


def _place(pose: str | PoseSpec | None) -> str:
    if pose is None:
        return "one place"
    return pose if isinstance(pose, str) else f"({metres(pose[0])}, {metres(pose[1])}), heading {pose[2]:.3g} rad"


def _things(plan: TestPlan) -> list[tuple[str, str, bool]]:
    """Name, what it is, whether it moves (or is measured)."""
    return [
        (name, _what(body), body.markers is not None or body.track is not None) for name, body in plan.bodies.items()
    ]


def _what(body: BodySpec) -> str:
    if body.shape is None:
        return "shape not given"
    values = body.shape.model_dump()
    kind = values.pop("kind")
    if kind == "robot":
        return f"the robot {values['robot']}"
    if kind == "polygon":
        return f"polygon with {len(values['vertices'])} corners"
    return ", ".join([kind, *(f"{name} {metres(v)} m" for name, v in values.items())])


def _driving(plan: TestPlan) -> str | None:
    """How long is driven, straight and at the set speeds, and turned on the spot; None if the plan doesn't say."""
    seconds = 0.0
    for trial in plan.trials:
        here: PoseSpec | None = None
        for leg in plan.legs_of(trial):
            start, goal = (plan.poses.get(p) if isinstance(p, str) else p for p in (leg.start, leg.goal))
            here = start or here
            if here is None or goal is None or trial.speed is None:
                return None
            turned = abs(math.remainder(goal[2] - here[2], math.tau))
            seconds += math.dist(here[:2], goal[:2]) / trial.speed + turned / TURNING + STARTING
            here = goal
    return f"{seconds / 3600:.1f} hours" if seconds >= 3600 else f"{math.ceil(seconds / 60)} minutes"


def _groups(plan: TestPlan, known: dict[Hashable, Scenario], line: Line | None) -> Iterable[Group]:
    numbered = [(i, t, known.get(key(t, t.speed))) for i, t in enumerate(plan.trials, 1)]
    batch = None
    for _, several in groupby(numbered, lambda x: _setting(x[1], x[2])):
        trials = list(several)
        _, first, scenario = trials[0]
        yield _group(plan, trials, first, scenario, line, first.batch != batch)
        batch = first.batch


def _setting(trial: RecordedTrialSpec, scenario: Scenario | None) -> Hashable:
    ways = () if scenario is None else tuple(r.path for _, r in _runs(scenario))
    return (
        trial.batch,
        trial.configuration,
        trial.size,
        trial.gap,
        trial.obstacles,
        ways,
        () if scenario is None else scenario.people,
    )


def _runs(scenario: Scenario) -> list[tuple[str, RunSpec]]:
    return [(o.name, run) for o in scenario.obstacles for run in o.runs]


def _group(
    plan: TestPlan,
    trials: Sequence[tuple[int, RecordedTrialSpec, Scenario | None]],
    first: RecordedTrialSpec,
    scenario: Scenario | None,
    line: Line | None,
    new_batch: bool,
) -> Group:
    runs = [] if scenario is None else _runs(scenario)
    placed = [o for o in first.obstacles if o.pose is not None]
    rows = tuple(
        Row(
            number,
            "" if t.speed is None else f"{t.speed:g}",
            _obstacle_speed(t, s),
            () if s is None else tuple(_after(r) for _, r in _runs(s)),
            t.repetition,
            t.file,
        )
        for number, t, s in trials
    )
    placements = () if line is None else tuple(
        Placement(i, o.body, _words(line, o.pose)) for i, o in enumerate(placed, 1) if o.pose is not None
    )  # fmt: skip
    return Group(
        title=setting(first),
        placements=placements,
        ways=() if line is None else tuple(_way(line, name, run) for name, run in runs),
        driven="" if scenario is None else who_drives(scenario),
        walks=() if line is None or scenario is None else tuple(walk(line, person) for person in scenario.people),
        legs=tuple(run.leg for _, run in runs),
        sketch=None if line is None else sketch(plan, line, placed, runs),
        rows=rows,
        moving=any(row.obstacle_speed for row in rows),
        new_batch=new_batch,
    )


def _obstacle_speed(trial: RecordedTrialSpec, scenario: Scenario | None) -> str:
    """As the plan has it, else as the scenario's moving obstacles are driven."""
    runs = [] if scenario is None else _runs(scenario)
    speeds = [run.speed for _, run in runs] if trial.obstacle_speed is None else [trial.obstacle_speed]
    return ", ".join(dict.fromkeys(f"{speed:g}" for speed in speeds))


def _words(line: Line, pose: PoseSpec) -> str:
    turned = line.turned(pose[2]) % 90
    square_on = min(turned, 90 - turned) < 0.01
    return line.words(pose) + ("" if square_on else f", turned {line.turned(pose[2]):g}°")


def _way(line: Line, name: str, run: RunSpec) -> str:
    return f"{run.leg}: {name} from {place(line.seen(run.path[0]))} to {place(line.seen(run.path[-1]))}"


def _after(run: RunSpec) -> str:
    """Seconds after the robot's start; negative: before it."""
    return f"{run.delay:+.1f}".replace("-", "\N{MINUS SIGN}")

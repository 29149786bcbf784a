"""A suite's scenarios as a lab sees them: in an order that carries obstacles rarely, with the things that play them.

The order is the suite's, batch by batch; within a batch the trials among the same obstacles stand together (in the
hospital's SO 28 set-ups instead of 84).
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Hashable
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.recordings.lab.test_plan import RecordedTrialSpec, TestPlan, seen_from
from clearway.recordings.protocol.line import Line
from clearway.robots import load_robot
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.scenario import (
    DiscSpec,
    LabelSpec,
    ObstacleSpec,
    RectangleSpec,
    RobotBodySpec,
    RunSpec,
    Scenario,
    SquareSpec,
)
from clearway.scenarios.suites import Selection, load_suite


def scenarios(
    suite: str, robot: str, selection: Selection | None = None, seed: int = 0, *, drawn: bool = False
) -> list[Scenario]:
    """The selected scenarios of a suite in the order in which a lab should drive them.

    Args:
        suite: Its name or file.
        robot: Its name, preset or file.
        selection: Which part of the suite.
        seed: Seed of the suite, and of the lot.
        drawn: Whether every test is driven once before any is repeated, each time in an order by lot: it carries obstacles more
            often, and a verdict may be asked for after every trial.

    Raises:
        ClearwayError: an unknown suite or robot, or a selection that selects nothing.
    """
    made = load_suite(suite).build(load_robot(robot), selection, seed)
    if drawn:
        lots = {s.name: hashlib.sha256(f"{seed} {s.name}".encode()).digest() for s in made}
        return sorted(made, key=lambda s: (s.labels.repetition, lots[s.name]))
    batches: dict[Hashable, int] = {}
    setups: dict[Hashable, int] = {}
    for s in made:
        batches.setdefault(s.labels.batch, len(batches))
        setups.setdefault(setup(s), len(setups))
    return sorted(made, key=lambda s: (batches[s.labels.batch], setups[setup(s)]))


def setup(scenario: Scenario) -> Hashable:
    """What has to stay as it is from one trial to the next: the obstacles that stand, the ways of those that move, the people."""
    placed = tuple((o.shape, o.pose) for o in scenario.obstacles if o.pose is not None)
    ways = tuple((o.shape, tuple((r.leg, r.path) for r in o.runs)) for o in scenario.obstacles if o.pose is None)
    return scenario.labels.batch, scenario.labels.configuration, placed, ways, scenario.people


def behind(plan: TestPlan, folder: Path) -> list[Scenario]:
    """The scenarios that a plan's trials were made from, as far as its suite is known; to be found by their labels."""
    if plan.test.robot is None:
        return []
    robot, floor = (None if n is None else seen_from(folder, n) for n in (plan.test.robot, plan.test.floor_plan))
    selection = Selection(floor_plan=floor, repetitions=max(t.repetition for t in plan.trials))
    try:
        return scenarios(plan.test.suite, str(robot), selection)
    except ClearwayError:
        return []


def key(labels: LabelSpec | RecordedTrialSpec, speed: float | None) -> Hashable:
    """What tells a trial within its suite; of a scenario or of a plan."""
    names = ("batch", "configuration", "obstacle_speed", "size", "gap", "repetition")
    return speed, *(getattr(labels, n) for n in names)


def labels_in(plan: TestPlan) -> list[dict[str, str | float | int | None]]:
    """The labels of a plan's trials, as their results will have them in columns."""
    names = ("batch", "configuration", "speed", "obstacle_speed", "size", "gap", "repetition")
    test = {"suite": plan.test.suite, "navigator": plan.test.navigator, "localisation": plan.test.localisation}
    return [test | {n: getattr(t, n) for n in names} for t in plan.trials]


def bodies_of(scenario: Scenario) -> list[tuple[str, ObstacleSpec]]:
    """The obstacles of a scenario, each with the name of the thing in the lab that plays it.

    Things of one shape are interchangeable: the first square of 0.3 m is the same in every trial.
    """
    count: Counter[str] = Counter()
    found = []
    for obstacle in scenario.obstacles:
        kind = _kind(obstacle)
        count[kind] += 1
        found.append((kind if isinstance(obstacle.shape, RobotBodySpec) else f"{kind}-{count[kind]}", obstacle))
    names = [name for name, _ in found]
    return [(n if names.count(n) == 1 else f"{n}-{o.name}", o) for n, o in found]


def who_drives(scenario: Scenario) -> str:
    """How the moving obstacles are to be driven, as they are in simulation; empty where none is."""
    ways = [o.behaviour for o in scenario.obstacles if o.runs]
    if not ways:
        return ""
    looks = next((spec for spec in ways if spec is not None), None)
    if looks is None:
        return "At constant speed, whatever the robot does."
    return (
        f"At constant speed, and looking at the robot: come in once it is not near there, stop {looks.stop_short:g} m short of it, "
        f"back off slowly after standing for {looks.patience:g} s."
    )


def walk(line: Line, person: PersonSpec) -> str:
    """How somebody is to walk, in words."""
    speed = "" if person.speed is None else f" at {person.speed:g} m/s"
    begin = line.words(person.start)
    if person.track or not person.route:
        return f"{person.name}: {'as recorded, from' if person.track else 'stands'} {begin}"
    places = "; ".join(
        f"to {line.words(stop.at)}" + (f" (stays {stop.wait:g} s)" if stop.wait else "") for stop in person.route
    )
    return f"{person.name}{speed} from {begin} {places}{'; and round again' if person.loop else ''}"


def _kind(obstacle: ObstacleSpec) -> str:
    match obstacle.shape:
        case SquareSpec(edge=edge):
            return f"square-{_short(edge)}"
        case RectangleSpec(length=length, width=width):
            return f"rectangle-{_short(length)}-{_short(width)}"
        case DiscSpec(radius=radius):
            return f"disc-{_short(2 * radius)}"
        case RobotBodySpec(robot=robot):
            return bare(Path(robot.removesuffix(".toml")).name)
        case _:
            return bare(obstacle.name)


def _short(length: float) -> str:
    """Without a dot, so that it may stand in a bare key: 30cm, 125mm."""
    cm = round(100 * length, 6)
    return f"{cm:.0f}cm" if cm == round(cm) else f"{1000 * length:.0f}mm"


def bare(name: str) -> str:
    """As a key that needs no quotes in TOML."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in name) or "body"


def setting(labels: LabelSpec | RecordedTrialSpec) -> str:
    """What trials among the same obstacles share, in a few words: `SO single, edge 0.03 m`."""
    words = [
        labels.batch if labels.configuration in (labels.batch, "free") else f"{labels.batch} {labels.configuration}"
    ]
    if labels.size is not None:
        words.append(f"edge {labels.size:g} m")
    if labels.gap is not None:
        words.append(f"gap {labels.gap:g} d_base")
    return ", ".join(words)


def described(scenario: Scenario) -> str:
    """A trial in a few words: `SO single, edge 0.03 m, 0.2 m/s`."""
    words = [setting(scenario.labels), f"{scenario.speed:g} m/s"]
    if scenario.labels.obstacle_speed is not None:
        words.append(f"obstacle {scenario.labels.obstacle_speed:g} m/s")
    return ", ".join(words)


def when(run: RunSpec) -> str:
    """When a moving obstacle starts, against the robot's own start of that leg."""
    if abs(run.delay) < 0.05:
        return "together with the robot"
    return f"{abs(run.delay):.1f} s {'before' if run.delay < 0 else 'after'} the robot"

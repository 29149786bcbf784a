"""Does a navigator keep its contract? `clearway check my_pkg:MyNavigator` asks this, and so do Clearway's own tests.

The navigator drives through short scenarios in a hall, as it would in a campaign, twice over, by two instances.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

import numpy as np

from clearway.campaigns.navigator_faults import beyond, changed, diagnostics_fault, malformed, not_finite
from clearway.campaigns.pilot import (
    DECISION_LIMIT,
    TookTooLong,
    compose,
    dismiss,
    guarded,
    prepare_limit,
    writes_into_input,
)
from clearway.campaigns.tuning import tuned_on
from clearway.contract import Command, Diagnostics, Navigator, Need, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.navigators.registry import check_drive, check_parameters, drives_of, wants_of
from clearway.perception import make_localiser, make_tracker
from clearway.registry import in_a_line
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import DiscSpec, LegSpec, ObstacleSpec, Scenario
from clearway.trials import LATE, Outcome, Trial
from clearway.tuning import TunedOn
from clearway.world import simulate

SPEED = 0.4
"""Set speed of the scenarios, m/s."""

_START = (-3.0, 0.0, 0.0)
_SEED = 2024


@dataclass(frozen=True, slots=True)
class Finding:
    """One question and its answer.

    Attributes:
        name: What was asked.
        passed: Whether it is so; None: that could not be tested.
        detail: What was seen, where it is not; why it could not be tested; or a figure.
    """

    name: str
    passed: bool | None
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a navigator is confronted with, in the middle of the plan `hall`.

    Attributes:
        name: For people.
        goals: One after the other, x [m], y [m] and heading [rad] in the map frame.
        duration: Time for each of them, s.
        discs: Centre and radius (x, y, radius) [m] of what stands there and is not on the map.
        near: The next goal comes as soon as the robot is so near to one, m; None: when it says that it has arrived.
        sees: Whether it is shown what its sensors see; if not, every scan is empty and so are the obstacles.
    """

    name: str
    goals: tuple[tuple[float, float, float], ...]
    duration: float
    discs: tuple[tuple[float, float, float], ...] = ()
    near: float | None = None
    sees: bool = True


SITUATIONS = (
    Situation("a free way", ((-0.5, 0.0, 0.0),), 20.0),
    Situation("nothing in sight", ((0.0, 1.0, 0.0),), 4.0, sees=False),
    Situation("an obstacle ahead", ((3.0, 0.0, 0.0),), 10.0, ((-1.2, 0.05, 0.25),)),
    Situation("a goal behind", ((-4.5, 0.5, math.pi),), 10.0),
    Situation(
        "many obstacles",
        ((3.0, 1.0, 0.0),),
        5.0,
        tuple((-1.5 + 0.9 * (i % 5), -3.0 + 1.2 * (i // 5), 0.15) for i in range(30)),
    ),
    Situation(
        "walled in",
        ((3.0, 0.0, 0.0),),
        2.0,
        tuple((-3.0 + 0.9 * math.cos(a), 0.9 * math.sin(a), 0.2) for a in np.linspace(0.0, math.tau, 14)[:-1]),
    ),
    Situation("a goal on top of itself", ((-3.0, 0.0, 0.0),), 2.0),
    Situation("goals that change", ((0.0, 2.0, 0.0), (-3.0, -2.0, math.pi), (0.0, 0.0, 0.0)), 10.0, near=1.5),
)


def check_navigator(
    factory: Callable[[], Navigator],
    robot: Robot,
    *,
    name: str | None = None,
    decision_limit: float | None = DECISION_LIMIT,
) -> Iterator[Finding]:
    """Drive a navigator through situations, twice over, and say what it keeps and what it breaks, each as soon as it is known.

    Args:
        factory: Makes the navigator.
        robot: Whose body and sensors it drives with.
        name: By which errors call it; None: that of its class.
        decision_limit: Wall clock after which a decision counts as hung, s; None: never. After one nothing more is tried.

    Raises:
        ClearwayError: The navigator can't be made, or the robot lacks what it needs or has a base that it doesn't drive.
    """
    with ExitStack() as after:
        yield from _checked(factory, robot, name, decision_limit, after)


def _checked(
    factory: Callable[[], Navigator], robot: Robot, name: str | None, decision_limit: float | None, after: ExitStack
) -> Iterator[Finding]:
    first = _made(factory, decision_limit)
    after.callback(dismiss, first, decision_limit)
    needs: Any = getattr(first, "needs", None)
    called = name or type(first).__name__
    said = (
        _needs(needs),
        _said("says what it wants besides, or nothing", lambda: _listed(wants_of(called, first))),
        _privileged(first),
        _said("says on what it was tuned, or nothing", lambda: _tuned(tuned_on(called, first))),
        _said("says which bases it drives, or nothing", lambda: _listed(drives_of(called, first))),
        _reads(called, first, robot),
    )
    yield from said
    if not all(f.passed for f in said):
        return
    if "scan" in needs and robot.lidar is None:
        raise ClearwayError(f"it needs scans, and the robot {robot.name!r} has no lidar; check it with another robot")
    check_drive(called, first, robot)
    runs: list[_Watched] = []
    for situation in SITUATIONS:
        name = f"decides: {situation.name}"
        if any(run.hung for run in runs):
            yield Finding(name, None, "an earlier decision hung")
            continue
        runs.append(run := _drive(first, robot, situation, decision_limit))
        yield Finding(name, not run.error, run.error)
    yield _first_fault("commands are finite", runs, not_finite)
    yield _first_fault("commands keep the robot's limits", runs, lambda c: beyond(c, robot, SPEED))
    yield _leaves_alone(runs)
    yield _arrives(runs[0])
    yield _shows(first, runs)
    if any(run.hung for run in runs):
        yield Finding(_SAME, None, "a decision hung")
        yield _pace(runs, robot)
        return
    after.close()  # a server may have room for one
    again = _made(factory, decision_limit)
    after.callback(dismiss, again, decision_limit)
    repeats: list[_Watched] = []
    for situation in reversed(SITUATIONS):  # another order: reset must forget
        repeats.append(run := _drive(again, robot, situation, decision_limit))
        if run.hung:
            yield Finding(_SAME, False, f"in '{situation.name}' a second instance {run.error}")
            break
    else:
        yield _deterministic(runs, repeats[::-1])
    yield _pace(repeats, robot)


def _made(factory: Callable[[], Navigator], decision_limit: float | None) -> Navigator:
    try:
        return guarded(prepare_limit(decision_limit), "to be made", factory)
    except TookTooLong as error:
        raise ClearwayError(f"the navigator cannot be made: it {error}") from error


class _Watched:
    """A navigator in one situation, and what it did there.

    Attributes:
        commands: What it answered.
        seconds: How long it took for each, s.
        error: Why it stopped answering; empty if it didn't.
        touched: What of an observation it wrote into; empty if nothing.
        shown: What is wrong with its diagnostics; empty if nothing.
        trial: What became of it; None where it could not even begin.
        answers: How often it answered anything.
        drawings: How often it was asked what it shows, and answered.
        hung: Whether it had to be broken off.
    """

    def __init__(self, navigator: Navigator, situation: Situation) -> None:
        self._navigator, self.situation, self.needs = navigator, situation, navigator.needs
        self.wants: frozenset[Need] = getattr(navigator, "wants", frozenset())
        self.commands: list[Command] = []
        self.seconds: list[float] = []
        self.error = self.touched = self.shown = ""
        self.trial: Trial | None = None
        self.answers = self.drawings = 0
        self.hung = False

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self._navigator.reset(task, robot, rng)

    def step(self, observation: Observation) -> Command:
        if not self.situation.sees:
            observation = _blind(observation)
        before, began = copy.deepcopy(observation), time.perf_counter()
        try:
            command = self._navigator.step(observation)
        except Exception as error:
            self.touched = self.touched or (f"it wrote into it: {in_a_line(error)}" if writes_into_input(error) else "")
            raise
        self.seconds.append(time.perf_counter() - began)
        self.answers += 1
        self.touched = self.touched or changed(before, observation)
        if wrong := malformed(command):
            self.error = wrong
            return Command(0.0, 0.0, gave_up=wrong)
        self.commands.append(command)
        return Command(0.0, 0.0, gave_up=found) if (found := not_finite(command)) else command

    def diagnostics(self) -> Diagnostics:
        ask = getattr(self._navigator, "diagnostics", None)
        shown = Diagnostics() if ask is None else ask()
        self.drawings += ask is not None
        self.shown = self.shown or diagnostics_fault(shown)
        return Diagnostics() if self.shown else shown


def _drive(navigator: Navigator, robot: Robot, situation: Situation, decision_limit: float | None) -> _Watched:
    run, scenario = _Watched(navigator, situation), _scenario(situation, robot)
    tracker = make_tracker(scenario.followed(robot), robot) if "obstacles" in run.needs else None
    watched: Any = run  # a Navigator, but that its `needs` are those of another
    pilot = compose(watched, make_localiser("truth", robot), tracker=tracker, decision_limit=decision_limit)
    try:
        run.trial = simulate(
            scenario, robot, pilot, navigator="checked", localisation="truth",
            map=load_floor_plan(scenario.floor_plan).map, privileged=bool(getattr(navigator, "privileged", False)),
        )  # fmt: skip
    except ClearwayError as error:
        run.error = str(error)
    if run.trial is not None and run.trial.outcome is Outcome.NAVIGATOR_FAILED:
        run.error = run.trial.reason
    run.hung = TookTooLong.__name__ in run.error
    return run


def _scenario(situation: Situation, robot: Robot) -> Scenario:
    declared = {} if situation.near is None else {"arrival": "measured", "xy_tolerance": situation.near}
    return Scenario(
        name=situation.name,
        floor_plan="hall",
        start=_START,
        legs=tuple(
            LegSpec(name=f"goal {k + 1}", goal=goal, time_limit=situation.duration, **declared)
            for k, goal in enumerate(situation.goals)
        ),
        speed=min(SPEED, robot.drive.v_max),
        obstacles=tuple(
            ObstacleSpec(name=f"disc {k + 1}", shape=DiscSpec(kind="disc", radius=radius), pose=(x, y, 0.0))
            for k, (x, y, radius) in enumerate(situation.discs)
        ),
        placement_xy=0.0,
        placement_yaw=0.0,
        seed=_SEED,
    )


def _blind(o: Observation) -> Observation:
    """The same, with nothing in sight."""
    scan = None if o.scan is None else replace(o.scan, ranges=np.full_like(o.scan.ranges, np.inf))
    seen = o.obstacles
    if seen is not None:
        seen = Obstacles(**{f.name: getattr(seen, f.name)[:0] for f in fields(seen)})
    return replace(o, scan=scan, obstacles=seen)


def _needs(needs: Any) -> Finding:
    name, known = "says what it needs", sorted(get_args(Need))
    if needs is None:
        return Finding(name, False, f"it has no attribute `needs`; give it one, such as needs = frozenset({known})")
    if not isinstance(needs, frozenset | set) or not needs <= set(known):
        return Finding(name, False, f"`needs` is {needs!r}; it must be a frozenset of some of {', '.join(known)}")
    return Finding(name, True, ", ".join(sorted(needs)) or "nothing")


def _said(name: str, ask: Callable[[], str]) -> Finding:
    """What it says of itself, if it says it as it should."""
    try:
        return Finding(name, True, ask())
    except ClearwayError as error:
        return Finding(name, False, str(error))


def _listed(words: Iterable[str]) -> str:
    return ", ".join(sorted(words)) or "nothing"


def _privileged(navigator: Navigator) -> Finding:
    flag = getattr(navigator, "privileged", False)
    good = isinstance(flag, bool)
    return Finding(
        "says whether it is privileged", good, "" if good else f"`privileged` is {flag!r}, not True or False"
    )


def _tuned(tests: Sequence[TunedOn] | None) -> str:
    return "nothing" if tests is None else "; ".join(map(str, tests)) or "on no test"


_READS = "reads its parameters"


def _reads(called: str, navigator: Navigator, robot: Robot) -> Finding:
    if not hasattr(navigator, "read_parameters"):
        return Finding(_READS, True, "it has none, and need not")

    def ask() -> str:
        check_parameters(called, navigator, robot)
        return f"for {robot.name}"

    return _said(_READS, ask)


def _first_fault(name: str, runs: list[_Watched], fault: Callable[[Command], str]) -> Finding:
    if not any(run.commands for run in runs):
        return Finding(name, None, "it gave no command")
    for run in runs:
        for k, command in enumerate(run.commands):
            if found := fault(command):
                return Finding(name, False, f"{found} (in '{run.situation.name}', decision {k})")
    return Finding(name, True)


def _leaves_alone(runs: list[_Watched]) -> Finding:
    name, wrote = "leaves its observation alone", _join(run.touched for run in runs)
    if not wrote and not any(run.answers for run in runs):
        return Finding(name, None, "it never came to an answer")
    return Finding(name, not wrote, wrote)


def _shows(navigator: Navigator, runs: list[_Watched]) -> Finding:
    name, wrong = "diagnostics in the vocabulary", _join(run.shown for run in runs)
    if not hasattr(navigator, "diagnostics"):
        return Finding(name, True, "it has none, and need not")
    if not wrong and not any(run.drawings for run in runs):
        return Finding(name, None, "they were never asked for")
    return Finding(name, not wrong, wrong)


_SAME = "same seed, same commands, whatever came before"


def _deterministic(runs: list[_Watched], repeats: list[_Watched]) -> Finding:
    name = _SAME
    if not any(run.commands for run in (*runs, *repeats)):
        return Finding(name, None, "it gave no command")
    for a, b in zip(runs, repeats, strict=True):
        left, right = ([(c.v, c.omega, c.v_y) for c in r.commands] for r in (a, b))
        for k, (one, other) in enumerate(zip(left, right, strict=False)):
            if repr(one) != repr(other):
                return Finding(
                    name,
                    False,
                    f"in '{a.situation.name}', decision {k}, a second instance with the same seed that had driven "
                    f"other situations before answered {_told(other)}, the first {_told(one)}; draw only from the rng "
                    "of reset(), and let reset() forget everything",
                )
        if len(left) != len(right) or a.error != b.error:
            return Finding(name, False, f"in '{a.situation.name}' two instances ended differently")
    return Finding(name, True)


def _arrives(run: _Watched) -> Finding:
    name, trial = "reaches a goal in the open", run.trial
    if trial is None or not run.commands:
        return Finding(name, None, "it gave no command")
    away = math.dist(trial.pose[-1, :2], run.situation.goals[-1][:2])
    detail = f"ended {away:.2f} m from a goal 2.5 m ahead after {len(run.commands)} decisions"
    return Finding(name, trial.outcome is Outcome.REACHED, detail)


def _pace(runs: list[_Watched], robot: Robot) -> Finding:
    """Whether a robot could drive by its decisions: as reports judge, but for a situation's first, which may load or compile."""
    name = "keeps up with its control period"
    seconds = np.array([s for r in runs for s in r.seconds[1:]])
    if any(run.hung for run in runs):
        return Finding(name, False, "a decision had to be broken off")
    if not len(seconds):
        return Finding(name, None, "it never came to a second answer")
    late = seconds > robot.period
    median, most = (1e3 * q for q in np.quantile(seconds, (0.5, 0.99)))
    detail = f"{100 * late.mean():.3g} % longer than the control period of {1e3 * robot.period:g} ms; median {median:.3g} ms, 99 % within {most:.3g} ms"
    return Finding(name, bool(late.mean() <= LATE), detail)


def _told(told: tuple[float, ...]) -> str:
    return f"({', '.join(map(repr, told))})"


def _join(texts: Iterable[str]) -> str:
    return next((text for text in texts if text), "")

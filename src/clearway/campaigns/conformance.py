"""Does a navigator keep its contract? `clearway check my_pkg:MyNavigator` asks this, and so do Clearway's own tests.

The navigator drives through short scenarios in a hall, as it would in a campaign, twice over, by two instances.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, get_args

import numpy as np

from clearway.campaigns.pilot import compose, writes_into_input
from clearway.campaigns.tuning import tuned_on
from clearway.contract import Command, Diagnostics, Navigator, Need, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.perception import make_localiser, make_tracker
from clearway.registry import in_a_line
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import DiscSpec, LegSpec, ObstacleSpec, Scenario
from clearway.trials import Outcome, Trial
from clearway.world import simulate

SLACK = 1e-6
"""By how much a command may exceed the robot's limits: rounding."""

SPEED = 0.4
"""Set speed of the scenarios, m/s."""

_START = (-3.0, 0.0, 0.0)
_SEED = 2024


@dataclass(frozen=True, slots=True)
class Finding:
    """One question and its answer.

    Attributes:
        name: What was asked.
        passed: Whether it is so.
        detail: What was seen, where it is not; or a figure.
    """

    name: str
    passed: bool
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


def check_navigator(factory: Callable[[], Navigator], robot: Robot) -> tuple[Finding, ...]:
    """Drive a navigator through situations, twice over, and say what it keeps and what it breaks.

    Args:
        factory: Makes the navigator.
        robot: Whose body and sensors it drives with.

    Raises:
        ClearwayError: The robot lacks what the navigator needs.
    """
    first = factory()
    needs: Any = getattr(first, "needs", None)
    findings = [_needs(needs), _privileged(first), _tuned(first)]
    if not all(f.passed for f in findings):
        return tuple(findings)
    if "scan" in needs and robot.lidar is None:
        raise ClearwayError(f"it needs scans, and the robot {robot.name!r} has no lidar; check it with another robot")
    runs = [_drive(first, robot, s) for s in SITUATIONS]
    again = factory()
    repeats = [_drive(again, robot, s) for s in reversed(SITUATIONS)][::-1]  # another order: reset must forget
    findings += [Finding(f"decides: {run.situation.name}", not run.error, run.error) for run in runs]
    findings += [
        _first_fault("commands are finite", runs, _not_finite),
        _first_fault("commands keep the robot's limits", runs, lambda c: _beyond(c, robot)),
        Finding("leaves its observation alone", not any(r.touched for r in runs), _join(r.touched for r in runs)),
        _deterministic(runs, repeats),
        _arrives(runs[0]),
        Finding("diagnostics in the vocabulary", not any(r.shown for r in runs), _join(r.shown for r in runs)),
        _pace(repeats, robot),
    ]
    return tuple(findings)


class _Watched:
    """A navigator in one situation, and what it did there.

    Attributes:
        commands: What it answered.
        seconds: How long it took for each, s.
        error: Why it stopped answering; empty if it didn't.
        touched: What of an observation it wrote into; empty if nothing.
        shown: What is wrong with its diagnostics; empty if nothing.
        trial: What became of it; None where it could not even begin.
    """

    def __init__(self, navigator: Navigator, situation: Situation) -> None:
        self._navigator, self.situation, self.needs = navigator, situation, navigator.needs
        self.commands: list[Command] = []
        self.seconds: list[float] = []
        self.error = self.touched = self.shown = ""
        self.trial: Trial | None = None

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
        self.touched = self.touched or _changed(before, observation)
        if malformed := _malformed(command):
            self.error = malformed
            return Command(0.0, 0.0, gave_up=malformed)
        self.commands.append(command)
        return Command(0.0, 0.0, gave_up=found) if (found := _not_finite(command)) else command

    def diagnostics(self) -> Diagnostics:
        ask = getattr(self._navigator, "diagnostics", None)
        shown = Diagnostics() if ask is None else ask()
        self.shown = self.shown or _diagnostics_fault(shown)
        return Diagnostics() if self.shown else shown


def _drive(navigator: Navigator, robot: Robot, situation: Situation) -> _Watched:
    run, scenario = _Watched(navigator, situation), _scenario(situation, robot)
    tracker = make_tracker(scenario.tracking, robot) if "obstacles" in run.needs else None
    watched: Any = run  # a Navigator, but that its `needs` are those of another
    pilot = compose(watched, make_localiser("truth", robot), "truth", tracker=tracker, decision_limit=None)
    try:
        run.trial = simulate(
            scenario, robot, pilot, navigator="checked", localisation="truth",
            map=load_floor_plan(scenario.floor_plan).map, privileged=bool(getattr(navigator, "privileged", False)),
        )  # fmt: skip
    except ClearwayError as error:
        run.error = str(error)
    if run.trial is not None and run.trial.outcome is Outcome.NAVIGATOR_FAILED:
        run.error = run.trial.reason
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


def _privileged(navigator: Navigator) -> Finding:
    flag = getattr(navigator, "privileged", False)
    good = isinstance(flag, bool)
    return Finding(
        "says whether it is privileged", good, "" if good else f"`privileged` is {flag!r}, not True or False"
    )


def _tuned(navigator: Navigator) -> Finding:
    name = "says on what it was tuned, or nothing"
    try:
        said = tuned_on(type(navigator).__name__, navigator)
    except ClearwayError as error:
        return Finding(name, False, str(error))
    return Finding(name, True, "nothing" if said is None else "; ".join(map(str, said)) or "on no test")


def _malformed(command: Any) -> str:
    if not isinstance(command, Command):
        return f"step() returned a {type(command).__name__}, not a clearway.contract.Command"
    for name in ("v", "omega"):
        if isinstance(value := getattr(command, name), bool) or not isinstance(value, int | float | np.floating):
            return f"the command's {name} is {value!r}, not a number"
    if command.arrived is not None and not isinstance(command.arrived, bool | np.bool_):
        return f"the command's `arrived` is {command.arrived!r}, not True, False or None"
    if command.gave_up is not None and not isinstance(command.gave_up, str):
        return f"the command's `gave_up` is {command.gave_up!r}, not the reason as text, or None"
    return ""


def _not_finite(c: Command) -> str:
    return "" if math.isfinite(c.v) and math.isfinite(c.omega) else f"v = {c.v}, omega = {c.omega}"


def _beyond(c: Command, robot: Robot) -> str:
    d = robot.limits()
    top = min(SPEED, d.v_max)
    if not d.v_min - SLACK <= c.v <= top + SLACK:
        return f"v = {c.v:.4g} m/s; the robot and the set speed allow {d.v_min:g} to {top:g}"
    if abs(c.omega) > d.omega_max + SLACK:
        return f"omega = {c.omega:.4g} rad/s; the robot allows {d.omega_max:g}"
    return ""


def _first_fault(name: str, runs: list[_Watched], fault: Callable[[Command], str]) -> Finding:
    for run in runs:
        for k, command in enumerate(run.commands):
            if found := fault(command):
                return Finding(name, False, f"{found} (in '{run.situation.name}', decision {k})")
    return Finding(name, True)


def _deterministic(runs: list[_Watched], repeats: list[_Watched]) -> Finding:
    name = "same seed, same commands, whatever came before"
    for a, b in zip(runs, repeats, strict=True):
        left, right = ([(c.v, c.omega) for c in r.commands] for r in (a, b))
        for k, (one, other) in enumerate(zip(left, right, strict=False)):
            if repr(one) != repr(other):
                return Finding(
                    name,
                    False,
                    f"in '{a.situation.name}', decision {k}, a second instance with the same seed that had driven "
                    f"other situations before answered {_pair(other)}, the first {_pair(one)}; draw only from the rng "
                    "of reset(), and let reset() forget everything",
                )
        if len(left) != len(right) or a.error != b.error:
            return Finding(name, False, f"in '{a.situation.name}' two instances ended differently")
    return Finding(name, True)


def _arrives(run: _Watched) -> Finding:
    name, trial = "reaches a goal in the open", run.trial
    if trial is None:
        return Finding(name, False, "it never began")
    away = math.dist(trial.pose[-1, :2], run.situation.goals[-1][:2])
    detail = f"ended {away:.2f} m from a goal 2.5 m ahead after {len(run.commands)} decisions"
    return Finding(name, trial.outcome is Outcome.REACHED, detail)


def _pace(runs: list[_Watched], robot: Robot) -> Finding:
    name = "keeps up with its control period"
    seconds = np.array([s for r in runs for s in r.seconds])
    if not len(seconds):
        return Finding(name, False, "it never decided")
    median, late = np.quantile(seconds, (0.5, 0.99))
    detail = f"median {1e3 * median:.3g} ms, 99 % within {1e3 * late:.3g} ms; the period is {1e3 * robot.period:g} ms"
    return Finding(name, bool(median <= robot.period), detail)


def _diagnostics_fault(shown: Any) -> str:
    if not isinstance(shown, Diagnostics):
        return f"diagnostics() returned a {type(shown).__name__}, not a clearway.contract.Diagnostics"
    arrays = [(f"polyline {n!r}", a, 2) for n, a in shown.polylines.items()]
    arrays += [(f"circles {n!r}", a, 3) for n, a in shown.circles.items()]
    arrays += [("tube", shown.tube, 3)] if shown.tube is not None else []
    arrays += [("tree", shown.tree, 4)] if shown.tree is not None else []
    for name, values, width in arrays:
        found = np.asarray(values)
        if found.ndim != 2 or found.shape[1] != width or found.dtype != np.float64:
            return f"the {name} is {found.dtype} {found.shape}, not float64 (n, {width})"
        if not np.isfinite(found).all():
            return f"the {name} holds a number that is not finite"
    if shown.field is not None and not isinstance(shown.field, OccupancyGrid):
        return f"the field is a {type(shown.field).__name__}, not an OccupancyGrid"
    if not isinstance(shown.status, str) or not isinstance(shown.iterations, int | np.integer):
        return f"status {shown.status!r} must be text, iterations {shown.iterations!r} a whole number"
    return ""


def _changed(before: Any, after: Any, where: str = "observation") -> str:
    """Which field of an observation the navigator wrote into."""
    if isinstance(before, np.ndarray):
        return "" if np.array_equal(before, after, equal_nan=True) else f"it wrote into {where}"
    if is_dataclass(before):
        found = (_changed(getattr(before, f.name), getattr(after, f.name), f"{where}.{f.name}") for f in fields(before))
        return next((text for text in found if text), "")
    return ""


def _pair(pair: tuple[float, float]) -> str:
    return f"({pair[0]!r}, {pair[1]!r})"


def _join(texts: Iterable[str]) -> str:
    return next((text for text in texts if text), "")

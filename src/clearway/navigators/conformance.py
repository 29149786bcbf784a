"""Does a navigator keep its contract? `clearway check my_pkg:MyNavigator` asks this, and so do Clearway's own tests.

The navigator is driven through the situations of `practice_room`, twice over, by two instances.
"""

from __future__ import annotations

import copy
import math
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np

from clearway.contract import Command, Diagnostics, Navigator, Need, Observation
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.navigators import practice_room
from clearway.navigators.practice_room import SITUATIONS, Room, Situation
from clearway.robots import Robot

SLACK = 1e-6
"""By how much a command may exceed the robot's limits: rounding."""

_SEED = 2024
_DIAGNOSTICS_EVERY = 5


@dataclass(frozen=True, slots=True)
class Finding:
    """One question and its answer.

    Attributes:
        name: what was asked. passed: whether it is so. detail: what was seen, where it is not; or a figure.
    """

    name: str
    passed: bool
    detail: str = ""


def check_navigator(factory: Callable[[], Navigator], robot: Robot) -> tuple[Finding, ...]:
    """Drive navigators that `factory` makes, with the body and sensors of `robot`, and say what they keep and break.

    No world is involved: the observations come from an empty room with a few discs in it. It takes as long as the
    navigator needs for about 2 x 100 s of driving.
    """
    first = factory()
    needs: Any = getattr(first, "needs", None)
    findings = [_needs(needs), _privileged(first)]
    if not all(f.passed for f in findings):
        return tuple(findings)
    if "scan" in needs and robot.lidar is None:
        raise ClearwayError(f"it needs scans, and the robot {robot.name!r} has no lidar; check it with another robot")
    runs = [_drive(first, robot, needs, s) for s in SITUATIONS]
    again = factory()
    repeats = [_drive(again, robot, needs, s) for s in reversed(SITUATIONS)][::-1]  # another order: reset must forget
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


@dataclass(eq=False)
class _Run:
    situation: Situation
    commands: list[Command] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    error: str = ""
    touched: str = ""
    shown: str = ""
    distance: float = math.inf
    arrived: bool = False

    def asked(self, question: Callable[[], None]) -> bool:
        """Whether the navigator answered; if not, `error` says why. The room's own faults are not caught."""
        try:
            question()
        except Exception as error:
            self.error = _words(error)
        return not self.error

    def decide(self, navigator: Navigator, observation: Observation) -> None:
        began = time.perf_counter()
        command = navigator.step(observation)
        self.seconds.append(time.perf_counter() - began)
        self.error = _malformed(command)
        if not self.error:
            self.commands.append(command)

    def show(self, navigator: Navigator) -> None:
        self.shown = _diagnostics_fault(navigator)


def _drive(navigator: Navigator, robot: Robot, needs: frozenset[Need], situation: Situation) -> _Run:
    run, room = _Run(situation), Room(situation, robot, needs)
    task = practice_room.task(situation, robot, needs, bool(getattr(navigator, "privileged", False)))
    if run.asked(lambda: navigator.reset(task, robot, np.random.default_rng(_SEED))):
        for k, observation in enumerate(room.observations()):
            before = copy.deepcopy(observation)
            if not run.asked(partial(run.decide, navigator, observation)):
                break
            run.touched = run.touched or _changed(before, observation)
            command = run.commands[-1]
            if _not_finite(command) or command.gave_up is not None:
                break
            if k % _DIAGNOSTICS_EVERY == 0 and not run.shown:
                run.asked(partial(run.show, navigator))
            room.obey(command)
    run.distance, run.arrived = room.distance(), room.arrived
    return run


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
    top = min(practice_room.SPEED, d.v_max)
    if not d.v_min - SLACK <= c.v <= top + SLACK:
        return f"v = {c.v:.4g} m/s; the robot and the set speed allow {d.v_min:g} to {top:g}"
    if abs(c.omega) > d.omega_max + SLACK:
        return f"omega = {c.omega:.4g} rad/s; the robot allows {d.omega_max:g}"
    return ""


def _first_fault(name: str, runs: list[_Run], fault: Callable[[Command], str]) -> Finding:
    for run in runs:
        for k, command in enumerate(run.commands):
            if found := fault(command):
                return Finding(name, False, f"{found} (in '{run.situation.name}', decision {k})")
    return Finding(name, True)


def _deterministic(runs: list[_Run], repeats: list[_Run]) -> Finding:
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


def _arrives(run: _Run) -> Finding:
    detail = f"ended {run.distance:.2f} m from a goal 2.5 m ahead after {len(run.commands)} decisions"
    return Finding("reaches a goal in the open", run.arrived, detail)


def _pace(runs: list[_Run], robot: Robot) -> Finding:
    name = "keeps up with its control period"
    seconds = np.array([s for r in runs for s in r.seconds])
    if not len(seconds):
        return Finding(name, False, "it never decided")
    median, late = np.quantile(seconds, (0.5, 0.99))
    detail = f"median {1e3 * median:.3g} ms, 99 % within {1e3 * late:.3g} ms; the period is {1e3 * robot.period:g} ms"
    return Finding(name, bool(median <= robot.period), detail)


def _diagnostics_fault(navigator: Navigator) -> str:
    ask = getattr(navigator, "diagnostics", None)
    if ask is None:
        return ""
    shown = ask()
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


def _join(texts: Any) -> str:
    return next((text for text in texts if text), "")


def _words(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())}{place}"

"""Composes a localiser, a tracker and a navigator into the pilot that the world talks to."""

from __future__ import annotations

import bdb
import signal
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, replace
from types import FrameType
from typing import Any, TypeVar

import numpy as np
from numba.core import event

from clearway.campaigns.heartbeat import HEARTBEAT
from clearway.campaigns.plain import MOST_SHOWN, plain_command, plain_diagnostics
from clearway.campaigns.surroundings import round_as_ever
from clearway.contract import (
    Command,
    Decision,
    Diagnostics,
    Localiser,
    Navigator,
    Observation,
    Obstacles,
    Sensing,
    Task,
    Tracker,
)
from clearway.errors import ClearwayError
from clearway.foreign import said
from clearway.geometry.read_only import read_only_view
from clearway.registry import in_a_line
from clearway.robots import Robot

SHOW_EVERY = 0.5
"""s of simulated time between two looks at a navigator's diagnostics."""

DECISION_LIMIT = 10.0
"""s of wall clock after which a decision counts as hung."""


_T = TypeVar("_T")
_OBSTACLES = fields(Obstacles)


def prepare_limit(decision_limit: float | None) -> float | None:
    """How long a navigator may take to be made and to prepare for a trial, s of wall clock; None: as long as it likes."""
    return None if decision_limit is None else max(6.0 * decision_limit, 20.0)


class TookTooLong(Exception):
    """A navigator or localiser did not answer within the hard limit."""


class _Alarm(BaseException):
    """Raised by the timer inside the navigator; not an `Exception`, so that the navigator's own handlers let it pass."""


def compose(
    navigator: Navigator,
    localiser: Localiser,
    *,
    tracker: Tracker | None = None,
    decision_limit: float | None = DECISION_LIMIT,
) -> Composed:
    """A pilot of a navigator, a localiser and a tracker.

    Args:
        navigator: Who decides; it gets what its `needs` asks for (the map, scans, obstacles) and nothing else.
        localiser: What gives the pose that the navigator believes in.
        tracker: What gives the obstacles of a navigator that needs them; not asked for one that doesn't.
        decision_limit: Wall clock after which a decision is broken off with `TookTooLong`, s; None: never. It works in
            the main thread of a process, where signals arrive, and can't stop code that never comes back to Python.

    Raises:
        ClearwayError: the navigator needs obstacles, and there is no tracker.
    """
    return Composed(navigator, localiser, tracker, decision_limit)


class Composed:
    """A localiser, a tracker and a navigator as one `Pilot`; arguments as for `compose`."""

    def __init__(
        self,
        navigator: Navigator,
        localiser: Localiser,
        tracker: Tracker | None,
        decision_limit: float | None,
    ) -> None:
        self._navigator, self._localiser = navigator, localiser
        self._limit = decision_limit
        self._prepare_limit = prepare_limit(decision_limit)
        self._watch = _Watchdog()
        needs = frozenset(getattr(navigator, "needs", frozenset()))
        self._map, self._scan = "map" in needs, "scan" in needs
        self._shows_scan = self._scan or "scan" in getattr(navigator, "wants", frozenset())
        self._tracker = tracker if "obstacles" in needs else None
        if "obstacles" in needs and tracker is None:
            raise ClearwayError("the navigator needs obstacles with position and velocity, which takes a tracker")
        self._diagnostics = getattr(navigator, "diagnostics", None)
        self._shown, self._room = -np.inf, MOST_SHOWN

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Prepare all three for a new trial, each with a random stream of its own."""
        self._shown, self._room = -np.inf, MOST_SHOWN
        key = [int(k) for k in rng.integers(0, 2**63, size=2)]  # one draw, so that no stream moves another
        self._localiser.reset(task, robot, _stream(key, "localiser"))
        if self._tracker is not None:
            self._tracker.reset(task, robot, _stream(key, "tracker"))
        self._watch(
            self._prepare_limit,
            "to prepare",
            self._navigator.reset,
            _told(task, self._map),
            robot.model_copy(deep=True),  # tables of it can be written
            _stream(key, "navigator"),
        )

    def decide(self, sensing: Sensing) -> Decision:
        """Localise, look for obstacles, then ask the navigator; now and then also what it thought."""
        observation = self.observe(sensing)
        pose = observation.pose.copy()
        try:
            command = self._watch(self._limit, "for a decision", self._command, observation)
        except Exception as error:
            if writes_into_input(error):
                raise ValueError(
                    f"it writes into what it is given, which it has to copy first: {in_a_line(error)}"
                ) from error
            raise
        return Decision(command, pose, self._show(sensing.t))

    def observe(self, sensing: Sensing) -> Observation:
        """What the navigator is told of one period's sensing: localised, with the obstacles that it needs.

        Raises:
            ClearwayError: it needs scans, and there is none.
        """
        if self._scan and sensing.scan is None:
            raise ClearwayError("the navigator needs scans, but the robot has no lidar")
        pose = self._localiser.update(sensing)
        scan = sensing.scan if self._shows_scan else None
        obstacles = None if self._tracker is None else self._tracker.update(sensing, pose)
        return Observation(
            t=sensing.t,
            pose=read_only_view(pose),
            velocity=read_only_view(sensing.odom_velocity),
            odom_pose=read_only_view(sensing.odom_pose),
            goal=sensing.goal,
            scan=None if scan is None else replace(scan, ranges=read_only_view(scan.ranges)),
            obstacles=None if obstacles is None else _seen(obstacles),
        )

    def _command(self, observation: Observation) -> Command:
        return plain_command(self._navigator.step(observation))

    def _show(self, t: float) -> Diagnostics | None:
        if self._diagnostics is None or t < self._shown + SHOW_EVERY - 1e-9:
            return None
        self._shown = t
        return self._watch(self._limit, "to show its thinking", self._drawn, self._diagnostics)

    def _drawn(self, diagnostics: Callable[[], object]) -> Diagnostics:
        found, size = plain_diagnostics(diagnostics(), self._room)
        self._room -= size
        return found


def writes_into_input(error: Exception) -> bool:
    """Whether `error` came of writing into an array that can't be written: NumPy's words, and Numba's."""
    return "read-only" in str(error) or "readonly array" in str(error)


def _told(task: Task, with_map: bool) -> Task:
    """What a navigator gets of a task: frozen values, and its own, as who gets round that must not change the world's."""
    return replace(
        task,
        map=replace(task.map) if with_map and task.map is not None else None,
        budget=replace(task.budget),
        latency=replace(task.latency),
    )


def _seen(o: Obstacles) -> Obstacles:
    return Obstacles(*(read_only_view(getattr(o, f.name)) for f in _OBSTACLES))


def _stream(key: list[int], name: str) -> np.random.Generator:
    return np.random.default_rng([*key, *name.encode()])


class _Watchdog:
    """Breaks a navigator's code off after some wall clock, where signals can do it. Compiling kernels doesn't count.

    Its handler stays installed between decisions: to change it costs more than the timer.
    """

    def __init__(self) -> None:
        self._seconds = self._began = self._compiled = 0.0
        self._within = False  # whether the code that it watches is running
        self._late = False  # whether it has rung in vain

    def __call__(self, seconds: float | None, what: str, function: Callable[..., _T], *arguments: Any) -> _T:
        """What `function` returns.

        Raises:
            TookTooLong: after `seconds`; None: never.
            RuntimeError: it asked Python to exit, or raised what is no `Exception`; each is a failure like another.
            KeyboardInterrupt: somebody has pressed Ctrl-C or, without a limit, left the debugger, which is no failure of
                the navigator.
        """
        watched = seconds is not None and threading.current_thread() is threading.main_thread()
        try:
            try:
                self._within, self._late = watched, False
                if watched:
                    assert seconds is not None
                    self._seconds, self._began, self._compiled = seconds, time.monotonic(), _compiling.seconds()
                    if signal.getsignal(signal.SIGALRM) != self._ring:
                        signal.signal(signal.SIGALRM, self._ring)
                    signal.setitimer(signal.ITIMER_REAL, seconds)
                HEARTBEAT.begin(seconds)
                answer = function(*arguments)
                if self._late:
                    raise _Alarm
                return answer
            finally:
                self._within = False  # first of all: no alarm comes between the end of that and this
        except _Alarm as alarm:
            notes = "".join(getattr(alarm, "__notes__", ()))  # of code that was broken off and knew more
            raise TookTooLong(f"took longer than {seconds:g} s {what}{notes}") from None
        except (bdb.BdbQuit, SystemExit) as error:
            if seconds is None and _left_debugger(error):
                raise KeyboardInterrupt from error
            if isinstance(error, bdb.BdbQuit):
                raise
            raise RuntimeError(f"the navigator called sys.exit({error.code!r:.100})") from error
        except KeyboardInterrupt as error:
            if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
                raise
            raise RuntimeError("the navigator raised KeyboardInterrupt") from error  # nobody's Ctrl-C comes here
        except Exception:
            raise
        except BaseException as error:
            raise RuntimeError(f"the navigator raised {said(error)}, which is no Exception") from error
        finally:
            HEARTBEAT.end()
            round_as_ever()
            if watched:
                signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _ring(self, signum: int, frame: FrameType | None) -> None:
        if not self._within:
            return
        taken = time.monotonic() - self._began - (_compiling.seconds() - self._compiled)
        self._late = taken > 0.99 * self._seconds and not _compiling.running
        later = self._late and _boxing(frame)
        # again in any case: what is raised within a destructor or a weak reference's callback is dropped by Python
        signal.setitimer(signal.ITIMER_REAL, 1e-3 if later else max(self._seconds - taken, 0.05))
        if self._late and not later:
            raise _Alarm


def _boxing(frame: FrameType | None) -> bool:
    """Whether a kernel is making Python's objects of what it answers. Whatever is raised there Numba doesn't look at: the process
    crashes, or Python makes a `SystemError` of it."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(("numba.", "namedtuple_")):
            return True
        frame = frame.f_back
    return False


def guarded(limit: float | None, what: str, function: Callable[..., _T], *arguments: Any) -> _T:
    """What `function` returns, which is a navigator's own; whatever it raises is an `Exception`, as `compose` has it.

    Args:
        limit: Wall clock after which it is broken off, s; None: never.
        what: What it is given time for, such as `for a decision`.
        function: It.
        arguments: Its arguments.

    Raises:
        TookTooLong: after `limit`.
    """
    return _Watchdog()(limit, what, function, *arguments)


def dismiss(navigator: object, decision_limit: float | None) -> None:
    """Let a navigator go that is needed no more: its `close()`, if it has one. What goes wrong there changes nothing.

    Args:
        navigator: It.
        decision_limit: As for `compose`.
    """
    with suppress(Exception):
        close = getattr(navigator, "close", None)
        if callable(close):
            guarded(prepare_limit(decision_limit), "to close", close)


def _left_debugger(error: BaseException) -> bool:
    """Whether the error came of the debugger's `quit`: which error that is depends on the version of Python."""
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    return isinstance(error, bdb.BdbQuit) or frame.f_globals.get("__name__") == "pdb"


class _Compiling(event.Listener):  # type: ignore[misc]
    """Notices Numba's compilations in this process: how many are running, each within another, and how long all took."""

    def __init__(self) -> None:
        self.running, self._taken, self._since = 0, 0.0, 0.0
        event.register("numba:compile", self)  # type: ignore[no-untyped-call]

    def seconds(self) -> float:
        """How long all have taken, those that are running too, s."""
        return self._taken + (time.monotonic() - self._since if self.running else 0.0)

    def on_start(self, event: event.Event) -> None:
        if not self.running:
            self._since = time.monotonic()
            HEARTBEAT.compile(True)
        self.running += 1

    def on_end(self, event: event.Event) -> None:
        if self.running == 1:
            self._taken = self.seconds()
            HEARTBEAT.compile(False)
        self.running -= 1


_compiling = _Compiling()

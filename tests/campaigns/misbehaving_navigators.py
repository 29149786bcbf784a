"""Navigators that misbehave, each in one way: in their words, by what they raise, by crashing, by never coming back.

`CLASSES` has them all, kind by kind. Whatever one does, its trial is a failed one (or goes on, where it does no harm), and
the campaign goes on; `benchmarks/faults.py --only navigators` runs each.
"""

from __future__ import annotations

import asyncio
import bdb
import contextlib
import ctypes
import fractions
import gc
import io
import itertools
import math
import os
import pickle
import platform
import re
import resource
import signal
import stat
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np

from clearway.contract import Command, Diagnostics, Observation, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.robots import Robot

CLASSES: dict[str, dict[str, type]] = {}
"""Kind -> name -> class."""

LATER = 0.45
"""s of simulated time after which most of them begin."""


class Drives:
    """Turns to the goal and drives there, like anybody."""

    needs: Any = frozenset({"scan"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.v_max = min(task.speed_limit, robot.drive.v_max)

    def step(self, o: Observation) -> Command:
        dx, dy = o.goal.pose[:2] - o.pose[:2]
        near = math.hypot(dx, dy) < 0.5 * o.goal.xy_tolerance
        error = math.remainder((o.goal.pose[2] if near else math.atan2(dy, dx)) - o.pose[2], math.tau)
        v = 0.0 if near else max(0.0, math.cos(error)) * min(self.v_max, math.hypot(dx, dy))
        return Command(v, max(-1.0, min(1.0, 2 * error)))


def _known(kind: str, name: str, body: dict[str, Any]) -> None:
    made = type(name, (Drives,), body | {"__module__": __name__})
    CLASSES.setdefault(kind, {})[name] = made
    globals()[name] = made


def answers(name: str, answer: Callable[[], Any], kind: str = "answers") -> None:
    """One that answers so, after a while; what `answer` raises, it raises."""

    def step(self: Any, o: Observation) -> Any:
        return Drives.step(self, o) if o.t < LATER else answer()

    _known(kind, name, {"step": step})


def says(name: str, **words: Any) -> None:
    """One that drives, and says this with each command."""

    def step(self: Any, o: Observation) -> Command:
        c = Drives.step(self, o)
        return c if o.t < LATER else Command(**({"v": c.v, "omega": c.omega} | words))

    _known("words", name, {"step": step})


def shows(name: str, diagnostics: Callable[[], Any]) -> None:
    """One that drives, and shows this of its thinking."""
    _known("diagnostics", name, {"diagnostics": lambda self: diagnostics()})


def does(kind: str, name: str, deed: Callable[[], Any], where: str = "step") -> None:
    """One that does this in its `step`, or where it says, and goes on as if nothing were."""
    if where == "step":

        def step(self: Any, o: Observation) -> Command:
            if o.t >= LATER:
                deed()
            return Drives.step(self, o)

        _known(kind, name, {"step": step})
    else:

        def other(self: Any, *arguments: Any) -> Any:
            deed()
            return Drives.reset(self, *arguments) if where == "reset" else Diagnostics()

        _known(kind, name, {where: (lambda self: other(self) and None) if where == "__init__" else other})


def raises(error: BaseException | type[BaseException]) -> Any:
    raise error


class Own(BaseException):
    """Not an Exception."""


class Mute(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no words")


class Leaves(Exception):
    def __str__(self) -> str:
        raise SystemExit(0)


class BadText(str):
    def encode(self, *_: Any, **__: Any) -> bytes:
        raise RuntimeError("cannot be encoded")

    def __str__(self) -> str:
        raise RuntimeError("cannot be said")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("cannot be compared")

    __ne__, __hash__ = __eq__, str.__hash__


class BadNumber(float):
    def __float__(self) -> float:
        raise RuntimeError("not a number after all")


class LazyCommand(Command):
    """Whose speed is never found."""

    def __getattribute__(self, name: str) -> Any:
        while name == "v":
            time.sleep(0.01)
        return super().__getattribute__(name)


class RaisingCommand(Command):
    def __getattribute__(self, name: str) -> Any:
        if name == "omega":
            raise Own
        return super().__getattribute__(name)


class Uncomparable:
    def __ne__(self, other: object) -> bool:
        raise Own

    def __str__(self) -> str:
        raise Own


# --- words -----------------------------------------------------------------------------------------------------------

LONG = "x" * 10_000_000
says("ArrivedText", arrived="yes")
says("ArrivedArray", arrived=np.array([True, False]))
says("GaveUpNumber", gave_up=3)
says("GaveUpBytes", gave_up=b"lost")
says("GaveUpSurrogate", gave_up="lost \udcff \ud800")
says("GaveUpLong", gave_up=LONG)
says("GaveUpEmpty", gave_up="")
says("GaveUpControls", gave_up="a\x00b\x1b[31mc\r\n")
says("GaveUpMarkup", gave_up="</script><script>alert(1)</script>")
says("GaveUpBadText", gave_up=BadText("x"))
says("StatusNumber", status=1)
says("StatusNone", status=None)
says("StatusList", status=["a"])
says("StatusSurrogate", status="\udc80")
says("StatusLong", status=LONG)
says("StatusBadText", status=BadText("x"))
says("StatusUncomparable", status=Uncomparable())
says("ViolatedNone", violated=None)
says("ViolatedText", violated="abc")
says("ViolatedNumbers", violated=(1, 2))
says("ViolatedSurrogate", violated=("\udcff",))
says("ViolatedMany", violated=("x",) * 1_000_000)
says("ViolatedEndless", violated=itertools.repeat("x"))
says("CutText", cut="no")
says("CutArray", cut=np.array([True, False]))


def _arrives(self: Any, o: Observation) -> Command:
    return Command(0.0, 0.0, arrived=True)


_known("words", "ArrivedAtOnce", {"step": _arrives})

# --- answers ---------------------------------------------------------------------------------------------------------

answers("AnswersNone", lambda: None)
answers("AnswersTuple", lambda: (0.1, 0.0))
answers("AnswersClass", lambda: Command)
answers("AnswersUnmade", lambda: object.__new__(Command))
answers("AnswersLazily", lambda: LazyCommand(0.1, 0.0))
answers("AnswersRaising", lambda: RaisingCommand(0.1, 0.0))
answers("AnswersAlike", lambda: SimpleNamespace(v=0.1, omega=0.0))
for word, number in {
    "Nan": math.nan, "Inf": math.inf, "MinusInf": -math.inf, "Text": "fast", "Array": np.array([0.1, 0.2]), "Empty": np.zeros(0),
    "Complex": 1j, "None_": None, "Huge": 1e308, "BigInteger": 10**400, "Fraction": fractions.Fraction(1, 10), "Bool": True,
    "Bad": BadNumber(0.1), "Single": np.float32(0.1), "Object": np.array(None),
}.items():  # fmt: skip
    answers(f"Speed{word}", lambda number=number: Command(number, 0.0))  # type: ignore[misc]
    if word in ("Nan", "Text", "Huge"):
        answers(f"Turn{word}", lambda number=number: Command(0.0, number))  # type: ignore[misc]


async def _soon() -> Command:
    return Command(0.1, 0.0)


def _by_and_by() -> Any:
    yield Command(0.1, 0.0)


answers("AnswersCoroutine", _soon)
answers("AnswersGenerator", _by_and_by)

# --- what it raises --------------------------------------------------------------------------------------------------


def _deeper(n: int = 0) -> int:
    return 1 + _deeper(n + 1)


for word, error in {
    "Exception": RuntimeError("lost"), "Own": Own("mine"), "SystemExit": SystemExit(0), "SystemExitText": SystemExit("bye"),
    "KeyboardInterrupt": KeyboardInterrupt(), "GeneratorExit": GeneratorExit(), "StopIteration": StopIteration(1),
    "Cancelled": asyncio.CancelledError(), "Memory": MemoryError(), "BdbQuit": bdb.BdbQuit(), "Mute": Mute(), "Leaves": Leaves(),
    "Surrogate": ValueError("lost \udcff"), "Control": ValueError("a\x00b\x1bc"), "Long": ValueError(LONG),
    "Group": BaseExceptionGroup("several", [Own(), ValueError(1)]), "Clearway": ClearwayError("my own", file="x"),
    "BrokenPipe": BrokenPipeError(32, "gone"), "EndOfFile": EOFError(), "Number": ValueError(np.zeros(5)),
}.items():  # fmt: skip
    answers(f"Raises{word}", lambda error=error: raises(error), "raises")  # type: ignore[misc]
answers("RaisesEndlessly", _deeper, "raises")
for place in ("reset", "diagnostics"):
    for word, error in {"Exception": RuntimeError("lost"), "SystemExit": SystemExit(0), "Own": Own()}.items():
        does("raises", f"Raises{word}In{place.title()}", lambda error=error: raises(error), place)  # type: ignore[misc]
does("raises", "RaisesClearwayInReset", lambda: raises(ClearwayError("my own")), "reset")

# --- diagnostics -----------------------------------------------------------------------------------------------------

POINTS = np.zeros((3, 2))
shows("ShowsNone", lambda: None)
shows("ShowsDict", dict)
shows("ShowsSurrogates", lambda: Diagnostics({"\udcff": POINTS}, status="\udcff"))
shows("ShowsWrongShape", lambda: Diagnostics({"a": np.zeros((3, 5))}))
shows("ShowsRagged", lambda: Diagnostics({"a": [[1.0], [1.0, 2.0]]}))  # type: ignore[dict-item]
shows("ShowsObjects", lambda: Diagnostics({"a": np.array([[None, {}]])}))
shows("ShowsComplex", lambda: Diagnostics({"a": np.array([[1j, 2]])}))
shows("ShowsWords", lambda: Diagnostics({"a": np.array([["x", "y"]])}))
shows("ShowsNan", lambda: Diagnostics({"a": np.full((3, 2), np.nan)}, tube=np.full((2, 3), np.inf)))
shows("ShowsHuge", lambda: Diagnostics({"a": np.full((3, 2), 1e308)}, iterations=-1))
shows("ShowsMuch", lambda: Diagnostics({"a": np.zeros((20_000_000, 2))}))
shows("ShowsMany", lambda: Diagnostics({str(i): POINTS for i in range(200_000)}))
shows("ShowsEmpty", lambda: Diagnostics({"a": np.zeros((0, 2))}, tree=np.zeros((0, 4))))
shows("ShowsNoMapping", lambda: Diagnostics(circles=[POINTS]))  # type: ignore[arg-type]
shows("ShowsStatusNone", lambda: Diagnostics(status=None))  # type: ignore[arg-type]
shows("ShowsStatusBad", lambda: Diagnostics(status=BadText("x")))
shows("ShowsIterationsNan", lambda: Diagnostics(iterations=math.nan))  # type: ignore[arg-type]
shows("ShowsIterationsMany", lambda: Diagnostics(iterations=10**30))
shows("ShowsIterationsText", lambda: Diagnostics(iterations="x"))  # type: ignore[arg-type]
shows("ShowsFieldText", lambda: Diagnostics(field="x"))  # type: ignore[arg-type]
shows("ShowsFieldLine", lambda: Diagnostics(field=SimpleNamespace(data=np.zeros(4), resolution=1, origin=(0, 0))))  # type: ignore[arg-type]
shows(
    "ShowsFieldWithoutScale",
    lambda: Diagnostics(field=OccupancyGrid(np.zeros((2, 2), np.int8), math.nan, (math.inf, 0.0))),
)
shows(
    "ShowsFieldLarge", lambda: Diagnostics(field=OccupancyGrid(np.zeros((20_000, 20_000), np.int8), 0.05, (0.0, 0.0)))
)
shows("ShowsByKeyboard", lambda: raises(KeyboardInterrupt()))
_known("diagnostics", "ShowsNotCallable", {"diagnostics": 3})

# --- crashes ---------------------------------------------------------------------------------------------------------


def _signal(number: int) -> Callable[[], None]:
    return lambda: os.kill(os.getpid(), number)


def _apart() -> None:
    threading.Thread(target=os._exit, args=(0,)).start()
    time.sleep(5.0)


_done: set[tuple[int, object]] = set()


def once(deed: Callable[[], Any]) -> Callable[[], None]:
    """The deed, once in a process, and in none that it makes of itself."""

    def done() -> None:
        if (os.getpid(), deed) not in _done:
            _done.add((os.getpid(), deed))
            deed()
            _done.add((os.getpid(), deed))

    return done


def _into_sockets(content: bytes) -> None:
    """Write it into whatever this process talks to others by."""
    for fd in range(3, 256):
        with contextlib.suppress(OSError):
            if stat.S_ISSOCK(os.fstat(fd).st_mode):
                os.write(fd, content)


def _in_its_stead() -> None:
    answer = pickle.dumps(("done", 7, False))
    _into_sockets(len(answer).to_bytes(4, "big") + answer)


CRASHES: dict[str, Callable[[], Any]] = {
    "WritesIntoSockets": lambda: _into_sockets(b"x" * 1000),
    "AnswersInItsStead": _in_its_stead,
    "SegmentationFault": lambda: ctypes.string_at(0),
    "ExitsQuietly": lambda: os._exit(0),
    "ExitsLoudly": lambda: os._exit(7),
    "Aborts": os.abort,
    "KillsItself": _signal(signal.SIGKILL),
    "TerminatesItself": _signal(signal.SIGTERM),
    "InterruptsItself": _signal(signal.SIGINT),
    "HangsItselfUp": _signal(signal.SIGHUP),
    "RingsTheAlarm": _signal(signal.SIGALRM),
    "BusError": _signal(signal.SIGBUS),
    "FloatingPointError": _signal(signal.SIGFPE),
    "ExitsInAThread": _apart,
    "ClosesAllFiles": lambda: os.closerange(0, 4096),
    "Forks": once(os.fork),
}
for word, deed in CRASHES.items():
    does("crashes", word, deed)
does("crashes", "SegmentationFaultInReset", CRASHES["SegmentationFault"], "reset")
does("crashes", "ExitsQuietlyInReset", CRASHES["ExitsQuietly"], "reset")
does("crashes", "ExitsQuietlyInDiagnostics", CRASHES["ExitsQuietly"], "diagnostics")

# --- hangs -----------------------------------------------------------------------------------------------------------


def _for_ever() -> None:
    while True:
        pass


def _deaf() -> None:
    while True:
        try:
            while True:
                time.sleep(0.01)
        except:  # noqa: E722
            pass


def _ignoring() -> None:
    signal.signal(signal.SIGALRM, signal.SIG_IGN)
    _for_ever()


def _without_timer() -> None:
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    _for_ever()


def _blocking() -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
    _for_ever()


def _deadlock() -> None:
    lock = threading.Lock()
    lock.acquire()
    lock.acquire()


@numba.njit
def _spin(x: float) -> float:  # pragma: no cover
    while x > 0.0:
        x = x + 1.0 if x < 1e6 else 1.0
    return x


def _in_c() -> None:
    sum(itertools.repeat(0))


def _compiling() -> None:
    while True:
        numba.njit(lambda x: x + 1)(1)


HANGS: dict[str, Callable[[], Any]] = {
    "LoopsForEver": _for_ever,
    "LoopsDeaf": _deaf,
    "LoopsIgnoringTheAlarm": _ignoring,
    "LoopsWithoutTimer": _without_timer,
    "LoopsBlockingTheAlarm": _blocking,
    "LoopsCompiled": lambda: _spin(1.0),
    "LoopsInC": _in_c,
    "LoopsInAPattern": lambda: re.match(r"(x+x+)+y", "x" * 40),
    "Sleeps": lambda: time.sleep(1e6),
    "Deadlocks": _deadlock,
    "StopsItself": _signal(signal.SIGSTOP),
    "WaitsForInput": lambda: os.read(os.pipe()[0], 1),
    "CompilesForEver": _compiling,
}
for word, deed in HANGS.items():
    does("hangs", word, deed)
does("hangs", "LoopsDeafInReset", _deaf, "reset")
does("hangs", "LoopsCompiledInReset", lambda: _spin(1.0), "reset")
does("hangs", "LoopsInDiagnostics", _for_ever, "diagnostics")
does("hangs", "LoopsCompiledInDiagnostics", lambda: _spin(1.0), "diagnostics")

# --- what it leaves behind -------------------------------------------------------------------------------------------


def _no_output() -> None:
    sys.stdout = sys.stderr = None  # type: ignore[assignment]


def _replaced_output() -> None:
    sys.stdout = io.StringIO()
    sys.stdout.close()


def _no_files() -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (4, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))


def _small_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def _little_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (1 << 20, resource.getrlimit(resource.RLIMIT_AS)[1]))


def rounds_up() -> None:
    """Floating-point numbers, from now on."""
    ctypes.CDLL(None).fesetround(0x400000 if platform.machine() in ("aarch64", "arm64") else 0x800)


def _no_open() -> None:
    import builtins

    builtins.open = None  # type: ignore[assignment]


def _no_json() -> None:
    import json

    json.dumps = None  # type: ignore[assignment]


LEFT: dict[str, Callable[[], Any]] = {
    "PrintsMuch": lambda: print("x" * 10_000),
    "PrintsBelow": lambda: os.write(1, b"{not json\n"),
    "ClosesOutput": lambda: os.close(1),
    "TakesOutputAway": _no_output,
    "ReplacesOutput": _replaced_output,
    "ChangesFolder": lambda: os.chdir("/"),
    "RaisesOnRounding": lambda: np.seterr(all="raise"),
    "RaisesOnWarnings": lambda: warnings.simplefilter("error"),
    "LimitsRecursion": lambda: sys.setrecursionlimit(120),
    "LimitsFiles": _no_files,
    "LimitsTheirSize": _small_files,
    "LimitsMemory": _little_memory,
    "RoundsUp": rounds_up,
    "RingsLater": lambda: signal.setitimer(signal.ITIMER_PROF, 1.0),
    "Profiles": lambda: sys.setprofile(lambda *_: raises(Own())),
    "MasksPermissions": lambda: os.umask(0o777),
    "ClearsEnvironment": os.environ.clear,
    "ClearsPath": sys.path.clear,
    "SpinsInAThread": once(lambda: threading.Thread(target=_for_ever, daemon=True).start()),
    "WaitsInAThread": once(lambda: threading.Thread(target=time.sleep, args=(1e6,)).start()),
    "LeavesAProcess": once(lambda: subprocess.Popen(["sleep", "1000"])),
    "StopsCollecting": gc.disable,
    "TakesOpenAway": _no_open,
    "TakesJsonAway": _no_json,
    "Traces": lambda: sys.settrace(lambda *_: raises(Own())),
}
for word, deed in LEFT.items():
    does("leaves behind", word, deed)


def _lingers(self: Any) -> None:
    while True:
        pass


_known("hangs", "LoopsWhenDropped", {"__del__": _lingers})
_known("raises", "RaisesWhenDropped", {"__del__": lambda self: raises(SystemExit(0))})

# --- its own parts ---------------------------------------------------------------------------------------------------


def _raising(error: BaseException) -> Any:
    return property(lambda self: raises(error))


def _second(self: Any) -> None:
    """Can be made a few times only."""
    type(self).made = getattr(type(self), "made", 0) + 1
    if type(self).made > 1:
        raise RuntimeError("once is enough")


PARTS: dict[str, dict[str, Any]] = {
    "NeedsNone": {"needs": None},
    "NeedsNumber": {"needs": 3},
    "NeedsText": {"needs": "scan"},
    "NeedsUnhashable": {"needs": [["scan"]]},
    "NeedsUnknown": {"needs": frozenset({"gps"})},
    "NeedsRaises": {"needs": _raising(RuntimeError("no needs"))},
    "NeedsExits": {"needs": _raising(SystemExit(0))},
    "PrivilegedArray": {"privileged": np.array([True, False])},
    "PrivilegedText": {"privileged": "no"},
    "NoStep": {"step": None},
    "StepWithoutArguments": {"step": lambda self: Command(0.0, 0.0)},
    "ResetWithoutArguments": {"reset": lambda self: None},
    "InitRaises": {"__init__": lambda self: raises(RuntimeError("no"))},
    "InitExits": {"__init__": lambda self: raises(SystemExit(0))},
    "InitRaisesOwn": {"__init__": lambda self: raises(Own())},
    "InitOnce": {"__init__": _second},
    "InitExitsQuietly": {"__init__": lambda self: os._exit(0)},
    "InitCrashes": {"__init__": lambda self: ctypes.string_at(0)},
    "InitHangs": {"__init__": lambda self: _deaf()},
    "InitPrints": {"__init__": lambda self: print("hello")},
    "ParametersRaise": {"read_parameters": lambda self, robot: raises(RuntimeError("no"))},
    "ParametersExit": {"read_parameters": lambda self, robot: raises(SystemExit(0))},
    "ParametersOwn": {"read_parameters": lambda self, robot: raises(Own())},
    "ParametersExitQuietly": {"read_parameters": lambda self, robot: os._exit(0)},
    "ParametersCrash": {"read_parameters": lambda self, robot: ctypes.string_at(0)},
    "ParametersNotCallable": {"read_parameters": 3},
}
for word, parts in PARTS.items():
    _known("parts", word, parts)

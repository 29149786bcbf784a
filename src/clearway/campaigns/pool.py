"""Runs calls in worker processes, goes on when one of them crashes or hangs, and leaves none running when all is over.

A worker has one call at a time, so that it is known with which one it died: such a call is tried once more, last of all and
in another worker, since a worker may have been killed for what its neighbours did. One that hangs is not tried again.
"""

from __future__ import annotations

import atexit
import json
import os
import pickle
import re
import secrets
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar

from clearway.campaigns.heartbeat import Pulse
from clearway.campaigns.surroundings import Setting
from clearway.errors import ClearwayError, shown
from clearway.given import packed

T = TypeVar("T")

_LOOK = 0.2
"""s between two looks at the workers' heartbeats."""
_DEATHS = 2
"""How often workers may die with a call."""
_FALSE_STARTS = 3
"""How many workers in a row may end before they take a call."""
_LONGEST = 64 << 20
"""Bytes of an answer."""
_HALF = struct.pack("ll", 5, 0)
"""How long the rest of an answer may take that has begun to come: a timeval, s and us."""


@dataclass(frozen=True, slots=True)
class Fate:
    """What became of a call that no worker could complete.

    Attributes:
        reason: In a few words.
        place: Where the code was, line by line; empty where nobody knows.
    """

    reason: str
    place: str = ""

    def __str__(self) -> str:
        """In one line, with the innermost place in the user's own code."""
        lines = [line.strip() for line in self.place.splitlines()]
        own = [line for line in lines if not any(f'"{folder}' in line for folder in (sys.prefix, sys.base_prefix))]
        return ", ".join([self.reason, *(own or lines)[-1:]])


class Pool:
    """Runs calls in worker processes; made by `pool`.

    Args:
        workers: How many processes; 0: every call is made in this process.
        out: The results directory, which the error names if workers die.
        folder: The current directory of calls; None: this process's.

    Attributes:
        workers: How many processes there may be.
    """

    def __init__(self, workers: int, out: Path, folder: str | None = None) -> None:
        self.workers, self._out, self._folder = workers, out, folder
        self._running: Generator[Any] | None = None

    def each(
        self,
        function: Callable[..., T],
        calls: Iterable[tuple[Any, ...]],
        *,
        patience: float | None = None,
        fallen: Callable[..., T] | None = None,
    ) -> Iterator[T]:
        """What the function returns for each tuple of arguments, in the order in which the calls end.

        Args:
            function: What is called, by a name that a worker can import.
            calls: The arguments of each call.
            patience: How long a call may take between two heartbeats, s of wall clock; None: as long as it likes.
            fallen: What is called, with the `Fate` and the arguments and in a worker again, in place of a call that no
                worker could complete; None: that is an error.

        Raises:
            ClearwayError: a call raised it; or no worker could complete one, or can be started.
        """
        asked = (_Call(function, arguments) for arguments in calls)
        setting = Setting.present(packed())
        if self._folder is not None:
            setting = replace(setting, folder=self._folder)
        if self.workers < 1:
            self._running = _here(asked)
        else:
            self._running = _there(asked, self.workers, patience, fallen, self._out, setting)
        return self._running

    def close(self) -> None:
        """Make no further calls, and end the workers that are in the middle of one."""
        if self._running is not None:
            self._running.close()


@contextmanager
def pool(workers: int, out: Path) -> Iterator[Pool]:
    """A pool for the block under `with`; an error in the block ends the workers that are in the middle of a call.

    Idle ones stay for the next pool, and end with this process.
    """
    made = Pool(workers, out)
    try:
        yield made
    except BaseException:
        made.close()
        raise


def workers_of(asked: int | None, least: int = 1) -> int:
    """How many processes there are to be: as asked, or one a core.

    Raises:
        ClearwayError: fewer than `least` are asked for.
    """
    if asked is not None and (isinstance(asked, bool) or not isinstance(asked, Integral) or asked < least):
        raise ClearwayError(f"{shown(asked)} is wrong: a whole number, at least {least}", field="workers")
    return (os.cpu_count() or 1) if asked is None else int(asked)


@dataclass(slots=True)
class _Call:
    """A call, and with how many workers it has died."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    deaths: int = 0
    last: bool = False  # it stands in for one that fell


def _here(calls: Iterable[_Call]) -> Generator[Any]:
    for call in calls:
        yield call.function(*call.arguments)


def _there(
    calls: Iterator[_Call],
    workers: int,
    patience: float | None,
    fallen: Callable[..., Any] | None,
    out: Path,
    setting: Setting,
) -> Generator[Any]:
    first, last, busy, false_starts = deque[_Call](), deque[_Call](), list[_Worker](), 0
    try:
        while True:
            while len(busy) < workers and (call := _next(first, calls, last)) is not None:
                try:
                    busy.append(_hire())
                except OSError as error:
                    first.appendleft(call)
                    if not busy:
                        raise _no_worker(error.strerror or str(error), out) from error
                    workers = max(
                        1, len(busy) - 2
                    )  # there can't be more; who puts the results together opens files too
                    break
                busy[-1].give(call, setting)
            if not busy:
                return
            wait([worker.line for worker in busy], _LOOK)
            for worker in list(busy):
                what, told = worker.told(patience)
                if what == "ready":
                    false_starts = 0
                if what in ("", "ready"):
                    continue
                busy.remove(worker)
                call = worker.let_go(keep=what in ("done", "refused") and len(busy) < workers)
                if what == "done":
                    yield told
                elif what == "refused":
                    raise told
                elif worker.ready and what != "stale":
                    last.append(_after(call, what == "hung", told, fallen, out))
                else:
                    first.appendleft(call)
                    false_starts += not worker.ready
                    if false_starts == _FALSE_STARTS:
                        raise _no_worker(told.reason, out)
    finally:
        for worker in busy:
            worker.end()


def _next(first: deque[_Call], calls: Iterator[_Call], last: deque[_Call]) -> _Call | None:
    """The call that is made next; those that are waiting to be made are not held."""
    if first:
        return first.popleft()
    call = next(calls, None)
    return last.popleft() if call is None and last else call


def _after(call: _Call, hung: bool, fate: Fate, fallen: Callable[..., Any] | None, out: Path) -> _Call:
    """What is called next, after a worker has died with `call` or was ended as it hung."""
    call.deaths += 1
    if not hung and call.deaths < _DEATHS:
        return call
    if fallen is None or call.last:
        raise ClearwayError(f"a worker process {fate}; what is finished is kept, --resume goes on from there", file=out)
    return _Call(fallen, (fate, *call.arguments), last=True)


def _no_worker(reason: str, out: Path) -> ClearwayError:
    return ClearwayError(f"no worker process can be started: {reason}", file=out)


_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Linear algebra keeps to the worker's own core, unless the user says otherwise: threads of many workers wait for each other,
and their number would decide the last bits."""


class _Worker:
    """A worker process, seen from its parent.

    Attributes:
        line: By which calls go there and answers come back.
        call: What it is at; None: it is idle.
        ready: Whether it has begun to take calls.
        spent: Whether its last call has left something running in it.
    """

    def __init__(self) -> None:
        self.call: _Call | None = None
        self.ready = self.spent = False
        self._key = secrets.token_hex(8)
        here, there = socket.socketpair()
        here.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _HALF)
        beat = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - they live as long as the worker
        beat.write(bytes(8))  # now: a full disk would end who writes into it later
        self._trace = tempfile.TemporaryFile()  # noqa: SIM115
        asked = {
            "parent": os.getpid(), "key": self._key, "connection": there.fileno(), "beat": beat.fileno(),
            "traces": self._trace.fileno(), "path": sys.path,
        }  # fmt: skip
        with there, beat:
            self._process = subprocess.Popen(
                [sys.executable, str(Path(__file__).with_name("worker_process.py")), json.dumps(asked)],
                stdin=subprocess.DEVNULL,
                stdout=_errors(),  # what a navigator prints is not ours
                pass_fds=(there.fileno(), beat.fileno(), self._trace.fileno()),
                env=_ONE_THREAD | os.environ,
                process_group=0,  # Ctrl-C comes here only; and what it starts ends with it
            )
            self._pulse = Pulse(beat.fileno())
        self.line = Connection(here.detach())

    @property
    def alive(self) -> bool:
        """Whether it can take a call."""
        return self._process.poll() is None and not self.line.poll()

    def give(self, call: _Call, setting: Setting) -> None:
        """Have it make a call."""
        self.call = call
        self._pulse.restart(time.monotonic())
        with suppress(OSError):  # it has ended: it will tell nothing more
            self.line.send_bytes(pickle.dumps((setting, pickle.dumps((call.function, call.arguments)))))

    def told(self, patience: float | None) -> tuple[str, Any]:
        """What it has to tell: a word, empty for nothing yet, and what comes with it, a `Fate` if it ended."""
        try:
            if self.line.poll():
                key, what, told, self.spent = pickle.loads(self.line.recv_bytes(_LONGEST))
                if key != self._key:
                    raise ValueError(key)
                self.ready = True
                self._pulse.restart(time.monotonic())
                return (what, told) if what != "broke" else (what, Fate(f"cannot go on ({told[0]})", told[1]))
        except (EOFError, OSError):
            return "died", self._fate()
        except Exception:  # a navigator has written there
            return "died", Fate("spoilt its connection")
        if patience is None or not self.ready:
            return "", None
        limit = self._pulse.overdue(time.monotonic(), patience)
        if limit is None:
            return "", None
        os.kill(self._process.pid, signal.SIGUSR2)  # it writes down where it is
        time.sleep(0.2)
        return "hung", Fate(f"took longer than {limit:g} s and could not be broken off", self._place())

    def let_go(self, keep: bool) -> _Call:
        """Take its call from it. It waits for another one if it may be kept and has left nothing running, or ends."""
        call, self.call = self.call, None
        assert call is not None
        if keep and not self.spent:
            _idle.append(self)
        else:
            self.end()
        return call

    def end(self) -> None:
        """End it now, wherever it is, and what it has started with it."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        with suppress(ProcessLookupError):
            self._process.kill()
        self._process.wait()
        self.line.close()
        self._trace.close()

    def _fate(self) -> Fate:
        try:
            code = self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            return Fate("closed or spoilt its connection")
        place = self._place()
        if code < 0:
            return Fate(f"was ended by {signal.Signals(-code).name}", place)
        return Fate(f"ended with exit code {code}", place)

    def _place(self) -> str:
        """The lines of Python in which it was, innermost last."""
        self._trace.seek(0)
        written = self._trace.read().decode(errors="replace")
        lines: list[str] = re.findall(r'^ +(File "[^"]*", line \d+ in .*)$', written, re.MULTILINE)

        return "\n".join(f"  {line}" for line in reversed(lines))


_idle: list[_Worker] = []
"""Workers that wait for a call."""


def _hire() -> _Worker:
    while _idle:
        worker = _idle.pop()
        if worker.alive:
            return worker
        worker.end()
    return _Worker()


os.register_at_fork(after_in_child=_idle.clear)  # they are the parent's


@atexit.register
def _end_idle() -> None:
    while _idle:
        _idle.pop().end()


def _errors() -> int:
    """Where a worker's output goes: to this process's errors."""
    try:
        os.fstat(2)
    except OSError:
        return subprocess.DEVNULL
    return 2

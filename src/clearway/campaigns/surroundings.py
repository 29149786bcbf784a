"""What a trial finds around it in a worker process: the same each time, whatever the trial before has done to it."""

from __future__ import annotations

import ctypes
import gc
import importlib
import os
import resource
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

_C = ctypes.CDLL(None)
_ARITHMETIC = ctypes.create_string_buffer(256)  # an fenv_t; no system's is larger
_C.fegetenv(_ARITHMETIC)
_TIMERS = (signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)  # the third one is the watchdog's own


@dataclass(frozen=True, slots=True)
class Setting:
    """What a process takes over from its parent.

    Attributes:
        folder: The current directory.
        path: Where modules lie.
        environment: The environment's variables.
        objects: What a Python program has handed over instead of names.
    """

    folder: str
    path: tuple[str, ...]
    environment: dict[str, str]
    objects: bytes = b""

    @classmethod
    def present(cls, objects: bytes = b"") -> Setting:
        """That of this process, with what was handed over to it."""
        return cls(os.getcwd(), tuple(sys.path), dict(os.environ), objects)


def settle(setting: Setting) -> None:
    """Take a setting over."""
    round_as_ever()
    with suppress(OSError):  # it may have gone, which is for whoever needs it to say
        os.chdir(setting.folder)
    if tuple(sys.path) != setting.path:
        sys.path[:] = setting.path
        importlib.invalidate_caches()
    if dict(os.environ) != setting.environment:
        os.environ.clear()
        os.environ.update(setting.environment)


def round_as_ever() -> None:
    """Have floating-point numbers rounded as at the start: a library may have changed that, for all that comes after it."""
    _C.fesetenv(_ARITHMETIC)


def limits() -> dict[str, tuple[int, int]]:
    """What this process may take of each kind, as it stands and at most."""
    return {name: resource.getrlimit(getattr(resource, name)) for name in dir(resource) if name.startswith("RLIMIT_")}


@contextmanager
def restored() -> Iterator[None]:
    """Puts back, after the block under `with`, what foreign code may have done to the process."""
    setting, mask = Setting.present(), os.umask(0o077)
    os.umask(mask)
    before, blocked = limits(), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    streams, depth, errors, shown = (sys.stdout, sys.stderr), sys.getrecursionlimit(), np.geterr(), warnings.filters[:]
    try:
        yield
    finally:
        sys.settrace(None)
        sys.setprofile(None)
        for timer in _TIMERS:
            signal.setitimer(timer, 0.0)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        sys.setrecursionlimit(depth)
        settle(setting)
        os.umask(mask)
        for which, limit in limits().items():
            if limit != before[which]:
                with suppress(OSError, ValueError):
                    resource.setrlimit(getattr(resource, which), before[which])
        sys.stdout, sys.stderr = streams
        np.seterr(**errors)
        warnings.filters[:] = shown  # type: ignore[index]
        gc.enable()


class Sources:
    """The user's own modules that this process has imported: whether one was edited since."""

    def __init__(self) -> None:
        self._seen: set[str] = set()
        self._stamps: dict[str, int | None] = {}
        self.look()

    def look(self) -> None:
        """Remember those that are new."""
        for name in set(sys.modules) - self._seen:
            self._seen.add(name)
            file = getattr(sys.modules[name], "__file__", None)
            if isinstance(file, str) and _own(file):
                self._stamps[file] = _stamp(file)

    def changed(self) -> bool:
        """Whether one is no longer what was imported."""
        return any(_stamp(file) != stamp for file, stamp in self._stamps.items())


def _own(file: str) -> bool:
    return not (Path(file).is_relative_to(sys.prefix) or Path(file).is_relative_to(sys.base_prefix))


def _stamp(file: str) -> int | None:
    try:
        return os.stat(file).st_mtime_ns
    except OSError:
        return None

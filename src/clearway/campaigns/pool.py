"""Runs calls on many cores, and leaves no worker process running when something goes wrong."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from clearway.errors import ClearwayError

T = TypeVar("T")


class Pool:
    """Runs calls in worker processes; made by `pool`.

    Args:
        workers: How many processes; with fewer than two, every call is made in this process.
        out: The results directory, which the error names if a worker dies.

    Attributes:
        workers: How many processes there may be.
    """

    def __init__(self, workers: int, out: Path) -> None:
        self.workers, self._out = workers, out
        self._running: Generator[Any] | None = None

    def each(self, function: Callable[..., T], calls: Iterable[tuple[Any, ...]]) -> Iterator[T]:
        """What the function returns for each tuple of arguments, in the order in which the calls end.

        Raises:
            ClearwayError: a worker process died.
        """
        calls = list(calls)
        workers = min(self.workers, len(calls))
        self._running = _here(function, calls) if workers < 2 else _there(function, calls, workers, self._out)
        return self._running

    def close(self) -> None:
        """Make no further calls."""
        if self._running is not None:
            self._running.close()


@contextmanager
def pool(workers: int, out: Path) -> Iterator[Pool]:
    """A pool for the block under `with`; an error in the block ends the worker processes, wherever they are.

    Without an error they stay, idle, for the next pool.
    """
    made = Pool(workers, out)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "[0-9]+ tasks which were still being processed")  # after an error: we know
        try:
            yield made
        except BaseException:
            made.close()
            _end_workers()
            raise


def workers_of(asked: int | None, least: int = 1) -> int:
    """How many processes there are to be: as asked, or one a core.

    Raises:
        ClearwayError: fewer than `least` are asked for.
    """
    if asked is not None and asked < least:
        raise ClearwayError(f"{asked} is wrong: at least {least}", field="workers")
    return (os.cpu_count() or 1) if asked is None else asked


def _here(function: Callable[..., T], calls: list[tuple[Any, ...]]) -> Generator[T]:
    for arguments in calls:
        yield function(*arguments)


def _there(function: Callable[..., T], calls: list[tuple[Any, ...]], workers: int, out: Path) -> Generator[T]:
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=workers, backend="loky", batch_size=1, return_as="generator_unordered", max_nbytes=None)
    try:
        yield from parallel(delayed(_in_worker)(os.getpid(), function, arguments) for arguments in calls)
    except BrokenProcessPool as error:
        raise ClearwayError(
            "a worker process died: a navigator crashed it, or memory ran out; what is finished is kept, --resume goes "
            "on from there, with --workers 1 up to the trial that does it",
            file=out,
        ) from error


def _end_workers() -> None:
    """End the worker processes now, wherever they are: what they have finished is on the disk."""
    if "joblib.externals.loky.reusable_executor" in sys.modules:
        from joblib.externals.loky import reusable_executor

        if reusable_executor._executor is not None:
            reusable_executor._executor.shutdown(wait=True, kill_workers=True)


# --- in a worker -----------------------------------------------------------------------------------------------------

_settled: int | None = None


def _in_worker(parent: int, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
    _settle(parent)
    return function(*arguments)


def _settle(parent: int) -> None:
    """Once a worker: leave Ctrl-C to the parent, and end when the parent has ended, however it did."""
    global _settled
    if _settled == parent:
        return
    _settled = parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)

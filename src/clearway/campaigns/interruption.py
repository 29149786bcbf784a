"""Ctrl-C in the middle of a campaign: nothing that is finished is lost, and the user is told how to go on."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, TracebackType

from clearway.trials.store import TrialStore
from clearway.trials.store_results import how_to_go_on


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C stopped a campaign; the message says how to go on.

    Attributes:
        path: The results directory, which can be resumed.
        done: How many trials are finished.
        total: How many there are.
    """

    def __init__(self, path: Path, done: int, total: int) -> None:
        self.path, self.done, self.total = path, done, total
        super().__init__(f"stopped after {done} of {total} trials; go on with `{how_to_go_on(path)}`")


@contextmanager
def interruptible(store: TrialStore) -> Iterator[None]:
    """Makes a `CampaignInterrupted` of Ctrl-C in the block under `with`, whatever exception has come of it."""
    with _CtrlC() as ctrl_c:
        try:
            yield
        except BaseException as error:
            if not (ctrl_c.came or isinstance(error, KeyboardInterrupt)):
                raise
            raise CampaignInterrupted(store.path, store.done(), store.total) from None


class _CtrlC:
    """Notices Ctrl-C, which reaches the workers too: what comes of that in the parent may be any exception."""

    came = False

    def __enter__(self) -> _CtrlC:
        self._main = threading.current_thread() is threading.main_thread()
        if self._main:
            self._before = signal.signal(signal.SIGINT, self._ring)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._main:
            signal.signal(signal.SIGINT, self._before)

    def _ring(self, signum: int, frame: FrameType | None) -> None:
        if not self.came:  # a second one must not break the clearing up
            self.came = True
            raise KeyboardInterrupt

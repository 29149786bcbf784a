"""Progress of long work on stderr: one line that is rewritten in a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from clearway.api import Results
    from clearway.statistics import Verdict


class Progress:
    """Call it with (done, total, note); it says how far the work is and how much time is left.

    Args:
        what: What is counted, for people: `trials`.
    """

    def __init__(self, what: str) -> None:
        self.what = what
        self.live = sys.stderr.isatty()
        self.spoke = time.monotonic()
        self.found: int | None = None  # what was done already when it began (a campaign that goes on)
        self.pace: tuple[float, int] | None = None  # when the first of it was done, and how much that made
        self.width = self.last = 0

    def __enter__(self) -> Progress:
        if self.live:  # every scenario and navigator is looked at before the first trial
            text = f"{self.what}: getting ready"
            print(text, end="", file=sys.stderr, flush=True)
            self.width = len(text)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.live and self.width:
            print(file=sys.stderr)

    def __call__(self, done: int, total: int, note: str = "") -> None:
        now = time.monotonic()
        if self.found is None or done < self.last:  # less than before: other work
            self.found, self.pace = done, None
        elif self.pace is None and done > self.found:
            self.pace = (now, done)  # the pace is taken from here: what came before was compiling
        self.last = done
        if not self.live and done < total and now - self.spoke < 10 and not (note and done == self.found):
            return
        self.spoke = now
        left = ""
        if self.pace is not None and self.pace[1] < done < total:
            left = f", {_duration((now - self.pace[0]) / (done - self.pace[1]) * (total - done))} left"
        text = f"{self.what}: {done}/{total}{left}" + (f"  {note}" if note else "")
        if self.live:
            print(f"\r{text:<{self.width}}", end="", file=sys.stderr, flush=True)
            self.width = len(text)
        else:
            print(text, file=sys.stderr, flush=True)

    def say(self, sentence: str) -> None:
        """Print a sentence on a line of its own."""
        clear = f"\r{'':<{self.width}}\r" if self.live else ""
        print(f"{clear}{sentence}", file=sys.stderr, flush=True)
        self.width = 0


@contextmanager
def stoppable(otherwise: str = "") -> Iterator[None]:
    """On Ctrl-C, say where the work stands and how to go on.

    Args:
        otherwise: That, where whoever was stopped doesn't say it; empty: nothing.
    """
    try:
        yield
    except KeyboardInterrupt as stopped:
        said = str(stopped) or "; ".join(filter(None, ("stopped", otherwise)))
        typer.echo(f"clearway: {said}", err=True)
        raise typer.Exit(130) from None


def written(results: Results, verdict: Verdict | None = None) -> Path:
    """The page of results, which begins with the `verdict` if there is one; a line says that it is being written, and on Ctrl-C
    what does it later."""
    print("writing the report", file=sys.stderr, flush=True)
    with stoppable(f"the results are whole, and `clearway report {results.path}` writes their page"):
        return results.report(verdict)
    raise AssertionError("a context manager that swallows nothing")


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"

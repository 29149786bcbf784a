"""How far long work is: who is told of it, and how."""

from __future__ import annotations

from typing import Protocol


class ProgressCallback(Protocol):
    """Told again and again how far the work is."""

    def __call__(self, done: int, total: int, note: str = "") -> None:
        """Take note.

        Args:
            done: How many trials are done.
            total: How many there are.
            note: What there is to say to people, often nothing.
        """


def silent(done: int, total: int, note: str = "") -> None:
    """A progress callback that tells nobody."""

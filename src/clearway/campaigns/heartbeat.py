"""What a worker process shows of itself while it can't speak: that it gets on, and how long it may take for what it does.

It is one number in memory that the worker shares with its parent, which so sees a loop in compiled code too. No clock is
compared: the parent counts how long the number stays the same.
"""

from __future__ import annotations

import math
import mmap

COMPILING = 1800.0
"""s that Numba may take for what is compiled between two beats: all of Clearway takes a minute or two."""
_ENDLESS = (1 << 24) - 1
_COMPILING = 1 << 24
_BEAT = 1 << 25
_A_SECOND = 100.0


class Heartbeat:
    """Counts beginnings and ends, in this process alone until it is shared."""

    def __init__(self) -> None:
        self._now = 0
        self._word = memoryview(bytearray(8)).cast("q")

    def share(self, descriptor: int) -> None:
        """Beat into a file of eight bytes, which somebody else reads."""
        self._word = memoryview(mmap.mmap(descriptor, 8)).cast("q")

    def begin(self, limit: float | None) -> None:
        """Foreign code begins, which may take `limit` s; None: as long as it likes."""
        self._beat(_ENDLESS if limit is None else min(math.ceil(limit * _A_SECOND), _ENDLESS))

    def end(self) -> None:
        """It is over."""
        self._beat(0)

    def compile(self, running: bool) -> None:
        """Compiling begins or ends, which has time of its own."""
        self._now = self._now | _COMPILING if running else self._now & ~_COMPILING
        self._word[0] = self._now

    def _beat(self, limit: int) -> None:
        self._now = (self._now // _BEAT + 1) * _BEAT | self._now & _COMPILING | limit
        self._word[0] = self._now  # one write, never half


class Pulse:
    """How long ago a heartbeat was last seen to change, by somebody who looks now and then.

    Args:
        descriptor: The file that the heartbeat is shared by.
    """

    def __init__(self, descriptor: int) -> None:
        self._word = memoryview(mmap.mmap(descriptor, 8)).cast("q")
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Count anew from `now`, s."""
        self._last, self._looked, self._still, self._compiling = self._word[0] // _BEAT, now, 0.0, 0.0

    def overdue(self, now: float, patience: float) -> float | None:
        """The limit that is passed by far, s; None where none is. By far: the worker is to notice it first.

        Args:
            now: By a clock that doesn't jump, s. Between two looks at most a second counts: who was not asked to look
                (a suspended process) doesn't know that the worker could get on.
            patience: How long it may take for all that is not foreign code, s.
        """
        word, passed = self._word[0], min(now - self._looked, 1.0)
        if word // _BEAT != self._last:
            self.restart(now)
            return None
        self._looked, limit = now, word & _ENDLESS
        if limit == _ENDLESS:
            return None
        if word & _COMPILING:
            self._compiling += passed
            return COMPILING if self._compiling > COMPILING else None
        self._still += passed
        allowed = limit / _A_SECOND if limit else patience
        return allowed if self._still > 1.5 * allowed + 2.0 else None


HEARTBEAT = Heartbeat()
"""Of this process."""

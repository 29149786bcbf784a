"""What a worker process shows of itself while it can't speak: that it gets on, and how long it may take for what it does.

It is one number in memory that the worker shares with its parent, which so sees a loop in compiled code too. No clock is
compared: the parent counts how long the number stays the same.
"""

from __future__ import annotations

import math
import mmap

_BITS = 24
_ENDLESS = (1 << _BITS) - 1
_A_SECOND = 100.0


class Heartbeat:
    """Counts beginnings, in this process alone until it is shared."""

    def __init__(self) -> None:
        self._count = self._limit = 0
        self._compiling = False
        self._word = memoryview(bytearray(8)).cast("q")

    def share(self, descriptor: int) -> None:
        """Beat into a file of eight bytes, which somebody else reads."""
        self._word = memoryview(mmap.mmap(descriptor, 8)).cast("q")

    def begin(self, limit: float | None) -> None:
        """Foreign code begins, which may take `limit` s; None: as long as it likes."""
        self._limit = _ENDLESS if limit is None else min(math.ceil(limit * _A_SECOND), _ENDLESS)
        self._beat()

    def end(self) -> None:
        """It is over."""
        self._limit = 0
        self._beat()

    def compile(self, running: bool) -> None:
        """Compiling begins or ends, which may take as long as it likes; whatever goes on has its time anew."""
        self._compiling = running
        self._beat()

    def _beat(self) -> None:
        self._count += 1
        self._word[0] = self._count << _BITS | (_ENDLESS if self._compiling else self._limit)  # one write, never half


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
        self._last, self._looked, self._still = self._word[0], now, 0.0

    def overdue(self, now: float, patience: float) -> float | None:
        """The limit that is passed by far, s; None where none is. By far: the worker is to notice it first.

        Args:
            now: By a clock that doesn't jump, s. Between two looks at most a second counts: who was not asked to look
                (a suspended process) doesn't know that the worker could get on.
            patience: How long it may take for all that is not foreign code, s.
        """
        word, passed = self._word[0], min(now - self._looked, 1.0)
        self._looked = now
        if word != self._last:
            self._last, self._still = word, 0.0
            return None
        self._still += passed
        limit = word & _ENDLESS
        if limit == _ENDLESS:
            return None
        allowed = limit / _A_SECOND if limit else patience
        return allowed if self._still > 1.5 * allowed + 2.0 else None


HEARTBEAT = Heartbeat()
"""Of this process."""

"""Loops of their own frequency within control periods."""

from __future__ import annotations

EARLY = 1e-6
"""s; a clock that ticks in periods may be this much short of a deadline."""


class Rate:
    """A loop of its own frequency, asked once per control period whether it is due (rclcpp::Rate).

    Args:
        frequency: Hz.
    """

    def __init__(self, frequency: float) -> None:
        self._period = 1.0 / frequency
        self._next: float | None = None

    def restart(self) -> None:
        """It is due at once, then after each period."""
        self._next = None

    def due(self, t: float) -> bool:
        """Whether it is due at `t` [s]."""
        if self._next is None:
            self._next = t
        if t < self._next - EARLY:
            return False
        self._next = max(self._next + self._period, t)
        return True

"""What comes on `/cmd_vel`: checked, and kept until the base's watchdog stops the robot."""

from __future__ import annotations

import math
from collections.abc import Iterable

from clearway.live.line import WireError
from clearway.live.ros.said import BASE, Twist

STILL = Twist(0.0, 0.0, 0.0, "")
"""Stand."""


class Commands:
    """The command that holds.

    Args:
        watchdog: How long the last one holds, in nanoseconds of `/clock`.
    """

    def __init__(self, watchdog: int) -> None:
        self._watchdog = watchdog
        self._last = STILL
        self._heard_at: dict[str, int] = {}

    def hear(self, twists: Iterable[Twist], now: int) -> bool:
        """Take what came; whether one of it was said after `now` was told, as far as that can be known.

        Args:
            twists: Oldest first.
            now: What `/clock` was told last, ns.

        Raises:
            WireError: one is not what a base takes.
        """
        fresh = False
        for twist in twists:
            self._check(twist, now)
            self._last = twist
            self._heard_at[twist.publisher] = now
            fresh |= twist.stamp is None or twist.stamp >= now
        return fresh

    def now(self, now: int) -> Twist:
        """What holds at `now`: the last one, or to stand where that is too long ago."""
        heard = self._heard_at.get(self._last.publisher)
        return self._last if heard is not None and now - heard <= self._watchdog else STILL

    def _check(self, twist: Twist, now: int) -> None:
        for name, value in (("linear.x", twist.v), ("linear.y", twist.v_y), ("angular.z", twist.omega)):
            if not math.isfinite(value):
                raise WireError(f"gave {name} = {value} on /cmd_vel, which is not finite")
        if twist.frame.lstrip("/") not in ("", BASE):
            raise WireError(f"gave a command in the frame {twist.frame!r} on /cmd_vel; a base takes them in {BASE!r}")
        if twist.publisher != self._last.publisher:
            # one that takes over is no fault (a recovery after a controller); two that take turns are
            before = self._heard_at.get(twist.publisher)
            if before is not None and now - before <= self._watchdog:
                who = " and ".join(sorted((twist.publisher, self._last.publisher)))
                raise WireError(
                    f"has two publishers of /cmd_vel that command at the same time, {who}; a base obeys one"
                )
        elif None not in (twist.stamp, self._last.stamp) and twist.stamp < self._last.stamp:  # type: ignore[operator]
            raise WireError(
                f"gave a stamp on /cmd_vel that jumps back from {self._last.stamp} to {twist.stamp} ns; does it use /clock?"
            )

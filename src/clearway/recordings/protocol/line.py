"""A-B on the floor, and how people with a tape measure see the map from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from clearway.quantities import PoseSpec


@dataclass(frozen=True, slots=True)
class Line:
    """A-B on the floor: how people with a tape measure see a pose of the map.

    Attributes:
        a: Pose A in the map: x, y [m], theta [rad].
        b: Pose B in the map: x, y [m], theta [rad].
    """

    a: PoseSpec
    b: PoseSpec

    @property
    def length(self) -> float:
        """Distance from A to B, m."""
        return math.dist(self.a[:2], self.b[:2])

    def seen(self, point: Sequence[float]) -> tuple[float, float]:
        """Metres from A towards B, and to the left of that line (negative: to the right)."""
        heading = self.heading
        dx, dy = point[0] - self.a[0], point[1] - self.a[1]
        c, s = math.cos(heading), math.sin(heading)
        return round(c * dx + s * dy, 6) + 0.0, round(c * dy - s * dx, 6) + 0.0

    def turned(self, theta: float) -> float:
        """A heading of the map against the line, degrees in (-180, 180]."""
        return round(math.degrees(math.remainder(theta - self.heading, math.tau)), 3) + 0.0

    @property
    def heading(self) -> float:
        """Of the line in the map, rad; A's own where A and B are one place."""
        if self.length < 1e-9:
            return self.a[2]
        return math.atan2(self.b[1] - self.a[1], self.b[0] - self.a[0])

    def words(self, pose: Sequence[float]) -> str:
        """Where a pose is, in words."""
        for name, end in (("A", self.a), ("B", self.b)):
            if math.dist(pose[:2], end[:2]) < 5e-4:
                return f"on {name}"
        along, across = self.seen(pose)
        from_a = f"{metres(along)} m from A towards B" if along >= 0 else f"{metres(-along)} m behind A"
        if abs(across) < 5e-4:
            return f"{from_a}, on the line"
        return f"{from_a}, {metres(abs(across))} m to the {'left' if across > 0 else 'right'}"


def metres(value: float) -> str:
    """A length to the millimetre, as short as possible."""
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")

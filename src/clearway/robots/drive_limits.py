"""What a base can do: one type for plant, navigators, indicators and reports, which compiled code reads as well."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.compiled import kernel


class DriveLimits(NamedTuple):
    """Limits of a differential drive. It heads for its command with these accelerations, and holds no speed beyond these.

    Attributes:
        v_min: Most negative forward speed (reverse), m/s, at most 0.
        v_max: Largest forward speed, m/s.
        acceleration: Bound on the growth of |v|, m/s^2; inf: it takes up any speed at once.
        deceleration: Bound on the decline of |v|, m/s^2; inf likewise.
        omega_max: Largest yaw rate either way, rad/s.
        angular_acceleration: Bound on the growth of |omega|, rad/s^2; inf likewise.
        angular_deceleration: Bound on the decline of |omega|, rad/s^2; inf likewise.
    """

    v_min: float
    v_max: float
    acceleration: float
    deceleration: float
    omega_max: float
    angular_acceleration: float
    angular_deceleration: float

    def capped(self, speed: float) -> DriveLimits:
        """The same base where no more than `speed` [m/s] is allowed either way."""
        return self._replace(v_min=max(self.v_min, -float(speed)), v_max=min(self.v_max, float(speed)))

    @property
    def fastest(self) -> float:
        """The larger of its speeds forwards and backwards, m/s."""
        return max(self.v_max, -self.v_min)


@kernel
def immediate(limits: DriveLimits) -> bool:
    """Whether the base takes up whatever it is told at once: no acceleration is bounded."""
    straight = min(limits.acceleration, limits.deceleration)
    return bool(min(straight, limits.angular_acceleration, limits.angular_deceleration) == math.inf)

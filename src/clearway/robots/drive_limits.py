"""What a base can do: one type for plant, navigators, indicators and reports, which compiled code reads as well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

from clearway.geometry.compiled import light

DriveKind: TypeAlias = Literal["differential", "omnidirectional", "ackermann"]
"""How a base moves: forwards and about its pivot; besides that to its sides; or as a car does, which can't turn on the spot."""

WHEELS = 4
"""So many wheels of an omnidirectional base may bound its speed."""

_Shares: TypeAlias = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip


class DriveLimits(NamedTuple):
    """Limits of a base. It heads for its command with these accelerations, and holds no speed beyond these.

    What follows the first seven is only for bases of another kind than `differential`.

    Attributes:
        v_min: Most negative forward speed (reverse), m/s, at most 0.
        v_max: Largest forward speed, m/s.
        acceleration: Bound on the growth of |v|, m/s^2; inf: it takes up any speed at once.
        deceleration: Bound on the decline of |v|, m/s^2; inf likewise.
        omega_max: Largest yaw rate either way, rad/s.
        angular_acceleration: Bound on the growth of |omega|, rad/s^2; inf likewise.
        angular_deceleration: Bound on the decline of |omega|, rad/s^2; inf likewise.
        v_y_max: Largest speed to either side, m/s; above 0 the base is omnidirectional.
        lateral_acceleration: Bound on the growth of |v_y|, m/s^2; inf likewise.
        lateral_deceleration: Bound on the decline of |v_y|, m/s^2; inf likewise.
        speed_max: Largest speed in any direction, m/s.
        wheels: (12,) for each of up to four wheels which share of its largest speed it takes for 1 m/s of v, 1 m/s of v_y
            and 1 rad/s of omega; zeros: no bound.
        wheelbase: From the rear axle to the front one, m; above 0 the base steers like a car (`ackermann`), and omega_max and
            the bounds on the change of omega follow from the steering.
        steering_max: Largest steering angle either way, rad.
        steering_rate: How fast it changes, rad/s.
    """

    v_min: float
    v_max: float
    acceleration: float
    deceleration: float
    omega_max: float
    angular_acceleration: float
    angular_deceleration: float
    v_y_max: float = 0.0
    lateral_acceleration: float = math.inf
    lateral_deceleration: float = math.inf
    speed_max: float = math.inf
    wheels: _Shares = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    wheelbase: float = 0.0
    steering_max: float = 0.0
    steering_rate: float = math.inf

    def capped(self, speed: float) -> DriveLimits:
        """The same base where no more than `speed` [m/s] is allowed in any direction."""
        capped = self._replace(v_min=max(self.v_min, -float(speed)), v_max=min(self.v_max, float(speed)))
        if self.v_y_max > 0.0:
            fastest = min(self.speed_max, float(speed))
            return capped._replace(v_y_max=min(self.v_y_max, float(speed)), speed_max=fastest)
        if self.wheelbase > 0.0:
            return capped._replace(omega_max=capped.fastest * math.tan(self.steering_max) / self.wheelbase)
        return capped

    @property
    def kind(self) -> DriveKind:
        """How it moves."""
        if self.wheelbase > 0.0:
            return "ackermann"
        return "omnidirectional" if self.v_y_max > 0.0 else "differential"

    @property
    def fastest(self) -> float:
        """The largest of its speeds in any direction, m/s."""
        along = max(self.v_max, -self.v_min)
        return along if self.v_y_max == 0.0 else min(math.hypot(along, self.v_y_max), self.speed_max)


def shares_of(values: Sequence[float]) -> _Shares:
    """`DriveLimits.wheels` of what its first wheels take; the rest are none."""
    filled: Any = tuple(map(float, values)) + (0.0,) * (3 * WHEELS - len(values))
    shares: _Shares = filled
    return shares


@light
def immediate(limits: DriveLimits) -> bool:
    """Whether the base takes up whatever it is told at once: no acceleration is bounded."""
    straight = min(limits.acceleration, limits.deceleration)
    return bool(min(straight, limits.angular_acceleration, limits.angular_deceleration) == math.inf)


@light
def possible(limits: DriveLimits, v: float, omega: float, v_y: float) -> tuple[float, float, float]:
    """What a base makes of a command that it may not be able to do: v [m/s], omega [rad/s] and v_y [m/s] that it can hold.

    Each is cut at its own limit. An omnidirectional base then keeps its direction and slows down, and where a wheel would be
    too fast turns the slower as well; a car turns as narrowly as it can.
    """
    v = min(max(v, limits.v_min), limits.v_max)
    if limits.wheelbase > 0.0:
        most = abs(v) * math.tan(limits.steering_max) / limits.wheelbase
        return v, min(max(omega, -most), most), 0.0
    omega = min(max(omega, -limits.omega_max), limits.omega_max)
    if limits.v_y_max == 0.0:
        return v, omega, 0.0
    v_y = min(max(v_y, -limits.v_y_max), limits.v_y_max)
    speed, most = math.hypot(v, v_y), 1.0
    if speed > limits.speed_max:
        v, v_y = v * limits.speed_max / speed, v_y * limits.speed_max / speed
    for k in range(0, 3 * WHEELS, 3):
        most = max(most, abs(limits.wheels[k] * v + limits.wheels[k + 1] * v_y + limits.wheels[k + 2] * omega))
    return v / most, omega / most, v_y / most


@light
def steering_angle(limits: DriveLimits, v: float, omega: float) -> float:
    """The angle [rad] to which a car's front wheels are steered for v [m/s] and omega [rad/s]; as far as they can at v = 0."""
    if v == 0.0:
        return math.copysign(limits.steering_max, omega)
    angle = math.atan(limits.wheelbase * omega / v)
    return min(max(angle, -limits.steering_max), limits.steering_max)

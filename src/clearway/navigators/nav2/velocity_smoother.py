"""Commands made smooth: Nav2's velocity smoother, and its parameters.

Behaviour after nav2_velocity_smoother/src/velocity_smoother.cpp.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from clearway.geometry.compiled import kernel
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import Velocity
from clearway.quantities import Finite, NonNegative, Positive

_REST = Velocity(0.0, 0.0, 0.0)


def _three_or_six(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) not in (3, 6):
        raise ValueError(f"has {len(values)} numbers; it takes 3 (x, y, yaw) or 6 (x, y, z, roll, pitch, yaw)")
    return values


def _rising(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(value < 0.0 for value in values):
        raise ValueError("has a number below 0; these are 0 or above")
    return _three_or_six(values)


def _falling(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(value > 0.0 for value in values):
        raise ValueError("has a number above 0; these are 0 or below")
    return _three_or_six(values)


_Upper = Annotated[tuple[Finite, ...], AfterValidator(_rising)]
_Lower = Annotated[tuple[Finite, ...], AfterValidator(_falling)]
_Each = Annotated[tuple[Finite, ...], AfterValidator(_three_or_six)]


class VelocitySmootherParameters(Group):
    """`velocity_smoother`; its lists are of x, y and yaw, or of all six axes, of which those three count."""

    smoothing_frequency: Positive = Field(default=20.0, description="Hz (at most one command per control period)")
    feedback: Literal["OPEN_LOOP", "CLOSED_LOOP"] = Field(
        default="OPEN_LOOP", description="whether it accelerates from the last command or from the measured velocity"
    )
    scale_velocities: bool = Field(
        default=False, description="whether all axes are slowed down as much as that which needs it most"
    )
    max_velocity: _Upper = Field(default=(0.5, 0.0, 2.5), description="m/s, m/s, rad/s")
    min_velocity: _Lower = Field(default=(-0.5, 0.0, -2.5), description="m/s, m/s, rad/s")
    max_accel: _Upper = Field(default=(2.5, 0.0, 3.2), description="m/s^2, m/s^2, rad/s^2")
    max_decel: _Lower = Field(default=(-2.5, 0.0, -3.2), description="m/s^2, m/s^2, rad/s^2")
    deadband_velocity: _Each = Field(default=(0.0, 0.0, 0.0), description="slower is 0, m/s, m/s, rad/s")
    velocity_timeout: NonNegative = Field(
        default=1.0, description="without a command for so long it stops the robot, s"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "odom_topic": "there are no topics here",
        "odom_duration": "the velocity is the robot's odometry as it comes",
        "use_realtime_priority": "nothing is late here",
        "stamp_smoothed_velocity_with_smoothing_time": "commands have no stamps here",
    }

    @model_validator(mode="after")
    def _as_many(self) -> VelocitySmootherParameters:
        lists = (self.max_velocity, self.min_velocity, self.max_accel, self.max_decel, self.deadband_velocity)
        if len({len(values) for values in lists}) > 1:
            raise ValueError(
                "max_velocity, min_velocity, max_accel, max_decel and deadband_velocity have not as many numbers each"
            )
        return self


class VelocitySmoother:
    """Takes commands whenever they come and hands smooth ones on at its own rate."""

    def __init__(self, parameters: VelocitySmootherParameters) -> None:
        self._parameters = p = parameters
        self._limits = tuple(
            (p.min_velocity[i], p.max_velocity[i], p.max_accel[i], p.max_decel[i], p.deadband_velocity[i])
            for i in (0, 1, len(p.max_velocity) - 1)
        )
        self.reset()

    @property
    def period(self) -> float:
        """Time between two smooth commands, s: as in the source, whole milliseconds."""
        return max(1, int(1000.0 / self._parameters.smoothing_frequency)) / 1000.0

    def reset(self) -> None:
        """Forget everything: a new trial begins."""
        self._command: Velocity | None = None
        self._since = 0.0
        self._last = _REST
        self._stopped = True

    def hear(self, now: float, command: Velocity) -> None:
        """A command came at `now`, s."""
        self._command, self._since = command, now

    def smooth(self, now: float, measured: Velocity) -> Velocity | None:
        """The smooth command at `now` [s] of a robot that moves as `measured`; None: it says nothing."""
        if self._command is None:
            return None
        if now - self._since > self._parameters.velocity_timeout:
            if self._stopped or self._last == _REST:
                self._stopped = True
                return None
            self._command = _REST
        self._stopped = False
        p = self._parameters
        begin = self._last if p.feedback == "OPEN_LOOP" else measured
        self._command = Velocity(
            *(max(low, min(v, high)) for v, (low, high, *_) in zip(self._command, self._limits, strict=True))
        )
        scale = 1.0
        if p.scale_velocities:
            for v, to, (_, _, faster, slower, _) in zip(begin, self._command, self._limits, strict=True):
                share = _share(v, to, faster / p.smoothing_frequency, slower / p.smoothing_frequency)
                if share > 0.0 and abs(1.0 - share) > abs(1.0 - scale):
                    scale = share
        self._last = Velocity(
            *(
                _towards(v, to, faster / p.smoothing_frequency, slower / p.smoothing_frequency, scale)
                for v, to, (_, _, faster, slower, _) in zip(begin, self._command, self._limits, strict=True)
            )
        )
        return Velocity(*(0.0 if abs(v) < dead else v for v, (*_, dead) in zip(self._last, self._limits, strict=True)))


@kernel
def _step(v: float, to: float, faster: float, slower: float) -> float:
    """How much a speed may change on its way to another; `slower`, which is negative, holds where it passes through 0, too."""
    return faster if abs(to) >= abs(v) and v * to >= 0.0 else -slower


@kernel
def _share(v: float, to: float, faster: float, slower: float) -> float:
    """The share of the way from a speed to another that may be gone; -1 if all of it."""
    change, most = to - v, _step(v, to, faster, slower)
    return most / abs(change) if abs(change) > most else -1.0


@kernel
def _towards(v: float, to: float, faster: float, slower: float, scale: float) -> float:
    """The speed that follows upon `v` on its way to `to`, of which but the share `scale` is wanted."""
    most = _step(v, to, faster, slower)
    return v + max(-most, min(scale * (to - v), most))

"""What a robot's file says of its base: of which kind it is, and its limits."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray
from clearway.quantities import Angle, Delay, Finite, Length, Positive, Rate, Speed
from clearway.reading.limits import ANGLE, LENGTH, SPEED
from clearway.robots.drive_limits import WHEELS, DriveLimits, shares_of
from clearway.robots.part import Part

Share = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=0.9)]
"""Of what the wheels turn; with more it would hardly drive."""


class _Drive(Part):
    v_max: Speed = Field(description="forward speed, m/s")
    v_min: Finite = Field(description="most negative speed (reverse), m/s, at most 0", ge=-SPEED, le=0)
    acceleration: Rate = Field(description="m/s^2; inf: none is known")
    deceleration: Rate = Field(description="m/s^2; inf: none is known")
    pivot: Finite = Field(
        default=0.0,
        ge=-LENGTH,
        le=LENGTH,
        description="how far ahead of base_link the point is that the base turns about, m: a skid-steered base turns"
        " about a point nearer to its heavier end, which its wheel odometry does not know; a car's, the middle of its"
        " rear axle, which it does",
    )

    lag: Delay = Field(
        default=0.0,
        description="time constant with which the motors follow, by first order, what the base's controller sets them to, s",
    )
    slip_ratio: Share = Field(
        default=0.0,
        description="share of the way, forwards or to its sides, that its wheels turn and it does not move; its odometry"
        " counts wheels",
    )
    turn_slip_ratio: Share = Field(default=0.0, description="the same of turns")

    def base_link(self, odometry: FloatArray) -> FloatArray:
        """(3,) where base_link is in the odometry's frame, whose pose (3,) is that of the point that the base turns about, or base_link's
        own where the odometry knows that point."""
        return compose(odometry, np.array((-self.pivot, 0.0, 0.0))) if self.pivot else odometry


class _Turning(_Drive):
    omega_max: Positive = Field(le=ANGLE, description="yaw rate, rad/s")
    angular_acceleration: Rate = Field(description="rad/s^2; inf: none is known")
    angular_deceleration: Rate = Field(description="rad/s^2; inf: none is known")

    def limits(self) -> DriveLimits:
        """The same for compiled code."""
        return DriveLimits(
            v_min=self.v_min,
            v_max=self.v_max,
            acceleration=self.acceleration,
            deceleration=self.deceleration,
            omega_max=self.omega_max,
            angular_acceleration=self.angular_acceleration,
            angular_deceleration=self.angular_deceleration,
        )


class DifferentialSpec(_Turning):
    """Limits of a differential drive, as the base's own controller enforces them, and where it turns about."""

    kind: Literal["differential"] = "differential"


class WheelSpec(Part):
    """A wheel of an omnidirectional base; its rollers let it slip in one direction."""

    x: Finite = Field(ge=-LENGTH, le=LENGTH, description="in base_link, m")
    y: Finite = Field(ge=-LENGTH, le=LENGTH, description="in base_link, m")
    direction: Angle = Field(default=0.0, description="in which it rolls, rad from base_link's x axis")
    slip: Angle = Field(
        description="in which its rollers let it slip, rad from base_link's x axis: of an omni-wheel across `direction`, of"
        " a mecanum wheel 45 degrees to it"
    )
    speed: Speed = Field(description="of its rim, at most, m/s")

    @model_validator(mode="after")
    def _rolls(self) -> WheelSpec:
        if abs(math.sin(self.slip - self.direction)) < 0.1:
            raise ValueError(f"slip {self.slip:g} must lie across direction {self.direction:g}: it would not drive")
        return self

    def shares(self) -> tuple[float, float, float]:
        """Which share of its largest speed it takes for 1 m/s of v, 1 m/s of v_y and 1 rad/s of omega."""
        scale = math.sin(self.slip - self.direction) * self.speed
        along, across = math.sin(self.slip) / scale, -math.cos(self.slip) / scale
        return along, across, across * self.x - along * self.y


class OmnidirectionalSpec(_Turning):
    """Limits of a base that moves to its sides as well, each component with its own, as the base's controller enforces them."""

    kind: Literal["omnidirectional"]
    v_y_max: Speed = Field(description="to either side, m/s")
    lateral_acceleration: Rate = Field(description="m/s^2; inf: none is known")
    lateral_deceleration: Rate = Field(description="m/s^2; inf: none is known")
    speed_max: Rate = Field(default=math.inf, description="in any direction, m/s; inf: none is known")
    wheels: tuple[WheelSpec, ...] = Field(
        default=(), max_length=WHEELS, description="whose speed bounds that of the base; default: none is known"
    )

    def limits(self) -> DriveLimits:
        """The same for compiled code."""
        shares = [share for wheel in self.wheels for share in wheel.shares()]
        return (
            super()
            .limits()
            ._replace(
                v_y_max=self.v_y_max,
                lateral_acceleration=self.lateral_acceleration,
                lateral_deceleration=self.lateral_deceleration,
                speed_max=self.speed_max,
                wheels=shares_of(shares),
            )
        )


class AckermannSpec(_Drive):
    """Limits of a base that steers like a car, which can't turn on the spot. Its `pivot` is the middle of its rear axle."""

    kind: Literal["ackermann"]
    wheelbase: Length = Field(description="from the rear axle to the front one, m")
    steering_max: Positive = Field(
        lt=math.pi / 2, description="largest steering angle either way, of a wheel in the middle of the front axle, rad"
    )
    steering_rate: Rate = Field(description="how fast that angle changes, rad/s; inf: none is known")

    def base_link(self, odometry: FloatArray) -> FloatArray:
        """(3,) the odometry's pose (3,) itself: a car knows where its rear axle is."""
        return odometry

    @property
    def omega_max(self) -> float:
        """Yaw rate at its largest speed with its wheels steered as far as they go, rad/s."""
        return self.limits().omega_max

    def limits(self) -> DriveLimits:
        """The same for compiled code."""
        return DriveLimits(
            v_min=self.v_min,
            v_max=self.v_max,
            acceleration=self.acceleration,
            deceleration=self.deceleration,
            omega_max=math.inf,
            angular_acceleration=math.inf,
            angular_deceleration=math.inf,
            wheelbase=self.wheelbase,
            steering_max=self.steering_max,
            steering_rate=self.steering_rate,
        ).capped(math.inf)


def _of_a_kind(drive: object) -> object:
    """A drive's table that doesn't say its kind is one of a differential drive."""
    return {"kind": "differential", **drive} if isinstance(drive, dict) else drive


DriveSpec = Annotated[
    DifferentialSpec | OmnidirectionalSpec | AckermannSpec,
    Field(discriminator="kind"),
    BeforeValidator(_of_a_kind),
]

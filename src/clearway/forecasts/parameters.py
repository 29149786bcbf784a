"""Parameters of the forecasts."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from clearway.quantities import Positive, Whole

Share = Annotated[float, Field(gt=0, lt=1)]
RULES = ("orca", "social-force")


def _rules(value: Any) -> Any:
    if isinstance(value, bool):
        return value
    if isinstance(value, list | tuple) and value and all(name in RULES for name in value):
        return tuple(name for name in RULES if name in value)
    raise ValueError(f"must be true (by ORCA), false, or a list of rules: {', '.join(map(repr, RULES))}")


Rules = Annotated[bool | tuple[Literal["orca", "social-force"], ...], BeforeValidator(_rules)]
"""By which rules obstacles may avoid each other: some of `RULES`, or true, which is ORCA, or false, which is none."""


class ForecastParameters(BaseModel):
    """What is assumed of obstacles' motion (the bounds), and what is expected of it (everything else).

    The bounds hold for people (sprint: about 4 m/s) and for the rescue cases' obstacles; what exceeds them is told.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    speed: Positive = Field(default=4.4, description="bound of an obstacle's speed, m/s")
    acceleration: Positive = Field(default=1.8, description="bound of an obstacle's acceleration, m/s^2")
    memory: float = Field(default=2.5, ge=0, allow_inf_nan=False, description="out of view for longer: dropped, s")
    hypotheses: Whole = Field(default=3, ge=1, le=3, description="H, at most so many for an obstacle")

    usual_speed: Positive = Field(
        default=1.5, description="standard deviation of a component of velocity at first, m/s"
    )
    oscillation: float = Field(default=0.38, ge=0, lt=1, description="probability at first that one oscillates")
    usual_reach: Positive = Field(default=4.0, description="the same of the way to the point of an oscillation, m")
    softest: Positive = Field(default=0.012, description="least stiffness of an oscillation, 1/s^2")
    stiffest: Positive = Field(default=0.7, description="largest stiffness of an oscillation, 1/s^2")
    stiffnesses: Whole = Field(
        default=8, ge=2, le=32, description="from which its estimate starts, the same factor apart"
    )
    ends: float = Field(default=2.0, ge=0, le=4, description="deviations of log stiffness at which the two ends lie")
    turns: tuple[Positive, ...] = Field(
        default=(0.3, 0.7, 1.4), min_length=1, max_length=8, description="rad/s, both ways"
    )

    velocities: bool = Field(default=False, description="measured velocities are taken in, too: a lidar's tracker sees"
                             " more of them than its places tell, a camera's difference of two places does not")  # fmt: skip

    noise_stopped: Positive = Field(default=1e-4, description="of the place of what stands, m^2/s")
    noise_steady: Positive = Field(default=0.002, description="of acceleration at constant velocity, m^2/s^3")
    noise_free: Positive = Field(default=0.3, description="the same where velocity changes at random")
    noise_braking: Positive = Field(default=0.05, description="the same where velocity fades")
    noise_turn: Positive = Field(default=0.005, description="the same at constant turn")
    noise_oscillation: Positive = Field(default=1e-4, description="of jerk in an oscillation, m^2/s^5")
    manoeuvre: Positive = Field(default=0.6, description="standard deviation of an acceleration that lasts, m/s^2")
    manoeuvre_time: Positive = Field(default=1.0, description="how long it lasts, s")
    braking_time: Positive = Field(default=0.6, description="in which a velocity that fades falls to 37 %, s")

    switching: float = Field(default=0.15, ge=0, allow_inf_nan=False, description="changes of the kind of motion, 1/s")
    patience: Positive = Field(
        default=2.0, description="over its age and that many s the changes seen of one are a rate"
    )
    refuted: Share = Field(default=1e-5, description="probability below which a kind of motion is begun anew")
    surprise: Positive = Field(
        default=30.0, description="squared deviations of the best model; beyond, all begins anew"
    )
    agree: float = Field(default=1.0, ge=0, description="hypotheses nearer than so many sigma are one")
    least: Share = Field(default=0.02, description="a hypothesis less probable than that is left out")
    avoidance: Rules = Field(
        default=False, description="by which rules they may avoid each other, of orca and social-force; true: by orca"
    )
    constant_velocity_only: bool = Field(default=False, description="no other kind of motion is expected")

    @model_validator(mode="after")
    def _ordered(self) -> ForecastParameters:
        if self.stiffest <= self.softest:
            raise ValueError(f"stiffest {self.stiffest} must lie above softest {self.softest}")
        return self

"""Parameters of `mppi-forecast`: ours, unless the robot's file says otherwise; DECISIONS.md tells where they come from."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from clearway.forecasts.parameters import Rules
from clearway.quantities import NonNegative, Positive, Whole
from clearway.robots import RobotTable

Share = Annotated[float, Field(gt=0, le=1)]


class Parameters(RobotTable):
    """Everything under `[navigators.mppi-forecast]`."""

    TABLE = "navigators.mppi-forecast"

    samples: Whole = Field(default=1000, ge=8, le=100_000, description="K, control sequences sampled in a decision")
    horizon: Positive = Field(default=4.0, le=30.0, description="how far it looks ahead, s")
    step: Positive = Field(default=0.2, description="of the control sequence, s; rounded to control periods")
    hold: Positive = Field(default=0.6, description="between two of the points between which noise is linear, s")
    temperature: Positive = Field(default=0.05, description="lambda, s")
    noise: Positive = Field(default=0.5, description="standard deviation of v and v_y, as a share of the top speed")
    noise_omega: Positive = Field(default=0.8, description="standard deviation of the yaw rate, rad/s")
    contact_cost: Positive = Field(default=50.0, description="of certain contact, s/s")
    discount: Share = Field(default=0.8, description="factor on that for each second ahead")
    margin: NonNegative = Field(default=0.03, description="kept from what stands, m")
    soft: Positive = Field(default=0.25, description="from this distance on nearness to what stands costs, m")
    near: NonNegative = Field(default=1.0, description="what it costs at no distance, s/s")
    effort: NonNegative = Field(default=0.02, description="cost of changes of velocity, by the noise's deviation, s/s")
    reverse_cost: NonNegative = Field(default=0.3, description="of reversing, s/s")
    own_spread: NonNegative = Field(default=0.03, description="standard deviation of the own position, m")
    most_spread: Positive = Field(default=0.25, description="no forecast counts as less certain than that, m")
    avoidance: Rules = Field(
        default=False,
        description="by which rules obstacles may avoid each other, of orca and social-force; true: by orca",
    )
    ahead: Positive = Field(default=2.0, description="how far along its way the sample that keeps to it heads, m")

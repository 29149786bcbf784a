"""Parameters of HL-RRT*. None was published: the stand-ins hold them all, a robot's file may override each."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from clearway.quantities import Positive, Whole
from clearway.robots import RobotTable

Share = Annotated[float, Field(ge=0, le=1)]


class Parameters(RobotTable):
    """Everything under `[navigators.hl-rrt]` of a robot's file."""

    TABLE = "navigators.hl-rrt"
    STAND_INS = "hl-rrt"

    step: Positive = Field(description="the longest new edge, eta, m")
    spacing: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(
        description="a sample this near to a node of the tree adds nothing, m"
    )
    horizon: Positive = Field(description="H, m")
    gamma: Positive = Field(description="RRT*'s gamma as a multiple of its least value sqrt(3 A / pi)")
    padding: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(
        description="kept clear of obstacles beyond the robot's radius, m"
    )
    speed: Positive | None = Field(default=None, description="along the path, m/s; default: the set speed of the test")
    goal_share: Share = Field(description="of samples at the goal")
    horizon_share: Share = Field(description="of samples in the horizon's annulus")
    cache_share: Share = Field(description="of samples at waypoints of old plans")
    mixture_share: Share = Field(description="of samples from the learnt mixture; what is left is uniform")
    cone: float = Field(gt=0, le=3.15, description="half the angle of the horizon's annulus, rad")
    elite_share: float = Field(gt=0, le=1, description="of nodes that the mixture learns from")
    elites: Whole = Field(ge=2, le=1_000, description="at most so many of them")
    cache: Whole = Field(ge=1, le=100_000, description="waypoints that are remembered")
    capacity: Whole = Field(ge=16, le=1_000_000, description="nodes of the tree at most")
    chunk: Whole = Field(ge=1, le=1_000_000, description="samples between two looks at the best candidate")
    patience: Whole = Field(ge=1, description="samples without improvement after which a valid path is good enough")
    improvement: float = Field(gt=0, lt=1, description="the least relative gain that counts as one")
    cap: Whole = Field(ge=1, description="samples a control period at most, whatever the budget")

    @model_validator(mode="after")
    def _shares(self) -> Parameters:
        total = self.goal_share + self.horizon_share + self.cache_share + self.mixture_share
        if total > 1.0 + 1e-9:
            raise ValueError(
                f"goal_share + horizon_share + cache_share + mixture_share is {total:g}; it must be at most 1"
            )
        return self

    @model_validator(mode="after")
    def _step_in_horizon(self) -> Parameters:
        if not self.spacing < self.step <= self.horizon:
            raise ValueError(
                f"spacing, step and horizon are {self.spacing:g}, {self.step:g} and {self.horizon:g} m; spacing must be "
                "below step, and step at most the horizon"
            )
        return self

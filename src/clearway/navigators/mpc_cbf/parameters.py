"""Parameters of `mpc-cbf`: the paper's where it prints them, else ours, unless the robot's file says otherwise."""

from __future__ import annotations

from pydantic import Field

from clearway.quantities import NonNegative, Positive
from clearway.robots import RobotTable

STEP = 0.2
"""The paper's time step, s: `gamma` is told for it."""


class Parameters(RobotTable):
    """Everything under `[navigators.mpc-cbf]`."""

    TABLE = "navigators.mpc-cbf"

    gamma: float = Field(
        default=0.2, gt=0, lt=1, description="share of its barrier that an obstacle may lose in 0.2 s, the paper's step"
    )
    horizon: float = Field(default=3.2, gt=0, le=8, description="how far ahead it plans, s")
    effort: NonNegative = Field(default=0.1, description="weight of u'u beside the tracking error in m: R / Q")
    terminal: Positive = Field(default=10.0, description="weight of the last error beside each other one: P / Q")
    heading_weight: NonNegative = Field(default=0.3, description="of the heading's error beside the position's, m/rad")
    padding: NonNegative = Field(default=0.05, description="kept beyond the robot's radius, m")
    distance: Positive = Field(default=5.0, description="obstacles and walls that are farther away are overlooked, m")
    ahead: Positive = Field(default=2.0, description="how far along its way it looks for the point to head for, m")
    reverse: bool = Field(default=True, description="whether it may drive backwards, as far as the robot can")

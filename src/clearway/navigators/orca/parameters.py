"""Parameters of `orca`: ours, unless the robot's file says otherwise."""

from __future__ import annotations

from pydantic import Field

from clearway.navigators.common.crowd_navigator import CrowdParameters
from clearway.quantities import NonNegative, Positive, Whole


class Parameters(CrowdParameters):
    """Everything under `[navigators.orca]`."""

    TABLE = "navigators.orca"

    distance: Positive = Field(default=5.0, description="obstacles whose centres are farther away are overlooked, m")
    neighbours: Whole = Field(
        default=20, ge=1, le=1000, description="at most so many obstacles are heeded, the nearest"
    )
    horizon: Positive = Field(default=3.0, description="obstacles are avoided for so long, s")
    wall_horizon: Positive = Field(default=1.0, description="the map's walls are, s")
    share: float = Field(
        default=0.5, ge=0, le=1, description="of avoiding what moves, as it falls to the robot; 0.5 where it looks too"
    )
    tracking_error: Positive = Field(
        default=0.1,
        description="epsilon: how far the base may get off the velocity that it follows, m; the radius grows by it",
    )
    arrival_time: NonNegative = Field(
        default=0.0,
        description="nearer to its goal than the way of this time it wants to be there no sooner, s; 0: as late as its base can brake",
    )

"""People who walk through a scenario: where to, how fast, with whom, and by which rule they keep out of each other's way.

`clearway.world.behaviours` has what each rule does.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from clearway.quantities import NonNegative, Point, Positive
from clearway.reading.limits import STOPS

Behaviour = Literal["orca", "social-force", "still"]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class StopSpec(_Part):
    """A place to which a person walks."""

    at: Point = Field(description="m")
    wait: NonNegative = Field(default=0.0, le=3600, description="how long the person stays there, s")


class PersonSpec(_Part):
    """One person, seen from above as a disc."""

    name: str = Field(min_length=1, description="unique in its scenario")
    start: Point = Field(description="where the person is at time 0, m")
    route: tuple[StopSpec, ...] = Field(
        default=(), max_length=STOPS, description="places, one after another, on ways round what stands; empty: stays"
    )
    loop: bool = Field(default=False, description="whether the route begins anew after its last place")
    speed: Annotated[float, Field(strict=True, gt=0, le=5)] | None = Field(
        default=None,
        description="preferred, m/s; default: drawn from the seed, normal with mean 1.34 and standard deviation 0.26 m/s, cut at two"
        " of these (Weidmann 1993, Transporttechnik der Fussgänger)",
    )
    radius: Annotated[float, Field(strict=True, ge=0.1, le=1)] = Field(default=0.25, description="m")
    behaviour: Behaviour = Field(default="social-force", description="by which rule the person walks")
    group: str = Field(default="", description="who walks together has the same; empty: alone (social-force only)")
    sees_robots: bool = Field(default=True, description="whether the person keeps out of a robot's way")
    reaction: float = Field(
        default=0.3, strict=True, ge=0, le=2, description="how old what the person sees of robots is, s"
    )
    yields_at: Positive | None = Field(
        default=None,
        le=10,
        description="still only: steps aside when a robot comes nearer than this, m; default: never",
    )

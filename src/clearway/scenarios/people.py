"""People who walk through a scenario: where to, how fast, with whom, and by which rule they keep out of each other's way.

`clearway.world.behaviours` has what each rule does.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from clearway.errors import unknown
from clearway.quantities import Finite, NonNegative, Point, Positive
from clearway.reading.limits import POINTS, STOPS
from clearway.scenarios.behaviours import BEHAVIOURS
from clearway.validation import Table

HURRY = 5.0
"""The most that a person walks or runs, m/s; sprinters do 10."""
INSTANT = 0.05
"""Time between the instants at which people may decide, s."""
_OWN = {
    "yields_at": {"still"}, "track": {"recorded"}, "route": {"orca", "crowdnav", "social-force", "headed-social-force"},
    "loop": {"orca", "social-force", "headed-social-force"},
    "speed": {"orca", "crowdnav", "social-force", "headed-social-force"}, "group": {"social-force", "headed-social-force"},
    "reaction": {"orca", "social-force", "headed-social-force", "recorded", "still"},
    "decides_every": {"orca", "social-force", "headed-social-force"},
}  # fmt: skip
"""By which of the shipped behaviours a field is read, where not by all."""


class StopSpec(Table):
    """A place to which a person walks."""

    at: Point = Field(description="m")
    wait: NonNegative = Field(default=0.0, le=3600, description="how long the person stays there, s")


class PersonSpec(Table):
    """One person, seen from above as a disc."""

    name: str = Field(min_length=1, description="unique in its scenario")
    start: Point = Field(description="where the person is at time 0, m; of a recorded one where the track begins")
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
    behaviour: str = Field(
        default="social-force",
        description="by which rule the person walks: `social-force`, `headed-social-force`, `orca`, `crowdnav`, `recorded`, `still`,"
        " or one of your own, as `my_pkg:MyBehaviour`",
    )
    track: tuple[tuple[Finite, Finite, Finite], ...] = Field(
        default=(),
        max_length=POINTS,
        description="recorded only: time since the trial began, x and y (s, m, m), times rising; in a file also the name of a CSV file with"
        " the columns t, x, y",
    )
    group: str = Field(default="", description="who walks together has the same; empty: alone (by social forces only)")
    sees_robots: bool = Field(default=True, description="whether the person keeps out of a robot's way")
    reaction: float = Field(
        default=0.3, strict=True, ge=0, le=2, description="how old what the person sees of robots is, s"
    )
    decides_every: float = Field(
        default=INSTANT,
        strict=True,
        ge=INSTANT,
        le=1,
        description="time from a decision to the next, s: a multiple of 0.05",
    )
    yields_at: Positive | None = Field(
        default=None,
        le=10,
        description="still only: steps out of the way of a robot that comes nearer than this, m; default: never",
    )

    @model_validator(mode="before")
    @classmethod
    def _starts_on_track(cls, given: Any) -> Any:
        if isinstance(given, dict) and "start" not in given and given.get("track"):
            with contextlib.suppress(TypeError, LookupError):  # what is wrong with it is said of the track
                return given | {"start": tuple(given["track"][0][1:])}
        return given

    def reads(self, name: str) -> bool:
        """Whether the field `name` means anything to somebody of this behaviour."""
        return name not in _OWN or self.behaviour not in set(BEHAVIOURS.shipped) - _OWN[name]

    @field_validator("behaviour")
    @classmethod
    def _known(cls, name: str) -> str:
        if ":" not in name and name not in BEHAVIOURS.addresses():
            raise ValueError(unknown("behaviour", name, BEHAVIOURS.addresses()).problem)
        return name

    @field_validator("decides_every")
    @classmethod
    def _at_instants(cls, every: float) -> float:
        if abs(every / INSTANT - round(every / INSTANT)) > 1e-6:
            raise ValueError(f"{every:g} s is no multiple of {INSTANT:g} s")
        return every

    @model_validator(mode="after")
    def _read(self) -> PersonSpec:
        for name in _OWN:
            if name in self.model_fields_set and not self.reads(name):
                raise ValueError(f"{name!r} means nothing to somebody whose behaviour is {self.behaviour!r}")
        if self.behaviour == "recorded":
            self._walkable()
        if self.behaviour == "crowdnav" and (len(self.route) != 1 or self.route[0].wait > 0.0):
            raise ValueError("somebody whose behaviour is 'crowdnav' needs a 'route' of one place, without a wait")
        return self

    def _walkable(self) -> None:
        if len(self.track) < 2:
            raise ValueError("somebody whose behaviour is 'recorded' needs a 'track' of at least two points")
        if math.dist(self.start, self.track[0][1:]) > 1e-6:
            raise ValueError(f"the start {self.start} is not where the track begins, {self.track[0][1:]}")
        for (t0, *a), (t1, *b) in itertools.pairwise(self.track):
            if t1 <= t0:
                raise ValueError(f"the times of the track do not rise: {t1:g} s after {t0:g} s")
            if math.dist(a, b) > HURRY * (t1 - t0):
                raise ValueError(
                    f"the track goes at {math.dist(a, b) / (t1 - t0):.1f} m/s at {t0:g} s; nobody here exceeds {HURRY:g} m/s"
                )

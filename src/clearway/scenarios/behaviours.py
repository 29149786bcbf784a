"""How people and moving obstacles decide while a trial goes on: what a scenario says of it.

`clearway.world.behaviours` has what each does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from pydantic import Field

from clearway.errors import ClearwayError
from clearway.quantities import Distance, NonNegative, Positive, Speed
from clearway.registry import Registry
from clearway.validation import Table

BEHAVIOURS = Registry(
    "behaviour",
    "clearway.behaviours",
    {
        "social-force": "clearway.world.behaviours.social_force:walkers",
        "headed-social-force": "clearway.world.behaviours.headed_social_force:walkers",
        "orca": "clearway.world.behaviours.orca:walkers",
        "crowdnav": "clearway.world.behaviours.crowdnav:CrowdNav",
        "recorded": "clearway.world.behaviours.recorded:Recorded",
        "still": "clearway.world.behaviours.still:Still",
    },
)
"""By which people go; each is a factory that is called with a `clearway.world.behaviours.behaviour.Cast`."""


def find_behaviour(name: str) -> Callable[..., Any]:
    """The class, or other factory, of the behaviour with a name or an address.

    Raises:
        ClearwayError: there is none, or it is nothing that can be called.
    """
    found = BEHAVIOURS.find(name)
    if not callable(found):
        raise ClearwayError(f"behaviour {name!r} is a {type(found).__name__}, not a class that makes a behaviour")
    factory: Callable[..., Any] = found
    return factory


class OperatorSpec(Table):
    """A person with a joystick, or who pushes a bed: goes along the path at the set speed, looks at the tested robot, and runs into nobody.

    Every number is a stand-in of ours, with its reason in `scenarios/DECISIONS.md`.
    """

    kind: Literal["operator"] = "operator"
    reaction: float = Field(default=0.3, strict=True, ge=0, le=2, description="how old what the person acts on is, s")
    stop_short: Distance = Field(default=0.5, description="left between it and what is in its way when it stands, m")
    beside: Distance = Field(
        default=0.1,
        description="a robot that is nearer to its way than this is in the way; left between it and anybody else that is, m",
    )
    foresight: NonNegative = Field(
        default=1.0, le=10, description="for how long the person takes the robot to drive on as it does, s"
    )
    line_keeping: float = Field(
        default=0.1, strict=True, ge=0, le=1, description="the most that it leaves its path by to either side, m"
    )
    patience: Positive = Field(default=3.0, le=3600, description="how long it stands before it backs off, s")
    backing: Speed = Field(default=0.1, description="speed at which it backs off, m/s")
    acceleration: Positive = Field(
        default=1.0, le=100, description="of its base, m/s^2; another robot's own where it is one"
    )
    deceleration: Positive = Field(default=1.0, le=100, description="the same of braking, m/s^2")

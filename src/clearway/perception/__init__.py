"""What the robot makes of its sensors: localisers (`truth`, `odometry`, `amcl`), mapping, and trackers of obstacles
(`difference`, `kalman`).
"""

from __future__ import annotations

from collections.abc import Callable

from clearway.contract import Localiser
from clearway.errors import unknown
from clearway.perception.amcl import Amcl
from clearway.perception.localisers import Odometry, Truth
from clearway.perception.parameters import AmclParameters, MappingParameters
from clearway.perception.trackers import TRACKERS, TrackerParameters, make_tracker
from clearway.robots import Robot

LOCALISERS: dict[str, Callable[[Robot], Localiser]] = {
    "amcl": lambda robot: Amcl(AmclParameters.read(robot)),
    "odometry": lambda robot: Odometry(),
    "truth": lambda robot: Truth(),
}
"""Name -> maker."""


def make_localiser(name: str, robot: Robot) -> Localiser:
    """The localiser `name` with the robot's parameters for it.

    Raises:
        ClearwayError: no such localiser, or a parameter in the robot's file is wrong.
    """
    if name not in LOCALISERS:
        raise unknown("localisation", name, LOCALISERS)
    return LOCALISERS[name](robot)


__all__ = [
    "LOCALISERS",
    "TRACKERS",
    "Amcl",
    "AmclParameters",
    "MappingParameters",
    "Odometry",
    "TrackerParameters",
    "Truth",
    "make_localiser",
    "make_tracker",
]

"""People who keep out of each other's way by optimal reciprocal collision avoidance."""

from __future__ import annotations

from clearway.world.behaviours.behaviour import Cast
from clearway.world.behaviours.walkers import Rule, Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by ORCA, as CrowdNav sets it for people: ten neighbours within 10 m, 5 s ahead."""
    return Walkers(cast, Rule.ORCA)

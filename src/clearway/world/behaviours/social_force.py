"""People who keep out of each other's way by social forces; groups stay together."""

from __future__ import annotations

from clearway.world.behaviours.behaviour import Cast
from clearway.world.behaviours.walkers import Rule, Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by social forces as Moussaïd et al. 2010 have them."""
    return Walkers(cast, Rule.SOCIAL_FORCE)

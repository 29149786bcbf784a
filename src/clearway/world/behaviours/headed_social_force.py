"""People who walk ahead: by social forces, but nobody goes sideways who isn't pushed."""

from __future__ import annotations

from clearway.world.behaviours.behaviour import Cast
from clearway.world.behaviours.walkers import Rule, Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by the headed social force model of Farina et al. 2017, on the forces of Moussaïd et al. 2010."""
    return Walkers(cast, Rule.HEADED_SOCIAL_FORCE)

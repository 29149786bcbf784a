"""People who keep out of each other's way by social forces; groups stay together."""

from __future__ import annotations

from clearway.crowds import social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import PERIOD, Cast
from clearway.world.behaviours.walkers import Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by social forces as Moussaïd et al. 2010 have them."""

    def rule(bodies: Bodies, wishes: Wishes, heading: FloatArray) -> tuple[FloatArray, None]:
        group = cast.groups(len(bodies.radius))
        return social_force.velocities(bodies, wishes, group, social_force.MOUSSAID, cast.walls, PERIOD), None

    return Walkers(cast, rule)

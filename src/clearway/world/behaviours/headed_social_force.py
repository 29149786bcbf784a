"""People who walk ahead: by social forces, but nobody goes sideways who isn't pushed."""

from __future__ import annotations

import numpy as np

from clearway.crowds import headed_social_force, social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.headed_social_force import FARINA, Facing
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import PERIOD, Cast
from clearway.world.behaviours.walkers import Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by the headed social force model of Farina et al. 2017, on the forces of Moussaïd et al. 2010."""
    turn_rate = np.zeros(len(cast.people))

    def rule(bodies: Bodies, wishes: Wishes, heading: FloatArray) -> tuple[FloatArray, FloatArray]:
        group, facing = cast.groups(len(bodies.radius)), Facing(heading, turn_rate)
        chosen, facing = headed_social_force.velocities(
            bodies, wishes, facing, group, social_force.MOUSSAID, FARINA, cast.walls, PERIOD
        )
        turn_rate[:] = facing.turn_rate
        return chosen, facing.heading

    return Walkers(cast, rule)

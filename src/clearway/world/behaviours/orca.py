"""People who keep out of each other's way by optimal reciprocal collision avoidance."""

from __future__ import annotations

import numpy as np

from clearway.crowds import orca
from clearway.crowds.bodies import Bodies, Wishes
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import PERIOD, Cast
from clearway.world.behaviours.walkers import Walkers


def walkers(cast: Cast) -> Walkers:
    """A crowd that walks by ORCA, as CrowdNav sets it for people: ten neighbours within 10 m, 5 s ahead."""
    k = len(cast.people)
    care = orca.Care(np.full(k, 10.0), np.full(k, 10, np.int64), np.full(k, 5.0), np.full(k, 1.0))

    def rule(bodies: Bodies, wishes: Wishes, heading: FloatArray) -> tuple[FloatArray, None]:
        return orca.velocities(bodies, wishes, care, cast.walls, PERIOD), None

    return Walkers(cast, rule)

"""What a behaviour is: it says where a body will be at its next decision.

It belongs to the world and may know the truth. It never decides for a robot that is tested.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from clearway.geometry.packing import Packed
from clearway.geometry.shapes import FloatArray
from clearway.world.laid import Laid

PERIOD = 0.05
"""Time from a decision to the next, s."""
ABSENT = np.full(3, np.nan)
"""The pose of a body that is not there."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenRobot:
    """A robot that drives in the world, as behaviours can see it.

    Attributes:
        shape: Its footprint, in the frame of its track.
        track: Where it has been up to now, map frame.
    """

    shape: Packed
    track: Laid


class Behaviour(Protocol):
    """Decides for one body.

    Attributes:
        speed: The most that it ever moves at, m/s.
    """

    speed: float

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """At time `t` [s] the tested robot begins the leg of this name.

        Returns:
            (3,) where the body is from now on, NaN if it isn't there; None: the legs don't concern it.
        """

    def step(self, t: float, until: float, robots: tuple[SeenRobot, ...]) -> FloatArray:
        """Decide at time `t` [s]: the pose (3,) at time `until`, NaN for none, with nothing known of what comes after `t`."""

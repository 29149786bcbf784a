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


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is there when behaviours decide.

    Attributes:
        moving: (m, 3) poses of all moving bodies, map frame; NaN where one is absent.
        before: (m, 3) the same `PERIOD` ago.
        robots: The robots that drive there.
    """

    moving: FloatArray
    before: FloatArray
    robots: tuple[SeenRobot, ...]


class Behaviour(Protocol):
    """Decides for one or several bodies.

    Attributes:
        members: Which of the moving bodies these are, by their places among them.
        speed: (n,) the most that each ever moves at, m/s.
    """

    members: tuple[int, ...]
    speed: FloatArray

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """At time `t` [s] the tested robot begins the leg of this name; the first at time 0.

        Returns:
            (n, 3) where the bodies are from now on, NaN where one isn't there; None: the legs don't concern them.
        """

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Decide at time `t` [s]: the poses (n, 3) at time `until`, NaN for none, with nothing known of what comes after `t`."""

"""Where a measured clearance says that the robot touched something, or may have."""

from __future__ import annotations

from clearway.geometry.shapes import FloatArray
from clearway.trials import Attempt, Event


def assess(
    attempt: Attempt, t: FloatArray, pose: FloatArray, movers: FloatArray, sigma: FloatArray | None
) -> tuple[Event, ...]:
    """Events `contact` and `possible contact`, in order of time.

    Args:
        t: (n,) s. pose: (n, 3) of the robot. movers: (n, m, 3) of the bodies without a pose. sigma: (n, 1 + m, 2) as
            `Trial.sigma`, None if unknown.
    """
    raise NotImplementedError

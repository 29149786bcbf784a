"""What is known of those who avoid each other, whichever rule they are thought to go by."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.bodies import Bodies, IntArray, Wishes
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SHARP = 0.03
"""Standard deviation of a velocity that a rule foretells, m/s, where rules are weighed."""
FADE, MOST = 0.9, 6.0
"""Share of what spoke for a rule that counts a period later, and the most that can, nats."""
STARTED = 0.1
"""Who has not been faster yet shows no wish, m/s."""


class Intents(NamedTuple):
    """What is known of those who move, if they go by one rule.

    Attributes:
        identity: (n,) int64, as the forecast has it.
        place: (n, 2) where each was perceived last, m.
        velocity: (n, 2) at which it came there, m/s.
        belief: (n, m) what the rule keeps of each one's wishes.
        wish: (n, 2) the velocity that it would move at alone, m/s; NaN: nothing is known of that.
        evidence: (n,) for the rule and against constant velocity, nats.
    """

    identity: npt.NDArray[np.int64]
    place: FloatArray
    velocity: FloatArray
    belief: FloatArray
    wish: FloatArray
    evidence: FloatArray


def nobody(beliefs: int) -> Intents:
    """Nobody is known, to a rule that keeps so many numbers of each one's wishes."""
    return Intents(
        np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.empty((0, beliefs)), np.empty((0, 2)), np.empty(0)
    )


@kernel
def bodies_of(place: FloatArray, velocity: FloatArray, radius: FloatArray) -> Bodies:
    """Discs that all avoid each other."""
    n = len(radius)
    return Bodies(place.copy(), velocity.copy(), radius.copy(), np.ones(n, np.int64), np.full(n, 0.5))


@kernel
def wishes_of(intents: Intents, faster: float) -> Wishes:
    """What each wants, or else goes on as it goes; nobody is more than `faster` times as fast as it wants to be."""
    n = len(intents.identity)
    wishes = Wishes(np.arange(n), intents.velocity.copy(), np.full(n, STARTED), np.ones(n, np.int64))
    for i in range(n):
        if math.isfinite(intents.wish[i, 0]):
            wishes.velocity[i] = intents.wish[i]
        wishes.v_max[i] = max(faster * math.hypot(wishes.velocity[i, 0], wishes.velocity[i, 1]), STARTED)
    return wishes


@kernel
def followed(
    known: Intents, dt: float, identity: npt.NDArray[np.int64], place: FloatArray, radius: FloatArray
) -> tuple[Intents, IntArray, FloatArray]:
    """Those who are at `place` (n, 2) now, with nothing learnt yet but velocities.

    Args:
        known: What was known before.
        dt: How long before, s; not above 0, or NaN: nobody was.
        identity: (n,) of them.
        place: (n, 2) m.
        radius: (n,) m.

    Returns:
        Them; (n,) which of `known` each was, -1: none; and the radius of each of `known`, m, 0 of who is gone.
    """
    n, m = len(identity), len(known.identity)
    now = Intents(
        identity.copy(), place.copy(), np.zeros((n, 2)), np.zeros((n, known.belief.shape[1])), np.full((n, 2), np.nan),
        np.zeros(n),
    )  # fmt: skip
    was, size = np.full(n, -1, np.int64), np.zeros(m)
    if not dt > 0.0:
        return now, was, size
    for i in range(n):
        for j in range(m):
            if known.identity[j] == identity[i]:
                was[i], size[j] = j, radius[i]
                now.velocity[i] = (place[i] - known.place[j]) / dt
    return now, was, size


@kernel
def gathered(before: float, straight: float, foretold: float, doubt: float) -> float:
    """The evidence for a rule after a velocity was seen, nats.

    Args:
        before: The evidence until then, nats.
        straight: How far the velocity is from the one before, m/s.
        foretold: How far it is from what the rule foretold, m/s.
        doubt: Its variance, m^2/s^2.
    """
    return FADE * before + 0.5 * (straight * straight - foretold * foretold) / (SHARP * SHARP + doubt)

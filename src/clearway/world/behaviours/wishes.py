"""What people want: the scenario says so, or it is drawn from the seed of the trial."""

from __future__ import annotations

import itertools

from clearway.geometry.streams import normal, stream
from clearway.scenarios.people import PersonSpec
from clearway.trials import Wish

MEAN_SPEED, SPREAD = 1.34, 0.26
"""Of pedestrians, m/s (Weidmann 1993)."""


def wish_of(person: PersonSpec, seed: int) -> Wish:
    """What a person wants in the trial of this seed."""
    if person.behaviour == "still":
        return Wish(0.0)
    if person.behaviour == "recorded":
        return Wish(None, (person.track[-1][1:],))
    return Wish(speed_of(person, seed), tuple(stop.at for stop in person.route), person.group)


def speed_of(person: PersonSpec, seed: int) -> float:
    """The speed that a person prefers, m/s: the scenario's, or drawn from the seed of the trial."""
    if person.speed is not None:
        return person.speed
    key = stream(seed, f"person {person.name}")
    drawn = (normal(key, 0, k) for k in itertools.count())
    return MEAN_SPEED + SPREAD * next(z for z in drawn if abs(z) <= 2.0)

"""When people come to the places of their routes, and how far they walked to get there: judged by where they are.

So it is known of whoever has a route, whatever behaviour they go by; but of those who are on recorded ways, or stand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.people import PersonSpec
from clearway.world.behaviours.routes import ARRIVED

_UNDECIDED = ("recorded", "still")
"""Behaviours of those who go nowhere of their own."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """Somebody came to a place of the route.

    Attributes:
        t: When, s since the trial began.
        path: How far the person had walked by then, m.
    """

    t: float
    path: float


class Watched(NamedTuple):
    """k people who go to places.

    Attributes:
        rows: (k,) int64, which of the moving bodies they are.
        at: (k, 2) where each was when last looked at, m.
        path: (k,) how far each has walked, m.
        place: (k, 2) where each is going, m.
        until: (k,) who waits somewhere does so until then, s; inf: for good.
        come: (k,) whether each has come to where it is going, when last looked at.
    """

    rows: npt.NDArray[np.int64]
    at: FloatArray
    path: FloatArray
    place: FloatArray
    until: FloatArray
    come: npt.NDArray[np.bool_]


class Arrivals:
    """Those of the people of a scenario.

    Args:
        people: Who they are.
        first: Which of the moving bodies is the first of them.

    Attributes:
        reached: By person, by number among `people`, who goes to places: where they have come to, in order. A route that begins
            anew has ever more places.
        watched: Where these are, and are going.
    """

    def __init__(self, people: Sequence[PersonSpec], first: int) -> None:
        who = [k for k, p in enumerate(people) if p.route and p.behaviour not in _UNDECIDED]
        self.reached: dict[int, list[Arrival]] = {k: [] for k in who}
        self._who, self._people = who, people
        self.watched = Watched(
            rows=first + np.array(who, np.int64),
            at=np.full((len(who), 2), np.nan),
            path=np.zeros(len(who)),
            place=np.array([people[k].route[0].at for k in who], np.float64).reshape(-1, 2),
            until=np.full(len(who), -math.inf),
            come=np.zeros(len(who), np.bool_),
        )

    def look(self, t: float, moving: FloatArray) -> None:
        """At time `t` [s] all that moves is at `moving` (m, 3), NaN where one is absent."""
        if self._who and walked(t, moving, self.watched):
            self.come_to(t)

    def come_to(self, t: float) -> None:
        """At time `t` [s], when they were last looked at, some of those who are watched may have come to where they were going."""
        for i in np.flatnonzero(self.watched.come).tolist():
            self._arrive(i, t)

    def _arrive(self, i: int, t: float) -> None:
        person, reached = self._people[self._who[i]], self.reached[self._who[i]]
        places, now = person.route, self.watched
        at = now.at[i].tolist()
        while t >= now.until[i] and math.dist(now.place[i].tolist(), at) <= ARRIVED:
            here = len(reached) % len(places)
            reached.append(Arrival(t, float(now.path[i])))
            now.until[i] = t + places[here].wait
            if here + 1 == len(places) and not person.loop:
                now.until[i] = math.inf
                return
            now.place[i] = places[(here + 1) % len(places)].at
            if here + 1 == len(places):
                return

    def bound_for(self, t: float) -> dict[int, int]:
        """By person: the place that it walks to at time `t` [s], by number, or at which it stays."""
        found = {}
        for k, until in zip(self._who, self.watched.until.tolist(), strict=True):
            count = len(self.reached[k])
            found[k] = count - 1 if t < until else count
        return found

    def come(self, places: Mapping[int, int]) -> bool:
        """Whether each of these people has come to its place, by number."""
        return all(len(self.reached[k]) > place for k, place in places.items())

    def at(self, k: int, place: int) -> Arrival | None:
        """When person `k` came to a place; None: it has not yet."""
        reached = self.reached[k]
        return reached[place] if place < len(reached) else None


@light
def walked(t: float, moving: FloatArray, now: Watched) -> bool:
    """Take note of where people are now.

    Args:
        t: Now, s.
        moving: (m, 3) where everything that moves is, NaN where one is absent.
        now: Who is watched; updated.

    Returns:
        Whether anybody has come to where it was going.
    """
    any_come = False
    for k in range(len(now.rows)):
        x, y = moving[now.rows[k], 0], moving[now.rows[k], 1]
        step = math.hypot(x - now.at[k, 0], y - now.at[k, 1])
        if math.isfinite(step):
            now.path[k] += step
        now.at[k, 0], now.at[k, 1] = x, y
        now.come[k] = t >= now.until[k] and math.hypot(x - now.place[k, 0], y - now.place[k, 1]) <= ARRIVED
        any_come |= now.come[k]
    return any_come

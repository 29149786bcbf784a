"""When people come to the places of their routes, and how far they walked to get there: judged by where they are.

So it is known of whoever has a route, whatever behaviour they go by; but of those who are on recorded ways, or stand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
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


class Arrivals:
    """Those of the people of a scenario.

    Args:
        people: Who they are.
        first: Which of the moving bodies is the first of them.

    Attributes:
        reached: By person, by number among `people`, who goes to places: where they have come to, in order. A route that begins
            anew has ever more places.
    """

    def __init__(self, people: Sequence[PersonSpec], first: int) -> None:
        who = [k for k, p in enumerate(people) if p.route and p.behaviour not in _UNDECIDED]
        self.reached: dict[int, list[Arrival]] = {k: [] for k in who}
        self._who, self._people = who, people
        self._rows = first + np.array(who, np.int64)
        self._place = np.array([people[k].route[0].at for k in who], np.float64).reshape(-1, 2)
        self._until = np.full(len(who), -math.inf)  # who waits somewhere does so until then, s; inf: for good
        self._path = np.zeros(len(who))
        self._at = np.full((len(who), 2), np.nan)

    def look(self, t: float, moving: FloatArray) -> None:
        """At time `t` [s] all that moves is at `moving` (m, 3), NaN where one is absent."""
        if not self._who:
            return
        if walked(t, moving, self._rows, self._at, self._path, self._place, self._until):
            away = self._at - self._place
            for i in np.flatnonzero((np.hypot(away[:, 0], away[:, 1]) <= ARRIVED) & (t >= self._until)).tolist():
                self._arrive(i, t)

    def _arrive(self, i: int, t: float) -> None:
        person, reached = self._people[self._who[i]], self.reached[self._who[i]]
        places, at = person.route, self._at[i].tolist()
        while t >= self._until[i] and math.dist(self._place[i].tolist(), at) <= ARRIVED:
            here = len(reached) % len(places)
            reached.append(Arrival(t, float(self._path[i])))
            self._until[i] = t + places[here].wait
            if here + 1 == len(places) and not person.loop:
                self._until[i] = math.inf
                return
            self._place[i] = places[(here + 1) % len(places)].at
            if here + 1 == len(places):
                return

    def bound_for(self, t: float) -> dict[int, int]:
        """By person: the place that it walks to at time `t` [s], by number, or at which it stays."""
        found = {}
        for k, until in zip(self._who, self._until.tolist(), strict=True):
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


@kernel
def walked(
    t: float, moving: FloatArray, rows: npt.NDArray[np.int64], at: FloatArray, path: FloatArray, place: FloatArray,
    until: FloatArray,
) -> bool:  # fmt: skip
    """Take note of where people are now.

    Args:
        t: Now, s.
        moving: (m, 3) where everything that moves is, NaN where one is absent.
        rows: (k,) which of them they are.
        at: (k, 2) where each was; updated.
        path: (k,) how far each has walked, m; updated.
        place: (k, 2) where each is going.
        until: (k,) who waits somewhere does so until then, s.

    Returns:
        Whether anybody has come to where it was going.
    """
    come = False
    for k in range(len(rows)):
        x, y = moving[rows[k], 0], moving[rows[k], 1]
        step = math.hypot(x - at[k, 0], y - at[k, 1])
        if math.isfinite(step):
            path[k] += step
        at[k, 0], at[k, 1] = x, y
        if t >= until[k] and math.hypot(x - place[k, 0], y - place[k, 1]) <= ARRIVED:
            come = True
    return come

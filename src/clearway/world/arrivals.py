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
NOTES = 64
"""Arrivals for which there is room beyond what may come at once, until they are written down."""


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
        stops: (p, 2) the places of all routes, one route after another, m.
        waits: (p,) how long they are stayed at, s.
        first: (k + 1,) int64, the places of person i are those from first[i] to first[i + 1].
        loop: (k,) whether each route begins anew.
        reached: (k,) int64, to how many places each has come.
        noted: (n, 3) who came to a place, when [s], and how far that person had walked [m], not yet written down.
        notes: (1,) int64, how many of these there are.
    """

    rows: npt.NDArray[np.int64]
    at: FloatArray
    path: FloatArray
    place: FloatArray
    until: FloatArray
    stops: FloatArray
    waits: FloatArray
    first: npt.NDArray[np.int64]
    loop: npt.NDArray[np.bool_]
    reached: npt.NDArray[np.int64]
    noted: FloatArray
    notes: npt.NDArray[np.int64]


class Arrivals:
    """Those of the people of a scenario.

    Args:
        people: Who they are.
        first: Which of the moving bodies is the first of them.

    Attributes:
        reached: By person, by number among `people`, who goes to places: where they have come to, in order, as far as that is
            written down. A route that begins anew has ever more places.
        watched: Where these are, and are going.
    """

    def __init__(self, people: Sequence[PersonSpec], first: int) -> None:
        who = [k for k, p in enumerate(people) if p.route and p.behaviour not in _UNDECIDED]
        self.reached: dict[int, list[Arrival]] = {k: [] for k in who}
        self._who = who
        stops = [stop for k in who for stop in people[k].route]
        self.watched = Watched(
            rows=first + np.array(who, np.int64),
            at=np.full((len(who), 2), np.nan),
            path=np.zeros(len(who)),
            place=np.array([people[k].route[0].at for k in who], np.float64).reshape(-1, 2),
            until=np.full(len(who), -math.inf),
            stops=np.array([stop.at for stop in stops], np.float64).reshape(-1, 2),
            waits=np.array([stop.wait for stop in stops], np.float64),
            first=np.cumsum([0, *(len(people[k].route) for k in who)], dtype=np.int64),
            loop=np.array([people[k].loop for k in who], np.bool_),
            reached=np.zeros(len(who), np.int64),
            noted=np.empty((NOTES + 2 * len(stops), 3)),
            notes=np.zeros(1, np.int64),
        )

    def look(self, t: float, moving: FloatArray) -> None:
        """At time `t` [s] all that moves is at `moving` (m, 3), NaN where one is absent."""
        if self._who and walked(t, moving, self.watched):
            self.take_note()

    def take_note(self) -> None:
        """Write down who has come where since the last time, so that there is room for more."""
        now = self.watched
        for i, t, path in now.noted[: now.notes[0]].tolist():
            self.reached[self._who[int(i)]].append(Arrival(t, path))
        now.notes[0] = 0

    def bound_for(self, t: float) -> dict[int, int]:
        """By person: the place that it walks to at time `t` [s], by number, or at which it stays."""
        self.take_note()
        found = {}
        for k, until in zip(self._who, self.watched.until.tolist(), strict=True):
            count = len(self.reached[k])
            found[k] = count - 1 if t < until else count
        return found

    def come(self, places: Mapping[int, int]) -> bool:
        """Whether each of these people has come to its place, by number."""
        self.take_note()
        return all(len(self.reached[k]) > place for k, place in places.items())

    def at(self, k: int, place: int) -> Arrival | None:
        """When person `k` came to a place; None: it has not yet."""
        self.take_note()
        reached = self.reached[k]
        return reached[place] if place < len(reached) else None


@light
def walked(t: float, moving: FloatArray, now: Watched) -> bool:
    """Take note of where people are now, and who has come to where it was going.

    Args:
        t: Now, s.
        moving: (m, 3) where everything that moves is, NaN where one is absent.
        now: Who is watched; updated.

    Returns:
        Whether that is to be written down, as there may be no room for more.
    """
    for k in range(len(now.rows)):
        x, y = moving[now.rows[k], 0], moving[now.rows[k], 1]
        step = math.hypot(x - now.at[k, 0], y - now.at[k, 1])
        if math.isfinite(step):
            now.path[k] += step
        now.at[k, 0], now.at[k, 1] = x, y
        first, end = now.first[k], now.first[k + 1]
        while t >= now.until[k] and math.hypot(x - now.place[k, 0], y - now.place[k, 1]) <= ARRIVED:
            here, n = first + now.reached[k] % (end - first), now.notes[0]
            now.noted[n, 0], now.noted[n, 1], now.noted[n, 2] = k, t, now.path[k]
            now.notes[0] += 1
            now.reached[k] += 1
            now.until[k] = t + now.waits[here]
            if here + 1 == end and not now.loop[k]:
                now.until[k] = math.inf
                break
            following = here + 1 if here + 1 < end else first
            now.place[k, 0], now.place[k, 1] = now.stops[following, 0], now.stops[following, 1]
            if here + 1 == end:
                break
    return bool(now.notes[0] + len(now.stops) > len(now.noted))

"""Where people are on their routes, and how they would walk if they were alone."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.ways import Room, Ways, way_point, ways_to
from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.scenarios.people import PersonSpec

AHEAD = 4.0
"""How far along the way a person looks for the place to head for, m."""
ARRIVED = 0.3
"""So near to a place of the route the next one is walked to, m."""
STOPPING = 1.0
"""Who comes to stay somewhere slows down so as to be there in no less than this, s."""
HELD_UP, PATIENCE, SIDESTEP, ASIDE = 0.3, 1.0, 1.0, 2.0
"""Who comes no faster than this share of the preferred speed for so long, s, heads so far to the right, rad, for so long, s:
those who give way to each other exactly would stand for ever."""
STRAYING = 0.02
"""By how much a person's course errs at most, rad: two who want exactly through each other would stand for ever."""
KNOWN_BYTES = 64 << 20
"""So much of the distances to places is kept for other trials on the same floor, the oldest forgotten first."""
_KNOWN: dict[tuple[bytes, tuple[float, float], float], FloatArray] = {}


class OnRoute(NamedTuple):
    """Where k people are on their routes.

    Attributes:
        speed: (k,) that each prefers, m/s.
        radius: (k,) m.
        keys: (k,) of what is drawn for each.
        place: (k, 2) where each walks to, or stays, m.
        walks: (k,) whether it walks there.
        stays: (k,) whether it is to stand there.
        due: (k,) when it walks on from where it stays, s; inf: it walks, or stays for good.
        slot: (k,) which of the distances are those to its place.
        distance: (n, rows, columns) see `Ways`.
        room: Where what stands leaves how much.
        moved: (k,) when each last came on, s.
        aside: (k,) until when each heads to the right, s.
        decided: (1,) int64, how often they have.
        news: (k,) who has come to a place or is to walk on, when last looked at.
    """

    speed: FloatArray
    radius: FloatArray
    keys: npt.NDArray[np.uint64]
    place: FloatArray
    walks: npt.NDArray[np.bool_]
    stays: npt.NDArray[np.bool_]
    due: FloatArray
    slot: npt.NDArray[np.int64]
    distance: FloatArray
    room: Room
    moved: FloatArray
    aside: FloatArray
    decided: npt.NDArray[np.int64]
    news: npt.NDArray[np.bool_]


class Routes:
    """Those of a crowd.

    Args:
        people: Who they are.
        speed: (k,) that each prefers, m/s.
        room: Where what stands leaves how much.
        seed: Of the trial.

    Attributes:
        now: Where the people are on them.
    """

    def __init__(self, people: Sequence[PersonSpec], speed: FloatArray, room: Room, seed: int) -> None:
        k = len(people)
        self._people, self._room = people, room
        self._stop, self._until = [0] * k, [-math.inf] * k
        self._held: list[tuple[float, float]] = [person.start for person in people]
        self._slots: dict[tuple[tuple[float, float], float], int] = {}
        self._floor = hashlib.blake2b(room.clearance.tobytes() + room.origin.tobytes(), digest_size=16).digest()
        self.now = OnRoute(
            speed=speed,
            radius=np.array([person.radius for person in people]),
            keys=np.array([stream(seed, f"person {person.name}") for person in people], np.uint64),
            place=np.array(self._held),
            walks=np.zeros(k, np.bool_),
            stays=np.ones(k, np.bool_),
            due=np.zeros(k),
            slot=np.zeros(k, np.int64),
            distance=np.empty((2 * k, *room.clearance.shape)),
            room=room,
            moved=np.zeros(k),
            aside=np.full(k, -math.inf),
            decided=np.zeros(1, np.int64),
            news=np.zeros(k, np.bool_),
        )

    def go_on(self, t: float, at: FloatArray) -> None:
        """Of the people, at `at` (k, 3) at time `t` [s], who has come to a place of its route, or has stayed there long enough, goes on:
        see `any_news`."""
        for k in np.flatnonzero(self.now.news).tolist():
            self._go_on(k, t, *at[k, :2].tolist())

    def _go_on(self, k: int, t: float, x: float, y: float) -> None:
        route, loop = self._people[k].route, self._people[k].loop
        stop = self._stop[k]
        while stop < len(route) and t >= self._until[k] and math.dist(route[stop].at, (x, y)) <= ARRIVED:
            self._held[k], self._until[k] = route[stop].at, t + route[stop].wait
            stop += 1
            if stop == len(route) and loop:
                stop = 0
                break
        walks = stop < len(route) and t >= self._until[k]
        place = route[stop].at if walks else self._held[k]
        now = self.now
        self._stop[k], now.walks[k], now.place[k] = stop, walks, place
        now.stays[k] = not walks or route[stop].wait > 0.0 or (stop == len(route) - 1 and not loop)
        now.due[k] = self._until[k] if not walks and stop < len(route) else math.inf
        now.slot[k] = -1
        now.slot[k] = self._slot_of((place, self._people[k].radius))

    def _slot_of(self, key: tuple[tuple[float, float], float]) -> int:
        """Where the distances to a place, for somebody of a radius, are kept."""
        if key in self._slots:
            return self._slots[key]
        if len(self._slots) < len(self.now.distance):
            slot = len(self._slots)
        else:  # nobody needs the oldest of these now
            used = set(self.now.slot.tolist())
            old = next(other for other, where in self._slots.items() if where not in used)
            slot = self._slots.pop(old)
        self.now.distance[slot] = self._distance(key)
        self._slots[key] = slot
        return slot

    def _distance(self, key: tuple[tuple[float, float], float]) -> FloatArray:
        """The distances themselves."""
        known = (self._floor, *key)
        if known not in _KNOWN:
            distance = ways_to(np.array(key[0]), self._room, key[1]).distance
            while _KNOWN and (len(_KNOWN) + 1) * distance.nbytes > KNOWN_BYTES:
                del _KNOWN[next(iter(_KNOWN))]
            _KNOWN[known] = distance
        return _KNOWN[known]


@light
def any_news(t: float, at: FloatArray, now: OnRoute) -> bool:
    """Whether at time `t` [s] anybody of those at `at` (k, 3) has come to where it walks, or is to walk on."""
    found = False
    for k in range(len(at)):
        come = now.walks[k] and math.hypot(now.place[k, 0] - at[k, 0], now.place[k, 1] - at[k, 1]) <= ARRIVED
        now.news[k] = come or t >= now.due[k]
        found |= now.news[k]
    return found


@light
def wish(t: float, at: FloatArray, velocity: FloatArray, now: OnRoute, out: FloatArray) -> None:
    """Write the velocities at which people would walk alone to `out` (k, 2), m/s.

    Args:
        t: Now, s.
        at: (k, 3) where they are.
        velocity: (k, 2) at which they walk now, m/s.
        now: Where they are on their routes; updated.
    """
    for k in range(len(at)):
        x, y, place = at[k, 0], at[k, 1], now.place[k]
        tx, ty, _ = way_point(Ways(now.distance[now.slot[k]], now.room, place, now.radius[k]), x, y, AHEAD)
        wanted = now.speed[k]
        if now.stays[k] and tx == place[0] and ty == place[1]:
            wanted = min(wanted, math.hypot(tx - x, ty - y) / STOPPING)
        course = math.atan2(ty - y, tx - x) + STRAYING * (2.0 * uniform(now.keys[k], 1, now.decided[0]) - 1.0)
        if math.hypot(velocity[k, 0], velocity[k, 1]) >= HELD_UP * wanted:
            now.moved[k] = t
        elif t > now.moved[k] + PATIENCE:
            now.aside[k] = t + ASIDE
        if t < now.aside[k]:
            course -= SIDESTEP
        out[k, 0], out[k, 1] = wanted * math.cos(course), wanted * math.sin(course)
    now.decided[0] += 1

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
SETTLING = 2.0
"""Nearer than that to where it is to stand, and with that in view, one of a group goes there alone, m: their places may be farther apart
than they walk."""
STOPPING = 1.0
"""Who comes to stay somewhere slows down so as to be there in no less than this, s."""
HELD_UP, PATIENCE, ASIDE = 0.3, 1.0, 2.0
"""Who comes no faster than this share of the preferred speed for so long, s, heads elsewhere for so long, s: those who give way to each
other exactly would stand for ever."""
ELSEWHERE = (-1.0, 1.0, math.pi)
"""To the right first, rad; to the left when soon after held up again; then back, out of the way."""
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
        stops: (p + k, 2) the places of the routes, one route after another, then where each starts, m.
        waits: (p,) how long they are stayed at, s.
        first: (k + 1,) int64, the places of person i are those from first[i] to first[i + 1].
        loop: (k,) whether each route begins anew.
        group: (k,) int64, with whom each goes: who has the same; negative: alone.
        come: (k,) int64, to how many places each has come.
        stop: (k,) int64, which place of its route each heads for next.
        held: (k,) int64, at which of `stops` each was last.
        until: (k,) until when it stays there, s.
        bound: (k,) int64, which of `stops` `place` is.
        place: (k, 2) where each walks to, or stays, m.
        walks: (k,) whether it walks there.
        stays: (k,) whether it is to stand there.
        settles: (k,) whether it is where it is to stand, or nearly, see `SETTLING`.
        due: (k,) when it walks on from where it stays, s; inf: it walks, or stays for good; -inf: it may walk on, once its group does.
        slot: (k,) int64, which of the distances are those to its place; negative: they are to be looked up.
        slots: (p + k,) int64, the same of all `stops`.
        distance: (n, rows, columns) see `Ways`.
        room: Where what stands leaves how much.
        moved: (k,) when each last came on, s.
        aside: (k,) until when each heads elsewhere, s.
        tries: (k,) int64, how often each has without coming on since.
        decided: (1,) int64, how often they have.
    """

    speed: FloatArray
    radius: FloatArray
    keys: npt.NDArray[np.uint64]
    stops: FloatArray
    waits: FloatArray
    first: npt.NDArray[np.int64]
    loop: npt.NDArray[np.bool_]
    group: npt.NDArray[np.int64]
    come: npt.NDArray[np.int64]
    stop: npt.NDArray[np.int64]
    held: npt.NDArray[np.int64]
    until: FloatArray
    bound: npt.NDArray[np.int64]
    place: FloatArray
    walks: npt.NDArray[np.bool_]
    stays: npt.NDArray[np.bool_]
    settles: npt.NDArray[np.bool_]
    due: FloatArray
    slot: npt.NDArray[np.int64]
    slots: npt.NDArray[np.int64]
    distance: FloatArray
    room: Room
    moved: FloatArray
    aside: FloatArray
    tries: npt.NDArray[np.int64]
    decided: npt.NDArray[np.int64]


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
        named = [person.group for person in people]
        self._room = room
        self._floor = hashlib.blake2b(room.clearance.tobytes() + room.origin.tobytes(), digest_size=16).digest()
        self._ends = [
            *((stop.at, person.radius) for person in people for stop in person.route),
            *((person.start, person.radius) for person in people),
        ]
        first = np.cumsum([0, *(len(person.route) for person in people)], dtype=np.int64)
        self._slots: dict[tuple[tuple[float, float], float], int] = {}
        self.now = OnRoute(
            speed=speed,
            radius=np.array([person.radius for person in people]),
            keys=np.array([stream(seed, f"person {person.name}") for person in people], np.uint64),
            stops=np.array([place for place, _ in self._ends]),
            waits=np.array([stop.wait for person in people for stop in person.route], np.float64),
            first=first,
            loop=np.array([person.loop for person in people], np.bool_),
            group=np.array([named.index(name) if name else -1 for name in named], np.int64),
            come=np.zeros(k, np.int64),
            stop=np.zeros(k, np.int64),
            held=first[-1] + np.arange(k),
            until=np.full(k, -math.inf),
            bound=first[-1] + np.arange(k),
            place=np.array([person.start for person in people]),
            walks=np.zeros(k, np.bool_),
            stays=np.ones(k, np.bool_),
            settles=np.zeros(k, np.bool_),
            due=np.zeros(k),
            slot=np.zeros(k, np.int64),
            slots=np.full(len(self._ends), -1),
            distance=np.empty((2 * k, *room.clearance.shape)),
            room=room,
            moved=np.zeros(k),
            aside=np.full(k, -math.inf),
            tries=np.zeros(k, np.int64),
            decided=np.zeros(1, np.int64),
        )

    def look_up(self) -> None:
        """Find the distances to where people are bound for who lack them."""
        for k in np.flatnonzero(self.now.slot < 0).tolist():
            self.now.slot[k] = self._slot_of(int(self.now.bound[k]))

    def _slot_of(self, end: int) -> int:
        """Where the distances to this of the places, for somebody of the radius of who goes there, are kept."""
        key = self._ends[end]
        if key not in self._slots:
            if len(self._slots) < len(self.now.distance):
                slot = len(self._slots)
            else:  # nobody needs the oldest of these now
                used = set(self.now.slot.tolist())
                old = next(other for other, where in self._slots.items() if where not in used)
                slot = self._slots.pop(old)
                self.now.slots[self.now.slots == slot] = -1
            self.now.distance[slot] = self._distance(key)
            self._slots[key] = slot
        self.now.slots[end] = self._slots[key]
        return self._slots[key]

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
def go_on(t: float, at: FloatArray, now: OnRoute) -> bool:
    """At time `t` [s] everybody of those at `at` (k, 3) goes on who has come to a place of the route, or has stayed there long enough;
    who belongs to a group does so with all of it.

    Args:
        t: Now, s.
        at: Where they are.
        now: Where they are on their routes; updated.

    Returns:
        Whether somebody lacks the distances to where it is bound for: they are to be looked up.
    """
    for k in range(len(at)):
        x, y = at[k, 0], at[k, 1]
        if t < now.due[k] and not (now.walks[k] and _apart(now.place, k, x, y) <= ARRIVED):
            continue
        first, end, stop = now.first[k], now.first[k + 1], now.first[k] + now.stop[k]
        while stop < end and t >= now.until[k] and _apart(now.stops, stop, x, y) <= ARRIVED:
            now.held[k], now.until[k] = stop, t + now.waits[stop]
            now.come[k] += 1
            stop += 1
            if stop == end and now.loop[k]:
                stop = first
                break
        now.stop[k], now.due[k] = stop - first, -math.inf
    lacking = False
    for k in range(len(at)):
        if t < now.due[k]:
            continue
        first, end, stop = now.first[k], now.first[k + 1], now.first[k] + now.stop[k]
        walks = stop < end and t >= now.until[k] and _all_come(t, k, now)
        now.walks[k], now.bound[k] = walks, stop if walks else now.held[k]
        now.place[k, 0], now.place[k, 1] = now.stops[now.bound[k], 0], now.stops[now.bound[k], 1]
        now.stays[k] = not walks or now.waits[stop] > 0.0 or (stop == end - 1 and not now.loop[k])
        if walks or stop == end:
            now.due[k] = math.inf
        elif t < now.until[k]:
            now.due[k] = now.until[k]
        now.slot[k] = now.slots[now.bound[k]]
        lacking |= now.slot[k] < 0
    return lacking


@light
def _all_come(t: float, k: int, now: OnRoute) -> bool:
    """Whether all of the group of person `k` have come as far on their routes, and have stayed there long enough by time `t` [s]."""
    if now.group[k] < 0:
        return True
    for j in range(len(now.group)):
        ends = now.first[j] + now.stop[j] == now.first[j + 1]
        behind = now.come[j] < now.come[k] or (now.come[j] == now.come[k] and t < now.until[j])
        if now.group[j] == now.group[k] and behind and not ends:
            return False
    return True


@light
def _apart(places: FloatArray, k: int, x: float, y: float) -> float:
    """How far (x, y) is from one of `places` (n, 2), m."""
    return math.hypot(places[k, 0] - x, places[k, 1] - y)


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
        left = math.hypot(tx - x, ty - y)
        ends = now.stays[k] and tx == place[0] and ty == place[1]
        now.settles[k] = ends and left < SETTLING
        if ends:
            wanted = min(wanted, left / STOPPING)
        course = math.atan2(ty - y, tx - x) + STRAYING * (2.0 * uniform(now.keys[k], 1, now.decided[0]) - 1.0)
        if math.hypot(velocity[k, 0], velocity[k, 1]) >= HELD_UP * wanted:
            now.moved[k] = t
            if t > now.aside[k] + PATIENCE:
                now.tries[k] = 0
        elif t > max(now.moved[k], now.aside[k]) + PATIENCE:
            now.aside[k] = t + ASIDE
            now.tries[k] += 1
        if t < now.aside[k]:
            course += ELSEWHERE[(now.tries[k] - 1) % len(ELSEWHERE)]
        out[k, 0], out[k, 1] = wanted * math.cos(course), wanted * math.sin(course)
    now.decided[0] += 1

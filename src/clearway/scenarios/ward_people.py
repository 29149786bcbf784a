"""Who goes about in the suites `ward-day`: staff, patients and visitors, each between places of their own.

The places where somebody stays are nobody else's, so that none waits for another to leave. Who comes later takes what is left: the first
five of ten people are those of five. Everybody has one in the waiting area, which so says how many the floor holds.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from clearway.errors import ClearwayError
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.people import PersonSpec, StopSpec
from clearway.scenarios.suite import draw
from clearway.scenarios.ward_floors import RADIUS, Place, Ward, places

_CORRIDOR, _WAITING = "corridor", "waiting area"


@dataclass(frozen=True, slots=True)
class _Stop:
    """Where a role goes.

    Attributes:
        kinds: Of rooms; where all of these are full somebody walks down the corridor instead.
        wait: How long somebody stays, drawn evenly between the two, s.
        near: At which of the ward's places, if at one of them.
    """

    kinds: tuple[str, ...]
    wait: tuple[float, float]
    near: Literal["", "reception", "entrance"] = ""


@dataclass(frozen=True, slots=True)
class _Role:
    """What somebody does there.

    Attributes:
        stops: Where to, one after another, and again.
        speed: Preferred, drawn evenly between the two, m/s; None: as `PersonSpec` has it.
        together: How many go together.
    """

    stops: tuple[_Stop, ...]
    speed: tuple[float, float] | None = None
    together: int = 1


SLOW = (0.46, 0.74)
"""Usual gait speed of people of 70 and more in acute care and of those who come in from outside, m/s (Peel, Kuys, Klein 2013, J Gerontol A
68:39, a meta-analysis of 48 studies)."""
_ROLES = {
    "staff": _Role((
        _Stop(("store", "examination room"), (5.0, 20.0)), _Stop(("patient room",), (5.0, 20.0)),
        _Stop((_WAITING,), (5.0, 20.0), "reception"),
    )),
    "inpatient": _Role((
        _Stop(("patient room",), (10.0, 40.0)), _Stop((_CORRIDOR,), (0.0, 0.0)), _Stop((_WAITING,), (10.0, 40.0)),
    ), SLOW),
    "outpatient": _Role((
        _Stop((_WAITING,), (20.0, 60.0)), _Stop(("examination room",), (10.0, 30.0)),
    ), SLOW),
    "visitor": _Role((
        _Stop((_WAITING,), (1.0, 5.0), "entrance"), _Stop(("patient room",), (20.0, 60.0)),
    ), together=2),
}  # fmt: skip
_ORDER = ("staff", "inpatient", "visitor", "outpatient", "staff", "visitor", "outpatient", "outpatient")
"""Of ten people: two of the staff, four patients, four visitors."""


def people(
    ward: Ward, number: int, key: str, free: Callable[[Place], bool] = lambda place: True
) -> tuple[PersonSpec, ...]:
    """So many people, drawn from `key`; they start where it is `free`: who would start elsewhere starts where they go next.

    Raises:
        ClearwayError: the floor has no places for so many.
    """
    floor = _Floor(ward, free)
    count = dict.fromkeys(_ORDER, 0)
    found: list[PersonSpec] = []
    for turn, name in enumerate(itertools.cycle(_ORDER)):
        if len(found) == number:
            break
        draws = _Draws(f"{ward.name} {key} {turn}")
        role = _ROLES[name]
        try:
            routes, speed = floor.routes(role, draws), draws.speed(role)
        except _FullError:
            raise ClearwayError(
                f"the floor plan {ward.plan!r} has places for {len(found)} people; {number} are asked for",
                field="batch",
            ) from None
        group = f"visitors {count[name] // 2 + 1}" if role.together > 1 else ""
        for start, route in routes[: number - len(found)]:
            count[name] += 1
            found.append(PersonSpec(name=f"{name} {count[name]}", start=start, route=route, loop=True, speed=speed, radius=RADIUS, group=group))  # fmt: skip
    return tuple(found)


class _Draws:
    """Numbers of one stream, one after another."""

    def __init__(self, name: str) -> None:
        self._name, self._count = name, itertools.count()

    def _next(self) -> float:
        return draw(next(self._count), self._name)

    def between(self, low: float, high: float) -> float:
        return round(low + (high - low) * self._next(), 2)

    def one_of(self, count: int) -> int:
        return int(count * self._next())

    def speed(self, role: _Role) -> float | None:
        return None if role.speed is None else self.between(*role.speed)


class _FullError(Exception):
    """No place is left."""


class _Floor:
    """Places that nobody has yet."""

    def __init__(self, ward: Ward, free: Callable[[Place], bool]) -> None:
        self._ward, self._free = ward, free
        rooms = load_floor_plan(ward.plan).rooms
        self._left = {(room.kind, room.name): list(places(ward)[room.name]) for room in rooms}

    def routes(self, role: _Role, draws: _Draws) -> list[tuple[Place, tuple[StopSpec, ...]]]:
        """Start and route of each who goes together; half of them set out at once, the others stay for a while where they start."""
        ways: list[list[StopSpec]] = [[] for _ in range(role.together)]
        for stop in role.stops:
            kind, some = self._take(stop, role.together, draws)
            wait = draws.between(*stop.wait)
            for way, place in zip(ways, some, strict=True):
                way.append(StopSpec(at=place, wait=0.0 if kind == _CORRIDOR else wait))
        stays = [k for k, stop in enumerate(ways[0]) if stop.wait > 0.0]
        drawn, sets_out = draws.one_of(len(stays)), draws.between(0.0, 1.0) < 0.5
        in_turn = stays[drawn:] + stays[:drawn]
        first = next((k for k in in_turn if all(self._free(way[k].at) for way in ways)), in_turn[0])
        turned = [way[first:] + way[:first] for way in ways]
        return [(way[0].at, tuple(way[1:] + way[:1] if sets_out else way)) for way in turned]

    def _take(self, stop: _Stop, count: int, draws: _Draws) -> tuple[str, list[Place]]:
        """So many places beside each other, in one room, and of which kind that is; in the corridor anybody may pass."""
        rooms = [key for key, left in self._left.items() if key[0] in stop.kinds and len(left) >= count]
        if not rooms and _WAITING in stop.kinds:
            raise _FullError
        if not rooms:
            rooms = [key for key in self._left if key[0] == _CORRIDOR]
        near = {"reception": (self._ward.reception,), "entrance": self._ward.entrances, "": ()}[stop.near]
        every = [(place, key) for key in rooms for place in self._left[key]]
        at, key = every[draws.one_of(len(every))]
        if near:
            at = near[draws.one_of(len(near))]
        left = sorted(self._left[key], key=lambda place: math.dist(at, place))
        if key[0] != _CORRIDOR:
            self._left[key] = left[count:]
        return key[0], left[:count]

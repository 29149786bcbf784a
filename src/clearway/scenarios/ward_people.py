"""Who goes about in the suites `ward-day`: staff, patients and visitors, each between places of their own.

A person's places are nobody else's, so that none waits for another to leave. Who comes later takes what is left: the first five of ten
people are those of five.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

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
        kinds: Of rooms; where all of these are full the corridor, through which people walk, then the waiting area.
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
        _Stop((_WAITING,), (20.0, 60.0)), _Stop((_WAITING,), (5.0, 15.0), "reception"),
        _Stop(("examination room", "bathroom"), (10.0, 30.0)),
    ), SLOW),
    "visitor": _Role((
        _Stop((_WAITING,), (0.0, 5.0), "entrance"), _Stop(("patient room",), (20.0, 60.0)),
    ), together=2),
}  # fmt: skip
_ORDER = ("staff", "inpatient", "visitor", "outpatient", "staff", "visitor", "outpatient", "outpatient")
"""Of ten people: two of the staff, four patients, four visitors."""


def people(ward: Ward, number: int, key: str) -> tuple[PersonSpec, ...]:
    """So many people, drawn from `key`.

    Raises:
        ClearwayError: the floor has no places for so many.
    """
    floor = _Floor(ward)
    count = dict.fromkeys(_ORDER, 0)
    found: list[PersonSpec] = []
    for turn, name in enumerate(itertools.cycle(_ORDER)):
        if len(found) == number:
            break
        draws = _Draws(f"{ward.name} {key} {turn}")
        some = min(_ROLES[name].together, number - len(found))
        try:
            routes, speed = floor.routes(_ROLES[name], some, draws), draws.speed(_ROLES[name])
        except _FullError:
            raise ClearwayError(
                f"the floor plan {ward.plan!r} has places for {len(found)} people; {number} are asked for",
                field="batch",
            ) from None
        group = f"visitors {count[name] // 2 + 1}" if some > 1 else ""
        for start, route in routes:
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

    def __init__(self, ward: Ward) -> None:
        self._ward, self._left = ward, dict[str, list[Place]]()
        for room in load_floor_plan(ward.plan).rooms:
            some = places(ward)[room.name]
            self._left.setdefault(room.kind, []).extend(some[:1] if room.kind == "bathroom" else some)

    def routes(self, role: _Role, together: int, draws: _Draws) -> list[tuple[Place, tuple[StopSpec, ...]]]:
        """Start and route of each who goes together; half of them set out at once, the others stay for a while where they start."""
        ways: list[list[StopSpec]] = [[] for _ in range(together)]
        for stop in role.stops:
            kind, first = self._choose(stop, draws)
            wait = draws.between(*stop.wait)
            for way, place in zip(ways, [first, *self._beside(kind, first, together - 1)], strict=True):
                way.append(StopSpec(at=place, wait=0.0 if kind == _CORRIDOR else wait))
        first_stop, sets_out = draws.one_of(len(role.stops)), draws.between(0.0, 1.0) < 0.5
        found = []
        for way in ways:
            turned = way[first_stop:] + way[:first_stop]
            found.append((turned[0].at, tuple(turned[1:] + turned[:1] if sets_out else turned)))
        return found

    def _choose(self, stop: _Stop, draws: _Draws) -> tuple[str, Place]:
        kinds = [k for k in stop.kinds if self._left.get(k)]
        kind = kinds[draws.one_of(len(kinds))] if kinds else self._elsewhere()
        left = self._left[kind]
        towards = {"reception": (self._ward.reception,), "entrance": self._ward.entrances, "": ()}[stop.near]
        if not kinds or not towards:
            return kind, left.pop(draws.one_of(len(left)))
        at = towards[draws.one_of(len(towards))]
        return kind, left.pop(int(np.argmin([math.dist(at, p) for p in left])))

    def _beside(self, kind: str, place: Place, count: int) -> Iterator[Place]:
        """The next `count` places to `place`, of its kind while there are some."""
        for _ in range(count):
            left = self._left[kind] or self._left[self._elsewhere()]
            yield left.pop(int(np.argmin([math.dist(place, p) for p in left])))

    def _elsewhere(self) -> str:
        for kind in (_CORRIDOR, _WAITING, *self._left):
            if self._left.get(kind):
                return kind
        raise _FullError

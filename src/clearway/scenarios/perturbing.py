"""The family of any scenario: how far each continuous thing that it has may be from what it is.

One table for all suites, by the fields of the scenario's model: a suite gets its family from what its scenarios have. The ranges
are of the size that differs between two tries of one test in a lab; a family of one's own says others (`clearway.scenarios.family`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from clearway.scenarios.family import COORDINATES, Family, Path_, Variable
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Room:
    """How far a number may be from what it is: a sum and a product.

    Attributes:
        shift: It may be so much more or less; of a place or a pose one for each coordinate.
        factor: It may be so many times what it is: least, most.
        least: What it is at least.
    """

    shift: tuple[float, ...] = (0.0,)
    factor: tuple[float, float] = (1.0, 1.0)
    least: float = -math.inf

    def around(self, value: float, coordinate: int) -> tuple[float, float]:
        """The least and the most that it may be."""
        shift = self.shift[min(coordinate, len(self.shift) - 1)]
        ends = [value * factor for factor in self.factor]
        return max(min(ends) - shift, self.least), max(*ends) + shift


_PLACE, _SIZE, _PACE = Room((0.3, 0.3, 0.3)), Room(factor=(0.8, 1.2)), Room(factor=(0.5, 1.5))
ROOM: dict[tuple[str, str], Room] = {
    ("Scenario", "start"): _PLACE,
    ("Scenario", "speed"): Room(factor=(0.7, 1.3)),
    ("Scenario", "latency"): Room(factor=(0.0, 1.5)),
    ("RobotSpec", "start"): _PLACE,
    ("ObstacleSpec", "pose"): _PLACE,
    ("SquareSpec", "edge"): _SIZE,
    ("RectangleSpec", "length"): _SIZE,
    ("RectangleSpec", "width"): _SIZE,
    ("DiscSpec", "radius"): _SIZE,
    ("RunSpec", "path"): _PLACE,
    ("RunSpec", "speed"): _PACE,
    ("RunSpec", "delay"): Room((3.0,)),
    ("OperatorSpec", "reaction"): Room(factor=(0.5, 2.0)),
    ("OperatorSpec", "stop_short"): _PACE,
    ("OscillationSpec", "start"): _PLACE,
    ("OscillationSpec", "velocity"): Room((0.1,)),
    ("OscillationSpec", "attraction"): _PLACE,
    ("OscillationSpec", "stiffness"): _SIZE,
    ("DampedSpec", "start"): _PLACE,
    ("DampedSpec", "attraction"): _PLACE,
    ("DampedSpec", "stiffness"): _SIZE,
    ("ShakenSpec", "start"): _PLACE,
    ("ShakenSpec", "attraction"): _PLACE,
    ("ShakenSpec", "push"): Room(factor=(0.0, 1.0)),
    ("StopAndGoSpec", "start"): _PLACE,
    ("StopAndGoSpec", "lag"): _SIZE,
    ("PursuitSpec", "start"): _PLACE,
    ("PursuitSpec", "path"): _PLACE,
    ("PursuitSpec", "pace"): _PACE,
    ("SplineSpec", "offset"): Room((3.0,), least=0.0),
    ("PersonSpec", "start"): _PLACE,
    ("PersonSpec", "speed"): Room(factor=(0.75, 1.25)),
    ("PersonSpec", "reaction"): Room(factor=(0.5, 2.0)),
    ("StopSpec", "at"): _PLACE,
    ("StopSpec", "wait"): Room(factor=(0.0, 2.0)),
    ("DisturbanceSpec", "position"): Room(factor=(0.0, 1.0)),
    ("DisturbanceSpec", "heading"): Room(factor=(0.0, 1.0)),
    ("DisturbanceSpec", "velocity"): Room(factor=(0.0, 1.0)),
    ("DisturbanceSpec", "turn"): Room(factor=(0.0, 1.0)),
}
"""By the table's and the field's name; any other field stays as it is. A disturbance stays within its bounds, and a fastest
speed or acceleration as it is: what a guarantee assumes of them holds for the whole family."""


def perturbed(scenario: Scenario) -> Family:
    """The family of a scenario: everything continuous about it, in the ranges of `ROOM`. Who walks a recorded track walks it."""
    return Family.of(scenario, tuple(_variables(scenario, (), ())))


def _variables(part: BaseModel, path: Path_, names: tuple[str, ...]) -> Iterator[Variable]:
    for name in type(part).model_fields:
        value = getattr(part, name)
        room = ROOM.get((type(part).__name__, name))
        if isinstance(part, PersonSpec) and (not part.reads(name) or (name == "start" and part.track)):
            continue
        if room is not None:
            yield from _numbers(value, room, (*path, name), (*names, name))
        elif isinstance(value, BaseModel):
            yield from _variables(value, (*path, name), (*names, name))
        elif isinstance(value, tuple):
            for i, item in enumerate(value):
                if isinstance(item, BaseModel):
                    called = getattr(item, "name", str(i))
                    yield from _variables(item, (*path, name, i), (*names, name, called))


def _numbers(value: Any, room: Room, path: Path_, names: tuple[str, ...], coordinate: int = 0) -> Iterator[Variable]:
    if isinstance(value, tuple):
        numbers = all(isinstance(v, float) for v in value)
        for i, inside in enumerate(value):
            name = COORDINATES[i] if numbers else str(i)
            yield from _numbers(inside, room, (*path, i), (*names, name), i if numbers else 0)
    elif isinstance(value, float):
        low, high = room.around(value, coordinate)
        if low < high:
            yield Variable(".".join(names), path, low, high, value)

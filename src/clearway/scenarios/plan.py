"""What a floor plan is, wherever it was read from."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray, Shape


@dataclass(frozen=True, slots=True, eq=False)
class Fixture:
    """Something that stands in a plan for good.

    Attributes:
        kind: `wall` or `furniture`. shape: in its own frame. pose: (3,) map frame.
    """

    name: str
    kind: str
    shape: Shape
    pose: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """Where a test takes place.

    Attributes:
        fixtures: walls and furniture, the truth. map: what a robot is given, None where nothing is known.
        a, b: (3,) poses of the protocol's line, heading along it; None in a plan without.
        clear: x0, y0, x1, y1 [m] of the area around the line that is free of fixtures, None without a line.
        bounds: x0, y0, x1, y1 [m] around everything. rooms: names and floor areas, for people.
        area: x0, y0, x1, y1 [m] that a robot's centre is to stay in, None: what stands there says it.
    """

    name: str
    title: str
    fixtures: tuple[Fixture, ...]
    map: OccupancyGrid | None
    a: FloatArray | None
    b: FloatArray | None
    clear: tuple[float, float, float, float] | None
    bounds: tuple[float, float, float, float]
    rooms: tuple[Room, ...] = ()
    area: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Room:
    """A part of the floor: `kind` such as `patient room`, how many beds, its floor as disjoint boxes x0, y0, x1, y1 [m]."""

    name: str
    kind: str
    beds: int
    floor: tuple[tuple[float, float, float, float], ...]

    @property
    def area(self) -> float:
        """Floor area, m²."""
        return sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in self.floor)

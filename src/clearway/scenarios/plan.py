"""What a floor plan is, wherever it was read from."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray, Shape


@dataclass(frozen=True, slots=True, eq=False)
class Fixture:
    """Something that stands in a plan for good.

    Attributes:
        name: Its name.
        kind: Either `wall` or `furniture`.
        shape: Its outline in its own frame.
        pose: (3,) pose in the map: x, y [m], theta [rad].
    """

    name: str
    kind: str
    shape: Shape
    pose: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """Where a test takes place.

    Attributes:
        name: Its name.
        title: Its name for people.
        fixtures: Walls and furniture: the truth.
        map: The map that a robot is given; None where nothing is known.
        a: (3,) pose A of the protocol's line: x, y [m], theta [rad] along it; None in a plan without a line.
        b: (3,) pose B of the protocol's line: x, y [m], theta [rad] along it; None in a plan without a line.
        clear: The area around the line that is free of fixtures: x0, y0, x1, y1 [m]; None without a line.
        bounds: What encloses everything: x0, y0, x1, y1 [m].
        rooms: Its rooms, for people.
        area: Where a robot's centre is to stay: x0, y0, x1, y1 [m]; None: what stands there says it.
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

    def __post_init__(self) -> None:
        if self.map is not None:  # every trial of a process is given this one
            object.__setattr__(self, "map", self.map.read_only())


@dataclass(frozen=True, slots=True)
class Room:
    """A part of the floor.

    Attributes:
        name: Its name.
        kind: What it is, such as `patient room`.
        beds: How many beds it has.
        floor: Its floor as disjoint boxes x0, y0, x1, y1 [m].
    """

    name: str
    kind: str
    beds: int
    floor: tuple[tuple[float, float, float, float], ...]

    @property
    def area(self) -> float:
        """Floor area, m²."""
        return sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in self.floor)

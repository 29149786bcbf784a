"""Where the robots of the suites `meeting-points` meet: floor plans that grow with the robots, starts and goals on them.

All lengths are in sizes: the diameter of the largest robot's circumscribed circle, rounded up to 0.1 m. A floor is as large as the most
robots need, whoever drives there; starts and goals lie as near to each other as so many robots allow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from clearway.scenarios.floor_plan_files import Box, FloorPlanSpec, WallSpec, floor_plan_of
from clearway.scenarios.plan import FloorPlan

Place = tuple[float, float]
"""x, y; in sizes, or in m where it says so."""

MOST = 32
"""So many robots a floor has room for."""
SIZES = tuple(k / 10 for k in range(3, 31))
"""Of robots for which there are floors, m."""
PLANS = {"circle": "hall", "swap": "hall", "crossing": "hall", "corridor": "corridor", "doorway": "doorway"}
"""Batch -> kind of floor plan."""
_ABREAST, _RANKS = {"swap": 8, "crossing": 4}, 4
_WALL = 0.2  # m
_DOOR_WALL = 0.2
"""Half the thickness of the wall that the doorway is in, in sizes."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """Distances between robots and walls.

    Attributes:
        name: Of the suite; what its floor plans are called by.
        ring: Distance between neighbours on the circle, in sizes.
        radius: Least radius of the circle, in sizes.
        pitch: Distance between neighbours that stand in ranks, in sizes.
        jitter: Every start is moved by at most this along x and y, in sizes.
        apart: From the middle to the first rank of those who swap or cross, in sizes.
        corridor: Length and width of the corridor, in sizes.
        door: Width of the doorway, in sizes.
        speed: Set speed, m/s.
    """

    name: str
    ring: float
    radius: float
    pitch: float
    jitter: float
    apart: float
    corridor: tuple[float, float]
    door: float
    speed: float

    @property
    def half(self) -> float:
        """Half the edge of the hall, in sizes: it holds the circle, the ranks of those who cross, and room behind them."""
        return max(self.ring_radius(MOST), self.apart + (_RANKS - 1) * self.pitch) + 2.0

    def ring_radius(self, robots: int) -> float:
        """Of the circle for so many robots, in sizes."""
        return max(self.radius, self.ring * robots / math.tau)

    @property
    def mouth(self) -> float:
        """From the middle to where the room begins in which the robots stand, in sizes: half the corridor, or the door's wall."""
        return 0.5 * self.corridor[0]

    @property
    def room(self) -> tuple[float, float]:
        """Depth and width of the rooms on either side of corridor and doorway, in sizes."""
        return (_RANKS + 1.5) * self.pitch, 5.0 * self.pitch


GEOMETRY = Geometry("meeting-points", 2.5, 5.0, 2.5, 0.2, 6.0, (10.0, 4.0), 1.6, 0.6)
HELD_OUT = Geometry("meeting-points-held-out", 2.8, 6.5, 2.7, 0.25, 7.5, (14.0, 3.5), 1.9, 0.8)
"""Other widths, radii and speeds, on which nothing is to be chosen."""


def size_of(diameter: float) -> float:
    """The size [m] of the floors for robots of up to `diameter` [m]."""
    return math.ceil(10.0 * diameter - 1e-9) / 10


def plan_name(geometry: Geometry, batch: str, size: float) -> str:
    """What the floor plan of a batch is called, for robots of up to `size` [m]."""
    return f"{geometry.name}-{PLANS[batch]}-{size:.1f}"


def floor_plans(geometry: Geometry) -> dict[str, Callable[[], FloorPlan]]:
    """Name -> maker of every floor plan of a geometry."""
    kinds = {kind: batch for batch, kind in PLANS.items()}
    return {plan_name(geometry, b, size): partial(_plan, geometry, b, size) for b in kinds.values() for size in SIZES}


def _plan(geometry: Geometry, batch: str, size: float) -> FloorPlan:
    walls = tuple(WallSpec(name=f"wall {k}", box=box) for k, box in enumerate(_walls(geometry, PLANS[batch], size), 1))
    title = f"{PLANS[batch].capitalize()} for robots of up to {size:.1f} m"
    return floor_plan_of(FloorPlanSpec(name=plan_name(geometry, batch, size), title=title, walls=walls))


def _walls(geometry: Geometry, kind: str, size: float) -> list[Box]:
    """Boxes in m: around the hall, or around two rooms, with a block on either side of the corridor or the doorway between them."""
    if kind == "hall":
        return _around(size * geometry.half, size * geometry.half)
    depth, width = geometry.room
    inner = geometry.mouth if kind == "corridor" else _DOOR_WALL
    free = geometry.corridor[1] if kind == "corridor" else geometry.door
    y0, y1, x0, x1 = (round(size * v, 3) for v in (0.5 * free, 0.5 * width, inner, inner + depth))
    return [*_around(x1, y1), (-x0, -y1, x0, -y0), (-x0, y0, x0, y1)]


def _around(x: float, y: float) -> list[Box]:
    """Walls around the free box from (-x, -y) to (x, y), m."""
    x, y = round(x, 3), round(y, 3)
    a, b = x + _WALL, y + _WALL
    return [(-a, -b, -x, b), (x, -b, a, b), (-x, -b, x, -y), (-x, y, x, b)]


def starts(geometry: Geometry, batch: str, robots: int) -> list[Place]:
    """Where so many robots start before their starts are moved, in sizes; at most `MOST`."""
    if batch == "circle":
        angle, radius = math.tau / robots, geometry.ring_radius(robots)
        return [(-radius * math.cos(k * angle), -radius * math.sin(k * angle)) for k in range(robots)]
    if batch == "crossing":
        ranks = _ranks(geometry, geometry.apart, _ABREAST[batch], (robots + 1) // 2)
        return [place for x, y in ranks for place in ((x, y), (-y, x))][:robots]
    if batch == "swap":
        ranks = _ranks(geometry, geometry.apart, _ABREAST[batch], (robots + 1) // 2)
    else:
        mouth = geometry.mouth if batch == "corridor" else _DOOR_WALL
        ranks = _ranks(geometry, mouth + geometry.pitch, 5, (robots + 1) // 2)
    return [place for x, y in ranks for place in ((x, y), (-x, y))][:robots]


def goal(geometry: Geometry, batch: str, start: Place, k: int, robots: int) -> Place:
    """Where robot number `k` of so many goes to from `start`; both in sizes.

    Opposite on the circle; where two groups exchange sides, the same place on the other side; at the crossing straight on, the first rank the
    farthest.
    """
    x, y = start
    if batch == "circle":
        return -x, -y
    if batch != "crossing":
        return -x, y
    last = max(abs(a) for a, _ in starts(geometry, batch, robots)[::2])
    beyond = last + geometry.apart
    return (beyond + x, y) if k % 2 == 0 else (x, beyond + y)


def _ranks(geometry: Geometry, first: float, abreast: int, count: int) -> list[Place]:
    """`count` places to the west, the first rank at x = -first, in each the middle first."""
    lanes = [math.ceil(k / 2) * (1 if k % 2 else -1) + (0.0 if abreast % 2 else -0.5) for k in range(abreast)]
    return [(-first - geometry.pitch * (k // abreast), geometry.pitch * lanes[k % abreast]) for k in range(count)]


def spare(geometry: Geometry, batch: str) -> Place:
    """A place, in sizes, where one more robot can stand while the others do: what shows that two can always exchange theirs."""
    if PLANS[batch] == "hall":
        return 0.0, 0.0
    return starts(geometry, batch, MOST + 2)[MOST]

"""Where the suites `ward-day` take place: floor plans, the robot's tasks, ways of what is pushed, and places where people may stand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import KDTree

from clearway.geometry.shapes import FloatArray
from clearway.quantities import PoseSpec
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.plan import Room
from clearway.scenarios.way import CELL, room_for

Place = tuple[float, float]
"""x, y [m]."""

RADIUS = 0.25
"""Of a person, m."""
PITCH = 1.1
"""Least distance of neighbouring places, m: between two who stand there a third gets through."""
BY = 0.3
"""Distance to another's disc from which one gets by, m: the own radius and one cell."""
MARGIN = 0.15
"""Left between somebody who stands and what stands there for good, m."""
DOOR = 0.8
"""A place is so far from where a room opens to another, m: nobody stands in a door's way."""
APART = 0.8
"""A place is so far from where the robot starts and goes on any task, m."""
APPEARS = 1.5
"""A place is so far from where what is pushed comes in and leaves, m: half the diagonal of a bed, a person, 0.1 m."""


@dataclass(frozen=True, slots=True, eq=False)
class Ward:
    """A floor with its traffic.

    Attributes:
        name: Of the suite.
        plan: Name of the floor plan; its rooms have kinds.
        tasks: Name -> where the robot starts, and where it goes before it comes back: m, m, rad.
        entrances: Places inside of its doors to the outside, m.
        reception: A place before the desk, m.
        pushed: Ways of what is pushed, on the legs there and back, m: to its right where the trolleys let it.
        numbers: Of people, one for each batch.
        speed: Set speed, m/s.
    """

    name: str
    plan: str
    tasks: Mapping[str, tuple[PoseSpec, PoseSpec]]
    entrances: tuple[Place, ...]
    reception: Place
    pushed: tuple[tuple[Place, ...], tuple[Place, ...]]
    numbers: tuple[int, ...]
    speed: float


_EAST, _NORTH, _WEST, _SOUTH = 0.0, 1.5708, 3.1416, -1.5708

WARD = Ward(
    "ward-day", "ward",
    {
        "medicine": ((16.1, 3.0, _SOUTH), (9.3, -2.6, _SOUTH)),
        "guide": ((-4.8, -1.6, _EAST), (13.2, 2.6, _NORTH)),
        "samples": ((11.9, -2.6, _NORTH), (-4.8, -1.6, _WEST)),
    },
    ((-5.8, 1.9),), (-5.2, -1.6),
    (
        ((4.2, -0.5), (9.4, -0.5), (12.3, 0.0), (14.6, 0.0)),
        ((14.6, 0.0), (10.2, 0.0), (7.2, 0.5), (4.2, 0.5)),
    ),
    (0, 5, 10, 20, 40), 0.6,
)  # fmt: skip
HELD_OUT = Ward(
    "ward-day-held-out", "wing",
    {
        "medicine": ((1.8, -2.2, _NORTH), (13.2, -1.9, _SOUTH)),
        "guide": ((-2.6, -3.2, _WEST), (9.85, -1.7, _SOUTH)),
        "samples": ((16.3, -1.8, _NORTH), (-2.6, -3.2, _EAST)),
    },
    ((-7.4, -1.0), (-4.1, 2.4)), (-1.9, -3.2),
    (
        ((-2.2, 0.4), (0.4, 0.65), (15.2, 0.65)),
        ((15.2, 0.85), (6.4, 0.85), (3.6, 1.3), (-2.2, 1.3)),
    ),
    (8, 16, 32), 0.8,
)  # fmt: skip
"""Another floor plan, other densities, another speed, on which nothing is to be chosen."""


@lru_cache(maxsize=8)
def places(ward: Ward) -> Mapping[str, tuple[Place, ...]]:
    """Room -> the places in it where somebody may stand: off walls, doors, the robot's ends, those of what is pushed, each other.

    Where somebody stands in each of them, a person still gets to every one.
    """
    plan = load_floor_plan(ward.plan)
    floor = room_for([(f.shape, f.pose) for f in plan.fixtures], plan.bounds, RADIUS + MARGIN)
    rows, columns = np.indices(floor.width.shape)
    at = np.stack([floor.origin[0] + (columns + 0.5) * CELL, floor.origin[1] + (rows + 0.5) * CELL], axis=-1)
    lies_in = [_within(room, at) for room in plan.rooms]
    robot = [pose[:2] for ends in ward.tasks.values() for pose in ends]
    begin = int((robot[0][1] - floor.origin[1]) / CELL), int((robot[0][0] - floor.origin[0]) / CELL)
    built = ndimage.label(floor.width > 0.0)[0]
    doorways = at[(built == built[begin]) & ~np.any(lies_in, axis=0)]  # free, and part of no room
    free = (floor.regions == floor.regions[begin]) & (floor.width >= RADIUS + MARGIN + CELL)
    appears = [place for way in ward.pushed for place in (way[0], way[-1])]
    for apart, some in ((DOOR, doorways), (APART, robot), (APPEARS, appears)):
        free[free] = KDTree(some).query(at[free])[0] >= apart
    passable = floor.width >= BY
    taken: list[Place] = []
    found: dict[str, tuple[Place, ...]] = {}
    for room, inside in zip(plan.rooms, lies_in, strict=True):
        first = len(taken)
        cells = np.argwhere(free & inside)[::2]
        if room.kind not in ("waiting area", "corridor"):  # the deepest first, which block the fewest
            cells = cells[np.argsort(-KDTree(doorways).query(at[tuple(cells.T)])[0], kind="stable")]
        for r, c in cells.tolist():
            place = (round(float(at[r, c, 0]), 3), round(float(at[r, c, 1]), 3))
            if any(math.dist(place, other) < PITCH for other in taken):
                continue
            left = passable & (np.hypot(*(at - place).transpose(2, 0, 1)) >= RADIUS + BY)
            if room.kind == "corridor":  # nobody stays there
                taken.append(place)
            elif _within_reach([*taken, place], left, floor.origin, begin):
                taken.append(place)
                passable = left
        found[room.name] = tuple(taken[first:])
    return found


def _within_reach(some: list[Place], passable: npt.NDArray[np.bool_], origin: Place, begin: tuple[int, ...]) -> bool:
    """Whether one gets beside each of `some` [m] from the cell `begin` over cells that are `passable`."""
    regions = ndimage.label(passable)[0]
    reached, n = regions == regions[begin], math.ceil((RADIUS + BY) / CELL) + 1
    for x, y in some:
        r, c = int((y - origin[1]) / CELL), int((x - origin[0]) / CELL)
        if not reached[max(r - n, 0) : r + n + 1, max(c - n, 0) : c + n + 1].any():
            return False
    return True


def _within(room: Room, at: FloatArray) -> npt.NDArray[np.bool_]:
    """Which of the points `at` (..., 2) [m] lie in a room."""
    x, y = at[..., 0], at[..., 1]
    inside: npt.NDArray[np.bool_] = np.any(
        [(x0 <= x) & (x <= x1) & (y0 <= y) & (y <= y1) for x0, y0, x1, y1 in room.floor], axis=0
    )
    return inside

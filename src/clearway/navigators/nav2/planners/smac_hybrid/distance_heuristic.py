"""How far it is to the goal for a base that turns in circles, without obstacles: a table in a square about the goal.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner/src/distance_heuristic.cpp, which fills the table when it
starts; here an entry is filled when it is first asked for.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.dubins import dubins, length, relative
from clearway.geometry.reeds_shepp import distance
from clearway.navigators.nav2.planners.smac_hybrid.motion import Motion, Single, Singles


class Table(NamedTuple):
    """The table, and with what it is filled.

    Attributes:
        entries: (n,) float32 distance by x, y >= 0 and heading, in cells; 0 where it was not asked for yet.
        half: Cells from the goal to the edge of the square.
        cosine: (headings,) float32 of the headings.
        sine: (headings,) float32 of the headings.
        headings: How many there are in a full turn.
        bin_size: Angle between two, rad.
        radius: Least turning radius, cells.
        reverse: Whether it drives backwards too.
    """

    entries: Singles
    half: int
    cosine: Singles
    sine: Singles
    headings: int
    bin_size: float
    radius: float
    reverse: bool


def make_table(motion: Motion, size: float) -> Table:
    """The table for a square of `size` cells about the goal."""
    half = int(size) // 2
    heading = motion.bin_size * np.arange(motion.headings, dtype=np.float32)
    entries = _entries(float(motion.radius), motion.headings, motion.reverse, half)
    radius, bin_size = float(motion.radius), float(motion.bin_size)
    return Table(entries, half, np.cos(heading), np.sin(heading), motion.headings, bin_size, radius, motion.reverse)


@lru_cache(maxsize=4)
def _entries(radius: float, headings: int, reverse: bool, half: int) -> Singles:
    """What all planners of that kind share."""
    return np.zeros((2 * half + 1) * (half + 1) * headings, np.float32)


@kernel
def _away(table: Table, x: float, y: float, yaw: float, gx: float, gy: float, goal_yaw: float) -> float:
    """Length of the shortest path between two poses, cells."""
    there = relative(x, y, yaw, gx, gy, goal_yaw, table.radius)
    if table.reverse:
        return table.radius * distance(there[0], there[1], there[2])
    return table.radius * length(dubins(there[0], there[1], there[2]))


@kernel
def _round(value: float) -> int:
    """To the nearest whole number, halves away from zero."""
    whole = int(abs(value) + 0.5)
    return whole if value >= 0 else -whole


@kernel
def without_obstacles(
    table: Table, row: int, column: int, heading: int, gx: float, gy: float, goal_heading: float, around: float
) -> Single:
    """Distance from a node to a goal, in cells; 0 outside of the square if `around`, the obstacle heuristic, has a value.

    As in the source the mirror of heading 0 is the entry of the next row, and the headings outside of the square are no
    angles.
    """
    g = int(goal_heading)
    cosine, sine = table.cosine[g], -table.sine[g]
    dx, dy = np.float32(column) - gx, np.float32(row) - gy
    turn = heading - np.float64(goal_heading)
    if turn < 0:
        turn += table.headings
    if turn > table.headings:
        turn -= table.headings
    x, y, t = _round(dx * cosine - dy * sine), _round(dx * sine + dy * cosine), _round(turn)
    half, across, headings = table.half, table.half + 1, table.headings
    if abs(x) < half and abs(y) < half:
        index = ((x + half) * across + abs(y)) * headings + (headings - t if y < 0 else t)
        if table.entries[index] == 0:
            rest = index // headings
            yaw = (index % headings) * table.bin_size
            table.entries[index] = _away(table, rest // across - half, rest % across, yaw, 0.0, 0.0, 0.0)
        return table.entries[index]
    if around > 0:
        return np.float32(0)
    return np.float32(_away(table, column, row, heading * headings, gx, gy, goal_heading * headings))

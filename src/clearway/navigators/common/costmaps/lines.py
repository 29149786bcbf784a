"""The cells of a costmap on a line, as ROS draws it, and where a ray leaves the map.

Bresenham's line with an integer error that starts at half the longer side (base_local_planner/src/line_iterator.h, which Nav2 has
unchanged).
"""

from __future__ import annotations

from typing import NamedTuple

from clearway.geometry.compiled import kernel


class Line(NamedTuple):
    """A line between two cells.

    Attributes:
        length: How many steps it has; one cell more.
        width: How many of them also go along the shorter side.
        row: Rows that each step goes.
        col: Columns that each step goes.
        side_row: Rows that a step along the shorter side goes beside that.
        side_col: Columns that a step along the shorter side goes beside that.
    """

    length: int
    width: int
    row: int
    col: int
    side_row: int
    side_col: int


@kernel
def line_between(r0: int, c0: int, r1: int, c1: int) -> Line:
    """The line from the first cell to the second, both of it."""
    dr, dc = abs(r1 - r0), abs(c1 - c0)
    sr = 1 if r1 >= r0 else -1
    sc = 1 if c1 >= c0 else -1
    if dc >= dr:
        return Line(dc, dr, 0, sc, sr, 0)
    return Line(dr, dc, sr, 0, 0, sc)


@kernel
def next_cell(line: Line, row: int, col: int, error: int) -> tuple[int, int, int]:
    """The cell after (row, col), and the error there; at the first cell it is `line.length // 2`."""
    error += line.width
    row += line.row
    col += line.col
    if error >= line.length:
        return row + line.side_row, col + line.side_col, error - line.length
    return row, col, error


@kernel
def clipped(
    x: float, y: float, px: float, py: float, low_x: float, low_y: float, high_x: float, high_y: float
) -> tuple[float, float]:
    """Where a ray from (x, y), on the map, to (px, py) ends on the map, m (ObstacleLayer::raytraceFreespace): side by side, so that it
    may still end off it."""
    a, b = px - x, py - y
    if px < low_x:
        px, py = low_x, y + b * ((low_x - x) / a)
    if py < low_y:
        px, py = x + a * ((low_y - y) / b), low_y
    if px > high_x:
        px, py = high_x - 0.001, y + b * ((high_x - x) / a)
    if py > high_y:
        px, py = x + a * ((high_y - y) / b), high_y - 0.001
    return px, py

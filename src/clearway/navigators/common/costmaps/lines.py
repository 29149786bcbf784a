"""The cells of a costmap on a line, as ROS draws it.

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

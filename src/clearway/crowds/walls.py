"""What stands in a crowd's way: polygons as edges, and where they come from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.bodies import IntArray
from clearway.errors import ClearwayError
from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray


class Walls(NamedTuple):
    """Edges of polygons; what is solid lies to their left. Edge k leads from vertex k to vertex `following[k]`.

    Attributes:
        vertex: (m, 2) m.
        direction: (m, 2) unit vector along the edge; zero for that of a single point.
        length: (m,) m.
        following: (m,) int64, the next vertex of the same polygon.
        preceding: (m,) int64, the one before.
        convex: (m,) bool, whether the solid has a convex corner at the vertex.
        polygon: (m,) int64, which polygon it belongs to, ascending.
    """

    vertex: FloatArray
    direction: FloatArray
    length: FloatArray
    following: IntArray
    preceding: IntArray
    convex: npt.NDArray[np.bool_]
    polygon: IntArray


def walls_of(polygons: Sequence[npt.ArrayLike]) -> Walls:
    """`Walls` of polygons (n, 2) in metres, each counter-clockwise around what is solid.

    A polygon around free space (a room seen from inside) is therefore clockwise, two vertices make a wall without
    thickness, one makes a post.

    Raises:
        ClearwayError: a polygon is no list of points, holds a number that is not finite, or the same point twice in a row.
    """
    arrays = [_checked(k, polygon) for k, polygon in enumerate(polygons)]
    counts = np.array([len(a) for a in arrays], np.int64)
    polygon, n = np.repeat(np.arange(len(arrays)), counts), np.repeat(counts, counts)
    points = np.concatenate([np.empty((0, 2)), *arrays])
    first = np.repeat(np.cumsum(counts) - counts, counts)
    place = np.arange(len(points)) - first
    following, preceding = first + (place + 1) % n, first + (place - 1) % n
    onwards, arriving = points[following] - points, points - points[preceding]
    if len(twice := polygon[(n > 1) & (arriving == 0.0).all(1)]):
        raise ClearwayError("the same point stands twice in a row", field=f"polygons[{twice[0]}]")
    length = np.hypot(*onwards.T)
    direction = onwards / np.where(length > 0.0, length, 1.0)[:, None]
    (ax, ay), (bx, by) = arriving.T, onwards.T
    convex = (n <= 2) | (ax * by - ay * bx >= 0.0)
    return Walls(points, direction, length, following, preceding, convex, polygon)


def _checked(k: int, polygon: npt.ArrayLike) -> FloatArray:
    points = np.asarray(polygon, np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or not len(points) or not np.isfinite(points).all():
        raise ClearwayError("not a list of points x, y with finite coordinates", field=f"polygons[{k}]")
    return points


@light
def from_edge(x: float, y: float, k: int, walls: Walls) -> tuple[float, float]:
    """The vector [m] from the nearest point of edge `k` to (x, y)."""
    rx, ry = x - walls.vertex[k, 0], y - walls.vertex[k, 1]
    dx, dy = walls.direction[k, 0], walls.direction[k, 1]
    along = min(max(rx * dx + ry * dy, 0.0), walls.length[k])
    return rx - along * dx, ry - along * dy


@light
def parted(x: float, y: float, px: float, py: float, walls: Walls) -> bool:
    """Whether an edge lies between (x, y) and (px, py) [m]."""
    wx, wy = px - x, py - y
    for k in range(len(walls.length)):
        dx, dy = walls.direction[k, 0] * walls.length[k], walls.direction[k, 1] * walls.length[k]
        rx, ry = walls.vertex[k, 0] - x, walls.vertex[k, 1] - y
        begins = wx * ry - wy * rx  # to which side of the line of sight
        if begins * (begins + wx * dy - wy * dx) <= 0.0:
            here = rx * dy - ry * dx  # to which side of the edge
            if here * (here - wx * dy + wy * dx) < 0.0:
                return True
    return False

"""Shapes as arrays, as the compiled kernels take them.

Every shape is a row of points, thickened by a radius: a circle is one point with a radius, a polygon its vertices
without one, a segment two vertices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import light
from clearway.geometry.shapes import Circle, FloatArray, Shape


class Packed(NamedTuple):
    """n shapes.

    Attributes:
        points: (k, 2) m, all shapes' points one after another.
        first: (n + 1,) int64; the points of shape i are points[first[i]:first[i + 1]].
        radius: (n,) m, by which its points are thickened.
        reach: (n,) m, radius around the frame's origin that no part of the shape leaves.
    """

    points: FloatArray
    first: npt.NDArray[np.int64]
    radius: FloatArray
    reach: FloatArray


def pack(shapes: Sequence[Shape]) -> Packed:
    """`shapes` as arrays, each in its own frame."""
    points = [np.zeros((1, 2)) if isinstance(s, Circle) else s.array for s in shapes]
    radius = np.array([s.radius if isinstance(s, Circle) else 0.0 for s in shapes], dtype=np.float64)
    first = np.cumsum([0, *(len(p) for p in points)], dtype=np.int64)
    reach = np.array([np.hypot(*p.T).max() for p in points], dtype=np.float64) + radius
    return Packed(np.concatenate([np.zeros((0, 2)), *points]), first, radius, reach)


def place(packed: Packed, poses: FloatArray) -> Packed:
    """The same shapes at `poses` (n, 3): points in the frame of the poses; `reach` still around each pose."""
    which = np.repeat(np.arange(len(packed.radius)), np.diff(packed.first))
    at = np.asarray(poses, dtype=np.float64).reshape(-1, 3)[which]
    c, s = np.cos(at[:, 2]), np.sin(at[:, 2])
    x, y = packed.points[:, 0], packed.points[:, 1]
    points = np.stack([at[:, 0] + c * x - s * y, at[:, 1] + s * x + c * y], axis=1)
    return packed._replace(points=np.ascontiguousarray(points))


def boxes(packed: Packed) -> FloatArray:
    """(n, 4) x_min, y_min, x_max, y_max around each shape."""
    first = packed.first[:-1]
    if len(first) == 0:
        return np.zeros((0, 4))
    low = np.minimum.reduceat(packed.points, first) - packed.radius[:, None]
    high = np.maximum.reduceat(packed.points, first) + packed.radius[:, None]
    return np.ascontiguousarray(np.hstack([low, high]))


@light
def transform(points: FloatArray, x: float, y: float, theta: float, out: FloatArray) -> None:
    """Write `points` (k, 2), given in the frame at pose (x, y, theta), to `out` (k, 2) in the frame of that pose."""
    c, s = math.cos(theta), math.sin(theta)
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        out[i, 0] = x + c * px - s * py
        out[i, 1] = y + s * px + c * py


@light
def to_box(boxes: FloatArray, i: int, x: float, y: float) -> float:
    """Distance from (x, y) to the box boxes[i], x_min, y_min, x_max, y_max; 0.0 inside."""
    dx = max(max(boxes[i, 0] - x, x - boxes[i, 2]), 0.0)
    dy = max(max(boxes[i, 1] - y, y - boxes[i, 3]), 0.0)
    return math.sqrt(dx * dx + dy * dy)

"""A route as a path of poses near each other, its corners round if that is asked.

Behaviour read from ros-navigation/navigation2: nav2_route/src/path_converter.cpp, include/nav2_route/corner_smoothing.hpp.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray

Point = tuple[float, float]


class Shape(NamedTuple):
    """How the path is laid.

    Attributes:
        spacing: Between its poses at most, m.
        radius: Of corners, m; 0: they stay sharp.
        widest: Angle between two edges from which on they stay as they are, rad.
    """

    spacing: float
    radius: float
    widest: float


class _Arc(NamedTuple):
    begin: Point
    end: Point
    centre: Point


def dense(places: FloatArray, shape: Shape) -> FloatArray:
    """The path (m, 3) along the places (n, 2) of a route's nodes, n >= 1."""
    nodes = [(float(x), float(y)) for x, y in places]
    points: list[Point] = []
    here = nodes[0]
    for corner, after in pairwise(nodes[1:]):
        arc = _arc(here, corner, after, shape)
        if arc is None:
            points += _between(here, corner, shape.spacing)
            here = corner
        else:
            points += _between(here, arc.begin, shape.spacing)
            points += _around(arc, shape.spacing / shape.radius)
            here = arc.end
    if len(nodes) > 1:
        points += _between(here, nodes[-1], shape.spacing)
    points.append(nodes[-1])
    path = np.zeros((len(points), 3))
    path[:, :2] = points
    steps = np.diff(path[:, :2], axis=0)
    path[:-1, 2] = np.arctan2(steps[:, 1], steps[:, 0])
    if len(nodes) > 1:
        dx, dy = places[-1] - places[-2]
        path[-1, 2] = math.atan2(dy, dx)
    return path


def _between(a: Point, b: Point, spacing: float) -> list[Point]:
    """Points from a on towards b, as far apart as fits in; b itself is left to whoever goes on."""
    apart = math.hypot(b[0] - a[0], b[1] - a[1])
    n = math.ceil(np.float32(apart) / np.float32(spacing))  # in floats, as in the source, whose number it is then
    return [(a[0] + (b[0] - a[0]) * i / n, a[1] + (b[1] - a[1]) * i / n) for i in range(n)]


def _arc(before: Point, corner: Point, after: Point, shape: Shape) -> _Arc | None:
    """The arc that touches both edges of a corner; None: it doesn't fit in, or they lead straight on or back."""
    ends = [(p[0] - corner[0], p[1] - corner[1]) for p in (before, after)]
    lengths = [math.hypot(x, y) for x, y in ends]
    if shape.radius <= 0.0 or min(lengths) == 0.0:
        return None
    (ax, ay), (bx, by) = ((x / n, y / n) for (x, y), n in zip(ends, lengths, strict=True))
    angle = math.acos(min(max(ax * bx + ay * by, -1.0), 1.0))
    if angle < 1e-6 or angle > shape.widest:
        return None
    reach = shape.radius / math.tan(angle / 2.0)
    if reach >= min(lengths):
        return None
    middle, far = math.hypot(ax + bx, ay + by), shape.radius / math.sin(angle / 2.0)
    return _Arc(
        (corner[0] + ax * reach, corner[1] + ay * reach),
        (corner[0] + bx * reach, corner[1] + by * reach),
        (corner[0] + (ax + bx) / middle * far, corner[1] + (ay + by) / middle * far),
    )


def _around(arc: _Arc, most: float) -> list[Point]:
    """Points on an arc from its begin on, no further apart than `most` rad; its end is left to whoever goes on."""
    x, y = arc.centre
    begin = math.atan2(arc.begin[1] - y, arc.begin[0] - x)
    turn = wrap(math.atan2(arc.end[1] - y, arc.end[0] - x) - begin)
    radius = math.hypot(arc.begin[0] - x, arc.begin[1] - y)
    n = max(1, math.ceil(abs(turn) / most))
    angles = [begin + turn * i / n for i in range(n)]
    return [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]

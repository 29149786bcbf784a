"""The footprint as planners take it: how far a point is from a robot, inside it too, exact for discs and polygons."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import light
from clearway.geometry.distance import contains, point_to_segment
from clearway.geometry.packing import pack
from clearway.geometry.shapes import FloatArray, Shape, circumscribed_radius, inscribed_radius


class Footprint(NamedTuple):
    """A robot's outline in base_link.

    Attributes:
        vertices: (k, 2) m; one of a disc, else of a simple polygon, convex or not, without repetition.
        radius: m, by which the vertices (their polygon) are grown.
        inscribed: Radius of the largest disc around the origin that is inside, m.
        circumscribed: Radius of the smallest disc around the origin that holds all, m.
        lever: m, the farthest vertex from the origin: how far a turn by 1 rad moves the outline at most (0.0: a disc).
    """

    vertices: FloatArray
    radius: float
    inscribed: float
    circumscribed: float
    lever: float


def footprint(shape: Shape) -> Footprint:
    """`shape` (see `clearway.geometry.shapes`) as arrays and radii."""
    packed = pack([shape])
    vertices = np.ascontiguousarray(packed.points)
    lever = float(np.hypot(*vertices.T).max())
    return Footprint(
        vertices, float(packed.radius[0]), inscribed_radius(shape), float(circumscribed_radius(shape)), lever
    )


@light
def gap(vertices: FloatArray, radius: float, x: float, y: float, theta: float, px: float, py: float) -> float:
    """Signed distance [m] from the point (px, py) to the footprint at the pose (x, y, theta); negative inside.

    Args:
        vertices: (n, 2) corners of the `Footprint`, m; two are a segment.
        radius: Its radius, m.
    """
    c, s = math.cos(theta), math.sin(theta)
    qx, qy = c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)  # the point in base_link
    n = vertices.shape[0]
    if n == 1:
        return math.hypot(qx - vertices[0, 0], qy - vertices[0, 1]) - radius
    squared = math.inf
    i = n - 1
    for j in range(n):
        squared = min(squared, point_to_segment(qx, qy, vertices[i, 0], vertices[i, 1], vertices[j, 0], vertices[j, 1]))
        i = j
    outline = math.sqrt(squared)
    return (-outline if contains(vertices, qx, qy) else outline) - radius

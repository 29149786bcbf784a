"""Shapes: what robots, obstacles and walls are made of. Metres, in the frame of the body that they belong to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
"""float64; the docstring that uses it says the shape. A pose is (3,): x [m], y [m], theta [rad]."""


@dataclass(frozen=True, slots=True)
class Circle:
    """A disc around the body's origin.

    Attributes:
        radius: Its radius, m.
    """

    radius: float


@dataclass(frozen=True, slots=True)
class Polygon:
    """A simple polygon, convex or not, counter-clockwise. Two vertices make a segment: a wall without thickness.

    Attributes:
        vertices: Its corners x, y in the body's frame, m.
    """

    vertices: tuple[tuple[float, float], ...]

    @property
    def array(self) -> FloatArray:
        """The vertices as an array (n, 2)."""
        return np.array(self.vertices, dtype=np.float64)


Shape: TypeAlias = Circle | Polygon


def rectangle(length: float, width: float) -> Polygon:
    """A rectangle centred on the body's origin: `length` along x, `width` along y, in metres."""
    a, b = length / 2, width / 2
    return Polygon(((-a, -b), (a, -b), (a, b), (-a, b)))


def circumscribed_radius(shape: Shape) -> float:
    """Radius in metres of the smallest disc around the body's origin that holds the shape."""
    if isinstance(shape, Circle):
        return shape.radius
    return max(math.hypot(x, y) for x, y in shape.vertices)


def inscribed_radius(shape: Shape) -> float:
    """Distance in metres from the body's origin to the shape's boundary (nav costmaps call it the inscribed radius)."""
    if isinstance(shape, Circle):
        return shape.radius
    v = shape.array
    e = np.roll(v, -1, axis=0) - v
    s = np.clip(-(v * e).sum(1) / np.maximum((e * e).sum(1), 1e-300), 0.0, 1.0)
    return float(np.hypot(*(v + s[:, None] * e).T).min())


def row_of_discs(shape: Shape, bulge: float) -> FloatArray:
    """(n, 3) x, y, radius [m]: the fewest equal discs in a row that hold the box around `shape`, which is along its own axes, and stick
    out of that box's longer sides by `bulge` [m] at most; of a circle itself."""
    if isinstance(shape, Circle):
        return np.array([[0.0, 0.0, shape.radius]])
    low, high = shape.array.min(axis=0), shape.array.max(axis=0)
    size, middle = high - low, 0.5 * (low + high)
    along = int(size[1] > size[0])
    length, width = float(size[along]), float(size[1 - along])
    n = max(math.ceil(length / (2.0 * math.sqrt(bulge * (width + bulge)))), 1)
    discs = np.empty((n, 3))
    discs[:, :2], discs[:, 2] = middle, math.hypot(0.5 * length / n, 0.5 * width)
    discs[:, along] += length * ((np.arange(n) + 0.5) / n - 0.5)
    return discs

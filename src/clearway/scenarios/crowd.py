"""What stands in a scenario, to be asked for what is near, and how much may be compared with it in a check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.rasterise import outline
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.reading.limits import COMPARISONS
from clearway.scenarios.way import CELL


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """Something that stands in a scenario: a fixture or a static obstacle.

    Attributes:
        name: Of the fixture or the obstacle.
        shape: In its own frame.
        pose: (3,) x, y [m], theta [rad] in the map.
    """

    name: str
    shape: Shape
    pose: FloatArray

    @property
    def box(self) -> FloatArray:
        """(4,) what it lies in: x0, y0, x1, y1 [m]."""
        if isinstance(self.shape, Circle):
            x, y, r = self.pose[0], self.pose[1], self.shape.radius
            return np.array([x - r, y - r, x + r, y + r])
        points = outline(self.shape, self.pose)
        return np.concatenate([points.min(0), points.max(0)])


class Crowd:
    """Everything that stands in a scenario, to be asked for what is near."""

    def __init__(self, members: Sequence[Standing], boxes: FloatArray) -> None:
        self._members, self._boxes = members, boxes

    @classmethod
    def of(cls, members: Sequence[Standing]) -> Crowd:
        return cls(members, np.array([m.box for m in members]).reshape(-1, 4))

    def and_others(self, others: Crowd) -> Crowd:
        return Crowd([*self._members, *others._members], np.concatenate([self._boxes, others._boxes]))

    def near(self, places: FloatArray, radius: float, first: int | None = None) -> list[Standing]:
        """Of the `first` members (None: of all) those that a disc of `radius` [m] may touch that goes by `places` (n, 2)."""
        x0, y0, x1, y1 = self._boxes[:first].T
        (left, low), (right, high) = places.min(0) - radius, places.max(0) + radius
        touched = (x0 <= right) & (x1 >= left) & (y0 <= high) & (y1 >= low)
        return [self._members[int(i)] for i in np.flatnonzero(touched)]

    @property
    def extent(self) -> tuple[FloatArray, FloatArray]:
        """The least and the greatest x and y [m] of them all, (2,) each; inf and -inf where nothing stands."""
        return self._boxes[:, :2].min(0, initial=np.inf), self._boxes[:, 2:].max(0, initial=-np.inf)

    def drawn(self) -> float:
        """How many cells of a grid are looked at to draw them all."""
        width, height = (self._boxes[:, 2:] - self._boxes[:, :2]).T / CELL
        return float(((width + 1.0) * (height + 1.0) + 40.0 * (width + height)).sum())

    @property
    def members(self) -> Sequence[Standing]:
        return self._members


class Work:
    """Counts how often something is compared with something, so that a check of a small file ends soon."""

    def __init__(self) -> None:
        self._done = 0.0

    def add(self, count: float, field: str) -> None:
        """Count more.

        Raises:
            ClearwayError: now it is too much.
        """
        self._done += count
        if self._done > COMPARISONS:
            raise ClearwayError(
                f"what moves passes so many places, near so much, that {COMPARISONS:,} comparisons don't suffice to check it",
                field=field,
            )

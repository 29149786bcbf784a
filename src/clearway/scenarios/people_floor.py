"""The floor on which people find their ways: how far it reaches, and how large it may be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reading.limits import CELLS
from clearway.scenarios.crowd import Crowd
from clearway.scenarios.people import PersonSpec

CELL = 0.1
"""Edge of its cells, m."""
MARGIN = 2.0
"""It ends so far beyond everything that stands and everywhere that people go, m."""


def places_of(person: PersonSpec) -> list[tuple[float, float]]:
    """Places within whose box all lie to which somebody goes, m."""
    return [person.start, *(stop.at for stop in person.route), *_corners(person.track)]


def floor_size(low: FloatArray, high: FloatArray) -> tuple[int, int]:
    """Rows and columns of the floor from `low` (2,) to `high` (2,) [m]."""
    columns, rows = (np.ceil((high - low) / CELL).astype(int) + 1).tolist()
    return rows, columns


def floor_errors(people: Sequence[PersonSpec], standing: Crowd) -> Iterator[ClearwayError]:
    """Who goes so far that the floor would be too large."""
    low, high = standing.extent
    for i, person in enumerate(people):
        places = np.array(places_of(person))
        wider = np.minimum(low, places.min(0)), np.maximum(high, places.max(0))
        cells = math.prod(floor_size(wider[0] - MARGIN, wider[1] + MARGIN))
        if cells > CELLS:
            (x0, y0), (x1, y1) = places.min(0), places.max(0)
            where = f"goes from x {x0:g} to {x1:g} m and from y {y0:g} to {y1:g} m"
            yield ClearwayError(
                f"{person.name!r} {where}: the floor on which people find their ways would have {cells:.3g} cells of {CELL:g} m,"
                f" at most {CELLS:,} are",
                field=f"people.{i}.track" if person.track else f"people.{i}",
            )
        else:
            low, high = wider


def _corners(track: Sequence[tuple[float, float, float]]) -> Sequence[tuple[float, float]]:
    """Of the box around a recorded track, two that lie across from each other."""
    if not track:
        return ()
    _, x, y = zip(*track, strict=True)
    return (min(x), min(y)), (max(x), max(y))

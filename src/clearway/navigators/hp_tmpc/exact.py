"""The shortest path among discs: tangent visibility graph, searched lazily (the planner's option `exact`)."""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


@kernel
def exact_path(
    start: FloatArray, target: FloatArray, discs: FloatArray, area: FloatArray, bound: float
) -> tuple[int, FloatArray, float]:
    """(status, pieces, length) of the shortest path between two free points; status `NO_PATH` if there is none.

    Args: as `plan_path`, and `bound`: m, length of a known path (inf: none known); it only saves time.
    """
    return 0, np.zeros((0, 7)), 0.0

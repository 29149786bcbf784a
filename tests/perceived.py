"""What perception would tell of obstacles, for tests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clearway.contract import Obstacles


def obstacles(
    position: Any = (),
    velocity: Any = math.nan,
    radius: Any = 0.35,
    *,
    error: Any = 0.01,
    velocity_error: Any = math.inf,
    identity: Any = None,
    moving: Any = True,
) -> Obstacles:
    """Those at `position` (n, 2) [m], by default with nothing known of their velocities; whatever is given once holds for all."""
    at = np.array(position, dtype=np.float64).reshape(-1, 2)
    n = len(at)

    def each(value: Any, dtype: Any = np.float64, *shape: int) -> Any:
        return np.broadcast_to(np.asarray(value, dtype), (n, *shape)).copy()

    return Obstacles(
        at, each(velocity, np.float64, 2), each(radius), each(error), each(velocity_error),
        np.arange(n) if identity is None else each(identity, np.int64), each(moving, np.bool_),
    )  # fmt: skip


def exact(
    position: Any = (), velocity: Any = 0.0, radius: Any = 0.35, *, identity: Any = None, moving: Any = True
) -> Obstacles:
    """The same, known without an error."""
    return obstacles(position, velocity, radius, error=0.0, velocity_error=0.0, identity=identity, moving=moving)

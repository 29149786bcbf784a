"""What perception would tell of obstacles, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clearway.contract import Obstacles


def obstacles(
    position: Any, error: float = 0.01, identity: Sequence[int] | np.ndarray | None = None, moving: Any = True
) -> Obstacles:
    """Those at `position` (n, 2) [m], with nothing known of their velocities."""
    at = np.asarray(position, dtype=np.float64).reshape(-1, 2)
    n = len(at)
    return Obstacles(
        position=at, velocity=np.full((n, 2), np.nan), radius=np.full(n, 0.35), error=np.full(n, error),
        velocity_error=np.full(n, np.inf),
        identity=np.arange(n) if identity is None else np.asarray(identity, dtype=np.int64),
        moving=np.broadcast_to(np.asarray(moving, dtype=np.bool_), (n,)).copy(),
    )  # fmt: skip

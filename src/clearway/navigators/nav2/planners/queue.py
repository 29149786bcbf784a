"""The open set of a search: what is cheapest first; of what costs the same, what came first."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.geometry.compiled import kernel


@kernel
def order(cost: Any, count: int) -> Any:
    """A key that sorts by `cost` (float32, not negative), then by `count` (below 2^32); for `clearway.geometry.heap`."""
    return (np.int64(np.float32(cost).view(np.int32)) << np.int64(32)) | np.int64(count)

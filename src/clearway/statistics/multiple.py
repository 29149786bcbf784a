"""Many tests at once: Holm's adjustment and the paper's asterisks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.geometry.shapes import FloatArray

LEVELS = ((1e-4, "****"), (1e-3, "***"), (1e-2, "**"), (5e-2, "*"))
"""Paper A, Fig. 6: the asterisks that go with p up to each level."""


def holm(p: Sequence[float] | FloatArray) -> FloatArray:
    """Holm's step-down adjusted p (n,): below alpha, a test counts with the family's error held at alpha. NaN stays NaN."""
    values = np.asarray(p, dtype=np.float64)
    adjusted = np.full(len(values), np.nan)
    known = np.flatnonzero(~np.isnan(values))
    order = known[np.argsort(values[known], kind="stable")]
    factors = len(order) - np.arange(len(order))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(factors * values[order]))
    return adjusted


def asterisks(p: float | None) -> str:
    """`*` to `****` as in paper A's Fig. 6; empty above 0.05 or without a p."""
    if p is None:
        return ""
    return next((stars for level, stars in LEVELS if p <= level), "")

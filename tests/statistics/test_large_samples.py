"""Statistics of large samples: the same figures as by listing every pair and every resample, in memory that stays small."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy import stats

from clearway.statistics import bootstrap_interval, signed_rank
from clearway.statistics.describe import RESAMPLES
from clearway.statistics.signed_rank import walsh_average


@pytest.mark.parametrize("n", [1, 2, 3, 10, 57, 200, 201, 1500])
@pytest.mark.parametrize("digits", [1, 15])
def test_walsh_averages_are_found_without_listing_them(n: int, digits: int) -> None:
    d = np.round(np.random.default_rng(n).normal(size=n), digits)  # to one digit: many ties, zeros of both signs
    i, j = np.triu_indices(n)
    every = np.sort((d[i] + d[j]) / 2)
    for rank in {0, len(every) // 3, len(every) // 2, len(every) - 1}:
        assert walsh_average(np.sort(d), rank) == every[rank]
    assert signed_rank(np.round(d, 9)).shift == pytest.approx(float(np.median(every)), abs=2e-9)


@pytest.mark.parametrize("n", [8, 10, 57, 500, 3000])
def test_bootstrap_is_scipys(n: int) -> None:
    sample = np.random.default_rng(n).exponential(size=n) - 1
    rng = np.random.default_rng(7)
    theirs = stats.bootstrap((sample,), np.mean, n_resamples=RESAMPLES, confidence_level=0.9, method="BCa", rng=rng)
    ours = bootstrap_interval(sample, 0.9, seed=7)
    assert ours is not None
    assert (ours.low, ours.high) == pytest.approx(tuple(theirs.confidence_interval), rel=1e-12)


def test_memory_does_not_grow_with_the_square() -> None:
    sample = np.random.default_rng(0).normal(size=40_000)
    tracemalloc.start()
    signed_rank(sample)
    bootstrap_interval(sample)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6  # 40,000 values: 0.3 MB; their pairs: 6.4 GB

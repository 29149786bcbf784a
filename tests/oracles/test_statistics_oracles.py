"""Our statistics against independent software (scipy's own tests, statsmodels) and published examples."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from clearway.statistics import (
    bootstrap_interval,
    holm,
    mcnemar,
    mean_interval,
    paired_success,
    signed_rank,
    success_interval,
    wilson_interval,
)

sm_proportion = pytest.importorskip("statsmodels.stats.proportion")
sm_multitest = pytest.importorskip("statsmodels.stats.multitest")
sm_tables = pytest.importorskip("statsmodels.stats.contingency_tables")

RATES = [(k, n) for n in (1, 3, 29, 84) for k in {0, 1, n // 2, n - 1, n} if 0 <= k <= n]


@pytest.mark.parametrize(("k", "n"), RATES)
def test_success_intervals_against_statsmodels(k, n):
    for ours, method in ((success_interval, "beta"), (wilson_interval, "wilson")):
        low, high = sm_proportion.proportion_confint(k, n, alpha=0.05, method=method)
        found = ours(k, n)
        assert found.low == pytest.approx(low, abs=1e-9)
        assert found.high == pytest.approx(high, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_holm_against_statsmodels(seed):
    p = np.random.default_rng(seed).uniform(size=17) ** 3
    p[3] = p[9]
    assert holm(p) == pytest.approx(sm_multitest.multipletests(p, method="holm")[1], rel=1e-12)


@pytest.mark.parametrize(("b", "c"), [(0, 0), (0, 1), (1, 5), (4, 4), (12, 2), (30, 13)])
def test_mcnemar_against_statsmodels(b, c):
    if b + c:
        oracle = sm_tables.mcnemar([[10, b], [c, 7]], exact=True).pvalue
        assert mcnemar(b, c) == pytest.approx(oracle, rel=1e-9)
    else:
        assert mcnemar(b, c) == 1.0


@pytest.mark.parametrize("seed", range(6))
def test_signed_rank_against_scipy_exact(seed):
    d = np.random.default_rng(seed).normal(0.4, 1.0, size=5 + 9 * seed)
    oracle = stats.wilcoxon(d, method="exact")
    found = signed_rank(d)
    assert found.exact
    assert found.p == pytest.approx(oracle.pvalue, rel=1e-9)
    assert min(found.statistic, len(d) * (len(d) + 1) / 2 - found.statistic) == pytest.approx(oracle.statistic)


@pytest.mark.parametrize("zeros", ["wilcox", "pratt"])
@pytest.mark.parametrize("seed", range(6))
def test_signed_rank_with_ties_and_zeros_against_every_sign(zeros, seed):
    """All 2^n signs of the non-zero differences, as scipy's permutation method does it, but complete."""
    d = np.random.default_rng(seed).integers(-2, 5, size=9).astype(float)
    ranks = stats.rankdata(np.abs(d[d != 0])) if zeros == "wilcox" else stats.rankdata(np.abs(d))[d != 0]
    signs = np.array(list(itertools.product([0, 1], repeat=len(ranks))))
    sums = signs @ ranks
    observed = ranks[d[d != 0] > 0].sum()
    oracle = min(1.0, 2 * min((sums <= observed + 1e-9).mean(), (sums >= observed - 1e-9).mean()))
    assert signed_rank(d, zeros=zeros).p == pytest.approx(oracle, rel=1e-12)


def test_signed_rank_with_ties_against_scipy_permutations():
    d = np.array([1, 1, 2, -1, 3, 3, 0, 2, -2, 1, 4, 0], float)
    oracle = stats.wilcoxon(d, zero_method="wilcox", method=stats.PermutationMethod(n_resamples=np.inf))
    assert signed_rank(d).p == pytest.approx(oracle.pvalue, rel=1e-9)


def test_many_pairs_approach_the_normal_approximation():
    rng = np.random.default_rng(3)
    d = np.round(rng.normal(0.1, 1.0, size=400), 2)
    oracle = stats.wilcoxon(d, method="asymptotic", correction=True)
    found = signed_rank(d)
    assert not found.exact
    assert found.p == pytest.approx(oracle.pvalue, rel=1e-3)
    half = signed_rank(d[:200])
    assert half.exact
    assert half.p == pytest.approx(stats.wilcoxon(d[:200], method="asymptotic", correction=True).pvalue, rel=0.03)


def test_depression_example_of_r():
    """`?wilcox.test` in R (Hollander and Wolfe 1973, p. 29): V = 40, one-sided p = 0.01953, hence 0.03906 two-sided."""
    x = np.array([1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30])
    y = np.array([0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29])
    found = signed_rank(x - y)
    assert found.statistic == 40
    assert found.p == pytest.approx(0.0390625)
    walsh = sorted((a + b) / 2 for a, b in itertools.combinations_with_replacement(x - y, 2))
    assert found.shift == pytest.approx(walsh[22])  # the middle of 45
    # n = 9: P(W <= 5) = 10 / 512 <= 0.025 < P(W <= 6) = 14 / 512: the 6th and the 6th but last average
    assert (found.low, found.high) == (pytest.approx(walsh[5]), pytest.approx(walsh[-6]))


def test_difference_of_paired_rates_without_correlation_is_newcombe_s():
    """With phi = 0 the interval for paired rates is the one for independent rates (statsmodels: `newcomb`)."""
    a = np.array([1] * 20 + [1] * 20 + [0] * 10 + [0] * 10)
    b = np.array([1] * 20 + [0] * 20 + [1] * 10 + [0] * 10)
    found = paired_success(a, b).difference
    low, high = sm_proportion.confint_proportions_2indep(30, 60, 40, 60, method="newcomb", compare="diff")
    assert found.estimate == pytest.approx(-1 / 6)
    assert (found.low, found.high) == (pytest.approx(low, abs=1e-9), pytest.approx(high, abs=1e-9))


def test_mean_interval_against_scipy():
    sample = np.random.default_rng(1).gamma(2.0, size=25)
    oracle = stats.ttest_1samp(sample, 0).confidence_interval(0.95)
    found = mean_interval(sample)
    assert (found.low, found.high) == (pytest.approx(oracle.low), pytest.approx(oracle.high))
    boot = bootstrap_interval(sample)
    assert boot == bootstrap_interval(sample)
    assert boot.low == pytest.approx(found.low, abs=0.15)
    assert boot.high == pytest.approx(found.high, abs=0.25)


def test_difference_of_paired_rates_covers_the_truth():
    """Simulated: 60 tests, the same hard ones for both (correlated), true difference -0.1."""
    rng = np.random.default_rng(8)
    covered = 0
    for _ in range(400):
        hard, luck = rng.uniform(size=60), rng.uniform(size=(2, 60))
        a = (0.5 * (hard < 0.8) + 0.5 * (luck[0] < 0.8)) > 0.4  # P = 1 - 0.2 * 0.2
        b = a & (luck[1] < 1 - 0.1 / 0.96)
        found = paired_success(a, b).difference
        covered += found.low <= -0.1 <= found.high
    assert covered / 400 >= 0.93


def test_newcombe_s_own_example():
    """Newcombe 1998, Stat. Med. 17, 2635: 20, 12, 2, 16 of 50 pairs; method 10 gives 0.0562 to 0.3292."""
    first = np.repeat([1, 1, 0, 0], [20, 12, 2, 16])
    second = np.repeat([1, 0, 1, 0], [20, 12, 2, 16])
    found = paired_success(second, first).difference
    assert (found.estimate, found.low, found.high) == pytest.approx((0.2, 0.0562, 0.3292), abs=5e-5)

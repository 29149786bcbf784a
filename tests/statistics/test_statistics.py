"""Tests, intervals and correlations against values worked out by hand, on tables made by hand."""

from __future__ import annotations

import json
import math

import hypothesis.strategies as st
import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings

from clearway.errors import ClearwayError
from clearway.indicators import INDICATORS, row_schema
from clearway.statistics import (
    asterisks,
    compare,
    compare_all,
    correlation_table,
    correlations,
    describe,
    holm,
    mean_interval,
    paired_success,
    pearson,
    reduced_set,
    signed_rank,
    spearman,
    strength,
    success_rates,
    wilcoxon_between_speeds,
)


def trial(number=0, **cells):
    row = dict.fromkeys(row_schema().names)
    row |= {"suite": "hospital", "batch": "SO", "configuration": "single", "robot": "tiago", "navigator": "move-base"}
    row |= {"localisation": "amcl", "privileged": False, "floor_plan": "hall", "speed": 0.2, "repetition": 1, "seed": 1}
    row |= {"scenario": f"s{number}", "outcome": "reached", "reason": "", "failure": "", "success": True}
    row |= {"success_self": True, "not_computable": "{}"}
    unknown = set(cells) - set(row)
    assert not unknown
    return row | cells


def table(rows):
    return pa.Table.from_pylist(rows, schema=row_schema())


def so(value, *, sizes=(0.03, 0.15, 0.3, 0.6), repetitions=3, speeds=(0.2, 0.6), name="CT"):
    """A table with `value(speed, size, repetition)` in each trial; a dict of cells is taken as it is."""
    rows = []
    for speed in speeds:
        for size in sizes:
            for repetition in range(1, repetitions + 1):
                cells = value(speed, size, repetition)
                cells = cells if isinstance(cells, dict) else {name: cells}
                rows.append(trial(len(rows), speed=speed, size=size, repetition=repetition, **cells))
    return table(rows)


FAILED = {"success": False, "outcome": "timeout", "failure": "timeout", "not_computable": json.dumps({"CT": "late"})}


# ---- signed ranks --------------------------------------------------------------------------------------------------


def test_smallest_p_of_few_pairs():
    """The floors that 3, 5 and 6 pairs cannot go below (0.25, 0.0625, 0.031)."""
    for n, floor in ((3, 0.25), (5, 0.0625), (6, 0.03125)):
        found = signed_rank(np.arange(1.0, n + 1))
        assert found.p == found.smallest_p == floor
        assert found.effect == 1.0


def test_signed_rank_by_hand():
    # |d| ranks: 1 -> 1, 2 and -2 -> 2.5 each, 4 -> 4; W+ = 1 + 2.5 + 4 = 7.5; of 16 sign patterns,
    # four sum to 7.5 or more: 10, 9 (without the 1), and 7.5 twice (without either 2.5)
    found = signed_rank(np.array([1.0, 2.0, -2.0, 4.0, 0.0]))
    assert (found.n, found.zeros, found.statistic) == (4, 1, 7.5)
    assert found.p == pytest.approx(2 * 4 / 16)
    assert found.effect == pytest.approx((7.5 - 2.5) / 10)
    assert found.shift == pytest.approx(1.0)  # Walsh averages: the 8th of 15
    assert found.low is None


def test_no_pair_no_evidence():
    assert signed_rank(np.array([])).p == 1.0
    assert signed_rank(np.zeros(5)).p == 1.0
    assert signed_rank(np.array([])).shift is None
    with pytest.raises(ClearwayError, match="missing"):
        signed_rank(np.array([1.0, np.nan]))


def test_rounding_in_the_data_makes_no_tie():
    assert signed_rank(np.array([0.3, 0.1 * 3, -0.2, 0.5])).p == signed_rank(np.array([3.0, 3.0, -2.0, 5.0])).p


differences = st.lists(st.integers(-30, 30).map(float), min_size=1, max_size=40).map(np.array)


@settings(max_examples=60, deadline=None)
@given(differences)
def test_swapping_the_samples_changes_the_sign_only(d):
    one, two = signed_rank(d), signed_rank(-d)
    assert one.p == pytest.approx(two.p, rel=1e-9)
    assert one.effect == pytest.approx(-two.effect)
    assert one.shift == pytest.approx(-two.shift)
    assert one.smallest_p - 1e-15 <= one.p <= 1.0
    if one.low is not None:
        assert one.low <= one.shift <= one.high


def test_interval_of_the_shift_covers_as_often_as_it_says():
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(400):
        found = signed_rank(rng.normal(1.0, 2.0, size=12))
        covered += found.low <= 1.0 <= found.high
    assert 0.925 <= covered / 400 <= 0.985  # exact coverage at n = 12 is 0.9575


# ---- many tests ----------------------------------------------------------------------------------------------------


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03, 0.5]) == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert holm([0.9, 0.8]) == pytest.approx([1.0, 1.0])
    assert holm([0.02, math.nan, 0.01])[[0, 2]] == pytest.approx([0.02, 0.02])
    assert math.isnan(holm([0.02, math.nan])[1])


@pytest.mark.parametrize(
    ("p", "stars"),
    [
        (0.05, "*"),
        (0.0501, ""),
        (0.01, "**"),
        (0.0101, "*"),
        (0.001, "***"),
        (0.0001, "****"),
        (3e-15, "****"),
        (None, ""),
    ],
)
def test_asterisks_as_in_the_paper(p, stars):
    assert asterisks(p) == stars


# ---- speeds --------------------------------------------------------------------------------------------------------


def only(found, **where):
    rows = [r for r in found.to_pylist() if all(r[k] == v for k, v in where.items())]
    assert len(rows) == 1, [(r["indicator"], r["analysis"], r["speed_a"], r["speed_b"]) for r in rows]
    return rows[0]


def test_speeds_are_paired_by_configuration_and_repetition():
    # size and repetition change CT far more than speed does: only pairing sees the 1 to 2 s between the speeds
    data = so(lambda v, s, r: 100 * s + 10 * r - (0.0 if v == 0.2 else 1 + s))
    row = only(wilcoxon_between_speeds(data), indicator="CT", analysis="complete pairs")
    assert (row["n"], row["dropped"], row["zeros"]) == (12, 0, 0)
    assert (row["speed_a"], row["speed_b"]) == (0.2, 0.6)
    assert row["p"] == row["smallest_p"] == pytest.approx(2 / 2**12)
    assert (row["stars"], row["effect"], row["exact"]) == ("***", -1.0, True)
    assert row["p_holm"] == row["p"]
    assert row["mean_b"] - row["mean_a"] == pytest.approx(-1.27)
    means = only(wilcoxon_between_speeds(data), indicator="CT", analysis="configuration means")
    assert means["n"] == 4
    assert means["p"] == means["smallest_p"] == 0.125


def test_shuffling_the_trials_changes_nothing():
    data = so(lambda v, s, r: 100 * s + 10 * r - (0.0 if v == 0.2 else math.sin(9 * s + r)))
    order = np.random.default_rng(0).permutation(data.num_rows)
    one, two = wilcoxon_between_speeds(data), wilcoxon_between_speeds(data.take(pa.array(order)))
    drop = ["mean_a", "mean_b"]
    assert one.drop_columns(drop).equals(two.drop_columns(drop))


def test_failures_leave_the_pairs_and_are_ranked_worst_beside_them():
    # 0.6 m/s is faster by 10 s, but one trial in three never arrives
    def cell(v, s, r):
        return FAILED if v == 0.6 and r == 3 else {"CT": 50 + s + 0.01 * r - (10 + s if v == 0.6 else 0)}

    found = wilcoxon_between_speeds(so(cell))
    complete = only(found, indicator="CT", analysis="complete pairs")
    assert (complete["n"], complete["dropped"], complete["effect"]) == (8, 4, -1.0)
    worst = only(found, indicator="CT", analysis="failures ranked worst")
    assert (worst["n"], worst["dropped"]) == (12, 0)
    # ranks 1..8 negative (sum 36), the four failures share (9 + 10 + 11 + 12) / 4 and are positive (sum 42)
    assert worst["statistic"] == 42
    assert worst["effect"] == pytest.approx((42 - 36) / 78)
    assert worst["difference"] is None


def test_failures_at_both_speeds_are_equal_and_higher_can_be_better():
    def cell(v, s, r):
        value = FAILED if r == 3 or (v == 0.2 and r == 2) else {"MDO": 0.3 - 0.1 * (v == 0.6) - 0.01 * s}
        return value | ({"MDO": 0.0} if value is FAILED else {})

    row = only(wilcoxon_between_speeds(so(cell)), indicator="MDO", analysis="failures ranked worst")
    assert (row["n"], row["zeros"]) == (12, 4)
    # r = 1: 0.1 m less at 0.6 m/s (4 pairs, ranks 2.5); r = 2: failed at 0.2 only: better at 0.6 (4 pairs, ranks 6.5)
    assert row["statistic"] == 4 * 6.5


def test_unpaired_speeds_and_single_speeds_give_no_test():
    assert wilcoxon_between_speeds(so(lambda v, s, r: 1.0 * r, speeds=(0.2,))).num_rows == 0
    overtaking = [trial(i, speed=0.2, configuration="overtaking", CT=40.0 + i, repetition=i + 1) for i in range(3)]
    both = table(overtaking + so(lambda v, s, r: r - v).to_pylist())
    assert only(wilcoxon_between_speeds(both), indicator="CT", analysis="complete pairs")["dropped"] == 0


def test_tests_that_cannot_be_told_apart_are_dropped_not_guessed():
    rows = [trial(i, speed=v, CT=30.0 + i) for i, v in enumerate((0.2, 0.2, 0.6))]
    row = wilcoxon_between_speeds(table(rows)).to_pylist()
    assert row == []
    more = so(lambda v, s, r: r - v, sizes=(0.3,)).to_pylist()
    found = only(wilcoxon_between_speeds(table(rows + more)), indicator="CT", analysis="complete pairs")
    assert (found["n"], found["dropped"]) == (3, 1)


def test_holm_s_family_is_one_analysis_of_a_robot():
    data = so(lambda v, s, r: {"CT": s + r - v, "PL": s + r - v, "TCS": s + r + (r - 2) * v})
    found = wilcoxon_between_speeds(data)
    assert only(found, indicator="CT", analysis="complete pairs")["p_holm"] == pytest.approx(3 * 2 / 2**12)
    with pytest.raises(ClearwayError, match="did you mean 'TCS'"):
        wilcoxon_between_speeds(data, ["TSC"])


# ---- describing ----------------------------------------------------------------------------------------------------


def test_description_by_hand():
    data = so(lambda v, s, r: {1: 10.0, 2: 12.0, 3: 20.0}[r] + (10 if v == 0.6 else 0), sizes=(0.3,))
    row = only(describe(data), speed=0.2)
    assert (row["n"], row["missing"], row["mean"], row["median"]) == (3, 0, 14.0, 12.0)
    assert row["sd"] == pytest.approx(math.sqrt(28))
    half = 4.302653 * math.sqrt(28 / 3)  # t(0.975; 2) = 4.302653
    assert (row["t_low"], row["t_high"]) == (pytest.approx(14 - half, rel=1e-6), pytest.approx(14 + half, rel=1e-6))
    # over both speeds the range is 10 to 30: the paper's Fig. 6 puts the mean at (14 - 10) / 20
    assert (row["range_low"], row["range_high"], row["norm_mean"]) == (10.0, 30.0, pytest.approx(0.2))
    assert row["boot_low"] is None  # of three values there is no bootstrap


def test_an_interval_stays_within_what_the_indicator_can_be():
    table = so(lambda v, s, r: {1: 1.0, 2: 30.0}[r], sizes=(0.3,), repetitions=2)
    row = only(describe(table), speed=0.2)
    assert (row["n"], row["t_low"]) == (2, 0.0)  # unbounded: 15.5 - 12.7 * 14.5
    shares = mean_interval(np.array([1.0, 99.0]), bounds=(0.0, 100.0))
    assert shares is not None
    assert (shares.low, shares.high) == (0.0, 100.0)
    assert (INDICATORS["TCS"].bounds, INDICATORS["DE"].bounds) == ((0.0, 100.0), (0.0, math.inf))


@pytest.mark.parametrize(("only_b", "doubtful"), [(5, True), (6, False), (0, False)])
def test_where_the_interval_and_mcnemar_disagree_is_told(only_b: int, doubtful: bool):
    a, b = np.zeros(20), np.r_[np.ones(only_b), np.zeros(20 - only_b)]
    found = paired_success(a, b)
    assert found.doubtful is doubtful  # 5 of 20 against none: the interval leaves out 0, McNemar's p is 2 / 32


def test_description_counts_what_is_missing_and_says_why():
    data = so(lambda v, s, r: FAILED if r == 1 else 40.0, sizes=(0.3,))
    row = only(describe(data), speed=0.6)
    assert (row["n"], row["missing"], row["reasons"]) == (2, 1, "late (1)")
    assert (row["sd"], row["shapiro_p"], row["norm_mean"]) == (0.0, None, 0.0)
    assert describe(data).filter(pa.compute.equal(describe(data)["indicator"], "MDO")).num_rows == 0


def test_normality_tells_a_normal_sample_from_a_skewed_one():
    rng = np.random.default_rng(2)
    normal, skewed = rng.normal(size=30), rng.exponential(size=30)
    data = so(lambda v, s, r: {"CT": normal[r - 1], "PL": skewed[r - 1]}, sizes=(0.3,), repetitions=30)
    found = describe(data)
    assert only(found, speed=0.2, indicator="CT")["normal"] is True
    assert only(found, speed=0.2, indicator="PL")["normal"] is False


def test_success_rates():
    data = so(lambda v, s, r: FAILED if v == 0.6 and s == 0.6 else 40.0)
    slow, fast = success_rates(data).to_pylist()
    assert (slow["n"], slow["SR"], slow["high"], slow["failures"]) == (12, 100.0, 100.0, "")
    assert slow["low"] == pytest.approx(100 * 0.025 ** (1 / 12))
    assert (fast["successes"], fast["SR"], fast["failures"]) == (9, 75.0, "timeout (3)")
    assert (fast["SR_self"], fast["self_successes"]) == (100.0, 12)
    assert (fast["SR_slack"], fast["slack_n"]) == (None, 0)  # results from before it was scored
    i, slack = data.column_names.index("success_slack"), pa.array([True] * 21 + [False] * 3)
    (all_of_it,) = success_rates(data.set_column(i, "success_slack", slack), by=("robot",)).to_pylist()
    assert all_of_it["SR_slack"] == 87.5
    assert (all_of_it["n"], all_of_it["successes"]) == (24, 21)


# ---- correlations --------------------------------------------------------------------------------------------------


def test_pearson_by_hand():
    # deviations (-2, -1, 0, 1, 2) and (-1, 0, -2, 2, 1): 2 + 0 + 0 + 2 + 2 = 6 over sqrt(10 * 10)
    found = pearson(np.array([1.0, 2, 3, 4, 5]), np.array([2.0, 3, 1, 5, 4]))
    assert found.r == pytest.approx(0.6)
    assert (found.n, found.strength) == (5, "too few trials")
    assert pearson(np.arange(10.0), np.arange(10.0)).strength == "very strong"
    assert found.low == pytest.approx(math.tanh(math.atanh(0.6) - 1.959964 / math.sqrt(2)), abs=1e-6)
    missing = pearson(np.array([1.0, 2, 3, 4, 5, 9]), np.array([2.0, 3, 1, 5, 4, math.nan]))
    assert missing == found
    assert pearson(np.ones(9), np.arange(9.0)).r is None
    assert spearman(np.arange(9.0), np.exp(np.arange(9.0))).r == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("r", "word"),
    [(0.19, "very low"), (-0.2, "low"), (0.39, "low"), (0.4, "moderate"), (-0.599, "strong"), (0.594, "moderate"),
     (0.79, "strong"), (0.8, "very strong"), (1.0, "very strong")],
)  # fmt: skip
def test_strength_in_the_paper_s_words(r, word):
    assert strength(r) == word


def test_correlations_drop_missing_values_pairwise_and_pool_the_robots():
    def cell(v, s, r):
        return {"CT": s + r, "PL": 2 * s - r, "MDO": None if s == 0.6 else s * r}

    one = so(cell)
    two = table([row | {"robot": "hosbot"} for row in one.to_pylist()])
    matrix = correlations(one)
    assert matrix.pairs["CT", "PL"].n == 24
    assert matrix.pairs["MDO", "CT"].n == 18
    assert matrix.r[0, 0] == pytest.approx(1.0)
    assert np.isnan(matrix.r[matrix.indicators.index("DE")]).all()
    both = correlation_table(pa.concat_tables([one, two]))
    pooled = only(both, robot="pooled", a="CT", b="MDO")
    assert (pooled["n"], pooled["paper"]) == (36, 0.18)
    assert only(both, robot="tiago", a="CT", b="MDO")["r"] == pytest.approx(pooled["r"])
    assert set(correlation_table(one)["robot"].to_pylist()) == {"tiago"}


def test_reduced_set_keeps_the_less_entangled_one():
    rng = np.random.default_rng(4)
    x, y, z = rng.normal(size=(3, 200))
    rows = [trial(i, CT=x[i], PL=x[i] + 0.2 * y[i], DE=y[i], OE=0.7 * y[i] + 0.7 * x[i], TCS=z[i]) for i in range(200)]
    found = reduced_set(correlations(table(rows)))
    assert {name for name, _, _ in found.dropped} == {"PL", "OE"} or {n for n, _, _ in found.dropped} == {"CT", "OE"}
    assert "TCS" in found.kept
    assert "DE" in found.kept
    kept = correlations(table(rows), list(found.kept))
    off = kept.r[~np.eye(len(found.kept), dtype=bool)]
    assert np.nanmax(np.abs(off)) < 0.4
    assert reduced_set(correlations(table(rows[:9]))).dropped == (), "too few trials to call one redundant"
    assert reduced_set(correlations(table(rows[:10]))).dropped != ()


# ---- comparing results ---------------------------------------------------------------------------------------------


def test_compare_two_navigators():
    a = so(lambda v, s, r: 100 * s + 10 * r)
    b = so(lambda v, s, r: FAILED if (s, r, v) == (0.6, 3, 0.6) else 100 * s + 10 * r - 2 - s / 10)
    b = table([row | {"navigator": "other"} for row in b.to_pylist()])
    found = compare(a, b, names=("move-base", "other"))
    assert (found.pairs, found.only_a, found.only_b) == (24, 0, 0)
    row = only(found.differences, indicator="CT", batch=None)
    assert (row["n"], row["dropped"], row["favours"]) == (23, 1, "B")
    assert row["effect"] == -1.0
    assert row["boot_low"] <= row["mean_difference"] <= row["boot_high"] < -2.0
    assert only(found.differences, indicator="CT", batch="SO")["p"] == row["p"]
    assert found.success[None].only_a == 1
    assert found.success["SO"].difference.estimate == pytest.approx(-1 / 24)
    assert only(found.differences, indicator="PL", batch=None)["p"] is None


def test_pairs_are_counted_as_tests_without_their_repetitions():
    a = so(lambda v, s, r: 100 * s + 10 * r)  # 2 speeds, 4 sizes, 3 repetitions
    b = table([row | {"navigator": "other"} for row in a.to_pylist()])
    found = compare(a, b, confidence=0.8)
    assert (found.pairs, found.tests, found.confidence) == (24, 8, 0.8)
    assert compare(a, b.filter(np.array(b["repetition"]) == 2)).tests == 8


def test_robots_of_one_simulation_are_paired_by_name_and_told_of():
    def both(*members, one):
        runs = [(m, f"{one}/{r}") for r in range(4) for m in members]
        rows = [trial(i // 2, navigator=one, member=m, run=run, CT=10.0 + len(m)) for i, (m, run) in enumerate(runs)]
        return table(rows)

    found = compare(both("robot", "robot 2", one="a"), both("robot 2", "robot", one="b"))
    assert (
        found.differences["mean_difference"].to_pylist()[0] == 0.0
    )  # "robot" beside "robot", not the first beside the first
    assert (found.pairs, found.together) == (8, 8)
    alone = table([trial(i, CT=float(i)) for i in range(4)])
    assert compare(alone, alone).together == 0


def test_speeds_are_paired_robot_by_robot():
    rows = [
        trial(i, speed=v, repetition=r, member=m, run=f"{v} {r}", CT=v + r)
        for i, (v, r, m) in enumerate((v, r, m) for v in (0.2, 0.6) for r in (1, 2, 3) for m in ("robot", "robot 2"))
    ]
    found = only(wilcoxon_between_speeds(table(rows), ["CT"]), analysis="complete pairs")
    assert (found["n"], found["dropped"]) == (6, 0)


def test_compare_needs_something_in_common():
    a = so(lambda v, s, r: 1.0)
    b = table([row | {"suite": "other"} for row in a.to_pylist()])
    with pytest.raises(ClearwayError, match="no test in common"):
        compare(a, b)
    with pytest.raises(
        ClearwayError, match="two trials for suite hospital, scenario s0, robot tiago, navigator move-base; choose"
    ):
        compare(pa.concat_tables([a, a]), a)
    with pytest.raises(ClearwayError, match="at least two"):
        compare_all({"a": a})
    assert len(compare_all({"a": a, "b": a, "c": a})) == 3
    assert [(c.a, c.b) for c in compare_all({"a": a, "b": b, "c": a, "d": b})] == [("a", "c"), ("b", "d")]
    with pytest.raises(ClearwayError, match="a and b have no test in common"):
        compare_all({"a": a, "b": b})
    assert compare(a, a).differences["p"].to_pylist()[0] == 1.0


def test_a_table_without_trials_gives_tables_without_rows():
    nothing = table([])
    for function in (describe, success_rates, wilcoxon_between_speeds, correlation_table):
        assert function(nothing).num_rows == 0
    assert correlations(nothing).pairs["CT", "PL"].r is None
    assert reduced_set(correlations(nothing)).dropped == ()


def test_every_column_that_a_table_lacks_is_named():
    with pytest.raises(ClearwayError, match="unknown column 'success'"):
        success_rates(so(lambda v, s, r: 1.0).drop_columns(["success"]))
    assert "CT" in INDICATORS

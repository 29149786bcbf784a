"""Recordings beside simulations and beside recordings: matched by configuration, against values worked out by hand."""

from __future__ import annotations

import json

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from clearway.errors import ClearwayError
from clearway.indicators import row_schema
from clearway.reports.text import comparison as printed
from clearway.statistics import (
    Comparison,
    ConfigurationComparison,
    compare,
    compare_all,
    compare_configurations,
    rate_difference,
)
from clearway.statistics.configurations import repetition_interval


def row(source, configuration, repetition, **cells):
    whole = dict.fromkeys(row_schema().names)
    whole |= {"suite": "hospital", "batch": "SO", "configuration": configuration, "robot": "tiago", "speed": 0.6}
    whole |= {"repetition": repetition, "success": True, "outcome": "reached", "source": source, "not_computable": "{}"}
    if source == "simulated":
        whole |= {"navigator": "move-base", "scenario": f"{configuration}-{cells.get('speed', 0.6)}-{repetition}"}
    else:
        whole |= {"navigator": "recorded"}
    return whole | cells


def table(rows):
    return pa.Table.from_pylist(rows, schema=row_schema())


def side(source, values, **cells):
    """A table with the CT's of each configuration."""
    return table([row(source, c, k + 1, CT=ct, **cells) for c, cts in values.items() for k, ct in enumerate(cts)])


SIM = {"single": [20.0, 21.0, 22.0], "parallel": [30.0, 30.0, 30.0], "perpendicular": [25.0, 26.0, 27.0]}
REAL = {"single": [24.0, 26.0], "parallel": [31.0, 33.0], "behind": [1.0]}


def differences(found, batch=None, indicator="CT"):
    return next(r for r in found.differences.to_pylist() if (r["batch"], r["indicator"]) == (batch, indicator))


def test_a_simulation_and_a_recording_are_matched_by_configuration():
    [found] = compare_all({"sim": side("simulated", SIM), "real": side("recorded", REAL)})
    assert isinstance(found, ConfigurationComparison)
    assert found.kind == "sim-to-real difference"
    assert (found.configurations, found.only_a, found.only_b) == (2, 1, 1)
    assert found.matched_by == ("suite", "batch", "configuration", "speed", "obstacle_speed", "size", "gap", "robot")
    assert (found.repetitions_a.trials, found.repetitions_a.fewest, found.repetitions_a.most) == (6, 3, 3)
    assert (found.repetitions_b.trials, found.repetitions_b.fewest, found.repetitions_b.most) == (4, 2, 2)
    ct = differences(found)
    # means of configurations: 21 and 30 against 25 and 32
    assert (ct["n"], ct["trials_a"], ct["trials_b"]) == (2, 6, 4)
    assert (ct["mean_a"], ct["mean_b"], ct["mean_difference"]) == (25.5, 28.5, 3.0)
    assert ct["median_difference"] == 3.0
    assert ct["boot_low"] is None  # two configurations are no sample to draw from
    # over repetitions: variances (1 + 0) * 2 / 4 = 0.5 of 3 and 2 of 2 trials, in 2 configurations each
    spread_a, spread_b = 0.5 * (2 / 3) / 4, 2.0 * (2 / 2) / 4
    half = (
        stats.t.ppf(0.975, (spread_a + spread_b) ** 2 / (spread_a**2 / 4 + spread_b**2 / 2))
        * (spread_a + spread_b) ** 0.5
    )
    assert (ct["rep_low"], ct["rep_high"]) == (pytest.approx(3 - half), pytest.approx(3 + half))
    [turned] = compare_all({"real": side("recorded", REAL), "sim": side("simulated", SIM)})
    assert turned.kind == "real-to-sim difference"
    assert differences(turned)["mean_difference"] == -3.0


def test_two_recordings_before_and_after():
    before, after = side("recorded", REAL), side("recorded", {c: [v - 1 for v in x] for c, x in REAL.items()})
    [found] = compare_all({"before": before, "after": after})
    assert isinstance(found, ConfigurationComparison)
    assert (found.kind, found.source_a, found.source_b) == ("difference", "recorded", "recorded")
    assert found.matched_by[-2:] == ("robot", "navigator")
    assert differences(found)["mean_difference"] == pytest.approx(-1.0)


def test_simulations_are_paired_test_by_test_as_ever():
    a, b = side("simulated", SIM), side("simulated", {c: [v + 1 for v in x] for c, x in SIM.items()})
    [found] = compare_all({"a": a, "b": b})
    assert isinstance(found, Comparison)
    alone = compare(a, b, names=("a", "b"))
    assert found.differences.equals(alone.differences)
    assert differences(found)["n"] == 9
    older = [t.drop_columns(["source"]) for t in (a, b)]
    assert compare(*older).differences.equals(compare(a, b).differences)
    assert isinstance(compare_all({"a": older[0], "b": older[1]})[0], Comparison)


def test_success_is_a_difference_of_rates_of_independent_trials():
    sim = table([row("simulated", "single", k, success=k < 10) for k in range(12)])
    real = table([row("recorded", "single", k, success={0: None, 1: False}.get(k, True)) for k in range(6)])
    [found] = compare_all({"sim": sim, "real": real})
    for batch in (None, "SO"):
        s = found.success[batch]
        assert (s.successes_a, s.trials_a, s.successes_b, s.trials_b) == (10, 12, 4, 5), "what nobody knows is left out"
        assert s.difference.estimate == pytest.approx(4 / 5 - 10 / 12)
        assert s.difference.low < s.difference.estimate < s.difference.high


def test_difference_of_rates_is_newcombes_tenth():
    """His examples: 56/70 - 48/80, 9/10 - 3/10, 10/10 - 0/20 (Stat. Med. 17, 873, Table II)."""
    for (k, n, of_k, of_n), (low, high) in {
        (48, 80, 56, 70): (0.0524, 0.3339), (3, 10, 9, 10): (0.1705, 0.8090), (0, 20, 10, 10): (0.6791, 1.0),
    }.items():  # fmt: skip
        found = rate_difference(k, n, of_k, of_n).difference
        assert (found.low, found.high) == (pytest.approx(low, abs=5e-5), pytest.approx(high, abs=5e-5))


@given(
    st.lists(st.floats(-5, 5), min_size=2, max_size=8, unique=True),
    st.lists(st.floats(-5, 5), min_size=2, max_size=8, unique=True),
)
def test_of_one_configuration_the_interval_over_repetitions_is_welchs(one, two):
    one, two = np.round(one, 3), np.round(two, 3)
    if one.std() < 1e-3 or two.std() < 1e-3:
        return
    found = repetition_interval([one], [two], 0.9)
    welch = stats.ttest_ind(two, one, equal_var=False).confidence_interval(0.9)
    assert found == (pytest.approx(welch.low, abs=1e-9), pytest.approx(welch.high, abs=1e-9))


def test_without_repetitions_there_is_no_interval_over_them():
    [found] = compare_all({"sim": side("simulated", {"single": [20.0]}), "real": side("recorded", REAL)})
    ct = differences(found)
    assert (ct["n"], ct["rep_low"], ct["boot_low"]) == (1, None, None)
    assert ct["mean_difference"] == 5.0


def test_a_configuration_without_a_value_is_dropped():
    real = side("recorded", {"single": [24.0], "parallel": [None, None]})
    ct = differences(compare_all({"sim": side("simulated", SIM), "real": real})[0])
    assert (ct["n"], ct["dropped"], ct["mean_difference"]) == (1, 1, 3.0)


def test_uncertainty_of_what_was_measured_stands_beside():
    sim = side("simulated", {"single": [20.0] * 2}, DE=0.05, DE_U=0.0, MDO=0.4)
    real = side("recorded", {"single": [20.0] * 2}, DE=0.07, DE_U=0.004, MDO=0.3)
    found = compare_configurations(sim, real, names=("sim", "real"))
    de, mdo = differences(found, indicator="DE"), differences(found, indicator="MDO")
    assert (de["u_a"], de["u_b"]) == (0.0, 0.004)
    assert mdo["u_b"] is None
    said = printed(found)
    assert "sim-to-real difference" in said
    assert "0.004" in next(line for line in said.splitlines() if "DE [m]" in line and line.startswith("SO"))
    assert "all" not in {line.split(" ")[0] for line in said.splitlines()}, "there is one batch only"
    assert "effect: matched-pairs rank-biserial" in said
    assert "matched by suite, batch, configuration" in said
    assert "sim: 2 trials, 2 of each configuration" in said
    json.dumps(found.differences.to_pylist())


def test_legs_found_by_motion_are_footnoted_where_one_side_only_has_them():
    sim, real = side("simulated", SIM, legs_by_motion=False), side("recorded", REAL, legs_by_motion=True)
    found = compare_configurations(sim, real, names=("sim", "real"), indicators=["CT", "DE"])
    assert (found.by_motion_a, found.by_motion_b) == (0, found.repetitions_b.trials)
    said = printed(found)
    assert "CT [s]*" in said
    assert "* real: the legs of" in said
    assert "DE [m]*" not in said
    assert "*" not in printed(compare_configurations(real, real, names=("before", "after"))), "both are off alike"
    assert "*" not in printed(compare_configurations(sim, side("recorded", REAL), names=("sim", "real")))


def test_a_difference_below_what_people_measure_is_nil():
    sim, real = (
        side("simulated", {"single": [20.0] * 2}, DE=0.05),
        side("recorded", {"single": [20.0] * 2}, DE=0.05 - 9e-7),
    )
    de = next(line for line in printed(compare_configurations(sim, real)).splitlines() if "DE [m]" in line)
    assert "e-07" not in de


def test_what_cannot_be_matched_says_what_there_is():
    with pytest.raises(ClearwayError, match=r"no configuration in common.*sim has suite hospital.*real has suite own"):
        compare_all({"sim": side("simulated", SIM), "real": side("recorded", REAL, suite="own")})
    both = pa.concat_tables([side("simulated", SIM), side("simulated", SIM, navigator="teb")])
    with pytest.raises(ClearwayError, match=r"sim has 2 values of navigator \(move-base, teb\)"):
        compare_all({"sim": both, "real": side("recorded", REAL)})


def test_a_set_speed_that_nobody_knows_matches_only_itself():
    a, b = side("recorded", REAL, speed=None), side("recorded", REAL, speed=None)
    assert compare_all({"a": a, "b": b})[0].configurations == 3
    with pytest.raises(ClearwayError, match="no configuration"):
        compare_all({"a": a, "b": side("recorded", REAL)})
    near = side("recorded", REAL, speed=0.6 + 1e-12)
    assert compare_all({"a": near, "b": side("recorded", REAL)})[0].configurations == 3


def test_the_rounding_of_means_is_no_difference():
    [found] = compare_all({
        "sim": side("simulated", {"single": [0.1, 0.2, 0.3], "parallel": [0.3, 0.3, 0.3]}),
        "real": side("recorded", {"single": [0.3, 0.2, 0.1], "parallel": [0.3, 0.3, 0.3 + 1e-15]}),
    })  # fmt: skip
    row = differences(found)
    assert (row["mean_difference"], row["effect"]) == (0.0, 0.0)

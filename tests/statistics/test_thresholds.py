"""The search for a threshold: coverage of its interval by simulation, what it costs, isotonic regression."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import binom

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.statistics.thresholds import ThresholdSearch, fewest_trials, isotonic, log_evidence

X = np.linspace(0.5, 1.2, 36)
CURVES = {
    "step": (X > 0.77).astype(float),
    "steep": ndtr((X - 0.8) / 0.02),
    "shallow": ndtr((X - 0.75) / 0.15),
    "just missed everywhere": np.full(36, 0.79),
    "just met everywhere": np.full(36, 0.801),
    "levels off below": 0.7 * ndtr((X - 0.8) / 0.03),
}


def _searched(curve: FloatArray, seed: int, reliability: float, confidence: float, most: int = 400) -> ThresholdSearch:
    rng = np.random.default_rng(seed)
    search = ThresholdSearch(len(curve), reliability, confidence, most)
    while (block := search.next()) is not None:
        search.tell(block, int(rng.binomial(block.trials, curve[block.index])))
    return search


@pytest.mark.parametrize("name", CURVES)
def test_the_interval_holds_the_true_threshold_at_least_as_often_as_it_says(name: str) -> None:
    curve, runs, confidence = CURVES[name], 300, 0.8
    true = int(np.argmax(curve >= 0.8)) if (curve >= 0.8).any() else len(curve)
    held = 0
    for seed in range(runs):
        found = _searched(curve, seed, 0.8, confidence)
        held += (-1 if found.fails is None else found.fails) < true <= (36 if found.passes is None else found.passes)
    assert binom.cdf(held, runs, confidence) > 0.01, f"{held} of {runs}"


def test_a_bet_grows_only_by_chance_where_success_is_exactly_r() -> None:
    rng = np.random.default_rng(1)
    outcomes = rng.random((2000, 100)) < 0.9
    successes = outcomes.cumsum(axis=1)
    ever = [
        any(log_evidence(int(row[n - 1]), n, 0.9, above=True) >= np.log(10) for n in range(5, 101, 5))
        for row in successes
    ]
    assert np.mean(ever) < 0.1  # Ville: the wealth ever reaches 10 with probability at most 1/10
    assert np.mean(ever) > 0.01  # and it isn't asleep


def test_a_clear_edge_is_found_to_one_step_and_few_trials() -> None:
    found = _searched(CURVES["step"], 0, 0.95, 0.95)
    edge = int(np.argmax(CURVES["step"] > 0))
    assert (found.fails, found.passes, found.estimate) == (edge - 1, edge, edge)
    assert found.trials.sum() < 130


def test_the_fewest_trials_are_near_those_of_a_plan_of_fixed_length() -> None:
    fixed = int(np.ceil(np.log(0.05) / np.log(0.95)))  # 59: no failure in as many shows 95 % with 95 % confidence
    assert fixed < fewest_trials(0.95, 0.95) < 1.6 * fixed
    assert log_evidence(90, 90, 0.95, above=True) > 0 > log_evidence(80, 90, 0.95, above=True)
    assert log_evidence(60, 90, 0.95, above=False) > np.log(1000)


def test_what_is_met_nowhere_and_everywhere() -> None:
    never, always = _searched(np.zeros(36), 0, 0.9, 0.9), _searched(np.ones(36), 0, 0.9, 0.9)
    assert never.passes is None
    assert never.fails == 35
    assert never.estimate is None
    assert always.passes == 0
    assert always.fails is None


def test_the_easiest_value_gets_what_trials_are_left_until_it_is_decided() -> None:
    hard = [0.1, 0.3, 0.5, 0.7]
    for seed in range(10):
        enough = _searched(np.array([*hard, 0.98]), seed, 0.95, 0.95, 5000)
        assert enough.passes == 4
        too_hard = _searched(np.array([*hard, 0.85]), seed, 0.95, 0.95, 5000)
        assert too_hard.fails == 4
        assert too_hard.trials.sum() < 1000
        near = _searched(np.array([*hard, 0.95]), seed, 0.95, 0.95, 600)
        assert near.trials.sum() == 600 or near.passes == 4 or near.fails == 4


def test_isotonic_regression_pools_violators() -> None:
    assert isotonic([0.0, 0.5, 0.25, 1.0], [4, 4, 4, 4]).tolist() == [0.0, 0.375, 0.375, 1.0]
    assert isotonic([1.0, 0.0], [1, 3]).tolist() == [0.25, 0.25]
    assert isotonic([], []).tolist() == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((10, 1.0), "reliability 1 must lie between"),
        ((10, 95.0), "did you mean 0.95"),
        ((10, 0.9, 1.0), "confidence 1 must lie between"),
        ((1, 0.9), "no range"),
        ((10, 0.999), "400 trials cannot show 0.999 success"),
    ],
)
def test_what_cannot_be_asked(arguments: tuple[float, ...], said: str) -> None:
    with pytest.raises(ClearwayError, match=said):
        ThresholdSearch(*arguments)  # type: ignore[arg-type]

"""How rare a failure is, of events whose probability a formula gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy import special

from clearway.errors import ClearwayError
from clearway.searching.candidates import NOISES, Candidate
from clearway.searching.rarity import rarity

Judge = Callable[[Sequence[Candidate]], list[float | None]]


class Box:
    def __init__(self, *sizes: int) -> None:
        self._sizes = sizes

    def __len__(self) -> int:
        return len(self._sizes)

    def size(self, base: int) -> int:
        return self._sizes[base]


def _told(judge: Judge, trials: int = 3000, seed: int = 0, space: Box | None = None):
    return rarity("event", space or Box(5), judge, trials, seed, lambda *_: None)


def _plane(probability: float) -> Judge:
    limit = -float(special.ndtri(probability))
    return lambda asked: (limit - special.ndtri([c.point for c in asked]).sum(axis=1) / math.sqrt(5)).tolist()


@pytest.mark.parametrize(("probability", "splitting"), [(1e-4, True), (0.2, False)])
def test_the_mean_is_right_and_intervals_hold_the_truth(probability, splitting):
    found = [_told(_plane(probability), seed=seed) for seed in range(12)]
    estimates = np.array([r.probability for r in found])
    assert all(r.splitting is splitting for r in found)
    assert abs(estimates.mean() - probability) < 4 * estimates.std() / math.sqrt(12)
    assert sum(r.low <= probability <= r.high for r in found) >= 9
    assert all(r.low <= r.probability <= r.high for r in found)
    assert all(r.trials <= 3000 for r in found)


def test_plain_sampling_counts_none_of_the_draws_that_chose_it():
    asked_for: list[tuple[float, ...]] = []

    def judge(asked: Sequence[Candidate]) -> list[float | None]:
        asked_for.extend(tuple(c.point) for c in asked)
        return _plane(0.2)(asked)

    found = _told(judge)
    assert not found.splitting
    assert len(set(asked_for)) == len(asked_for) == found.trials


def test_the_same_seed_tells_the_same_and_another_one_another():
    assert _told(_plane(1e-3), seed=4) == _told(_plane(1e-3), seed=4)
    assert _told(_plane(1e-3), seed=4) != _told(_plane(1e-3), seed=5)


def test_noise_is_one_of_the_numbers():
    found = [_told(lambda asked: [c.noise / NOISES - 0.002 for c in asked], seed=seed) for seed in range(6)]
    assert np.mean([r.probability for r in found]) == pytest.approx(0.002, rel=0.5)


def test_what_never_fails_is_bounded_by_draws_of_chance_alone():
    never = _told(lambda asked: [0.1 + float(c.point[0]) for c in asked])
    assert (never.probability, never.low, never.plain) == (0.0, 0.0, None)
    assert never.high == never.limit == pytest.approx(1.0 - 0.025 ** (1 / 527))  # of 3,000 trials 527 are first draws
    assert "in less than 0.007 of all trials (95 %)" in str(never)
    flat = _told(lambda asked: [math.inf for _ in asked])
    assert flat.probability == 0.0
    assert 0.0 < flat.high < never.high  # nowhere to climb to, so all trials are such draws


def test_no_limit_is_below_what_margins_do_not_lead_to():
    def judge(asked: Sequence[Candidate]) -> list[float | None]:
        return [-0.5 if c.point[1] < 1e-3 else 0.1 + float(c.point[0]) for c in asked]

    found = [_told(judge, trials=2000, seed=seed) for seed in range(12)]
    assert any(r.probability == 0.0 for r in found)  # and margins near 0 for nothing
    assert all(r.trials <= 2000 for r in found)
    assert all(r.low <= 1e-3 <= r.high <= r.limit for r in found)


def test_the_sentence_tells_the_limit_that_rests_on_no_margin():
    found = _told(_plane(1e-4))
    assert found.high < found.limit
    assert f"{found.high:.2g} if small margins lead to it, up to {found.limit:.2g} if they don't)" in str(found)
    assert "margins" not in str(_told(_plane(0.2)))


def test_only_what_makes_a_scenario_counts():
    def judge(asked: Sequence[Candidate]) -> list[float | None]:
        return [None if c.point[0] < 0.5 else float(c.point[0] - 0.6) for c in asked]

    found = _told(judge)
    assert found.low <= 0.2 <= found.high
    with pytest.raises(ClearwayError, match="narrow the ranges"):
        _told(lambda asked: [None for _ in asked])


def test_each_scenario_is_as_likely_whatever_varies_in_it():
    found = _told(lambda asked: [c.base - 0.5 for c in asked], space=Box(1, 2, 30, 4))
    assert found.probability == pytest.approx(0.25, abs=0.01)


def test_few_trials_are_refused():
    with pytest.raises(ClearwayError, match="499 trials are too few: at least 500"):
        _told(_plane(0.1), trials=499)


def test_the_sentence_says_it_as_a_person_would():
    found = _told(_plane(1e-4))
    assert str(found).startswith("event in ")
    assert "of all trials (95 %: " in str(found)
    assert "about one in " in str(found)
    assert "plain sampling would take about " in str(found)


def test_plain_sampling_is_told_as_dearer_only_where_it_takes_more_for_as_wide_an_interval():
    sure = _told(_plane(1e-4))
    assert sure.plain is not None
    z = float(special.ndtri(0.975))
    # as many trials have a Poisson number of failures, whose logarithm has that half width
    assert z / math.sqrt(sure.plain * sure.probability) == pytest.approx(
        math.log(sure.probability / sure.low), rel=0.01
    )
    one = [
        _told(lambda asked: [-0.5 if c.point[1] < 1e-3 else 0.1 + c.point[0] for c in asked], 2000, k)
        for k in range(12)
    ]
    assert any(r.probability > 0.0 for r in one)
    assert all(r.plain is None and "plain sampling would" not in str(r) for r in one if r.splitting)


def test_a_trial_without_a_margin_is_far_from_failing():
    def judge(asked):
        margins = _plane(1e-3)(asked)
        return [math.nan if c.point[0] < 0.2 else m for c, m in zip(asked, margins, strict=True)]

    found = _told(judge)
    assert 0.0 < found.probability < 1e-3
    assert _told(lambda asked: [math.nan for _ in asked]).probability == 0.0

"""The two bets on a share: fair at the limit, as exact as the bounds that are made of them, and never above their errors."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.statistics.betting import failures_within, first_shown, log_wealth, prospect, rule, shown_shares


@pytest.mark.parametrize("above", [True, False])
@pytest.mark.parametrize("share", [0.5, 0.9, 0.99])
def test_at_the_limit_the_bet_is_fair(share: float, above: bool):
    for k, f in ((0, 0), (7, 0), (3, 4), (200, 3)):
        now, yes, no = (np.exp(log_wealth(*c, share, above=above)) for c in ((k, f), (k + 1, f), (k, f + 1)))
        assert share * yes + (1 - share) * no == pytest.approx(now, rel=1e-9)
        assert (yes > no) == above
    assert log_wealth(0, 0, share, above=above) == pytest.approx(0.0)


@pytest.mark.parametrize(("share", "error"), [(0.8, 0.05), (0.9, 0.1), (0.95, 0.05), (0.99, 0.01)])
def test_either_error_keeps_to_its_probability_at_the_limit(share: float, error: float):
    bounds = rule(share, error, error)
    at = prospect(bounds, share, 40 * bounds.least)
    assert 0.4 * error < at.accepted <= error  # and is not wasted
    assert 0.2 * error < at.rejected <= error
    good, bad = prospect(bounds, 1.0, 10_000), prospect(bounds, 1 - 3 * (1 - share), 10_000)
    assert (good.accepted, good.expected, good.ninth) == (1.0, bounds.least, bounds.least)
    assert bad.rejected > 0.999
    assert bad.expected < 10 * bounds.least


def test_bounds_say_what_the_bets_say_trial_by_trial():
    rng = np.random.default_rng(1)
    bounds = rule(0.9, 0.05, 0.02)
    decided = 0
    for rate in np.repeat((0.7, 0.85, 0.92, 0.97, 1.0), 30):
        conforms = rng.random(300) < rate
        yes = first_shown(conforms, 0.9, 0.05, above=True)
        no = first_shown(conforms, 0.9, 0.02, above=False)
        n, f = np.arange(1, 301), np.cumsum(~conforms)
        accepted, rejected = np.flatnonzero(n >= bounds.accepts[f]), np.flatnonzero(n <= bounds.rejects[f])
        assert (int(accepted[0]) + 1 if len(accepted) else None) == yes
        assert (int(rejected[0]) + 1 if len(rejected) else None) == no
        decided += yes is not None or no is not None
    assert decided > 90


def test_prospect_is_what_many_robots_meet():
    rng = np.random.default_rng(2)
    bounds, rate, most = rule(0.8, 0.1, 0.1), 0.87, 120
    exact = prospect(bounds, rate, most)
    lengths, accepted, runs = [], 0, 3000
    for conforms in rng.random((runs, most)) < rate:
        n, f = np.arange(1, most + 1), np.cumsum(~conforms)
        over = np.flatnonzero((n >= bounds.accepts[f]) | (n <= bounds.rejects[f]))
        lengths.append(int(over[0]) + 1 if len(over) else most)
        accepted += bool(len(over)) and n[over[0]] >= bounds.accepts[f[over[0]]]
    assert accepted / runs == pytest.approx(exact.accepted, abs=0.03)
    assert np.mean(lengths) == pytest.approx(exact.expected, rel=0.04)


def test_a_prospect_is_exact_however_many_fail():
    least = rule(0.5, 0.05, 0.05, failures=0).least
    for most in (1, least, 200, 12_000):
        failures = failures_within(0.5, 0.05, most)
        assert failures == most or log_wealth(most - failures, failures, 0.5, above=False) >= -np.log(0.05)
        if most < 1000:
            all_of_them = prospect(rule(0.5, 0.05, 0.05, failures=most), 0.5, most)
            assert prospect(rule(0.5, 0.05, 0.05, failures=failures), 0.5, most) == all_of_them
    at = prospect(rule(0.5, 0.05, 0.05, failures=failures), 0.51, most)  # more than 4,000 fail
    going = 1 - at.accepted - at.rejected
    assert 0.5 < going < 1
    assert at.expected > 0.8 * most


def test_bounds_begin_where_they_are_asked_to():
    whole, end = rule(0.5, 0.05, 0.05, failures=120), rule(0.5, 0.05, 0.05, failures=120, first=100)
    assert (whole.accepts[100:].tolist(), whole.rejects[100:].tolist()) == (end.accepts.tolist(), end.rejects.tolist())
    more = end.more(110, 100, 0.55)
    assert more is not None
    assert whole.more(110, 100, 0.55) == more


def test_possible_shares_agree_with_the_verdict():
    bounds = rule(0.9, 0.05, 0.05)
    for k, f in ((32, 0), (33, 0), (60, 1), (65, 1), (8, 2), (2, 2), (0, 1), (5, 30)):
        found = shown_shares(k, f, 0.05)
        assert (found.low >= 0.9) == (k + f >= bounds.accepts[f])
        assert (found.high <= 0.9) == (k + f <= bounds.rejects[f])
        assert found.low <= k / (k + f) <= found.high
    assert (shown_shares(0, 0, 0.05).low, shown_shares(0, 0, 0.05).high) == (0.0, 1.0)


def test_possible_shares_where_hardly_anything_is_ruled_out():
    assert (shown_shares(1, 0, 1e-16).low, shown_shares(0, 1, 1e-16).high) == (0.0, 1.0)
    close = shown_shares(1_000_000, 1, 1e-4)
    assert 0.99998 < close.low < close.estimate < close.high == 1.0
    assert 0.4 < shown_shares(59, 0, 1e-17).low < 0.95


def test_trials_more_lead_to_the_bound():
    bounds = rule(0.95, 0.05, 0.05)
    assert bounds.more(10, 0, 1.0) == bounds.least - 10
    more = bounds.more(50, 1, 50 / 51)
    assert more is not None
    assert bounds.accepts[round((51 + more) / 51)] == pytest.approx(51 + more, abs=60)
    towards = bounds.more(17, 3, 0.85)
    assert towards is not None
    assert bounds.rejects[round(0.15 * (20 + towards))] >= 20 + towards - 7
    assert bounds.more(950, 50, 0.95) is None or bounds.more(950, 50, 0.95) > 10_000

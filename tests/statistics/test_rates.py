"""Success rates, their intervals, and how many trials show a reliability."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.statistics import (
    paired_success,
    reliability_shown,
    samples_needed,
    success_interval,
)


@pytest.mark.parametrize(
    ("reliability", "confidence", "failures", "n"),
    [
        (0.8, 0.8, 0, 8), (0.8, 0.8, 1, 14), (0.8, 0.8, 2, 21), (0.8, 0.8, 3, 27), (0.9, 0.9, 0, 22),
        (0.9, 0.95, 0, 29), (0.9, 0.95, 1, 46), (0.9, 0.95, 2, 61), (0.9, 0.95, 3, 76),
        (0.95, 0.95, 0, 59), (0.95, 0.95, 1, 93), (0.95, 0.95, 2, 124), (0.95, 0.95, 3, 153), (0.99, 0.95, 0, 299),
    ],
)  # fmt: skip
def test_number_of_trials(reliability, confidence, failures, n):
    assert samples_needed(reliability, confidence, failures) == n
    assert reliability_shown(n, failures, confidence) >= reliability
    assert reliability_shown(n - 1, failures, confidence) < reliability


def test_number_of_trials_at_the_edge():
    assert samples_needed(0.5, 0.75) == 2  # 0.5^2 is exactly 1 - 0.75
    assert reliability_shown(29, 0, 0.95) == pytest.approx(0.05 ** (1 / 29))
    assert reliability_shown(5, 5, 0.95) == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((90, 0.95), r"reliability 90 must lie between 0 and 1.*did you mean 0.9"),
        ((0.9, 95), "did you mean 0.95"),
        ((1.0, 0.95), "between 0 and 1"),
        ((0.9, 0.0), "confidence 0 must"),
        ((0.9, float("nan")), "confidence nan"),
        ((0.9, 0.95, -1), "failures -1"),
        ((0.9999999999, 0.95), "more than 10,000,000"),
    ],
)
def test_nonsense_is_refused(arguments, message):
    with pytest.raises(ClearwayError, match=message):
        samples_needed(*arguments)


def test_impossible_counts_are_refused():
    for call in (lambda: success_interval(5, 4), lambda: success_interval(0, 0), lambda: reliability_shown(3, 4, 0.9)):
        with pytest.raises(ClearwayError):
            call()


def test_paired_success_by_hand():
    a, b = [1] * 8 + [1] * 6 + [0] * 1 + [0] * 5, [1] * 8 + [0] * 6 + [1] * 1 + [0] * 5
    found = paired_success(np.array(a), np.array(b))
    assert (found.both, found.only_a, found.only_b, found.neither, found.n) == (8, 6, 1, 5, 20)
    assert found.p == pytest.approx(2 * (1 + 7) / 2**7)
    assert found.difference.estimate == pytest.approx(-0.25)
    turned = paired_success(np.array(b), np.array(a)).difference
    assert (turned.low, turned.high) == (pytest.approx(-found.difference.high), pytest.approx(-found.difference.low))
    with pytest.raises(ClearwayError, match="equally many"):
        paired_success(np.ones(2), np.ones(3))

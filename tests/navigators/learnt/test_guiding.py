"""What stands between a policy that sees scans and its base."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.navigators.learnt.guiding import ANSWERS, BEAMS, LAGS, SIZE, Guide

TURNING = 2.0
FIRST = SIZE - BEAMS * len(LAGS)


def seen(x: float, y: float, turn: float = 0.0, ranges: float = 3.0) -> np.ndarray:
    return np.array([[x, y, np.cos(turn), np.sin(turn), 0.0, 0.0, *[ranges] * BEAMS]], np.float32)


def guide() -> Guide:
    made = Guide(1, TURNING)
    made.begin(seen(4.0, 0.0), np.ones(1, np.bool_))
    return made


def driven(x: float, y: float, turn: float = 0.0, says: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    answers = np.array([says], np.float32)
    v, omega = guide().commands(seen(x, y, turn), np.array([0.6]), answers, 0.2)[0]
    return [float(v), float(omega)]


def test_by_itself_it_steers_at_the_goal() -> None:
    assert driven(4.0, 0.0) == pytest.approx([0.6, 0.0])
    v, omega = driven(0.0, 4.0)
    assert v == pytest.approx(0.0, abs=1e-9)
    assert omega > 0.0


def test_a_policy_slows_it_down_and_turns_it_away() -> None:
    assert driven(4.0, 0.0, says=(-0.5, -0.25)) == pytest.approx([0.3, -0.5])
    assert driven(4.0, 0.0, says=(9.0, 9.0)) == pytest.approx([0.6, TURNING])


def test_it_can_stop_at_the_goal_and_turns_on_the_spot_there() -> None:
    v, _ = driven(0.25, 0.0)
    assert v == pytest.approx(0.5)
    assert driven(0.1, 0.0, turn=-0.4, says=(1.0, 1.0)) == pytest.approx([0.0, -0.6])


def test_it_shows_what_was_seen_and_said_before() -> None:
    made, speed = guide(), np.array([0.6])
    made.commands(seen(4.0, 0.0), speed, np.array([[-0.5, 0.5]], np.float32), 0.2)
    for k in range(max(LAGS)):
        made.keep(seen(4.0, 0.0, ranges=1.0 + k / 10))
    shown = made.shown(seen(4.0, 0.0), speed)[0]
    assert shown.shape == (SIZE,)
    assert shown[6 : 6 + ANSWERS] == pytest.approx([0.3, 1.0])
    ranges = np.exp(shown[FIRST:].reshape(len(LAGS), BEAMS)[:, 0])
    assert ranges == pytest.approx([1.8, 1.5, 3.0])


def test_who_begins_anew_forgets() -> None:
    made = Guide(2, TURNING)
    both = np.concatenate((seen(4.0, 0.0), seen(4.0, 0.0)))
    made.begin(both, np.ones(2, np.bool_))
    made.commands(both, np.full(2, 0.6), np.zeros((2, ANSWERS), np.float32), 0.2)
    near = np.concatenate((seen(4.0, 0.0, ranges=1.0),) * 2)
    made.begin(near, np.array([True, False]))
    first, second = made.shown(near, np.full(2, 0.6))
    assert first[6:10].tolist() == [0.0] * 4
    assert second[6] == pytest.approx(0.6)
    assert np.exp(first[FIRST:]) == pytest.approx(1.0)
    assert np.exp(second[FIRST:]) == pytest.approx(3.0)

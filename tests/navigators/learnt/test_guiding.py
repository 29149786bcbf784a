"""What stands between a policy that sees scans and its base."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.navigators.learnt.guiding import ANSWERS, BEAMS, LAGS, SIZE, Guide
from clearway.robots import load_robot

TIAGO = load_robot("tiago")
TURNING = TIAGO.limits().omega_max
FIRST = SIZE - BEAMS * len(LAGS)


def seen(x: float, y: float, turn: float = 0.0, ranges: float = 3.0, v: float = 0.0) -> np.ndarray:
    return np.array([[x, y, np.cos(turn), np.sin(turn), v, 0.0, *[ranges] * BEAMS]], np.float32)


def guide(begun: np.ndarray) -> Guide:
    made = Guide(len(begun), TIAGO)
    made.begin(begun, np.ones(len(begun), np.bool_))
    return made


def commands(made: Guide, what: np.ndarray, says: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    v, omega = made.commands(what, np.array([0.6]), np.array([says], np.float32), 0.2)[0]
    return [float(v), float(omega)]


def driven(x: float, y: float, turn: float = 0.0, says: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    return commands(guide(seen(x, y, turn)), seen(x, y, turn), says)


def test_by_itself_it_steers_at_the_goal() -> None:
    assert driven(4.0, 0.0) == pytest.approx([0.6, 0.0])
    v, omega = driven(0.0, 4.0)
    assert v == pytest.approx(0.0, abs=1e-6)
    assert omega > 0.0


@pytest.mark.parametrize("side", [-1, 1])
def test_by_itself_it_passes_what_stands_before_it_on_the_free_side(side: int) -> None:
    before = seen(4.0, 0.0)
    parts = np.arange(BEAMS) - (BEAMS - 1) / 2
    before[0, 6:][(parts * side > -3) & (parts * side < 12)] = 0.6  # a wall on one side
    v, omega = commands(guide(before), before)
    assert omega * side < -0.5
    assert v < 0.6


def test_it_stands_before_a_wall() -> None:
    before = seen(4.0, 0.0, ranges=0.15)  # 0.35 m from its middle
    v, _ = commands(guide(before), before)
    assert v == 0.0


def test_it_remembers_what_it_has_just_passed() -> None:
    """Something at its left, out of the lidar's field of view by now, while the goal is to its left, too."""
    mount, part = TIAGO.lidar.mount[0], math.radians(200.0) / BEAMS
    made = guide(seen(4.0, 0.0))
    for k in range(12):
        x, y = 0.45 - 0.05 * k, 0.45
        now, angle = seen(0.0, 4.0, v=0.5), math.atan2(y, x - mount)
        if angle < math.radians(100.0):
            now[0, 6 + int((angle + math.radians(100.0)) / part)] = math.hypot(x - mount, y)
        else:
            assert (now[0, 6:] == 3.0).all()
        made.keep(now)
    chosen = [math.atan2(*one.shown(now, np.array([0.6]))[0, [7, 6]]) for one in (guide(now), made)]
    assert chosen[0] == pytest.approx(math.pi / 2)
    assert abs(chosen[1] - math.pi / 2) > 0.3


def test_a_policy_slows_it_down_and_turns_it_away() -> None:
    assert driven(4.0, 0.0, says=(-0.5, -0.25)) == pytest.approx([0.3, -0.25 * TURNING])
    assert driven(4.0, 0.0, says=(9.0, 9.0)) == pytest.approx([0.6, TURNING])


def test_it_can_stop_at_the_goal_and_turns_on_the_spot_there() -> None:
    v, _ = driven(0.25, 0.0)
    assert v == pytest.approx(0.5)
    assert driven(0.1, 0.0, turn=-0.4, says=(1.0, 1.0)) == pytest.approx([0.0, -0.6])


def test_it_shows_what_was_seen_and_said_before() -> None:
    made, speed = guide(seen(4.0, 0.0)), np.array([0.6])
    made.commands(seen(4.0, 0.0), speed, np.array([[-0.5, 0.5]], np.float32), 0.2)
    for k in range(max(LAGS)):
        made.keep(seen(4.0, 0.0, ranges=1.0 + k / 10))
    shown = made.shown(seen(4.0, 0.0), speed)[0]
    assert shown.shape == (SIZE,)
    assert shown[8 : 8 + ANSWERS] == pytest.approx([0.3, 0.5 * TURNING])
    ranges = np.exp(shown[FIRST:].reshape(len(LAGS), BEAMS)[:, 0])
    assert ranges == pytest.approx([1.8, 1.5, 3.0])


def test_who_begins_anew_forgets() -> None:
    both = np.concatenate((seen(4.0, 0.0), seen(4.0, 0.0)))
    made = guide(both)
    made.commands(both, np.full(2, 0.6), np.zeros((2, ANSWERS), np.float32), 0.2)
    near = np.concatenate((seen(4.0, 0.0, ranges=1.0),) * 2)
    made.begin(near, np.array([True, False]))
    first, second = made.shown(near, np.full(2, 0.6))
    assert first[8:12].tolist() == [0.0] * 4
    assert second[8] == pytest.approx(0.6)
    assert np.exp(first[FIRST:]) == pytest.approx(1.0)
    assert np.exp(second[FIRST:]) == pytest.approx(3.0)

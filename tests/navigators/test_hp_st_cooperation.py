"""Whether those around make room: learnt by Bayes' rule from contacts that were foretold and did not come."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from space_time_scenes import begun, goal, observation, obstacles

from clearway.forecasts.forecast import Forecast
from clearway.navigators.hp_st.environment.cooperation import AHEAD, FORGETS, PRIOR, SEEN, Cooperation
from clearway.navigators.hp_st.navigator import IMMINENT, SURE
from clearway.robots import load_robot

PERIOD, INSCRIBED, RADIUS, COUNT = 0.1, 0.27, 0.25, 20
HERE = np.zeros(3)


def coming(
    *at: tuple[float, float], speed: float = 1.0, sigma: float = 0.05, identity: int = 1, age: float = 0.0
) -> Forecast:
    """Each comes along x at `speed` and will be at `at` after `AHEAD`, as sure as `sigma`."""
    n, t = len(at), np.arange(COUNT) * PERIOD
    path = np.zeros((n, 1, COUNT, 2))
    for i, (x, y) in enumerate(at):
        path[i, 0, :, 0], path[i, 0, :, 1] = x + speed * (t - AHEAD), y
    return Forecast(
        PERIOD, np.zeros((0, 3)), path, np.full((n, 1, COUNT), sigma), np.ones((n, 1)), np.full(n, RADIUS),
        path[:, 0], np.zeros((n, COUNT)), np.full(n, 2.0), np.arange(identity, identity + n), np.full(n, age),
    )  # fmt: skip


def watched(*forecasts: Forecast) -> float:
    """What is doubted once the robot has stood through all of these periods."""
    cooperation = Cooperation(INSCRIBED, PERIOD, 0.0)
    for forecast in forecasts:
        cooperation.look(HERE, forecast)
    return cooperation.doubt


def test_contacts_that_are_foretold_again_and_again_and_do_not_come_are_somebodys_doing() -> None:
    doubts = [watched(*[coming((0.3, 0.2))] * n) for n in (5, 6, 10, 20, 40)]
    assert doubts[0] == PRIOR  # nobody can have made room yet
    assert doubts == sorted(doubts, reverse=True)
    assert doubts[2] < SURE
    assert doubts[-1] < 1e-3


@pytest.mark.parametrize(
    "forecast",
    [
        coming(),
        coming((3.0, 0.0)),
        coming((0.0, INSCRIBED + RADIUS + 0.3)),
        coming((0.3, 0.2), speed=0.2),
        coming((0.3, 0.2), age=SEEN + 0.01),
        coming((math.nan, math.nan)),
    ],
    ids=("nobody", "far", "beside", "about to stop", "out of view", "nowhere"),
)
def test_what_would_not_have_hit_it_or_may_not_be_there_says_nothing(forecast: Forecast) -> None:
    assert watched(*[forecast] * 40) == pytest.approx(PRIOR, abs=1e-3)


def test_who_is_another_now_was_an_error_of_the_trackers() -> None:
    assert watched(*[coming((0.3, 0.2), identity=k) for k in range(40)]) == PRIOR


@given(x=st.floats(-1.5, 1.5), y=st.floats(-1.5, 1.5), sigma=st.floats(0.05, 0.4))
def test_it_counts_with_the_probability_of_the_contact(x: float, y: float, sigma: float) -> None:
    n = round(AHEAD / PERIOD)
    doubt = watched(*[coming((x, y), sigma=sigma)] * (n + 1))
    places = np.random.default_rng(1).normal((x, y), sigma, (20_000, 2))
    chance = min((np.hypot(*places.T) < INSCRIBED + RADIUS).mean(), 0.95)
    missed = (1.0 - chance) ** (PERIOD / AHEAD)
    assert doubt == pytest.approx(PRIOR * missed / (PRIOR * missed + 1.0 - PRIOR), abs=0.01)


def test_of_several_the_likeliest_contact_counts_once() -> None:
    one, group = coming((0.3, 0.2)), coming((0.3, 0.2), (0.3, 0.2), (2.0, 0.0))
    assert watched(*[group] * 12) == watched(*[one] * 12)


def test_others_come_and_it_forgets() -> None:
    cooperation = Cooperation(INSCRIBED, PERIOD, 0.0)
    for _ in range(15):
        cooperation.look(HERE, coming((0.3, 0.2)))
    learnt = cooperation.doubt
    for _ in range(round(FORGETS / PERIOD)):
        cooperation.look(HERE, coming())
    left = math.log(cooperation.doubt / (1.0 - cooperation.doubt)) / math.log(learnt / (1.0 - learnt))
    assert left == pytest.approx(1.0 / math.e, abs=0.02)


def test_however_often_it_was_so_it_can_be_unlearnt() -> None:
    cooperation = Cooperation(INSCRIBED, PERIOD, 0.0)
    for _ in range(3000):
        cooperation.look(HERE, coming((0.0, 0.0), sigma=1e-6))
    for _ in range(round(6.0 * FORGETS / PERIOD)):
        cooperation.look(HERE, coming())
    assert cooperation.doubt > SURE


@pytest.mark.parametrize(("robot", "learns"), [("tiago", True), ("rescue:lidar", False)])
def test_where_they_make_room_what_comes_soon_counts_alone(robot: str, learns: bool) -> None:
    navigator = begun(load_robot(robot), 0.6)
    whole, period = navigator._settings.periods, navigator._period
    for doubt in (PRIOR, 0.5 * SURE, PRIOR):
        navigator._cooperation.doubt = doubt
        navigator.step(observation(0.0, HERE, goal(5.0, 0.0), obstacles()))
        counts = round(IMMINENT / period) if learns and doubt < SURE else whole
        assert navigator._settings.imminent == navigator._evasion.settings.imminent == counts

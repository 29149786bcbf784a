"""Obstacles that avoid each other: what each wants is found out, and where they will be is foretold better for it."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.contract import Obstacles
from clearway.crowds import orca
from clearway.crowds.bodies import Wishes
from clearway.crowds.walls import walls_of
from clearway.forecasts.avoidance import HORIZON, NOBODY, bodies_of, learn
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray

STEP, AHEAD = 0.25, 12


def circle(people: int, periods: int, pace: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """(t, n, 2) where people are who change places across a circle by ORCA, and (n, 2) where they want to."""
    turn = 2.0 * np.pi * np.arange(people) / people + 0.1 * np.sin(np.arange(people))
    at, velocity = 4.0 * np.column_stack((np.cos(turn), np.sin(turn))), np.zeros((people, 2))
    goal, radius, ways = -3.0 * at, np.full(people, 0.3), [at]
    care = orca.Care(np.full(people, 10.0), np.full(people, 10), np.full(people, HORIZON), np.full(people, HORIZON))
    for _ in range(periods):
        wish = pace * (goal - at) / np.linalg.norm(goal - at, axis=1)[:, None]
        wishes = Wishes(np.arange(people), wish, np.full(people, pace), np.ones(people, np.int64))
        velocity = orca.velocities(bodies_of(at, velocity, radius), wishes, care, walls_of([]), STEP)
        at = at + STEP * velocity
        ways.append(at)
    return np.array(ways), goal


def seen(place: FloatArray, before: FloatArray, order: np.ndarray | None = None) -> Obstacles:
    n = len(place)
    who = np.arange(n) if order is None else order
    return Obstacles(
        place[who], (place - before)[who] / STEP, np.full(n, 0.3), np.zeros(n), np.zeros(n), who, np.ones(n, np.bool_)
    )


def forecasts(ways: FloatArray, avoidance: bool, order: np.ndarray | None = None) -> list[Forecast]:
    parameters = ForecastParameters(avoidance=avoidance)
    forecaster = Forecaster(parameters, STEP, STEP, AHEAD)
    return [forecaster.update(STEP * k, seen(ways[k], ways[max(k - 1, 0)], order))[0] for k in range(len(ways) - AHEAD)]


def error(found: list[Forecast], ways: FloatArray) -> float:
    """Mean error of the likeliest hypotheses at the end of the horizon, m, without those of the first second."""
    return float(
        np.mean(
            [
                np.linalg.norm(f.path[np.argsort(f.identity), 0, -1] - ways[k + AHEAD], axis=1).mean()
                for k, f in enumerate(found)
                if k >= 4
            ]
        )
    )


@pytest.mark.parametrize("people", [2, 5, 9])
def test_it_errs_by_less_than_half_where_people_avoid_each_other(people: int) -> None:
    ways, _ = circle(people, 30)
    assert error(forecasts(ways, True), ways) < 0.5 * error(forecasts(ways, False), ways)


def test_what_each_wants_is_found_though_none_goes_there() -> None:
    ways, goal = circle(5, 12)
    known = NOBODY
    for place in ways:
        known = learn(known, STEP, np.arange(5), place, np.full(5, 0.3), np.zeros(5))
    wanted = (goal - ways[-2]) / np.linalg.norm(goal - ways[-2], axis=1)[:, None]
    off = np.linalg.norm(known.wish - wanted, axis=1)
    assert off.max() < 0.1
    assert off.mean() < 0.2 * np.linalg.norm(known.velocity - wanted, axis=1).mean()


def test_hypotheses_stay_what_they_are() -> None:
    for found in forecasts(circle(6, 24)[0], True):
        assert found.weight.sum(axis=1) == pytest.approx(1.0)
        assert (np.diff(found.weight, axis=1) <= 1e-12).all()
        assert np.isfinite(found.path).all()
        assert (found.sigma > 0.0).all()
        assert found.path[:, 0, 0] == pytest.approx(found.centre[:, 0], abs=0.05)


def test_the_order_in_which_obstacles_are_told_changes_nothing() -> None:
    ways, _ = circle(5, 20)
    plain, turned = forecasts(ways, True)[-1], forecasts(ways, True, np.array([3, 1, 4, 0, 2]))[-1]
    a, b = np.argsort(plain.identity), np.argsort(turned.identity)
    assert plain.path[a] == pytest.approx(turned.path[b], abs=1e-9)
    assert plain.weight[a] == pytest.approx(turned.weight[b], abs=1e-9)


def test_who_has_not_moved_is_expected_to_stand() -> None:
    place = np.array([[0.0, 0.0], [1.0, 0.0]])
    ways = np.repeat(place[None], 20, axis=0)
    for with_it, without in zip(forecasts(ways, True), forecasts(ways, False), strict=True):
        for a, b in zip(with_it, without, strict=True):
            assert np.array_equal(a, b)

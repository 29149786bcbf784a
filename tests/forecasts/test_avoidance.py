"""Obstacles that avoid each other: what each wants is found out, and where they will be is foretold better for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from clearway.contract import Obstacles
from clearway.crowds import orca, social_force
from clearway.crowds.bodies import Wishes
from clearway.crowds.walls import walls_of
from clearway.forecasts.avoidance.intents import bodies_of
from clearway.forecasts.avoidance.orca import HORIZON, KEPT
from clearway.forecasts.avoidance.rules import Avoidance
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray
from perceived import exact

STEP, AHEAD = 0.25, 12
ORCA, FORCE, BOTH = ["orca"], ["social-force"], ["orca", "social-force"]
RULES = (ORCA, FORCE, BOTH)


def circle(rule: str, people: int, periods: int, pace: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """(t, n, 2) where people are who change places across a circle by a rule, and (n, 2) where they want to."""
    turn = 2.0 * np.pi * np.arange(people) / people + 0.1 * np.sin(np.arange(people))
    at, velocity = 4.0 * np.column_stack((np.cos(turn), np.sin(turn))), np.zeros((people, 2))
    goal, radius, ways = -3.0 * at, np.full(people, 0.3), [at]
    care = orca.Care(np.full(people, 10.0), np.full(people, 10), np.full(people, HORIZON), np.full(people, HORIZON))
    parts, faster = (1, 1.0) if rule == "orca" else (5, 1.3)
    for k in range(1, periods * parts + 1):
        wish = pace * (goal - at) / np.linalg.norm(goal - at, axis=1)[:, None]
        wishes = Wishes(np.arange(people), wish, np.full(people, faster * pace), np.ones(people, np.int64))
        if rule == "orca":
            velocity = orca.velocities(bodies_of(at, velocity, radius + KEPT), wishes, care, walls_of([]), STEP)
        else:
            bodies, alone = bodies_of(at, velocity, radius), np.full(people, -1)
            velocity = social_force.velocities(bodies, wishes, alone, social_force.MOUSSAID, walls_of([]), STEP / parts)
        at = at + STEP / parts * velocity
        if k % parts == 0:
            ways.append(at)
    return np.array(ways), goal


def seen(place: FloatArray, before: FloatArray, order: np.ndarray | None = None) -> Obstacles:
    who = np.arange(len(place)) if order is None else order
    return exact(place[who], (place - before)[who] / STEP, 0.3, identity=who)


def forecasts(ways: FloatArray, avoidance: Any, order: np.ndarray | None = None, hypotheses: int = 3) -> list[Forecast]:
    parameters = ForecastParameters(avoidance=avoidance, hypotheses=hypotheses)
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


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["orca", "social-force"])
@pytest.mark.parametrize("people", [2, pytest.param(5, marks=pytest.mark.slow), 9])
def test_it_errs_by_less_than_half_where_people_avoid_each_other_by_the_rule(people: int, rule: str) -> None:
    ways, _ = circle(rule, people, 30)
    assert error(forecasts(ways, [rule]), ways) < 0.5 * error(forecasts(ways, False), ways)


@pytest.mark.parametrize("rule", ["orca", "social-force"])
@pytest.mark.parametrize("people", [5, 9])
def test_the_likelier_of_both_rules_is_nearly_as_good_as_the_right_one(people: int, rule: str) -> None:
    ways, _ = circle(rule, people, 30)
    right, both, none = (error(forecasts(ways, rules), ways) for rules in ([rule], BOTH, False))
    assert both < right + 0.15 * (none - right)


@pytest.mark.parametrize("rule", ["orca", "social-force"])
def test_what_each_wants_is_found_though_none_goes_there(rule: str) -> None:
    ways, goal = circle(rule, 5, 12)
    avoidance = Avoidance([rule], 0.02)
    forecaster = Forecaster(ForecastParameters(), STEP, STEP, AHEAD)
    for k, place in enumerate(ways):
        avoidance.update(STEP if k else np.nan, forecaster.update(STEP * k, seen(place, place))[0])
    known = avoidance.known[0]
    wanted = (goal - ways[-2]) / np.linalg.norm(goal - ways[-2], axis=1)[:, None]
    off = np.linalg.norm(known.wish - wanted, axis=1)
    assert off.max() < 0.1
    assert off.mean() < 0.2 * np.linalg.norm(known.velocity - wanted, axis=1).mean()


@pytest.mark.parametrize("hypotheses", [1, 2, 3])
@pytest.mark.parametrize("rules", RULES)
def test_hypotheses_stay_what_they_are(rules: list[str], hypotheses: int) -> None:
    for found in forecasts(circle("social-force", 6, 24)[0], rules, hypotheses=hypotheses):
        assert found.weight.sum(axis=1) == pytest.approx(1.0)
        assert (np.diff(found.weight, axis=1) <= 1e-12).all()
        assert np.isfinite(found.path).all()
        assert (found.sigma > 0.0).all()
        assert found.path[:, 0, 0] == pytest.approx(found.centre[:, 0], abs=0.05)


@pytest.mark.parametrize("rules", RULES)
def test_the_order_in_which_obstacles_are_told_changes_nothing(rules: list[str]) -> None:
    ways, _ = circle("social-force", 5, 20)
    plain, turned = forecasts(ways, rules)[-1], forecasts(ways, rules, np.array([3, 1, 4, 0, 2]))[-1]
    a, b = np.argsort(plain.identity), np.argsort(turned.identity)
    assert plain.path[a] == pytest.approx(turned.path[b], abs=1e-9)
    assert plain.weight[a] == pytest.approx(turned.weight[b], abs=1e-9)


def test_places_that_are_perceived_with_an_error_are_foretold_by_force_no_worse_than_without() -> None:
    ways, _ = circle("social-force", 5, 30)
    rng, found = np.random.default_rng(3), {}
    off = rng.uniform(-0.02, 0.02, ways.shape)
    for rules in (False, FORCE):
        forecaster = Forecaster(ForecastParameters(avoidance=rules), STEP, STEP, AHEAD)
        told = [replace(seen(p, p), error=np.full(5, 0.03), velocity=np.full((5, 2), np.nan)) for p in ways + off]
        found[str(rules)] = error([forecaster.update(STEP * k, o)[0] for k, o in enumerate(told[:-AHEAD])], ways)
    assert found[str(FORCE)] < 0.7 * found["False"]


def test_who_is_seen_within_others_is_not_flung_away() -> None:
    t = STEP * np.arange(20.0)
    ways = np.stack([np.column_stack([0.9 * t + 0.1 * k, 0.05 * k + 0.0 * t]) for k in range(4)], axis=1)
    avoidance, forecaster = Avoidance(FORCE, 0.02), Forecaster(ForecastParameters(), STEP, STEP, AHEAD)
    for k, place in enumerate(ways):
        told = replace(seen(place, place), radius=np.full(4, 1.0), error=np.full(4, 0.05))
        avoidance.update(STEP if k else np.nan, forecaster.update(STEP * k, told)[0])
        assert np.abs(avoidance.known[0].place - place).max() < 0.5
        assert np.abs(avoidance.known[0].velocity).max() < 5.0


@pytest.mark.parametrize("rules", RULES)
def test_who_has_not_moved_is_expected_to_stand(rules: list[str]) -> None:
    place = np.array([[0.0, 0.0], [1.0, 0.0]])
    ways = np.repeat(place[None], 20, axis=0)
    for with_it, without in zip(forecasts(ways, rules), forecasts(ways, False), strict=True):
        for a, b in zip(with_it, without, strict=True):
            assert np.array_equal(a, b)


def test_true_is_orca_and_what_is_no_rule_is_told() -> None:
    ways, _ = circle("orca", 4, 18)
    for a, b in zip(forecasts(ways, True), forecasts(ways, ORCA), strict=True):
        assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
    for wrong in ("orca", [], ["orca", "boids"], 1, None):
        with pytest.raises(ValidationError, match=r"must be true \(by ORCA\), false, or a list of rules") as told:
            ForecastParameters(avoidance=wrong)
        assert told.value.error_count() == 1

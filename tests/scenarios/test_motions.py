"""Motions that no forecast models: they keep their bounds, are what their formulas say, and mislead every simple model."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy.optimize import least_squares

from clearway.scenarios.motions import KNOT, MotionSpec, states
from clearway.scenarios.sar import frozen
from clearway.stand_ins import stand_ins

READ: TypeAdapter[MotionSpec] = TypeAdapter(MotionSpec)
BOUNDS = {"start": (3.0, 4.0), "speed": 9.0, "acceleration": 9.0}
SWING = {"velocity": (0.5, -0.3), "attraction": (8.0, 3.0), "stiffness": (0.1, 0.3)}
SHAKEN = {"kind": "shaken", "damping": 0.2, "push": 1.0, "hold": (0.3, 1.0), "seed": 4}
STOPS = {
    "kind": "stop-and-go", "region": (1.5, 12.5), "pace": (0.4, 1.4), "drive": (0.6, 3.0), "rest": (0.4, 2.0), "lag": 0.1,
    "seed": 4,
}  # fmt: skip
CHASE = {"kind": "pursuit", "path": ((0.0, 0.0), (1000.0, 0.0)), "pace": 0.8, "stiffness": 0.6, "damping": 0.8}


def motion(**given: Any) -> MotionSpec:
    return READ.validate_python(BOUNDS | given)


EACH = [motion(**SWING, kind="damped", damping=0.3), motion(**SWING, **SHAKEN), motion(**STOPS), motion(**CHASE)]
each = pytest.mark.parametrize("spec", EACH, ids=lambda m: m.kind)


def test_damping_is_that_of_the_textbook() -> None:
    """x'' = k (a - x) - c x' has the solution e^(-c t / 2) (A cos + B sin) around a."""
    k, c = 0.1, 0.3
    way = states(motion(**SWING, kind="damped", damping=c), 20.0)
    t = KNOT * np.arange(len(way))
    w = math.sqrt(k - c * c / 4)
    x = 8.0 + np.exp(-c * t / 2) * (-5.0 * np.cos(w * t) + (0.5 - 5.0 * c / 2) / w * np.sin(w * t))
    assert np.abs(way[:, 0] - x).max() < 0.03  # the rule of first order, which the knots are defined by
    assert len(t) == 401


def test_a_pursuer_lags_by_what_it_has_to() -> None:
    """Behind a point at constant speed: stiffness times the lag is what damping takes."""
    way = states(motion(**CHASE, velocity=(0.0, 0.0)), 60.0)
    assert way[-1, 2:] == pytest.approx([0.8, 0.0], abs=1e-3)
    assert 0.8 * 60.0 - way[-1, 0] == pytest.approx(0.8 * 0.8 / 0.6, abs=0.05)


def test_a_pursuer_patrols() -> None:
    way = states(motion(**CHASE | {"path": ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0)), "start": (0.0, 0.0)}), 100.0)
    x = way[400:, 0]  # once it has settled it goes to and fro
    assert (np.diff(np.sign(np.diff(x))) != 0).sum() >= 10
    assert -0.5 < x.min() < 1.0
    assert 2.0 < x.max() < 3.8


def test_stop_and_go_stops_and_goes_elsewhere() -> None:
    way = states(motion(**STOPS), 300.0)
    speed = np.hypot(*way[:, 2:].T)
    rests, drives = speed < 0.01, speed > 0.39
    assert 0.1 < rests.mean() < 0.9
    assert rests.mean() + drives.mean() > 0.7
    starts = np.flatnonzero(np.diff(rests.astype(int)) == -1)
    heading = np.arctan2(*(way[starts + 8, 2:] * (1, 1)).T[::-1])
    assert len(starts) > 50
    assert np.abs(np.angle(np.exp(1j * np.diff(heading)))).mean() > 0.8
    assert way[:, :2].min() > 1.4
    assert way[:, :2].max() < 12.6


@each
def test_a_longer_one_goes_on_where_a_shorter_one_ends(spec: MotionSpec) -> None:
    assert states(spec, 30.0)[:201].tolist() == states(spec, 10.0).tolist()
    assert len(states(spec, 0.0)) == 1


def test_another_seed_is_another_course() -> None:
    for row in (SWING | SHAKEN, STOPS):
        one, two = (states(motion(**row | {"seed": seed}), 5.0) for seed in (1, 2))
        assert np.abs(one - two)[:, :2].max() > 0.1


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(EACH), st.floats(0.3, 4.0), st.floats(0.1, 9.0), st.integers(0, 2**31),
    st.tuples(st.floats(0.0, 14.0), st.floats(0.0, 14.0)),
)  # fmt: skip
def test_bounds_are_kept_between_any_two_knots(
    spec: MotionSpec, speed: float, acceleration: float, seed: int, start: tuple[float, float]
) -> None:
    given_ = spec.model_dump() | {"start": start, "speed": speed, "acceleration": acceleration, "velocity": (0.0, 0.0)}
    way = states(READ.validate_python(given_ | ({"seed": seed} if "seed" in given_ else {})), 20.0)[:, :2]
    v = np.diff(way, axis=0) / KNOT
    assert np.hypot(*v.T).max() <= speed * (1 + 1e-9) + 1e-9
    assert np.hypot(*np.diff(v, axis=0).T).max() / KNOT <= acceleration * (1 + 1e-9) + 1e-9


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (STOPS | {"pace": (2.0, 1.0)}, r"\(2, 1\) is no range; the smaller number stands first"),
        (STOPS | {"velocity": (9.0, 9.0)}, r"velocity is \(9.0, 9.0\), beyond speed 9 m/s"),
        (CHASE | {"path": ((1.0, 1.0), (1.0, 1.0))}, "the path has no length"),
        (CHASE | {"stiffness": math.nan}, "stiffness"),
        (CHASE | {"kind": "escape"}, "'damped', 'shaken', 'stop-and-go', 'pursuit'"),
        (SWING | SHAKEN | {"seed": -1}, "seed"),
        (SWING | SHAKEN | {"pull": 1}, "pull"),
    ],
)
def test_what_is_no_motion(row: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        motion(**row)


# --- what forecasts make of them: fitted to 2 s without noise, asked for the next 2 s

T = np.arange(0.0, 4.01, 0.15)
PAST = T <= 2.0
NOISE = 0.01
"""The camera's bound, m."""


def line(x: np.ndarray) -> np.ndarray:
    columns = np.column_stack([np.ones_like(T), T])
    fitted: np.ndarray = columns @ np.linalg.lstsq(columns[PAST], x[PAST], rcond=None)[0]
    return fitted


def oscillator(x: np.ndarray) -> np.ndarray:
    best, out = np.full(2, np.inf), np.empty_like(x)
    for w in np.sqrt(np.geomspace(0.015, 0.5, 120)):
        columns = np.column_stack([np.ones_like(T), np.cos(w * T), np.sin(w * T)])
        fitted = columns @ np.linalg.lstsq(columns[PAST], x[PAST], rcond=None)[0]
        residual = np.abs(fitted - x)[PAST].max(0)
        for axis in np.flatnonzero(residual < best):
            best[axis], out[:, axis] = residual[axis], fitted[:, axis]
    return out


def turn(x: np.ndarray) -> np.ndarray:
    def arc(p: np.ndarray) -> np.ndarray:
        half = 0.5 * p[4] * T
        chord = p[3] * T * np.sinc(half / math.pi)
        return np.column_stack([p[0] + chord * np.cos(p[2] + half), p[1] + chord * np.sin(p[2] + half)])

    v = (x[1] - x[0]) / T[1]
    begun = [[*x[0], math.atan2(v[1], v[0]), math.hypot(*v), omega] for omega in (0.0, 0.5, -0.5)]
    found = [least_squares(lambda p: (arc(p) - x)[PAST].ravel(), b) for b in begun]
    return arc(min(found, key=lambda f: f.cost).x)


MODELS: tuple[Callable[[np.ndarray], np.ndarray], ...] = (line, turn, oscillator)


def misled(way: np.ndarray, begin: float) -> tuple[float, float]:
    """Of the best model each: the largest residual of the fit, and the largest error of the forecast, m."""
    t = KNOT * np.arange(len(way))
    x = np.column_stack([np.interp(begin + T, t, way[:, k]) for k in range(2)])
    errors = [np.hypot(*(model(x) - x).T) for model in MODELS]
    return min(e[PAST].max() for e in errors), min(e[~PAST].max() for e in errors)


def test_the_models_of_this_test_fit_what_they_model() -> None:
    swing = np.column_stack([3.0 * np.cos(0.4 * KNOT * np.arange(100)), 2.0 + np.sin(0.6 * KNOT * np.arange(100))])
    assert max(misled(swing, 0.0)) < NOISE


def test_no_model_forecasts_them() -> None:
    found: dict[str, list[tuple[float, float]]] = {}
    for spec in frozen()["misspecified"][0].layout.motions:
        way = states(spec, 12.0)
        found.setdefault(spec.kind, []).extend(misled(way, begin) for begin in (0.0, 2.0, 4.0, 6.0))
    assert list(found) == ["damped", "shaken", "stop-and-go", "pursuit"]
    for kind, pairs in found.items():
        fit, ahead = np.array(pairs).T
        assert np.median(ahead) > 2 * NOISE, kind
        if kind in ("shaken", "stop-and-go"):  # these don't even fit what has been seen
            assert np.median(fit) > 2 * NOISE
            assert np.median(ahead) > 0.2


def test_the_suites_motions_keep_the_stated_bounds() -> None:
    own = stand_ins("misspecified")
    for drawn in frozen()["misspecified"]:
        assert [m.kind for m in drawn.layout.motions] == ["damped", "shaken", "stop-and-go", "pursuit"] * 2
        for spec, start in zip(drawn.layout.motions, drawn.layout.start.tolist(), strict=True):
            assert list(spec.start) == start
            v = states(spec, 40.0)[:, 2:]
            assert np.hypot(*v.T).max() <= own["speed"] + 1e-9
            bound = own["sudden"] if spec.kind == "stop-and-go" else own["acceleration"]
            assert np.hypot(*np.diff(v, axis=0).T).max() / KNOT <= bound + 1e-6

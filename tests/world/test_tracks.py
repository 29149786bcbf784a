from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.scenarios.motions import states
from clearway.scenarios.scenario import LegSpec, ObstacleSpec
from clearway.world.laid import Laid
from clearway.world.setting import steps
from clearway.world.tracks import KNOT, ROBOTS_ROOM, longest, pose_at, tracks


def obstacle(*runs: dict[str, Any]) -> ObstacleSpec:
    return ObstacleSpec.model_validate({"name": "o", "shape": {"kind": "disc", "radius": 0.1}, "runs": runs})


def at(way: Any, leg: int, body: int, t: float) -> list[float]:
    out = np.empty(3)
    present = pose_at(way.knots, *way.rows[leg, body].tolist(), t, out)
    assert present == math.isfinite(out[0])
    return out.tolist()


def test_a_way_round_a_corner() -> None:
    way = tracks([obstacle({"leg": "forth", "path": [(0, 0), (2, 0), (2, 1)], "speed": 0.5, "delay": 1.0})], ["forth"])
    assert math.isnan(at(way, 0, 0, 0.99)[0])
    assert at(way, 0, 0, 1.0) == [0, 0, 0]
    assert at(way, 0, 0, 3.0) == pytest.approx([1, 0, 0])
    assert at(way, 0, 0, 5.0) == pytest.approx([2, 0, math.pi / 2])
    assert at(way, 0, 0, 6.0) == pytest.approx([2, 0.5, math.pi / 2])
    assert at(way, 0, 0, 7.0) == pytest.approx([2, 1, math.pi / 2])
    assert math.isnan(at(way, 0, 0, 7.01)[0])
    assert way.speed.tolist() == pytest.approx([0.5])


def test_under_way_already_and_legs_of_ones_own() -> None:
    runs = [{"leg": "forth", "path": [(0, 0), (4, 0)], "speed": 1.0, "delay": -2.0},
            {"leg": "back", "path": [(4, 0), (0, 0)], "speed": 2.0}]  # fmt: skip
    way = tracks([obstacle(runs[1]), obstacle(*runs)], ["forth", "turn", "back"])
    assert at(way, 0, 1, 0.0) == pytest.approx([2, 0, 0])
    assert math.isnan(at(way, 1, 1, 0.0)[0])
    assert at(way, 2, 1, 1.0) == pytest.approx([2, 0, math.pi])
    assert math.isnan(at(way, 0, 0, 0.0)[0])
    assert way.speed.tolist() == pytest.approx([2.0, 2.0])


def test_two_passes_in_one_leg() -> None:
    runs = [{"leg": "forth", "path": [(9, 0), (10, 0)], "speed": 1.0, "delay": 5.0},
            {"leg": "forth", "path": [(0, 0), (1, 0)], "speed": 1.0}]  # fmt: skip
    way = tracks([obstacle(*runs)], ["forth"])
    assert at(way, 0, 0, 0.5) == pytest.approx([0.5, 0, 0])
    assert math.isnan(at(way, 0, 0, 3.0)[0])
    assert at(way, 0, 0, 5.5) == pytest.approx([9.5, 0, 0])
    assert way.speed.tolist() == [math.inf]


def test_what_cannot_be() -> None:
    with pytest.raises(ClearwayError, match="'fort' is not a leg"):
        tracks([obstacle({"leg": "fort", "path": [(0, 0), (1, 0)], "speed": 1.0})], ["forth"])
    with pytest.raises(ClearwayError, match="overlap"):
        tracks([obstacle({"leg": "a", "path": [(0, 0), (1, 0)], "speed": 1.0},
                         {"leg": "a", "path": [(5, 0), (6, 0)], "speed": 1.0, "delay": 0.5})], ["a"])  # fmt: skip
    with pytest.raises(ValueError, match="no length"):
        tracks([obstacle({"leg": "a", "path": [(1, 0), (1, 0)], "speed": 1.0})], ["a"])


SWING = {"start": (2.0, 9.0), "velocity": (0.5, -0.5), "attraction": (12.0, 3.0), "stiffness": (0.083, 0.125)}


def swinging() -> ObstacleSpec:
    return ObstacleSpec.model_validate({"name": "s", "shape": {"kind": "disc", "radius": 0.35}, "oscillation": SWING})


def test_an_oscillation_is_laid_out_to_a_tenth_of_a_millimetre() -> None:
    """About as wild as the suites draw them: 10 m from its attraction. Between the knots too."""
    way = tracks([swinging()], ["way"], 130.0)
    t = np.linspace(0.0, 130.0, 20_011)
    found = np.array([at(way, 0, 0, float(s)) for s in t])
    for axis in range(2):
        x, v, a, w = (SWING[k][axis] for k in ("start", "velocity", "attraction", "stiffness"))
        w = math.sqrt(w)
        assert np.abs(found[:, axis] - (a + (x - a) * np.cos(w * t) + v / w * np.sin(w * t))).max() < 1e-4
    assert (found[:, 2] == 0.0).all()
    step = np.hypot(*np.diff(found[:, :2], axis=0).T).max() / (t[1] - t[0])
    assert step <= way.speed[0] * (1 + 1e-9)
    assert way.speed[0] < 4.0
    assert KNOT == 0.015


def test_an_oscillation_runs_on_from_leg_to_leg() -> None:
    way = tracks([obstacle({"leg": "b", "path": [(0, 0), (1, 0)], "speed": 1.0}), swinging()], ["a", "b"], 20.0)
    assert way.lasting.tolist() == [False, True]
    assert at(way, 0, 1, 7.3) == at(way, 1, 1, 7.3)
    assert math.isfinite(at(way, 1, 1, 20.0)[0])
    assert at(way, 1, 0, 0.5) == pytest.approx([0.5, 0, 0])


def test_how_long_a_trial_may_take() -> None:
    legs = [LegSpec(name="a", goal=(0, 0, 0), time_limit=10.0),
            LegSpec(name="b", goal=(0, 0, 0), time_limit=20.0, clock_starts_after=0.1)]  # fmt: skip
    assert longest(legs) == 10.0 + 2 * 20.0 + 1.0
    with pytest.raises(ClearwayError, match="at most 3600"):
        tracks([swinging()], ["a"], 1e6)


@pytest.mark.parametrize("kind", ["damped", "stop-and-go"])
def test_other_motions_are_laid_out_as_they_are(kind: str) -> None:
    own = {
        "damped": {"attraction": (6.0, 3.0), "stiffness": (0.1, 0.2), "damping": 0.2, "velocity": (0.5, 0.0)},
        "stop-and-go": {"region": (1.5, 12.5), "pace": (0.4, 1.4), "drive": (0.6, 3.0), "rest": (0.4, 2.0), "lag": 0.1, "seed": 3},
    }[kind]  # fmt: skip
    given = {"kind": kind, "start": (2.0, 9.0), "speed": 3.5, "acceleration": 8.0} | own
    shaken = ObstacleSpec.model_validate({"name": "m", "shape": {"kind": "disc", "radius": 0.35}, "motion": given})
    assert shaken.motion is not None
    way = tracks([shaken], ["a", "b"], 20.0)
    assert way.lasting.tolist() == [True]
    expected = states(shaken.motion, 20.0)
    for k in (0, 1, 77, 400):
        assert at(way, 0, 0, 0.05 * k) == pytest.approx([*expected[k, :2], 0.0], abs=1e-9)
    assert at(way, 1, 0, 7.325) == pytest.approx([*(expected[146:148, :2].mean(0)), 0.0])
    assert way.speed[0] == pytest.approx(np.hypot(*expected[1:, 2:].T).max())
    with pytest.raises(ClearwayError, match="at most 3600"):
        tracks([shaken], ["a"], 1e6)


@pytest.mark.parametrize("period", [0.001, 0.003, 0.007, 0.05, 0.1, 1.0, 10.0])
def test_a_robot_can_be_seen_as_it_was_two_seconds_ago_whatever_its_control_period(period: float) -> None:
    knots, count = np.full((ROBOTS_ROOM, 4), np.nan), np.zeros(1, np.int64)
    laid, n = Laid(knots, count), steps(period)
    laid.lay(0.0, np.zeros(3))
    for k in range(math.ceil(25.0 / period)):
        t = k * period
        way = t + period / n * np.arange(n + 1.0)
        laid.drive(t, period, np.column_stack([way, -2.0 * way, np.zeros(n + 1)]))
        for late in (0.0, 0.3, 2.1):
            seen = max(t + period - late, 0.0)
            assert laid.at(seen) == pytest.approx([seen, -2.0 * seen, 0.0], abs=1e-9)
        assert laid.at(max(t, 0.0)) == pytest.approx([t, -2.0 * t, 0.0], abs=1e-9)  # all of the period, too

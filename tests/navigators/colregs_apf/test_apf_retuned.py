"""Gains tuned for a scenario are found again by what is seen first, and by nothing else."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from clearway.contract import Goal, Observation, Obstacles, Task
from clearway.navigators.colregs_apf import ColregsApf, RetunedColregsApf, retuned
from clearway.navigators.registry import make_navigator
from clearway.robots import load_robot
from perceived import obstacles

RESCUE = load_robot("rescue")


def seen(*places: tuple[float, float], identity: Any = None) -> Obstacles:
    return obstacles(places, 0.0, velocity_error=0.0, identity=identity)


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [
        {"scenario": "a", "seen": [[2.0, 3.0], [4.0, 1.0]], "gains": {"eta_d": 0.7}},
        {"scenario": "b", "seen": [[2.0, 3.0]], "gains": {"eta_d": 0.9}},
    ]
    monkeypatch.setattr(retuned, "_entries", lambda: entries)


@pytest.mark.usefixtures("two")
def test_recall() -> None:
    assert retuned.recall(seen((2.01, 3.0), (4.0, 0.99))) == {"eta_d": 0.7}
    assert retuned.recall(seen((4.0, 1.0), (2.0, 3.0), identity=(5, 2))) == {"eta_d": 0.7}  # by identity, not by place
    assert retuned.recall(seen((2.0, 3.0))) == {"eta_d": 0.9}
    for other in (seen((4.0, 1.0)), seen((2.0, 3.1)), seen((2.0, 3.0), (4.0, 1.0), (9.0, 9.0))):
        assert retuned.recall(other) is None


def commands(navigator: ColregsApf, *views: Obstacles) -> list[tuple[float, float]]:
    navigator.reset(Task(0.15, 1.0, np.zeros(3)), RESCUE, np.random.default_rng(0))
    goal = Goal(np.array((6.0, 2.0, 0.0)), 0.2, math.pi)
    found = []
    for k, view in enumerate(views):
        o = Observation(0.15 * k, np.array((0.5, 1.0, 0.2)), np.array((0.4, 0.1)), np.zeros(3), goal, None, view)
        command = navigator.step(o)
        found.append((command.v, command.omega))
    return found


@pytest.mark.usefixtures("two")
def test_the_first_obstacles_decide_and_gains_stay() -> None:
    a, later = seen((2.0, 3.0), (4.0, 1.0)), seen((1.8, 1.6))
    tuned = ColregsApf(eta_d=0.7)
    assert commands(RetunedColregsApf(), seen(), a, later) == commands(tuned, seen(), a, later)
    unknown = seen((3.0, 1.5))
    assert commands(RetunedColregsApf(), unknown, a, later) == commands(ColregsApf(), unknown, a, later)


def test_the_shipped_gains_are_valid_and_tell_scenarios_apart() -> None:
    entries = json.loads(retuned.FILE.read_text(encoding="utf-8"))["scenarios"]
    assert len(entries) == 20
    for entry in entries:
        ColregsApf(**entry["gains"])
        assert retuned.recall(seen(*map(tuple, entry["seen"]))) == entry["gains"]
    assert isinstance(make_navigator("colregs-apf-retuned"), RetunedColregsApf)


@pytest.mark.slow
def test_retuning_removes_a_livelock() -> None:
    """Paper B's figures 8 and 10a, on a scenario of ours."""
    from clearway.campaigns.pilot import compose
    from clearway.perception import make_localiser, make_tracker
    from clearway.scenarios.suites import load_suite
    from clearway.trials import Outcome
    from clearway.world import simulate

    robot = load_robot("rescue:unlimited")  # the gains were chosen for it
    scenario = load_suite("sar-case2").build(robot)[8]
    by_hand = {
        "eta_d": 0.3,
        "eta_e": 1.0,
        "eta_s": 0.2,
        "rho_0": 4.0,
        "rho_s": 1.0,
        "d_safe": 0.3,
        "velocity_term": 0.0,
    }
    outcomes = []
    for navigator in (ColregsApf(**by_hand), RetunedColregsApf()):
        tracker = make_tracker(scenario.tracking, robot)
        pilot = compose(navigator, make_localiser("truth", robot), tracker=tracker)
        trial = simulate(scenario, robot, pilot, navigator="colregs-apf", localisation="truth", map=None)
        outcomes.append(trial.outcome)
    assert outcomes == [Outcome.LIVELOCK, Outcome.REACHED]

"""The suite `barn` keeps BARN's task, and its published runs are those of its repository."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.robots import load_robot
from clearway.scenarios.barn import START, TASKS, published_runs, worlds
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import Selection, load_suite

JACKAL = load_robot("jackal")


def test_150_even_worlds_50_of_them_official() -> None:
    assert list(worlds()) == list(range(0, 300, 2))
    assert [w.number for w in worlds().values() if w.official] == list(range(0, 300, 6))


def test_the_official_set_is_50_worlds_ten_times() -> None:
    tests = load_suite("barn").build(JACKAL, Selection(batches=("official",)), 1)
    assert len(tests) == 500
    assert set(Counter(t.floor_plan for t in tests).values()) == {10}
    assert {t.floor_plan for t in tests} == {f"barn-{n}" for n in range(0, 300, 6)}
    assert len({t.name for t in tests}) == len({t.seed for t in tests}) == 500


def test_barn_s_task() -> None:
    (test,) = load_suite("barn").build(JACKAL, Selection(worlds=(108,), repetitions=1), 1)
    assert test.start == (-2.25, 3.0, 1.57)
    assert test.speed == 0.5
    assert test.localisation == "odometry"
    (leg,) = test.legs
    assert leg.goal[:2] == (-2.25, 13.0)
    assert (leg.arrival, leg.xy_tolerance, leg.yaw_tolerance) == ("measured", 1.0, math.inf)
    assert (leg.clock_starts_after, leg.time_limit) == (0.1, 100.0)
    assert (test.labels.batch, test.labels.configuration) == ("official", "world-108")


def test_the_reference_length_by_hand() -> None:
    world = worlds()[108]
    points = np.array([START[:2], *world.path, (-2.25, 13.0)])
    assert world.reference_length == pytest.approx(np.hypot(*np.diff(points, axis=0).T).sum())
    assert all(10.0 <= w.reference_length <= 25.0 for w in worlds().values())


def test_the_published_score_follows_from_the_reference_length() -> None:
    """BARN's recomputed mean score of its move_base is 0.159 (T = L / 2, clipped to 2 T and 8 T)."""
    scores = []
    for run in published_runs():
        optimal = worlds()[run.world].reference_length / 2
        scores.append(run.success * optimal / min(max(run.time, 2 * optimal), 8 * optimal))
    assert np.mean(scores) == pytest.approx(0.159, abs=0.001)


def test_the_published_runs_were_driven_under_the_task_of_2022() -> None:
    """Their last column is 2 x time / length of start + path + goal: it fits a start at x = -2, not one at -2.25."""
    for run in published_runs():
        if run.success:
            length = 2 * run.time / run.ratio
            assert worlds()[run.world].length(TASKS["barn-2022"]) == pytest.approx(length, abs=0.01)
    off = [abs(worlds()[r.world].length(TASKS["barn"]) - 2 * r.time / r.ratio) for r in published_runs() if r.success]
    assert max(off) > 0.25


def test_the_task_of_2022() -> None:
    (test,) = load_suite("barn-2022").build(JACKAL, Selection(worlds=(108,), repetitions=1), 1)
    (leg,) = test.legs
    assert test.start == (-2.0, 3.0, 1.57)
    assert leg.goal[:2] == (-2.0, 13.0)
    assert leg.xy_tolerance == 0.5
    assert (test.labels.suite, test.floor_plan) == ("barn-2022", "barn-108")
    assert len(load_suite("barn-2022").build(JACKAL, Selection(batches=("official",)), 1)) == 500


def test_published_runs() -> None:
    runs = published_runs()
    assert len(runs) == 500
    assert set(Counter(r.world for r in runs).values()) == {10}
    assert np.mean([r.success for r in runs]) == pytest.approx(0.85)
    assert np.mean([r.collided for r in runs]) == pytest.approx(0.056)
    assert np.mean([r.timed_out for r in runs]) == pytest.approx(0.094)
    assert np.mean([r.time for r in runs if r.success]) == pytest.approx(33.1, abs=0.05)
    assert all(r.success + r.collided + r.timed_out == 1 for r in runs)
    hardest = {n: np.mean([r.success for r in runs if r.world == n]) for n in (264, 282, 228, 216, 258)}
    assert hardest == pytest.approx({264: 0.0, 282: 0.1, 228: 0.2, 216: 0.4, 258: 0.5})


@pytest.mark.slow
def test_every_world_can_be_driven() -> None:
    for test in load_suite("barn").build(JACKAL, Selection(repetitions=1), 1):
        assert [str(e) for e in check_scenario(test, JACKAL)] == [], test.name


def test_another_speed() -> None:
    tests = load_suite("barn").build(JACKAL, Selection(worlds=(0,), speeds=(0.5, 2.0), repetitions=1), 1)
    assert [t.name for t in tests] == ["barn-0-v0.5-r1", "barn-0-v2-r1"]
    with pytest.raises(ClearwayError, match=r"speed 3 m/s is out of reach for 'jackal', at most 2"):
        load_suite("barn").build(JACKAL, Selection(speeds=(3.0,)), 1)


def test_wrong_selections() -> None:
    with pytest.raises(ClearwayError, match="no world 7 in the suite 'barn'"):
        load_suite("barn").build(JACKAL, Selection(worlds=(7,)), 1)
    with pytest.raises(ClearwayError, match="floor_plan: the worlds of the suite 'barn'"):
        load_suite("barn").build(JACKAL, Selection(floor_plan="hall"), 1)


def test_the_way_in_is_walled_by_cylinders() -> None:
    """The start lies in a corridor of cylinders: to its left and right, but not ahead."""
    places = np.array([f.pose[:2] for f in load_floor_plan("barn-0").fixtures])
    beside = places[np.abs(places[:, 1] - START[1]) < 0.1]
    assert (beside[:, 0] < START[0]).any()
    assert (beside[:, 0] > START[0]).any()

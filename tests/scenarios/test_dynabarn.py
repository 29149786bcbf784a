"""The suite `dynabarn` keeps DynaBARN's worlds and the challenge's task."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.dynabarn import EDGE, KINDS, worlds
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.spline import SplineSpec, knots
from clearway.scenarios.suites import Selection, load_suite

JACKAL = load_robot("jackal")


def made(*numbers: int, repetitions: int | None = None) -> list[Scenario]:
    return load_suite("dynabarn").build(JACKAL, Selection(worlds=numbers, repetitions=repetitions), 1)


def test_sixty_worlds_twenty_of_a_kind() -> None:
    assert list(worlds()) == list(range(300, 360))
    assert Counter(w.kind for w in worlds().values()) == dict.fromkeys(KINDS, 20)
    assert {len(w.cylinders) for w in worlds().values()} <= set(range(5, 25))


def test_every_world_ten_times() -> None:
    (batch,) = {t.labels.batch for t in made(300, 319)}
    assert batch == "easy"
    assert {t.labels.batch for t in made(320, 359, repetitions=1)} == {"medium", "hard"}
    assert len(made(300, 319)) == 20
    assert len({t.name for t in made(300, 319)}) == len({t.seed for t in made(300, 319)}) == 20


def test_the_challenge_s_task() -> None:
    (test,) = made(347, repetitions=1)
    (leg,) = test.legs
    assert (test.start, leg.goal[:2]) == ((11.0, 0.0, 3.14), (-9.0, 0.0))
    assert (leg.arrival, leg.xy_tolerance, leg.yaw_tolerance) == ("measured", 1.0, math.inf)
    assert (leg.clock_starts_after, leg.time_limit, test.reference_length) == (0.1, 100.0, 20.0)
    assert (test.speed, test.localisation, test.labels.family) == (0.5, "odometry", "barn")
    assert list(check_scenario(test, JACKAL)) == []


def test_nothing_leaves_the_floor() -> None:
    for world in worlds().values():
        for cylinder in world.cylinders:
            assert isinstance(cylinder.motion, SplineSpec)
            assert np.nanmax(np.abs(knots(cylinder.motion, cylinder.motion.period)[:, 1:])) + 0.5 < EDGE


def test_the_cylinders_have_begun_together_and_leave_the_start_free() -> None:
    begun = set()
    for test in made(310, 344, 358):
        motions = [o.motion for o in test.obstacles if isinstance(o.motion, SplineSpec)]
        assert len({m.offset for m in motions}) == 1
        begun.add(motions[0].offset)
        for obstacle, motion in zip(test.obstacles, motions, strict=True):
            there = np.array([*motion.start, 0.0])
            assert clearance(JACKAL.shape, np.array(test.start), obstacle.shape.shape(), there) > 0.04
    assert len(begun) == 30
    assert min(begun) < 20.0 < max(begun)


def test_other_worlds_and_speeds_out_of_reach_are_refused() -> None:
    with pytest.raises(ClearwayError, match="no world 6 in the suite 'dynabarn'; it has 300 to 359"):
        made(6)
    with pytest.raises(ClearwayError, match="out of reach"):
        load_suite("dynabarn").build(JACKAL, Selection(speeds=(3.0,)), 1)

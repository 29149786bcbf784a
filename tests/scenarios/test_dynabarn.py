"""The suites `dynabarn` keep DynaBARN's worlds, its rule, and the challenge's task."""

from __future__ import annotations

import itertools
import json
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.dynabarn import KINDS, worlds
from clearway.scenarios.dynabarn_draws import HELD_OUT, PUBLISHED, Geometry, Keyframes, Kind, draw
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.spline import SplineSpec, knots
from clearway.scenarios.suites import Selection, load_suite

JACKAL = load_robot("jackal")
GEOMETRIES = (PUBLISHED, HELD_OUT)


def build(suite: str = "dynabarn", **selection: Any) -> list[Scenario]:
    return load_suite(suite).build(JACKAL, Selection(**selection), 1)


def made(*numbers: int, repetitions: int | None = None) -> list[Scenario]:
    return build(worlds=numbers, repetitions=repetitions)


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


@pytest.mark.parametrize("geometry", GEOMETRIES, ids=lambda g: g.suite)
def test_nothing_leaves_the_floor(geometry: Geometry) -> None:
    for world in worlds(geometry.suite).values():
        for cylinder in world.cylinders:
            assert isinstance(cylinder.motion, SplineSpec)
            far = np.nanmax(np.abs(knots(cylinder.motion, cylinder.motion.period)[:, 1:]), axis=0)
            assert (far + geometry.radius < geometry.edge).all()


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
    with pytest.raises(ClearwayError, match="no world 300 in the suite 'dynabarn-held-out'; it has 400 to 459"):
        build("dynabarn-held-out", worlds=(300,))
    with pytest.raises(ClearwayError, match="out of reach"):
        build(speeds=(3.0,))
    with pytest.raises(ClearwayError, match="'7:7' is no range of seeds"):
        build(seeds=(7, 7))
    with pytest.raises(ClearwayError, match="worlds that are drawn from seeds have no numbers"):
        build(seeds=(0, 1), worlds=(300,))


def drawn(kind: Kind, count: int) -> list[Keyframes]:
    return [way for seed in range(count) for way in draw(PUBLISHED, kind, seed)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", PUBLISHED.kinds, ids=lambda k: k.name)
def test_other_worlds_are_like_the_published_ones(kind: Kind) -> None:
    """Key frames, lengths, rounds, speeds, and how many come back to where they began."""
    ours = drawn(kind, 40)
    motions = {c.name: c.motion for w in worlds().values() if w.kind == kind.name for c in w.cylinders}
    theirs = [m.keyframes for m in motions.values() if isinstance(m, SplineSpec)]

    def told(ways: Sequence[Keyframes]) -> dict[str, float]:
        frames = [np.array(way) for way in ways]
        steps = [np.hypot(*np.diff(f[:, 1:], axis=0).T) for f in frames]
        speeds = np.concatenate([s / np.diff(f[:, 0]) for s, f in zip(steps, frames, strict=True)])
        lengths = np.array([s.sum() for s in steps])
        return {
            "key frames": float(np.mean([len(f) for f in frames])),
            "median length": float(np.median(lengths)),
            "long": float(np.quantile(lengths, 0.9)),
            "median round": float(np.median([f[-1, 0] for f in frames])),
            "slow": float(np.quantile(speeds, 0.1)),
            "fast": float(np.quantile(speeds, 0.9)),
        }

    assert told(ours) == pytest.approx(told(theirs), rel=0.12)
    closed = [np.mean([way[0][1:] == way[-1][1:] for way in ways]) for ways in (ours, theirs)]
    assert abs(closed[0] - closed[1]) < 0.05
    counts = {len(draw(PUBLISHED, kind, seed)) for seed in range(200)}
    assert counts == set(range(kind.cylinders[0], kind.cylinders[1] + 1))
    assert {len(w.cylinders) for w in worlds().values() if w.kind == kind.name} <= counts


@pytest.mark.parametrize("geometry", GEOMETRIES, ids=lambda g: g.suite)
def test_a_drawn_way_goes_from_border_to_border_no_faster_than_its_kind(geometry: Geometry) -> None:
    for kind in geometry.kinds:
        for way in draw(geometry, kind, 11):
            for _, x, y in (way[0], way[-1]):
                assert abs(x) == geometry.half[0] or abs(y) == geometry.half[1]
            for (t0, *a), (t1, *b) in itertools.pairwise(way):
                assert math.dist(a, b) < (kind.speed[1] - 0.1) * (t1 - t0) + 0.03  # as much as rounding may make of it
                assert math.dist(a, b) > kind.speed[0] * (t1 - t0) - 0.03


@pytest.mark.parametrize("suite", [g.suite for g in GEOMETRIES])
def test_seeds_draw_other_worlds_the_same_ones_each_time(suite: str) -> None:
    scenarios = build(suite, seeds=(0, 3))
    assert [(s.labels.batch, s.labels.configuration) for s in scenarios] == [
        (kind, f"seed-{k}") for kind in KINDS for k in range(3)
    ]
    assert len({s.obstacles[0].motion for s in scenarios}) == 9
    for scenario in scenarios[::4]:
        assert check_scenario(scenario, JACKAL) == []
    (again,) = build(suite, seeds=(0, 10**6), scenarios=(f"{suite}-hard-seed-2-v0.5-r1",))
    assert again == scenarios[-1]
    frozen = {c.motion for w in worlds(suite).values() for c in w.cylinders}
    assert not any(o.motion in frozen for s in scenarios for o in s.obstacles)
    assert len(build(suite, seeds=(0, 1), repetitions=2, batches=("easy",))) == 2


def test_a_drawn_world_is_the_same_after_it_was_written_down() -> None:
    generator = load_suite("dynabarn").generator
    assert generator is not None
    (call,) = generator.calls(Selection(seeds=(4, 5), batches=("easy",)))
    assert generator.read(json.loads(json.dumps(generator.written(generator(*call))))) == generator(*call)


def test_a_drawn_world_stays_what_it_is() -> None:
    assert [round(way[-1][0], 2) for way in draw(HELD_OUT, HELD_OUT.kinds[0], 1)][:3] == [57.14, 40.86, 58.53]


def test_the_held_out_geometry_is_another_one_throughout() -> None:
    for name in ("half", "radius", "start", "goal", "length"):
        assert getattr(PUBLISHED, name) != getattr(HELD_OUT, name), name
    for ours, theirs in zip(HELD_OUT.kinds, PUBLISHED.kinds, strict=True):
        areas = [4.0 * g.half[0] * g.half[1] for g in GEOMETRIES]
        density = [sum(k.cylinders) / 2.0 / area for k, area in zip((theirs, ours), areas, strict=True)]
        assert density[1] > density[0]
        assert ours.speed[0] < theirs.speed[0]
    assert {w.kind for w in worlds("dynabarn-held-out").values()} == set(KINDS)
    one = build("dynabarn-held-out", worlds=(447,), repetitions=1)[0]
    assert (one.start[0], one.legs[0].goal[0], one.reference_length) == (9.0, -7.0, 16.0)
    assert (one.labels.batch, one.labels.suite) == ("hard", "dynabarn-held-out")
    assert list(check_scenario(one, JACKAL)) == []

"""The suites `meeting-points`: robots fit, start apart, and can always exchange their places one after another."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, circumscribed_radius
from clearway.robots import load_robot, robot_names
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.meeting_places import GEOMETRY, HELD_OUT, MOST, PLANS, Geometry, spare, starts
from clearway.scenarios.meeting_points import HELD_OUT_MEETING_POINTS, MEETING_POINTS, NUMBERS
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, Suite
from clearway.scenarios.way import CELL, room_for, widest_way

SUITES = {GEOMETRY: MEETING_POINTS, HELD_OUT: HELD_OUT_MEETING_POINTS}
TIAGO = load_robot("tiago")
Place = tuple[float, float]


def one(suite: Suite, batch: str, number: int, draw: int, robot: str = "tiago") -> Scenario:
    chosen = Selection(batches=(batch,), configurations=(str(number),), seeds=(draw, draw + 1))
    (scenario,) = suite.build(load_robot(robot), chosen)
    return scenario


def ends(scenario: Scenario) -> tuple[list[Place], list[Place]]:
    members = scenario.members()
    return [m.start[:2] for m in members], [m.legs[0].goal[:2] for m in members]


@pytest.mark.parametrize("robot", robot_names())
def test_every_shipped_robot_finds_its_scenarios_sound(robot: str) -> None:
    ready = load_robot(robot)
    chosen = Selection(repetitions=1, configurations=("4",))
    for scenario in MEETING_POINTS.build(ready, chosen):
        assert [str(problem) for problem in check_scenario(scenario, ready)] == []


@pytest.mark.parametrize("suite", SUITES.values(), ids=lambda suite: suite.name)
def test_the_floors_hold_the_most_robots(suite: Suite) -> None:
    for scenario in suite.build(TIAGO, Selection(repetitions=1, configurations=(str(MOST),))):
        assert len(scenario.tested()) == MOST
        assert [str(problem) for problem in check_scenario(scenario, TIAGO)] == []


@settings(max_examples=30, deadline=None)
@given(geometry=st.sampled_from([GEOMETRY, HELD_OUT]), batch=st.sampled_from(list(PLANS)), number=st.sampled_from(NUMBERS), draw=st.integers(0, 10**6))  # fmt: skip
def test_starts_lie_apart_and_goals_do(geometry: Geometry, batch: str, number: int, draw: int) -> None:
    scenario = one(SUITES[geometry], batch, number, draw)
    size = 0.6
    moved = 2.0 * math.sqrt(2.0) * geometry.jitter
    for places in ends(scenario):
        assert (
            min(math.dist(p, q) for p, q in combinations(places, 2))
            >= (min(geometry.pitch, geometry.ring) - moved) * size - 0.01
            > size
        )
    _, goals = ends(scenario)
    assert min(math.dist(a, b) for a, b in zip(*ends(scenario), strict=True)) > 4.0 * size
    bounds = load_floor_plan(scenario.floor_plan).bounds
    assert all(bounds[0] + size < x < bounds[2] - size and bounds[1] + size < y < bounds[3] - size for x, y in goals)


def moves(scenario: Scenario, geometry: Geometry) -> Iterator[tuple[int, Place, Place]]:
    """Who drives from where to where, one after another: pairs exchange their places, with one more to wait in."""
    batch, (begin, end) = scenario.labels.batch, ends(scenario)
    waiting = tuple(0.6 * v for v in spare(geometry, batch))
    if batch == "crossing":
        yield from ((k, begin[k], end[k]) for k in range(len(begin)))
        return
    partner = [(k + len(begin) // 2) if batch == "circle" else k + 1 for k in range(len(begin))]
    for a in range(len(begin) // 2) if batch == "circle" else range(0, len(begin) - 1, 2):
        b = partner[a]
        yield a, begin[a], waiting
        yield b, begin[b], end[b]
        yield a, waiting, end[a]


@settings(max_examples=8, deadline=None)
@given(geometry=st.sampled_from([GEOMETRY, HELD_OUT]), batch=st.sampled_from(list(PLANS)), number=st.sampled_from([2, 4, 8]), draw=st.integers(0, 10**6))  # fmt: skip
def test_robots_can_get_to_their_goals_one_after_another(
    geometry: Geometry, batch: str, number: int, draw: int
) -> None:
    solve(one(SUITES[geometry], batch, number, draw), geometry)


def test_as_many_as_fit_can_do_so_through_the_doorway() -> None:
    solve(one(MEETING_POINTS, "doorway", MOST, 1), GEOMETRY)


def solve(scenario: Scenario, geometry: Geometry) -> None:
    """Every move has a way past walls and past all others, who stand, for the robot's circumscribed disc."""
    plan, radius = load_floor_plan(scenario.floor_plan), circumscribed_radius(TIAGO.shape)
    walls = [(f.shape, f.pose) for f in plan.fixtures]
    at, goals = ends(scenario)
    for who, start, goal in moves(scenario, geometry):
        assert at[who] == start
        others = [(Circle(radius), np.array((*p, 0.0))) for k, p in enumerate(at) if k != who]
        # The grid is in the robot's favour by a cell, by half a diagonal of it, and by half a step.
        room = room_for(walls + others, plan.bounds, radius + 2.21 * CELL)
        assert widest_way(room, [start, goal]) == [None], (scenario.name, who)
        at[who] = goal
    assert at == goals


def test_frozen_ones_are_the_same_in_every_campaign_and_seeds_draw_others() -> None:
    chosen = Selection(batches=("corridor",), configurations=("4",))
    first, second, third = MEETING_POINTS.build(TIAGO, chosen)
    again, *_ = MEETING_POINTS.build(TIAGO, chosen, 1)
    assert ends(first) == ends(again)
    assert first.seed != again.seed
    assert len({ends(s)[0][0] for s in (first, second, third, one(MEETING_POINTS, "corridor", 4, 5))}) == 4
    assert {s.labels.repetition for s in (first, second, third)} == {1, 2, 3}


def test_the_held_out_geometry_is_another_one_throughout() -> None:
    for name in ("ring", "radius", "pitch", "jitter", "apart", "corridor", "door", "speed"):
        assert getattr(GEOMETRY, name) != getattr(HELD_OUT, name), name
    for batch in PLANS:
        assert starts(GEOMETRY, batch, 4) != starts(HELD_OUT, batch, 4)


def test_a_robot_larger_than_the_largest_floor_is_refused() -> None:
    large = TIAGO.model_copy(update={"footprint": TIAGO.footprint.model_copy(update={"radius": 1.6})})
    with pytest.raises(ClearwayError, match=r"robots of up to 3 m; one here takes 3\.2 m"):
        MEETING_POINTS.build(large)
    with pytest.raises(ClearwayError, match="brings its own floor plans"):
        MEETING_POINTS.build(TIAGO, Selection(floor_plan="ward"))


def test_their_page_says_whom_they_are_taken_from() -> None:
    for suite in (MEETING_POINTS, HELD_OUT_MEETING_POINTS):
        assert "Helbing" in suite.source

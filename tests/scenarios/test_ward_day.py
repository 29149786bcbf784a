"""The suites `ward-day`: sound for every robot of theirs, nobody starts in anybody, the same people for everyone who drives."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle
from clearway.robots import Robot, load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, Suite
from clearway.scenarios.ward_day import CLEAR, HELD_OUT_WARD_DAY, WARD_DAY
from clearway.scenarios.ward_floors import APART, HELD_OUT, PITCH, RADIUS, WARD, Place, Ward, places
from clearway.scenarios.ward_people import SLOW, people
from clearway.scenarios.way import room_for, widest_way

SUITES = {WARD: WARD_DAY, HELD_OUT: HELD_OUT_WARD_DAY}
TIAGO, HOSBOT = load_robot("tiago"), load_robot("hosbot")
ward_or_held_out = pytest.mark.parametrize("ward", SUITES, ids=lambda ward: ward.name)


def crowd(suite: Suite, number: int, **selection: object) -> list[Scenario]:
    return suite.build(TIAGO, Selection(batches=(f"people-{number}",), **selection))  # type: ignore[arg-type]


@ward_or_held_out
def test_every_frozen_scenario_is_sound(ward: Ward) -> None:
    for robot in (TIAGO, HOSBOT):
        for scenario in SUITES[ward].build(robot):
            assert [str(problem) for problem in check_scenario(scenario, robot)] == [], (scenario.name, robot.name)


@ward_or_held_out
def test_places_lie_apart_off_doors_and_in_their_rooms(ward: Ward) -> None:
    plan, found = load_floor_plan(ward.plan), places(ward)
    every = [place for some in found.values() for place in some]
    assert min(math.dist(p, q) for p, q in itertools.combinations(every, 2)) >= PITCH
    for room in plan.rooms:
        for x, y in found[room.name]:
            assert any(x0 <= x <= x1 and y0 <= y <= y1 for x0, y0, x1, y1 in room.floor)
    doors = {
        "ward": [(14.6, -1.3), (13.0, 1.3), (6.6, 0.0), (8.45, 2.65)],
        "wing": [(1.75, -0.1), (16.2, -0.1), (0.1, 1.0)],
    }
    assert min(math.dist(p, door) for p in every for door in doors[ward.plan]) >= 0.8


@ward_or_held_out
def test_where_everybody_stands_a_person_still_gets_everywhere(ward: Ward) -> None:
    plan = load_floor_plan(ward.plan)
    every = [place for room, some in places(ward).items() if room != "corridor" for place in some]
    for place in every:
        others = [(Circle(RADIUS), np.array((*p, 0.0))) for p in every if p != place]
        room = room_for([(f.shape, f.pose) for f in plan.fixtures] + others, plan.bounds, RADIUS)
        assert widest_way(room, [ward.tasks["guide"][0][:2], place]) == [None], place


@settings(max_examples=25, deadline=None)
@given(ward=st.sampled_from(list(SUITES)), number=st.integers(0, 32), draw=st.integers(0, 10**9))
def test_whatever_is_drawn_nobody_shares_a_place(ward: Ward, number: int, draw: int) -> None:
    found = people(ward, number, f"seed-{draw}")
    assert len(found) == number == len({p.name for p in found})
    corridor = set(places(ward)["corridor"])
    mine = [{stop.at for stop in person.route} - corridor for person in found]
    every = [place for some in mine for place in some]
    assert len(set(every)) == len(every)
    starts = [person.start for person in found]
    assert all(start in some for start, some in zip(starts, mine, strict=True))
    ends = [pose[:2] for task in ward.tasks.values() for pose in task]
    assert all(math.dist(start, end) >= APART for start in starts for end in ends)
    assert all(math.dist(a, b) > 2 * RADIUS for a, b in itertools.combinations(starts, 2))
    assert all(stop.wait == 0.0 for p in found for stop in p.route if stop.at in corridor)
    assert all(SLOW[0] <= (p.speed or 0.0) <= SLOW[1] for p in found if "patient" in p.name)
    assert all(p.loop and p.speed is None for p in found if "patient" not in p.name)


def test_the_first_of_many_are_those_of_few() -> None:
    many = people(WARD, 40, "frozen 1")
    assert many[:9] == people(WARD, 9, "frozen 1")
    assert many[:9] != people(WARD, 9, "frozen 2")[:9]
    assert sum(p.name.startswith("staff") for p in many) == 8
    assert sum(p.name.startswith("visitor") for p in many) == 16
    assert many[2].group == many[3].group == "visitors 1"
    assert math.dist(many[2].start, many[3].start) < 1.5


def test_everybody_who_drives_meets_the_same_people() -> None:
    (a,), (b,) = (suite_of(robot) for robot in (TIAGO, HOSBOT))
    assert a.people == b.people
    assert a.obstacles == b.obstacles
    assert a.seed == b.seed
    other_noise = WARD_DAY.build(TIAGO, Selection(scenarios=(a.name,)), 1)[0]
    assert other_noise.people == a.people
    assert other_noise.seed != a.seed


def room_beside(scenario: Scenario, robot: Robot) -> float:
    """Of who starts nearest to the robot."""
    start = np.array(scenario.start)
    return min(clearance(robot.shape, start, Circle(RADIUS), np.array((*p.start, 0.0))) for p in scenario.people)


@ward_or_held_out
@pytest.mark.parametrize("name", ["mir100", "husky", "whill"])
def test_who_would_start_in_a_large_robot_starts_elsewhere(ward: Ward, name: str) -> None:
    robot, chosen = load_robot(name), Selection(batches=(f"people-{ward.numbers[-2]}",), seeds=(0, 25))
    theirs = zip(SUITES[ward].build(robot, chosen), SUITES[ward].build(TIAGO, chosen), strict=True)
    moved = [(mine, tiagos) for mine, tiagos in theirs if mine.people != tiagos.people]
    assert moved
    for mine, tiagos in moved:
        assert [str(problem) for problem in check_scenario(mine, robot)] == []
        assert room_beside(tiagos, robot) <= CLEAR < room_beside(mine, robot)
        for one, other in zip(mine.people, tiagos.people, strict=True):
            assert {s.at for s in one.route} == {s.at for s in other.route}


def suite_of(robot: object) -> list[Scenario]:
    return WARD_DAY.build(robot, Selection(scenarios=("people-10-guide-v0.6-r2",)))  # type: ignore[arg-type]


def test_seeds_draw_others_and_what_is_pushed_takes_turns() -> None:
    frozen, drawn = (
        crowd(WARD_DAY, 5, configurations=("guide",)),
        crowd(WARD_DAY, 5, configurations=("guide",), seeds=(7, 10)),
    )
    assert [[o.name for o in s.obstacles] for s in frozen] == [["bed"], ["wheelchair"], []]
    assert len({tuple(p.start for p in s.people) for s in [*frozen, *drawn]}) == 6
    assert [leg.name for leg in frozen[0].legs] == ["forth", "back"]
    assert frozen[0].legs[1].goal == frozen[0].start
    assert not any(s.people or s.obstacles for s in crowd(WARD_DAY, 0))


@ward_or_held_out
def test_a_floor_says_how_many_it_holds(ward: Ward) -> None:
    suite = SUITES[ward]
    with pytest.raises(
        ClearwayError, match=rf"the floor plan '{ward.plan}' has places for (32|56) people; 400 are asked for"
    ):
        crowd(suite, 400)
    assert len(crowd(suite, 31)[0].people) == 31
    with pytest.raises(ClearwayError, match="unknown batch 'people-many'"):
        suite.build(TIAGO, Selection(batches=("people-many",)))
    with pytest.raises(ClearwayError, match=f"takes place in '{ward.plan}', not in 'hall'"):
        suite.build(TIAGO, Selection(floor_plan="hall"))


def test_the_held_out_geometry_is_another_one_throughout() -> None:
    assert WARD.plan != HELD_OUT.plan
    assert WARD.speed != HELD_OUT.speed
    assert not set(WARD.numbers) & set(HELD_OUT.numbers)
    assert not set(ends_of(WARD)) & set(ends_of(HELD_OUT))


def ends_of(ward: Ward) -> list[Place]:
    return [pose[:2] for task in ward.tasks.values() for pose in task]

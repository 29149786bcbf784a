"""A test that nobody can win, or that isn't what it seems, is refused before it runs; one that somebody can is not."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.geometry.distance import clearance
from clearway.robots import load_robot
from clearway.scenarios.check import check_file, check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.world.attempt import placed

NORTH = 4.5
"""Where the hall's north wall begins, m."""
WALK = ((0.0, 1.0, 1.0), (10.0, 1.0, 3.0))


def problems(robot: str = "tiago", **changes: Any) -> list[str]:
    """Of a scenario in the hall, 12 m by 9 m, from its west to its east; with `changes`."""
    table: dict[str, Any] = {
        "name": "t", "floor_plan": "hall", "start": (-2.5, 0.0, 0.0), "speed": 0.5,
        "legs": [{"name": "way", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0}],
    }  # fmt: skip
    return [str(e) for e in check_scenario(Scenario.model_validate(table | changes), load_robot(robot))]


def recorded(*track: tuple[float, float, float]) -> dict[str, Any]:
    return {"name": "ann", "behaviour": "recorded", "track": track}


def still(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": f"{x} {y}", "start": (x, y), "behaviour": "still", **more}


def other(start: tuple[float, float, float], goal: tuple[float, float, float], **more: Any) -> dict[str, Any]:
    leg = {"name": "way", "goal": goal, "time_limit": 60.0, **more.pop("leg", {})}
    return {"name": "robot 2", "start": start, "legs": [leg], **more}


def test_a_recorded_way_with_a_sample_far_away_is_told_by_its_extent() -> None:
    (problem,) = problems(people=[recorded(*WALK, (9000.0, 12000.0, 9000.0))])
    assert problem == (
        "people.0.track: 'ann' goes from x 1 to 12000 m and from y 1 to 9000 m: the floor on which people find their ways would have "
        "1.08e+10 cells of 0.1 m, at most 16,000,000 are"
    )
    assert problems(people=[recorded(*WALK, (90.0, 100.0, 100.0))]) == []


@pytest.mark.parametrize(
    ("shift", "says"),
    [
        (1.7e9, "begins at 1.7e+09 s; the trial is over by 60 s; times count from its beginning"),
        (60.1, "begins at 60.1 s; the trial is over by 60 s; times count from its beginning"),
        (-10.1, "ends at -0.1 s, before the trial begins; times count from its beginning"),
        (59.0, None),
        (-9.0, None),
    ],
)
def test_somebody_recorded_is_there_while_the_trial_lasts(shift: float, says: str | None) -> None:
    track = [(t + shift, x, y) for t, x, y in WALK]
    assert problems(people=[recorded(*track)]) == ([] if says is None else [f"people.0.track: {says}"])


def test_a_trial_lasts_as_long_as_its_slowest_robot(tmp_path: Path) -> None:
    track = [(t + 100.0, x, y) for t, x, y in WALK]
    robots = [other((2.5, 2.0, 0.0), (-2.5, 2.0, 0.0), leg={"time_limit": 120.0})]
    assert problems(people=[recorded(*track)], robots=robots) == []
    legs = [{"name": "way", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0, "clock_starts_after": 0.1}]
    assert problems(people=[recorded(*track)], legs=legs) == []  # its clock may start by the end of as long again


def test_a_csv_file_of_other_times_is_told(tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text("t,x,y\n1700000000,1,1\n1700000010,1,3\n")
    (tmp_path / "scene.toml").write_text(
        'name = "t"\nfloor_plan = "hall"\nstart = [-2.5, 0.0, 0.0]\nspeed = 0.5\nlegs = [{ name = "way", goal = [2.5, 0.0, 0.0], time_limit = 60.0 }]\n'
        'people = [{ name = "ann", behaviour = "recorded", track = "walk.csv" }]\n'
    )
    (problem,) = check_file(tmp_path / "scene.toml")
    assert problem.field == "people.0.track"
    assert problem.problem.startswith("begins at 1.7e+09 s; the trial is over by 60 s")


def test_who_never_goes_counts_as_standing_where_robots_are_to_go() -> None:
    (problem,) = problems(people=[still(2.5, 0.1)])
    assert problem == "legs.0.goal: tiago at the goal 'way' (2.5, 0) would stand in '2.5 0.1'"
    wall = [{"name": f"crate {k}", "shape": {"kind": "rectangle", "length": 0.2, "width": 3.1}, "pose": (1.0, y, 0.0)}
            for k, y in enumerate((-2.9, 2.9))]  # fmt: skip
    gate = [still(1.0, y) for y in (-0.8, 0.0, 0.8)]
    assert problems(obstacles=wall) == []
    (problem,) = problems(obstacles=wall, people=gate)
    assert problem.startswith("legs.0.goal: tiago is 0.54 m wide, but the widest way to the goal 'way' is about 0.")
    (blind,) = problems(people=[still(2.5, 0.1, yields_at=1.0, sees_robots=False)])
    assert blind.startswith("legs.0.goal")
    aside = [still(1.0, y, yields_at=1.0) for y in (-0.8, 0.0, 0.8)]
    assert problems(obstacles=wall, people=[*aside, still(2.5, 0.1, yields_at=1.0)]) == []


def test_who_stands_in_a_robot_is_said_once() -> None:
    assert problems(people=[still(-2.5, 0.1)]) == ["people.0.start: '-2.5 0.1' at (-2.5, 0.1) would stand in tiago"]


def test_two_robots_cannot_end_in_one_place() -> None:
    (problem,) = problems(robots=[other((2.5, 2.0, 0.0), (2.4, 0.0, 0.0))])
    assert problem == (
        "robots.0.legs.0.goal: 'robot 2' and 'robot 1' can't both end there: at (2.4, 0) and (2.5, 0), within 0.2 and 0.2 m, one would "
        "stand in the other, which stays where it has ended"
    )
    assert (
        problems(robots=[other((2.5, 2.0, 0.0), (2.3, 0.0, 0.0))]) == []
    )  # 0.2 m apart and each 0.2 m astray they can
    assert problems(robots=[other((2.5, 2.0, 0.0), (2.4, 0.0, 0.0), role="other")]) == []  # the tested one may be first
    first = {"name": "by", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0}
    on = other((2.5, 2.0, 0.0), (2.5, -2.0, 0.0))
    assert problems(robots=[on | {"legs": [first, *on["legs"]]}]) == []  # it comes by, and goes on
    (long,) = problems("whill", robots=[other((2.5, 2.0, 0.0), (2.5, 0.0, 0.0))])  # by its outline, not its width
    assert "can't both end there" in long
    measured = {"arrival": "measured", "xy_tolerance": 0.2}
    legs = [{"name": "way", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0, **measured}]
    rolls = other((2.5, 2.0, 0.0), (2.5, 0.0, 0.0), leg=measured)
    assert "can't both" in problems(legs=legs, robots=[rolls], speed=0.1)[0]
    assert problems(legs=legs, robots=[rolls], speed=1.0) == []  # it rolls on and comes to rest far enough


def test_a_robot_has_as_much_room_at_its_start_as_it_may_be_placed_astray() -> None:
    near = {"start": (-1.0, NORTH - 0.27 - 0.015, 0.0)}
    (problem,) = problems(**near)
    assert problem == (
        f"start: tiago at the start (-1, {near['start'][1]:g}) would stand in 'north wall, west of the door', as placement_xy and placement_yaw may "
        "have it: 0.015 m are between them"
    )
    assert problems(**near, placement_xy=0.01) == []
    box = {"start": (-1.0, NORTH - 0.3 - 0.022, 0.0)}  # HOSBOT is a square of 0.6 m: its corners turn into the wall
    assert problems("tiago", **box) == []
    assert problems("hosbot", **box)[0].startswith("start: hosbot")
    assert problems("hosbot", **box, placement_yaw=0.001) == []


def test_no_draw_of_a_start_that_is_let_through_touches_anything() -> None:
    robot, wall = load_robot("hosbot"), load_floor_plan("hall").fixtures
    starts = ((-1.0, NORTH - 0.3 - 0.001 * k, 0.0) for k in range(100))
    start = next(start for start in starts if not problems("hosbot", start=start))
    base = {"name": "t", "floor_plan": "hall", "start": start, "speed": 0.5}
    base["legs"] = [{"name": "way", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0}]
    drawn = [placed(np.array(start), Scenario.model_validate(base | {"seed": seed})) for seed in range(300)]
    gaps = [clearance(robot.shape, pose, f.shape, f.pose) for pose in drawn for f in wall]
    assert 0.0 < min(gaps) < 0.01  # and hardly any is kept from it


def test_people_and_robots_are_apart_however_robots_are_placed() -> None:
    beside = {"name": "ann", "start": (-2.5, 0.27 + 0.25 + 0.01), "route": [{"at": (2.0, 2.0)}]}
    (problem,) = problems(people=[beside])
    assert problem.startswith(
        "people.0.start: 'ann' at (-2.5, 0.53) would stand in tiago, as placement_xy and placement_yaw may"
    )
    assert problems(people=[beside], placement_xy=0.0) == []
    robots = [other((-2.5, 0.57, 0.0), (2.5, 2.0, 0.0))]  # 0.03 m apart, both placed within 0.02 m
    assert problems(robots=robots)[0].startswith(
        "robots.0.start: 'robot 2' at (-2.5, 0.57) would stand in 'robot 1', as"
    )
    assert problems(robots=robots, placement_xy=0.01) == []


DISC = {"kind": "disc", "radius": 0.3}


def swinging(x: float, y: float) -> dict[str, Any]:
    motion = {"start": (x, y), "velocity": (0.1, 0.0), "attraction": (x, y), "stiffness": (0.5, 0.5)}
    return {"name": "m", "shape": DISC, "oscillation": motion}


def running(*path: tuple[float, float], **more: Any) -> dict[str, Any]:
    behaviour = {"behaviour": more.pop("behaviour")} if "behaviour" in more else {}
    return {"name": "m", "shape": DISC, "runs": [{"leg": "way", "path": path, "speed": 0.5, **more}], **behaviour}


def test_what_moves_begins_in_no_robot_and_in_nobody() -> None:
    robots = [other((2.5, 2.0, 0.0), (-2.5, 2.0, 0.0))]
    people = [{"name": "ann", "start": (0.0, -2.0), "route": [{"at": (2.0, -2.0)}]}]
    there: dict[str, Any] = {"robots": robots, "people": people}
    assert problems(**there, obstacles=[swinging(0.0, 0.0)]) == []
    (problem,) = problems(**there, obstacles=[swinging(2.4, 2.0)])
    assert problem == "obstacles.0.oscillation.start: 'm' at (2.4, 2) touches 'robot 2' at the start (2.5, 2)"
    (problem,) = problems(**there, obstacles=[swinging(0.0, -2.0)])
    assert problem == "obstacles.0.oscillation.start: 'm' at (0, -2) touches 'ann' at the start (0, -2)"
    (problem,) = problems(**there, obstacles=[running((2.4, 2.0), (0.0, 2.0))])
    assert (
        problem == "obstacles.0.runs.0.path: 'm' touches 'robot 2' when it appears at (2.4, 2); give it a longer run-up"
    )
    (problem,) = problems(**there, obstacles=[running((0.0, -2.0), (-2.0, -2.0))])
    assert problem == "obstacles.0.runs.0.path: 'm' touches 'ann' when it appears at (0, -2); give it a longer run-up"
    assert problems(**there, obstacles=[running((0.0, -2.0), (-2.0, -2.0), delay=5.0)]) == []  # she has gone by then
    waits = running((0.0, -2.0), (-2.0, -2.0), behaviour={"kind": "operator"})
    assert problems(**there, obstacles=[waits]) == []  # until nobody is there


def test_of_who_was_recorded_it_counts_where_they_are_as_the_trial_begins() -> None:
    walk = [(-10.0, 0.0, -2.0), (10.0, 0.0, 0.0)]
    (problem,) = problems(people=[recorded(*walk)], obstacles=[swinging(0.0, -1.0)])
    assert problem.endswith("touches 'ann' at the start (0, -1)")
    late = [(t + 11.0, x, y) for t, x, y in walk]
    assert problems(people=[recorded(*late)], obstacles=[swinging(0.0, -2.0)]) == []
    assert math.isclose(late[0][0], 1.0)

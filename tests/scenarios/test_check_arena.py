"""Scenarios in an open area, with obstacles that oscillate: what is wrong with them, and that nothing else is."""

from __future__ import annotations

import math
from typing import Any

import pytest

from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.stand_ins import stand_ins

DISC = {"kind": "disc", "radius": 0.35}


def swinging(**changes: Any) -> dict[str, Any]:
    motion = {"start": (5.0, 6.0), "velocity": (0.3, 0.0), "attraction": (9.0, 6.0), "stiffness": (0.1, 0.2)}
    return {"name": "m", "shape": DISC, "oscillation": motion | changes}


def standing(x: float, y: float) -> dict[str, Any]:
    return {"name": f"s {x} {y}", "shape": DISC, "pose": (x, y, 0.0)}


def problems(*obstacles: dict[str, Any], **changes: Any) -> list[str]:
    table: dict[str, Any] = {
        "name": "t", "floor_plan": "arena", "start": (1.75, 1.75, 0.8), "speed": 1.0, "obstacles": obstacles,
        "legs": [{"name": "way", "goal": (12.25, 12.25, 0.0), "time_limit": 120.0, "yaw_tolerance": math.inf}],
    }  # fmt: skip
    return [str(e) for e in check_scenario(Scenario.model_validate(table | changes), load_robot("rescue"))]


def test_the_arena_is_the_paper_s_square_without_anything_in_it() -> None:
    plan = load_floor_plan("arena")
    size = stand_ins("task")["size"]
    assert plan.area == plan.bounds == (0.0, 0.0, size, size)
    assert plan.fixtures == ()
    assert plan.map is None


def test_nothing_is_wrong_with_a_good_one_or_an_empty_one() -> None:
    assert problems() == []
    assert problems(standing(6.0, 4.0), swinging()) == []
    assert problems(swinging(attraction=(13.0, 6.0))) == []  # it may swing out of the square, as the paper's do


@pytest.mark.parametrize(
    ("obstacles", "message"),
    [
        ([standing(1.9, 1.9)], "start: rescue at the start (1.75, 1.75) would stand in 's 1.9 1.9'"),
        ([standing(12.0, 12.0)], "legs.0.goal: rescue at the goal 'way' (12.25, 12.25) would stand in 's 12.0 12.0'"),
        ([swinging(start=(2.2, 1.9))], "obstacles.0.oscillation.start: 'm' at (2.2, 1.9) touches rescue at the start (1.75, 1.75)"),
        ([standing(15.0, 3.0)], "obstacles.0.pose: (15, 3) is outside the floor plan 'arena' (x 0 to 14, y 0 to 14)"),
        ([standing(5.0, 5.0), standing(5.3, 5.3)], "obstacles.1.pose: 's 5.3 5.3' at (5.3, 5.3) overlaps 's 5.0 5.0'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_the_obstacles(obstacles: list[dict[str, Any]], message: str) -> None:
    assert problems(*obstacles) == [message]


def test_what_is_wrong_with_the_task() -> None:
    assert problems(start=(-1.0, 1.0, 0.0))[0].startswith("start: the start (-1, 1) is outside the floor plan 'arena'")
    legs = [{"name": "way", "goal": (12.25, 12.25, 0.0), "time_limit": 4000.0}]
    assert problems(legs=legs) == []
    assert problems(swinging(), legs=legs) == [
        "legs.time_limit: the legs may take 4000 s together; with something that oscillates, at most 3600"
    ]


def test_a_ring_of_obstacles_leaves_no_way() -> None:
    ring = [
        standing(12.25 + math.cos(a) * 1.1, 12.25 + math.sin(a) * 1.1) for a in [k * math.tau / 9 for k in range(9)]
    ]
    assert problems(*ring)[0].startswith("legs.0.goal: rescue is 0.50 m wide, but the widest way to the goal 'way'")


def test_what_oscillates_does_not_go_through_walls() -> None:
    hall = {"floor_plan": "hall", "start": (-2.5, 0.0, 0.0),
            "legs": [{"name": "way", "goal": (2.5, 0.0, 0.0), "time_limit": 60.0}]}  # fmt: skip
    inside = swinging(start=(0.0, 2.0), attraction=(0.5, 1.5))
    assert problems(inside, **hall) == []
    found = problems(swinging(start=(0.0, 2.0), attraction=(3.5, 1.5)), **hall)
    assert len(found) == 1
    assert found[0].startswith("obstacles.0.oscillation: 'm' would swing into 'east wall' at (")

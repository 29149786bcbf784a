"""A bed that is pushed among people: they make way for it, and it is pushed into none of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from worlds import body, constant, make_robot, make_scenario, run_among

from clearway.geometry.shapes import FloatArray, Polygon, rectangle, row_of_discs
from clearway.trials import Trial

RULES = ("orca", "social-force", "headed-social-force")
LENGTH, WIDTH = 2.1, 0.96
BED = {
    "name": "bed",
    "shape": {"kind": "rectangle", "length": LENGTH, "width": WIDTH},
    "behaviour": {"acceleration": 0.4, "deceleration": 0.8, "line_keeping": 0.0},
    "runs": [{"leg": "forth", "path": [(-4.0, 0.0), (4.0, 0.0)], "speed": 0.7}],
}
CORRIDOR = [body(rectangle(20.0, 0.2), 0.0, y, name=f"wall {y}") for y in (-1.6, 1.6)]


def push(people: Sequence[dict[str, Any]], seconds: float = 25.0) -> Trial:
    """A bed is pushed along the corridor, 3 m wide, among `people`; the robot stands far away."""
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": seconds}]
    scenario = make_scenario(people=people, obstacles=[BED], start=(0.0, -20.0, 0.0), legs=legs, seed=5)
    return run_among(CORRIDOR, constant(0.0), scenario, make_robot())


def person(name: str, start: tuple[float, float], *places: tuple[float, float], **more: Any) -> dict[str, Any]:
    return {"name": name, "start": start, "route": [{"at": place} for place in places]} | more


def gaps(trial: Trial) -> FloatArray:
    """(samples, people) between each and the bed while that is there, m; negative: so deep it is in it."""
    poses = trial.moving_obstacles[np.isfinite(trial.moving_obstacles[:, 0, 0])]
    apart, theta = poses[:, 1:, :2] - poses[:, :1, :2], poses[:, :1, 2]
    along = np.abs(np.cos(theta) * apart[..., 0] + np.sin(theta) * apart[..., 1]) - LENGTH / 2
    across = np.abs(np.cos(theta) * apart[..., 1] - np.sin(theta) * apart[..., 0]) - WIDTH / 2
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(along, across), 0.0) - 0.25)


@pytest.mark.parametrize("rule", RULES)
def test_who_meets_a_bed_head_on_goes_round_it_and_both_get_where_they_go(rule: str) -> None:
    people = [person(f"p{k}", (5.0 + k, 0.1 * k), (-8.0, 0.0), behaviour=rule, speed=1.2) for k in range(3)]
    found = push(people)
    assert gaps(found).min() > 0.0
    assert found.moving_obstacles[-1, 1:, 0].max() < -7.5
    bed = found.moving_obstacles[:, 0, 0]
    assert np.isnan(bed[-1])  # it is through
    assert np.nanmax(bed) > 3.9


def test_who_walks_more_slowly_ahead_of_a_bed_is_followed_or_passed_but_not_run_over() -> None:
    found = push([person("old", (-2.0, 0.0), (9.0, 0.0), speed=0.3)])
    assert gaps(found).min() > 0.0
    assert found.moving_obstacles[-1, 1, 0] > 3.0


def test_a_bed_stops_before_who_does_not_make_way() -> None:
    found = push([{"name": "post", "start": (1.0, 0.2), "behaviour": "still"}])
    assert gaps(found)[-1, 0] == pytest.approx(
        0.07, abs=0.04
    )  # `beside`, less what it rolls from one decision to the next


def test_a_bed_passes_who_stands_beside_its_way() -> None:
    found = push([{"name": "post", "start": (1.0, 0.48 + 0.25 + 0.01), "behaviour": "still"}])
    assert np.nanmax(found.moving_obstacles[:, 0, 0]) > 3.9


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), number=st.integers(2, 8))
def test_nobody_of_a_crowd_is_ever_in_the_bed(seed: int, number: int) -> None:
    """Both ways along the corridor, across it, and about it; where many press, the arm of one at most gives way."""
    rng = np.random.default_rng(seed)
    people = []
    for k in range(number):
        x, side = rng.uniform(-1.0, 7.0), rng.choice((-1.0, 1.0))
        goal = (-7.0 if rng.random() < 0.7 else 7.0, rng.uniform(-1.0, 1.0))
        people.append(person(f"p{k}", (x, side * rng.uniform(0.4, 1.1)), goal, speed=rng.uniform(0.5, 1.5)))
    assert gaps(push(people)).min() > -0.05


@given(
    length=st.floats(0.1, 5.0), width=st.floats(0.0, 5.0), x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), bulge=st.floats(0.02, 0.3)
)  # fmt: skip
@example(length=0.1369298809227358, width=0.1369298809227358, x=0.3, y=0.7, bulge=0.02)
def test_a_row_of_discs_holds_the_box_and_sticks_out_no_further_than_told(
    length: float, width: float, x: float, y: float, bulge: float
) -> None:
    corners = np.array(rectangle(length, width).vertices) + np.array((x, y))
    discs = row_of_discs(Polygon(tuple(map(tuple, corners.tolist()))), bulge)
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, 41), np.linspace(-0.5, 0.5, 41))
    inside = np.column_stack((x + length * u.ravel(), y + width * v.ravel()))
    apart = np.hypot(*(inside[:, None] - discs[None, :, :2]).transpose(2, 0, 1)) - discs[:, 2]
    assert apart.min(axis=1).max() <= 1e-9
    across = int(np.ptp(corners[:, 1]) <= np.ptp(corners[:, 0]))  # of a square rounding decides
    off = discs[:, across] - (x, y)[across]
    assert (np.abs(off) + discs[:, 2] <= 0.5 * (length, width)[across] + bulge + 1e-9).all()

"""ORCA against what RVO2 did, and what holds for it whatever the crowd."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from crowd_scenes import bodies_of, crowds, least_gap, mirrored, reordered, towards, wishes_of
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.orca import Care, body_lines, velocities
from clearway.crowds.walls import walls_of

NOTHING = walls_of([])
DOORWAY = [[(1, 1), (1, 4), (-1, 4), (-1, 1)], [(1, -4), (1, -1), (-1, -1), (-1, -4)]]


def care_of(n: int, distance=10.0, neighbours=10, horizon=3.0, wall_horizon=1.5) -> Care:
    return Care(
        np.full(n, distance), np.full(n, neighbours, np.int64), np.full(n, horizon), np.full(n, wall_horizon)
    )  # fmt: skip


def decide(bodies: Bodies, wishes: Wishes, walls=NOTHING, period=0.1, **care):
    return velocities(bodies, wishes, care_of(len(wishes.who), **care), walls, period)


def test_steps_of_rvo2():
    """From each state that RVO2 recorded, the velocities that it took next: in 32-bit floats, so not to the last digit."""
    with gzip.open(Path(__file__).with_name("rvo2") / "reference.json.gz") as file:
        runs = json.load(file)
    for run in runs:
        agents, period, positions = run["agents"], run["time_step"], np.array(run["positions"])
        taken = np.array(run["velocities"])
        n, goal = len(agents), np.array([a["goal"] for a in agents], np.float64)
        radius = np.array([a.get("radius", run["radius"]) for a in agents])
        speed = np.array([a.get("vpref", 1.0) for a in agents])[:, None]
        care = care_of(
            n, run["neighbor_dist"], run["max_neighbors"], run["time_horizon"], run["time_horizon_obst"]
        )  # fmt: skip
        walls, before, wrong = walls_of(run["obstacles"]), np.zeros((n, 2)), []
        for position, after in zip(positions, taken, strict=False):
            away = goal - position
            wish = away / np.maximum(np.hypot(*away.T)[:, None], speed * period) * speed
            bodies, wishes = bodies_of(position, before, radius), wishes_of(wish, run["max_speed"])
            wrong += list(np.hypot(*(velocities(bodies, wishes, care, walls, period) - after).T))
            before = after
        assert len(wrong) == taken.shape[0] * n >= 3600
        assert np.mean(np.array(wrong) <= 1e-4) >= 0.999, run["name"]
        assert max(wrong) < 1e-3, run["name"]


def test_half_each_of_what_two_that_meet_have_to_yield():
    """Two head on, a little to the side: by hand, the least change that takes the pair past each other, shared."""
    bodies = bodies_of([(-2, 0.1), (2, -0.1)], [(1, 0), (-1, 0)])
    after = decide(bodies, wishes_of([(1, 0), (-1, 0)]), horizon=10.0)
    assert after[0] == pytest.approx(-after[1], abs=1e-12)
    r, v = np.array((4.0, -0.2)), 2.0 * after[0]  # relative place and velocity: v touches the cone of radius 0.5
    assert abs(r[0] * v[1] - r[1] * v[0]) / np.hypot(*v) == pytest.approx(0.5, abs=1e-9)
    assert after[0, 1] > 0.0  # each to the side on which it is already


def test_all_of_it_where_the_other_does_not_look():
    bodies = bodies_of([(-2, 0.1), (2, -0.1)], [(1, 0), (-1, 0)])._replace(share=np.array((0.5, 1.0)))
    after = decide(bodies, wishes_of([(1, 0), (-1, 0)]), horizon=10.0)
    r, v = np.array((4.0, -0.2)), after[0] - (-1.0, 0.0)
    assert abs(r[0] * v[1] - r[1] * v[0]) / np.hypot(*v) == pytest.approx(0.5, abs=1e-9)


def test_who_is_on_a_layer_that_one_does_not_look_at_is_overlooked():
    bodies = bodies_of([(-2, 0.1), (2, -0.1)], [(1, 0), (-1, 0)])._replace(layer=np.array((1, 2)))
    after = decide(bodies, wishes_of([(1, 0), (-1, 0)])._replace(sees=np.array((1, 3))))
    assert after[0] == pytest.approx((1.0, 0.0), abs=1e-12)
    assert after[1] != pytest.approx((-1.0, 0.0), abs=1e-3)


@given(crowds(), st.sampled_from((3, 10)), st.booleans())
def test_a_mirrored_crowd_goes_mirrored_ways(crowd, neighbours, door):
    polygons = DOORWAY if door else []
    there = decide(
        *mirrored(*crowd), walls=walls_of([np.array(p)[::-1] * (1, -1) for p in polygons]), neighbours=neighbours
    )
    here = decide(*crowd, walls=walls_of(polygons), neighbours=neighbours)
    assert np.abs(there - here * (1, -1)).max() < 1e-9


@given(crowds(), st.data())
def test_the_order_of_bodies_changes_no_bit(crowd, data):
    order = data.draw(st.permutations(range(len(crowd[0].radius))))
    there = decide(*reordered(*crowd, order), neighbours=4)
    assert np.array_equal(there, decide(*crowd, neighbours=4)[order])


@given(crowds(), st.data())
def test_one_decides_alone_as_among_all(crowd, data):
    """Those that decide are any of the bodies, in any order."""
    bodies, wishes = crowd
    some = np.array(data.draw(st.lists(st.integers(0, len(bodies.radius) - 1), min_size=1, unique=True)))
    alone = decide(bodies, Wishes(*(a[some].copy() for a in wishes)))
    assert np.array_equal(alone, decide(bodies, wishes)[some])


OVERLAP = {0.05: 0.01, 0.1: 0.05, 0.25: 0.25}
"""By control period [s], how deep discs of 0.25 m may press into each other in a jam, m. RVO2's do, as deep, in the same scenes."""


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(2, 16), st.sampled_from(tuple(OVERLAP)))
def test_nobody_passes_through_anybody(seed, n, period):
    """A circle whose members change places, none exactly opposite: who finds a velocity that all others leave touches nobody."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n
    start = 6.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    bodies, line, care = bodies_of(start), np.empty(4), {"neighbours": 15, "period": period}
    for _ in range(int(12.0 / period)):
        velocity = decide(bodies, wishes_of(towards(-start, bodies.position, 1.2, period)), **care)
        assert np.hypot(*velocity.T).max() <= 1.6 + 1e-9
        before, gap = least_gap(bodies, velocity, 0.0), least_gap(bodies, velocity, period)
        assert gap > -OVERLAP[period]
        if gap < min(before, 0.0) - 1e-6:
            assert not all(
                _left_to(bodies, i, j, period, velocity[i], line) for i in range(n) for j in range(n) if i != j
            )  # fmt: skip
        bodies = bodies._replace(position=bodies.position + velocity * period, velocity=velocity)


def _left_to(bodies, i, j, period, v, line) -> bool:
    body_lines(i, np.array([j]), bodies, 3.0, period, line[None])
    return line[2] * (v[1] - line[1]) - line[3] * (v[0] - line[0]) >= -1e-9


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.sampled_from((0.05, 0.1, 0.25)))
def test_nobody_passes_through_a_wall(seed, period):
    """Twelve want through a doorway, from both sides; some want through the wall beside it and stay before it."""
    rng = np.random.default_rng(seed)
    walls = walls_of(DOORWAY)
    start = np.column_stack((np.repeat((-1.0, 1.0), 6) * rng.uniform(2, 8, 12), rng.uniform(-3, 3, 12)))
    while least_gap(bodies_of(start), np.zeros((12, 2)), 0.0) < 0.05:
        start[:, 0] = np.repeat((-1.0, 1.0), 6) * rng.uniform(2, 8, 12)
    bodies, goal = bodies_of(start), start * (-1, 1)
    for _ in range(int(10 / period)):
        wish = wishes_of((goal - bodies.position) / np.hypot(*(goal - bodies.position).T)[:, None])
        velocity = decide(bodies, wish, walls=walls, period=period)
        for part in np.linspace(0.0, period, 6):
            x, y = np.abs(bodies.position + part * velocity).T
            beyond = np.hypot(np.maximum(x - 1.0, 0.0), np.maximum(1.0 - y, 0.0))
            assert (np.where((x < 1.0) & (y > 1.0), 0.0, beyond) > bodies.radius - 1e-4).all()
        bodies = bodies._replace(position=bodies.position + velocity * period, velocity=velocity)


def test_who_stands_in_the_same_place_as_another_is_answered():
    after = decide(bodies_of([(0, 0), (0, 0)]), wishes_of([(1, 0), (1, 0)]))
    assert np.isfinite(after).all()

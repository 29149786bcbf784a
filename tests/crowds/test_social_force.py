"""The social force model against a second, plain reading of its papers, and what holds for it whatever the crowd."""

from __future__ import annotations

import numpy as np
import plain_social_force as plain
import pytest
from crowd_scenes import bodies_of, crowds, least_gap, mirrored, reordered, towards, wishes_of
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.crowds.social_force import MOUSSAID, forces, velocities
from clearway.crowds.walls import walls_of

FAINT = 1e-5
"""What is left out where it is faint, m/s^2: that of each other one is less than 1e-6."""
POLYGONS = [[(-6, -6.5), (6, -6.5), (6, -6), (-6, -6)], [(3, 0), (4, 1)], [(-3, 2)]]
ALONE = np.full(40, -1)


@given(crowds(), st.booleans(), st.data())
def test_as_the_papers_write_it(crowd, walled, data):
    bodies, wishes = crowd
    n = len(bodies.radius)
    group = np.array(data.draw(st.lists(st.integers(-1, 2), min_size=n, max_size=n)))
    polygons = POLYGONS if walled else []
    ours = forces(bodies, wishes, group, MOUSSAID, walls_of(polygons))
    papers = plain.forces(bodies.position, bodies.velocity, bodies.radius, group, polygons)
    assert np.abs(ours - papers).max() < FAINT


def test_the_drive_and_the_largest_speed():
    bodies, wishes = bodies_of([(0, 0), (50, 0)], [(0, 0), (1, 0)]), wishes_of([(1.3, 0), (3.0, 0)], v_max=1.5)
    after = velocities(bodies, wishes, ALONE[:2], MOUSSAID, walls_of([]), 0.1)
    assert after == pytest.approx(np.array([(1.3 * 0.1 / 0.5, 0), (1.4, 0)]))
    assert velocities(bodies, wishes, ALONE[:2], MOUSSAID, walls_of([]), 0.3)[1] == pytest.approx((1.5, 0))


def test_two_that_meet_turn_to_their_own_sides_and_slow_down():
    f = forces(
        bodies_of([(-1, 0.1), (1, -0.1)], [(1, 0), (-1, 0)]),
        wishes_of([(1, 0), (-1, 0)]),
        ALONE[:2],
        MOUSSAID,
        walls_of([]),
    )
    assert f[0] == pytest.approx(-f[1], abs=1e-12)
    assert f[0, 0] < 0.0 < f[0, 1]


def test_both_sides_of_a_corridor_are_felt_and_a_corner_once():
    """A room seen from inside is one polygon, clockwise: between its long walls all is even; its corner is felt from both walls."""
    wishes = wishes_of([(0, 0)])
    room = walls_of([[(0, 0), (0, 2), (9, 2), (9, 0)]])
    assert forces(bodies_of([(4.5, 1.0)]), wishes, ALONE[:1], MOUSSAID, room) == pytest.approx(
        np.zeros((1, 2)), abs=1e-9
    )
    corner = forces(bodies_of([(0.4, 0.4)]), wishes, ALONE[:1], MOUSSAID, room)[0]
    assert corner == pytest.approx(np.full(2, 3.0 * np.exp(-1.5)), abs=1e-5)
    post = walls_of([[(0, 0), (-1, 1), (-2, -2), (1, -1)]])  # its corner, from outside
    away = forces(bodies_of([(0.3, 0.3)]), wishes, ALONE[:1], MOUSSAID, post)[0]
    assert np.hypot(*away) == pytest.approx(3.0 * np.exp((0.25 - 0.3 * np.sqrt(2)) / 0.1), rel=1e-6)


@pytest.mark.parametrize("off", [1e-9, 1e-5, 1e-3])
def test_who_walks_inside_a_broad_body_is_pushed_by_a_number(off):
    """The discs of two beds overlap there, and D, the relative velocity and the direction to the other in one, is next to nothing."""
    bodies = bodies_of([(0, 0), (0.7, 0)], [(-0.5 + off, 0), (0, 0)])
    bodies.radius[1] = 1.15
    force = forces(bodies, wishes_of([(1, 0)]), ALONE[:2], MOUSSAID, walls_of([]))
    assert np.abs(force).max() < 1e6  # NaN becomes more


def test_a_broad_body_is_felt_from_its_edge():
    """A bed of 1 m radius at 2 m is as near as a person at 2 - (1.25 - 0.6) m."""
    far = bodies_of([(0, 0), (2, 0.3)], [(1, 0), (0, 0)], [0.25, 1.0])
    direction = far.position[1] / np.hypot(*far.position[1])
    near = bodies_of([(0, 0), far.position[1] - 0.65 * direction], [(1, 0), (0, 0)])
    wishes, nothing = wishes_of([(1, 0), (0, 0)]), walls_of([])
    assert forces(far, wishes, ALONE[:2], MOUSSAID, nothing) == pytest.approx(
        forces(near, wishes, ALONE[:2], MOUSSAID, nothing), abs=1e-9
    )  # fmt: skip


@given(crowds())
def test_what_people_do_to_each_other_adds_up_to_nothing(crowd):
    n = len(crowd[0].radius)
    assert np.abs(forces(*crowd, ALONE[:n], MOUSSAID, walls_of([])).sum(0)).max() < 1e-9


@given(crowds(), st.data())
def test_the_order_of_bodies_changes_no_bit(crowd, data):
    n = len(crowd[0].radius)
    order = data.draw(st.permutations(range(n)))
    group = np.array(data.draw(st.lists(st.integers(-1, 1), min_size=n, max_size=n)))
    here = velocities(*crowd, group, MOUSSAID, walls_of(POLYGONS), 0.1)
    there = velocities(*reordered(*crowd, order), group[order], MOUSSAID, walls_of(POLYGONS), 0.1)
    assert np.array_equal(there, here[order])


@given(crowds(), st.data())
def test_a_mirrored_crowd_goes_mirrored_ways(crowd, data):
    n = len(crowd[0].radius)
    group = np.array(data.draw(st.lists(st.integers(-1, 1), min_size=n, max_size=n)))
    polygons = [np.array(p)[::-1] * (1, -1) for p in POLYGONS]
    here = velocities(*crowd, group, MOUSSAID, walls_of(POLYGONS), 0.1)
    there = velocities(*mirrored(*crowd), group, MOUSSAID, walls_of(polygons), 0.1)
    assert np.abs(there - here * (1, -1)).max() < 1e-9


@given(crowds(), st.integers(0, 2**32 - 1))
def test_who_overlooks_a_layer_walks_as_if_nobody_were_on_it(crowd, seed):
    bodies, wishes = crowd
    n = len(bodies.radius)
    layer = np.random.default_rng(seed).integers(1, 3, n)
    blind = velocities(bodies._replace(layer=layer), wishes, ALONE[:n], MOUSSAID, walls_of([]), 0.1)
    for i in range(n):
        seen = (layer == 1) | (np.arange(n) == i)
        alone = velocities(
            bodies_of(bodies.position[seen], bodies.velocity[seen], bodies.radius[seen]),
            wishes_of(wishes.velocity[seen]), ALONE[: seen.sum()], MOUSSAID, walls_of([]), 0.1,
        )  # fmt: skip
        assert np.array_equal(alone[int(seen[:i].sum())], blind[i])


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.sampled_from((0.05, 0.1, 0.25)))
def test_nobody_passes_through_anybody(seed, n, period):
    """Across a circle, none exactly opposite: the model knows no bodies, so discs may touch; centres keep well apart."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n
    start = 6.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    bodies, nothing = bodies_of(start), walls_of([])
    for _ in range(int(12.0 / period)):
        wishes = wishes_of(towards(-start, bodies.position, 1.2, period))
        velocity = velocities(bodies, wishes, ALONE[:n], MOUSSAID, nothing, period)
        assert least_gap(bodies, velocity, period) > -0.4
        bodies = bodies._replace(position=bodies.position + velocity * period, velocity=velocity)


def test_those_of_a_group_stay_together():
    """Three that start apart with one wish walk side by side or behind one another; without a group they keep their distance."""
    start, nothing = np.array([(0, 0), (0, 3), (-2, 1.5)], float), walls_of([])
    spread = []
    for group in (np.zeros(3, np.int64), ALONE[:3]):
        bodies = bodies_of(start)
        for _ in range(100):
            velocity = velocities(bodies, wishes_of(np.tile((1.2, 0.0), (3, 1))), group, MOUSSAID, nothing, 0.1)
            bodies = bodies._replace(position=bodies.position + velocity * 0.1, velocity=velocity)
        spread.append(np.hypot(*(bodies.position - bodies.position.mean(0)).T).max())
    assert spread[0] < 1.3 < 1.6 < spread[1]


def test_a_group_is_not_drawn_through_a_wall():
    """Each of a pair has a wall before it, behind which the other stands; once around its end they come together."""
    wall = walls_of([[(-0.1, -2.0), (0.1, -2.0), (0.1, 2.0), (-0.1, 2.0)]])
    pair = np.zeros(2, np.int64)
    for y, drawn in ((0.0, False), (2.5, True)):
        bodies, wishes = bodies_of([(-1.2, y), (1.2, y)]), wishes_of([(0, 0), (0, 0)])
        together, apart = (forces(bodies, wishes, group, MOUSSAID, wall) for group in (pair, ALONE[:2]))
        assert together[:, 0] - apart[:, 0] == pytest.approx([3.0, -3.0] if drawn else [0.0, 0.0])

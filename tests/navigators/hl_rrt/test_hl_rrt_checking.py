"""Edges are judged rightly, once, at present positions; a blocked one costs its subtree, which mends lazily."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clearway.navigators.hl_rrt import checking as c
from clearway.navigators.hl_rrt import tree as t

HALF = 3.5


def distance(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """From p to the segment a-b, sampled finely: an upper bound, less than 1e-3 too large here."""
    along = a + np.linspace(0, 1, 400)[:, None] * (b - a)
    return float(np.hypot(*(along - p).T).min())


coordinate = st.floats(-3, 3)
disc = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.05, 1.5))


@given(st.lists(disc, max_size=12), coordinate, coordinate, coordinate, coordinate)
def test_edges_against_brute_force(discs, ax, ay, bx, by) -> None:  # type: ignore[no-untyped-def]
    discs = np.array([d for d in discs if math.hypot(d[0], d[1]) > d[2]]).reshape(-1, 3)
    scene = c.look(discs, 0.0, 0.0, HALF, 0.5)
    a, b = np.array((ax, ay)), np.array((bx, by))
    gaps = [distance(d[:2], a, b) - d[2] for d in discs]
    ends = [math.dist(d[:2], b) - d[2] for d in discs]
    state = c.edge(scene, ax, ay, bx, by)
    if gaps and min(gaps) < -1e-3:
        assert state != c.FREE
    if not gaps or min(gaps) > 2e-3:
        assert state == c.FREE
    if ends and min(ends) < -1e-9:
        assert state == c.INSIDE
    if not ends or min(ends) > 1e-9:
        assert state != c.INSIDE


def test_a_robot_inside_a_disc_may_leave_it_but_not_go_deeper() -> None:
    scene = c.look(np.array(((0.5, 0.0, 0.8), (0.0, 2.0, 0.3))), 0.0, 0.0, HALF, 0.5)
    assert scene.discs[0, 2] == 0.5
    assert c.edge(scene, 0.0, 0.0, -0.5, 0.0) == c.FREE
    assert c.edge(scene, 0.0, 0.0, 0.0, 0.5) == c.FREE
    assert c.edge(scene, 0.0, 0.0, 0.3, 0.0) == c.INSIDE
    assert c.edge(scene, 0.0, 0.0, 1.2, 0.0) == c.BLOCKED


def test_discs_out_of_reach_are_left_out() -> None:
    scene = c.look(np.array(((4.0, 0.0, 0.4), (4.0, 0.0, 0.6), (0.0, -9.0, 0.2))), 0.0, 0.0, HALF, 0.5)
    assert scene.discs.tolist() == [[4.0, 0.0, 0.6]]


def ladder() -> t.Tree:
    """0 - 1 - 2 - 3 along y = 0 in steps of 0.5, and a node 4 beside 2, reached from the root by a way of its own."""
    tree = t.make_tree(16, HALF, 0.5)
    t.plant(tree, 0.0, 0.0)
    for k in range(3):
        t.insert(tree, 0.5 * (k + 1), 0.0, k)
    t.insert(tree, 0.7, 0.5, 0)
    return tree


def test_a_blocked_edge_is_cut_and_its_subtree_re_parented() -> None:
    tree, checked = ladder(), c.make_checked(64)
    scene = c.look(np.array(((0.75, -0.05, 0.15),)), 0.0, 0.0, HALF, 0.5)  # between nodes 1 and 2
    found, queue = np.zeros(16, np.int64), np.zeros(16, np.int64)
    assert c.first_blocked(checked, 1, tree, scene, 3) == 2
    c.cut(checked, 1, tree, 2, 0.7, found, queue)
    assert t.path(tree, 3).tolist() == [0, 4, 2, 3]  # not 1 - 2 again: that edge is known
    assert tree.cost[3] == math.hypot(0.7, 0.5) + math.hypot(0.3, 0.5) + 0.5
    assert c.first_blocked(checked, 1, tree, scene, 3) == -1


def test_without_another_way_the_subtree_costs_infinity() -> None:
    tree, checked = ladder(), c.make_checked(64)
    scene = c.look(np.array(((0.75, -0.05, 0.15),)), 0.0, 0.0, HALF, 0.5)
    assert c.first_blocked(checked, 1, tree, scene, 3) == 2
    c.cut(checked, 1, tree, 2, 0.51, np.zeros(16, np.int64), np.zeros(16, np.int64))
    assert tree.cost[1:5].tolist() == [0.5, math.inf, math.inf, math.hypot(0.7, 0.5)]
    assert tree.parent[3] == 2  # still below it, to come back with it


def test_a_node_inside_an_obstacle_is_out_and_its_children_look_for_themselves() -> None:
    tree, checked = ladder(), c.make_checked(64)
    scene = c.look(np.array(((1.0, -0.1, 0.2),)), 0.0, 0.0, HALF, 0.5)  # on node 2
    assert c.first_blocked(checked, 1, tree, scene, 3) == 2
    assert tree.blocked[2] == 1
    c.cut(checked, 1, tree, 2, 0.95, np.zeros(16, np.int64), np.zeros(16, np.int64))
    assert tree.cost[2] == math.inf
    assert tree.parent[3] == 4


def test_what_was_checked_is_remembered_within_a_tick_only() -> None:
    tree, checked = ladder(), c.make_checked(64)
    blocked = c.look(np.array(((0.75, -0.05, 0.15),)), 0.0, 0.0, HALF, 0.5)
    free = c.look(np.empty((0, 3)), 0.0, 0.0, HALF, 0.5)
    assert c.known(checked, 1, tree, 1, 2) == -1
    assert c.check(checked, 1, tree, blocked, 1, 2) == c.BLOCKED
    assert c.check(checked, 1, tree, free, 1, 2) == c.BLOCKED  # not looked at again
    assert c.known(checked, 1, tree, 2, 1) == c.BLOCKED  # nor from the other side
    assert c.known(checked, 2, tree, 1, 2) == -1
    assert c.check(checked, 2, tree, free, 1, 2) == c.FREE


def test_a_full_table_does_not_keep_the_search_from_ending() -> None:
    tree, checked = ladder(), c.make_checked(1)
    scene = c.look(np.array(((0.75, -0.05, 0.15),)), 0.0, 0.0, HALF, 0.5)
    c.check(checked, 1, tree, scene, 0, 4)  # takes the only slot
    assert c.first_blocked(checked, 1, tree, scene, 3) == 2
    c.cut(checked, 1, tree, 2, 0.51, np.zeros(16, np.int64), np.zeros(16, np.int64))
    assert tree.cost[2] == math.inf

"""The tree keeps its invariants, whatever is done to it; forward pruning keeps the descendants and nothing else."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.navigators.hl_rrt import tree as t

HALF, CAPACITY = 3.0, 24
places = st.tuples(st.floats(-2, 2), st.floats(-2, 2))
operations = st.lists(
    st.tuples(st.sampled_from(["insert", "replace", "reparent", "detach", "advance"]), places, st.integers(0, 10**6)),
    max_size=60,
)


def count(tree: t.Tree) -> int:
    return int(tree.meta[0])


def ancestors(tree: t.Tree, node: int) -> list[int]:
    way = [node]
    while tree.parent[way[-1]] >= 0:
        way.append(int(tree.parent[way[-1]]))
        assert len(way) <= count(tree), "a cycle"
    return way


def check(tree: t.Tree) -> None:
    n = count(tree)
    assert tree.parent[0] == -1
    assert tree.cost[0] == 0.0
    assert len(set(tree.name[:n].tolist())) == n
    for node in range(n):
        way = ancestors(tree, node)
        edges = [math.dist(tree.position[a], tree.position[b]) for a, b in itertools.pairwise(way)]
        assert tree.cost[node] == (pytest.approx(sum(edges), abs=1e-12) if way[-1] == 0 else math.inf)
        children, child, before = [], int(tree.child[node]), -1
        while child >= 0:
            assert tree.before[child] == before
            children.append(child)
            before, child = child, int(tree.after[child])
        assert sorted(children) == [k for k in range(n) if tree.parent[k] == node]
    listed = []
    for (row, column), head in np.ndenumerate(tree.head):
        node = int(head)
        while node >= 0:
            low = tree.frame[:2] + tree.frame[2] * np.array((column, row))
            assert (tree.position[node] >= low - 1e-9).all()
            assert (tree.position[node] <= low + tree.frame[2] + 1e-9).all()
            listed.append(node)
            node = int(tree.following[node])
    assert sorted(listed) == list(range(n))


def apply(tree: t.Tree, what: str, place: tuple[float, float], pick: int) -> None:
    n = count(tree)
    connected = [k for k in range(n) if tree.cost[k] < math.inf]
    some = connected[pick % len(connected)]
    if what == "insert":
        assert t.insert(tree, *place, some) == (n if n < CAPACITY else -1)
    elif what == "replace":
        leaves = [k for k in range(1, n) if tree.child[k] < 0 and k != some]
        if leaves:
            t.replace_leaf(tree, leaves[pick % len(leaves)], *place, some)
    elif what == "detach" and n > 1:
        t.detach(tree, 1 + pick % (n - 1))
    elif what == "reparent" and n > 1:
        node = 1 + pick % (n - 1)
        if node not in ancestors(tree, some):
            t.reparent(tree, node, some)
    elif what == "advance":
        t.advance(tree, some, *place, 1.5 * HALF)


@given(operations)
def test_invariants_hold_after_every_operation(todo: list[tuple[str, tuple[float, float], int]]) -> None:
    tree = t.make_tree(CAPACITY, 2 * HALF, 0.5)
    t.plant(tree, 0.0, 0.0)
    for what, place, pick in todo:
        apply(tree, what, place, pick)
        check(tree)


@given(operations, places, st.integers(0, 10**6), st.floats(0.2, 8.0))
def test_forward_pruning_keeps_exactly_the_descendants(todo, place, pick, half) -> None:  # type: ignore[no-untyped-def]
    tree = t.make_tree(CAPACITY, 2 * HALF, 0.5)
    t.plant(tree, 0.0, 0.0)
    for what, at, k in todo:
        apply(tree, what, at, k)
    connected = [k for k in range(count(tree)) if tree.cost[k] < math.inf]
    executed = connected[pick % len(connected)]
    expected = set()
    for node in range(count(tree)):
        way = ancestors(tree, node)
        if executed in way:
            below = way[: way.index(executed)]
            if all(math.dist(tree.position[k], place) <= half for k in below):
                expected.add((int(tree.name[node]), *tree.position[node].tolist()) if node != executed else "root")
    order = t.advance(tree, executed, *place, half)
    check(tree)
    assert len(order) == count(tree)
    assert tree.position[0].tolist() == list(place)
    found = {(int(tree.name[k]), *tree.position[k].tolist()) for k in range(1, count(tree))} | {"root"}
    assert found == expected


def test_costs_are_shifted_to_the_new_root() -> None:
    tree = t.make_tree(8, HALF, 0.5)
    t.plant(tree, 0.0, 0.0)
    a = t.insert(tree, 1.0, 0.0, 0)
    b = t.insert(tree, 1.0, 1.0, a)
    t.insert(tree, -1.0, 0.0, 0)
    order = t.advance(tree, 0, 0.25, 0.0, HALF)  # on the way: no node is behind yet
    assert tree.cost[:4].tolist() == [0.0, *([0.75, 1.75, 1.25] if order[1] == a else [1.25, 0.75, 1.75])]
    a = int(np.flatnonzero(order == a)[0])
    t.advance(tree, a, 1.0, 0.25, HALF)  # a is executed: only b is below it
    assert count(tree) == 2
    assert tree.cost[:2].tolist() == [0.0, 0.75]
    assert b == 2


@given(st.lists(places, min_size=1, max_size=20), places, st.floats(0.05, 3.0))
def test_nearest_and_neighbours_against_brute_force(points, query, radius) -> None:  # type: ignore[no-untyped-def]
    tree = t.make_tree(CAPACITY, HALF, 0.5)
    t.plant(tree, 0.1, 0.2)
    for x, y in points:
        t.insert(tree, x, y, 0)
    if len(points) > 2:
        t.detach(tree, 2)
    n = count(tree)
    distance = np.hypot(*(tree.position[:n] - query).T)
    usable = np.where(tree.cost[:n] < np.inf, distance, np.inf)
    assert usable[t.nearest(tree, *query)] == pytest.approx(usable.min(), abs=1e-12)
    found = np.zeros(CAPACITY, np.int64)
    within = set(found[: t.neighbours(tree, *query, radius, found)].tolist())
    assert within >= set(np.flatnonzero(distance < radius - 1e-9).tolist())
    assert within <= set(np.flatnonzero(distance < radius + 1e-9).tolist())


def test_a_path_is_restored_as_it_was_unless_a_node_of_it_is_gone() -> None:
    tree = t.make_tree(8, HALF, 0.5)
    t.plant(tree, 0.0, 0.0)
    a = t.insert(tree, 0.5, 0.0, 0)
    b = t.insert(tree, 1.0, 0.0, a)
    c = t.insert(tree, 0.5, 0.5, 0)
    nodes = t.path(tree, b)
    names = tree.name[nodes]
    t.reparent(tree, b, c)
    t.reparent(tree, a, b)  # upside down
    assert t.restore(tree, nodes, names)
    check(tree)
    assert t.path(tree, b).tolist() == [0, a, b]
    assert tree.cost[b] == 1.0
    t.replace_leaf(tree, b, 1.0, 0.0, a)  # another node in the same slot
    assert not t.restore(tree, nodes, names)

"""Ways are told apart by how they pass an obstacle, and only by that."""

from __future__ import annotations

import numpy as np
import pytest
from space_time_scenes import OTHER, finder, line

from clearway.navigators.hp_st.environment.contact import PredictedObstacles
from clearway.navigators.hp_st.search.candidates import _differ, _rounds, _see, by_first_step
from clearway.navigators.hp_st.search.tree import TOTAL, Tree


def test_left_and_right_of_what_stands() -> None:
    found = finder()
    found.look((4.0, 0.0), still=[(1.5, 0.05, OTHER)])
    ways = found.ways()
    sides = [float(np.sign(w[np.argmin(np.abs(w[:, 0] - 1.5)), 1] - 0.05)) for w in ways if w[-1, 0] > 1.8]
    assert len(ways) >= 2
    assert {-1.0, 1.0} == set(sides)


def test_before_and_after_what_crosses() -> None:
    """The better one first; what waits, or turns back, does not cross at all."""
    both = 0
    for y in (-1.6, -1.65, -1.7, -1.75, -1.8):
        found, moving_obstacle = finder(), line(1.5, y, 0.0, 1.0)
        found.look((4.0, 0.0), moving_obstacles=[moving_obstacle])
        first = []
        for way in found.ways():
            crossing = np.flatnonzero(way[:, 0] >= 1.5)
            if len(crossing):
                first.append(bool(moving_obstacle(crossing[0] * found.costs.step)[1] < way[crossing[0], 1]))
        both += set(first) == {True, False}
    assert both >= 4


def test_bearings_turn_as_the_sum_of_their_steps_says() -> None:
    """Twice around one that stands, either way, and past one that moves; the bearing comes past west on the way."""
    k = np.arange(21)
    for sense in (1.0, -1.0):
        round_it = np.column_stack((np.cos(0.7 * k), sense * np.sin(0.7 * k)))
        tree = Tree(
            np.zeros((21, 1, 7)), np.zeros((21, 1), np.int64), np.zeros((21, 1, 2)), np.ones(21, np.int64), np.array((-1.0, -1.0, np.inf))
        )  # fmt: skip
        tree.nodes[:, 0, :2] = round_it
        at = np.column_stack((0.3 * k - 2.0, 0.1 * k))[:, None]
        seen = PredictedObstacles(
            np.array([(0.1, -0.2, 0.3), (5.0, 5.0, 0.3)]),
            at,
            np.ones((21, 1)),
            np.ones(1),
            np.ones(1),
            np.ones((21, 1)),
        )
        last, rounds = np.empty((3, 2)), _rounds(tree, seen, 1, 20, 0, 20)[20, 0]
        _see(tree, seen, 1, 20, 0, last)
        paths = [seen.still[0, :2] - round_it, seen.still[1, :2] - round_it, at[:, 0] - round_it]
        steps = [np.angle((p[1:, 0] + 1j * p[1:, 1]) / (p[:-1, 0] + 1j * p[:-1, 1])).sum() for p in paths]
        begun = [np.arctan2(*p[0, ::-1]) for p in paths]
        turned = np.arctan2(last[:, 1], last[:, 0]) - begun + 2.0 * np.pi * rounds
        assert turned == pytest.approx(steps, abs=1e-9)
        assert abs(turned[0]) > 4.0 * np.pi


def test_ways_differ_where_a_bearing_turns_farther_apart() -> None:
    """Against the difference of the turns themselves, for every pair of bearings and rounds."""
    angles = np.linspace(-np.pi + 0.01, np.pi - 0.02, 23)
    for apart in (0.5, 1.5, 4.0):
        for a in angles:
            for b in angles:
                for more in (-2, -1, 0, 1, 2):
                    off = abs(a - b + 2.0 * np.pi * more)
                    if abs(off - apart) < 1e-9:
                        continue
                    seen = [np.array([(0.3 * np.cos(t), 0.3 * np.sin(t))]) for t in (a, b)]
                    told = _differ(seen[0], np.array([more], np.int16), seen[1], np.array([0], np.int16), apart)
                    assert told == (off > apart)


def test_in_the_open_there_is_one() -> None:
    found = finder()
    found.look((2.5, 0.3))
    assert len(found.ways()) == 1
    found.look((2.5, 0.3), still=[(-3.0, 3.0, OTHER)])
    assert len(found.ways()) == 1


def test_no_more_than_asked_for() -> None:
    found = finder()
    found.look((4.0, 0.0), still=[(1.3, 0.3, OTHER), (1.3, -0.6, 0.2)])
    assert len(found.ways(1)) == 1
    assert len(found.ways(2)) == 2
    first = [w.tolist() for w in found.ways(1)] + [found.best()[0].tolist()]
    assert first[0] == first[1]


def test_of_each_first_step_the_best_end() -> None:
    found = finder()
    tree = found.look((4.0, 0.0), still=[(1.3, 0.0, OTHER)])
    ends = by_first_step(tree)
    last = len(tree.count) - 1
    first = []
    for layer, index in ends.tolist():
        assert layer == last
        at = index
        for k in range(last, 1, -1):
            at = int(tree.parent[k, at])
        first.append(at)
        rivals = [b for b in range(tree.count[last]) if began_with(tree, b) == at]
        assert tree.nodes[last, index, TOTAL] == min(tree.nodes[last, b, TOTAL] for b in rivals)
    assert sorted(first) == sorted({began_with(tree, b) for b in range(tree.count[last])})
    totals = [tree.nodes[layer, index, TOTAL] for layer, index in ends.tolist()]
    assert totals == sorted(totals)


def began_with(tree: Tree, index: int) -> int:
    """The node of the first layer from which one of the last comes."""
    for k in range(len(tree.count) - 1, 1, -1):
        index = int(tree.parent[k, index])
    return index

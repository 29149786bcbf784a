"""What stands is kept while the sensor looks away, dropped when it is seen to be gone, and jitters less than the scan."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.contract import Scan
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import rectangle
from clearway.perception.clusters import ClusterParameters, perceive
from clearway.perception.covering import cores
from clearway.perception.structure import StructureMemory

AHEAD = Scan(np.full(101, np.inf), -1.0, 0.02, 0.3, 10.0, np.zeros(3))  # sees from -1 to 1 rad
IDS = np.array([-9, -4, 6])
DISCS = np.array([[2.0, 0.0, 0.1], [0.0, 2.0, 0.1], [0.1, 0.0, 0.05]])  # ahead; to the left, out of view; too near
KNOWN = np.array([1, 0, 0], dtype=np.uint8)
NONE = (np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0, dtype=np.uint8))


def memory(seconds: float = 5.0, most: int = 300) -> StructureMemory:
    return StructureMemory(seconds, 0.01, 4.0, most)


def test_out_of_view_is_kept_for_a_while_and_in_view_it_must_be_seen() -> None:
    m = memory()
    assert m.update(IDS, DISCS, KNOWN, AHEAD, np.zeros(3), 0.0)[0].tolist() == [-9, -4, 6]
    for t in (0.1, 4.9):
        ids, discs, known = m.update(*NONE, AHEAD, np.zeros(3), t)
        assert ids.tolist() == [-4, 6]
        assert discs.tolist() == DISCS[1:].tolist()
        assert known.tolist() == [0, 0]
    assert len(m.update(*NONE, AHEAD, np.zeros(3), 5.2)[0]) == 0


def test_what_comes_into_view_and_is_not_there_has_gone() -> None:
    m = memory()
    m.update(IDS, DISCS, KNOWN, AHEAD, np.zeros(3), 0.0)
    assert m.update(*NONE, AHEAD, np.array([0.0, 0.0, math.pi / 2]), 0.1)[0].tolist() == [-9, 6]
    far = m.update(*NONE, AHEAD, np.array([-3.0, 0.0, math.pi]), 0.2)[0]  # 5 m from the first, 3.1 m from the last
    assert far.tolist() == [6]


def test_without_seconds_nothing_is_kept() -> None:
    m = memory(0.0)
    m.update(IDS, DISCS, KNOWN, AHEAD, np.zeros(3), 0.0)
    assert len(m.update(*NONE, AHEAD, np.zeros(3), 0.1)[0]) == 0


def test_the_oldest_give_way() -> None:
    m = memory(most=3)
    m.update(IDS, DISCS, KNOWN, AHEAD, np.zeros(3), 0.0)
    m.update(IDS[2:], DISCS[2:], KNOWN[2:], AHEAD, np.zeros(3), 1.0)
    new = np.array([-20, -21])
    ids, _, _ = m.update(new, np.full((2, 3), 1.0), np.ones(2, dtype=np.uint8), AHEAD, np.zeros(3), 1.1)
    assert ids.tolist() == [-21, -20, 6]


def test_noise_is_averaged_and_what_is_new_is_covered() -> None:
    rng = np.random.default_rng(0)
    m, seen = memory(), []
    for k in range(200):
        noisy = DISCS[:1] + np.array([[*rng.normal(0, 0.01, 2), 0.0]])
        _, discs, _ = m.update(IDS[:1], noisy, KNOWN[:1], AHEAD, np.zeros(3), 0.1 * k)
        seen.append(discs[0])
    assert np.std(seen, axis=0)[:2].max() < 0.005
    grown = np.array([[2.1, 0.0, 0.2]])
    _, discs, _ = m.update(IDS[:1], grown, KNOWN[:1], AHEAD, np.zeros(3), 20.1)
    assert np.hypot(*(discs[0] - grown[0])[:2]) + 0.2 <= discs[0, 2] + 2 * 0.01 + 1e-12


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4, 1.2])
def test_the_disc_inside_a_square_leaves_no_return_inside_and_lies_in_the_square(turn: float) -> None:
    """Of a square of 0.6 m at 2 m, however it is turned; it keeps a line through the square from looking free."""
    rays = beams(1000, -math.pi, math.pi * 0.998, 0.05, 20.0)
    ranges = sweep(scene([rectangle(0.6, 0.6)], np.array([[2.0, 0.0, turn]])), rays, np.zeros(3))
    scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 20.0, np.zeros(3))
    returns = perceive(scan, np.zeros(3), ClusterParameters())
    (core,) = cores(returns.points, returns.label, returns.circles, returns.sensor, np.array([0]))
    gaps = np.hypot(returns.points[:, 0] - core[0], returns.points[:, 1] - core[1])
    assert gaps.min() >= core[2] - 1e-9
    assert 0.18 < core[2] <= 0.31
    c, s = math.cos(turn), math.sin(turn)
    x, y = core[0] - 2.0, core[1]
    assert max(abs(c * x + s * y), abs(c * y - s * x)) + core[2] < 0.3 + 0.42 / 8  # a step of the push

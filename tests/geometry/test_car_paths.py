"""Dubins' and Reeds and Shepp's shortest paths: they end where they should, and are as long as OMPL's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.geometry.dubins import Pieces, along, changes, dubins, length, relative
from clearway.geometry.reeds_shepp import distance, reeds_shepp

POSES = np.random.default_rng(7).uniform((-6, -6, -math.pi), (6, 6, math.pi), (400, 3))
NEAR = POSES * (0.2, 0.2, 1.0)
PLAIN = np.array(
    [(x, y, yaw) for x in (-3.0, 0.0, 0.5, 4.0) for y in (-2.0, 0.0, 1.0) for yaw in (-math.pi / 2, 0.0, 1.0, math.pi)]
)


@pytest.mark.parametrize("paths", [dubins, reeds_shepp])
@pytest.mark.parametrize("poses", [POSES, NEAR, PLAIN], ids=["far", "near", "plain"])
def test_paths_end_where_they_should(paths, poses) -> None:
    for x, y, yaw in poses:
        pieces = paths(x, y, yaw)
        ex, ey, end = along(pieces, length(pieces))
        assert (ex, ey) == (pytest.approx(x, abs=1e-6), pytest.approx(y, abs=1e-6))
        assert math.cos(end - yaw) == pytest.approx(1.0, abs=1e-11)


@pytest.mark.parametrize("model", ["dubins", "reeds_shepp"])
def test_lengths_against_ompl(model: str) -> None:
    base = pytest.importorskip("ompl.base")
    radius = 0.7
    space = base.DubinsStateSpace(radius) if model == "dubins" else base.ReedsSheppStateSpace(radius)
    start, end = space.allocState(), space.allocState()
    rng = np.random.default_rng(1)
    ours, theirs = [], []
    for x, y, yaw in np.concatenate((POSES, NEAR, PLAIN)):
        pose = (*rng.uniform(-3, 3, 2), rng.uniform(-3, 3))
        for state, (sx, sy, syaw) in ((start, pose), (end, (x, y, yaw))):
            state.setX(sx)
            state.setY(sy)
            state.setYaw(syaw)
        theirs.append(space.distance(start, end))
        seen = relative(*pose, x, y, yaw, radius)
        ours.append(radius * (length(dubins(*seen)) if model == "dubins" else distance(*seen)))
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_the_way_along_is_continuous_and_turns_no_tighter_than_the_circle() -> None:
    for x, y, yaw in NEAR[:60]:
        pieces = reeds_shepp(x, y, yaw)
        assert length(pieces) == pytest.approx(distance(x, y, yaw), abs=1e-12)
        at = np.array([along(pieces, d) for d in np.linspace(0, length(pieces), 400)])
        step = length(pieces) / 399
        assert np.hypot(*np.diff(at[:, :2], axis=0).T).max() <= step * (1 + 1e-9)
        assert np.abs(np.diff(at[:, 2])).max() <= step * (1 + 1e-9)


def test_known_paths() -> None:
    assert length(dubins(3.0, 0.0, 0.0)) == pytest.approx(3.0)  # no loop from rounding
    assert length(dubins(3.0, 0.0, -1e-12)) == pytest.approx(3.0)
    assert length(dubins(0.0, 2.0, math.pi)) == pytest.approx(math.pi)
    assert length(reeds_shepp(-3.0, 0.0, 0.0)) == pytest.approx(3.0)
    turn = reeds_shepp(0.0, 0.0, math.pi)  # half a turn on the spot: three arcs of 60 degrees
    assert length(turn) == pytest.approx(math.pi)
    assert changes(turn) == 2


def test_changes_of_direction_are_counted_over_pieces_that_are_there() -> None:
    assert changes(Pieces(1.0, 0.0, -1.0, 0.0, 2.0, 1.0, 0.0, 1.0, 0.0, 1.0)) == 2
    assert changes(dubins(1.0, 5.0, 2.0)) == 0
    assert changes(reeds_shepp(-3.0, 0.0, 0.0)) == 0

"""Samples come from where they should, as often as they should."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.geometry.streams import stream
from clearway.navigators.hl_rrt import sampling as s

SHARES = np.cumsum([0.10, 0.25, 0.10, 0.35])
N = 20_000
AREA = np.array((0.0, 0.0, 4.0, 14.0))


def source(**change: object) -> s.Source:
    root = np.array((2.0, 2.0))
    covariance = np.array(((0.04, 0.03, 0.09), (0.01, 0.0, 0.01)))
    fields = {
        "root": root, "goal": np.array((2.0, 12.0)), "horizon": 3.0, "cone": math.pi / 3, "shares": SHARES,
        "box": s.window(root, 3.0, AREA), "waypoints": np.array(((1.0, 3.0), (1.5, 4.0), (2.0, 4.5))),
        "steps": np.array((0.25, 1.0)), "mean": np.array(((1.0, 2.0), (3.0, 4.0))), "root_of": s.cholesky(covariance),
    }  # fmt: skip
    return s.Source(**(fields | change))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def samples() -> dict[int, np.ndarray]:
    drawn = np.array([s.draw(source(), stream(1, "test"), 7, i) for i in range(N)])
    return {kind: drawn[drawn[:, 2] == kind, :2] for kind in range(5)}


@pytest.mark.parametrize(("kind", "share"), list(enumerate((0.10, 0.25, 0.10, 0.35, 0.20))))
def test_shares(samples: dict[int, np.ndarray], kind: int, share: float) -> None:
    spread = math.sqrt(share * (1 - share) / N)
    assert len(samples[kind]) / N == pytest.approx(share, abs=4 * spread)


def test_goal_samples_are_the_goal(samples: dict[int, np.ndarray]) -> None:
    assert (samples[s.GOAL] == (2.0, 12.0)).all()


def test_horizon_samples_fill_the_annulus_within_the_cone(samples: dict[int, np.ndarray]) -> None:
    dx, dy = (samples[s.HORIZON] - (2.0, 2.0)).T
    r, off = np.hypot(dx, dy), np.arctan2(dx, dy)  # the goal lies along y
    assert 1.5 <= r.min() < 1.51
    assert 2.99 < r.max() <= 3.0
    assert math.pi / 3 - 0.02 < abs(off).max() <= math.pi / 3 + 1e-9
    assert np.mean(r < math.sqrt((1.5**2 + 3.0**2) / 2)) == pytest.approx(0.5, abs=0.03)  # by area
    assert np.mean(off) == pytest.approx(0.0, abs=0.03)


def test_horizon_samples_end_at_a_goal_that_is_near() -> None:
    near = source(goal=np.array((2.0, 3.0)), shares=np.array((0.0, 1.0, 1.0, 1.0)))
    drawn = np.array([s.draw(near, stream(1, "test"), 0, i)[:2] for i in range(500)])
    assert np.hypot(*(drawn - (2.0, 2.0)).T).max() <= 1.0 + 1e-12


def test_cache_samples_are_the_waypoints_evenly(samples: dict[int, np.ndarray]) -> None:
    points, counts = np.unique(samples[s.CACHE], axis=0, return_counts=True)
    assert points.tolist() == [[1.0, 3.0], [1.5, 4.0], [2.0, 4.5]]
    assert counts / counts.sum() == pytest.approx(1 / 3, abs=0.05)


def test_mixture_samples_have_its_moments(samples: dict[int, np.ndarray]) -> None:
    drawn = samples[s.MIXTURE]
    first = drawn[np.hypot(*(drawn - (1.0, 2.0)).T) < np.hypot(*(drawn - (3.0, 4.0)).T)]
    assert len(first) / len(drawn) == pytest.approx(0.25, abs=0.03)
    assert first.mean(0) == pytest.approx([1.0, 2.0], abs=0.03)
    assert np.cov(first.T) == pytest.approx(np.array(((0.04, 0.03), (0.03, 0.09))), abs=0.008)


def test_uniform_samples_fill_the_window_within_the_area(samples: dict[int, np.ndarray]) -> None:
    drawn = samples[s.UNIFORM]
    assert s.window(np.array((2.0, 2.0)), 3.0, AREA).tolist() == [0.0, 0.0, 4.0, 5.0]
    assert drawn.min(0) == pytest.approx([0.0, 0.0], abs=0.02)
    assert drawn.max(0) == pytest.approx([4.0, 5.0], abs=0.02)
    assert drawn.mean(0) == pytest.approx([2.0, 2.5], abs=0.08)


def test_an_empty_source_leaves_its_share_to_uniform() -> None:
    bare = source(waypoints=np.empty((0, 2)), steps=np.empty(0), mean=np.empty((0, 2)), root_of=np.empty((0, 3)))
    kinds = np.array([s.draw(bare, stream(1, "test"), 7, i)[2] for i in range(N)])
    assert np.mean(kinds == s.UNIFORM) == pytest.approx(0.65, abs=0.015)
    assert set(kinds.tolist()) == {s.GOAL, s.HORIZON, s.UNIFORM}


def test_a_robot_outside_the_area_still_samples_around_itself() -> None:
    assert s.window(np.array((9.0, 2.0)), 3.0, AREA).tolist() == [6.0, -1.0, 12.0, 5.0]


def test_a_full_cache_replaces_at_random() -> None:
    cache = s.WaypointCache(20, np.random.default_rng(3))
    cache.add(np.zeros((20, 2)))
    cache.add(np.ones((20, 2)))
    assert len(cache.points) == 20
    new = int((cache.points == 1.0).all(axis=1).sum())
    assert 6 <= new <= 18  # 20 (1 - (1 - 1/20)^20) = 12.8 expected
    cache.clear()
    assert len(cache.points) == 0

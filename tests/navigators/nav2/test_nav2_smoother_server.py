"""Nav2's smoother server and its simple smoother, which agrees with a second, plain reading on random paths and costmaps."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.navigators.nav2.behavior_tree.routes import SmoothRequest
from clearway.navigators.nav2.behavior_tree.servers import Error
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.servers import SmootherServer as Parameters
from clearway.navigators.nav2.seams import CostView
from clearway.navigators.nav2.simple_smoother import SimpleSmoother, smoothed
from clearway.navigators.nav2.smoother_server import SmootherServer

pytestmark = pytest.mark.slow  # compiles for long

ORIGIN = np.zeros(3)


def turn(a, b):
    return math.remainder(b - a, math.tau)


def plain(path, view, p):
    """The smoother, read once more: point by point, without a kernel."""

    def cell(x, y):
        column = int((x - view.origin[0]) / view.resolution) if x >= view.origin[0] else -1
        row = int((y - view.origin[1]) / view.resolution) if y >= view.origin[1] else -1
        inside = 0 <= row < view.cost.shape[0] and 0 <= column < view.cost.shape[1]
        return (row, column) if inside else None

    def oriented(poses):
        theta = math.atan2(poses[2][1] - poses[1][1], poses[2][0] - poses[1][0])
        back = abs(turn(poses[1][2], theta)) > math.pi / 2
        for a, b in pairwise(poses):
            if abs(b[0] - a[0]) >= 1e-4 or abs(b[1] - a[1]) >= 1e-4:
                a[2] = turn(0.0, math.atan2(b[1] - a[1], b[0] - a[0]) + (math.pi if back else 0.0))
        return poses

    def smooth(poses, refined):
        new = [list(q) for q in poses]
        last = [list(q) for q in poses]
        change, its, mine = p.tolerance, 0, 0
        while change >= p.tolerance:
            its, change = its + 1, 0.0
            if its >= p.max_its:
                return oriented(last)
            for i in range(1, len(poses) - 1):
                for j in (0, 1):
                    old = new[i][j]
                    new[i][j] = (
                        old + p.w_data * (poses[i][j] - old) + p.w_smooth * (new[i + 1][j] + new[i - 1][j] - 2 * old)
                    )
                    change += abs(new[i][j] - old)
                if (at := cell(*new[i][:2])) is not None:
                    mine = view.cost[at]
                if 252 < mine != 255:
                    return oriented(last)
            last = [list(q) for q in new]
        if p.do_refinement and refined < p.refinement_num:
            new = smooth(new, refined + 1)
        return oriented(new)

    poses = [list(map(float, q)) for q in path]
    ends = [0]
    if p.enforce_path_inversion:
        for i in range(1, len(poses) - 1):
            a, b, c = poses[i - 1 : i + 2]
            if (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0:
                ends.append(i)
            if abs(c[0] - b[0]) < 1e-4 and abs(c[1] - b[1]) < 1e-4 and abs(turn(b[2], c[2])) > 1e-4:
                ends.append(i)
    ends.append(len(poses) - 1)
    for begin, end in pairwise(ends):
        if end - begin > 3:
            poses[begin : end + 1] = smooth(poses[begin : end + 1], 0)
    return np.array(poses)


def view_of(rng, share):
    cost = np.where(rng.random((60, 60)) < share, 254, 0).astype(np.uint8)
    cost[rng.random((60, 60)) < share] = 255
    return CostView(
        cost, np.array((-1.5, -1.5)), 0.05, np.array(((0.1, 0.1), (0.1, -0.1), (-0.1, 0.0))), 0.1, 0.15, 3.0, 0.5, True,
        False,
    )  # fmt: skip


def wiggly(rng):
    """A path that turns here and there, sometimes back or in place."""
    n = int(rng.integers(2, 40))
    heading = np.cumsum(rng.normal(0.0, 0.4, n)) + np.where(rng.random(n) < 0.05, math.pi, 0.0)
    steps = np.where(rng.random(n) < 0.1, 0.0, 0.05)
    path = np.stack((np.cumsum(steps * np.cos(heading)), np.cumsum(steps * np.sin(heading)), heading), axis=1)
    if rng.random() < 0.3:
        path[:, 2] += math.pi  # driven backwards
    path[:, 2] = np.remainder(path[:, 2] + math.pi, math.tau) - math.pi
    return path


@pytest.mark.parametrize("seed", range(60))
def test_it_smooths_as_the_plain_reading_does(seed):
    rng = np.random.default_rng(seed)
    p = SimpleSmoother(
        tolerance=float(rng.choice((1e-10, 1e-3))),
        max_its=int(rng.choice((1, 2, 5, 60))),
        w_data=float(rng.choice((0.2, 0.05))),
        do_refinement=bool(rng.random() < 0.7),
        refinement_num=int(rng.integers(0, 4)),
        enforce_path_inversion=bool(rng.random() < 0.5),
    )
    view, path = view_of(rng, float(rng.choice((0.0, 0.01, 0.05)))), wiggly(rng)
    before = path.copy()
    found, wanted = smoothed(path, view, p), plain(path, view, p)
    assert np.array_equal(path, before)
    assert np.allclose(found[:, :2], wanted[:, :2], rtol=0.0, atol=1e-12)
    assert max(abs(turn(a, b)) for a, b in zip(found[:, 2], wanted[:, 2], strict=True)) < 1e-6


def test_a_corner_becomes_round_and_the_ends_stay():
    ahead = np.arange(0.0, 1.0, 0.05)
    path = np.zeros((40, 3))
    path[:20, 0], path[20:, 0], path[20:, 1], path[20:, 2] = ahead, 1.0, ahead, math.pi / 2
    new = smoothed(path, view_of(np.random.default_rng(0), 0.0), SimpleSmoother(refinement_num=5))
    assert np.array_equal(new[[0, -1], :2], path[[0, -1], :2])
    assert new[20, 0] < 0.95
    assert np.max(np.abs(np.diff(new[:, 2]))) < 0.25


def made(costmap, **table):
    return SmootherServer(settle(Parameters, table, "smoother_server", None), costmap)


def line(n=20):
    return np.stack((np.linspace(-0.9, 0.9, n), np.where(np.arange(n) % 2, 0.05, 0.0), np.zeros(n)), axis=1)


def test_a_path_is_smoothed_when_the_costmap_is_current_in_whatever_frame_that_is(costmap):
    frame, server = np.array((3.0, -2.0, 1.0)), made(costmap)
    costmap.current = False
    job = server.send(SmoothRequest(line(), "", False))
    server.think(ORIGIN)
    assert job.running
    costmap.current = True
    server.think(ORIGIN)
    assert job.succeeded
    assert np.ptp(job.result[3:-3, 1]) < 0.02
    c, s = math.cos(1.0), math.sin(1.0)
    there = line() @ np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) + frame
    other = server.send(SmoothRequest(there, "simple_smoother", False))
    server.think(frame)
    assert np.allclose(other.result[:, :2], job.result[:, :2] @ np.array(((c, s), (-s, c))) + frame[:2])
    gone = server.send(SmoothRequest(line(), "", False))
    server.cancel()
    server.think(ORIGIN)
    assert gone.running


@pytest.mark.parametrize(
    ("path", "name", "said"),
    [
        (line(), "route_smoother", "no smoother 'route_smoother'; smoother_server has 'simple_smoother'"),
        (line()[:0], "", "no path"),
    ],
)
def test_what_it_does_not_know_it_refuses(costmap, path, name, said):
    server = made(costmap)
    job = server.send(SmoothRequest(path, name, False))
    server.think(ORIGIN)
    assert job.error is Error.GOAL_REJECTED
    assert said in job.message


def test_a_smoothed_path_that_collides_is_refused_where_that_is_asked(costmap):
    server, row = made(costmap), costmap.cost.shape[0] // 2
    costmap.cost[row, row] = 254
    try:
        for checked, error in ((False, Error.NONE), (True, Error.SMOOTHED_PATH_IN_COLLISION)):
            job = server.send(SmoothRequest(line() + np.array((0.0, 0.15, 0.0)), "", checked))
            server.think(ORIGIN)
            assert job.error is error
    finally:
        costmap.cost[row, row] = 0
    far = server.send(SmoothRequest(line() + np.array((9.0, 0.0, 0.0)), "", True))
    server.think(ORIGIN)
    assert "collides at (8.10, 0.00)" in far.message


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"w_smooth": 0.5}, "w_data 0.2 \\+ 4 \\* w_smooth 0.5 is more than 2"),
        ({"max_its": 0}, "max_its"),
        ({"tolerance": 1}, "ROS takes a double here"),
    ],
)
def test_wrong_parameters_are_one_clear_error(table, said):
    given = {"smoother_plugins": ("mine",), "mine": {"plugin": "nav2_smoother::SimpleSmoother", **table}}
    with pytest.raises(ClearwayError, match=said):
        settle(Parameters, given, "smoother_server", None)

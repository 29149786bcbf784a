"""Nav2's path handler, goal checkers and progress checkers, against a plain reading and in the details that matter."""

from __future__ import annotations

import math

import following_oracle as plain
import numpy as np
import pytest

from clearway.navigators.nav2.goal_checkers import (
    PositionGoal,
    SimpleGoal,
    SimpleGoalChecker,
    StoppedGoal,
    make_goal_checker,
)
from clearway.navigators.nav2.path_handler import FeasiblePath, FeasiblePathHandler
from clearway.navigators.nav2.progress_checkers import PoseProgress, SimpleProgress, make_progress_checker
from clearway.navigators.nav2.seams import ControllerFailed, CostView, Velocity

REST = Velocity(0.0, 0.0, 0.0)


def view(rows: int = 60, columns: int = 60, origin: tuple[float, float] = (-1.5, -1.5)) -> CostView:
    square = np.array([(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)])
    return CostView(np.zeros((rows, columns), np.uint8), np.array(origin), 0.05, square, 0.1, 0.1414, 3.0, 0.5, True)


def winding_path(rng: np.random.Generator) -> np.ndarray:
    """A path that turns back and turns in place now and then."""
    x, y, yaw, way = 0.0, 0.0, rng.uniform(-3, 3), 1.0
    poses = [(x, y, yaw)]
    for _ in range(rng.integers(1, 120)):
        chance = rng.random()
        if chance < 0.03:
            way = -way
        if chance > 0.9:
            yaw += rng.normal(0.0, 0.5)
        else:
            yaw += rng.normal(0.0, 0.1)
            x, y = x + way * 0.05 * math.cos(yaw), y + way * 0.05 * math.sin(yaw)
        poses.append((x, y, yaw))
    return np.array(poses)


@pytest.mark.parametrize(("inversion", "rotation"), [(False, False), (True, False), (False, True), (True, True)])
def test_path_handler_against_a_plain_reading(inversion: bool, rotation: bool) -> None:
    rng = np.random.default_rng(11)
    shorter = passed = empty = 0
    for _ in range(40):
        path = winding_path(rng)
        prune, search = rng.uniform(0.1, 2.5), rng.choice((-1.0, 0.3, 1.0))
        p = FeasiblePath(
            prune_distance=prune,
            max_robot_pose_search_dist=search,
            enforce_path_inversion=inversion,
            enforce_path_rotation=rotation,
            minimum_rotation_angle=0.6,
        )
        handler = FeasiblePathHandler(p)
        oracle = plain.PlainHandler(prune, math.inf if search < 0 else search, inversion, rotation, 0.2, 0.4, 0.6)
        handler.set_plan(path)
        oracle.set_plan([tuple(row) for row in path.tolist()])
        frame = np.array((*rng.normal(0.0, 0.3, 2), rng.uniform(-3, 3)))
        c, s = math.cos(frame[2]), math.sin(frame[2])
        for k in range(0, len(path), 3):
            mx, my, yaw = path[k] + rng.normal(0.0, 0.03, 3)
            pose = np.array((frame[0] + c * mx - s * my, frame[1] + s * mx + c * my, yaw + frame[2]))
            origin = np.round((pose[:2] - 0.75) / 0.05) * 0.05
            seen = view(30, 30, tuple(origin))
            expected = oracle.local_plan(tuple(pose), tuple(frame), (1.5, 1.5), tuple(origin))
            if not expected:
                empty += 1
                with pytest.raises(ControllerFailed):
                    handler.local_plan(pose, frame, seen)
                continue
            found = handler.local_plan(pose, frame, seen)
            assert len(found) == len(expected)
            np.testing.assert_allclose(found[:, :2], np.array(expected)[:, :2], atol=1e-9)
            assert all(abs(plain.turn(a, b[2])) < 1e-9 for a, b in zip(found[:, 2], expected, strict=True))
            shorter += len(found) < len(path) - k
            passed += oracle.locale > 0
    assert shorter > 100
    assert (passed > 50) == (inversion or rotation)


def test_the_path_is_handed_on_up_to_its_cusp_until_the_robot_is_there() -> None:
    there = np.linspace(0.0, 1.0, 21)
    path = np.zeros((41, 3))
    path[:21, 0], path[20:, 0] = there, 1.0 - there
    handler = FeasiblePathHandler(FeasiblePath(enforce_path_inversion=True, max_robot_pose_search_dist=3.0))
    handler.set_plan(path)
    frame = np.zeros(3)
    assert handler.local_plan(np.array((0.3, 0.1, 0.0)), frame, view())[-1, 0] == pytest.approx(1.0)
    on = handler.local_plan(np.array((0.7, 0.0, 0.0)), frame, view())
    assert on[0, 0] == pytest.approx(0.7)
    assert len(on) == 7
    handler.local_plan(np.array((0.85, 0.0, 0.0)), frame, view())  # within 0.2 m
    assert handler.local_plan(np.array((0.85, 0.0, 0.0)), frame, view())[-1, 0] == pytest.approx(0.0)


def test_the_nearest_pose_is_looked_for_up_to_half_the_local_costmaps_side() -> None:
    for x, first in ((1.49, 1.49), (1.51, 0.0)):
        handler = FeasiblePathHandler(FeasiblePath())
        handler.set_plan(np.array(((0.0, 0.0, 0.0), (x, 0.0, 0.0), (x + 0.1, 0.0, 0.0))))
        found = handler.local_plan(np.array((x, 0.0, 0.0)), np.zeros(3), view(60, 60, (-1.0, -1.5)))
        assert found[0, 0] == pytest.approx(first)


def test_a_path_off_the_local_costmap_and_one_of_a_single_pose() -> None:
    handler = FeasiblePathHandler(FeasiblePath())
    handler.set_plan(np.array(((5.0, 0.0, 0.0), (6.0, 0.0, 0.0))))
    with pytest.raises(ControllerFailed, match="local costmap"):
        handler.local_plan(np.zeros(3), np.zeros(3), view())
    one = np.array(((0.5, 0.0, 0.0),))
    handler.set_plan(one)
    np.testing.assert_array_equal(handler.local_plan(np.zeros(3), np.zeros(3), view()), one)
    strict = FeasiblePathHandler(FeasiblePath(reject_unit_path=True))
    strict.set_plan(one)
    with pytest.raises(ControllerFailed, match="1 poses"):
        strict.local_plan(np.zeros(3), np.zeros(3), view())


@pytest.mark.parametrize("stateful", [True, False])
@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("buffer", [0.0, 0.2])
def test_goal_checker_against_a_plain_reading(stateful: bool, symmetric: bool, buffer: float) -> None:
    rng = np.random.default_rng(3)
    checker = SimpleGoalChecker(
        SimpleGoal(stateful=stateful, symmetric_yaw_tolerance=symmetric, xy_goal_tolerance_buffer=buffer)
    )
    oracle = plain.PlainGoalChecker(0.25, buffer, 0.25, 1.0, stateful, symmetric)
    goal = np.array((1.0, 2.0, 3.0))
    answers = []
    for k in range(600):
        if k % 50 == 0:
            checker.reset()
            oracle.check_xy = True
        pose = goal + np.array((*rng.normal(0.0, 0.3, 2), rng.choice((0.0, math.pi)) + rng.normal(0.0, 0.3)))
        left = rng.choice((0.5, 1.5), p=(0.8, 0.2))
        answers.append(checker.reached(pose, goal, REST, left))
        assert answers[-1] == oracle.reached(tuple(pose), tuple(goal), left)
        assert checker.tolerances().there == oracle.xy_reached(tuple(pose), tuple(goal), left)
    assert 20 < sum(answers) < 580


def test_the_stopped_robot_and_the_position_alone() -> None:
    goal = np.array((0.0, 0.0, 1.0))
    stopped, position = make_goal_checker(StoppedGoal()), make_goal_checker(PositionGoal(stateful=False))
    assert not stopped.reached(goal, goal, Velocity(0.2, 0.2, 0.0), 0.0)
    assert stopped.tolerances() == (0.25, 0.25, True)
    assert not stopped.reached(goal, goal, Velocity(0.0, 0.0, -0.3), 0.0)
    assert stopped.reached(goal, goal, Velocity(0.1, 0.1, 0.2), 0.0)
    assert position.reached(np.array((0.2, 0.0, -2.0)), goal, Velocity(1.0, 0.0, 0.0), 0.0)
    assert not position.reached(np.array((0.3, 0.0, 1.0)), goal, REST, 0.0)


def test_progress_is_a_distance_or_a_turn_in_time() -> None:
    here = np.zeros(3)
    simple, pose = make_progress_checker(SimpleProgress()), make_progress_checker(PoseProgress())
    for checker in (simple, pose):
        assert checker.check(5.0, here)
        assert checker.check(15.0, np.array((0.5, 0.0, 0.0)))  # not beyond the radius, and not beyond the time
        assert not checker.check(15.1, here)
        assert checker.check(16.0, np.array((0.51, 0.0, 0.0)))
        assert checker.check(26.0, np.array((0.6, 0.0, 0.4)))
    turned = np.array((0.6, 0.0, 6.0))
    assert not simple.check(26.1, turned)
    assert not pose.check(26.1, turned)  # 6 rad is but 0.28 the other way round
    assert pose.check(26.2, np.array((0.6, 0.0, 0.6)))
    simple.reset()
    assert simple.check(100.0, turned)

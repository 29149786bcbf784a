"""The navigator in the hands of a run: drives, stops, survives odd input, and says what is wrong with its parameters."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from arcs import step_arc
from clearway.contract import Budget, Goal, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.navigators.hl_rrt import HlRrt
from clearway.navigators.hl_rrt.checking import look
from clearway.navigators.hl_rrt.following import Body, follow, turn
from clearway.robots import DriveLimits, Robot, load_robot
from perceived import exact

pytestmark = pytest.mark.slow

RESCUE = load_robot("rescue")
GOAL = Goal(np.array((6.0, 0.0, 0.0)), 0.2, math.pi)
FAST = Body(DriveLimits(0.0, 0.5, math.inf, math.inf, 1.5, math.inf, math.inf), 0.15)
SLOW = Body(DriveLimits(0.0, 0.5, 1.0, 1.0, 1.5, 2.0, 2.0), 0.1)
NOTHING = look(np.empty((0, 3)), 0.0, 0.0, 3.5, 0.5)


def seen(discs: Any) -> Obstacles:
    d = np.array(discs, float).reshape(-1, 3)
    return exact(d[:, :2], radius=d[:, 2], moving=False)


def make(robot: Robot = RESCUE, budget: Budget = Budget(), **options: Any) -> HlRrt:  # noqa: B008
    navigator = HlRrt(**options)
    navigator.reset(Task(robot.period, 1.0, np.zeros(3), budget=budget), robot, np.random.default_rng(0))
    return navigator


def look_at(discs: Any = (), pose: Any = (0.0, 0.0, 0.0), goal: Goal = GOAL, velocity: Any = (0.0, 0.0)) -> Observation:
    return Observation(0.0, np.array(pose, float), np.array(velocity, float), np.zeros(3), goal, None, seen(discs))


def drive(navigator: HlRrt, discs: Any, seconds: float, goal: Goal = GOAL) -> tuple[np.ndarray, list[str]]:
    pose, velocity, track, words = np.zeros(3), np.zeros(2), [np.zeros(3)], []
    for _ in range(int(seconds / 0.15)):
        command = navigator.step(look_at(discs, pose, goal, velocity))
        velocity = np.array((command.v, command.omega))
        pose = step_arc(pose, *velocity, 0.15)
        track.append(pose)
        words.append(command.status)
    return np.array(track), words


def test_it_drives_around_obstacles_and_arrives() -> None:
    discs = [(2.0, 0.1, 0.35), (4.0, -0.3, 0.35), (4.2, 0.6, 0.35)]
    track, words = drive(make(), discs, 18.0)
    assert words[-1] == "arrived"
    assert math.dist(track[-1, :2], GOAL.pose[:2]) <= 0.2
    gaps = [np.hypot(*(track[:, :2] - d[:2]).T).min() - d[2] - 0.25 for d in discs]
    assert min(gaps) > 0.0
    length = np.hypot(*np.diff(track[:, :2], axis=0).T).sum()
    assert length < 1.08 * 6.0


def test_it_turns_to_the_goals_heading() -> None:
    goal = Goal(np.array((1.0, 0.0, 2.0)), 0.2, 0.1)
    track, _ = drive(make(), [], 7.0, goal)
    assert track[-1, 2] == pytest.approx(2.0, abs=0.06)
    assert math.dist(track[-1, :2], (1.0, 0.0)) <= 0.2


def test_walled_in_it_stands_still() -> None:
    ring = [(0.62 * math.cos(a), 0.62 * math.sin(a), 0.35) for a in np.linspace(0, math.tau, 13)[:-1]]
    track, words = drive(make(cap=200), ring, 1.5)
    assert np.hypot(*track[:, :2].T).max() < 0.1
    assert "no path" in words


def test_an_obstacle_on_top_of_it_does_not_bar_its_way_out() -> None:
    track, _ = drive(make(), [(-0.3, 0.0, 0.35)], 3.0)
    assert track[-1, 0] > 0.5
    assert make().step(look_at([(0.0, 0.0, 0.35)])).v >= 0.0


def test_a_goal_inside_an_obstacle_is_approached_and_waited_at() -> None:
    track, _ = drive(make(cap=400), [(3.0, 0.0, 0.5)], 9.0, Goal(np.array((3.0, 0.0, 0.0)), 0.2, math.pi))
    end = math.dist(track[-1, :2], (3.0, 0.0))
    assert 0.8 <= end < 1.1
    assert math.dist(track[-1, :2], track[-8, :2]) < 0.1


def test_obstacles_that_are_not_finite_are_left_out() -> None:
    odd = [(math.nan, 0.0, 0.3), (1.5, math.inf, 0.3), (1.5, 0.0, math.nan), (1.5, 0.0, -1.0)]
    wanted = make().step(look_at([(2.0, 0.1, 0.35)]))
    assert make().step(look_at([*odd, (2.0, 0.1, 0.35)])) == wanted


@pytest.mark.parametrize("field", ["pose", "velocity"])
def test_a_pose_or_velocity_that_is_nan_is_named(field: str) -> None:
    with pytest.raises(ValueError, match=rf"the observation's {field} is .*nan.*; [23] finite numbers are needed"):
        make().step(look_at(**{field: (math.nan, 0.0, 0.0)[: 3 if field == "pose" else 2]}))


def test_no_obstacles_at_all_and_a_thousand() -> None:
    o = look_at()
    command = make().step(Observation(o.t, o.pose, o.velocity, o.odom_pose, o.goal))
    assert command.v == RESCUE.drive.acceleration * RESCUE.period  # from rest
    rng = np.random.default_rng(1)
    many = np.column_stack([rng.uniform(-6, 6, (1000, 2)), np.full(1000, 0.05)])
    assert make(cap=300).step(look_at(many)).v >= 0.0


def test_budgets() -> None:
    cut = make(budget=Budget(iterations=50))
    assert cut.step(look_at()).cut
    assert cut.diagnostics().iterations == 50
    assert not make().step(look_at()).cut
    late = make(budget=Budget(seconds=0.0)).step(look_at())
    assert (late.cut, late.v) == (True, 0.0)
    assert late.status == "no path"


def test_diagnostics() -> None:
    navigator = make()
    navigator.step(look_at([(2.0, 0.1, 0.35)]))
    navigator.step(look_at([(2.0, 0.1, 0.35)]))
    shown = navigator.diagnostics()
    assert shown.status == "tracking"
    assert shown.tree is not None
    assert shown.tree.shape[1] == 4
    assert shown.circles["obstacles"] == pytest.approx(np.array([[2.0, 0.1, 0.65]]))
    assert len(shown.circles["mixture"]) >= 1
    assert shown.polylines["plan"][0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"horizon": 0.0}, r"hl-rrt[.:] ?horizon: 0\.0 is wrong.*greater than 0"),
        ({"step": 4.0}, "spacing, step and horizon are 0.1, 4 and 3 m; .* step at most the horizon"),
        ({"goal_share": 0.9}, r"is 1\.6; it must be at most 1"),
        ({"padding": -1.0}, r"padding: -1\.0 is wrong"),
        ({"speed": math.nan}, "speed: nan is wrong"),
        ({"hoizon": 2.0}, r"hoizon: unknown key; did you mean 'horizon'\?"),
        ({"capacity": 3}, "capacity: 3 is wrong.*greater than or equal to 16"),
    ],
)
def test_wrong_parameters_are_one_clear_error(options: dict[str, float], says: str) -> None:
    with pytest.raises(ClearwayError, match=says):
        make(**options)
    robot = RESCUE.model_copy(update={"navigators": {"hl-rrt": options}})
    with pytest.raises(ClearwayError, match=says) as told:
        make(robot)
    assert str(told.value).startswith("robot rescue: navigators.hl-rrt")


def test_following_straight_ahead_and_off_course() -> None:
    path, pose = np.array(((0.0, 0.0), (0.5, 0.0), (3.0, 0.0))), np.zeros(3)
    assert follow(path, pose, np.zeros(2), FAST, 0.075, NOTHING) == (0.5, 0.0, True)
    v, omega, _ = follow(path, np.array((0.0, 0.0, 0.1)), np.zeros(2), FAST, 0.075, NOTHING)
    assert v == pytest.approx(0.5 * math.cos(0.2))
    assert v / omega == pytest.approx(-0.5 / (2.0 * math.sin(0.1)))  # the arc to the point 0.5 m (1 s) ahead
    v, omega, _ = follow(path, np.array((0.0, 0.0, 1.0)), np.zeros(2), FAST, 0.075, NOTHING)
    assert (v, omega) == (0.0, -1.5)


def test_following_aims_at_what_it_sees() -> None:
    corner = np.array(((0.0, 0.0), (0.3, 0.0), (0.3, 1.0)))
    v, omega, _ = follow(corner, np.zeros(3), np.zeros(2), FAST, 0.075, NOTHING)
    bearing, away = math.atan2(0.2, 0.3), math.hypot(0.2, 0.3)
    assert v / omega == pytest.approx(away / (2.0 * math.sin(bearing)))
    inside = look(np.array(((0.2, 0.1, 0.05),)), 0.0, 0.0, 3.5, 0.5)  # in the corner: the sight ends at 0.25 m
    assert follow(corner, np.zeros(3), np.zeros(2), FAST, 0.075, inside) == (0.5, 0.0, True)


@pytest.mark.parametrize("body", [FAST, SLOW])
def test_following_a_jagged_path_it_does_not_sway(body: Body) -> None:
    pose, velocity, sway = np.array((0.0, 0.0, 0.4)), np.zeros(2), []
    for k in range(60):
        ahead = pose[0] + 0.15 * np.arange(1, 30)
        jagged = np.column_stack([ahead, 0.03 * (-1.0) ** np.arange(k, k + 29)])  # another one each period
        v, omega, clear = follow(np.vstack([pose[:2], jagged]), pose, velocity, body, 0.05, NOTHING)
        assert clear
        velocity = np.array((v, omega))
        pose = step_arc(pose, v, omega, body.period)
        if k >= 30:
            sway.append(pose[2])
            assert v > 0.9 * body.limits.v_max
    assert np.abs(sway).max() < 0.1


def test_following_keeps_the_rate_limits_and_brakes_for_the_end() -> None:
    path = np.array(((0.0, 0.0), (0.02, 0.0)))
    ahead = np.array(((0.0, 0.0), (3.0, 0.0)))
    v, omega, _ = follow(ahead, np.array((0.0, 0.0, 0.7)), np.array((0.5, 0.5)), SLOW, 0.05, NOTHING)
    assert (v, omega) == (pytest.approx(0.4), pytest.approx(0.3))
    v, omega, _ = follow(ahead, np.array((0.0, 0.0, 0.9)), np.zeros(2), SLOW, 0.05, NOTHING)
    assert (v, omega) == (0.0, pytest.approx(-0.2))
    v, _, _ = follow(path, np.zeros(3), np.array((0.3, 0.0)), SLOW, 0.05, NOTHING)
    assert v == pytest.approx(0.2)  # wants 0.2 = min(0.02 / 0.1, sqrt(2 * 0.02)), and may lose 0.1
    assert turn(0.0, np.array((0.3, 0.1)), SLOW) == (pytest.approx(0.2), 0.0)


def test_a_turn_on_the_spot_does_not_overshoot() -> None:
    for error in (0.02, 0.3, 2.0):
        left, omega, least = error, 0.0, error
        for _ in range(60):
            before = omega
            _, omega = turn(left, np.array((0.0, omega)), SLOW)
            left -= 0.5 * (before + omega) * SLOW.period
            least = min(least, left)
        assert abs(left) < 1e-3
        assert least > -0.02


def test_an_arc_that_would_touch_is_not_driven() -> None:
    path = np.array(((0.0, 0.0), (0.5, 0.0), (3.0, 0.0)))
    beside = look(np.array(((0.05, 0.702, 0.7),)), 0.0, 0.0, 3.5, 0.5)  # free ahead, not for who still points left
    v, omega, clear = follow(path, np.array((0.0, 0.0, 0.5)), np.array((0.4, 0.0)), FAST, 0.075, beside)
    assert (v, clear) == (0.0, False)
    assert omega < 0.0
    assert follow(path, np.zeros(3), np.zeros(2), FAST, 0.075, beside)[2]


def test_arrived_only_well_within_the_tolerances_or_for_good() -> None:
    goal = Goal(np.array((1.0, 0.0, 0.0)), 0.2, 0.4)
    navigator = make()
    assert navigator.step(look_at(pose=(0.83, 0.0, 0.0), goal=goal)).arrived is False
    assert navigator.step(look_at(pose=(0.92, 0.0, 0.35), goal=goal)).arrived is False
    there = navigator.step(look_at(pose=(0.92, 0.0, 0.19), goal=goal))
    assert (there.arrived, there.v, there.omega) == (True, 0.0, 0.0)
    navigator = make()  # an obstacle on the goal: it gets no farther than this
    barred = [(1.0, 0.0, 0.01)]
    said = [navigator.step(look_at(barred, (0.83, 0.0, 0.0), goal)).arrived for _ in range(15)]
    assert said == [False] * 14 + [True]


def test_near_an_obstacle_it_goes_as_fast_as_it_can_stop() -> None:
    path, velocity = np.array(((0.0, 0.0), (3.0, 0.0))), np.array((0.5, 0.0))
    rim = {d: look(np.array(((d + 0.5, 0.0, 0.5),)), 0.0, 0.0, 3.5, 0.5) for d in (0.19, 0.14, 0.12)}
    assert follow(path, np.zeros(3), velocity, SLOW, 0.05, rim[0.19]) == (0.5, 0.0, True)  # 0.05 + 0.125 m
    assert follow(path, np.zeros(3), velocity, SLOW, 0.05, rim[0.14]) == (pytest.approx(0.4), 0.0, True)  # 0.045 + 0.08
    assert follow(path, np.zeros(3), velocity, SLOW, 0.05, rim[0.12]) == (pytest.approx(0.4), 0.0, False)
    assert follow(path, np.zeros(3), velocity, FAST, 0.05, rim[0.12]) == (0.5, 0.0, True)  # stops at once

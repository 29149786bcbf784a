"""DWAPlannerROS: sampling, choice, oscillation, end game, limits; a small closed loop."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from local_oracle import dwa_scores, speeds

from clearway.geometry.shapes import Circle, rectangle
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.common.oscillation import Oscillation, Signs
from clearway.navigators.move_base.local_planners.dwa import DWAPlanner
from clearway.navigators.move_base.local_planners.dwa_search import (
    sample_steps,
    sideways_of,
    velocity_samples,
    window_of,
)
from clearway.navigators.move_base.local_planners.parameters import DWAParameters
from clearway.navigators.move_base.local_planners.sampling import roll

PERIOD = 0.1
TIAGO = DWAParameters(
    acc_lim_x=1.0, max_vel_x=1.0, max_vel_trans=1.0, max_vel_theta=2.0, path_distance_bias=32.0, goal_distance_bias=24.0,
    oscillation_reset_dist=0.1, scaling_speed=0.5, vx_samples=5, vth_samples=8, xy_goal_tolerance=0.2,
    yaw_goal_tolerance=0.2, trans_stopped_vel=0.01, theta_stopped_vel=0.01,
)  # fmt: skip
ROUND = outline(Circle(0.275), 0.01)
ORIGIN, RESOLUTION, SHAPE = np.array([-2.0, -2.0]), 0.05, (80, 80)


def planner(parameters=TIAGO, polygon=ROUND):
    return DWAPlanner(parameters, polygon, PERIOD)


def straight(length=1.9):
    x = np.arange(0.0, length, 0.05)
    return np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))


def decide(who, pose, velocity=(0.0, 0.0), plan=None, cost=None, limit=9.0, goal=None):
    plan = straight() if plan is None else plan
    cost = np.zeros(SHAPE, np.uint8) if cost is None else cost
    goal = plan[-1] if goal is None else goal
    return who.compute(np.array(pose, float), np.array(velocity, float), plan, goal, cost, ORIGIN, RESOLUTION, limit)


@pytest.mark.parametrize(
    ("low", "high", "count", "expected"),
    [
        (0.0, 0.6, 4, [0.0, 0.2, 0.4, 0.6]),
        (-0.1, 0.3, 3, [-0.1, 0.0, 0.1, 0.3]),  # zero is added where the range straddles it
        (-0.2, 0.2, 3, [-0.2, 0.0, 0.2]),
        (0.5, 0.5, 10, [0.5]),
        (0.1, 0.3, 1, [0.1, 0.3]),  # never fewer than two
    ],
)
def test_velocity_samples(low, high, count, expected):
    assert velocity_samples(low, high, count).tolist() == pytest.approx(expected)


def test_window_is_what_one_period_reaches_within_the_limits():
    window = planner().window(RESOLUTION, 9.0, 5.0)
    assert window_of(window, np.array([0.5, 1.9]), 5.0) == pytest.approx((0.4, 0.6, 1.58, 2.0))
    assert window_of(window, np.array([0.04, 0.0]), 5.0) == pytest.approx((0.0, 0.14, -0.32, 0.32))
    slow = planner().window(RESOLUTION, 0.2, 5.0)
    assert window_of(slow, np.array([0.19, 0.0]), 5.0)[:2] == pytest.approx((0.09, 0.2))


def test_window_without_the_dynamic_window_never_overshoots_the_goal():
    window = planner(TIAGO.model_copy(update={"use_dwa": False})).window(RESOLUTION, 9.0, 5.0)
    assert window_of(window, np.array([0.0, 0.0]), 0.34) == pytest.approx((0.0, 0.2, -2.0, 2.0))


def test_names_of_pal_that_the_real_planner_does_not_read_change_nothing():
    pal = TIAGO.model_copy(update={"acc_lim_th": 1.5, "vtheta_samples": 3})
    assert planner(pal).window(RESOLUTION, 9.0, 5.0) == planner().window(RESOLUTION, 9.0, 5.0)
    assert DWAParameters.model_validate({"acc_lim_th": 1.5}).acc_lim_theta == 3.2


def test_too_slow_samples_are_refused_and_points_lie_a_granularity_apart():
    window = planner().window(RESOLUTION, 9.0, 5.0)
    assert sample_steps(window, 0.05, 0.3) == 0  # slower than both minima
    assert sample_steps(window, 0.05, 0.4) == math.ceil(0.4 * 1.7 / 0.1)
    assert sample_steps(window, 0.1, 0.0) == 7  # 0.17 m every 0.025 m
    assert sample_steps(window, 1.1, 0.0) == 0  # above max_vel_trans


def test_rollout_is_the_arc_in_the_limit_and_exact_in_its_heading():
    v, w, horizon = 0.8, 1.3, 1.7
    errors = []
    for steps in (500, 1000):
        out = np.empty((steps, 5))
        roll(np.array([0.3, -0.2, 0.4]), v, w, v, w, 0.0, 0.0, horizon / steps, steps, out)
        t = horizon * (steps - 1) / steps
        yaw = 0.4 + w * t
        exact = (0.3 + v / w * (math.sin(yaw) - math.sin(0.4)), -0.2 - v / w * (math.cos(yaw) - math.cos(0.4)))
        assert out[-1, 2] == pytest.approx(yaw, abs=1e-12)
        assert out[-1, 3:] == pytest.approx([math.cos(yaw), math.sin(yaw)], abs=1e-12)
        errors.append(math.dist(out[-1, :2], exact))
    assert errors[0] < 3e-3
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.01)  # Euler: first order


def test_rollout_accelerates_towards_its_sample():
    out = np.empty((5, 5))
    roll(np.zeros(3), 0.0, 0.0, 0.3, 0.0, 1.0, 1.0, 0.1, 5, out)
    assert out[:, 0].tolist() == pytest.approx([0.0, 0.01, 0.03, 0.06, 0.09])


def random_scene(seed, obstacles=9):
    rng = np.random.default_rng(seed)
    r, c = np.mgrid[: SHAPE[0], : SHAPE[1]]
    distance = np.full(SHAPE, np.inf)
    for _ in range(obstacles):
        x, y = rng.uniform(0, 80, 2)
        if math.hypot(x - 40, y - 40) > 11:
            distance = np.minimum(distance, np.hypot(c - x, r - y) - 2)
    cost = np.where(distance < 6, 252 * np.exp(-distance / 3), 0)
    cost[distance < 3] = 253
    cost[distance < 0] = 254
    x = np.linspace(0, 1.9, 30)
    y = rng.uniform(-0.5, 0.5) * x + rng.uniform(-0.5, 0.5) * x**2
    turn = rng.uniform(-0.7, 0.7)
    plan = np.column_stack((x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), x * 0))
    pose = np.array([*rng.uniform(-0.1, 0.1, 2), rng.uniform(-1, 1)])
    velocity = np.array([rng.uniform(0, 1), rng.uniform(-1.5, 1.5)])
    return cost.astype(np.uint8), plan, pose, velocity


@pytest.mark.parametrize("seed", range(14))
def test_the_choice_is_that_of_scoring_every_sample_by_every_critic(seed):
    cost, plan, pose, velocity = random_scene(seed)
    if seed == 13:
        plan = plan[:4]  # close to the goal: the nose is not scored
    polygon = outline(rectangle(0.5, 0.36), 0.01) if seed % 2 else ROUND
    scores = dwa_scores(TIAGO, PERIOD, pose, velocity, plan, cost, ORIGIN, RESOLUTION, polygon)
    result = decide(planner(polygon=polygon), pose, velocity, plan, cost, goal=np.array([50.0, 0.0, 0.0]))
    assert result.ok == bool(scores)
    if scores:
        best = min(scores.values())
        assert min(scores.items(), key=lambda kv: abs(kv[0][0] - result.v) + abs(kv[0][1] - result.omega))[
            1
        ] == pytest.approx(best)


def test_the_comparison_above_meets_blocked_and_narrow_scenes():
    legal = [
        len(dwa_scores(TIAGO, PERIOD, pose, velocity, plan, cost, ORIGIN, RESOLUTION, ROUND))
        for cost, plan, pose, velocity in map(random_scene, range(13))
    ]
    assert min(legal) < 20 < max(legal)


def test_a_wall_all_around_leaves_no_command():
    cost = np.zeros(SHAPE, np.uint8)
    cost[32:49, 32:49] = 254
    result = decide(planner(), (0.0, 0.0, 0.0), cost=cost)
    assert (result.v, result.omega, result.ok, len(result.trajectory)) == (0.0, 0.0, False, 0)


def test_the_footprint_grows_with_speed():
    cost = np.zeros(SHAPE, np.uint8)
    cost[47, :] = 254  # walls from 0.35 m to the left and right
    cost[32, :] = 254
    fast = decide(planner(), (0.0, 0.0, 0.0), (1.0, 0.0), cost=cost)
    narrow = TIAGO.model_copy(update={"max_scaling_factor": 0.3})
    slowed = decide(planner(narrow), (0.0, 0.0, 0.0), (0.9, 0.0), cost=cost)
    assert fast.v >= 0.95
    assert 0.8 <= slowed.v < 0.88  # 0.285 m grown by 0.3 (v - 0.5) / 0.5 fits in 0.35 m up to 0.88 m/s


def test_turning_back_and_forth_is_forbidden_until_the_robot_has_moved():
    flags = Oscillation(distance=0.1, angle=0.2)
    here = np.zeros(3)
    flags.update(here, 0.0, 0.5, 0.1)
    assert flags.signs == Signs()
    flags.update(here, 0.0, -0.5, 0.1)
    assert flags.signs == Signs(no_left=True)
    flags.update(np.array([0.05, 0.0, -0.1]), 0.3, 0.5, 0.1)  # driving: turning doesn't count
    assert flags.signs == Signs(no_left=True)
    flags.update(np.array([0.05, 0.0, -0.21]), 0.0, -0.5, 0.1)
    assert flags.signs == Signs()


def test_forbidden_directions_are_not_chosen():
    who = planner()
    left = np.column_stack((np.zeros(30), np.linspace(0, 1.5, 30), np.full(30, 1.57)))
    assert decide(who, (0.0, 0.0, 0.0), plan=left).omega > 0
    who._oscillation.signs = Signs(no_left=True)
    assert decide(who, (0.0, 0.0, 0.0), plan=left).omega <= 0
    who.set_plan()
    assert decide(who, (0.0, 0.0, 0.0), plan=left).omega > 0


OMNI = TIAGO.model_copy(update={"max_vel_y": 0.4, "min_vel_y": -0.3, "acc_lim_y": 1.0, "vy_samples": 5})


def test_sideways_is_what_one_period_reaches_and_nothing_for_a_base_without_sides():
    window = DWAPlanner(OMNI, ROUND, PERIOD, sideways=True).window(RESOLUTION, 9.0, 5.0)
    assert sideways_of(window, np.array([0.5, 0.0, 0.35]), 5.0) == pytest.approx((0.25, 0.4))
    assert sideways_of(window, np.array([0.5, 0.0, -0.28]), 5.0) == pytest.approx((-0.3, -0.18))
    slow = DWAPlanner(OMNI, ROUND, PERIOD, sideways=True).window(RESOLUTION, 0.2, 5.0)
    assert sideways_of(slow, np.array([0.1, 0.0, 0.15]), 5.0) == pytest.approx((0.05, 0.2))
    assert sideways_of(planner(OMNI).window(RESOLUTION, 9.0, 5.0), np.array([0.5, 0.0]), 5.0) == (0.0, 0.0)


def test_a_base_with_sides_steps_aside_and_rolls_there():
    """The plan leads to the left; sideways speed and turn bring it there."""
    left = np.column_stack((np.zeros(30), np.linspace(0, 1.5, 30), np.full(30, 1.57)))
    moving = (0.1, 0.0, 0.2)
    chosen = decide(DWAPlanner(OMNI, ROUND, PERIOD, sideways=True), (0.0, 0.0, 0.0), moving, plan=left)
    assert chosen.ok
    assert chosen.v_y == pytest.approx(0.3)
    assert chosen.trajectory[-1, 1] > 0.3
    assert decide(planner(OMNI), (0.0, 0.0, 0.0), moving[:2], plan=left).v_y == 0.0


def test_a_strafing_rollout_by_hand():
    """0.3 m/s ahead and 0.4 m/s to the left, heading along y: so it moves along y and along -x."""
    out = np.empty((11, 5))
    roll(np.array([1.0, 2.0, math.pi / 2]), 0.3, 0.0, 0.3, 0.0, 0.0, 0.0, 0.1, 11, out, 0.4, 0.4, 0.0)
    assert out[10, :3] == pytest.approx([1.0 - 0.4, 2.0 + 0.3, math.pi / 2])


def test_too_fast_in_both_together_is_refused():
    window = DWAPlanner(OMNI, ROUND, PERIOD, sideways=True).window(RESOLUTION, 0.5, 5.0)
    assert sample_steps(window, 0.4, 0.0, 0.3) > 0
    assert sample_steps(window, 0.4, 0.0, 0.4) == 0


def test_strafing_back_and_forth_is_forbidden_until_the_robot_has_moved():
    flags = Oscillation(distance=0.1, angle=0.2)
    here = np.zeros(3)
    flags.update(here, 0.0, 0.0, 0.1, 0.2)
    assert flags.signs == Signs()
    flags.update(here, 0.0, 0.0, 0.1, -0.2)
    assert flags.signs == Signs(no_strafe_left=True)
    flags.update(np.array([0.0, -0.2, 0.0]), 0.0, 0.0, 0.1, -0.2)
    assert flags.signs == Signs()


def test_at_the_goal_a_base_with_sides_brakes_to_its_side_as_well():
    goal = np.array([0.1, 0.0, 1.0])
    who = DWAPlanner(OMNI, ROUND, PERIOD, sideways=True)
    braking = decide(who, (0.0, 0.0, 0.0), (0.5, -0.5, -0.3), goal[None, :])
    assert (braking.v, braking.omega, braking.v_y) == pytest.approx((0.4, -0.18, -0.2))


def test_at_the_goal_it_brakes_then_turns_then_arrives():
    who, goal = planner(), np.array([0.1, 0.0, 1.0])
    plan = goal[None, :]
    braking = decide(who, (0.0, 0.0, 0.0), (0.5, -0.5), plan)
    assert (braking.v, braking.omega) == pytest.approx((0.4, -0.18))
    turning = decide(who, (0.0, 0.0, 0.0), (0.0, 0.0), plan)
    assert (turning.v, turning.omega) == pytest.approx((0.0, 0.4))  # min_vel_theta outranks 3.2 rad/s^2 * 0.1 s
    faster = decide(who, (0.0, 0.0, 0.0), (0.0, 0.4), plan)
    assert faster.omega == pytest.approx(0.72)  # it does not stop again once it turns
    assert not who.goal_reached(np.array([0.0, 0.0, 0.5]), np.zeros(2), goal)
    assert not who.goal_reached(np.array([0.0, 0.0, 0.9]), np.array([0.0, 0.3]), goal)
    assert decide(who, (0.0, 0.0, 0.9), (0.0, 0.3), plan).omega == 0.0
    assert who.goal_reached(np.array([0.0, 0.0, 0.9]), np.zeros(2), goal)


def test_a_turn_into_an_obstacle_is_refused():
    cost = np.zeros(SHAPE, np.uint8)
    cost[45, 48] = 254
    long = outline(rectangle(1.0, 0.2))
    goal = np.array([0.05, 0.0, 1.5])
    assert decide(planner(polygon=long), (0.0, 0.0, 0.0), plan=goal[None, :]).ok
    assert not decide(planner(polygon=long), (0.0, 0.0, 0.0), plan=goal[None, :], cost=cost).ok


@pytest.mark.parametrize("latch", [False, True])
def test_the_latch_keeps_a_robot_at_its_goal_that_was_pushed_away(latch):
    who = DWAPlanner(TIAGO, ROUND, PERIOD, latch=latch)
    goal = np.array([0.1, 0.0, 1.0])
    decide(who, (0.0, 0.0, 0.0), plan=goal[None, :])
    pushed = decide(who, (-0.4, 0.0, 0.0), plan=straight(), goal=goal)
    assert (pushed.v == 0.0 and pushed.omega > 0.3) == latch
    who.set_plan()
    assert decide(who, (-0.4, 0.0, 0.0), plan=straight(), goal=goal).v > 0.0


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 1.2))
def test_a_command_never_leaves_window_and_limits(seed, limit):
    cost, plan, pose, velocity = random_scene(seed, 6)
    velocity[0] = min(velocity[0], limit)
    result = decide(planner(), pose, velocity, plan, cost, limit)
    assert math.isfinite(result.v)
    assert math.isfinite(result.omega)
    if result.ok:
        assert max(0.0, velocity[0] - 0.1) - 1e-9 <= result.v <= min(1.0, limit, velocity[0] + 0.1) + 1e-9
        assert max(-2.0, velocity[1] - 0.32) - 1e-9 <= result.omega <= min(2.0, velocity[1] + 0.32) + 1e-9
    else:
        assert (result.v, result.omega) == (0.0, 0.0)


def test_driving_in_a_loop_it_passes_a_box_and_reaches_the_goal():
    """Kinematics only: the planner's own commands, a fixed costmap, a plan that bends around a box."""
    cost = np.zeros(SHAPE, np.uint8)
    cost[38:42, 38:42] = 254  # a box of 0.2 m around the origin
    x = np.linspace(-1.3, 1.2, 60)
    plan = np.column_stack((x, 0.8 * np.exp(-((x / 0.6) ** 2)), np.zeros(60)))
    who, pose, velocity = planner(), np.array([-1.3, 0.0, 0.0]), np.zeros(2)
    nearest = np.inf
    for _ in range(200):
        if who.goal_reached(pose, velocity, plan[-1]):
            break
        ahead = plan[np.argmin(np.hypot(plan[:, 0] - pose[0], plan[:, 1] - pose[1])) :]
        result = decide(who, pose, velocity, ahead, cost, 0.6, goal=plan[-1])
        velocity = np.array([result.v, result.omega])
        pose = pose + PERIOD * np.array([result.v * math.cos(pose[2]), result.v * math.sin(pose[2]), result.omega])
        nearest = min(nearest, math.hypot(max(abs(pose[0]) - 0.1, 0), max(abs(pose[1]) - 0.1, 0)))
    assert who.goal_reached(pose, velocity, plan[-1])
    assert 0.275 < nearest < 0.8


def test_samples_of_the_oracle_are_the_planners():
    assert speeds(-0.1, 0.3, 3) == pytest.approx(velocity_samples(-0.1, 0.3, 3).tolist())


def test_below_both_minimum_speeds_within_one_period_it_cannot_start():
    """PAL's public file at 10 Hz: 0.8 m/s^2 * 0.1 s < 0.1 m/s and 3.2 rad/s^2 * 0.1 s < 0.4 rad/s, so nothing is left."""
    assert not decide(planner(TIAGO.model_copy(update={"acc_lim_x": 0.8})), (0.0, 0.0, 0.0)).ok
    assert decide(planner(), (0.0, 0.0, 0.0)).v == pytest.approx(0.1)

"""TrajectoryPlannerROS: samples, choice, flags against oscillation, escape, end game, limits; a small closed loop."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from local_oracle import distances, footprint_cost, plan_cells, robot_cells, world_to_cell

from clearway.geometry.shapes import rectangle
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.move_base.local_planners.parameters import TrajectoryParameters
from clearway.navigators.move_base.local_planners.rollout import TrajectoryPlanner
from clearway.navigators.move_base.local_planners.rollout_search import samples, window_of

PERIOD = 0.05
BARN = TrajectoryParameters.model_validate(
    {
        "acc_lim_x": 10.0, "acc_lim_theta": 20.0, "max_vel_x": 0.5, "min_vel_x": 0.1, "max_vel_theta": 1.57,
        "min_vel_theta": -1.57, "min_in_place_vel_theta": 0.314, "escape_vel": -0.5, "yaw_goal_tolerance": 0.157,
        "xy_goal_tolerance": 0.25, "sim_time": 2.0, "sim_granularity": 0.02, "angular_sim_granularity": 0.1,
        "vx_samples": 4, "vtheta_samples": 8, "meter_scoring": True, "occdist_scale": 0.1, "pdist_scale": 0.75,
        "gdist_scale": 1.0, "dwa": True, "escape_reset_theta": 0.1, "holonomic_robot": False,
    }
)  # fmt: skip
JACKAL = outline(rectangle(0.42, 0.33), 0.1)
ORIGIN, RESOLUTION, SHAPE = np.array([-2.0, -2.0]), 0.05, (80, 80)


def planner(parameters=BARN, polygon=JACKAL):
    return TrajectoryPlanner(parameters, polygon, PERIOD)


def straight(length=1.9):
    x = np.arange(0.0, length, 0.05)
    return np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))


def decide(who, pose, velocity=(0.0, 0.0), plan=None, cost=None, limit=9.0):
    plan = straight() if plan is None else plan
    cost = np.zeros(SHAPE, np.uint8) if cost is None else cost
    return who.compute(
        np.array(pose, float), np.array(velocity, float), plan, plan[-1], cost, ORIGIN, RESOLUTION, limit
    )


def random_scene(seed, obstacles=9):
    rng = np.random.default_rng(seed)
    r, c = np.mgrid[: SHAPE[0], : SHAPE[1]]
    distance = np.full(SHAPE, np.inf)
    for _ in range(obstacles):
        x, y = rng.uniform(5, 75, 2)
        if math.hypot(x - 40, y - 40) > 11:
            distance = np.minimum(distance, np.hypot(c - x, r - y) - 2)
    cost = np.where(distance < 8, 252 * np.exp(-(distance - 5) / 3), 0).clip(0, 252)
    cost[distance < 5] = 253
    cost[distance < 0] = 254
    x = np.linspace(0, 1.9, 30)
    y = rng.uniform(-0.5, 0.5) * x + rng.uniform(-0.5, 0.5) * x**2
    turn = rng.uniform(-2.5, 2.5)
    plan = np.column_stack((x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), x * 0))
    pose = np.array([*rng.uniform(-0.1, 0.1, 2), rng.uniform(-1, 1)])
    velocity = np.array([rng.uniform(0, 0.5), rng.uniform(-1.5, 1.5)])
    return cost.astype(np.uint8), plan, pose, velocity


class Plain:
    """createTrajectories once more, sample by sample in its order, without any state from before."""

    def __init__(self, p, pose, velocity, plan, cost):
        self.p, self.pose, self.velocity, self.cost = p, pose, velocity, cost
        free = robot_cells(pose, JACKAL, ORIGIN, RESOLUTION, cost.shape)
        cells = plan_cells(plan, cost, ORIGIN, RESOLUTION)
        self.path, self.goal = distances(cost, cells, free), distances(cost, cells[-1:])
        self.top = min(p.max_vel_x, math.hypot(plan[-1, 0] - pose[0], plan[-1, 1] - pose[1]) / p.sim_time)

    def score(self, v, w):
        """Cost (-1 blocked, -2 no way) and last point."""
        p, n = self.p, self.cost.size
        steps = max(1, int(max(abs(v) * p.sim_time / p.sim_granularity, abs(w) / p.angular_sim_granularity) + 0.5))
        dt, (x, y, yaw), (vi, wi) = p.sim_time / steps, self.pose, self.velocity
        occ = 0
        for _ in range(steps):
            cell = world_to_cell(x, y, ORIGIN, RESOLUTION, self.cost.shape)
            here = -1 if cell is None else footprint_cost((x, y, yaw), JACKAL, 1.0, self.cost, ORIGIN, RESOLUTION)
            if here < 0:
                return -1.0, None
            if self.path[cell] >= n or self.goal[cell] >= n:
                return -2.0, None
            occ, last = max(occ, here, int(self.cost[cell])), (x, y, yaw)
            vi += np.clip(v - vi, -p.acc_lim_x * dt, p.acc_lim_x * dt)
            wi += np.clip(w - wi, -p.acc_lim_theta * dt, p.acc_lim_theta * dt)
            x, y, yaw = x + vi * math.cos(yaw) * dt, y + vi * math.sin(yaw) * dt, yaw + wi * dt
        scale = RESOLUTION if p.meter_scoring_honoured else 1.0
        return scale * (p.path_bias * self.path[cell] + p.goal_bias * self.goal[cell]) + p.occdist_scale * occ, last

    def best(self):
        p, best = self.p, (-1.0, None, None)
        span = PERIOD if p.dwa else p.sim_time
        low_v = max(p.min_vel_x, self.velocity[0] - p.acc_lim_x * span)
        high_v = max(min(self.top, self.velocity[0] + p.acc_lim_x * span), p.min_vel_x)
        low_w = max(p.min_vel_theta, self.velocity[1] - p.acc_lim_theta * span)
        high_w = min(p.max_vel_theta, self.velocity[1] + p.acc_lim_theta * span)
        rates = np.linspace(low_w, high_w, p.vtheta_samples)
        for v in np.linspace(low_v, high_v, p.vx_samples):
            for w in [0.0, *rates[:-1]]:
                cost, _ = self.score(v, w)
                if cost >= 0 and (best[0] < 0 or cost < best[0]):
                    best = (cost, v, w)
        looked = math.inf
        for w in rates:
            limited = max(w, p.min_in_place_vel_theta) if w > 0 else min(w, -p.min_in_place_vel_theta)
            cost, last = self.score(0.0, limited)
            if cost >= 0 and (best[0] < 0 or cost <= best[0]) and abs(w) > rates[1] - rates[0]:
                eye = (
                    last[0] + p.heading_lookahead * math.cos(last[2]),
                    last[1] + p.heading_lookahead * math.sin(last[2]),
                )
                cell = world_to_cell(*eye, ORIGIN, RESOLUTION, self.cost.shape)
                if cell is not None and self.goal[cell] < looked:
                    best, looked = (cost, 0.0, limited), self.goal[cell]
        return best if best[0] >= 0 else (*self.score(p.escape_vel, 0.0)[:1], p.escape_vel, 0.0)


@pytest.mark.parametrize("dwa", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_the_choice_is_that_of_trying_every_sample_in_turn(seed, dwa):
    p = BARN.model_copy(update={"dwa": dwa, "acc_lim_theta": 3.2, "acc_lim_x": 2.5} if not dwa else {})
    p = p.model_copy(update={"meter_scoring_honoured": seed % 2 == 0})
    cost, plan, pose, velocity = random_scene(seed)
    who = planner(p)
    total, v, w, points, _ = who._search(pose, velocity, (0.0, 0.0), plan, cost, ORIGIN, RESOLUTION, 9.0)
    plain = Plain(p, pose, velocity, plan, cost)
    expected = plain.best()
    assert total == pytest.approx(expected[0] if expected[0] != -1.0 else 1.0)
    if (v, w) != pytest.approx(expected[1:]):  # a tie: another sample of the same cost
        assert plain.score(v, w)[0] == pytest.approx(total)
        assert v > 0
    assert points.shape[1] == 5


def test_the_scenes_above_make_it_drive_turn_and_back_up():
    kinds = {
        int(np.sign(best[1]))
        for best in (
            Plain(BARN, pose, velocity, plan, cost).best()
            for cost, plan, pose, velocity in map(random_scene, range(10))
        )
    }
    assert {0, 1} <= kinds


def test_window_and_samples_by_hand():
    p = BARN.model_copy(update={"vx_samples": 2, "vtheta_samples": 3, "acc_lim_theta": 4.0, "acc_lim_x": 1.0})
    settings = planner(p).window(RESOLUTION, 9.0)
    window = window_of(settings, np.array([0.3, 0.1]), 5.0)
    assert window == pytest.approx((0.25, 0.35, -0.1, 0.3))
    out = np.empty((11, 3))
    assert samples(settings, window, out) == (6, 9)
    assert out[:6, :2].tolist() == pytest.approx(
        np.array([[0.25, 0], [0.25, -0.1], [0.25, 0.1], [0.35, 0], [0.35, -0.1], [0.35, 0.1]])
    )
    assert out[6:9, :2].tolist() == pytest.approx(np.array([[0, -0.314], [0, 0.314], [0, 0.314]]))
    assert out[9, :2].tolist() == [-0.5, 0.0]


def test_it_slows_down_before_the_plans_end_and_under_a_set_speed():
    settings = planner().window(RESOLUTION, 0.3)
    assert window_of(settings, np.array([0.2, 0.0]), 5.0)[1] == pytest.approx(0.3)
    assert window_of(settings, np.array([0.2, 0.0]), 0.4)[1] == pytest.approx(0.2)
    assert window_of(settings, np.array([0.2, 0.0]), 0.05)[1] == pytest.approx(0.1)  # min_vel_x


def test_old_names_of_the_biases_count_unless_the_new_ones_are_given():
    assert (BARN.path_bias, BARN.goal_bias) == (0.75, 1.0)
    both = TrajectoryParameters(pdist_scale=0.75, path_distance_bias=0.2)
    assert both.path_bias == 0.2
    assert TrajectoryParameters().path_bias == 0.6
    turning = TrajectoryParameters(min_in_place_rotational_vel=0.1)
    assert (turning.least_goal_turn, turning.min_in_place_vel_theta) == (0.1, 0.4)


def test_meter_scoring_has_no_effect_unless_it_is_honoured():
    def bias(**change):
        return planner(BARN.model_copy(update=change)).window(RESOLUTION, 9.0).path_bias

    assert bias() == bias(meter_scoring=False) == bias(meter_scoring=False, meter_scoring_honoured=True) == 0.75
    assert bias(meter_scoring_honoured=True) == pytest.approx(0.75 * 0.05)


def test_a_strafing_base_is_refused():
    with pytest.raises(ValueError, match="DWAPlannerROS has y velocities"):
        TrajectoryParameters(holonomic_robot=True)


def walled_in():
    """Walls that let the robot neither drive on nor turn, open behind it."""
    cost = np.zeros(SHAPE, np.uint8)
    cost[33, 20:49] = cost[46, 20:49] = 254
    cost[33:47, 48] = 254
    return cost


def test_it_backs_up_where_nothing_else_is_legal_and_keeps_off_driving_until_away():
    who = planner()
    result = decide(who, (0.0, 0.0, 0.0), cost=walled_in())
    assert (result.v, result.omega, result.ok) == (-0.5, 0.0, True)
    free = decide(who, (-0.05, 0.0, 0.0))  # nothing in the way any more, but 0.1 m are not yet covered
    assert free.v <= 0.0
    decide(who, (-0.11, 0.0, 0.0))
    assert decide(who, (-0.11, 0.0, 0.0)).v > 0.0


def test_it_backs_up_even_where_that_is_blocked_too_but_not_without_a_way_to_the_goal():
    cost = walled_in()
    cost[39:41, 28] = 254  # a post behind: the wave passes it, the robot does not
    assert decide(planner(), (0.0, 0.0, 0.0), cost=cost).v == -0.5
    nowhere = straight() + np.array([50.0, 0.0, 0.0])
    result = decide(planner(), (0.0, 0.0, 0.0), plan=nowhere)
    assert (result.v, result.omega, result.ok) == (0.0, 0.0, False)


def test_after_turning_both_ways_a_second_turn_fixes_the_direction():
    who = planner()
    behind_left = np.column_stack((np.linspace(0, -1.5, 30), np.full(30, 0.02), np.zeros(30)))
    spins = []
    for omega in (0.0, 0.0):
        spins.append(decide(who, (0.0, 0.0, 1.2), (0.0, omega), plan=behind_left))
    assert all(s.v == 0.0 and s.omega > 0.0 for s in spins)
    assert who.window(RESOLUTION, 9.0).no_right
    assert not who.window(RESOLUTION, 9.0).no_left
    behind_right = behind_left * np.array([1.0, -1.0, 1.0])
    assert decide(planner(), (0.0, 0.0, -1.2), plan=behind_right).omega < 0.0
    turned = decide(who, (0.0, 0.0, -1.2), plan=behind_right)
    assert turned.v > 0.0 or turned.omega > 0.0
    decide(who, (0.2, 0.0, 0.0), (0.3, 0.0))  # driven on: the flags are dropped
    assert not who.window(RESOLUTION, 9.0).no_right


def test_at_the_goal_it_brakes_turns_and_arrives():
    who, plan = planner(BARN.model_copy(update={"acc_lim_x": 2.0, "acc_lim_theta": 4.0})), np.array([[0.1, 0.0, 1.0]])
    braking = decide(who, (0.0, 0.0, 0.0), (0.5, -0.5), plan)
    assert (braking.v, braking.omega) == pytest.approx((0.4, -0.3))
    first = decide(who, (0.0, 0.0, 0.0), (0.0, 0.0), plan)
    assert (first.v, first.omega) == pytest.approx((0.0, 0.314))  # min_in_place_vel_theta outranks 0.2 rad/s
    assert decide(who, (0.0, 0.0, 0.0), (0.0, 0.9), plan).omega == pytest.approx(1.0)  # max_rotational_vel, not 1.57
    assert decide(who, (0.0, 0.0, 0.8), (0.0, 0.3), plan).omega == pytest.approx(0.314)
    assert not who.goal_reached(np.zeros(3), np.zeros(2), plan[-1])
    assert decide(who, (0.0, 0.0, 0.9), (0.0, 0.3), plan).omega == 0.0
    assert who.goal_reached(np.zeros(3), np.zeros(2), plan[-1])
    who.set_plan()
    assert not who.goal_reached(np.zeros(3), np.zeros(2), plan[-1])


def test_a_turn_into_an_obstacle_is_refused():
    cost = np.zeros(SHAPE, np.uint8)
    cost[46:48, 42:46] = 254
    plan = np.array([[0.1, 0.0, 1.5]])
    assert decide(planner(), (0.0, 0.0, 0.0), plan=plan).omega > 0.0
    result = decide(planner(), (0.0, 0.0, 0.0), plan=plan, cost=cost)
    assert (result.ok, result.omega) == (False, 0.0)


@pytest.mark.parametrize(
    "change", [{"heading_scoring": True, "heading_scoring_timestep": 0.8}, {"simple_attractor": True}]
)
def test_the_other_scorings_lead_to_the_goal_too(change):
    result = decide(planner(BARN.model_copy(update=change)), (0.0, 0.0, 0.0), (0.3, 0.0))
    assert result.v > 0.3
    assert abs(result.omega) < 0.7


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.15, 0.6), st.booleans())
def test_a_command_never_leaves_the_limits(seed, limit, dwa):
    cost, plan, pose, velocity = random_scene(seed, 14)
    velocity[0] = min(velocity[0], limit)
    result = decide(planner(BARN.model_copy(update={"dwa": dwa})), pose, velocity, plan, cost, limit)
    if not result.ok:
        assert (result.v, result.omega) == (0.0, 0.0)
    else:
        assert result.v in (-0.5, 0.0) or 0.1 <= result.v <= min(0.5, limit) + 1e-9
        assert abs(result.omega) <= 1.57 + 1e-9


def test_driving_in_a_loop_it_passes_a_box_and_reaches_the_goal():
    cost = np.zeros(SHAPE, np.uint8)
    cost[38:42, 38:42] = 254
    x = np.linspace(-1.3, 1.2, 60)
    plan = np.column_stack((x, 0.8 * np.exp(-((x / 0.6) ** 2)), np.zeros(60)))
    who, pose, velocity = planner(), np.array([-1.3, 0.0, 0.0]), np.zeros(2)
    nearest = np.inf
    for _ in range(400):
        if who.goal_reached(pose, velocity, plan[-1]):
            break
        ahead = plan[np.argmin(np.hypot(plan[:, 0] - pose[0], plan[:, 1] - pose[1])) :]
        result = decide(who, pose, velocity, ahead, cost)
        velocity = np.array([result.v, result.omega])
        pose = pose + PERIOD * np.array([result.v * math.cos(pose[2]), result.v * math.sin(pose[2]), result.omega])
        nearest = min(nearest, math.hypot(max(abs(pose[0]) - 0.1, 0), max(abs(pose[1]) - 0.1, 0)))
    assert who.goal_reached(pose, velocity, plan[-1])
    assert 0.26 < nearest < 0.8

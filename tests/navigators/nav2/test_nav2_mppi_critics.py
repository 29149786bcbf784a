"""MPPI's critics against a second reading of the source, on random samples, paths and costmaps."""

import mppi_oracle as oracle
import numpy as np
import pytest
from mppi_scenes import scene

from clearway.navigators.nav2.controllers.mppi.critics.goal import GoalAngleCritic, GoalCritic
from clearway.navigators.nav2.controllers.mppi.critics.obstacles import CostCritic, ObstaclesCritic
from clearway.navigators.nav2.controllers.mppi.critics.path import PathAlignCritic, PathAngleCritic, PathFollowCritic
from clearway.navigators.nav2.controllers.mppi.critics.velocity import (
    ConstraintCritic,
    PreferForwardCritic,
    TwirlingCritic,
    VelocityDeadbandCritic,
)
from clearway.navigators.nav2.controllers.mppi.parameters import (
    ConstraintParameters,
    CostParameters,
    GoalAngleParameters,
    GoalParameters,
    MPPIParameters,
    ObstaclesParameters,
    PathAlignParameters,
    PathAngleParameters,
    PathFollowParameters,
    PreferForwardParameters,
    TwirlingParameters,
    VelocityDeadbandParameters,
)

CONTROLLER = MPPIParameters()
SEEDS = range(25)


def scored(critic, rollouts):
    """Costs of a critic on top of others, and whether it gives up."""
    costs = np.full(rollouts.samples.x.shape[1], 2.0, np.float32)
    return critic.score(rollouts, costs), costs.astype(float) - 2.0


def same(critic, rollouts, expected, tolerance=2e-5):
    gives_up, costs = scored(critic, rollouts)
    assert not gives_up
    np.testing.assert_allclose(costs, expected, rtol=tolerance, atol=tolerance * max(1.0, np.abs(expected).max()))
    return bool(np.any(expected != 0.0))


@pytest.mark.parametrize("model", ["diff", "omni", "ackermann"])
@pytest.mark.parametrize("power", [0, 1, 2, 3])
def test_velocity_critics(model, power):
    spoke = np.zeros(4, int)
    for seed in SEEDS:
        rollouts, plain = scene(seed, model)
        critics = (
            (ConstraintCritic(ConstraintParameters(cost_power=power), CONTROLLER),
             oracle.constraint(plain, 4.0, power, -0.35, 0.5, 0.5)),
            (PreferForwardCritic(PreferForwardParameters(cost_power=power), CONTROLLER),
             oracle.prefer_forward(plain, 5.0, power, 0.5)),
            (TwirlingCritic(TwirlingParameters(cost_power=power), CONTROLLER), oracle.twirling(plain, 10.0, power)),
            (VelocityDeadbandCritic(
                VelocityDeadbandParameters(cost_power=power, deadband_velocities=(0.1, -0.05, 0.2)), CONTROLLER),
             oracle.velocity_deadband(plain, 35.0, power, (0.1, -0.05, 0.2))),
        )  # fmt: skip
        spoke += [same(critic, rollouts, expected) for critic, expected in critics]
    assert np.all(spoke > len(SEEDS) // 2)


@pytest.mark.parametrize("power", [1, 2])
def test_goal_critics(power):
    spoke = 0
    for seed in SEEDS:
        rollouts, plain = scene(seed)
        near = GoalParameters(cost_power=power, threshold_to_consider=1.0)
        spoke += same(GoalCritic(near, CONTROLLER), rollouts, oracle.goal(plain, 5.0, power, 1.0))
        for symmetric in (False, True):
            angle = GoalAngleParameters(cost_power=power, threshold_to_consider=2.0, symmetric_yaw_tolerance=symmetric)
            expected = oracle.goal_angle(plain, 3.0, power, 2.0, symmetric)
            spoke += same(GoalAngleCritic(angle, CONTROLLER), rollouts, expected)
    assert len(SEEDS) < spoke < 3 * len(SEEDS)  # near and far


def test_path_follow():
    spoke = 0
    for seed in SEEDS:
        rollouts, plain = scene(seed, tracks_unknown=seed % 2 == 0)
        assert rollouts.furthest == oracle.furthest(plain)
        assert rollouts.valid.tolist() == oracle.valid(plain)
        follow = PathFollowParameters(threshold_to_consider=0.3, cost_power=1 + seed % 2)
        expected = oracle.path_follow(plain, 5.0, 1 + seed % 2, 0.3, 6)
        spoke += same(PathFollowCritic(follow, CONTROLLER), rollouts, expected)
    assert spoke > len(SEEDS) // 2


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_path_angle(mode):
    spoke = 0
    for seed in SEEDS:
        rollouts, plain = scene(seed)
        angle = PathAngleParameters(mode=mode, max_angle_to_furthest=0.5)
        expected = oracle.path_angle(plain, 2.2, 1, 0.5, 4, 0.5, mode)
        spoke += same(PathAngleCritic(angle, CONTROLLER), rollouts, expected)
    assert spoke > len(SEEDS) // 4


def test_a_base_that_does_not_reverse_is_not_asked_to_look_astern():
    rollouts, plain = scene(1)
    forward_only = MPPIParameters(vx_min=0.0)
    critic = PathAngleCritic(PathAngleParameters(mode=1, max_angle_to_furthest=0.0), forward_only)
    assert same(critic, rollouts, oracle.path_angle(plain, 2.2, 1, 0.5, 4, 0.0, 0))


@pytest.mark.parametrize("with_yaw", [False, True])
def test_path_align(with_yaw):
    spoke = 0
    for seed in SEEDS:
        rollouts, plain = scene(seed)
        step, offset = 1 + seed % 4, 3
        align = PathAlignParameters(
            offset_from_furthest=offset,
            trajectory_point_step=step,
            max_path_occupancy_ratio=0.4,
            use_path_orientations=with_yaw,
        )
        expected = oracle.path_align(plain, 10.0, 1, 0.5, offset, step, 0.4, with_yaw)
        spoke += same(PathAlignCritic(align, CONTROLLER), rollouts, expected)
    assert spoke > len(SEEDS) // 4


@pytest.mark.parametrize("footprint", [False, True])
@pytest.mark.parametrize("inflation", [0.6, 0.25, 0.0])
def test_costmap_critics(footprint, inflation):
    hits = 0
    for seed in SEEDS:
        rollouts, plain = scene(seed, tracks_unknown=seed % 3 > 0, inflation=inflation)
        near_goal = 0.5 + seed % 2
        cost = CostParameters(
            consider_footprint=footprint, near_goal_distance=near_goal, trajectory_point_step=1 + seed % 3
        )
        expected, all_collide = oracle.cost(plain, 3.81, 1, footprint, 300.0, 253, 1_000_000.0, near_goal, 1 + seed % 3)
        gives_up, costs = scored(CostCritic(cost, CONTROLLER), rollouts)
        assert gives_up == all_collide
        np.testing.assert_allclose(costs, expected, rtol=2e-5, atol=1e-4)
        hits += int((expected > 100.0).sum())

        near = ObstaclesParameters(consider_footprint=footprint, near_goal_distance=near_goal, collision_cost=1000.0)
        expected, all_collide = oracle.obstacles(plain, 1, footprint, 1.5, 20.0, 1000.0, 0.1, near_goal)
        gives_up, costs = scored(ObstaclesCritic(near, CONTROLLER), rollouts)
        assert gives_up == all_collide
        np.testing.assert_allclose(costs, expected, rtol=2e-5, atol=1e-3)
    assert hits > 50


def test_all_samples_in_a_wall_fail():
    rollouts, plain = scene(3)
    rollouts.view.cost[:] = 254
    assert scored(CostCritic(CostParameters(), CONTROLLER), rollouts)[0]
    assert scored(ObstaclesCritic(ObstaclesParameters(), CONTROLLER), rollouts)[0]
    assert oracle.cost(plain, 3.81, 1, False, 300.0, 253, 1e6, 0.5, 2)[1]

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from simulated_room import cast, drive, forth_and_back, make_robot, room_map

from clearway.contract import Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.perception import Amcl, AmclParameters, make_localiser
from clearway.perception import particle_filter as pf
from clearway.perception.amcl import likelihood_field, room_at

PAL = {  # TIAGo's public amcl.yaml
    "min_particles": 500,
    "max_particles": 5000,
    "kld_err": 0.05,
    "update_min_d": 0.2,
    "update_min_a": 0.1745,
    "resample_interval": 1,
    "odom_model_type": "diff-corrected",
    "odom_alpha1": 0.02,
    "odom_alpha2": 0.002,
    "odom_alpha3": 0.08,
    "odom_alpha4": 0.002,
    "laser_z_hit": 0.5,
    "laser_z_rand": 0.5,
}
ROBOT = make_robot(
    localisation={"amcl": PAL},
    odometry={"translation_per_metre": 0.01, "rotation_per_metre": 0.01, "rotation_per_radian": 0.02, "scale": 0.01},
)
START = np.array((2.0, 2.5, 0.0))


def run(name: str, sensed: list[Sensing], believed: np.ndarray, seed: int, robot=ROBOT) -> np.ndarray:  # type: ignore[no-untyped-def]
    localiser = make_localiser(name, robot)
    localiser.reset(Task(0.1, 0.6, believed, room_map()), robot, np.random.default_rng(seed))
    return np.array([localiser.update(s) for s in sensed])


def test_amcl_bounds_the_error_that_odometry_lets_grow() -> None:
    finals: dict[str, list[float]] = {"amcl": [], "odometry": [], "truth": []}
    for seed in range(8):
        sensed = drive(START, forth_and_back(), ROBOT, seed)
        believed = START + np.random.default_rng(seed).uniform(-1, 1, 3) * (0.02, 0.02, 0.03)
        for name, errors in finals.items():
            estimate = run(name, sensed, believed, seed)
            errors.append(float(np.hypot(*(estimate[-1] - sensed[-1].truth)[:2])))
    assert max(finals["truth"]) == 0.0
    assert max(finals["amcl"]) < 0.06
    assert np.mean(finals["amcl"]) < 0.03
    assert np.mean(finals["odometry"]) > 3 * np.mean(finals["amcl"])


def test_amcl_finds_back_from_a_start_that_is_half_a_metre_wrong() -> None:
    robot = make_robot(
        localisation={"amcl": PAL | {"initial_cov_xx": 0.25, "initial_cov_yy": 0.25, "initial_cov_aa": 0.07}}
    )
    sensed = drive(START, forth_and_back(), robot, 1)
    estimate = run("amcl", sensed, START + np.array((-0.4, 0.3, 0.2)), 1, robot)
    assert np.hypot(*(estimate[0] - sensed[0].truth)[:2]) > 0.4
    assert np.hypot(*(estimate[-1] - sensed[-1].truth)[:2]) < 0.06


def test_same_seed_same_bits_and_another_seed_other_ones() -> None:
    sensed = drive(START, forth_and_back()[:60], ROBOT, 3)
    first, again, other = (run("amcl", sensed, START, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0


def test_between_updates_the_estimate_follows_the_odometry() -> None:
    sensed = drive(START, np.tile((0.5, 0.0), (4, 1)), make_robot(), 0)  # 0.15 m: below update_min_d
    estimate = run("amcl", sensed, START, 0)
    steps = np.hypot(*np.diff(estimate[:, :2], axis=0).T)
    odom = np.hypot(*np.diff([s.odom_pose[:2] for s in sensed], axis=0).T)
    np.testing.assert_allclose(steps, odom, rtol=1e-9)


def test_fewer_particles_once_it_knows_where_it_is() -> None:
    localiser = Amcl(AmclParameters.model_validate(PAL))
    localiser.reset(Task(0.1, 0.6, START, room_map()), ROBOT, np.random.default_rng(0))
    assert len(localiser.poses) == 5000
    for sensing in drive(START, forth_and_back()[:60], ROBOT, 0):
        localiser.update(sensing)
    assert 500 <= len(localiser.poses) < 1000
    assert localiser.weights.sum() == pytest.approx(1.0)


def test_likelihood_field_against_the_formula_cell_by_cell() -> None:
    data = np.full((20, 30), FREE, dtype=np.int8)
    data[4, 7] = data[15, 22] = OCCUPIED
    grid = OccupancyGrid(data, 0.1, (1.0, 2.0))
    field, outside = likelihood_field(grid, 0, 0.5, 0.05, 0.2, 1.0, False)
    for row, col in ((4, 7), (4, 9), (10, 15), (19, 0), (15, 20)):
        d = min(1.0, 0.1 * min(math.hypot(row - 4, col - 7), math.hypot(row - 15, col - 22)))
        assert field[row, col] == pytest.approx((0.5 * math.exp(-(d**2) / 0.08) + 0.05) ** 3, rel=1e-12)
    assert outside == pytest.approx((0.5 * math.exp(-1 / 0.08) + 0.05) ** 3)
    logs, _ = likelihood_field(grid, 0, 0.5, 0.05, 0.2, 1.0, True)
    np.testing.assert_allclose(np.exp(logs) ** 3, field)


def test_only_the_faces_of_the_robots_room_attract_beams() -> None:
    data = np.full((40, 40), FREE, dtype=np.int8)
    data[:, 18:22] = OCCUPIED  # a wall four cells thick between two rooms
    grid = OccupancyGrid(data, 0.05, (0.0, 0.0))
    left = room_at(grid, 0.2, 1.0)
    assert left != room_at(grid, 1.8, 1.0)
    assert room_at(grid, 1.0, 1.0) == room_at(grid, -1.0, 1.0) == 0
    field, _ = likelihood_field(grid, left, 0.5, 0.05, 0.05, 2.0, False)
    assert np.argmax(field[20]) == 18
    assert field[20, 19] < field[20, 18]


@pytest.mark.parametrize("name", ["likelihood_field", "likelihood_field_prob"])
def test_both_sensor_models_prefer_the_true_pose(name: str) -> None:
    p = AmclParameters(laser_model_type=name, max_particles=2, min_particles=1)  # type: ignore[arg-type]
    localiser = Amcl(p)
    localiser.reset(Task(0.1, 0.6, START, room_map()), ROBOT, np.random.default_rng(0))
    localiser.poses = np.array((START, START + np.array((0.15, 0.1, 0.05))))
    localiser._sense(cast(START, ROBOT))
    assert localiser.weights[0] > localiser.weights[1]


def test_what_amcl_needs_is_said_in_one_line() -> None:
    with pytest.raises(ClearwayError, match="needs a map"):
        make_localiser("amcl", ROBOT).reset(Task(0.1, 0.6, START), ROBOT, np.random.default_rng(0))
    blind = make_robot(lidar=None)
    with pytest.raises(ClearwayError, match="needs a lidar"):
        make_localiser("amcl", blind).reset(Task(0.1, 0.6, START, room_map()), blind, np.random.default_rng(0))
    with pytest.raises(ClearwayError, match="did you mean 'odometry'"):
        make_localiser("odometri", ROBOT)
    wrong = make_robot(localisation={"amcl": {"laser_max_beam": 30}})
    with pytest.raises(ClearwayError, match=r"localisation\.amcl\.laser_max_beam: .*laser_max_beams"):
        make_localiser("amcl", wrong)


def test_lost_robot_recovers_with_random_poses() -> None:
    robot = make_robot(
        localisation={"amcl": PAL | {"recovery_alpha_slow": 0.02, "recovery_alpha_fast": 0.5, "min_particles": 5000}}
    )
    localiser = make_localiser("amcl", robot)
    assert isinstance(localiser, Amcl)
    localiser.reset(Task(0.1, 0.6, START, room_map()), robot, np.random.default_rng(0))
    sensed = drive(START, np.tile((0.6, 0.0), (80, 1)), robot, 0)
    for sensing in sensed[:40]:
        localiser.update(sensing)
    strays = (np.hypot(*(localiser.poses[:, :2] - sensed[39].truth[:2]).T) > 1.0).mean()
    kidnapped = drive(np.array((8.0, 5.0, 3.0)), np.tile((0.6, 0.0), (41, 1)), robot, 0)
    for k in range(40, 48):  # the odometry goes on as if nothing had happened
        s = sensed[k]
        localiser.update(
            Sensing(s.t, s.odom_pose, s.odom_velocity, kidnapped[k - 40].scan, None, s.goal, kidnapped[k - 40].truth)
        )
    assert (np.hypot(*(localiser.poses[:, :2] - sensed[47].truth[:2]).T) > 1.0).mean() > max(0.05, 5 * strays)


def test_kld_limit_is_the_chi_square_bound() -> None:
    from clearway.perception.particle_filter import kld_limit

    for bins in (5, 20, 100):
        exact = stats.chi2.ppf(stats.norm.cdf(2.33), bins - 1) / (2 * 0.05)
        assert kld_limit(bins, 1, 100_000, 0.05, 2.33) == pytest.approx(exact, rel=0.02)
    assert kld_limit(1, 10, 777, 0.05, 0.99) == 777
    assert kld_limit(2, 10, 777, 0.05, 0.99) == pytest.approx(stats.chi2.ppf(stats.norm.cdf(0.99), 1) / 0.1, rel=0.1)


@pytest.mark.parametrize("corrected", [False, True])
def test_particles_of_an_omnidirectional_base_move_to_its_side(corrected: bool) -> None:
    """A metre to its left while it turns by 0.5 rad: they follow, and spread along by alpha3, across by alpha5."""
    old, new = np.array([3.0, 1.0, 0.4]), np.array([3.0 - math.sin(0.4), 1.0 + math.cos(0.4), 0.9])
    poses = np.tile([5.0, 5.0, 0.0], (20_000, 1))
    alpha = np.array([0.0, 0.0004, 0.01, 0.0, 0.0025])
    pf.move_anywhere(poses, old, new, alpha, corrected, np.random.default_rng(1))
    assert poses.mean(0) == pytest.approx([5.0, 6.0, 0.5], abs=5e-3)
    expected = np.array([0.0025, 0.01, 0.0004])  # across is along x here
    assert poses.std(0) == pytest.approx(np.sqrt(expected) if corrected else expected, rel=0.05)

"""MPPIController as a whole: driving a path in a closed loop, failing, its parameters."""

import math

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.nav2.controllers.mppi import MPPIController, MPPIParameters
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.seams import CostView, NoValidControl, Tolerances, Velocity

pytestmark = pytest.mark.slow  # compiles for long

CRITICS = (
    "ConstraintCritic", "CostCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic", "PathFollowCritic",
    "PathAngleCritic", "PreferForwardCritic",
)  # fmt: skip
TOLERANCES = Tolerances(0.25, 0.25)
STANDING = Velocity(0.0, 0.0, 0.0)


def table(**given):
    """Nav2's default file, with fewer samples."""
    return {
        "batch_size": 300, "critics": CRITICS, "regenerate_noises": True, "CostCritic": {"near_goal_distance": 1.0},
        "PathAlignCritic": {"cost_weight": 14.0, "max_path_occupancy_ratio": 0.05},
        "PathFollowCritic": {"offset_from_furthest": 5}, "PathAngleCritic": {"cost_weight": 2.0, "max_angle_to_furthest": 1.0},
    } | given  # fmt: skip


def make(given, frequency=20.0, seed=0):
    spaces = {name: kind.model_validate(given.get(name, {})) for name, kind in MPPIParameters.children(given).items()}
    return MPPIController(MPPIParameters.model_validate(given), spaces, frequency, np.random.default_rng(seed))


def ground(centre, obstacles=(), radius=0.2):
    """A rolling window of 3 m with discs of obstacles, inflated."""
    resolution, cells = 0.05, 60
    origin = np.floor((np.asarray(centre) - 1.5) / resolution) * resolution
    rows, columns = np.mgrid[:cells, :cells]
    x, y = origin[0] + (columns + 0.5) * resolution, origin[1] + (rows + 0.5) * resolution
    cost = np.zeros((cells, cells), np.uint8)
    for ox, oy, r in obstacles:
        away = np.maximum(np.hypot(x - ox, y - oy) - r, 0.0)
        inflated = np.where(away <= radius, 253, 252 * np.exp(-3.0 * (away - radius)) * (away < 0.7))
        cost = np.maximum(cost, np.where(away == 0.0, 254, inflated).astype(np.uint8))
    return CostView(cost, origin, resolution, outline(Circle(radius)), radius, radius, 3.0, 0.7, True)


def straight(length=2.5, y=0.0):
    x = np.arange(0.0, length + 0.01, 0.05)
    return np.column_stack((x, np.full_like(x, y), np.zeros_like(x)))


def drive(controller, path, pose=(0.0, 0.0, 0.0), steps=200, obstacles=()):
    """Poses and commands until the goal is 0.1 m away."""
    pose, velocity, poses, commands = np.array(pose, float), STANDING, [], []
    for k in range(steps):
        nearest = int(np.argmin(np.hypot(*(path[:, :2] - pose[:2]).T)))
        view = ground(pose[:2], obstacles)
        velocity = controller.compute(
            0.05 * k, pose, velocity, path[nearest : nearest + 30], path[-1], TOLERANCES, view
        )
        c, s = math.cos(pose[2]), math.sin(pose[2])
        pose = pose + 0.05 * np.array(
            [velocity.v_x * c - velocity.v_y * s, velocity.v_x * s + velocity.v_y * c, velocity.omega]
        )
        poses.append(pose)
        commands.append(velocity)
        if math.hypot(*(pose[:2] - path[-1, :2])) < 0.1:
            break
    return np.array(poses), np.array(commands)


def model(plugin, **own):
    return {"motion_model": "base", "base": {"plugin": plugin, **own}}


def test_it_drives_a_path_at_speed_and_ends_at_the_goal():
    poses, commands = drive(make(table()), straight())
    assert math.hypot(*(poses[-1, :2] - (2.5, 0.0))) < 0.1
    assert np.abs(poses[:, 1]).max() < 0.15
    assert np.median(commands[20:-20, 0]) > 0.4
    assert np.all(commands[:, 0] <= 0.5 + 1e-6)
    assert np.all(np.abs(np.diff(commands[:, 0])) <= 3.0 * 0.05 + 1e-6)
    assert np.all(commands[:, 1] == 0.0)


def test_it_goes_around_what_stands_on_the_path():
    obstacle = (1.3, 0.05, 0.1)
    poses, _ = drive(make(table()), straight(), steps=400, obstacles=[obstacle])
    assert math.hypot(*(poses[-1, :2] - (2.5, 0.0))) < TOLERANCES.xy
    assert np.hypot(poses[:, 0] - 1.3, poses[:, 1] - 0.05).min() > 0.3


def test_an_omnidirectional_base_steps_aside_and_a_car_keeps_its_radius():
    beside = straight(1.0, y=0.5)
    poses, commands = drive(make(table(**model("mppi::OmniMotionModel"))), beside, steps=120)
    assert np.abs(commands[:, 1]).max() > 0.1
    assert math.hypot(*(poses[-1, :2] - beside[-1, :2])) < 0.1
    car = make(table(**model("mppi::AckermannMotionModel", min_turning_r=0.5)))
    _, commands = drive(car, straight(), pose=(0.0, 0.3, 0.8), steps=150)
    assert np.all(np.abs(commands[:, 2]) <= np.abs(commands[:, 0]) / 0.5 + 1e-6)


@pytest.mark.parametrize("regenerates", [False, True])
def test_same_seed_same_bits(regenerates):
    given = table(regenerate_noises=regenerates)
    first, again, other = (drive(make(given, seed=seed), straight(), steps=25)[1] for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_wall_all_around_is_no_valid_control_and_forgets_the_sequence():
    controller, path = make(table()), straight()
    _, commands = drive(controller, path, steps=20)
    view = ground((0.5, 0.0))
    view.cost[:] = 254
    with pytest.raises(NoValidControl, match="collide"):
        controller.compute(
            1.0, np.array([0.5, 0.0, 0.0]), Velocity(0.5, 0.0, 0.0), path[10:40], path[-1], TOLERANCES, view
        )
    # it begins anew, from standing: a slower command than one that continued
    after = controller.compute(1.05, np.zeros(3), STANDING, path[:30], path[-1], TOLERANCES, ground((0.0, 0.0)))
    assert after.v_x < 0.2 < commands[-1, 0]


def test_the_validator_refuses_what_critics_let_pass():
    given = table(critics=("PathFollowCritic",), retry_attempt_limit=0)
    path, wall = straight(), [(0.45, 0.0, 0.15)]
    blind = make(given | {"TrajectoryValidator": {"collision_lookahead_time": 0.0}})
    poses, _ = drive(blind, path, steps=30, obstacles=wall)
    assert poses[-1, 0] > 0.4
    with pytest.raises(NoValidControl, match="comes out collides"):
        drive(make(given), path, steps=30, obstacles=wall)


def test_speed_limit_open_loop_and_silence():
    controller = make(table())
    controller.set_speed_limit(50.0, True)
    assert 0.2 < drive(controller, straight(), steps=40)[1][:, 0].max() <= 0.25 + 1e-6
    controller.reset()  # as the controller server does whenever a path is done
    assert drive(controller, straight(), steps=40)[1][:, 0].max() <= 0.25 + 1e-6
    controller.set_speed_limit(0.1, False)
    assert drive(controller, straight(), steps=40)[1][-10:, 0].max() <= 0.1 + 1e-6
    controller.set_speed_limit(0.0, False)
    assert drive(controller, straight(), steps=40)[1][:, 0].max() > 0.4

    view, path = ground((0.0, 0.0)), straight()
    for open_loop in (False, True):  # told that it stands, it goes two steps of acceleration beyond that, if it looks
        controller = make(table(open_loop=open_loop))
        for k in range(30):
            command = controller.compute(0.05 * k, np.zeros(3), STANDING, path, path[-1], TOLERANCES, view)
        assert (command.v_x > 0.3 + 1e-6) == open_loop

    for period, forgets in ((None, False), (1.0, True)):
        controller = make(table(reset_period=period, open_loop=True))
        for k in range(15):
            controller.compute(0.05 * k, np.zeros(3), STANDING, path, path[-1], TOLERANCES, view)
        command = controller.compute(9.0, np.zeros(3), STANDING, path, path[-1], TOLERANCES, view)
        assert (command.v_x < 0.2) == forgets


def test_periods():
    path, view = straight(), ground((0.0, 0.0))
    command = make(table(), frequency=30.0).compute(0.0, np.zeros(3), STANDING, path, path[-1], TOLERANCES, view)
    assert 0.0 < command.v_x <= 3.0 / 30.0 + 1e-6
    with pytest.raises(ClearwayError, match="shorter than a control period"):
        make(table(), frequency=10.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"critics": ("CostCritic", "CostCritic")}, "'CostCritic' twice"),
        ({"critics": ("CostCritics",)}, "did you mean 'CostCritic'"),
        ({"critics": ("PathAlignLegacyCritic",)}, "closest is PathAlignCritic"),
        ({"motion_model": "diff_drive"}, r"diff_drive.plugin: is None; write the motion model's plug-in there"),
        (model("mppi::Tricycle"), "one of mppi::DiffDriveMotionModel"),
    ],
)
def test_bad_files_are_one_clear_error(given, message):
    with pytest.raises(ClearwayError, match=message):
        settle(MPPIParameters, table(**given), "FollowPath", None)


@pytest.mark.parametrize(
    "given",
    [
        {"batch_size": -1},
        {"time_steps": 1},
        {"model_dt": 0.0},
        {"vx_std": 0.0},
        {"temperature": 0.0},
        {"iteration_count": 0},
    ],
)
def test_numbers_out_of_bounds(given):
    with pytest.raises(ValueError, match="greater than"):
        MPPIParameters.model_validate(given)


def test_a_file_of_jazzy_names_its_motion_model_itself():
    given = table(motion_model="Ackermann", AckermannConstraints={"min_turning_r": 0.7})
    _, commands = drive(make(given), straight(), pose=(0.0, 0.2, 0.5), steps=30)
    assert np.abs(commands[:, 2]).max() > 0.0
    assert np.all(np.abs(commands[:, 2]) <= np.abs(commands[:, 0]) / 0.7 + 1e-6)
    given = table(motion_model="DiffDrive", AckermannConstraints={"min_turning_r": 0.7})
    _, commands = drive(make(given), straight(), pose=(0.0, 0.2, 0.5), steps=30)
    assert np.any(np.abs(commands[:, 2]) > np.abs(commands[:, 0]) / 0.7 + 1e-6)

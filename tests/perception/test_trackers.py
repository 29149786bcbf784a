"""Velocities are right where they can be, bounds hold, what stands stays put however the robot moves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from simulated_room import cast, drive, make_robot, room_map

from clearway.contract import Goal, Obstacles, Scan, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, FloatArray, rectangle
from clearway.perception import TRACKERS, TrackerParameters, make_tracker
from clearway.robots import Robot
from perceived import obstacles

GOAL = Goal(np.zeros(3), 0.2, 0.2)
CAMERA = {"camera": {"range": 4.0, "error": 0.01}, "lidar": None}
PERIOD = 0.15
BOTH = pytest.mark.parametrize("name", sorted(TRACKERS))


def fresh(name: str, robot: Robot, **task: object):  # type: ignore[no-untyped-def]
    tracker = make_tracker(name, robot)
    tracker.reset(Task(PERIOD, 1.0, np.zeros(3), **task), robot, np.random.default_rng(0))  # type: ignore[arg-type]
    return tracker


def seen(position: object, identity: object = None, error: float = 0.01, moving: object = True) -> Obstacles:
    wrong = np.where(moving, error, 0.0)
    return obstacles(position, error=wrong, velocity_error=np.nan, identity=identity, moving=moving)


def sensing(
    t: float, obstacles: Obstacles | None = None, scan: Scan | None = None, odom: object = (0.0, 0.0, 0.0)
) -> Sensing:
    return Sensing(t, np.array(odom, dtype=float), np.zeros(2), scan, obstacles, GOAL, np.zeros(3))


def test_a_difference_by_hand() -> None:
    tracker = fresh("difference", make_robot(**CAMERA))
    first = tracker.update(sensing(0.0, seen([[1, 2], [5, 5]], [7, 3])), np.zeros(3))
    assert first.velocity.tolist() == [[0, 0], [0, 0]]
    assert first.velocity_error.tolist() == [math.inf, math.inf]
    again = tracker.update(sensing(0.15, seen([[5, 5.3], [1.15, 1.7], [0, 0]], [3, 7, 9])), np.zeros(3))
    assert again.velocity == pytest.approx(np.array([[0, 2], [1, -2], [0, 0]]))
    bound = 2 * 0.01 / 0.15 + 0.5 * math.sqrt(2) * TrackerParameters().acceleration * 0.15
    assert again.velocity_error == pytest.approx([bound, bound, math.inf])
    assert again.error.tolist() == [0.01] * 3
    gone = tracker.update(sensing(0.3, seen([[5, 5.6]], [3])), np.zeros(3))
    back = tracker.update(sensing(0.45, seen([[5, 5.6], [1, 1]], [3, 7])), np.zeros(3))
    assert gone.velocity == pytest.approx(np.array([[0, 2]]))
    assert back.velocity == pytest.approx(np.array([[0, 0], [0, 0]]))
    assert back.velocity_error[1] == math.inf  # no memory beyond the last frame


@BOTH
def test_what_stands_is_taken_as_measured(name: str) -> None:
    tracker = fresh(name, make_robot(**CAMERA))
    for k in range(5):
        out = tracker.update(sensing(PERIOD * k, seen([[1, 2], [0.1 * k, 0]], moving=[False, True])), np.zeros(3))
    assert out.position[0].tolist() == [1, 2]
    assert (out.velocity[0].tolist(), out.error[0], out.velocity_error[0]) == ([0, 0], 0, 0)
    assert out.velocity[1, 0] == pytest.approx(0.1 / PERIOD, abs=0.05)
    assert out.moving.tolist() == [False, True]
    assert out.radius.tolist() == [0.35, 0.35]


def oscillators(rng: np.random.Generator, n: int, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """True positions and velocities (periods, n, 2) by paper B's eqs. 6-7 in closed form."""
    attraction, start = rng.uniform(1.5, 12.5, (2, n, 2))
    speed = rng.uniform(-0.5, 0.5, (n, 2))
    stiffness = 0.2 * (1 + 4 * rng.uniform(size=(n, 1))) / (2.0 + np.linalg.norm(start - attraction, axis=1)[:, None])
    w = np.sqrt(stiffness)
    t = PERIOD * np.arange(periods)[:, None, None]
    x = attraction + (start - attraction) * np.cos(w * t) + speed / w * np.sin(w * t)
    v = -(start - attraction) * w * np.sin(w * t) + speed * np.cos(w * t)
    return x, v


def in_a_disc(rng: np.random.Generator, shape: tuple[int, ...], radius: float) -> np.ndarray:
    angle, r = rng.uniform(0, 2 * math.pi, shape), radius * np.sqrt(rng.uniform(size=shape))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)


@BOTH
def test_bounds_hold_on_paper_b_s_obstacles(name: str) -> None:
    """In at least 98.9 % (3 sigma in the plane), hence in all for finite differences; and Kalman's are the smaller."""
    rng = np.random.default_rng(5)
    x, v = oscillators(rng, 200, 60)
    noise = in_a_disc(rng, x.shape[:2], 0.01)
    tracker, held, close, errors, bounds = fresh(name, make_robot(**CAMERA)), [], [], [], []
    for k in range(60):
        out = tracker.update(sensing(PERIOD * k, seen(x[k] + noise[k])), np.zeros(3))
        off = np.linalg.norm(out.velocity - v[k], axis=1)
        held.append(off <= out.velocity_error + 1e-12)
        close.append(np.linalg.norm(out.position - x[k], axis=1) <= out.error + 1e-12)
        if k >= 10:
            errors.append(off)
            bounds.append(out.velocity_error)
    least = {"difference": 1.0, "kalman": 0.989}[name]
    assert np.mean(held) >= least
    assert np.mean(close) >= least
    rmse = math.sqrt(np.mean(np.square(errors)))
    assert rmse < {"difference": 0.075, "kalman": 0.06}[name]
    assert np.mean(bounds) < {"difference": 0.25, "kalman": 0.18}[name]


@pytest.mark.parametrize("error", [0.0, 1e-6])
def test_told_exactly_a_velocity_that_changes_at_once_is_known_soon(error: float) -> None:
    tracker = fresh("kalman", make_robot(**CAMERA))
    x, told = 0.0, []
    for k in range(30):
        v = 0.5 if k < 15 else -0.7
        told.append(tracker.update(sensing(k * PERIOD, seen([[x, 0.0]], error=error)), np.zeros(3)).velocity[0, 0] - v)
        x += v * PERIOD
    assert np.abs(told[4:15]).max() < 1e-2
    assert np.abs(told[16:]).max() < 0.2
    assert np.abs(told[19:]).max() < 1e-2


def test_kalman_remembers_an_obstacle_for_a_while() -> None:
    tracker = fresh("kalman", make_robot(**CAMERA))
    for k in range(20):
        tracker.update(sensing(PERIOD * k, seen([[0.15 * k, 0], [3, 3]], [4, 8])), np.zeros(3))
    for k in (20, 21, 22):
        out = tracker.update(sensing(PERIOD * k, seen([[3, 3]], [8])), np.zeros(3))
        assert out.identity.tolist() == [8]
    out = tracker.update(sensing(PERIOD * 23, seen([[3, 3], [0.15 * 23, 0]], [8, 4])), np.zeros(3))
    assert out.velocity[1] == pytest.approx([1.0, 0.0], abs=0.03)
    for k in range(24, 40):  # longer than it remembers
        tracker.update(sensing(PERIOD * k, seen([[3, 3]], [8])), np.zeros(3))
    out = tracker.update(sensing(PERIOD * 40, seen([[0.15 * 40, 0]], [4])), np.zeros(3))
    assert out.velocity[0].tolist() == [0, 0]
    assert out.velocity_error[0] == pytest.approx(TrackerParameters().speed)


@BOTH
def test_odd_observations_of_a_camera(name: str) -> None:
    tracker = fresh(name, make_robot(**CAMERA))
    for k in range(3):
        assert len(tracker.update(sensing(PERIOD * k, seen([])), np.zeros(3))) == 0
    many = np.random.default_rng(0).uniform(0, 14, (1000, 2))
    for k in range(3, 6):
        many[7] = (math.nan, 1.0)
        many[9] = (math.inf, 1.0)
        out = tracker.update(sensing(PERIOD * k, seen(many, np.random.default_rng(k).permutation(1000))), np.zeros(3))
        assert len(out) == 998
        assert np.isfinite(out.position).all()
        assert np.isfinite(out.velocity).all()
        assert not np.isnan(out.velocity_error).any()
    same = tracker.update(sensing(PERIOD * 5, seen([[1, 1]])), np.zeros(3))  # no time has passed
    assert np.isfinite(same.velocity).all()
    with pytest.raises(ClearwayError, match="camera"):
        tracker.update(sensing(1.0), np.zeros(3))


def test_names_and_sensors_are_checked() -> None:
    with pytest.raises(ClearwayError, match=r"unknown tracking 'kalmann'; did you mean 'kalman'\?"):
        make_tracker("kalmann", make_robot())
    with pytest.raises(ClearwayError, match="neither a camera nor a lidar"):
        make_tracker("kalman", make_robot(lidar=None))
    with pytest.raises(ClearwayError, match="scan"):
        fresh("kalman", make_robot()).update(sensing(0.0), np.zeros(3))


@BOTH
@pytest.mark.parametrize("ranges", [np.empty(0), np.full(181, np.nan), np.full(181, np.inf)])
def test_odd_scans(name: str, ranges: np.ndarray) -> None:
    tracker = fresh(name, make_robot())
    for k in range(12):
        scan = Scan(ranges, -1.9, 3.8 / 180, 0.05, 12.0, np.zeros(3))
        assert len(tracker.update(sensing(0.1 * k, scan=scan), np.zeros(3))) == 0
    scan = Scan(np.array([1.0]), 0.0, 0.0, 0.05, 12.0, np.zeros(3))
    out = tracker.update(sensing(1.3, scan=scan), np.zeros(3))
    assert out.position == pytest.approx(np.array([[1.0, 0.0]]))


WINDING = np.array([(0.5, 0.9 * math.cos(0.12 * k)) for k in range(80)])


@pytest.mark.parametrize("granted", [True, False])
def test_nothing_moves_in_a_room_that_stands_while_the_robot_drives_and_turns(granted: bool) -> None:
    robot = make_robot()
    for seed in range(3):
        tracker = fresh("kalman", robot, map=room_map() if granted else None)
        for step in drive(np.array([1.0, 2.5, 0.0]), WINDING, robot, seed):
            out = tracker.update(step, step.truth)
            assert not out.moving.any()
            assert (out.velocity == 0).all()
            assert (out.error == 0).all()


def test_nothing_moves_among_posts_while_a_base_turns_about_a_point_ahead_of_its_middle() -> None:
    """Wheels know how that point moves, so the odometry has the middle stand that swings by 5 cm."""
    drive = make_robot().drive.model_dump() | {"pivot": 0.05, "omega_max": 4.0}
    robot = make_robot(drive=drive, lidar=TIM | {"mount": [0.1, 0.0, 0.0], "sigma": 0.001})
    rng, rays = np.random.default_rng(2), beams(606, -1.745, 1.745, 0.05, 25.0)
    at = np.column_stack((rng.uniform((1.0, -3.0), (7.0, 3.0), (40, 2)), np.zeros(40)))
    posts = scene([Circle(0.075)] * 40, at)
    tracker, told = fresh("kalman", robot), []
    for k in range(60):
        theta = 1.5 * math.sin(2.0 * 0.1 * k)
        x, y = 0.05 * (1.0 - math.cos(theta)), -0.05 * math.sin(theta)
        truth, c, s = np.array((x, y, theta)), math.cos(theta), math.sin(theta)
        ranges = sweep(posts, rays, np.array((x + 0.1 * c, y + 0.1 * s, theta)))
        scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 25.0, np.array([0.1, 0.0, 0.0]))
        out = tracker.update(sensing(0.1 * k, scan=scan, odom=(0.0, 0.0, theta)), truth)
        told.append(out.moving.any())
    assert not any(told)


def test_a_correction_of_the_localisation_is_no_velocity() -> None:
    """The estimate jumps by 0.3 m and 0.1 rad: the discs follow it, and none gets a speed."""
    robot, tracker = make_robot(), fresh("kalman", make_robot())
    for k, step in enumerate(drive(np.array([1.0, 2.5, 0.0]), WINDING[:30], robot, 1)):
        jump = np.array([0.3, 0.0, 0.1]) * (k >= 20)
        before = tracker.update(step, step.truth + jump)
        assert (before.velocity == 0).all()


def moving_scene(
    body: object,
    velocity: np.ndarray,
    robot: Robot,
    commands: np.ndarray,
    seed: int = 3,
    start: tuple[float, float] = (3.5, 0.4),
):  # type: ignore[no-untyped-def]
    """A robot from the origin, four walls, and a body that goes straight: (sensing, true pose, true position) each period."""
    rng = np.random.default_rng(seed)
    lidar = robot.lidar
    assert lidar is not None
    walls = [(rectangle(12, 0.2), (3, 4, 0)), (rectangle(12, 0.2), (3, -4, 0)), (rectangle(0.2, 8), (9, 0, 0))]
    rays = beams(lidar.beams, lidar.angle_min, lidar.angle_max, lidar.range_min, lidar.range_max)
    truth, odom = np.zeros(3), np.zeros(3)
    for k, (v, omega) in enumerate(commands):
        at = np.array(start) + velocity * 0.1 * k
        heading = math.atan2(velocity[1], velocity[0])
        shapes, poses = zip(*walls, (body, (*at, heading)), strict=True)
        c, s = math.cos(truth[2]), math.sin(truth[2])
        eye = np.array([truth[0] + 0.1 * c, truth[1] + 0.1 * s, truth[2]])
        ranges = sweep(scene(shapes, np.array(poses, dtype=float)), rays, eye) + lidar.sigma * rng.standard_normal(
            lidar.beams
        )
        step = (lidar.angle_max - lidar.angle_min) / (lidar.beams - 1)
        scan = Scan(ranges, lidar.angle_min, step, lidar.range_min, lidar.range_max, np.array([0.1, 0.0, 0.0]))
        yield Sensing(0.1 * k, odom.copy(), np.array([v, omega]), scan, None, GOAL, truth.copy()), truth.copy(), at
        for pose, noise in ((truth, 0.0), (odom, 0.02 * math.sqrt(abs(omega) * 0.1) * rng.standard_normal())):
            turn = omega * 0.1 + noise
            pose += (v * 0.1 * math.cos(pose[2] + turn / 2), v * 0.1 * math.sin(pose[2] + turn / 2), turn)


TIM = {"beams": 606, "angle_min": -1.745, "angle_max": 1.745, "range_min": 0.05, "range_max": 25.0, "sigma": 0.02}


@pytest.mark.parametrize(
    ("body", "velocity"),
    [
        (Circle(0.27), (-0.6, 0.0)),
        (Circle(0.27), (0.0, -0.6)),
        (Circle(0.27), (0.3, 0.2)),
        (Circle(0.27), (-0.2, 0.0)),
        (rectangle(0.6, 0.6), (-0.5, 0.3)),
        (rectangle(0.6, 0.6), (0.0, -1.0)),
        (Circle(0.1), (-0.4, -0.8)),
    ],
)
def test_a_body_that_moves_is_found_and_its_velocity_within_the_bound(
    body: object, velocity: tuple[float, float]
) -> None:
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0]})
    tracker, v = fresh("kalman", robot), np.array(velocity)
    commands = np.array([(0.3, 0.4 * math.sin(0.2 * k)) for k in range(35)])
    found, within, ids, off = [], [], set(), []
    for k, (step, pose, at) in enumerate(moving_scene(body, v, robot, commands)):
        out = tracker.update(step, pose)
        near = np.linalg.norm(out.position - at, axis=1) < 0.6
        assert not (out.moving & ~near).any()  # neither walls nor ghosts
        if k < 18:
            continue
        found.append((out.moving & near).any())
        for i in np.flatnonzero(out.moving):
            off.append(np.linalg.norm(out.velocity[i] - v))
            within.append(off[-1] <= out.velocity_error[i])
            ids.add(int(out.identity[i]))
    assert np.mean(found) > 0.9
    assert np.mean(within) >= 0.95
    assert np.median(off) < 0.2
    assert len(ids) == 1


def test_who_stands_on_two_legs_may_walk_and_a_post_does_not() -> None:
    """From the first look on a person is told as one that moves, as wide as the shoulders; a single post stays structure."""
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0], "height": 0.2})
    assert robot.lidar is not None
    tracker, rng, mount = fresh("kalman", robot), np.random.default_rng(0), np.array([0.1, 0.0, 0.0])
    rays = beams(robot.lidar.beams, robot.lidar.angle_min, robot.lidar.angle_max, 0.05, 25.0)
    there = scene([Circle(0.06)] * 3, np.array([[1.5, 0.3, 0.0], [1.45, 0.55, 0.0], [1.5, -0.6, 0.0]]))
    for k in range(8):
        ranges = sweep(there, rays, mount) + robot.lidar.sigma * rng.standard_normal(robot.lidar.beams)
        scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 25.0, mount)
        out = tracker.update(sensing(0.1 * k, scan=scan), np.zeros(3))
        told = np.flatnonzero(out.moving)
        assert len(told) == 1
        near = np.hypot(*(out.position[~out.moving] - (1.5, -0.6)).T) < 0.2
        assert near.any()
        for i in told:
            assert out.position[i] == pytest.approx([1.47, 0.42], abs=0.1)
            assert 0.25 <= out.radius[i] < 0.3
            assert np.hypot(*out.velocity[i]) <= out.velocity_error[i]


def walk(velocities: Sequence[FloatArray], start: FloatArray) -> Iterator[tuple[FloatArray, Obstacles]]:
    """Where somebody on two legs is who walks from `start` (2,) at one of `velocities` [m/s] in each period, and what is told of it."""
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0], "height": 0.2})
    assert robot.lidar is not None
    tracker, rng, mount = fresh("kalman", robot), np.random.default_rng(0), np.array([0.1, 0.0, 0.0])
    rays = beams(robot.lidar.beams, robot.lidar.angle_min, robot.lidar.angle_max, 0.05, 25.0)
    middle = start.copy()
    for k, v in enumerate(velocities):
        ahead, beside = v / np.hypot(*v), np.array([-v[1], v[0]]) / np.hypot(*v)
        swing = 0.17 * (2.0 * abs(2.0 * (0.091 * k % 1.0) - 1.0) - 1.0)
        feet = [middle + side * (0.085 * beside + swing * ahead) for side in (1.0, -1.0)]
        there = scene([Circle(0.06)] * 2, np.array([(*foot, 0.0) for foot in feet]))
        ranges = sweep(there, rays, mount) + robot.lidar.sigma * rng.standard_normal(robot.lidar.beams)
        yield (
            middle.copy(),
            tracker.update(
                sensing(0.1 * k, scan=Scan(ranges, rays.angle_min, rays.increment, 0.05, 25.0, mount)), np.zeros(3)
            ),
        )
        middle += 0.1 * v


@pytest.mark.parametrize(("velocity", "start"), [((-1.2, 0.0), (3.4, 0.2)), ((0.2, -1.0), (3.4, 2.2))])
def test_who_walks_is_where_their_legs_swing_about(velocity: tuple[float, float], start: tuple[float, float]) -> None:
    """Told where they are within the bound, though the two legs are now two clusters, now one, and now one hides the other."""
    v, off, within, wrong = np.array(velocity), [], [], []
    for k, (middle, out) in enumerate(walk([v] * 22, np.array(start))):
        if k < 8:
            continue
        (i,) = np.flatnonzero(out.moving)
        off.append(np.hypot(*(out.position[i] - middle)))
        within.append(off[-1] <= out.error[i])
        wrong.append(np.hypot(*(out.velocity[i] - v)) <= out.velocity_error[i])
        assert 0.25 <= out.radius[i] < 0.3
    assert np.mean(within) > 0.9
    assert np.mean(wrong) > 0.9
    assert np.mean(off) < 0.05


def test_who_walks_evenly_is_known_better_until_they_turn() -> None:
    velocities = [np.array([-1.0, 0.0])] * 16 + [np.array([0.0, -1.0])] * 14
    bounds, within = [], []
    for (_, out), v in zip(walk(velocities, np.array([3.6, 0.4])), velocities, strict=True):
        (i,) = np.flatnonzero(out.moving) if out.moving.any() else (None,)
        bounds.append(math.inf if i is None else out.velocity_error[i])
        within.append(i is not None and bool(np.hypot(*(out.velocity[i] - v)) <= out.velocity_error[i]))
    assert max(bounds[11:16]) < 0.45
    assert max(bounds[17:24]) > 1.3 * bounds[15]
    assert all(within[8:16])
    assert all(within[22:])


def test_without_memory_a_body_has_the_finite_difference() -> None:
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0]})
    tracker, v = fresh("difference", robot), np.array([-0.6, 0.2])
    commands = np.zeros((12, 2))
    off = []
    for k, (step, pose, at) in enumerate(moving_scene(Circle(0.27), v, robot, commands)):
        out = tracker.update(step, pose)
        (i,) = np.flatnonzero(out.moving)
        assert np.linalg.norm(out.position[i] - at) < 0.3
        if k == 0:
            assert (out.velocity[i].tolist(), out.velocity_error[i]) == ([0, 0], math.inf)
        else:
            off.append(np.linalg.norm(out.velocity[i] - v) <= out.velocity_error[i])
    assert np.mean(off) > 0.9


@BOTH
def test_every_return_near_the_robot_is_covered(name: str) -> None:
    """Walls, boxes and a moving body, as the navigator sees them: in the map frame, 300 discs at most.

    Noise is averaged out along surfaces, so that a return may stick out by as much as it errs."""
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0]})
    tracker = fresh(name, robot)
    commands = np.array([(0.4, 0.5 * math.sin(0.3 * k)) for k in range(25)])
    for step, pose, _ in moving_scene(rectangle(0.6, 0.6), np.array([-0.5, 0.1]), robot, commands):
        believed = pose + np.array((5.0, -3.0, 0.7))
        out = tracker.update(step, believed)
        scan = step.scan
        assert scan is not None
        angle = believed[2] + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        eye = believed[:2] + 0.1 * np.array([math.cos(believed[2]), math.sin(believed[2])])
        ends = eye + (scan.ranges[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))[scan.ranges < 4.0]
        gap = np.hypot(ends[:, None, 0] - out.position[:, 0], ends[:, None, 1] - out.position[:, 1]) - out.radius
        assert gap.min(axis=1).max() < 4.5 * 0.02
        assert np.percentile(gap.min(axis=1), 90) < 0.02
        assert len(out) <= 300
        assert len(set(out.identity.tolist())) == len(out)


def test_the_same_again_after_reset() -> None:
    robot = make_robot()
    tracker = make_tracker("kalman", robot)
    steps = drive(np.array([1.0, 2.5, 0.0]), WINDING[:20], robot, 1)
    outs = []
    for _ in range(2):
        tracker.reset(Task(0.1, 1.0, np.zeros(3), map=room_map()), robot, np.random.default_rng(0))
        outs.append([tracker.update(s, s.truth) for s in steps][-1])
    assert outs[0].position.tobytes() == outs[1].position.tobytes()
    assert outs[0].identity.tolist() == outs[1].identity.tolist()
    assert cast(np.array([1.0, 2.5, 0.0]), robot).ranges.shape == (181,)


def test_a_body_that_the_robot_turns_away_from_is_told_of_for_two_seconds() -> None:
    """It crosses from the right while the robot turns left until it is out of view, and goes on in the dark."""
    robot = make_robot(lidar=TIM | {"mount": [0.1, 0.0, 0.0]})
    tracker, v = fresh("kalman", robot), np.array([-0.3, 0.0])
    commands = np.array([(0.0, 0.0)] * 18 + [(0.0, 1.2)] * 17 + [(0.0, 0.0)] * 30)
    gone = 0
    for k, (step, pose, at) in enumerate(moving_scene(Circle(0.27), v, robot, commands, start=(3.0, -1.0))):
        out = tracker.update(step, pose)
        if k <= 20:
            continue
        bearing = math.remainder(math.atan2(at[1] - pose[1], at[0] - pose[0]) - pose[2], math.tau)
        gone += bearing < -2.0  # all of it out of view
        told = np.flatnonzero(out.moving)
        if gone in range(1, 15):
            (i,) = told
            assert np.linalg.norm(out.position[i] - at) <= out.error[i] + 0.15
            assert np.linalg.norm(out.velocity[i] - v) <= out.velocity_error[i]
    assert gone > 25
    assert len(told) == 0

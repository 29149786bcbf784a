from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import DRIVE, SILENT, Pilot, body, constant, make_robot, make_scenario, moving_obstacle, run

from clearway.contract import Command
from clearway.geometry.distance import min_clearance, path_clearance
from clearway.geometry.shapes import Circle, FloatArray, Polygon, rectangle
from clearway.trials import Outcome, Trial

SHORT = [{"name": "forth", "goal": (9.0, 0.0, 0.0), "time_limit": 0.25}]
FAST = DRIVE | {"v_max": 50.0, "acceleration": 1000.0, "deceleration": 1000.0}


def test_speed_and_acceleration_keep_their_limits() -> None:
    """Full speed ahead, then full stop, then back; the set speed of the test is 1.0."""
    plan = [Command(9.0, 0.0)] * 40 + [Command(0.0, 0.0)] * 20 + [Command(-9.0, -9.0)] * 40
    robot, far = make_robot(), make_scenario(legs=[{"name": "forth", "goal": (99, 0, 0), "time_limit": 9.9}])
    trial = run(Pilot(lambda s: plan[round(s.t / 0.1)]), scenario=far, robot=robot)
    assert trial.velocity is not None
    v, omega = trial.velocity.T
    assert v.max() == pytest.approx(1.0)
    assert v.min() == pytest.approx(-1.0)
    assert omega.min() == pytest.approx(-2.0)
    assert v[10] == pytest.approx(0.5)  # 0.5 m/s^2 for 1 s
    assert v[20] == pytest.approx(1.0)
    assert v[42] == pytest.approx(0.6)  # 2 m/s^2 for 0.2 s
    assert v[46] == 0.0
    # s = v^2 / 2a in acceleration, 2 s of cruise, v^2 / 2d to stop
    assert trial.pose[50, 0] == pytest.approx(1 / 1.0 + 2.0 + 1 / 4.0, abs=1e-9)


def test_a_thin_wall_stops_a_fast_robot() -> None:
    """At 50 m/s the robot passes 0.5 m in a step of the plant; the wall has no thickness at all."""
    wall = body(Polygon(((0.0, -1.0), (0.0, 1.0))), 7.0, 0.0, name="glass")
    robot = make_robot(drive=FAST, footprint={"kind": "circle", "radius": 0.02})
    scenario = make_scenario(speed=50.0, legs=[{"name": "forth", "goal": (90, 0, 0), "time_limit": 5.0}])
    trial = run(constant(50.0), [wall], scenario, robot)
    assert trial.outcome is Outcome.COLLISION
    assert trial.pose[-1, 0] == pytest.approx(6.98, abs=2e-5)
    assert "'glass'" in trial.reason
    assert trial.events[-1].t == trial.t[-1] == trial.spans[-1].end
    assert "robot at 50.000 m/s" in trial.events[-1].detail


def test_the_instant_of_contact_by_hand() -> None:
    """0.5 m/s^2 from rest: 0.75 m are passed after sqrt(3) s."""
    trial = run(constant(2.0), [body(rectangle(1, 1), 1.5, 0)], make_scenario(speed=2.0))
    assert trial.t[-1] == pytest.approx(math.sqrt(3.0), abs=1e-4)
    assert trial.pose[-1, 0] == pytest.approx(0.75, abs=2e-5)


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (math.inf, -1.0),  # without limits it turns round at once
        (10.0, 1.0 - 10.0 * 0.005),  # 5 ms of braking
    ],
)
def test_the_velocity_at_a_contact_is_that_of_the_instant(limit: float, expected: float) -> None:
    """What moves touches the robot from behind 5 ms after it was told to reverse, within a step of the plant."""
    robot = make_robot(drive=DRIVE | {"acceleration": limit, "deceleration": limit})
    plan = [Command(1.0, 0.0), *[Command(-1.0, 0.0)] * 2]
    alone = run(Pilot(lambda s: plan[round(s.t / 0.1)]), scenario=make_scenario(legs=SHORT), robot=robot)
    assert alone.velocity is not None
    assert alone.velocity[1, 0] == pytest.approx(1.0)
    way = 0.005 * (expected if limit == math.inf else (1.0 + expected) / 2)
    behind = float(alone.pose[1, 0]) + way - 0.25 - 0.1
    knots = np.array([[0.0, behind - 10.5, 0.0, 0.0], [0.21, behind + 10.5, 0.0, 0.0]])
    trial = run(
        Pilot(lambda s: plan[round(s.t / 0.1)]), [moving_obstacle(Circle(0.1))], make_scenario(legs=SHORT), robot,
        knots=[knots],
    )  # fmt: skip
    assert trial.outcome is Outcome.COLLISION
    assert trial.velocity is not None
    assert trial.t[-1] == pytest.approx(0.105, abs=1e-4)
    assert trial.velocity[-1, 0] == pytest.approx(expected, abs=2e-3)


def test_a_moving_obstacle_that_crosses_within_a_step_is_not_missed() -> None:
    """It needs 2 ms to pass through the standing robot, and is far away at both ends of the plant's step."""
    knots = np.array([[0.0, 0.3, -50.0, 1.0], [0.1, 0.3, 50.0, 1.0]])
    trial = run(constant(0.0), [moving_obstacle(rectangle(0.1, 0.1))], knots=[knots])
    assert trial.outcome is Outcome.COLLISION
    assert trial.t[-1] == pytest.approx(0.05, abs=1e-3)
    assert "robot at 0.000 m/s" in trial.events[-1].detail
    assert "1000.000 m/s" in trial.events[-1].detail
    miss = run(constant(0.0), [moving_obstacle(rectangle(0.1, 0.1))], knots=[knots + np.array([0, 0.1, 0, 0])])
    assert miss.outcome is Outcome.TIMEOUT


def test_a_swept_crossing_of_two_that_move() -> None:
    """Robot along x at 1 m/s, disc along y at 1 m/s, both aiming at (2, 0): contact when their centres are r1 + r2 apart."""
    robot = make_robot(drive=FAST | {"acceleration": 1e6})
    knots = np.array([[0.0, 2.0, -2.0, math.pi / 2], [4.0, 2.0, 2.0, math.pi / 2]])
    trial = run(constant(1.0), [moving_obstacle(Circle(0.35))], robot=robot, knots=[knots])
    assert trial.outcome is Outcome.COLLISION
    # |(2 - t, -(2 - t))| = sqrt(2) (2 - t) = 0.6
    assert trial.t[-1] == pytest.approx(2.0 - 0.6 / math.sqrt(2.0), abs=5e-5)
    assert trial.moving_obstacles[-1, 0] == pytest.approx([2.0, -0.6 / math.sqrt(2.0), math.pi / 2], abs=5e-5)


def test_a_moving_obstacle_that_appears_on_the_robot_is_contact() -> None:
    knots = np.array([[1.0, 0.0, 0.1, 0.0], [2.0, 5.0, 0.1, 0.0]])
    trial = run(constant(0.0), [moving_obstacle(Circle(0.1))], knots=[knots])
    assert trial.outcome is Outcome.COLLISION
    assert trial.t[-1] == pytest.approx(1.0, abs=0.011)


def test_a_turning_corner_touches() -> None:
    """A square of edge 0.6 turns in place beside a wall that its sides clear by 0.05 m and its corners don't."""
    robot = make_robot(footprint={"kind": "polygon", "vertices": [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]})
    trial = run(constant(0.0, 1.0), [body(rectangle(4, 0.1), 0.0, 0.4)], robot=robot)
    assert trial.outcome is Outcome.COLLISION
    # the corner reaches 0.35 where cos(45 degrees - angle) = 0.35 / (0.3 sqrt 2)
    assert trial.pose[-1, 2] == pytest.approx(math.pi / 4 - math.acos(0.35 / (0.3 * math.sqrt(2))), abs=1e-3)


shapes = st.sampled_from([Circle(0.1), Circle(0.5), rectangle(0.6, 0.2), rectangle(3, 0.05),
                          Polygon(((-0.5, -0.5), (0.5, -0.5), (0.0, 0.0), (0.5, 0.5), (-0.5, 0.5)))])  # fmt: skip
places = st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)).map(np.array)
FOOT = {"kind": "polygon", "vertices": [(-0.3, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.3, 0.2)]}


@settings(max_examples=60)
@given(
    st.lists(st.tuples(shapes, places), max_size=4),
    st.lists(st.tuples(shapes, places, places), max_size=2),
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=5),
)
def test_contact_is_when_the_gap_closes_and_not_before(
    still: list[tuple[Rect, FloatArray]],
    moving: list[tuple[Rect, FloatArray, FloatArray]],
    commands: list[tuple[float, float]],
) -> None:
    """The trial's own samples, a tenth of a second apart at first and one step of the plant apart here, are the oracle."""
    robot = make_robot(footprint=FOOT, period=0.01)
    scenario = make_scenario(speed=2.0, legs=[{"name": "forth", "goal": (99, 0, 0), "time_limit": 3.0}])
    bodies = [body(s, *p) for s, p in still] + [moving_obstacle(s) for s, _, _ in moving]
    knots = [np.vstack([[0.0, *a], [3.5, *b]]) for _, a, b in moving]
    pilot = Pilot(lambda s: Command(*commands[min(int(s.t), len(commands) - 1)]))
    trial = run(pilot, bodies, scenario, robot, knots=knots or None)
    gap = min_clearance(robot.shape, trial.pose, bodies, trial.moving_obstacles)
    if trial.outcome is Outcome.COLLISION:
        assert gap[-1] <= 1.2e-5
        assert (gap[:-1] > 0).all()
        if len(gap) > 1:
            assert path_clearance(robot.shape, trial.pose, bodies, trial.moving_obstacles, 1e-5)[:-2].min(initial=1) > 0
        slow = run(pilot, bodies, scenario, make_robot(footprint=FOOT), knots=knots or None)
        assert slow.outcome is Outcome.COLLISION  # with ten times the control period, but for what the commands change
    else:
        assert trial.outcome is Outcome.TIMEOUT
        assert gap.min(initial=1.0) > 0
        assert path_clearance(robot.shape, trial.pose, bodies, trial.moving_obstacles, 1e-5).min() > 0


Rect = Circle | Polygon


def drift(trial: Trial, pilot: Pilot) -> FloatArray:
    return pilot.seen[-1].odom_pose


def test_odometry_without_error_is_the_truth() -> None:
    pilot = Pilot(lambda s: Command(0.8, math.sin(s.t)))
    trial = run(pilot, scenario=make_scenario(legs=[{"name": "forth", "goal": (99, 0, 0), "time_limit": 20.0}]))
    for seen, pose, velocity in zip(pilot.seen, trial.pose, trial.velocity, strict=True):  # type: ignore[arg-type]
        assert seen.odom_pose == pytest.approx(pose, abs=1e-9)
        assert seen.odom_velocity == pytest.approx(velocity, abs=1e-12)


@pytest.mark.parametrize("turning", [False, True])
def test_odometry_drifts_as_its_model_says(turning: bool) -> None:
    """Over 200 seeds: deviation of the distance and of the heading within 4 standard errors (20 %)."""
    robot = make_robot(
        period=0.5, lidar=None, drive=FAST | {"angular_acceleration": 1e6, "angular_deceleration": 1e6},
        odometry={"translation_per_metre": 0.03, "rotation_per_metre": 0.02, "rotation_per_radian": 0.05, "scale": 0.0},
    )  # fmt: skip
    ends = []
    for seed in range(200):
        scenario = make_scenario(seed=seed, legs=[{"name": "forth", "goal": (99, 0, 0), "time_limit": 4.0}])
        pilot = constant(0.0, 1.0) if turning else constant(1.0)
        run(pilot, scenario=scenario, robot=robot)
        ends.append(pilot.seen[-1].odom_pose)
    x, _, theta = np.array(ends).T
    if turning:  # 4 rad in place
        assert np.std(theta - 4.0 + 2 * math.pi) == pytest.approx(0.05 * 2.0, rel=0.2)
        assert np.abs(x).max() < 1e-12
    else:  # 4 m straight on
        assert np.std(x) == pytest.approx(0.03 * 2.0, rel=0.2)
        assert np.mean(x) == pytest.approx(4.0, abs=0.03)
        assert np.std(theta) == pytest.approx(0.02 * 2.0, rel=0.2)


def test_the_scale_error_is_one_draw_a_trial() -> None:
    robot = make_robot(period=0.5, lidar=None, odometry=SILENT | {"scale": 0.1})
    ratios = []
    for seed in range(100):
        pilot = constant(1.0)
        trial = run(pilot, robot=robot, scenario=make_scenario(seed=seed))
        share = np.array([s.odom_pose[0] for s in pilot.seen[1:]]) / trial.pose[1:, 0]
        assert np.ptp(share) < 1e-9
        ratios.append(share[0])
    assert np.std(ratios) == pytest.approx(0.1, rel=0.3)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.04)


def test_turning_has_a_scale_of_its_own() -> None:
    robot = make_robot(period=0.5, lidar=None, odometry=SILENT | {"scale": 0.0, "turn_scale": 0.05})
    ratios = []
    for seed in range(100):
        pilot = constant(0.5, 0.5)
        trial = run(pilot, robot=robot, scenario=make_scenario(seed=seed))
        assert trial.velocity is not None
        told = np.array([s.odom_velocity for s in pilot.seen[1:]])
        assert told[:, 0] == pytest.approx(trial.velocity[1 : len(told) + 1, 0], abs=1e-12)
        share = told[2:, 1] / trial.velocity[3 : len(told) + 1, 1]
        assert np.ptp(share) < 1e-9
        ratios.append(share[0])
    assert np.std(ratios) == pytest.approx(0.05, rel=0.3)


def test_unequal_wheels_bend_the_way_alike_forth_and_back() -> None:
    """Backwards the imagined turn is undone: it goes with the metres, not with the time."""
    robot = make_robot(period=0.5, lidar=None, odometry=SILENT | {"curvature": 0.01})
    bends = []
    for seed in range(100):
        pilot = Pilot(lambda s: Command(0.5 if s.t < 4.0 else -0.5, 0.0))
        trial = run(pilot, robot=robot, scenario=make_scenario(seed=seed))
        x = trial.pose[: len(pilot.seen), 0]
        theta = np.array([s.odom_pose[2] for s in pilot.seen])
        far = int(np.argmax(x))
        assert theta == pytest.approx(x * theta[far] / x[far], abs=1e-9)
        bends.append(theta[far] / x[far])
    assert np.std(bends) == pytest.approx(0.01, rel=0.3)


def test_noise_of_measured_velocities_does_not_add_up() -> None:
    """It is a share of the speed, nothing at rest, and the dead-reckoned pose knows nothing of it."""
    robot = make_robot(lidar=None, odometry=SILENT | {"speed_noise": 0.02, "yaw_rate_noise": 0.05})
    long = make_scenario(legs=[{"name": "forth", "goal": (99, 0, 0), "time_limit": 90.0}])
    pilot = Pilot(lambda s: Command(1.0 if s.t < 60.0 else 0.0, 0.0))
    trial = run(pilot, robot=robot, scenario=long)
    assert trial.velocity is not None
    told = np.array([s.odom_velocity for s in pilot.seen])
    error = told - trial.velocity[: len(told)]
    cruise = trial.velocity[: len(told), 0] == 1.0
    assert np.std(error[cruise], axis=0) == pytest.approx([0.02, 0.05], rel=0.15)
    assert np.abs(np.mean(error[cruise], axis=0) / [0.02, 0.05]).max() < 4 / math.sqrt(cruise.sum())
    assert (error[trial.velocity[: len(told), 0] == 0.0] == 0.0).all()
    assert pilot.seen[-1].odom_pose == pytest.approx(trial.pose[len(told) - 1], abs=1e-9)


@pytest.mark.parametrize("own", [{}, {"speed_noise": 0.02, "yaw_rate_noise": 0.03}])
def test_measured_velocities_err_as_much_as_is_said(own: dict[str, float]) -> None:
    """Over 200 seeds, in a curve: within 4 standard errors (20 %)."""
    errors = {"translation_per_metre": 0.01, "rotation_per_metre": 0.01, "rotation_per_radian": 0.02,
              "scale": 0.01, "turn_scale": 0.02, "curvature": 0.02}  # fmt: skip
    robot = make_robot(period=0.1, lidar=None, drive=FAST | {"angular_acceleration": 1e6}, odometry=errors | own)
    off, short = [], [{"name": "forth", "goal": (3.0, 0.0, 0.0), "time_limit": 0.5}]
    for seed in range(200):
        pilot = constant(0.8, 0.5)
        trial = run(pilot, robot=robot, scenario=make_scenario(seed=seed, legs=short))
        assert trial.velocity is not None
        assert trial.velocity[3] == pytest.approx([0.8, 0.5])
        off.append(pilot.seen[3].odom_velocity - trial.velocity[3])
    assert np.std(off, axis=0) == pytest.approx(robot.odometry.velocity_errors(0.8, 0.5, 0.1), rel=0.2)

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import DRIVE, Pilot, body, constant, make_robot, make_scenario, moving_obstacle, run, steer

from clearway.contract import Budget, Command, Decision, Diagnostics, Sensing
from clearway.errors import ClearwayError
from clearway.geometry.frames import relative
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, rectangle
from clearway.robots import load_robot
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome, Trial
from clearway.world import simulate

NOISY = {
    "odometry": {"translation_per_metre": 0.02, "rotation_per_metre": 0.02, "rotation_per_radian": 0.02, "scale": 0.01},
    "lidar": {"beams": 31, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.05, "range_max": 10.0, "sigma": 0.02},
}
THERE_AND_BACK = [
    {"name": "forth", "goal": (2.0, 0.0, 0.0), "time_limit": 30.0},
    {"name": "turn", "goal": (2.0, 0.0, math.pi), "time_limit": 30.0, "scored": False},
    {"name": "back", "goal": (0.0, 0.0, math.pi), "time_limit": 30.0, "xy_tolerance": 0.05},
]


def same_bits(a: Trial, b: Trial) -> bool:
    names = ("t", "pose", "velocity", "estimate", "command", "leg", "moving_obstacles")
    return all(getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in names) and (
        (a.spans, a.events, a.outcome, a.reason) == (b.spans, b.events, b.outcome, b.reason)
    )


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not() -> None:
    def once(seed: int) -> tuple[Trial, bytes]:
        scenario = make_scenario(
            seed=seed, placement_xy=0.05, placement_yaw=0.1, legs=THERE_AND_BACK,
            obstacles=[{"name": "m", "shape": {"kind": "square", "edge": 0.3},
                        "runs": [{"leg": "forth", "path": [(1, 3), (1, 1)], "speed": 0.5}]}],
        )  # fmt: skip
        pilot = Pilot(steer)
        trial = run(
            pilot, [body(rectangle(1, 1), 5, 0), moving_obstacle(rectangle(0.3, 0.3))], scenario, make_robot(**NOISY)
        )
        seen = b"".join(s.scan.ranges.tobytes() + s.odom_pose.tobytes() for s in pilot.seen if s.scan)
        return trial, seen

    (a, seen_a), (b, seen_b), (c, seen_c) = once(3), once(3), once(4)
    assert same_bits(a, b)
    assert seen_a == seen_b
    assert a.pose[0].tolist() != c.pose[0].tolist()
    assert seen_a != seen_c
    assert a.outcome is Outcome.REACHED


def test_legs_follow_each_other() -> None:
    pilot = Pilot(steer)
    trial = run(pilot, scenario=make_scenario(legs=THERE_AND_BACK))
    assert trial.outcome is Outcome.REACHED
    assert [s.leg for s in trial.spans] == [0, 1, 2]
    assert all(s.reached for s in trial.spans)
    assert trial.spans[0].start == 0.0
    for a, b in zip(trial.spans, trial.spans[1:], strict=False):
        assert a.end == b.start
    assert trial.spans[-1].end == trial.t[-1]
    # one goal object a leg, and the sample at the end of a leg still belongs to it
    goals = [s.goal for s in pilot.seen]
    assert len({id(g) for g in goals}) == 3
    assert [g.leg for g in goals] == trial.leg.tolist()
    assert trial.t[trial.leg == 0][-1] == trial.spans[0].end
    # the robot was within tolerance whenever it said so
    for span, leg in zip(trial.spans, trial.attempt.legs, strict=True):
        at = trial.pose[np.searchsorted(trial.t, span.end)]
        assert math.dist(at[:2], leg.goal[:2]) <= leg.xy_tolerance
        assert abs(math.remainder(at[2] - leg.goal[2], 2 * math.pi)) <= leg.yaw_tolerance
    assert trial.attempt.legs[0].xy_tolerance == 0.1
    assert trial.attempt.legs[2].xy_tolerance == 0.05
    assert trial.attempt.legs[2].start.tolist() == [2.0, 0.0, math.pi]
    assert trial.t == pytest.approx(0.1 * np.arange(len(trial.t)))


def test_who_says_that_a_goal_is_reached() -> None:
    here = make_scenario(legs=[{"name": "forth", "goal": (0.0, 0.0, 2.0), "time_limit": 1.0}])
    assert run(constant(0.0), scenario=here).outcome is Outcome.TIMEOUT  # the heading is wrong
    free = make_scenario(legs=[{"name": "f", "goal": (0, 0, 2.0), "time_limit": 1.0, "yaw_tolerance": math.inf}])
    assert run(constant(0.0), scenario=free).outcome is Outcome.REACHED
    assert run(Pilot(lambda _: Command(0, 0, arrived=False)), scenario=free).outcome is Outcome.TIMEOUT
    far = make_scenario(legs=[{"name": "f", "goal": (3, 0, 0), "time_limit": 9.0}])
    early = run(Pilot(lambda s: Command(0, 0, arrived=s.t > 1)), scenario=far)
    assert early.outcome is Outcome.REACHED  # the robot says so; whether it is true is for the indicators
    assert early.t[-1] == pytest.approx(1.1)
    judged = make_scenario(
        legs=[{"name": "f", "goal": (2, 0, 3.0), "time_limit": 9, "arrival": "measured", "xy_tolerance": 1}]
    )
    trial = run(Pilot(lambda _: Command(1, 0, arrived=False)), scenario=judged)
    assert trial.outcome is Outcome.REACHED
    assert trial.pose[-1, 0] >= 1.0 > trial.pose[-2, 0]


def test_a_goal_is_reached_once_it_is_called_so_and_the_robot_stands() -> None:
    far = make_scenario(legs=[{"name": "f", "goal": (3, 0, 0), "time_limit": 9.0}])
    rushes = run(Pilot(lambda s: Command(1, 0.5, arrived=s.t > 0.99)), scenario=far)  # it calls, and means to drive on
    assert rushes.outcome is Outcome.REACHED
    called = int(np.searchsorted(rushes.t, 1.0))
    assert rushes.command is not None
    assert rushes.velocity is not None
    assert rushes.command[:called].tolist() == [[1.0, 0.5]] * called
    assert not rushes.command[called:].any()  # the base is told to stand
    assert rushes.velocity[called, 0] == pytest.approx(0.5)
    assert rushes.t[-1] == pytest.approx(1.3)  # 0.5 m/s at 2 m/s^2: the third period begins at rest
    assert np.abs(rushes.velocity[-1]).max() == 0.0
    # whoever takes the call back before it stands drives on
    doubts = run(Pilot(lambda s: Command(1, 0, arrived=0.99 < s.t < 1.15)), scenario=far)
    assert doubts.outcome is Outcome.TIMEOUT
    assert doubts.velocity is not None
    assert doubts.velocity[-1, 0] == 1.0
    # the same for one that leaves it to the run, and would drive through
    passes = run(Pilot(lambda _: Command(0.5, 0)), scenario=far)
    assert passes.outcome is Outcome.REACHED
    assert abs(3.0 - passes.pose[-1, 0]) <= 0.1
    assert passes.velocity is not None
    assert passes.velocity[-1].tolist() == [0.0, 0.0]


def test_the_planner_is_told_its_own_tolerances_and_the_test_judges_by_its_own() -> None:
    legs = [
        {"name": "forth", "goal": (1.0, 0.0, 0.0), "time_limit": 30.0},
        {"name": "back", "goal": (0.0, 0.0, math.pi), "time_limit": 30.0, "xy_tolerance": 0.05},
    ]
    pilot = Pilot(steer)
    told = {"xy_goal_tolerance": 0.04}
    trial = run(pilot, scenario=make_scenario(legs=legs), robot=make_robot(goal_checker=told))
    forth, back = trial.attempt.legs
    assert (forth.xy_tolerance, forth.yaw_tolerance) == (0.1, 0.2)
    assert (forth.planner_xy_tolerance, forth.planner_yaw_tolerance) == (0.04, 0.2)
    assert (back.xy_tolerance, back.planner_xy_tolerance) == (0.05, 0.05)  # a leg's own is both
    assert (pilot.seen[0].goal.xy_tolerance, pilot.seen[0].goal.yaw_tolerance) == (0.04, 0.2)
    at = trial.pose[np.searchsorted(trial.t, trial.spans[0].end)]
    assert math.dist(at[:2], forth.goal[:2]) <= 0.04  # the pilot leaves arrival to the run


def test_the_clock_may_wait_for_the_robot() -> None:
    legs = [{"name": "f", "goal": (9, 0, 0), "time_limit": 5.0, "clock_starts_after": 0.1}]
    trial = run(Pilot(lambda s: Command(1.0 if s.t > 2 else 0.0, 0)), scenario=make_scenario(legs=legs))
    span = trial.spans[0]
    moved = int(np.searchsorted(trial.t, span.start))
    assert trial.pose[moved, 0] >= 0.1 > trial.pose[moved - 1, 0]
    assert span.end == pytest.approx(span.start + 5.0)
    assert trial.outcome is Outcome.TIMEOUT
    assert "'f' took longer than 5 s" in trial.reason
    lazy = run(constant(0.0), scenario=make_scenario(legs=legs))
    assert (lazy.outcome, lazy.spans[0].start, lazy.t[-1]) == (Outcome.TIMEOUT, 0.0, pytest.approx(5.0))


def test_livelock_only_if_asked_for() -> None:
    legs = [{"name": "f", "goal": (9, 0, 0), "time_limit": 60.0}]
    circling = constant(0.2, 1.0)  # a circle of radius 0.2 m
    assert run(circling, scenario=make_scenario(legs=legs)).outcome is Outcome.TIMEOUT
    trial = run(circling, scenario=make_scenario(legs=legs, livelock=True))
    assert trial.outcome is Outcome.LIVELOCK
    assert trial.t[-1] == pytest.approx(20.0)
    slow = run(constant(0.03), scenario=make_scenario(legs=legs, livelock=True))
    assert slow.outcome is Outcome.TIMEOUT  # 0.6 m in 20 s


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda _: Command(math.nan, 0.0), "not finite"),
        (lambda _: Command(0.0, math.inf), "not finite"),
        (lambda _: None, "a Command is expected"),
        (lambda _: Command("fast", 0.0), "TypeError"),
        (lambda _: 1 / 0, "ZeroDivisionError: division by zero"),
    ],
)
def test_a_navigator_that_fails(answer: Any, said: str) -> None:
    trial = run(Pilot(lambda s: answer(s) if s.t > 0.45 else Command(1.0, 0.0)))
    assert trial.outcome is Outcome.NAVIGATOR_FAILED
    assert said in trial.reason
    assert trial.events[-1].kind == "error"
    assert "Traceback" in trial.events[-1].detail
    assert len(trial.t) == 6
    assert np.isfinite(trial.command).all()  # type: ignore[arg-type]
    assert not trial.spans[-1].reached


def test_failures_outside_a_decision() -> None:
    class Broken(Pilot):
        def reset(self, *_: Any) -> None:
            raise RuntimeError("no model")

    trial = run(Broken(steer))
    assert (trial.outcome, len(trial.t)) == (Outcome.NAVIGATOR_FAILED, 1)
    assert "RuntimeError: no model" in trial.reason

    class Lost(Pilot):
        def decide(self, sensing: Sensing) -> Decision:
            return Decision(Command(0, 0), np.array([math.nan, 0, 0]))

    assert "not three finite numbers" in run(Lost(steer)).reason

    class Unable(Pilot):
        def reset(self, *_: Any) -> None:
            raise ClearwayError("needs obstacles")

    assert run(Unable(steer)).reason.startswith("ClearwayError: needs obstacles")  # a campaign goes on


def test_giving_up_and_starting_in_contact() -> None:
    trial = run(Pilot(lambda s: Command(0, 0, gave_up="no plan" if s.t > 0.25 else None)))
    assert (trial.outcome, trial.reason, trial.t[-1]) == (Outcome.ABORTED, "no plan", pytest.approx(0.3))
    trial = run(Pilot(steer), [body(rectangle(1, 1), 0.7, 0, name="bed")])
    assert (trial.outcome, len(trial.t)) == (Outcome.COLLISION, 1)
    assert "'bed'" in trial.reason
    assert "placed" in trial.reason
    on_it = [np.array([[-1.0, -1.0, 0.0, 0.0], [9.0, 9.0, 0.0, 0.0]])]
    assert run(Pilot(steer), [moving_obstacle(Circle(0.1))], knots=on_it).outcome is Outcome.COLLISION


def test_what_the_pilot_is_told_and_what_it_shows() -> None:
    class Shows(Pilot):
        def decide(self, sensing: Sensing) -> Decision:
            decision = super().decide(sensing)
            shown = Diagnostics(status="rolling") if sensing.t in (0.0, 1.0) else None
            return Decision(decision.command, decision.estimate, shown)

    pilot = Shows(steer)
    scenario = make_scenario(placement_xy=0.1, placement_yaw=0.2, speed=0.7)
    trial = run(pilot, scenario=scenario, budget=Budget(iterations=9))
    assert pilot.task is not None
    task: Any = pilot.task
    assert (task.period, task.speed_limit, task.budget, task.time_limit) == (0.1, 0.7, Budget(iterations=9), 30.0)
    assert task.start.tolist() == [0, 0, 0]  # the intended pose; the true one differs
    assert trial.pose[0].tolist() != [0, 0, 0]
    assert pilot.seen[0].odom_pose.tolist() == [0, 0, 0]
    assert task.obstacle_oracle is None
    assert [s.t for s in trial.snapshots] == [0.0, 1.0]
    of_decisions = {f"decide_{name}" for name in ("count", "mean", "p50", "p99", "max", "overrun")}
    assert {"wall", *of_decisions} == set(trial.timing)
    assert trial.attempt.labels.speed == 0.7


@given(st.integers(0, 10**6))
@settings(max_examples=50)
def test_placement_stays_within_its_error(seed: int) -> None:
    scenario = make_scenario(
        seed=seed, placement_xy=0.1, placement_yaw=0.2, legs=[{"name": "f", "goal": (9, 9, 0), "time_limit": 0.05}]
    )
    x, y, theta = run(constant(0.0), scenario=scenario, robot=make_robot(lidar=None)).pose[0]
    assert math.hypot(x, y) <= 0.1
    assert abs(theta) <= 0.2


def test_the_truth_as_a_forecast_for_the_privileged() -> None:
    pilot = constant(0.0)
    knots = np.array([[1.0, 5.0, -2.0, 1.57], [5.0, 5.0, 2.0, 1.57]])
    bodies = [
        body(Circle(0.2), 0, 3, kind="obstacle"),
        body(rectangle(9, 1), 0, 9),
        moving_obstacle(rectangle(0.6, 0.8)),
    ]
    run(pilot, bodies, knots=[knots], privileged=True)
    task: Any = pilot.task
    assert task.obstacle_oracle(2.0) == pytest.approx(np.array([[0, 3, 0.2, 1], [5, -1, 0.5, 1]]))
    assert task.obstacle_oracle(0.5)[1, 3] == 0.0


def test_scans_are_what_stands_there() -> None:
    lidar = {"beams": 181, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.3, "range_max": 6.0, "sigma": 0.0,
             "mount": (0.2, 0.1, 0.3)}  # fmt: skip
    pilot = Pilot(steer)
    knots = np.array([[0.0, 4.0, -2.0, 0.0], [20.0, 4.0, 2.0, 0.0]])
    bodies = [body(rectangle(1, 1), 5, 2), body(Circle(0.3), 2, -1), moving_obstacle(rectangle(0.5, 0.5))]
    trial = run(pilot, bodies, knots=[knots], robot=make_robot(lidar=lidar))
    rays = beams(181, -1.5, 1.5, 0.3, 6.0)
    for i in (0, 10, len(trial.t) - 1):
        scan = pilot.seen[i].scan
        assert scan is not None
        x, y, theta = trial.pose[i]
        c, s = math.cos(theta), math.sin(theta)
        at = np.array([x + c * 0.2 - s * 0.1, y + s * 0.2 + c * 0.1, theta + 0.3])
        poses = np.array([bodies[0].pose, bodies[1].pose, trial.moving_obstacles[i, 0]])
        expected = sweep(scene([b.shape for b in bodies], poses), rays, at)
        assert np.isclose(scan.ranges, expected, atol=1e-9).sum() >= 179
        assert scan.mount.tolist() == [0.2, 0.1, 0.3]
    assert scan.angle_min + 180 * scan.angle_increment == pytest.approx(1.5)


def test_noise_of_the_lidar() -> None:
    robot = make_robot(lidar=NOISY["lidar"])
    pilot = constant(0.0)
    run(pilot, [body(rectangle(0.1, 90), 2.05, 0)], robot=robot)
    ranges = np.array([s.scan.ranges for s in pilot.seen if s.scan])
    middle = ranges[:, 15]
    assert middle.mean() == pytest.approx(2.0, abs=4 * 0.02 / math.sqrt(len(middle)))
    assert middle.std() == pytest.approx(0.02, rel=0.2)
    assert abs(np.corrcoef(ranges[:, 14], ranges[:, 15])[0, 1]) < 0.25
    edge = ranges[:, 0]  # 2 / cos(1.5) = 28 m away
    assert np.isinf(edge).all()


def test_a_test_of_the_hospital_from_its_suite() -> None:
    robot = load_robot("tiago")
    scenario = load_suite("hospital").build(robot, Selection(batches=("NO",), speeds=(0.6,), repetitions=1), 1)[0]
    trial = simulate(scenario, robot, Pilot(steer), navigator="steer", localisation="truth", map=None)
    assert trial.outcome is Outcome.REACHED
    assert trial.attempt.floor_plan == scenario.floor_plan
    assert len(trial.attempt.bodies) > 3
    assert trial.velocity is not None
    assert trial.velocity[:, 0].max() == pytest.approx(0.6)


def test_a_base_that_turns_about_a_point_ahead_of_it() -> None:
    """In place, base_link goes round that point at its distance; wheel odometry believes that it stands."""
    ahead = 0.04
    robot = make_robot(drive=DRIVE | {"pivot": ahead})
    trial = run(constant(0.0, 1.0), robot=robot)
    heading = np.unwrap(trial.pose[:, 2])
    assert heading[-1] > 2 * math.pi
    centre = trial.pose[:, :2] + ahead * np.stack((np.cos(heading), np.sin(heading)), axis=1)
    np.testing.assert_allclose(centre, np.broadcast_to((ahead, 0.0), centre.shape), atol=1e-9)
    assert np.ptp(trial.pose[:, 0]) == pytest.approx(2 * ahead, abs=1e-3)
    pilot = constant(0.0, 1.0)
    run(pilot, robot=robot)
    assert all(np.hypot(*s.odom_pose[:2]) < 1e-12 for s in pilot.seen)
    first, *rest = (robot.drive.base_link(s.odom_pose) for s in pilot.seen)
    for found, pose in zip(rest, trial.pose[1:], strict=False):
        np.testing.assert_allclose(relative(first, found), relative(trial.pose[0], pose), atol=1e-9)


def test_where_a_base_that_turns_about_another_point_is_touched() -> None:
    """Driving straight, the point makes no difference: neither to the contact nor to what the lidar sees."""
    wall = body(rectangle(0.2, 4.0), 2.0, 0.0)
    trials, seen = [], []
    for ahead in (0.0, 0.1):
        pilot = constant(0.5)
        trials.append(run(pilot, robot=make_robot(drive=DRIVE | {"pivot": ahead}), bodies=[wall]))
        seen.append(pilot.seen)
    assert trials[0].outcome is trials[1].outcome is Outcome.COLLISION
    np.testing.assert_allclose(trials[0].pose, trials[1].pose, atol=2e-5)
    for a, b in zip(*seen, strict=True):
        assert a.scan is not None
        assert b.scan is not None
        np.testing.assert_allclose(a.scan.ranges, b.scan.ranges, atol=1e-9)
        assert a.scan.mount[0] == b.scan.mount[0] == 0.0


def test_what_a_trial_keeps_of_a_navigator_s_words_and_of_the_budget() -> None:
    words = ["", "", "tracking", "tracking", "infeasible", "tracking"]
    pilot = Pilot(lambda s: Command(0, 0, status=words[round(s.t / 0.1) % 6], cut=round(s.t / 0.1) % 3 == 0))
    here = make_scenario(legs=[{"name": "f", "goal": (9, 0, 0), "time_limit": 0.8}])
    trial = run(pilot, scenario=here, budget=Budget(seconds=0.1), tracking="kalman")
    said = [(round(e.t, 3), e.detail) for e in trial.events if e.kind == "status"]
    assert said == [(0.2, "tracking"), (0.4, "infeasible"), (0.5, "tracking"), (0.6, ""), (0.8, "tracking")]
    assert trial.cut is not None
    assert trial.cut.tolist() == [True, False, False] * 3
    assert trial.attempt.tracking == "kalman"
    assert run(constant(0.0), scenario=here).cut is None  # nothing could have cut it
    bounded = run(constant(0.0), scenario=here, budget=Budget(iterations=5)).cut
    assert bounded is not None
    assert not bounded.any()


def test_a_test_of_the_rescue_suites() -> None:
    robot = load_robot("rescue")
    scenario = load_suite("sar-case1").build(robot)[0]
    pilot = Pilot(steer)
    trial = simulate(scenario, robot, pilot, navigator="steer", localisation="truth", map=None)
    assert pilot.task is not None
    assert pilot.task.area == (0.0, 0.0, 14.0, 14.0)
    assert pilot.task.map is None
    assert scenario.optimal is not None
    assert trial.attempt.optimal_time == scenario.optimal.time
    assert trial.attempt.shortest_path == scenario.shortest
    crow = math.dist(scenario.start[:2], scenario.legs[0].goal[:2]) - robot.tolerances.xy
    assert scenario.shortest is not None
    assert crow <= scenario.shortest <= scenario.optimal.path * (1.0 + 1e-4)
    assert trial.moving_obstacles.shape[1] == 5
    assert len(trial.attempt.bodies) == 11
    first = scenario.obstacles[6].oscillation
    assert first is not None
    assert trial.moving_obstacles[0, 0, :2].tolist() == list(first.start)
    for sensing, pose in zip(pilot.seen, trial.pose, strict=False):
        assert sensing.obstacles is not None
        assert sensing.truth.tolist() == pose.tolist()
        apart = np.hypot(*(sensing.obstacles.position - pose[:2]).T) - sensing.obstacles.radius
        assert (apart <= robot.camera.range + robot.camera.error).all()  # type: ignore[union-attr]

"""HP+TMPC as a navigator: what it promises in odd situations, and that its parts are alive."""

from __future__ import annotations

import math

import numpy as np
import pytest

from arcs import step_arc
from clearway.contract import Budget, Goal, Observation, Task
from clearway.errors import ClearwayError
from clearway.geometry.angles import turn_between
from clearway.navigators.hp_tmpc import HpTmpc
from clearway.navigators.hp_tmpc.navigator import _settings
from clearway.navigators.hp_tmpc.parameters import Parameters
from clearway.navigators.hp_tmpc.tube_mpc.posing import obstacle_rows
from clearway.robots import load_robot
from perceived import exact

ROBOT = load_robot("rescue:unlimited")
C = ROBOT.period


def discs(*rows, moving=False, velocity=(0.0, 0.0)):
    """Obstacles of rows (x, y, radius)."""
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return exact(table[:, :2], velocity, table[:, 2], moving=moving)


def task(robot=ROBOT, speed=1.0, **given):
    return Task(robot.period, speed, np.zeros(3), **given)


def drive(navigator, obstacles, goal, periods=150, start=(0.0, 0.0, 0.0), noise=0.0, robot=ROBOT, the_task=None):
    """Drives until the goal is reached within 0.2 m; obstacles: Obstacles or a function of the time."""
    navigator.reset(the_task or task(robot), robot, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    pose, velocity, target = np.array(start), np.zeros(2), Goal(np.array(goal), 0.2, math.pi)
    commands, corrections, poses = [], [], [pose]
    for k in range(periods):
        seen = obstacles(k * robot.period) if callable(obstacles) else obstacles
        command = navigator.step(Observation(k * robot.period, pose.copy(), velocity, pose, target, obstacles=seen))
        assert math.isfinite(command.v + command.omega)
        commands.append(command)
        corrections.append(navigator.correction)
        pose = step_arc(pose, command.v, command.omega, robot.period)
        pose = pose + noise * rng.uniform(-1, 1, 3)
        velocity = np.array((command.v, command.omega))
        poses.append(pose)
        if math.hypot(pose[0] - goal[0], pose[1] - goal[1]) < 0.2:
            break
    return commands, np.array(poses), np.array(corrections)


def clearance(poses, rows):
    return min(np.hypot(*(poses[:, :2] - (x, y)).T).min() - r for x, y, r in rows) - 0.25


def test_reaches_a_goal_round_an_obstacle_without_contact():
    rows = [(2.0, 0.05, 0.35)]
    commands, poses, _ = drive(HpTmpc(), discs(*rows), (4.0, 0.0, 0.0), noise=0.005)
    assert math.hypot(*(poses[-1, :2] - (4.0, 0.0))) < 0.2
    assert 0.0 < clearance(poses, rows) < 0.25
    assert {c.status for c in commands} <= {"tracking", "infeasible"}


def test_without_obstacles_it_drives_straight_at_the_reference_speed():
    commands, poses, _ = drive(HpTmpc(), discs(), (3.0, 0.0, 0.0))
    assert commands[8].v == pytest.approx(0.5, abs=0.02)  # v_max / 2, as the paper has it
    assert np.abs(poses[:, 1]).max() < 0.02
    assert {c.status for c in commands} == {"tracking"}


def test_yields_to_a_moving_obstacle_that_crosses():
    def crossing(t):
        return discs((1.5, -2.0 + 0.8 * t, 0.35), moving=True, velocity=(0.0, 0.8))

    _, poses, _ = drive(HpTmpc(), crossing, (4.0, 0.0, 0.0))
    gaps = [math.hypot(p[0] - 1.5, p[1] + 2.0 - 0.8 * C * k) for k, p in enumerate(poses)]
    assert min(gaps) > 0.6
    assert math.hypot(*(poses[-1, :2] - (4.0, 0.0))) < 0.2


def test_the_ancillary_gain_is_alive():
    navigator = HpTmpc()
    _, _, corrections = drive(navigator, discs((2.0, 0.05, 0.35)), (4.0, 0.0, 0.0), noise=0.005)
    assert (corrections > 1e-4).mean() > 0.2
    assert navigator.spectral_radius < 1.0


def test_without_disturbance_there_is_nothing_to_correct():
    _, _, corrections = drive(HpTmpc(), discs(), (3.0, 0.0, 0.0))
    assert corrections.max() < 1e-9


def test_turns_round_on_the_spot_for_a_goal_behind():
    _, poses, _ = drive(HpTmpc(), discs(), (-3.0, 0.1, 0.0))
    assert math.hypot(*(poses[-1, :2] - (-3.0, 0.1))) < 0.2
    assert poses[:, 0].max() < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["pattern-search", "genetic"])
def test_the_papers_own_solvers_arrive_within_a_budget(solver):
    rows = [(1.2, 0.05, 0.35)]
    budget = Budget(iterations=400)
    _, poses, _ = drive(HpTmpc(solver), discs(*rows), (2.4, 0.0, 0.0), 60, the_task=task(budget=budget))
    assert math.hypot(*(poses[-1, :2] - (2.4, 0.0))) < 0.5
    assert clearance(poses, rows) > 0.0


def test_a_clock_that_runs_out_is_told():
    navigator = HpTmpc("genetic")
    commands, _, _ = drive(
        navigator, discs((1.2, 0.0, 0.35)), (3.0, 0.0, 0.0), 5, the_task=task(budget=Budget(seconds=1e-6))
    )
    assert all(c.cut for c in commands)


ROWS = [(1.2, 0.05, 0.35), (2.6, -0.6, 0.35), (2.2, 0.9, 0.35)]


@pytest.mark.parametrize("n", [5, 12])
def test_a_clock_that_does_not_run_out_changes_nothing(n):
    def run(budget):
        navigator = HpTmpc(prediction_horizon=n)
        return drive(navigator, discs(*ROWS), (3.5, 0.1, 0.0), 40, noise=0.01, the_task=task(budget=budget))[0]

    with_clock = run(Budget(seconds=600.0))
    assert with_clock == run(Budget())
    assert not any(c.cut for c in with_clock)


def test_the_clock_ends_a_decision_of_the_default_solver():
    def crossing(t):
        return discs((1.2, 1.0 - 0.5 * t, 0.35), (1.0, 0.2, 0.3), moving=True, velocity=(0.0, -0.5))

    commands, _, _ = drive(HpTmpc(), crossing, (3.0, 0.0, 0.0), 40, the_task=task(budget=Budget(seconds=20e-6)))
    assert all(c.cut for c in commands)
    before = np.zeros(2)
    for c in commands:
        now = np.array((c.v, c.omega))
        assert -1e-9 <= c.v <= 1.0 + 1e-9
        assert abs(c.omega) <= 1.5 + 1e-9
        assert np.hypot(*(now - before)) <= Parameters.read().input_change + 1e-9
        before = now


def test_an_unbounded_decision_is_never_called_cut():
    commands, _, _ = drive(HpTmpc(), discs((1.2, 0.0, 0.35)), (3.0, 0.0, 0.0), 30)
    assert not any(c.cut for c in commands)


@pytest.mark.parametrize("literal", ["1", "2", "3f", "3k", "1,2,3f,3k"])
def test_literal_readings_answer(literal):
    commands, _, _ = drive(HpTmpc(literal=literal), discs((1.2, 0.0, 0.35)), (3.0, 0.0, 0.0), 20)
    assert len(commands) == 20


def test_the_literal_circle_never_lets_the_robot_come_near_its_goal():
    """(3f) as printed allows motion up to the farthest planned point less rho_safe, which is > 0.6 m."""
    commands, poses, _ = drive(HpTmpc(literal=("3f",)), discs((5.0, 3.0, 0.35)), (0.5, 0.0, 0.0), 40)
    assert "infeasible" in {c.status for c in commands} or "braking" in {c.status for c in commands}
    assert math.hypot(*(poses[-1, :2] - (0.5, 0.0))) > 0.2


def test_literal_3k_gives_the_reference_inputs_when_nothing_disturbs():
    commands, _, _ = drive(HpTmpc(literal=("3k",)), discs(), (3.0, 0.0, 0.0), 6)
    assert [c.v for c in commands] == pytest.approx([0.5] * 6, abs=1e-9)


def test_what_is_known_of_a_moving_obstacles_error_counts_once():
    """(5) starts at the error of the position: a second's doubt of 0.3 m doesn't grow by 0.3 m every period."""
    p = Parameters.read()
    settings = _settings(p, task(), ROBOT, frozenset(), False)
    rows, counts = obstacle_rows(
        settings,
        np.zeros((0, 3)),
        np.array([[1.0, 0.0, 0.0, 0.0, 0.6, 0.3]]),
        np.zeros(3),
        np.zeros(settings.horizon + 1),
    )
    step = 0.9 * 0.3 + p.w_dyn  # of w_1, xi_dyn = 0.1
    assert counts[0] == 2  # at steps 1 and 2
    assert rows[0, :2, 2] == pytest.approx([0.65 + step, 0.65 + 0.9 * step + p.w_dyn])


# bad input


def test_a_thousand_obstacles():
    rng = np.random.default_rng(0)
    rows = np.column_stack((rng.uniform(-4, 4, (1000, 2)), np.full(1000, 0.1)))
    rows = rows[np.hypot(rows[:, 0], rows[:, 1]) > 0.5]
    commands, _, _ = drive(HpTmpc(), discs(*rows, moving=True, velocity=(0.1, 0.0)), (3.0, 0.0, 0.0), 4)
    assert len(commands) == 4


def test_obstacles_that_are_not_numbers_are_left_out():
    def run(*rows):
        return [(c.v, c.omega) for c in drive(HpTmpc(), discs(*rows), (3.0, 0.0, 0.0), 20)[0]]

    assert run((1.5, 0.0, 0.3), (math.nan, 0.0, 0.3), (1.0, 0.0, math.nan)) == run((1.5, 0.0, 0.3))


def test_an_unknown_velocity_counts_as_none():
    def run(velocity):
        seen = discs((1.5, 0.0, 0.3), moving=True, velocity=velocity)
        return [(c.v, c.omega) for c in drive(HpTmpc(), seen, (3.0, 0.0, 0.0), 20)[0]]

    assert run((math.nan, math.nan)) == run((0.0, 0.0))


@pytest.mark.parametrize("field", ["pose", "goal.pose"])
def test_a_pose_that_is_not_a_number_is_named(field):
    navigator = HpTmpc()
    navigator.reset(task(), ROBOT, np.random.default_rng(0))
    bad, good = np.array((0.0, math.nan, 0.0)), np.zeros(3)
    pose, goal = (bad, good) if field == "pose" else (good, bad)
    with pytest.raises(ValueError, match=field):
        navigator.step(Observation(0.0, pose, np.zeros(2), good, Goal(goal, 0.2, 1.0), obstacles=discs()))


@pytest.mark.parametrize(
    "rows",
    [
        [(0.0, 0.0, 0.35)],  # on top of the robot, so the start is inside
        [(0.2, 0.1, 0.35), (-0.3, 0.0, 0.5)],
        [(3.0, 0.0, 0.5)],  # the goal is inside
        [(0.8 * math.cos(a), 0.8 * math.sin(a), 0.3) for a in np.linspace(0, 2 * math.pi, 12)],  # no free path
    ],
)
def test_hopeless_places_get_an_answer_within_the_limits(rows):
    commands, _, _ = drive(HpTmpc(), discs(*rows), (3.0, 0.0, 0.0), 25)
    for c in commands:
        assert -1e-9 <= c.v <= 1.0 + 1e-9
        assert abs(c.omega) <= 1.5 + 1e-9
        assert c.status in ("tracking", "infeasible", "braking", "no path", "iteration limit", "input limit")


def test_walled_in_it_stays_in_and_touches_nothing():
    rows = [(1.2 * math.cos(a), 1.2 * math.sin(a), 0.4) for a in np.linspace(0, 2 * math.pi, 13)]
    _, poses, _ = drive(HpTmpc(), discs(*rows), (4.0, 0.0, 0.0), 60)
    assert clearance(poses, rows) > 0.0
    assert np.hypot(poses[:, 0], poses[:, 1]).max() < 1.2


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("prediction_horizon", 0, "prediction_horizon"),
        ("control_horizon", 25, "control_horizon"),
        ("w1", 1.5, "w1"),
        ("w2", -1.0, "w2"),
        ("xi_rob", 1.2, "xi_rob"),
        ("xi_dyn", -0.1, "xi_dyn"),
        ("w_rob", math.nan, "w_rob"),
        ("pole_left", 1.0, "pole_left"),
        ("safe_marign", 0.1, "safe_margin"),
    ],
)
def test_wrong_parameters_are_named(option, value, words):
    with pytest.raises(ClearwayError, match=words):
        HpTmpc(**{option: value})


def test_wrong_parameters_of_a_robot_name_the_robot():
    robot = ROBOT.model_copy(update={"navigators": {"hp-tmpc": {"prediction_horizon": 0}}})
    with pytest.raises(
        ClearwayError, match=r"robot rescue:unlimited: navigators\.hp-tmpc\.prediction_horizon: 0 is wrong"
    ):
        HpTmpc().reset(task(), robot, np.random.default_rng(0))


@pytest.mark.parametrize("option", [{"solver": "newton"}, {"planner": "a-star"}, {"literal": "4"}])
def test_unknown_choices_list_the_known(option):
    with pytest.raises(ClearwayError, match="known:"):
        HpTmpc(**option)


def test_control_horizon_follows_the_prediction_horizon():
    assert Parameters.read(None, prediction_horizon=12).control_horizon == 12
    assert Parameters.read(None, prediction_horizon=12, control_horizon=3).control_horizon == 3


def test_the_same_seed_gives_the_same_commands():
    runs = [
        [(c.v, c.omega) for c in drive(HpTmpc(), discs((1.5, 0.0, 0.3), (2.5, 0.6, 0.3)), (4.0, 0.3, 0.0), 60)[0]]
        for _ in range(2)
    ]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("name", ["tiago", "hosbot"])
def test_robots_with_accelerations_keep_them(name):
    robot = load_robot(name)
    commands, _, _ = drive(
        HpTmpc(), discs((1.8, 0.1, 0.2)), (3.5, 0.0, 0.0), 60, robot=robot, the_task=task(robot, 0.6)
    )
    v = np.array([0.0, *(c.v for c in commands)])
    d = robot.drive
    assert v.max() <= 0.6 + 1e-9
    assert np.diff(v).max() <= d.acceleration * robot.period + 1e-9
    assert np.diff(v).min() >= -d.deceleration * robot.period - 1e-9
    assert v.max() > 0.25


def test_turns_to_the_goals_heading_once_there():
    robot = load_robot("tiago")
    navigator = HpTmpc()
    navigator.reset(task(robot, 0.6), robot, np.random.default_rng(0))
    pose, goal = np.zeros(3), Goal(np.array((0.05, 0.0, 2.0)), 0.2, 0.1)
    for k in range(60):
        command = navigator.step(Observation(k * 0.1, pose.copy(), np.zeros(2), pose, goal, obstacles=discs()))
        pose = step_arc(pose, command.v, command.omega, robot.period)
    assert abs(pose[2] - 2.0) < 0.1
    assert math.hypot(pose[0] - 0.05, pose[1]) < 0.2
    assert abs(command.omega) < 0.1


def test_says_that_it_has_arrived_well_within_the_tolerances_only():
    robot = load_robot("tiago")
    navigator = HpTmpc()
    navigator.reset(task(robot, 0.6), robot, np.random.default_rng(0))
    pose, velocity, goal = np.zeros(3), np.zeros(2), Goal(np.array((1.0, 0.0, 2.0)), 0.2, 0.2)
    called = False
    for k in range(200):
        command = navigator.step(Observation(k * 0.1, pose.copy(), velocity, pose, goal, obstacles=discs()))
        away, off = math.hypot(pose[0] - 1.0, pose[1]), abs(turn_between(pose[2], 2.0))
        called = called or (away <= 0.14 and off <= 0.1)
        assert command.arrived == called
        if command.arrived and not velocity.any():
            break
        pose, velocity = step_arc(pose, command.v, command.omega, robot.period), np.array((command.v, command.omega))
    assert command.arrived  # and it stands
    assert math.hypot(pose[0] - 1.0, pose[1]) <= 0.14
    assert abs(turn_between(pose[2], 2.0)) <= 0.1


@pytest.mark.parametrize("yaw_tolerance", [0.2, math.pi, math.inf])
def test_takes_the_goals_own_tolerances_where_it_comes_no_nearer(yaw_tolerance):
    """A goal that is covered up to 0.18 m from it: the robot can't come nearer than that."""
    robot = load_robot("tiago")
    navigator = HpTmpc(prediction_horizon=5)
    navigator.reset(task(robot, 0.6), robot, np.random.default_rng(0))
    seen = discs((1.44, 0.0, 0.25))
    pose, velocity, goal = np.array((0.2, 0.0, 0.0)), np.zeros(2), Goal(np.array((1.0, 0.0, 0.0)), 0.2, yaw_tolerance)
    for k in range(300):
        command = navigator.step(Observation(k * 0.1, pose.copy(), velocity, pose, goal, obstacles=seen))
        if command.arrived:
            break
        pose, velocity = step_arc(pose, command.v, command.omega, robot.period), np.array((command.v, command.omega))
    assert command.arrived
    assert 0.14 < math.hypot(pose[0] - 1.0, pose[1]) <= 0.2


def test_diagnostics_show_plan_horizon_tube_and_belts():
    navigator = HpTmpc()
    seen = discs((1.2, 0.6, 0.35), moving=True, velocity=(0.0, -0.5))
    commands, _, _ = drive(navigator, seen, (3.0, 0.0, 0.0), 2)
    shown = navigator.diagnostics()
    assert {"plan", "horizon"} <= set(shown.polylines)
    assert len(shown.circles["belts"]) > 0
    assert len(shown.circles["obstacles"]) == 1
    assert shown.tube is not None
    assert (np.diff(shown.tube[:, 2]) > 0).all()
    assert shown.status == commands[-1].status


def test_on_the_rescue_robot_it_drives_as_if_there_were_no_reverse():
    """Paper B's controller is what it was before the robot could drive backwards: command by command, bit by bit."""
    forwards = ROBOT.model_copy(update={"drive": ROBOT.drive.model_copy(update={"v_min": 0.0})})
    rows = ((1.5, 0.05, 0.35), (2.6, 0.5, 0.35))

    def obstacles(t):  # one of them comes at the robot
        return discs(*rows, (4.0 - 0.8 * t, 0.1, 0.35), moving=True, velocity=(-0.8, 0.0))

    runs = [drive(HpTmpc(), obstacles, (5.0, 0.0, 0.0), 60, noise=0.01, robot=robot)[0] for robot in (ROBOT, forwards)]
    assert [(c.v, c.omega) for c in runs[0]] == [(c.v, c.omega) for c in runs[1]]
    assert min(c.v for c in runs[0]) >= 0.0
    assert ROBOT.drive.v_min == -1.0
    assert not Parameters.read(ROBOT).reverse
    assert Parameters.read(load_robot("tiago")).reverse
    backwards = ROBOT.model_copy(update={"navigators": {"hp-tmpc": {"reverse": True}}})
    assert _settings(Parameters.read(backwards), task(), backwards, frozenset(), False).limits.v_min == -1.0

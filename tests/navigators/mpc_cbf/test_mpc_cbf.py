"""MPC-CBF: the condition on its barriers along what it predicts, what stands for walls, its drive, and where it is known to fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.plan import CampaignPlan
from clearway.contract import Budget, Goal, Latency, Observation, Status, Task
from clearway.crowds.walls import walls_of
from clearway.errors import ClearwayError
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.motion import arc
from clearway.navigators.common.tracking.gauss_newton import BUDGET, solve_gauss_newton
from clearway.navigators.common.tracking.problem import TOLERANCE
from clearway.navigators.mpc_cbf import MpcCbf
from clearway.navigators.mpc_cbf.decision import Settings, barriers, pose_problem
from clearway.robots import DriveLimits, load_robot
from clearway.scenarios.suite import Selection
from perceived import exact

pytestmark = pytest.mark.slow  # compiles for long

RADIUS, PERIOD = 0.25, 0.1
ROBOT = load_robot("rescue").model_copy(update={"period": PERIOD})
LIMITS = DriveLimits(0.0, 1.0, 2.0, 2.0, 1.5, 4.0, 4.0)
EVERYWHERE = np.array((-math.inf, -math.inf, math.inf, math.inf))


def settings(horizon=12, gamma=0.1, limits=LIMITS):
    return Settings(PERIOD, horizon, gamma, 0.1, 10.0, 0.3, 0.3, 5.0, 2.0, EVERYWHERE, limits)


def facing(settings, away, need, speed=1.0, aside=0.0, coming=0.0):
    """Problem (10) of a robot that drives along x at `speed`, a disc of contact `need` `away` before it that comes at `coming`."""
    n = settings.horizon
    reference = np.column_stack((PERIOD * np.arange(1, n + 1), np.zeros(n), np.zeros(n)))
    place = np.column_stack(
        (away - coming * PERIOD * np.arange(n + 1), np.full(n + 1, aside), np.full(n + 1, need))
    )[:, None]  # fmt: skip
    return pose_problem(settings, reference, place[0].copy(), place[1:].copy(), np.zeros(3), np.array((speed, 0.0)))


def heights(problem, states):
    """h of (17) at the start and at each stage, (N + 1, M)."""
    at = np.vstack((problem.start, states))[:, None, :2]
    rows = np.concatenate((problem.passed[None], problem.rows))
    return ((at - rows[..., :2]) ** 2).sum(2) - rows[..., 2] ** 2


def drive(navigator, discs, duration, goal=(5.0, 0.0), late=0, grid=None):
    """The robot from the origin to `goal` among `discs(t)`, sensing and acting `late` periods late; its poses, commands, the
    smallest gap, whether it arrived."""
    pose, velocity = np.zeros(3), np.zeros(2)
    aim, latency = Goal(np.array((*goal, 0.0)), 0.2, math.pi), Latency(late * PERIOD, late * PERIOD)
    navigator.reset(Task(PERIOD, 1.0, pose.copy(), map=grid, latency=latency), ROBOT, np.random.default_rng(0))
    poses, velocities, commands, gap = [pose], [velocity], [], math.inf
    for k in range(int(duration / PERIOD)):
        others = discs(k * PERIOD)
        if len(others):
            gap = min(gap, float((np.hypot(*(others.position - pose[:2]).T) - others.radius).min()) - RADIUS)
        then, t = max(k - late, 0), (k - late) * PERIOD
        told = Observation(t, poses[then], velocities[then], poses[then], aim, None, discs(t))
        commands.append(navigator.step(told))
        if k >= late:
            velocity = np.array((commands[k - late].v, commands[k - late].omega))
        pose = np.array(arc(*pose, *velocity, PERIOD))
        poses.append(pose)
        velocities.append(velocity)
        if commands[-1].arrived:
            break
    return np.array(poses), commands, gap, bool(commands[-1].arrived)


def nobody(t):
    return exact()


@pytest.mark.parametrize("gamma", [0.03, 0.1, 0.3])
def test_no_barrier_falls_by_more_than_its_share_along_the_prediction(gamma):
    problem = facing(settings(gamma=gamma), 2.0, 0.7, 0.3, 0.2)
    solution = solve_gauss_newton(problem, np.tile((0.3, 0.0), (12, 1)), BUDGET)
    h = heights(problem, solution.states)
    assert solution.violation <= TOLERANCE
    assert (h[1:] - (1.0 - gamma) * h[:-1] >= -2.0 * 0.7 * TOLERANCE).all()
    assert np.isclose(h[1:], (1.0 - gamma) * h[:-1], atol=1e-3).any()  # somewhere it binds


def test_the_smaller_gamma_the_farther_it_keeps():
    """Table I of the paper; with gamma = 1 the barrier is the distance alone (MPC-DC), and it goes up to the rim."""
    least = []
    for gamma in (0.03, 0.1, 0.3, 1.0):
        problem = facing(settings(20, gamma), 1.6, 0.6, 0.3)
        states = solve_gauss_newton(problem, np.tile((0.3, 0.0), (20, 1)), BUDGET).states
        least.append(math.sqrt(heights(problem, states).min() + 0.36) - 0.6)
    assert least == sorted(least, reverse=True)
    assert least[0] > 0.3
    assert abs(least[-1]) < 0.02


def test_with_a_small_gamma_and_a_speed_that_brakes_are_too_weak_for_there_is_no_solution():
    """Remark 3: the smaller gamma, the smaller the set of inputs that keep (10f); braking itself does not, though nothing
    would be touched."""
    for gamma, feasible in ((0.05, False), (0.5, True)):
        problem = facing(settings(6, gamma), 1.6, 0.6)
        solution = solve_gauss_newton(problem, np.zeros((6, 2)), BUDGET)
        assert (solution.violation <= TOLERANCE) is feasible
        assert (np.hypot(*(solution.states[:, :2] - (1.6, 0.0)).T) > 0.6).all()


def test_a_short_horizon_without_barriers_sees_too_late():
    """What the paper sets out from: at N = 5 distances alone (MPC-DC) let it come so near that nothing keeps them any more;
    the barriers make it brake in time with the same horizon."""
    last = {}
    for gamma in (0.2, 1.0):
        here, pose, velocity = settings(2, gamma), np.zeros(3), np.array((1.0, 0.0))
        worst, plan = 0.0, np.tile((1.0, 0.0), (2, 1))
        for _ in range(30):
            n = here.horizon
            reference = np.column_stack((pose[0] + PERIOD * np.arange(1, n + 1), np.zeros(n), np.zeros(n)))
            rows = np.tile((3.0, 0.0, 0.6), (n, 1, 1))
            problem = pose_problem(here, reference, rows[0].copy(), rows, pose, velocity)
            solution = solve_gauss_newton(problem, plan, BUDGET)
            plan, velocity = solution.inputs, solution.inputs[0]
            pose, worst = solution.states[0], max(worst, 0.6 - math.hypot(3.0 - solution.states[0, 0], pose[1]))
        last[gamma] = worst
    assert last[0.2] <= TOLERANCE
    assert last[1.0] > 0.02


def test_exactly_head_on_it_stands_before_what_stands_and_a_little_aside_it_passes():
    """The deadlock of the symmetric meeting: to neither side does the cost fall. What counts as one that can move is not
    planned around by the way, so the controller alone has to get past it."""
    stuck, _, gap, arrived = drive(MpcCbf(), lambda t: exact((2.5, 0.0), radius=0.3), 15.0)
    assert not arrived
    assert gap > 0.0
    assert abs(stuck[-1, 1]) < 1e-6
    assert np.hypot(*(stuck[-1] - stuck[-20])[:2]) < 0.05
    _, _, gap, arrived = drive(MpcCbf(), lambda t: exact((2.5, 0.3), radius=0.3), 15.0)
    assert arrived
    assert gap > 0.0


def test_it_brakes_and_says_so_where_nothing_keeps_the_barriers():
    """Somebody runs at it, and nothing that it can do keeps (10f): there it stands, and does not run through."""
    here = MpcCbf(reverse=False)
    poses, commands, _, _ = drive(here, lambda t: exact((4.0 - 2.5 * t, 0.0), (-2.5, 0.0), 0.3), 1.5)
    assert np.mean([c.status == Status.BRAKING for c in commands]) > 0.7
    assert np.hypot(*poses[-1, :2]) < 0.05
    assert here.diagnostics().status == Status.BRAKING


@pytest.mark.parametrize("late", [0, 2])
def test_it_gets_past_whoever_crosses(late):
    """Who comes to its senses 0.2 s late and acts 0.2 s later, too."""

    def crossing(t):
        return exact([(2.5, 2.0 - 0.8 * t), (4.0, -2.6 + 0.6 * t)], [(0.0, -0.8), (0.0, 0.6)], 0.3)

    _, _, gap, arrived = drive(MpcCbf(), crossing, 20.0, late=late)
    assert arrived
    assert gap > 0.0


def test_around_what_stands_and_through_a_door():
    cells = np.zeros((80, 80), np.int8)
    cells[:, 40] = cells[:, 41] = 100
    cells[48:60, 40:42] = 0  # a door of 1.2 m, 0.8 m aside
    grid = OccupancyGrid(cells, 0.1, (-1.5, -4.0))
    poses, _, _, arrived = drive(MpcCbf(), nobody, 25.0, grid=grid)
    assert arrived
    inside = (poses[:, 0] > 2.5) & (poses[:, 0] < 2.7)
    assert (poses[inside, 1] > 0.8 + RADIUS - 0.03).all()
    assert (poses[inside, 1] < 2.0 - RADIUS + 0.03).all()
    _, _, gap, arrived = drive(MpcCbf(), lambda t: exact((2.5, 0.05), radius=0.3, moving=False), 20.0)
    assert arrived
    assert gap > 0.0


def test_two_that_meet_get_past_each_other(tmp_path):
    """Whose cost outweighed the penalty on (10f) stood before the other until their time was over."""
    chosen = Selection(configurations=("two robots",), repetitions=1)
    plan = CampaignPlan(("people",), robots=("tiago",), navigators=("mpc-cbf",), selection=chosen)
    assert [row["outcome"] for row in run_campaign(plan, tmp_path / "out", 0).trials.to_pylist()] == ["reached"] * 2


def test_without_a_way_it_stands_and_says_so():
    cells = np.zeros((60, 60), np.int8)
    cells[:, 30] = 100
    poses, commands, _, _ = drive(MpcCbf(), nobody, 1.0, (2.0, 0.0), grid=OccupancyGrid(cells, 0.1, (-1.5, -3.0)))
    assert commands[0].status == Status.NO_PATH
    assert np.hypot(*poses[-1, :2]) < 0.05


def test_a_wall_is_a_disc_that_touches_it_from_within():
    """Along the wall nearly a half-plane, and at its corner no more than a point: a door stays as wide as it is."""
    walls = walls_of([[(0.0, 1.0), (6.0, 1.0), (6.0, 2.0), (0.0, 2.0)]])
    nothing = Forecaster(ForecastParameters(), PERIOD, PERIOD, 3).update(0.0, nobody(0.0))[0]
    here = settings(3)
    for x, size in ((3.0, 3.0), (1.0, 1.0), (-0.5, 0.0)):
        states = np.tile((x, 0.2, 0.0), (3, 1))
        now, later = barriers(here, nothing, walls, np.array((x, 0.2, 0.0)), states)
        assert any(np.allclose(row, (max(x, 0.0), 1.0 + size, size + 0.3)) for row in now)
        gap = np.hypot(now[:, 0] - x, now[:, 1] - 0.2) - now[:, 2]
        assert gap.min() == pytest.approx(math.hypot(min(x, 0.0), 0.8) - 0.3)
        assert (later == now).all()


def test_its_budget_ends_the_search_and_is_told():
    navigator = MpcCbf()
    task = Task(PERIOD, 1.0, np.zeros(3), budget=Budget(iterations=3))
    navigator.reset(task, ROBOT, np.random.default_rng(0))
    goal, pose = Goal(np.array((5.0, 0.0, 0.0)), 0.2, math.pi), np.zeros(3)
    near = exact([(0.9, 0.2), (0.8, -0.7)], [(-0.5, 0.0), (0.0, 0.5)], 0.3)
    command = navigator.step(Observation(0.0, pose, np.array((0.5, 0.0)), pose, goal, None, near))
    assert command.cut
    assert navigator.diagnostics().iterations <= 3


@pytest.mark.parametrize(("option", "value"), [("gamma", 1.0), ("gamma", 0.0), ("horizon", -1.0), ("effort", math.nan)])
def test_a_wrong_option_is_told_at_once(option, value):
    with pytest.raises(ClearwayError, match=option):
        MpcCbf(**{option: value})

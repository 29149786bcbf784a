"""The tracking problem against hand-computed values and independent numpy; its solvers' promises on random problems."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from tracking_problems import cost, problem, violations

from clearway.geometry.streams import stream
from clearway.navigators.common.tracking.gauss_newton import BUDGET, linearise, solve_gauss_newton
from clearway.navigators.common.tracking.interior_point import Program, minimise
from clearway.navigators.common.tracking.problem import (
    CONVERGED,
    INFEASIBLE,
    INPUT_LIMIT,
    ITERATION_LIMIT,
    TOLERANCE,
    advance,
    box,
    discounts,
    judge,
    project,
    roll_out,
    seeds,
    shift,
)
from clearway.navigators.common.tracking.riccati import LinearMotion
from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.genetic import genetic
from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.pattern_search import pattern_search

KEY = stream(3, "test")


def straight(n=5, rows=None, **other):
    """A reference along x at 0.5 m/s from the origin, as the stand-ins have it."""
    given = {
        "start": (0.0, 0.0, 0.0),
        "reference": [(0.075 * (k + 1), 0.0, 0.0) for k in range(n)],
        "nominal": (0.5, 0.0),
        "previous": (0.5, 0.0),
        "low": (0.0, -1.5),
        "high": (1.0, 1.5),
        "period": 0.15,
        "smooth": 0.5,
        "discount": discounts(n, 0.9, 0, False),
        "effort": 0.1,
        "heading_weight": 0.1,
    }
    if rows is not None:
        given["rows"] = np.tile(np.asarray(rows, dtype=float).reshape(1, -1, 3), (n, 1, 1))
    return problem(**(given | other))


@st.composite
def problems(draw):
    """Random problems, feasible or not: any horizon, held inputs, both models, random obstacles and bounds."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(1, 9))
    m = draw(st.sampled_from([0, 1, 6]))
    rows = np.concatenate([rng.uniform(-1.5, 1.5, (n, m, 2)), rng.uniform(0.0, 0.8, (n, m, 1))], axis=2)
    return problem(
        start=rng.uniform(-1, 1, 3) * (0.3, 0.3, 4.0),
        previous=rng.uniform((0, -1.5), (1, 1.5)),
        reference=rng.uniform(-1, 1, (n, 3)) * (1, 1, 4),
        nominal=rng.uniform((0, -1), (1, 1)),
        rows=rows,
        counts=rng.integers(0, m + 1, n),
        reach=draw(st.sampled_from([math.inf, 0.3])),
        area=draw(st.sampled_from([(-math.inf, -math.inf, math.inf, math.inf), (-0.3, -0.3, 0.3, 0.3)])),
        low=(draw(st.sampled_from([0.0, -0.5])), -1.5),
        high=(1.0, 1.5),
        period=0.15,
        smooth=draw(st.sampled_from([math.inf, 0.5, 0.05])),
        discount=discounts(n, 0.9, 7, draw(st.booleans())),
        effort=draw(st.sampled_from([0.0, 0.1])),
        heading_weight=draw(st.sampled_from([0.0, 0.1])),
        exact=draw(st.booleans()),
        control_horizon=draw(st.integers(1, n)),
    )


def test_advance_by_hand():
    assert advance(0.0, 0.0, 0.0, 1.0, math.pi / 2, 1.0, True) == pytest.approx((2 / math.pi, 2 / math.pi, math.pi / 2))
    assert advance(1.0, 2.0, math.pi / 2, 0.5, 0.0, 0.2, True) == pytest.approx((1.0, 2.1, math.pi / 2))
    # Eq. 1 as printed: x + c (v cos - c w v sin), y + c (v sin + c w v cos)
    assert advance(0.0, 0.0, 0.0, 1.0, 0.5, 0.2, False) == pytest.approx((0.2, 0.02, 0.1))
    assert advance(0.0, 0.0, math.pi / 2, 1.0, 0.5, 0.2, False) == pytest.approx((-0.02, 0.2, math.pi / 2 + 0.1))


def test_cost_by_hand():
    p = problem(
        start=(0, 0, 0), reference=[(0.5, 0.3, 0.0), (1.0, 0.0, 3.0)], low=(-1, -1), high=(1, 1), period=0.5,
        discount=(0.9, 0.81), effort=0.1, heading_weight=0.2,
    )  # fmt: skip
    u = np.array([[1.0, 0.0], [1.0, 0.0]])
    by_hand = 0.9 * 0.3 + 0.81 * 0.2 * 3.0 + 0.1 * 2.0
    assert cost(p, u, roll_out(p, u)) == pytest.approx(by_hand)
    assert judge(p, u)[0] == pytest.approx(by_hand)


def test_the_headings_error_is_wrapped():
    p = problem(
        start=(0, 0, 3.1), reference=[(0, 0, -3.1)], low=(0, 0), high=(0, 0), period=0.1, heading_weight=1.0
    )  # fmt: skip
    assert judge(p, np.zeros((1, 2)))[0] == pytest.approx(2 * math.pi - 6.2)


def test_discounts_by_hand():
    np.testing.assert_allclose(discounts(3, 0.9, 41, False), [0.9, 0.81, 0.729])
    np.testing.assert_allclose(discounts(2, 0.9, 0, True), [0.9, 0.81])  # kappa = 0: k / 1
    np.testing.assert_allclose(discounts(2, 0.9, 9, True), [0.9, 0.9**1.1])  # kappa = 9: 10/10, 11/10


def test_violations_by_hand():
    p = straight(
        2, [(0.3, 0.4, 0.6), (9.0, 9.0, 1.0)], reach=0.1, area=(-1, -1, 0.12, 1), high=(0.8, 1.5), previous=(0.2, 0.0)
    )
    found = violations(p, np.array([[1.0, 0.0], [0.0, 0.0]]))
    assert found == pytest.approx([0.03, 0.2, 0.5, 0.05, 0.6 - math.hypot(0.15, 0.4)])


def numpy_violation(p, u):
    """The largest violation, written independently: motion integrated in closed form by another formula."""
    x, y, theta, last, worst = *p.start, p.previous, 0.0
    for k, (v, w) in enumerate(u):
        if not p.exact:
            a, b = p.period * v, p.period * p.period * w * v
            x, y = x + a * math.cos(theta) - b * math.sin(theta), y + a * math.sin(theta) + b * math.cos(theta)
        elif abs(w) < 1e-7:
            x, y = x + v * p.period * math.cos(theta), y + v * p.period * math.sin(theta)
        else:
            end = theta + w * p.period
            x, y = x + v / w * (math.sin(end) - math.sin(theta)), y + v / w * (math.cos(theta) - math.cos(end))
        theta += w * p.period
        r = p.rows[k, : p.counts[k]]
        worst = max(
            [worst, *(r[:, 2] - np.hypot(r[:, 0] - x, r[:, 1] - y)), *(p.area[k, :2] - (x, y)),
             *((x, y) - p.area[k, 2:]), math.dist((x, y), p.centre) - p.reach[k],
             *(p.low[k] - (v, w)), *((v, w) - p.high[k]), math.dist((v, w), last) - p.smooth[k]]
        )  # fmt: skip
        last = v, w
    return worst


@given(problems(), st.integers(0, 2**32 - 1))
def test_a_projected_plan_keeps_box_rates_and_held_inputs(p, seed):
    n = len(p.reference)
    u = np.random.default_rng(seed).uniform(-3, 3, (n, 2))
    assert project(p, u)  # `previous` lies in the box here
    assert violations(p, u)[1:3].max() <= 1e-12
    assert (u[p.control_horizon - 1 :] == u[p.control_horizon - 1]).all()
    again = u.copy()
    project(p, again)
    np.testing.assert_allclose(again, u, atol=1e-9)


def test_a_box_out_of_the_rate_limits_reach_is_told_and_the_box_kept():
    p = straight(3, previous=(0.0, 0.0), low=(0.4, -1.5), smooth=0.1)
    u = np.zeros((3, 2))
    assert not project(p, u)
    assert violations(p, u)[1] == 0.0
    assert violations(p, u)[2] == pytest.approx(0.3)
    answer = solve_gauss_newton(p, u, BUDGET)
    assert answer.status == INPUT_LIMIT
    assert violations(p, answer.inputs)[1] == 0.0


def test_the_last_free_input_keeps_the_bounds_of_the_stages_that_it_serves():
    high = np.array([(1.0, 1.5), (0.8, 1.2), (0.6, 1.3)])
    p = straight(3, high=high, control_horizon=2)
    assert box(p, 0) == (0.0, 1.0, -1.5, 1.5)
    assert box(p, 1) == (0.0, 0.6, -1.5, 1.2)


@settings(max_examples=30)
@given(problems(), st.integers(0, 2**32 - 1))
def test_derivatives_against_finite_differences(p, seed):
    n = len(p.reference)
    u = np.random.default_rng(seed).uniform((0.0, -1.5), (1.0, 1.5), (n, 2))
    turn, push, error = np.empty((n, 2)), np.empty((n, 2, 2)), np.empty((n, 3))
    linearise(p, u, LinearMotion(turn, push, p.period), error)
    states = np.vstack([p.start, roll_out(p, u)])
    h = 1e-6
    for k in range(n):
        x, y, theta = states[k]
        off = [
            (np.array(advance(x, y, theta + a, u[k, 0] + b, u[k, 1] + c, p.period, p.exact))
             - advance(x, y, theta - a, u[k, 0] - b, u[k, 1] - c, p.period, p.exact)) / (2 * h)
            for a, b, c in ((h, 0, 0), (0, h, 0), (0, 0, h))
        ]  # fmt: skip
        np.testing.assert_allclose(turn[k], off[0][:2], atol=1e-8)
        np.testing.assert_allclose(push[k, :, 0], off[1][:2], atol=1e-8)
        np.testing.assert_allclose(push[k, :, 1], off[2][:2], atol=1e-8)
    np.testing.assert_allclose(error[:, :2], states[1:, :2] - p.reference[:, :2], atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * (error[:, 2] + p.reference[:, 2])), np.exp(1j * states[1:, 2]), atol=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_the_interior_point_against_scipy(seed):
    """A random convex program with all its kinds of terms: no worse than SLSQP, and feasible."""
    rng = np.random.default_rng(seed)
    n, free, m, rho, effort = 4, 3, 3, 20.0, 0.1
    turn, push = rng.normal(size=(n, 2)) * 0.1, rng.normal(size=(n, 2, 2)) * 0.3
    error, gamma, base = rng.normal(size=(n, 3)), rng.uniform(0.3, 1, n), rng.uniform(-0.5, 0.5, (free, 2))
    low, high, smooth = np.full((free, 2), -1.0), np.full((free, 2), 1.0), np.array([0.6, math.inf, 0.6])
    stage, lack = rng.integers(0, n, m), rng.normal(size=m) * 0.3
    normal = rng.normal(size=(m, 2))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    previous, out = np.zeros(2), np.empty((free, 2))

    def deltas(u):
        d, found = np.zeros(3), []
        for k in range(n):
            du = (u - base)[min(k, free - 1)]
            d = d + np.array([*(turn[k] * d[2] + push[k] @ du), 0.15 * du[1]])
            found.append(d)
        return np.array(found)

    def value(u):
        d = deltas(u)
        lacking = lack - np.einsum("ij,ij->i", normal, d[stage, :2])
        norms = np.linalg.norm((error + d) * (1, 1, 0.5), axis=1)
        held = np.vstack([u, u[-1:]])
        return gamma @ norms + effort * (held**2).sum() + rho * np.maximum(lacking, 0).sum()

    program = Program(
        LinearMotion(turn, push, 0.15), error, 0.5, gamma, effort, base, low, high, smooth, previous, stage, normal,
        np.zeros((0, 2)), lack, m, rho,
    )  # fmt: skip
    spent = minimise(program, 20.0, 1e-8, 60, out)
    assert 0 < spent < 40
    assert (abs(out) <= 1).all()
    changes = np.linalg.norm(np.diff(np.vstack([previous, out]), axis=0), axis=1)
    assert (changes <= smooth + 1e-6).all()

    def smooth_value(z):
        return value_with_slack(z[: 2 * free].reshape(free, 2), z[2 * free :])

    def value_with_slack(u, t):
        d = deltas(u)
        norms = np.linalg.norm((error + d) * (1, 1, 0.5), axis=1)
        return gamma @ norms + effort * (np.vstack([u, u[-1:]]) ** 2).sum() + rho * t.sum()

    def rows_kept(z):
        d = deltas(z[: 2 * free].reshape(free, 2))
        return np.einsum("ij,ij->i", normal, d[stage, :2]) - lack + z[2 * free :]

    def rates_kept(z):
        u = np.vstack([previous, z[: 2 * free].reshape(free, 2)])
        return (np.minimum(smooth, 9) ** 2 - (np.diff(u, axis=0) ** 2).sum(axis=1)).ravel()

    best = min(
        minimize(
            smooth_value, np.concatenate([rng.uniform(-0.2, 0.2, 2 * free), np.ones(m)]), method="SLSQP",
            bounds=[(-1, 1)] * (2 * free) + [(0, None)] * m, options={"ftol": 1e-12, "maxiter": 300},
            constraints=[{"type": "ineq", "fun": rows_kept}, {"type": "ineq", "fun": rates_kept}],
        ).fun
        for _ in range(3)
    )  # fmt: skip
    assert value(out) == pytest.approx(best, abs=2e-6)


def test_a_free_way_is_followed_and_an_obstacle_on_it_is_passed():
    free = solve_gauss_newton(straight(10), np.zeros((10, 2)), BUDGET)
    assert free.status == CONVERGED
    # Effort is cheaper than the last stages' errors are dear: the reference is met but for the tail.
    np.testing.assert_allclose(free.states[:6, :2], [(0.075 * (k + 1), 0) for k in range(6)], atol=1e-3)
    blocked = solve_gauss_newton(straight(20, [(0.9, 0.1, 0.65)]), np.tile((0.5, 0.0), (20, 1)), BUDGET)
    assert blocked.status == CONVERGED
    assert blocked.violation <= TOLERANCE
    assert blocked.states[-1, 1] < -0.2  # it goes round on the side of the gap
    assert blocked.cost > free.cost


@settings(max_examples=60)
@given(problems(), st.integers(0, 80))
def test_what_every_solver_promises(p, budget):
    n = len(p.reference)
    warm = np.full((n, 2), 0.3)
    for solve in (
        lambda: solve_gauss_newton(p, warm, budget),
        lambda: pattern_search(p, seeds(p), budget=budget),
        lambda: genetic(p, seeds(p), KEY, 5, budget=budget),
    ):
        answer = solve()
        assert answer.inputs.shape == (n, 2)
        assert violations(p, answer.inputs)[1:3].max() <= 1e-12
        assert (answer.inputs[p.control_horizon - 1 :] == answer.inputs[p.control_horizon - 1]).all()
        assert max(answer.violation, 1e-12) == pytest.approx(max(numpy_violation(p, answer.inputs), 1e-12), abs=1e-9)
        assert answer.cost == pytest.approx(cost(p, answer.inputs, roll_out(p, answer.inputs)))
        np.testing.assert_array_equal(answer.states, roll_out(p, answer.inputs))
        assert answer.iterations <= max(budget, 1)
        assert (answer.violation > TOLERANCE) <= (answer.status != CONVERGED)
        again = solve()
        np.testing.assert_array_equal(again.inputs, answer.inputs)
        assert again[2:] == answer[2:]


@given(problems(), st.integers(0, 400))
def test_an_answer_is_never_worse_than_the_warm_plan(p, budget):
    warm = np.zeros((len(p.reference), 2))
    answer = solve_gauss_newton(p, warm, budget)
    project(p, warm)
    merits = [value + 100 * summed for value, _, summed in (judge(p, answer.inputs), judge(p, warm))]
    assert merits[0] <= merits[1] + 1e-9


@pytest.mark.parametrize("m", [0, 1000])
@pytest.mark.parametrize("n", [1, 5, 20])
def test_none_or_a_thousand_obstacles(m, n):
    rng = np.random.default_rng(0)
    rows = np.column_stack([rng.uniform(-8, 8, (m, 2)), np.full(m, 0.1)])
    rows = rows[np.hypot(rows[:, 0], rows[:, 1]) > 0.5]
    p = straight(n, rows)
    for answer in (
        solve_gauss_newton(p, np.zeros((n, 2)), BUDGET),
        pattern_search(p, seeds(p), budget=300),
        genetic(p, seeds(p), KEY, 0, budget=300),
    ):
        assert answer.violation <= TOLERANCE


def test_inside_an_obstacle_it_gets_out_as_far_as_it_can():
    for x in (0.0, -0.1, 0.3):  # the centre on the robot, behind, ahead
        p = straight(5, [(x, 0.0, 0.65)])
        answer = solve_gauss_newton(p, np.zeros((5, 2)), BUDGET)
        assert np.isfinite(answer.inputs).all()
        assert answer.status == INFEASIBLE
        assert answer.violation < 0.65
    behind = solve_gauss_newton(straight(5, [(-0.1, 0.0, 0.65)]), np.zeros((5, 2)), BUDGET)
    assert behind.inputs[:3, 0] == pytest.approx(1.0, abs=1e-3)  # away at full speed, until it is out


def test_not_a_number_ends_in_an_answer():
    for p in (
        straight(5, [(math.nan, 0.0, 0.65)]),
        straight(5)._replace(reference=np.full((5, 3), math.nan)),
        straight(5)._replace(start=np.array([0.0, math.nan, 0.0])),
    ):
        for answer in (
            solve_gauss_newton(p, np.zeros((5, 2)), BUDGET),
            pattern_search(p, seeds(p), budget=100),
            genetic(p, seeds(p), KEY, 0, budget=100),
        ):
            assert np.isfinite(answer.inputs).all()
            assert violations(p, answer.inputs)[1:3].max() <= 1e-12


def test_the_budget_ends_the_thinking_and_says_so():
    p = straight(10, [(0.6, 0.02, 0.5)])
    unbounded = solve_gauss_newton(p, np.tile((0.5, 0.0), (10, 1)), BUDGET)
    assert unbounded.iterations < BUDGET
    cut = solve_gauss_newton(p, np.tile((0.5, 0.0), (10, 1)), 3)
    assert (cut.iterations, cut.status) == (3, ITERATION_LIMIT)


def test_a_deadline_in_the_past_still_gets_an_answer():
    p = straight(20, [(0.6, 0.02, 0.5)])
    for solve in (
        lambda late: pattern_search(p, seeds(p), deadline=late),
        lambda late: genetic(p, seeds(p), KEY, 0, deadline=late),
    ):
        answer = solve(time.perf_counter())
        assert answer.status == ITERATION_LIMIT
        assert answer.violation <= TOLERANCE  # braking is among the starts
        assert answer.iterations <= 256


def test_the_papers_solvers_come_to_the_same_plan():
    for rows in (None, [(0.75, 0.05, 0.5)]):
        p = straight(5, rows)
        best = solve_gauss_newton(p, np.zeros((5, 2)), BUDGET)
        for answer in (pattern_search(p, seeds(p)), genetic(p, seeds(p), KEY, 0)):
            assert answer.status == CONVERGED
            assert answer.cost == pytest.approx(best.cost, rel=0.02, abs=2e-3)


def test_populations_differ_by_stream_and_by_period():
    p = straight(5, [(0.75, 0.05, 0.5)])
    answers = [
        genetic(p, seeds(p), key, step, budget=200).inputs for key, step in ((KEY, 0), (KEY, 1), (stream(4, "test"), 0))
    ]
    assert not (answers[0] == answers[1]).all()
    assert not (answers[0] == answers[2]).all()


def test_shift():
    np.testing.assert_array_equal(shift(np.array([[1.0, 2.0], [3.0, 4.0]])), [[3.0, 4.0], [3.0, 4.0]])

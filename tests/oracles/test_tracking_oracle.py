"""The tracking solver and its interior point against casadi + ipopt and daqp, on the benchmark's instances."""

from __future__ import annotations

import numpy as np
import pytest

from benchmark_modules import load_benchmark
from clearway.navigators.common.tracking.gauss_newton import BUDGET, solve_gauss_newton
from clearway.navigators.common.tracking.interior_point import Program, minimise
from clearway.navigators.common.tracking.riccati import LinearMotion


@pytest.fixture(scope="module")
def benchmark():
    return load_benchmark("tracking_solver")


@pytest.mark.parametrize(("horizon", "control_horizon"), [(5, None), (8, 4)])
def test_as_good_as_ipopt(benchmark, horizon, control_horizon):
    """Where ipopt keeps the constraints we do, and mostly at no higher cost: both find local minima only."""
    pytest.importorskip("casadi")
    instances = benchmark.record(horizon, scenes=1, steps=120, control_horizon=control_horizon)[::8]
    ipopt = benchmark.Ipopt(instances[0].problem)
    good = []
    for instance in instances:
        p = instance.problem
        ours = solve_gauss_newton(p, instance.warm, BUDGET)
        cost, violation = benchmark.judged(p, ours.inputs)
        assert (cost, violation) == (pytest.approx(ours.cost), pytest.approx(ours.violation, abs=1e-9))
        cost, violation = benchmark.judged(p, ipopt.plan(ipopt(ipopt.arguments(instance))))
        if violation <= benchmark.KEPT:
            assert ours.violation <= benchmark.KEPT
            good.append(ours.cost <= 1.01 * cost + 1e-3)
    assert len(good) >= 10
    assert np.mean(good) >= 0.95


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_the_interior_point_solves_quadratic_programs_as_daqp(seed, coupled):
    """Without norms and rate limits a quadratic program is left: effort, box, soft rows about one pose or about two."""
    daqp = pytest.importorskip("daqp")
    rng = np.random.default_rng(seed)
    n, m, rho = 6, 10, 5.0
    turn, push = rng.normal(size=(n, 2)) * 0.2, rng.normal(size=(n, 2, 2)) * 0.4
    base = rng.uniform(-0.5, 0.5, (n, 2))
    low, high = rng.uniform(-1.5, -0.6, (n, 2)), rng.uniform(0.6, 1.5, (n, 2))
    stage, normal, lack = rng.integers(0, n, m), rng.normal(size=(m, 2)), rng.normal(size=m) * 0.4
    other = rng.normal(size=(m, 2)) if coupled else np.zeros((0, 2))
    out = np.empty((n, 2))
    program = Program(
        LinearMotion(turn, push, 0.15), np.zeros((n, 3)), 0.0, np.zeros(n), 0.3, base, low, high, np.full(n, np.inf),
        np.zeros(2), stage, normal, other, lack, m, rho,
    )  # fmt: skip
    minimise(program, 10.0, 1e-9, 60, out)

    position = np.zeros((n, 3, 2 * n))  # d(pose)_k / d inputs
    for k in range(n):
        before = position[k - 1] if k > 0 else np.zeros((3, 2 * n))
        position[k] = before
        position[k, :2] += np.outer(turn[k], before[2])
        position[k, :2, 2 * k : 2 * k + 2] += push[k]
        position[k, 2, 2 * k + 1] += 0.15
    rows = np.hstack([np.einsum("ij,ijk->ik", normal, position[stage, :2]), np.eye(m)])
    if coupled:
        earlier = np.concatenate((np.zeros((1, 3, 2 * n)), position))[stage, :2]
        rows[:, : 2 * n] += np.einsum("ij,ijk->ik", other, earlier)
    bound = lack + rows[:, : 2 * n] @ base.ravel()
    size = 2 * n + m
    hessian, linear = np.diag([0.6] * (2 * n) + [1e-7] * m), np.array([0.0] * (2 * n) + [rho] * m)
    upper = np.concatenate([high.ravel(), np.full(m, 1e6), np.full(m, 1e6)])
    lower = np.concatenate([low.ravel(), np.zeros(m), bound])
    x, _, flag, _ = daqp.solve(hessian, linear, rows, upper, lower, np.zeros(size + m, dtype=np.int32))
    assert flag == 1
    np.testing.assert_allclose(out.ravel(), x[: 2 * n], atol=2e-4)

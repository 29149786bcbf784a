"""Problem (10) of Zeng, Zhang, Sreenath 2021 as they print it, in casadi and solved by ipopt, beside `mpc-cbf`'s solver."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.geometry.motion import arc
from clearway.navigators.common.tracking.gauss_newton import BUDGET, solve_gauss_newton
from clearway.navigators.common.tracking.problem import TOLERANCE
from clearway.navigators.mpc_cbf.decision import COST, Settings, pose_problem
from clearway.robots import DriveLimits

pytestmark = pytest.mark.slow  # compiles for long

PERIOD, GAMMA, N = 0.1, 0.225, 12
LIMITS = DriveLimits(0.0, 1.0, 2.0, 2.0, 1.5, 4.0, 4.0)
EVERYWHERE = np.array((-math.inf, -math.inf, math.inf, math.inf))
SETTINGS = Settings(PERIOD, N, GAMMA, 0.1, 10.0, 0.3, 0.3, 5.0, 2.0, EVERYWHERE, LIMITS)


def scene(seed):
    """A robot on its way along x, and four discs: places (4, N + 1, 2), distances of contact (4,)."""
    rng = np.random.default_rng(seed)
    pose, velocity = np.array((0.0, 0.0, rng.uniform(-0.5, 0.5))), np.array((rng.uniform(0.2, 1.0), 0.0))
    need = rng.uniform(0.4, 0.8, 4)
    away, bearing = need + rng.uniform(0.3, 2.0, 4), rng.uniform(-1.2, 1.2, 4)
    first = np.column_stack((away * np.cos(bearing), away * np.sin(bearing)))
    moved = rng.uniform(-0.6, 0.6, (4, 1, 2)) * PERIOD * np.arange(N + 1)[None, :, None]
    reference = np.column_stack((PERIOD * np.arange(1, N + 1), np.zeros(N), np.zeros(N)))
    return pose, velocity, reference, first[:, None] + moved, need


def by_ipopt(pose, velocity, reference, places, need, low, high, start):
    """The inputs (N, 2), or None where ipopt finds none that keep (10b)-(10f)."""
    ca = pytest.importorskip("casadi")
    u, x = ca.SX.sym("u", 2, N), ca.SX.sym("x", 3, N + 1)
    cost, equal, above = 0, [x[:, 0] - pose], []
    for k in range(N):
        v, w, theta = u[0, k], u[1, k], x[2, k]
        half = 0.5 * w * PERIOD  # (10b): an arc, whose chord is v c sin(half) / half
        chord = v * PERIOD * (1 - half**2 / 6 + half**4 / 120)
        ahead = ca.vertcat(chord * ca.cos(theta + half), chord * ca.sin(theta + half), w * PERIOD)
        equal.append(x[:, k + 1] - x[:, k] - ahead)
        e = x[:, k + 1] - reference[k]
        size = ca.sqrt(e[0] ** 2 + e[1] ** 2 + (SETTINGS.heading_weight * e[2]) ** 2 + 1e-6)
        cost += (SETTINGS.terminal if k == N - 1 else 1.0) * size + SETTINGS.effort * (v**2 + w**2)  # (10a)
        last = velocity if k == 0 else u[:, k - 1]
        above.append((LIMITS.deceleration * PERIOD) ** 2 - ca.sumsqr(u[:, k] - last))
        for i in range(len(need)):
            h, h_next = (ca.sumsqr(x[:2, k + j] - places[i, k + j]) - need[i] ** 2 for j in (0, 1))  # (17)
            above.append(h_next - h + GAMMA * h)  # (10f)
    g = ca.vertcat(*equal, *above)
    nlp = {"x": ca.vertcat(ca.vec(u), ca.vec(x)), "f": cost, "g": g}
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-7}
    states = [pose]
    for v, w in start:
        states.append(np.array(arc(*states[-1], v, w, PERIOD)))
    solver, rows = ca.nlpsol("cbf", "ipopt", nlp, quiet), g.shape[0]
    held = 3 * (N + 1)
    answer = solver(
        x0=np.concatenate((start.ravel(), np.ravel(states))),
        lbx=np.concatenate((low.ravel(), np.full(3 * (N + 1), -np.inf))),
        ubx=np.concatenate((high.ravel(), np.full(3 * (N + 1), np.inf))),
        lbg=0.0, ubg=np.concatenate((np.zeros(held), np.full(rows - held, np.inf))),
    )  # fmt: skip
    good = solver.stats()["success"] and np.array(answer["g"])[held:].min() > -1e-6
    return np.array(answer["x"]).ravel()[: 2 * N].reshape(N, 2) if good else None


def judged(pose, reference, places, need, inputs):
    """Cost and the largest lack in (10f), as h / (2 need), of `inputs`, worked out apart from the solver."""
    cost, lack, at = 0.0, 0.0, pose
    for k, (v, w) in enumerate(inputs):
        h = ((at[:2] - places[:, k]) ** 2).sum(1) - need**2
        at = np.array(arc(*at, v, w, PERIOD))
        h_next = ((at[:2] - places[:, k + 1]) ** 2).sum(1) - need**2
        lack = max(lack, (((1.0 - GAMMA) * h - h_next) / (2.0 * need)).max())
        e = (at - reference[k]) * (1.0, 1.0, SETTINGS.heading_weight)
        cost += (SETTINGS.terminal if k == N - 1 else 1.0) * np.linalg.norm(e) + SETTINGS.effort * (v * v + w * w)
    return cost, lack


def test_as_good_as_ipopt():
    """Where ipopt finds inputs that keep (10f) so do we, at no higher cost, and nearly always they begin alike: each finds
    a local minimum only, and the same one from the same start."""
    kept, cheap, alike, bound = [], [], [], []
    for seed in range(40):
        pose, velocity, reference, places, need = scene(seed)
        later = np.ascontiguousarray(
            np.concatenate((places[:, 1:], np.broadcast_to(need[:, None, None], (4, N, 1))), 2).transpose(1, 0, 2)
        )
        now = np.column_stack((places[:, 0], need))
        problem = pose_problem(SETTINGS, reference, now, later, pose, velocity)
        start = np.tile((0.5 * velocity[0], 0.0), (N, 1))
        theirs = by_ipopt(pose, velocity, reference, places, need, problem.low, problem.high, start)
        ours = solve_gauss_newton(problem, start, BUDGET)
        cost, lack = judged(pose, reference, places, need, ours.inputs)
        assert (cost, max(lack, 0.0)) == (pytest.approx(ours.cost / COST), pytest.approx(ours.violation, abs=1e-9))
        if theirs is None:
            continue
        least, _ = judged(pose, reference, places, need, theirs)
        kept.append(lack <= TOLERANCE)
        cheap.append(cost <= 1.01 * least + 1e-3)
        alike.append(np.abs(ours.inputs[0] - theirs[0]).max() < 0.02)
        free = solve_gauss_newton(problem._replace(counts=np.zeros(N, np.int64)), start, BUDGET)
        bound.append(free.cost < 0.99 * COST * least)
        print(seed, lack, cost, least, ours.inputs[0], theirs[0], ours.iterations, bound[-1])
    assert len(kept) >= 25
    assert sum(bound) >= 10  # the barriers matter
    assert all(kept)
    assert np.mean(cheap) >= 0.9
    assert np.mean(alike) >= 0.9

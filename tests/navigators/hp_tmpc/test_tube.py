"""The tube (4), (5) against the printed sums, and its claim against random and worst disturbances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arcs import step_arc
from benchmark_modules import load_benchmark
from clearway.navigators.common.tracking.ancillary import gain
from clearway.navigators.hp_tmpc.parameters import Parameters
from clearway.navigators.hp_tmpc.tube_mpc.tube import tightening
from clearway.robots import load_robot

C = 0.15


@pytest.fixture(scope="module")
def benchmark() -> Any:
    """It knows what the linearised closed loop needs at worst, and which damping covers that."""
    return load_benchmark("tube")


def nominal(v, omega, steps, theta=0.0):
    poses = [np.array((0.0, 0.0, theta))]
    for _ in range(steps):
        poses.append(step_arc(poses[-1], v, omega, C))
    return np.array(poses), np.full((steps, 2), (v, omega))


@given(st.floats(0, 0.1), st.floats(0, 1), st.integers(1, 30))
def test_tightening_is_the_printed_sum(bound, xi, steps):
    w = tightening(bound, xi, steps, 0.0)
    for k in range(steps + 1):
        assert w[k] == pytest.approx(bound * sum((1 - xi) ** i for i in range(k)), abs=1e-12)


def test_tightening_by_hand():
    assert tightening(0.01, 0.3, 3, 0.0) == pytest.approx([0.0, 0.01, 0.017, 0.0219])
    assert tightening(0.01, 0.5, 2, 0.04) == pytest.approx([0.04, 0.03, 0.025])


def test_at_rest_the_worst_case_is_the_plain_sum(benchmark):
    poses, inputs = nominal(0.0, 0.0, 6)
    poles = np.array((0.3, 0.3, 0.3))
    worst = benchmark.deviation(poses, inputs, C, poles, 1e-9, 0.01, 0.0)
    assert worst == pytest.approx(0.01 * np.arange(7), rel=6e-3)
    assert benchmark.damping(worst, 0.01) == pytest.approx(0.0, abs=6e-3)


@pytest.mark.parametrize(("xi", "bound"), [(0.3, 0.01), (0.05, 0.02)])
def test_damping_finds_the_one_that_made_the_numbers(benchmark, xi, bound):
    assert benchmark.damping(tightening(bound, xi, 10, 0.0), bound) == pytest.approx(xi, abs=1e-6)
    assert np.isnan(benchmark.damping(2.0 * tightening(bound, 0.0, 4, 0.0), bound))


def test_worst_case_is_worse_than_random_ones_and_nearly_reached_by_the_worst(benchmark):
    p = Parameters.read(load_robot("rescue"))
    poles = np.array((p.pole_along, p.pole_left, p.pole_heading))
    poses, inputs = nominal(0.5, 0.4, 8, theta=0.7)
    worst = benchmark.deviation(poses, inputs, C, poles, p.gain_limit, 0.01, 0.01)
    rng = np.random.default_rng(3)
    seen = np.zeros(9)
    for trial in range(300):
        pose = poses[0].copy()
        side = rng.choice((-1.0, 1.0))
        for k in range(8):
            error = pose - poses[k]
            v, omega = inputs[k] + gain(poses[k, 2], *inputs[k], C, False, poles, p.gain_limit) @ error
            pose = step_arc(pose, v, omega, C)
            angle, radius = rng.uniform(0, 2 * np.pi), 0.01 * np.sqrt(rng.uniform())
            turn = rng.uniform(-0.01, 0.01)
            if trial % 2:  # adversary: always to the same side, and turned the same way
                angle, radius, turn = poses[k + 1, 2] + side * np.pi / 2, 0.01, side * 0.01
            pose += (radius * np.cos(angle), radius * np.sin(angle), turn)
            seen[k + 1] = max(seen[k + 1], np.hypot(*(pose - poses[k + 1])[:2]))
    assert (seen <= 1.02 * worst + 1e-12).all()
    assert (seen[1:] >= 0.9 * worst[1:]).all()


@pytest.mark.parametrize("speed", [0.0, 0.1, 0.25, 0.5, 0.75, 1.0])
def test_the_damping_that_ships_makes_eq_4_true(benchmark, speed):
    """Over the horizons that benchmarks and sweeps use, at every speed, with the stand-ins' disturbance."""
    p = Parameters.read(load_robot("rescue"))
    poles = np.array((p.pole_along, p.pole_left, p.pole_heading))
    for omega in (-1.0, 0.0, 0.5):
        poses, inputs = nominal(speed, omega, 20)
        worst = benchmark.deviation(poses, inputs, C, poles, p.gain_limit, 0.01, 0.01)
        assert (worst <= tightening(p.w_rob, p.xi_rob, 20, 0.0) + 1e-12).all()

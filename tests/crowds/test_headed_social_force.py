"""The headed social force model against a second, plain reading of its equations, and what it promises."""

from __future__ import annotations

import numpy as np
import pytest
from crowd_scenes import bodies_of, crowds, mirrored, wishes_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from clearway.crowds.headed_social_force import FARINA, Facing, velocities
from clearway.crowds.social_force import MOUSSAID, forces
from clearway.crowds.walls import walls_of

M, K_O, K_D, K_LAMBDA, ALPHA, TAU = 75.0, 1.0, 500.0, 0.3, 3.0, 0.5
NOTHING = walls_of([])
SILENT = MOUSSAID._replace(strength=0.0)


def step(bodies, wishes, heading, turn_rate, period, model=MOUSSAID):
    group = np.full(len(bodies.radius), -1)
    facing = Facing(np.array(heading, float), np.array(turn_rate, float))
    return velocities(bodies, wishes, facing, group, model, FARINA, NOTHING, period)


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def equations(f_0, f_e, theta_0, drag=True):
    """The paper's, for x = theta, omega, v_f, v_o; forces (2,) in newtons, in the map's frame."""
    size = np.hypot(*f_0)
    k_theta, k_omega = K_LAMBDA * size, (1 + ALPHA) * np.sqrt(K_LAMBDA * size / ALPHA)  # both by the moment of inertia

    def rate(t, x):
        theta, omega, _, v_o = x
        ahead, aside = np.array((np.cos(theta), np.sin(theta))), np.array((-np.sin(theta), np.cos(theta)))
        u_f, u_o = (f_0 + f_e) @ ahead, K_O * f_e @ aside - K_D * v_o
        return omega, -k_theta * wrapped(theta - theta_0) - k_omega * omega, u_f / M, u_o / M

    return rate


@settings(max_examples=40)
@given(crowds(5), st.integers(0, 2**32 - 1))
def test_as_the_paper_writes_it(crowd, seed):
    """Over a short period, in which the heading of the forces hardly turns."""
    bodies, wishes = crowd
    n, rng, period = len(bodies.radius), np.random.default_rng(seed), 1e-3
    heading, turn_rate = rng.uniform(-np.pi, np.pi, n), rng.uniform(-1, 1, n)
    after, facing = step(bodies, wishes, heading, turn_rate, period)
    f_e = M * forces(bodies, wishes, np.full(n, -1), MOUSSAID, NOTHING)
    for i in range(n):
        f_0 = M * (wishes.velocity[i] - bodies.velocity[i]) / TAU
        frame = np.array(((np.cos(heading[i]), np.sin(heading[i])), (-np.sin(heading[i]), np.cos(heading[i]))))
        theta_0 = np.arctan2(*wishes.velocity[i][::-1])
        if abs(wrapped(heading[i] - theta_0)) > 3.1:
            continue  # either way around is as near
        x = solve_ivp(
            equations(f_0, f_e[i], theta_0), (0, period), (heading[i], turn_rate[i], *frame @ bodies.velocity[i]),
            rtol=1e-10, atol=1e-12,
        ).y[:, -1]  # fmt: skip
        turned = np.array(((np.cos(x[0]), np.sin(x[0])), (-np.sin(x[0]), np.cos(x[0]))))
        assert wrapped(facing.heading[i] - x[0]) == pytest.approx(0.0, abs=1e-9)
        assert facing.turn_rate[i] == pytest.approx(x[1], abs=1e-6)
        assert turned @ after[i] == pytest.approx(x[2:], abs=1e-4)


@given(st.floats(-3.0, 3.0), st.floats(-1, 1), st.floats(0.01, 1.0), st.floats(0.1, 1.3))
def test_a_turn_is_exact_over_any_period(off, omega, period, speed):
    """From rest and alone: the heading follows its linear equation, however long the period."""
    after, facing = step(bodies_of([(0, 0)]), wishes_of([(speed, 0)]), [off], [omega], period, SILENT)
    k = K_LAMBDA * M * speed / TAU
    a = np.array(((0.0, 1.0), (-k, -(1 + ALPHA) * np.sqrt(k / ALPHA))))
    x = solve_ivp(lambda t, x: a @ x, (0, period), (off, omega), rtol=1e-10, atol=1e-12).y[:, -1]
    assert wrapped(facing.heading[0] - x[0]) == pytest.approx(0.0, abs=1e-7)
    assert facing.turn_rate[0] == pytest.approx(x[1], abs=1e-6)
    ahead = min(period * speed / TAU * np.cos(off), 1.6)  # the drive acts along the heading only
    assert after[0] == pytest.approx(ahead * np.array((np.cos(facing.heading[0]), np.sin(facing.heading[0]))), abs=1e-9)


@given(
    st.floats(-np.pi, np.pi),
    st.floats(-2, 2),
    st.floats(-1.5, 1.5),
    st.floats(-1.5, 1.5),
    st.sampled_from((0.05, 0.1, 0.25)),
)
def test_who_wants_nothing_gains_no_energy(heading, turn_rate, vx, vy, period):
    """Alone and without a wish: turning makes no speed of what there was, and what goes sideways dies away."""
    bodies, facing = bodies_of([(0, 0)], [(vx, vy)]), Facing(np.array([heading]), np.array([turn_rate]))
    for _ in range(20):
        v, facing = step(bodies, wishes_of([(0, 0)]), facing.heading, facing.turn_rate, period, SILENT)
        assert np.hypot(*v[0]) <= np.hypot(*bodies.velocity[0]) + 1e-12
        bodies = bodies._replace(velocity=v)


@settings(max_examples=40)
@given(crowds(8), st.integers(0, 2**32 - 1), st.sampled_from((0.05, 0.1, 0.25)))
def test_nobody_drifts_sideways_faster_than_pushed(crowd, seed, period):
    """Across its heading nobody goes faster than it did, or than the force there over the damping."""
    bodies, wishes = crowd
    n, rng = len(bodies.radius), np.random.default_rng(seed)
    heading, turn_rate = rng.uniform(-np.pi, np.pi, n), rng.uniform(-1, 1, n)
    after, facing = step(bodies, wishes, heading, turn_rate, period)
    push = forces(bodies, wishes, np.full(n, -1), MOUSSAID, NOTHING)

    def across(v, theta):
        return np.abs(np.cos(theta) * v[:, 1] - np.sin(theta) * v[:, 0])

    bound = np.maximum(across(bodies.velocity, heading), across(push, heading) * K_O * M / K_D)
    assert (across(after, facing.heading) <= bound + 1e-12).all()


@given(crowds(8), st.integers(0, 2**32 - 1))
def test_a_mirrored_crowd_goes_mirrored_ways(crowd, seed):
    n, rng = len(crowd[0].radius), np.random.default_rng(seed)
    heading, turn_rate = rng.uniform(-3, 3, n), rng.uniform(-1, 1, n)
    here, facing = step(*crowd, heading, turn_rate, 0.1)
    there, turned = step(*mirrored(*crowd), -heading, -turn_rate, 0.1)
    assert np.abs(there - here * (1, -1)).max() < 1e-9
    assert np.abs(wrapped(turned.heading + facing.heading)).max() < 1e-9


def test_one_walks_to_the_side_by_turning_there():
    """At rest, facing +x, wanting to go along +y at 1.3 m/s: it turns and walks ahead, and gets up to speed."""
    bodies, facing, sideways = bodies_of([(0, 0)]), Facing(np.zeros(1), np.zeros(1)), 0.0
    for _ in range(60):
        v, facing = step(bodies, wishes_of([(0, 1.3)]), facing.heading, facing.turn_rate, 0.05, SILENT)
        sideways = max(sideways, abs(np.cos(facing.heading[0]) * v[0, 1] - np.sin(facing.heading[0]) * v[0, 0]))
        bodies = bodies._replace(position=bodies.position + 0.05 * v, velocity=v)
    assert sideways < 1e-9
    assert v[0] == pytest.approx((0.0, 1.3), abs=0.05)
    assert abs(wrapped(facing.heading[0] - np.pi / 2)) < 0.05

"""Each force is minus the gradient of its potential, by finite differences; and the potentials' shapes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clearway.navigators.colregs_apf.potentials import Gains, attraction, emergency, risk, static

GAINS = Gains(1.3, 0.3, 1.1, 0.2, 4.0, 1.0, 0.3, 0.0, 1.0)
RADIUS, R_O = 0.25, 0.35
TAU = RADIUS + R_O
D_M = TAU + GAINS.d_safe
STEP = 1e-6

angle = st.floats(-math.pi, math.pi)
speed = st.floats(0.05, 1.5)
goal_at = st.one_of(st.floats(0.05, 0.99), st.floats(1.01, 12.0))
"""m, off the kink where d_g stops growing."""


def polar(length: float, direction: float):  # type: ignore[no-untyped-def]
    return length * np.array((math.cos(direction), math.sin(direction)))


def minus_gradient(U, at):  # type: ignore[no-untyped-def]
    axes = np.eye(len(at)) * STEP
    return np.array([(U(at - a) - U(at + a)) / (2 * STEP) for a in axes])


def vector(parts, r, w, n_g):  # type: ignore[no-untyped-def]
    """The force from its parts, across on the side that w points to."""
    _, away, across, to_goal = parts
    n = r / np.hypot(*r)
    side = 1.0 if r[0] * w[1] - r[1] * w[0] > 0 else -1.0
    return -away * n + across * side * np.array((-n[1], n[0])) + to_goal * n_g


@given(st.floats(D_M + 0.03, D_M + GAINS.rho_0 - 0.01), angle, st.floats(-0.95, 0.95), speed, goal_at, angle)
@settings(max_examples=300, deadline=None)
def test_risk_force_is_minus_the_gradient(d, phi, off, v, d_g, psi):  # type: ignore[no-untyped-def]
    assume(abs(off) > 0.02)  # straight at the obstacle theta has a kink
    p, w = -polar(d, phi), polar(v, phi + off * math.asin(D_M / d))  # the obstacle is the origin
    goal = p + polar(d_g, psi)

    def parts(q, u, gains=GAINS):  # type: ignore[no-untyped-def]
        return risk(*-q, *u, TAU, R_O, float(np.hypot(*(goal - q))), gains, 0.0)

    n_g = polar(1.0, psi)
    expected = minus_gradient(lambda q: parts(q, w)[0], p)
    np.testing.assert_allclose(vector(parts(p, w), -p, w, n_g), expected, rtol=1e-4, atol=1e-5)
    by_velocity = minus_gradient(lambda u: parts(p, u)[0], w)
    with_velocity = parts(p, w, GAINS._replace(velocity_term=0.7))
    np.testing.assert_allclose(vector(with_velocity, -p, w, n_g), expected + 0.7 * by_velocity, rtol=1e-4, atol=1e-5)


@given(st.floats(TAU + 0.03, D_M - 0.001), angle, angle, speed, goal_at, angle)
@settings(max_examples=300, deadline=None)
def test_emergency_force_is_minus_the_gradient(d, phi, course, v, d_g, psi):  # type: ignore[no-untyped-def]
    p, w, n_g = -polar(d, phi), polar(v, course), polar(1.0, psi)
    goal = p + d_g * n_g

    def parts(q):  # type: ignore[no-untyped-def]
        return emergency(*-q, *w, TAU, R_O, float(np.hypot(*(goal - q))), GAINS)

    expected = minus_gradient(lambda q: parts(q)[0], p)
    np.testing.assert_allclose(vector(parts(p), -p, w, n_g), expected, rtol=1e-4, atol=1e-4)


@given(st.floats(TAU + 0.03, TAU + GAINS.rho_s - 0.001), angle, goal_at, angle)
@settings(max_examples=200, deadline=None)
def test_static_force_is_minus_the_gradient(d, phi, d_g, psi):  # type: ignore[no-untyped-def]
    p, n_g = -polar(d, phi), polar(1.0, psi)
    goal = p + d_g * n_g

    def parts(q):  # type: ignore[no-untyped-def]
        return static(float(np.hypot(*q)) - TAU, R_O, float(np.hypot(*(goal - q))), GAINS)

    _, away, to_goal = parts(p)
    force = away * p / d + to_goal * n_g
    np.testing.assert_allclose(force, minus_gradient(lambda q: parts(q)[0], p), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("d_g", [0.2, 0.8, 1.5, 12.0])
def test_attraction_is_the_gradient_and_capped(d_g: float) -> None:
    slope = (attraction(d_g + STEP, GAINS)[0] - attraction(d_g - STEP, GAINS)[0]) / (2 * STEP)
    assert attraction(d_g, GAINS)[1] == pytest.approx(slope, rel=1e-6)
    assert attraction(d_g, GAINS)[1] == pytest.approx(1.3 * min(d_g, 1.0))


def test_risk_by_hand() -> None:
    # straight ahead at 2 m, theta = 0: theta_m = asin(0.9 / 2), far from the goal
    U, away, across, to_goal = risk(2.0, 0.0, 0.5, 0.0, TAU, R_O, 10.0, GAINS, 0.0)
    lead = math.asin(0.45)
    A = 1 / 1.1 - 1 / 4
    assert pytest.approx(0.3 * 0.35 * (math.exp(lead) - 1) * A) == U
    G = 0.9 / (2 * math.sqrt(4 - 0.81))
    assert away == pytest.approx(0.3 * 0.35 * (math.exp(lead) * G * A + (math.exp(lead) - 1) / 1.21))
    assert across == pytest.approx(0.3 * 0.35 * math.exp(lead) * A / 2)
    assert to_goal == 0.0


def test_no_risk_off_the_cone_or_out_of_reach_or_receding() -> None:
    for r, w in (
        ((2.0, 0.0), (0.3, 0.4)),
        ((4.95, 0.0), (0.5, 0.0)),
        ((2.0, 0.0), (-0.5, 0.0)),
        ((2.0, 0.0), (0.0, 0.0)),
    ):
        assert risk(*r, *w, TAU, R_O, 5.0, GAINS, 1.0) == (0.0, 0.0, 0.0, 0.0)


def test_the_edge_term_lets_the_risk_set_in_gently() -> None:
    theta = math.asin(D_M / 2.0) - 1e-9
    w = (0.5 * math.cos(theta), 0.5 * math.sin(theta))
    _, away, across, _ = risk(2.0, 0.0, *w, TAU, R_O, 5.0, GAINS, 1.0)
    assert max(away, across) < 1e-8
    assert risk(2.0, 0.0, *w, TAU, R_O, 5.0, GAINS, 0.0)[1] > 0.01


def test_emergency_pushes_more_when_approaching_and_not_for_leaving() -> None:
    still = emergency(0.8, 0.0, 0.0, 0.0, TAU, R_O, 5.0, GAINS)
    leaving = emergency(0.8, 0.0, -0.5, 0.2, TAU, R_O, 5.0, GAINS)
    coming = emergency(0.8, 0.0, 0.5, 0.2, TAU, R_O, 5.0, GAINS)
    assert still == leaving
    assert coming[0] > still[0]
    assert coming[2] > 0.0


@pytest.mark.parametrize("clearance", [0.0, -0.5, 1e-12])
def test_contact_is_finite(clearance: float) -> None:
    d = TAU + clearance
    assert np.isfinite(static(clearance, R_O, 1.0, GAINS)).all()
    assert np.isfinite(emergency(max(d, 0.0), 0.0, 0.3, 0.1, TAU, R_O, 1.0, GAINS)).all()
    assert np.isfinite(emergency(0.0, 0.0, 0.3, 0.1, TAU, R_O, 0.0, GAINS)).all()


def test_gains_scale_their_own_potential_only() -> None:
    double = GAINS._replace(eta_s=2 * GAINS.eta_s)
    assert static(0.4, R_O, 5.0, double)[1] == pytest.approx(2 * static(0.4, R_O, 5.0, GAINS)[1])
    assert risk(2.0, 0.0, 0.5, 0.0, TAU, R_O, 5.0, double, 1.0) == risk(2.0, 0.0, 0.5, 0.0, TAU, R_O, 5.0, GAINS, 1.0)

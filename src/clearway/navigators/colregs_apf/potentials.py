"""The potentials of Lyu & Yin 2019 and their gradients.

"COLREGS-constrained real-time path planning for autonomous ships using modified artificial potential fields",
J. Navigation (doi 10.1017/S0373463318000796), could not be had; the forms are read off public re-implementations of
it (which ones, and what stays open: DECISIONS.md beside this file).

Notation, as there: r = p_o - p (from own position to the obstacle's), d = |r|, n = r / d, l = n turned left by 90
degrees; w = v - v_o, theta = angle between w and r; tau = R + R_o (contact), d_m = tau + d_safe;
theta_m = asin(d_m / d), the half angle under which the safety circle is seen; d_g the distance from the goal, here
min(d_g, goal_cap) in every potential, n_g the direction to the goal. A force is -dU/dp, in parts along -n (away from
the obstacle), l (across) and n_g (to the goal).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.compiled import kernel

FLOOR = 0.02
"""The least clearance that a potential is evaluated at, m: it stays finite in contact."""


class Gains(NamedTuple):
    """What shapes the potentials.

    Attributes:
        epsilon: Gain of the attraction.
        eta_d: Gain of the risk of moving obstacles.
        eta_e: Gain of their emergency zone.
        eta_s: Gain of static obstacles.
        rho_0: How far beyond d_m the risk reaches, m.
        rho_s: How far beyond contact static repulsion reaches, m.
        d_safe: Clearance that d_m adds to contact, m.
        velocity_term: Weight of -dU/dv in the risk force, s.
        goal_cap: Attraction and d_g stop growing at this distance from the goal, m.
    """

    epsilon: float
    eta_d: float
    eta_e: float
    eta_s: float
    rho_0: float
    rho_s: float
    d_safe: float
    velocity_term: float
    goal_cap: float


Parts = tuple[float, float, float, float]
"""U, and the force's parts: away from the obstacle, across (without a sign), to the goal."""


@kernel
def attraction(d_g: float, gains: Gains) -> tuple[float, float]:
    """U_att = epsilon d_g^2 / 2, a cone beyond goal_cap; and the force to the goal, epsilon min(d_g, goal_cap)."""
    d_c = min(d_g, gains.goal_cap)
    return gains.epsilon * d_c * (d_g - 0.5 * d_c), gains.epsilon * d_c


@kernel
def risk(
    rx: float, ry: float, wx: float, wy: float, tau: float, R_o: float, d_g: float, gains: Gains, edge: float
) -> Parts:
    """U_rd = eta_d R_o d_g^2 (e^(theta_m - theta) - 1) (1 / (d - d_m) - 1 / rho_0) where d_m < d < d_m + rho_0 and
    theta < theta_m (on a course into the safety circle), else 0.

    The force is -dU/dp - velocity_term dU/dv. `across` is its size along l on the side that w already points to.

    Args:
        rx: x of r, m.
        ry: y of r, m.
        wx: x of w, m/s.
        wy: y of w, m/s.
        tau: Distance at contact R + R_o, m.
        R_o: The obstacle's radius, m.
        d_g: Distance from the goal, m.
        edge: 0 gives the gradient itself, which jumps where theta reaches theta_m; 1 takes the angular part's value
            there off, so that the force sets in gently: Lyu & Yin's F_to0.
    """
    d, s = math.hypot(rx, ry), math.hypot(wx, wy)
    d_m = tau + gains.d_safe
    if not (d_m < d < d_m + gains.rho_0) or s < 1e-9:
        return 0.0, 0.0, 0.0, 0.0
    sine, cosine = abs(rx * wy - ry * wx) / (d * s), (rx * wx + ry * wy) / (d * s)
    lead = math.asin(d_m / d) - math.atan2(sine, cosine)
    if lead <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    clear = max(d - d_m, FLOOR)
    d_c = min(d_g, gains.goal_cap)
    scale = gains.eta_d * R_o * d_c * d_c
    E, A = math.exp(lead) - 1.0, max(1.0 / clear - 1.0 / gains.rho_0, 0.0)
    turning = scale * A * (E + 1.0 - edge)  # what one radian of theta is worth
    G = d_m / (d * math.sqrt((d + d_m) * clear))  # -d theta_m / d d
    T = gains.velocity_term / s
    away = turning * (G + T * sine) + scale * E / (clear * clear)
    across = turning * (1.0 / d + T * cosine)
    to_goal = 2.0 * gains.eta_d * R_o * d_c * E * A if d_g < gains.goal_cap else 0.0
    return scale * E * A, away, across, to_goal


@kernel
def emergency(rx: float, ry: float, wx: float, wy: float, tau: float, R_o: float, d_g: float, gains: Gains) -> Parts:
    """U_re = eta_e R_o d_g^2 ((1 / (d - tau) - 1 / d_m)^2 + max(0, n.w)^2) where d <= d_m, else 0.

    n.w = |w| cos(theta) is the closing speed. Only an approach counts: the square alone would also hold back a robot
    that gets away. `across` has the sign of the side that w points to (left: positive along l).
    """
    d = max(math.hypot(rx, ry), 1e-9)
    d_m = tau + gains.d_safe
    if d > d_m:
        return 0.0, 0.0, 0.0, 0.0
    clear = max(d - tau, FLOOR)
    d_c = min(d_g, gains.goal_cap)
    scale = gains.eta_e * R_o * d_c * d_c
    B = max(1.0 / clear - 1.0 / d_m, 0.0)
    closing = max((rx * wx + ry * wy) / d, 0.0)
    aside = (rx * wy - ry * wx) / d
    away = 2.0 * scale * B / (clear * clear)
    across = 2.0 * scale * closing * abs(aside) / d
    level = B * B + closing * closing
    to_goal = 2.0 * gains.eta_e * R_o * d_c * level if d_g < gains.goal_cap else 0.0
    return scale * level, away, across, to_goal


@kernel
def static(clearance: float, R_o: float, d_g: float, gains: Gains) -> tuple[float, float, float]:
    """U_rs = eta_s R_o d_g^2 (1 / (d - tau) - 1 / rho_s)^2 / 2 where the clearance d - tau < rho_s, else 0.

    Returns:
        U, and the force's parts away from the obstacle and to the goal.
    """
    if clearance >= gains.rho_s:
        return 0.0, 0.0, 0.0
    clear = max(clearance, FLOOR)
    d_c = min(d_g, gains.goal_cap)
    scale = gains.eta_s * R_o * d_c * d_c
    B = max(1.0 / clear - 1.0 / gains.rho_s, 0.0)
    to_goal = gains.eta_s * R_o * d_c * B * B if d_g < gains.goal_cap else 0.0
    return 0.5 * scale * B * B, scale * B / (clear * clear), to_goal

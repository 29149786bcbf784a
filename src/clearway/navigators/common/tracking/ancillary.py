"""The ancillary gain: K of (3k) by linearising the motion model (1) about the nominal motion, per control period.

Along a nominal chord of length D [m] in direction phi, the error e = (along, left, heading) in the chord's frame obeys

    e+ = [1 0 0; 0 1 D; 0 0 1] e + [g_v g_w; 0 b; 0 c] (dv, domega),

so dv can take care of the error along, and domega of the other two. Pole placement is a formula then, no Riccati
equation is solved, and f^SR(A + B K) < 1 holds by construction wherever the robot moves. At rest (D = 0) nothing can
move a differential drive to its left: one eigenvalue is 1 whatever K is, and `spectral_radius` says so.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.motion import sinc
from clearway.geometry.shapes import FloatArray


@light
def chord(v: float, omega: float, c: float, literal: bool) -> tuple[float, float, float, float, float]:
    """Chord of one period `c` [s] at `v` [m/s] and `omega` [rad/s], relative to the heading at its start.

    Returns:
        Its length D [m], its direction [rad], dD/dv, dD/domega and D x d(direction)/domega. `literal`: by (1) as it is
        printed, a second-order step without its 1/2; else by the exact arc.
    """
    if literal:
        stretch = math.sqrt(1.0 + (c * omega) ** 2)
        length = c * v * stretch
        return length, math.atan(c * omega), c * stretch, c * v * c * c * omega / stretch, length * c / stretch**2
    half = 0.5 * omega * c
    s = sinc(half)
    slope = (math.cos(half) - s) / half if abs(half) > 1e-4 else -half / 3.0  # of sinc
    return v * c * s, half, c * s, v * c * slope * 0.5 * c, v * c * s * 0.5 * c


@kernel
def linearise(theta: float, v: float, omega: float, c: float, literal: bool) -> tuple[FloatArray, FloatArray]:
    """A (3, 3) and B (3, 2) of (1) about heading `theta` [rad], `v` [m/s], `omega` [rad/s]; state (x, y, theta)."""
    length, turn, g_v, g_w, b = chord(v, omega, c, literal)
    cos, sin = math.cos(theta + turn), math.sin(theta + turn)
    a_k, b_k = np.eye(3), np.zeros((3, 2))
    a_k[0, 2], a_k[1, 2] = -length * sin, length * cos
    b_k[0, 0], b_k[1, 0] = g_v * cos, g_v * sin
    b_k[0, 1], b_k[1, 1] = g_w * cos - b * sin, g_w * sin + b * cos
    b_k[2, 1] = c
    return a_k, b_k


@kernel
def gain(theta: float, v: float, omega: float, c: float, literal: bool, poles: FloatArray, most: float) -> FloatArray:
    """K (2, 3) of u = u_bar + K (x - x_bar) about the nominal heading, speed and yaw rate.

    Args:
        theta: Nominal heading, rad.
        v: Nominal speed, m/s.
        omega: Nominal yaw rate, rad/s.
        c: Control period, s.
        literal: Whether (1) is taken as printed.
        poles: (3,) of the error along, left and of the heading, in [0, 1).
        most: Bound on the gain from the error to the left to omega, rad/s/m: at low speed the pole of the error to the
            left goes towards 1 instead of this gain to infinity.
    """
    length, turn, g_v, g_w, b = chord(v, omega, c, literal)
    fast = 1.0 - poles[2]
    slow = min(1.0 - poles[1], most * c * abs(length) / fast)
    left = fast * slow / (c * length) if abs(length) > 1e-9 else most
    heading = (fast + slow - left * b) / c
    along = (1.0 - poles[0]) / g_v
    cos, sin = math.cos(theta + turn), math.sin(theta + turn)
    k = np.empty((2, 3))
    k[1, 0], k[1, 1], k[1, 2] = left * sin, -left * cos, -heading
    k[0, 0] = -along * cos - g_w / g_v * k[1, 0]
    k[0, 1] = -along * sin - g_w / g_v * k[1, 1]
    k[0, 2] = -g_w / g_v * k[1, 2]
    return k


@kernel
def spectral_radius(m: FloatArray) -> float:
    """f^SR: the largest absolute eigenvalue of a real (3, 3) matrix, by its characteristic cubic."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    minors = (
        m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0] + m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]
        + m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1]
    )  # fmt: skip
    det = (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )
    # z^3 + p z + q with lambda = z + trace / 3
    p = minors - trace * trace / 3.0
    q = -2.0 * trace**3 / 27.0 + trace * minors / 3.0 - det
    third, disc = trace / 3.0, q * q / 4.0 + p**3 / 27.0
    if disc > 0.0:  # one real root and a pair
        root = math.sqrt(disc)
        one, other = -0.5 * q + root, -0.5 * q - root
        u, w = math.copysign(abs(one) ** (1.0 / 3.0), one), math.copysign(abs(other) ** (1.0 / 3.0), other)
        real = u + w
        pair = math.hypot(third - 0.5 * real, 0.5 * math.sqrt(3.0) * (u - w))
        return float(max(abs(third + real), pair))
    size = 2.0 * math.sqrt(max(-p / 3.0, 0.0))
    if size == 0.0:
        return float(abs(third))
    angle = math.acos(min(max(-4.0 * q / size**3, -1.0), 1.0)) / 3.0
    top = 0.0
    for i in range(3):
        top = max(top, abs(third + size * math.cos(angle - 2.0 * math.pi * i / 3.0)))
    return float(top)


@kernel
def stability(theta: float, v: float, omega: float, c: float, literal: bool, k: FloatArray) -> float:
    """f^SR(A_k + B_k K): below 1 where the error dies out; 1 at rest, where the robot can't move to its left."""
    a_k, b_k = linearise(theta, v, omega, c, literal)
    return spectral_radius(a_k + b_k @ k)

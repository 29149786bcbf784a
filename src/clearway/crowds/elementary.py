"""exp and atan2 of IEEE arithmetic alone: the same bits whatever the C library, and without branches.

A loop that calls them is thus compiled to work on several numbers at once. They err by less than 2^-51 of their value.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import light

_PER_LN_2 = 1.4426950408889634
_LN_2 = float.fromhex("0x1.62e42feep-1"), 1.9082149292705877e-10
"""In two parts, of which the first has few enough bits that a whole multiple of it is exact."""
_ROUND = 1.5 * 2.0**52
"""A number to which it is added is rounded to a whole one, in the lowest bits."""
_EXP = tuple((1.0 / math.factorial(k + 1), 1.0 / math.factorial(k)) for k in range(12, -1, -2))
"""Taylor's coefficients, of odd and even powers, highest first: two sums take half the time of one."""
_TAN_PI_8 = 0.41421356237309503
_ATAN = (
    (0.016284375050043393, -0.03456931506332609), (0.045515447340221615, -0.05230443640686948),
    (0.05878927554473807, -0.0666642476020052), (0.07692296368042296, -0.09090908753259112),
    (0.11111111105150588, -0.14285714285659779), (0.19999999999999804, -0.3333333333333333),
)  # fmt: skip
"""The same of (atan(q) / q - 1) / q^2 in q^2, which they meet at twelve Chebyshev nodes of 0 to tan^2(pi/8)."""


@light
def exp(x: float) -> float:
    """e^x, for x from -708 to 709; below and above it is what it is there."""
    x = min(max(x, -708.0), 709.0)
    shifted = x * _PER_LN_2 + _ROUND
    whole = shifted - _ROUND
    r = (x - whole * _LN_2[0]) - whole * _LN_2[1]  # |r| <= ln(2) / 2
    odd = even = 0.0
    for a, b in _EXP:
        odd, even = odd * (r * r) + a, even * (r * r) + b
    power = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)  # 2^whole
    return (odd * r + even) * power


@light
def atan2(y: float, x: float) -> float:
    """The angle of (x, y) in [-pi, pi], rad; 0 at the origin. Zeros count as positive."""
    low, high = min(abs(x), abs(y)), max(abs(x), abs(y))
    steep = low > _TAN_PI_8 * high  # nearer to a diagonal than to an axis: q is taken from it
    above, below = low - high if steep else low, low + high if steep else high
    q = above / (below if below > 0.0 else 1.0)
    z, odd, even = q * q, 0.0, 0.0
    for a, b in _ATAN:
        odd, even = odd * (z * z) + a, even * (z * z) + b
    angle = q + q * z * (odd * z + even)
    angle = 0.25 * math.pi + angle if steep else angle
    angle = 0.5 * math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle

"""Functions of float32 that LLVM can put into vector registers: no branch, no call, the same bits everywhere.

Polynomials for the sine and cosine on an eighth of a turn and for the logarithm on an octave (Moshier, Cephes, `sinf.c` and
`logf.c`), after a reduction by three parts of pi / 2 (Cody, Waite). Absolute errors against exact values: below 1.2e-7
for |x| < 100 rad, below 3e-7 for the logarithm (both are measured in the tests).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel

Floats = npt.NDArray[np.float32]

ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
PI, TWO_PI = np.float32(math.pi), np.float32(2.0 * math.pi)

_PER_QUARTER = np.float32(2.0 / math.pi)
_PER_TURN = np.float32(0.5 / math.pi)
_ROUND = np.float32(1.5 * 2**23)  # added and taken away again, it leaves the nearest whole number
_QUARTER_1, _QUARTER_2, _QUARTER_3 = (
    np.float32(1.5703125),
    np.float32(4.837512969970703e-4),
    np.float32(7.54978995489e-8),
)
_S3, _S5, _S7 = np.float32(-1.6666654611e-1), np.float32(8.3321608736e-3), np.float32(-1.9515295891e-4)
_C4, _C6, _C8 = np.float32(4.166664568298827e-2), np.float32(-1.388731625493765e-3), np.float32(2.443315711809948e-5)
_L = tuple(
    np.float32(c)
    for c in (
        7.0376836292e-2,
        -1.1514610310e-1,
        1.1676998740e-1,
        -1.2420140846e-1,
        1.4249322787e-1,
        -1.6668057665e-1,
        2.0000714765e-1,
        -2.4999993993e-1,
        3.3333331174e-1,
    )
)
_L0, _L1, _L2, _L3, _L4, _L5, _L6, _L7, _L8 = _L
_LN_2 = np.float32(math.log(2.0))
_ROOT_HALF_BITS = np.int32(0x3F3504F3)  # of sqrt(0.5)
_S23 = np.int32(23)


@kernel
def sine_cosine(x: np.float32) -> tuple[np.float32, np.float32]:
    """Sine and cosine of an angle of less than some 10,000 rad."""
    shifted = x * _PER_QUARTER + _ROUND
    quarters = shifted - _ROUND
    n = np.int32(quarters)
    r = ((x - quarters * _QUARTER_1) - quarters * _QUARTER_2) - quarters * _QUARTER_3
    z = r * r
    s = r + r * z * (_S3 + z * (_S5 + z * _S7))
    c = ONE - HALF * z + z * z * (_C4 + z * (_C6 + z * _C8))
    odd = (n & np.int32(1)) != 0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if (n & np.int32(2)) != 0 else sine
    cosine = -cosine if ((n + np.int32(1)) & np.int32(2)) != 0 else cosine
    return sine, cosine


@kernel
def logarithm(x: np.float32) -> np.float32:
    """The natural logarithm of a normal number above 0."""
    bits = np.float32(x).view(np.int32)
    k = np.int32((bits - _ROOT_HALF_BITS) >> _S23)
    m = np.int32(bits - (k << _S23)).view(np.float32) - ONE  # from sqrt(0.5) - 1 to sqrt(2) - 1
    e = np.float32(k)
    z = m * m
    p = ((((((((_L0 * m + _L1) * m + _L2) * m + _L3) * m + _L4) * m + _L5) * m + _L6) * m + _L7) * m + _L8) * m * z
    return (m + (p - HALF * z)) + e * _LN_2


@kernel
def wrapped(angle: np.float32) -> np.float32:
    """The same direction within half a turn of 0."""
    return angle - TWO_PI * ((angle * _PER_TURN + _ROUND) - _ROUND)

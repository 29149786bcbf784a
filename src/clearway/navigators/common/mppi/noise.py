"""Normal noise for all samples of a decision at once: counter-based, so that no draw depends on another.

Nav2 draws from `std::default_random_engine` (nav2_mppi_controller/src/noise_generator.cpp), one number after another. Here
each pair of numbers is a function of (key, draw, time step, sample): Philox2x32-10 (Salmon et al., SC 2011) gives 64 bits,
Box and Muller's method two normal numbers of them.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ONE, TWO_PI, Floats, logarithm, sine_cosine

_MULTIPLIER, _WEYL = np.uint64(0xD256D193), np.uint64(0x9E3779B9)
_LOW, _S32, _S8 = np.uint64(0xFFFFFFFF), np.uint64(32), np.uint64(8)
_UNIT = np.float32(2.0**-24)
_MINUS_TWO = np.float32(-2.0)


@kernel
def philox(low: np.uint64, high: np.uint64, key: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Two words of 32 bits for a counter of two such words and a key of one."""
    k = key & _LOW
    for _ in range(10):
        product = low * _MULTIPLIER
        low, high = (product >> _S32) ^ k ^ high, product & _LOW
        k = (k + _WEYL) & _LOW
    return low, high


@kernel
def draw_noise(first: Floats, second: Floats, key: np.uint64, draw: int, std_first: float, std_second: float) -> None:
    """Fill two arrays (time steps, samples) with independent normal numbers of mean 0.

    Args:
        key: Of the stream, 32 bits.
        draw: Which draw it is, below 2**32.
        std_first: Standard deviation of the numbers in `first`.
        std_second: And in `second`.
    """
    a, b = np.float32(std_first), np.float32(std_second)
    steps, samples = first.shape
    high = np.uint64(draw) & _LOW
    for t in range(steps):
        begin = np.uint64(t * samples)
        u, v = first[t], second[t]
        for i in range(samples):
            w0, w1 = philox(begin + np.uint64(i), high, key)
            # (0, 1] and [0, 1), in steps of 2**-24
            radius = np.sqrt(_MINUS_TWO * logarithm((np.float32(np.int32(w0 >> _S8)) + ONE) * _UNIT))
            sine, cosine = sine_cosine(TWO_PI * (np.float32(np.int32(w1 >> _S8)) * _UNIT))
            u[i] = a * (radius * cosine)
            v[i] = b * (radius * sine)

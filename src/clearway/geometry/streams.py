"""Random numbers without a state: each is a function of (stream, step, index), so that the order of drawing can't matter.

A stream is a 64-bit key made of a seed and a name, such as `stream(seed, "lidar")`. The bits come from the finaliser
of SplitMix64 (Steele, Lea, Flood 2014), applied once per coordinate; normal numbers from the inverse of the normal
distribution (Wichura 1988, algorithm AS 241), one uniform number each.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np

from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S27, _S30, _S31, _S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
_ONE = np.uint64(1)
_UNIT = 2.0**-53
_MIDDLE = 0.425


def stream(seed: int, name: str) -> np.uint64:
    """The key of the stream `name` of a trial with `seed` (any integer)."""
    digest = hashlib.blake2b(f"{seed}/{name}".encode(), digest_size=8).digest()
    return np.uint64(int.from_bytes(digest, "little"))


@light
def bits(key: np.uint64, step: int, index: int) -> np.uint64:
    """64 random bits for (stream key, step, index)."""
    a, b = np.uint64(np.int64(step)), np.uint64(np.int64(index))  # by way of int64: Python itself refuses uint64(-1)
    return _mix(_mix(key + _GOLDEN * (a + _ONE)) + _GOLDEN * (b + _ONE))


@light
def uniform(key: np.uint64, step: int, index: int) -> float:
    """A number from the open interval (0, 1)."""
    return (np.float64(bits(key, step, index) >> _S11) + 0.5) * _UNIT


@light
def normal(key: np.uint64, step: int, index: int) -> float:
    """A number from the standard normal distribution."""
    return normal_quantile(uniform(key, step, index))


@light
def _mix(z: np.uint64) -> np.uint64:
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    return z ^ (z >> _S31)


@light
def normals(key: np.uint64, step: int, out: FloatArray, p: FloatArray) -> None:
    """Write to `out` (n,) what `normal` draws for the indices 0 to n - 1; `p` (n,) is overwritten."""
    n = out.shape[0]
    for i in range(n):  # without branches: the compiler works on several at once
        p[i] = uniform(key, step, i)
        out[i] = _middle(p[i] - 0.5)
    for i in range(n):
        if abs(p[i] - 0.5) > _MIDDLE:
            out[i] = _tail(p[i])


@light
def normal_quantile(p: float) -> float:
    """The number below which a standard normal one lies with probability `p` in (0, 1); relative error below 1e-15."""
    q = p - 0.5
    return _middle(q) if abs(q) <= _MIDDLE else _tail(p)


@light
def _middle(q: float) -> float:
    """`normal_quantile` of q + 0.5 where |q| is at most `_MIDDLE`."""
    r = 0.180625 - q * q
    top = 2.5090809287301226727e3
    top = top * r + 3.3430575583588128105e4
    top = top * r + 6.7265770927008700853e4
    top = top * r + 4.5921953931549871457e4
    top = top * r + 1.3731693765509461125e4
    top = top * r + 1.9715909503065514427e3
    top = top * r + 1.3314166789178437745e2
    top = top * r + 3.3871328727963666080e0
    low = 5.2264952788528545610e3
    low = low * r + 2.8729085735721942674e4
    low = low * r + 3.9307895800092710610e4
    low = low * r + 2.1213794301586595867e4
    low = low * r + 5.3941960214247511077e3
    low = low * r + 6.8718700749205790830e2
    low = low * r + 4.2313330701600911252e1
    return q * top / (low * r + 1.0)


@light
def _tail(p: float) -> float:
    """`normal_quantile` elsewhere."""
    q = p - 0.5
    r = math.sqrt(-math.log(p if q < 0.0 else 1.0 - p))
    if r <= 5.0:
        r -= 1.6
        top = 7.74545014278341407640e-4
        top = top * r + 2.27238449892691845833e-2
        top = top * r + 2.41780725177450611770e-1
        top = top * r + 1.27045825245236838258e0
        top = top * r + 3.64784832476320460504e0
        top = top * r + 5.76949722146069140550e0
        top = top * r + 4.63033784615654529590e0
        top = top * r + 1.42343711074968357734e0
        low = 1.05075007164441684324e-9
        low = low * r + 5.47593808499534494600e-4
        low = low * r + 1.51986665636164571966e-2
        low = low * r + 1.48103976427480074590e-1
        low = low * r + 6.89767334985100004550e-1
        low = low * r + 1.67638483018380384940e0
        low = low * r + 2.05319162663775882187e0
    else:
        r -= 5.0
        top = 2.01033439929228813265e-7
        top = top * r + 2.71155556874348757815e-5
        top = top * r + 1.24266094738807843860e-3
        top = top * r + 2.65321895265761230930e-2
        top = top * r + 2.96560571828504891230e-1
        top = top * r + 1.78482653991729133580e0
        top = top * r + 5.46378491116411436990e0
        top = top * r + 6.65790464350110377720e0
        low = 2.04426310338993978564e-15
        low = low * r + 1.42151175831644588870e-7
        low = low * r + 1.84631831751005468180e-5
        low = low * r + 7.86869131145613259100e-4
        low = low * r + 1.48753612908506148525e-2
        low = low * r + 1.36929880922735805310e-1
        low = low * r + 5.99832206555887937690e-1
    tail = top / (low * r + 1.0)
    return -tail if q < 0.0 else tail

"""exp and atan2 against those of Python's math, and compiled against themselves uncompiled."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.crowds.elementary import atan2, exp
from clearway.geometry.compiled import kernel

PRECISE = 3.0 * 2.0**-52
"""Theirs and ours together."""
COORDINATE = st.one_of(st.floats(-1e300, 1e300), st.floats(-10.0, 10.0))


@given(st.one_of(st.floats(-708.0, 709.0), st.floats(-1.0, 1.0)))
def test_exp(x):
    assert exp(x) == pytest.approx(math.exp(x), rel=PRECISE, abs=0.0)


@given(COORDINATE, COORDINATE)
def test_atan2(y, x):
    expected = math.atan2(y + 0.0, x + 0.0)  # zeros count as positive
    assert atan2(y, x) == pytest.approx(expected, rel=PRECISE, abs=5e-324)
    assert atan2(-y, x) == -atan2(y, x) or y == 0.0


def test_at_the_ends():
    assert exp(0.0) == 1.0
    assert (exp(-math.inf), exp(math.inf)) == (exp(-708.0), exp(709.0))
    assert [atan2(0.0, 0.0), atan2(0.0, -1.0), atan2(1.0, 0.0), atan2(-2.0, 0.0)] == [
        0.0,
        math.pi,
        math.pi / 2,
        -math.pi / 2,
    ]


@kernel
def of_many(y, x, out):
    for k in range(len(x)):
        out[0, k], out[1, k] = atan2(y[k], x[k]), exp(x[k])


def test_several_at_once_are_the_bits_of_one_by_one_uncompiled():
    """No fused multiply-add, no sum in another order."""
    y, x = np.random.default_rng(1).normal(0.0, 20.0, (2, 1003))
    out = np.empty((2, 1003))
    of_many(y, x, out)
    assert out[0].tolist() == [atan2.py_func(*each) for each in zip(y, x, strict=True)]
    assert out[1].tolist() == [exp.py_func(each) for each in x]

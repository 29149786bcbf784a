"""Kernels that don't count who holds which array: what they may not do is refused, as they are compiled."""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
import pytest

from clearway.geometry.compiled import inlined, kernel, light
from clearway.geometry.held import Held


class Pair(NamedTuple):
    a: np.ndarray
    b: np.ndarray


@light
def makes(a: np.ndarray) -> float:
    return float(np.zeros(3)[0] + a[0])


@light
def hands_on(a: np.ndarray) -> np.ndarray:
    return a


@inlined
def hands_on_inlined(a: np.ndarray) -> np.ndarray:
    return a


@light
def hands_on_inside(a: np.ndarray) -> tuple[float, Pair]:
    return 1.0, Pair(a, a)


@kernel
def fresh(n: int) -> np.ndarray:
    return np.full(n, 2.0)


@light
def gets(a: np.ndarray) -> float:
    return float(fresh(len(a))[0])


@kernel
def total(n: int) -> float:
    return float(np.full(n, 2.0).sum())


@light
def asks(pair: Pair, k: int) -> float:
    """It looks at rows, and calls one that makes an array for itself."""
    row = pair.a[k]
    row[0] = 5.0
    return row[0] + pair.b[k, 1] + total(3)


@kernel
def hold(pair: Pair) -> Held[Pair]:
    return Held(pair)


@light
def asks_held(held: Held[Pair], k: int) -> float:
    return asks(held.value, k)


@kernel
def has_it_asked(held: Held[Pair], k: int) -> float:
    return asks_held(held, k)


def test_it_reads_what_is_held_and_what_is_let_go_is_gone() -> None:
    pair = Pair(np.ones((2, 2)), np.full((2, 2), 3.0))
    counts = [sys.getrefcount(array) for array in pair]
    held = hold(pair)
    assert has_it_asked(held, 1) == 14.0
    assert pair.a[1, 0] == 5.0, "held, not copied"
    with pytest.raises(TypeError, match="what is held goes to a kernel"):
        asks_held(held, 1)
    del held
    assert [sys.getrefcount(array) for array in pair] == counts


def test_one_that_makes_an_array_is_refused() -> None:
    with pytest.raises(TypeError, match="if it makes an array, it is to be a kernel"):
        makes(np.ones(3))


@pytest.mark.parametrize("function", [hands_on, hands_on_inlined, hands_on_inside, gets])
def test_one_that_hands_arrays_on_is_refused(function: object) -> None:
    with pytest.raises(TypeError, match="hands arrays on"):
        function(np.ones(3))  # type: ignore[operator]


def test_what_it_is_given_lives_on() -> None:
    pair = Pair(np.zeros((4, 2)), np.ones((4, 2)))
    assert [asks(pair, k) for k in range(4)] == [12.0] * 4
    assert pair.a[:, 0].tolist() == [5.0] * 4
    assert (pair.a.base, pair.b.base) == (None, None)

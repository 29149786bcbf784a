"""What kernels hold is what Python gave them, not a copy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.held import Held
from clearway.geometry.shapes import FloatArray


class Tally(NamedTuple):
    marks: FloatArray
    step: float


@kernel
def hold(tally: Tally) -> Held[Tally]:
    return Held(tally)


@kernel
def count(held: Held[Tally], times: int) -> float:
    marks, step = held.value
    for _ in range(times):
        marks[0] += step
    return float(marks[0])


def test_both_sides_see_what_is_written() -> None:
    tally = Tally(np.zeros(1), 0.5)
    held = hold(tally)
    assert count(held, 3) == 1.5
    tally.marks[0] = 10.0
    assert count(held, 2) == 11.0
    assert tally.marks[0] == 11.0


def test_what_is_held_outlives_its_maker() -> None:
    held = [hold(Tally(np.full(1, float(i)), 1.0)) for i in range(50)]
    np.empty(1000).fill(np.nan)
    assert [count(h, 1) for h in held] == [i + 1.0 for i in range(50)]

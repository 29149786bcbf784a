"""What was seen to stand is remembered behind something nearer, beside the view and beyond it, and forgotten once it is seen to be gone."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.sight import Sight
from clearway.navigators.hp_st.environment.standing import MOST, RIM, SAME, Standing

SIGHT = Sight(4.0, 0.0, math.radians(100))
EYE = np.zeros(3)
POST = (2.0, 0.0, 0.1)


def discs(*found: tuple[float, float, float]) -> FloatArray:
    return np.array(found, dtype=np.float64).reshape(-1, 3)


def remembered(before: FloatArray, now: FloatArray, eye: FloatArray = EYE) -> list[list[float]]:
    """What is told from `eye` when `now` is seen there, beside that, after `before` was seen from the origin."""
    standing = Standing(SIGHT)
    standing.update(EYE, before)
    return [list(disc) for disc in standing.update(eye, now)[len(now) :].tolist()]


def test_what_is_in_view_and_not_seen_any_more_is_gone() -> None:
    assert remembered(discs(POST), discs()) == []
    assert remembered(discs(POST), discs((2.0, 0.5, 0.1))) == [], "something else at its side hides nothing"
    assert remembered(discs(POST), discs((3.0, 0.0, 0.1))) == [], "nor does what is farther away"


def test_what_can_not_be_seen_may_stand_there_still() -> None:
    assert remembered(discs(POST), discs((1.0, 0.0, 0.2))) == [list(POST)], "behind something nearer"
    assert remembered(discs(POST), discs(), np.array((0.0, 0.0, math.pi))) == [list(POST)], "behind its back"
    far = np.array((-2.5, 0.0, 0.0))
    assert remembered(discs(POST), discs(), far) == [list(POST)], "out of range"
    assert remembered(discs(POST), discs(), np.array((-1.5, 0.0, 0.0))) == []


def test_what_is_seen_again_is_told_once_where_it_is_seen_now() -> None:
    standing = Standing(SIGHT)
    standing.update(EYE, discs(POST, (1.0, 0.0, 0.2)))
    again = discs((2.0 + 0.9 * SAME, 0.0, 0.1), (1.0, 0.0, 0.2))
    assert standing.update(EYE, again).tolist() == again.tolist()


def test_the_oldest_give_way() -> None:
    standing = Standing(SIGHT)
    many = discs(*((-1.0 - 0.01 * k, 3.0, 0.01) for k in range(MOST)))
    standing.update(EYE, many)
    told = standing.update(EYE, discs(POST))
    assert len(told) == MOST
    assert told[0].tolist() == list(POST)
    assert told[-1].tolist() == many[-2].tolist()


places = st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(0.02, 0.3))


@given(st.lists(places, max_size=8), st.lists(places, max_size=8), st.floats(-3.0, 3.0))
def test_against_a_plain_reading(
    before: list[tuple[float, float, float]], now: list[tuple[float, float, float]], theta: float
) -> None:
    """By the line of sight to each centre; discs that a line merely grazes may be told apart either way."""
    eye = np.array((0.0, 0.0, theta))
    found = remembered(discs(*before), discs(*now), eye)
    for x, y, r in dict.fromkeys(before):
        far, bearing = math.hypot(x, y), math.atan2(y, x)
        if any(math.hypot(x - a, y - b) <= SAME for a, b, _ in now):
            assert [x, y, r] not in found
            continue
        off = abs(math.remainder(bearing - theta, 2.0 * math.pi))
        clear, hidden = True, False
        for a, b, s in now:
            along = a * math.cos(bearing) + b * math.sin(bearing)
            across = abs(b * math.cos(bearing) - a * math.sin(bearing))
            if math.hypot(a, b) - s < far and along > -s and across < s + 0.02 * far + 0.02 * math.hypot(a, b):
                clear = False
            hidden |= (
                math.hypot(a, b) > s
                and math.hypot(a, b) - s < far
                and along > 0.0
                and across < s - 0.02 * math.hypot(a, b)
            )
        if hidden or off > SIGHT.half + 1e-6 or far > SIGHT.range - RIM + 1e-6:
            assert [x, y, r] in found
        elif clear and far > 1e-3 and off < SIGHT.half - 1e-6 and far < SIGHT.range - RIM - 1e-6:
            assert [x, y, r] not in found

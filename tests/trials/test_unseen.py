"""How near two things can have come unseen: worked out on paper, and never farther than they truly were."""

from __future__ import annotations

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, Shape, rectangle
from clearway.trials.unseen import Way, fastest, least_clearance, nearest

T = np.arange(0.0, 10.01, 0.1)


def line(speed: float = 0.5, hidden: tuple[float, float] = (4.0, 6.0), shape: Shape | None = None) -> Way:
    """Drives along x from 0 and is not seen between two times, both excluded."""
    pose = np.stack([speed * T, 0 * T, 0 * T], axis=1)
    pose[(hidden[0] + 1e-6 < T) & (hidden[1] - 1e-6 > T)] = np.nan
    return Way(shape or Circle(0.3), T, pose, speed, 0.5, 0.3)


def still(x: float, y: float, shape: Shape | None = None) -> Way:
    return Way(shape or Circle(0.1), T[[0, -1]], np.tile([x, y, 0.0], (2, 1)), 0.0, 0.0)


def test_the_stretches_run_from_the_last_sample_to_the_next() -> None:
    assert line().unseen() == [pytest.approx((4.0, 6.0))]
    assert line(hidden=(4.0, 99.0)).unseen() == [pytest.approx((4.0, 10.0))]
    assert line(hidden=(-1.0, 3.0)).unseen() == [pytest.approx((0.0, 3.0))]
    whole = line(hidden=(5.0, 5.0))
    assert whole.unseen() == []
    keep = (T < 2.05) | (T > 3.95)
    assert Way(whole.shape, T[keep], whole.pose[keep], 0.5, 0.5, 0.3).unseen() == [pytest.approx((2.0, 4.0))]
    nothing = Way(whole.shape, T, np.full((len(T), 3), np.nan), 0.5, 0.5, 0.3)
    assert nothing.unseen() == [pytest.approx((0.0, 10.0))]


def test_at_full_speed_it_can_only_have_driven_straight_on() -> None:
    """From (2, 0) to (3, 0) in 2 s at 0.5 m/s: it passed (2.5, 0) and was nowhere else."""
    least, when = nearest(line(), still(2.5, 1.0), 4.0, 6.0)
    assert least == pytest.approx(1.0 - 0.4, abs=0.011)
    assert when == pytest.approx(5.0, abs=0.05)


def test_with_time_to_spare_it_can_have_been_within_an_ellipse() -> None:
    """Over the same 2 s a robot that can do 1.0 m/s reaches sqrt(1 - 0.25) m beside the middle of its way."""
    way = line()
    fast = Way(way.shape, way.t, way.pose, 1.0, 0.5, 0.3)
    reach = math.sqrt(1.0 - 0.25) + 0.4
    for beside, near in ((reach + 0.05, 0.05), (reach - 0.05, 0.0)):
        assert nearest(fast, still(2.5, beside), 4.0, 6.0)[0] == pytest.approx(near, abs=0.011)


def test_a_jump_is_taken_for_a_drive_that_was_as_fast_as_it_had_to_be() -> None:
    way = line()
    slow = Way(way.shape, way.t, way.pose, 0.1, 0.0, 0.3)
    assert nearest(slow, still(2.5, 1.0), 4.0, 6.0)[0] == pytest.approx(0.6, abs=0.011)


def test_a_heading_that_is_lost_only_costs_the_disc_around_the_outline() -> None:
    square = rectangle(0.6, 0.6)
    pose = np.stack([0.5 * T, 0 * T, 0 * T], axis=1)
    pose[40:61, 2] = np.nan
    blind = Way(square, T, pose, 0.5, 0.5, 0.3)
    assert least_clearance(blind, still(2.5, 1.0), np.array([5.0]))[0] == pytest.approx(0.9 - math.hypot(0.3, 0.3))
    short = Way(square, T, pose, 0.5, 0.0, 0.3)  # which never turns
    assert least_clearance(short, still(2.5, 1.0), np.array([4.0]))[0] > 0.6 - 0.06


def test_what_visits_was_not_there_before_and_after() -> None:
    visitor = line(hidden=(4.0, 99.0))
    guest = Way(visitor.shape, visitor.t, visitor.pose, 0.5, 0.5, 0.3, visits=True)
    at = np.array([9.0])
    assert least_clearance(still(2.5, 0.0), visitor, at) == pytest.approx(0.0)
    assert np.isinf(least_clearance(still(2.5, 0.0), guest, at)).all()
    assert guest.unseen() == []
    never = Way(visitor.shape, T, np.full((len(T), 3), np.nan), 0.5, 0.5, 0.3)
    assert least_clearance(still(50.0, 0.0), never, at) == pytest.approx(0.0), "it can have been anywhere"


def test_a_leap_is_no_speed() -> None:
    pose = np.stack([0.5 * T, 0 * T, 0.2 * T], axis=1)
    leapt = pose.copy()
    leapt[50:, 0] += 4.0
    assert fastest(T, pose, 0.3) == pytest.approx((0.5, 0.2))
    fine = np.arange(0.0, 10.0, 0.01)
    many = np.stack([0.5 * fine + 4.0 * (fine > 5), 0 * fine, 0 * fine], axis=1)
    assert fastest(fine, many, 0.3)[0] < 1.0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nothing_ever_came_nearer_than_the_bound(seed: int) -> None:
    """Two wander about at no more than their speeds, each of them seen now and then."""
    rng = np.random.default_rng(seed)

    def wanderer(shape: Shape, speed: float, rate: float) -> tuple[Way, np.ndarray]:
        steps = rng.uniform(-1, 1, (len(T) - 1, 2))
        steps *= speed * 0.1 * rng.uniform(0, 1, (len(steps), 1)) / np.hypot(*steps.T)[:, None]
        turns = rate * 0.1 * rng.uniform(-1, 1, len(steps))
        true = np.zeros((len(T), 3))
        true[0] = rng.uniform(-2, 2, 3)
        true[1:] = true[0] + np.cumsum(np.column_stack([steps, turns]), axis=0)
        seen = true.copy()
        for _ in range(3):
            i = int(rng.integers(len(T)))
            seen[i : i + int(rng.integers(1, 30)), int(rng.integers(0, 2)) * 2 :] = np.nan
        return Way(shape, T, seen, speed, rate, 0.3), true

    a, true_a = wanderer(rectangle(0.6, 0.3), 0.8, 1.0)
    b, true_b = wanderer(Circle(0.2) if seed % 2 else rectangle(0.2, 0.5), 0.5, 0.7)
    gaps = np.array([clearance(a.shape, p, b.shape, q) for p, q in zip(true_a, true_b, strict=True)])
    assert (least_clearance(a, b, T) <= gaps + 1e-9).all()
    both = a.seen & b.seen
    assert least_clearance(a, b, T)[both] == pytest.approx(gaps[both], abs=1e-9)
    for start, end in (*a.unseen(), *b.unseen()):
        within = (start - 1e-9 <= T) & (end + 1e-9 >= T)
        assert nearest(a, b, start, end)[0] <= gaps[within].min() + 1e-9

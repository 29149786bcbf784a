"""Legs: found to a fraction of a sample, whatever the robot did on its way; what can't be told is said."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from driven import Knots, driven

from clearway.errors import ClearwayError
from clearway.recordings.lab.legs import find_legs
from clearway.recordings.motion.motion import Motion, Quality
from clearway.trials import Leg

A, B, TURNED, BACK = (np.array(p) for p in ([0.0, 0, 0], [5.0, 0, 0], [5.0, 0, math.pi], [0.0, 0, math.pi]))
LEGS = (
    Leg("forth", A, B, 0.2, 0.2),
    Leg("turn", B, TURNED, 0.2, 0.2, scored=False),
    Leg("back", TURNED, BACK, 0.2, 0.2),
)
UNKNOWN = tuple(replace(leg, start=np.full(3, np.nan), goal=np.full(3, np.nan)) for leg in LEGS)

Part = list[tuple[float, float, float]]
"""Seconds, and v, omega at their end."""


def drive(distance: float, v: float = 0.5, a: float = 1.0) -> Part:
    """From rest to rest, straight."""
    ramp = v / a
    sign = math.copysign(1, distance)
    return [(ramp, sign * v, 0), (abs(distance) / v - ramp, sign * v, 0), (ramp, 0, 0)]


def spin(angle: float, w: float = 1.0, a: float = 2.0) -> Part:
    ramp = w / a
    sign = math.copysign(1, angle)
    return [(ramp, 0, sign * w), (abs(angle) / w - ramp, 0, sign * w), (ramp, 0, 0)]


def stand(seconds: float) -> Part:
    return [(seconds, 0, 0)]


def made(*parts: Part) -> tuple[Knots, list[float]]:
    """The knots of parts one after another, and when each ends."""
    knots: Knots = [(0.0, 0.0, 0.0)]
    ends = []
    for part in parts:
        for seconds, v, w in part:
            knots.append((knots[-1][0] + seconds, v, w))
        ends.append(knots[-1][0])
    return knots, ends


THERE_AND_BACK = (stand(3), drive(5), stand(0.3), spin(math.pi), stand(0.3), drive(5), stand(4))


@pytest.mark.parametrize("rate", [10.0, 30.0, 100.0, 240.0])
def test_to_a_fraction_of_a_sample(rate: float) -> None:
    knots, (t0, t1, t2, t3, t4, t5, _) = made(*THERE_AND_BACK)
    found = find_legs(driven(knots, rate), LEGS)
    assert [f.leg for f in found] == [0, 1, 2]
    assert all(f.reached for f in found)
    for f, start, end in zip(found, (t0, t2, t4), (t1, t3, t5), strict=True):
        assert f.start == pytest.approx(start, abs=max(0.5 / rate, 0.005))
        assert f.end == pytest.approx(end, abs=max(0.5 / rate, 0.005))


@pytest.mark.parametrize("v", [0.2, 0.6, 1.0])
def test_as_motion_capture_sees_it(v: float) -> None:
    """0.5 mm of noise, 6 Hz low-pass: within 15 ms on the mean, 60 ms at worst."""
    knots, (t0, t1, t2, t3, t4, t5, _) = made(
        stand(3), drive(5, v), stand(0.3), spin(math.pi), stand(0.3), drive(5, v), stand(4)
    )
    errors = []
    for seed in range(10):
        m = driven(knots, noise=5e-4, turn_noise=3e-3, filtered=6.0, seed=seed)
        found = find_legs(m, LEGS)
        assert all(f.reached for f in found)
        errors += [[f.start - s, f.end - e] for f, s, e in zip(found, (t0, t2, t4), (t1, t3, t5), strict=True)]
    assert np.abs(errors).max() < 0.06
    assert np.abs(np.mean(errors, axis=0)).max() < 0.015


def test_the_final_rotation_belongs_to_the_leg() -> None:
    knots, ends = made(stand(3), drive(5), stand(1.0), spin(-0.6), stand(5))
    m = driven(knots, at=(0.0, 0.0, 0.6))
    goal = np.array([5 * math.cos(0.6), 5 * math.sin(0.6), 0.0])
    (found,) = find_legs(m, (Leg("forth", A, goal, 0.2, 0.2),))
    assert found.end == pytest.approx(ends[3], abs=0.01)
    (free,) = find_legs(m, (Leg("forth", A, goal, 0.2, math.inf),), rest=0.9)
    assert free.end == pytest.approx(ends[1], abs=0.01)


def test_a_robot_that_waits_has_not_arrived() -> None:
    knots, ends = made(stand(3), drive(2.5), stand(12), drive(1.5), stand(0.8), drive(1.0), stand(3))
    (found,) = find_legs(driven(knots), LEGS[:1])
    assert (found.start, found.end) == pytest.approx((ends[0], ends[5]), abs=0.01)
    assert found.reached


def test_pauses_near_the_start_and_a_nudge_before() -> None:
    knots, ends = made(stand(3), drive(0.05, 0.1), stand(4), drive(0.2), stand(0.7), drive(4.8), stand(3))
    (found,) = find_legs(driven(knots), LEGS[:1])
    assert found.start == pytest.approx(ends[2], abs=0.02)
    assert "with 1 pause near it" in found.why


def test_overshoot_and_recovery_at_the_goal() -> None:
    knots, ends = made(
        stand(3), drive(5.4), stand(0.4), drive(-0.8), stand(0.5), spin(1.0), stand(0.4), spin(-1.0), stand(0.2),
        drive(0.4), stand(0.3), spin(math.pi), stand(0.4), spin(-0.1), stand(3),
    )  # fmt: skip
    forth, turn = find_legs(driven(knots), LEGS[:2])
    assert forth.end == pytest.approx(ends[9], abs=0.02)
    assert turn.start == pytest.approx(ends[10], abs=0.02)
    assert turn.end == pytest.approx(ends[11], abs=0.02) or turn.end == pytest.approx(ends[13], abs=0.02)


def test_one_leg_that_runs_into_the_next() -> None:
    """The turn begins before the robot ever stands."""
    knots: Knots = [(0, 0, 0), (3, 0, 0), (3.5, 0.5, 0), (13, 0.5, 0), (13.5, 0.02, 0.05), (14, 0, 1.0), (16.6, 0, 1.0)]
    knots += [(17.1, 0, 0), (20, 0, 0)]
    forth, turn = find_legs(driven(knots), LEGS[:2])
    assert forth.reached
    assert turn.reached
    assert forth.end == pytest.approx(13.5, abs=0.2)
    assert turn.start == pytest.approx(forth.end, abs=0.1)
    assert turn.end == pytest.approx(17.1, abs=0.02)


def test_a_robot_that_never_arrives() -> None:
    knots, ends = made(stand(3), drive(3), stand(20))
    (found,) = find_legs(driven(knots), LEGS)
    assert not found.reached
    assert found.start == pytest.approx(ends[0], abs=0.01)
    assert found.end == ends[-1]
    assert "nearest 2.00 m" in found.why
    (stuck,) = find_legs(driven(made(stand(9))[0]), LEGS)
    assert not stuck.reached
    knots, ends = made(stand(3), drive(5), stand(0.3), spin(1.0), stand(9))
    forth, turn = find_legs(driven(knots), LEGS)
    assert (forth.reached, turn.reached) == (True, False)
    assert forth.end == pytest.approx(ends[1], abs=0.01)
    only, *none = find_legs(driven(made(stand(3), drive(5), stand(9))[0]), LEGS)
    assert only.reached
    assert not none


def test_a_robot_that_is_carried_back_between_repetitions() -> None:
    knots, ends = made(stand(3), drive(5), stand(5), drive(-5, 0.8), stand(5), drive(5), stand(4))
    twice = (LEGS[0], LEGS[0])
    first, second = find_legs(driven(knots), twice)
    assert (first.start, first.end) == pytest.approx((ends[0], ends[1]), abs=0.01)
    assert (second.start, second.end) == pytest.approx((ends[4], ends[5]), abs=0.01)
    late = driven(knots)
    cut = late.t > ends[1] + 1  # the record begins with the robot still at the goal
    (found,) = find_legs(Motion(late.t[cut], late.pose[cut], late.velocity[cut], None, late.quality), LEGS[:1])
    assert (found.start, found.end) == pytest.approx((ends[4], ends[5]), abs=0.01)


def test_the_next_repetition_in_the_same_record_is_not_this_one() -> None:
    knots, ends = made(*THERE_AND_BACK, spin(-math.pi), stand(3), *THERE_AND_BACK[1:])
    found = find_legs(driven(knots), LEGS)
    assert [f.reached for f in found] == [True] * 3
    assert found[2].end == pytest.approx(ends[5], abs=0.01)


def test_carried_sideways_is_motion() -> None:
    """Its own forward speed doesn't show that somebody shifts it."""
    t = np.arange(0, 20, 0.01)
    y = np.clip((t - 5) * 0.3, 0, 1.5)
    x = np.clip((t - 13) * 0.5, 0, 2.0)
    pose = np.stack([x, y - 1.5, 0 * t], axis=1)
    v = np.stack([np.where((t > 13) & (t < 17), 0.5, 0.0), 0 * t], axis=1)
    leg = Leg("forth", A, np.array([2.0, 0, 0]), 0.1, 0.2)
    (found,) = find_legs(Motion(t, pose, v, None, Quality(100, 1.0)), (leg,))
    assert (found.start, found.end) == pytest.approx((13.0, 17.0), abs=0.02)


def test_without_goals_long_rests_part_the_legs() -> None:
    knots, ends = made(
        stand(3), drive(5), stand(2.5), spin(math.pi), stand(2.5), drive(2), stand(1), drive(3), stand(4)
    )
    found = find_legs(driven(knots), UNKNOWN)
    assert [(f.start, f.end) for f in found] == [
        pytest.approx(pair, abs=0.01) for pair in ((ends[0], ends[1]), (ends[2], ends[3]), (ends[4], ends[7]))
    ]
    assert all(f.reached for f in found)
    with pytest.raises(ClearwayError, match=r"drove 3 times \(3\.0 s to 13\.5 s; .* has 1 legs; give their goals or"):
        find_legs(driven(knots), UNKNOWN[:1])
    cut = driven(knots)
    moving = cut.t < ends[7] - 1
    early = find_legs(Motion(cut.t[moving], cut.pose[moving], cut.velocity[moving], None, cut.quality), UNKNOWN)
    assert [f.rested for f in early] == [True, True, False]
    assert all(f.reached for f in early)  # where it should have gone is unknown


def test_goals_that_were_sent_begin_the_legs() -> None:
    knots, ends = made(*THERE_AND_BACK)
    sent = np.array([ends[0] - 0.25, ends[2] - 0.15, ends[4] - 0.2])
    found = find_legs(driven(knots), LEGS, sent=sent)
    assert [f.start for f in found] == pytest.approx(sent)
    assert "goal sent at" in found[0].why
    assert find_legs(driven(knots), LEGS, sent=np.array([999.0]))[0].start == pytest.approx(ends[0], abs=0.01)


def test_gaps_while_it_stands_and_while_it_drives() -> None:
    knots, ends = made(*THERE_AND_BACK)
    m = driven(knots)
    m.pose[50:150] = np.nan
    m.pose[600:640] = np.nan
    m.velocity[50:150] = m.velocity[600:640] = np.nan
    found = find_legs(m, LEGS)
    assert [f.reached for f in found] == [True] * 3
    assert found[0].start == pytest.approx(ends[0], abs=0.01)
    assert found[0].end == pytest.approx(ends[1], abs=0.01)
    m.pose[:] = np.nan
    with pytest.raises(ClearwayError, match="seen in 0 samples"):
        find_legs(m, LEGS)


def test_without_headings_positions_decide() -> None:
    knots, ends = made(stand(3), drive(5), stand(4))
    m = driven(knots)
    m.pose[:, 2] = np.nan
    m.velocity[:, 1] = np.nan
    (found,) = find_legs(m, LEGS[:1])
    assert (found.start, found.end) == pytest.approx((ends[0], ends[1]), abs=0.01)
    with pytest.raises(ClearwayError, match="no legs"):
        find_legs(m, ())


def test_the_sentence_for_people() -> None:
    knots, _ = made(stand(3), drive(5.1), stand(4))
    (found,) = find_legs(driven(knots), LEGS[:1])
    assert "moved off at 3.00 s after 3.0 s of rest, 0.00 m from the start" in found.why
    assert "came to rest at 13.70 s, 0.10 m and 0.00 rad from the goal" in found.why
    knots, _ = made(stand(3), drive(5.3), stand(4))
    (found,) = find_legs(driven(knots), LEGS[:1])
    assert found.reached
    assert "outside its tolerance" in found.why

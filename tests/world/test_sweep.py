"""A lidar's beams are cast one after another: what each sees is where all were at its time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from worlds import DRIVE, Pilot, body, make_robot, make_scenario, moving_obstacle, run

from clearway.contract import Command, Sensing
from clearway.geometry.shapes import Circle, FloatArray, rectangle
from clearway.perception.skew import straightened

N, FIRST, LAST = 91, -1.5, 1.5
AT_ONCE = DRIVE | {"acceleration": math.inf, "deceleration": math.inf,
                   "angular_acceleration": math.inf, "angular_deceleration": math.inf}  # fmt: skip
LEGS = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 3.0}]
SWEEP = 0.08


def scans(
    command: Command, bodies: Any = (), knots: Any = None, sensing: float = 0.05, factor: float = 1.0, period: float = 0.1, **lidar: Any
) -> list[Sensing]:  # fmt: skip
    table = {"beams": N, "angle_min": FIRST, "angle_max": LAST, "range_min": 0.05, "range_max": 10.0, "sigma": 0.0,
             "sweep": SWEEP, "mount": (0.2, 0.1, 0.3)}  # fmt: skip
    robot = make_robot(lidar=table | lidar, latency={"sensing": sensing}, drive=AT_ONCE, period=period)
    pilot = Pilot(lambda _: command)
    run(pilot, bodies, make_scenario(legs=LEGS, latency=factor), robot, knots)
    return pilot.seen


def ranges(sensing: Sensing) -> FloatArray:
    assert sensing.scan is not None
    return sensing.scan.ranges


def beam_times(stamp: float, clockwise: bool = False) -> FloatArray:
    times = stamp + SWEEP * (np.arange(N) / (N - 1) - 0.5)
    return times[::-1] if clockwise else times


def to_wall(x: float, y: float, theta: float, wall: float) -> float:
    """Along a ray to the wall at x = `wall`, in plain Python."""
    return (wall - x) / math.cos(theta) if math.cos(theta) > 1e-9 else math.inf


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("omega", [-1.9, 0.7])
def test_a_turning_robots_scan_is_skewed_by_omega_dt_of_each_beam(omega: float, clockwise: bool) -> None:
    """On the spot, with the lidar over the pivot, the heading at each beam's time says all."""
    wall = body(rectangle(0.2, 1000.0), 3.1, 0.0)
    seen = scans(Command(0.0, omega), [wall], clockwise=clockwise, mount=(0.0, 0.0, 0.0))
    compared = 0
    for s in seen:
        for i, t in enumerate(beam_times(s.t, clockwise)):
            heading = omega * max(t, 0.0) + FIRST + i * (LAST - FIRST) / (N - 1)
            expected = to_wall(0.0, 0.0, heading, 3.0)
            if t > 0.0 or s.t < -SWEEP:
                assert ranges(s)[i] == pytest.approx(expected if expected <= 10.0 else math.inf, rel=1e-9), (s.t, i)
                compared += expected <= 10.0
    assert compared > 300


@pytest.mark.parametrize("clockwise", [False, True])
def test_straightened_it_shows_what_stands_where_it_is(clockwise: bool) -> None:
    wall, omega = body(rectangle(0.2, 1000.0), 3.1, 0.0), -1.9
    seen = scans(Command(0.0, omega), [wall], clockwise=clockwise, mount=(0.0, 0.0, 0.0))
    off = []
    for s in seen:
        if s.t < SWEEP or s.scan is None:
            continue
        for scan in (straightened(s.scan, omega), s.scan):
            at = omega * s.t + scan.angle_min + scan.angle_increment * np.arange(N)
            hit = scan.ranges < np.inf
            off.append(np.abs(scan.ranges * np.cos(at) - 3.0)[hit].max(initial=0.0))
    assert max(off[::2]) < 1e-9
    assert max(off[1::2]) > 0.1


def test_a_driving_robots_scan_is_skewed_within_what_the_groups_leave() -> None:
    """At 0.8 m/s a sixteenth of 80 ms is 4 mm along the way; the mount turns along."""
    v, omega = 0.8, 0.6
    seen = scans(Command(v, omega), [body(rectangle(0.2, 1000.0), 6.1, 0.0)])
    worst = 0.0
    for s in seen[3:]:
        for i, t in enumerate(beam_times(s.t)):
            th = omega * t
            x, y = v / omega * math.sin(th), v / omega * (1.0 - math.cos(th))
            x, y = x + 0.2 * math.cos(th) - 0.1 * math.sin(th), y + 0.2 * math.sin(th) + 0.1 * math.cos(th)
            heading = th + 0.3 + FIRST + i * (LAST - FIRST) / (N - 1)
            if abs(math.remainder(heading, math.tau)) < 1.2:
                expected = to_wall(x, y, heading, 6.0)
                if 0.05 < expected < 10.0:
                    # off by the way in half a group, along the wall's normal and by the mount's turn
                    worst = max(worst, abs(ranges(s)[i] - expected) * math.cos(heading))
    assert 1e-4 < worst <= (v + 0.3 * omega) * SWEEP / 16.0


@pytest.mark.parametrize("clockwise", [False, True])
def test_who_moves_is_seen_where_it_was_at_each_beam(clockwise: bool) -> None:
    """A wall comes at 1 m/s: the beams that are cast later meet it nearer; never later than now."""
    knots = [np.array([[0.0, 9.0, 0.0, 0.0], [4.0, 5.0, 0.0, 0.0]])]
    seen = scans(
        Command(0.0, 0.0), [moving_obstacle(rectangle(0.2, 1000.0))], knots, clockwise=clockwise, mount=(0.0, 0.0, 0.0)
    )
    for s in seen[2:]:
        at = ranges(s) * np.cos(FIRST + np.arange(N) * (LAST - FIRST) / (N - 1))
        expected = 8.9 - beam_times(s.t, clockwise)
        hit = np.isfinite(at)
        assert hit.sum() > 25
        assert np.abs(at - expected)[hit].max() <= SWEEP / 16.0 + 1e-9
        assert at[hit].min() >= 8.9 - (s.t + 0.05) - 1e-9  # what arrives at t + sensing has not seen later


def test_a_robot_that_stands_among_still_things_sees_the_same_to_the_bit() -> None:
    bodies = [
        body(Circle(0.4), 2.0, 0.5),
        body(rectangle(0.6, 1.0), 3.0, -1.0, 0.3),
        body(rectangle(0.1, 9.0), 5.0, 0.0),
    ]
    noisy = {"sigma": 0.02, "divergence": 0.05, "dropout": 0.05, "bias": 0.03}
    with_, without = (scans(Command(0.0, 0.0), bodies, sweep=s, **noisy) for s in (SWEEP, 0.0))
    for a, b in zip(with_, without, strict=True):
        assert np.array_equal(ranges(a), ranges(b))


def test_without_latency_there_is_no_sweep() -> None:
    knots = [np.array([[0.0, 6.0, 0.0, 0.0], [3.9, 2.1, 0.0, 0.0]])]
    with_, without = (
        scans(Command(0.5, 1.0), [moving_obstacle(Circle(0.5))], knots, factor=0.0, sweep=s) for s in (SWEEP, 0.0)
    )
    assert all(np.array_equal(ranges(a), ranges(b)) for a, b in zip(with_, without, strict=True))


def test_the_factor_scales_the_sweep() -> None:
    wall = body(rectangle(0.2, 1000.0), 3.1, 0.0)
    twice = scans(Command(0.3, 1.0), [wall], factor=2.0, sweep=0.05, sensing=0.05)
    long = scans(Command(0.3, 1.0), [wall], factor=1.0, sweep=0.1, sensing=0.1)
    short = scans(Command(0.3, 1.0), [wall], factor=1.0, sweep=0.05, sensing=0.1)
    assert all(np.array_equal(ranges(a), ranges(b)) for a, b in zip(twice, long, strict=True))
    assert not np.array_equal(ranges(twice[20]), ranges(short[20]))


def test_a_sweep_across_the_begin_of_a_leg_knows_where_all_were_before() -> None:
    legs = [
        {"name": n, "goal": (g, 0.0, 0.0), "xy_tolerance": 1.0, "time_limit": 2.0}
        for n, g in (("one", 0.0), ("two", 9.0))
    ]
    places = {"one": 3.0, "two": 5.0}
    runs = [{"leg": n, "path": [(x, 0.0), (x + 1e-6, 0.0)], "speed": 1e-7} for n, x in places.items()]
    table = {"name": "box", "shape": {"kind": "rectangle", "length": 0.2, "width": 30.0}, "runs": runs}
    pilot = Pilot(lambda s: Command(0.0, 0.0, arrived=s.goal.leg == 0 and s.t > 0.75))
    lidar = {
        "beams": N,
        "angle_min": -0.5,
        "angle_max": 0.5,
        "range_min": 0.05,
        "range_max": 10.0,
        "sigma": 0.0,
        "sweep": SWEEP,
    }
    run(pilot, [moving_obstacle(rectangle(0.2, 30.0))], make_scenario(legs=legs, obstacles=[table]),
        make_robot(lidar=lidar, latency={"sensing": 0.27}))  # fmt: skip
    began = next(s.t for s in pilot.seen if s.goal.leg == 1) + 0.27 - 0.1
    crossed = 0
    for s in pilot.seen:
        at = ranges(s) * np.cos(-0.5 + np.arange(N) / (N - 1))
        before = beam_times(s.t) < began - SWEEP / 16.0
        after = beam_times(s.t) > began + SWEEP / 16.0
        assert at[before] == pytest.approx(2.9, abs=1e-3)
        assert at[after] == pytest.approx(4.9, abs=1e-3)
        crossed += before.any() and after.any()
    assert crossed


@pytest.mark.parametrize(
    ("sweep", "said"),
    [(-0.01, "greater than or equal to 0"), (0.11, "arrive before its last beam"), (3.0, "less than")],
)
def test_a_sweep_that_can_not_be_is_refused(sweep: float, said: str) -> None:
    lidar = {"beams": 3, "angle_min": -1.0, "angle_max": 1.0, "range_min": 0.1, "range_max": 9.0, "sigma": 0.0}
    with pytest.raises(ValidationError, match=said):
        make_robot(lidar=lidar | {"sweep": sweep}, latency={"sensing": 0.05})


def test_a_lidar_that_turns_as_slowly_as_its_robot_looks_at_one_place() -> None:
    """One radian in a second, on a robot that turns by one radian a second the other way."""
    wall = body(rectangle(0.2, 1000.0), 3.1, 0.0)
    lidar = {"angle_min": 0.0, "angle_max": 1.0, "sweep": 1.0, "mount": (0.0, 0.0, 0.0)}
    seen = scans(Command(0.0, -1.0), [wall], sensing=0.5, **lidar)
    s = seen[20]
    assert s.t == pytest.approx(1.5)
    assert ranges(s) == pytest.approx(3.0 / math.cos(1.0) * np.ones(N), rel=1e-6)

"""Certified plans touch nothing, whatever is tried; what should be certified is; what should not be is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from benchmark_modules import load_benchmark
from clearway.forecasts.forecast import Forecast
from clearway.geometry.footprint import footprint
from clearway.geometry.shapes import Circle, FloatArray, Polygon, rectangle
from clearway.navigators.hp_st.environment.sight import Sight, depth, sight_of
from clearway.navigators.hp_st.guarantee.certificate import (
    AREA,
    CLEAR,
    UNSEEN,
    Rules,
    Safety,
    Verdict,
    certify,
    longest_certified,
    stopped_after,
)
from clearway.navigators.hp_st.guarantee.tube import Plan, drive, room, tube
from clearway.robots import DriveLimits, load_robot

PERIOD = 0.15
INSTANT = DriveLimits(-1.0, 1.0, math.inf, math.inf, 1.5, math.inf, math.inf)
HOSBOT = DriveLimits(-1.5, 1.5, 0.5, 2.0, 3.0, 1.0, 2.0)
SHOVED = np.array([0.01, 0.01, 0.0, 0.0, 0.0])
DISC = footprint(Circle(0.25))
FREE = Rules(math.inf, np.array([-math.inf, -math.inf, math.inf, math.inf]), Sight(math.inf), 0.0)
L_SHAPE = Polygon(((-0.3, -0.3), (0.4, -0.3), (0.4, 0.0), (0.0, 0.0), (0.0, 0.4), (-0.3, 0.4)))


@pytest.fixture(scope="module")
def benchmark() -> Any:
    return load_benchmark("certificates")


def expect(
    still: Any = (),
    centre: Any = None,
    reach: Any = None,
    step: float = PERIOD,
    speed: float = 1.0,
    radius: float = 0.35,
) -> Forecast:
    """Standing discs (s, 3), and one moving obstacle whose centre (K + 1, 2) is known within `reach` (K + 1,)."""
    n = 0 if centre is None else 1
    at = np.zeros((n, 1, 2)) if centre is None else np.array([centre], dtype=np.float64)
    count = at.shape[1]
    grown = np.zeros((n, count)) if reach is None else np.array([reach], dtype=np.float64)
    return Forecast(
        step, np.array(still, dtype=np.float64).reshape(-1, 3), np.zeros((n, 1, count, 2)), np.zeros((n, 1, count)),
        np.ones((n, 1)), np.full(n, radius), at, grown, np.full(n, speed), np.arange(n), np.zeros(n),
    )  # fmt: skip


def judge(
    commands: Any, forecast: Forecast, rules: Rules = FREE, disturbance: FloatArray = SHOVED, body: Any = DISC
) -> Verdict:
    plan = drive(np.zeros(5), np.array(commands, dtype=np.float64), INSTANT, PERIOD)
    about = tube(plan, room(plan, INSTANT), PERIOD, disturbance, np.zeros(3), True)
    return certify(plan, about, PERIOD, body, forecast, rules)


TURN = [(0.0, 1.0)] * 3 + [(0.0, 0.0)] * 2
AHEAD = [(0.8, 0.0)] * 10 + [(0.0, 0.0)] * 2
STAND = [(0.0, 0.0)] * 5
NOTHING = (CLEAR, math.inf)


@pytest.mark.parametrize(
    ("name", "shape"),
    [("rescue", None), ("rescue:unlimited, misreading its pose", L_SHAPE), ("hosbot", None), ("hosbot", L_SHAPE)],
)
def test_a_certified_plan_never_touches_anything(benchmark: Any, name: str, shape: Polygon | None) -> None:
    """Driven with the worst disturbance found, among pursuers: benchmarks/certificates.py does it in thousands."""
    seen = benchmark.certificates(name, 60, 7, shape)
    assert seen["certified"] >= 20
    assert seen["refused"] >= 3
    for what in ("standing", "moving", "unseen", "area"):
        assert seen[what] > 0.0, what


def test_beyond_the_bounds_it_does_touch(benchmark: Any) -> None:
    """So the test above could fail."""
    seen = benchmark.certificates("rescue:unlimited", 60, 7, beyond=4.0)
    assert min(seen["standing"], seen["moving"], seen["unseen"]) <= 0.0


def test_a_round_base_turns_beside_anybody_where_turning_counts_as_standing() -> None:
    beside = expect(centre=[(0.0, 0.61)] * 9, reach=[0.0 + 0.2 * k for k in range(9)])
    free = FREE._replace(turning=True)
    steady = np.zeros(5)
    assert judge(STAND, beside, disturbance=steady).ok
    assert not judge(TURN, beside, disturbance=steady).ok
    assert judge(TURN, beside, free, steady).ok
    assert not judge(TURN, beside, free, steady, footprint(L_SHAPE)).ok  # its corners move
    assert not judge([(0.05, 1.0), *TURN], beside, free, steady).ok  # it drives as well
    assert not judge(TURN, expect([(0.0, 0.5, 0.35)]), free, steady).ok  # what stands counts at any time


def test_free_space_is_certified_and_what_is_in_the_way_is_not() -> None:
    assert judge(AHEAD, expect()) == (True, *NOTHING)
    assert judge(AHEAD, expect([(3.0, 0.0, 0.35), (-1.0, 0.0, 0.35)])).ok
    verdict = judge(AHEAD, expect([(5.0, 5.0, 0.35), (1.4, 0.0, 0.35)]))
    assert (verdict.ok, verdict.which) == (False, 1)
    assert verdict.time == pytest.approx((1.4 - 0.35 - 0.25) / 0.8, abs=0.1)  # the tube comes a little sooner
    assert verdict.time < (1.4 - 0.35 - 0.25) / 0.8


def test_the_edge_of_the_tube_is_the_edge_of_the_certificate() -> None:
    plan = drive(np.zeros(5), np.array(AHEAD), INSTANT, PERIOD)
    about = tube(plan, room(plan, INSTANT), PERIOD, SHOVED, np.zeros(3), True)
    edge = 0.25 + 0.35 + about.around[4]  # beside the middle of period 4, which is at x = 4.5 * 0.12
    assert judge(AHEAD, expect([(0.54, edge + 0.02, 0.35)])).ok
    assert not judge(AHEAD, expect([(0.54, edge - 0.001, 0.35)])).ok


def test_contact_between_two_samples_is_seen() -> None:
    """The obstacle crosses the way between two instants and two samples; at all of them it is clear."""
    crossing = [(0.42, 1.2), (0.42, -1.2)] + [(0.42, -5.0)] * 8
    fast = expect(centre=crossing, speed=20.0, step=PERIOD, radius=0.1)
    assert [math.hypot(x - i * 0.12, y) > 0.6 for i, (x, y) in enumerate(crossing)]
    rules = FREE._replace(acceleration=0.0)
    assert (judge(AHEAD, fast, rules).which, judge(AHEAD, fast).ok) == (0, False)
    past = expect(centre=[(0.42, 2.2), (0.42, 2.2)] + [(0.42, 5.0)] * 8, speed=20.0, step=PERIOD, radius=0.1)
    assert judge(AHEAD, past, rules).ok


def test_a_bounded_acceleration_tells_more_than_a_bounded_speed() -> None:
    """Passing side by side: the speed's bound lets it swerve between two instants, the acceleration's does not."""
    beside = expect(centre=[(0.9 * i * PERIOD, 0.8) for i in range(14)], speed=4.0)
    assert judge(AHEAD, beside, FREE._replace(acceleration=1.8)).ok
    assert not judge(AHEAD, beside).ok


def test_beyond_the_forecast_the_speed_bounds() -> None:
    short = expect(centre=[(3.0, 0.0), (3.0, 0.0)], speed=1.0, step=PERIOD)
    verdict = judge(AHEAD, short)
    # (3 - 0.6) is closed by 0.8 of ours and 1.0 of its, from the forecast's last instant on
    assert verdict.time == pytest.approx((3.0 - 0.6 + PERIOD * 1.0) / 1.8, abs=0.1)
    assert judge(AHEAD, short._replace(speed=np.array([0.1]))).ok


def test_at_rest_the_robot_may_be_hit_but_not_stand_in_something() -> None:
    assert judge(STAND, expect(centre=[(0.1, 0.0)] * 6)).ok
    assert judge(STAND, expect([(0.1, 0.0, 0.35)])) == (False, 0, 0.0)
    coming = expect(centre=[(2.4 - 1.0 * i * PERIOD, 0.0) for i in range(14)], speed=1.0)
    assert not judge(AHEAD, coming, FREE._replace(acceleration=0.5)).ok
    assert judge([(0.8, 0.0)] * 2 + [(0.0, 0.0)] * 10, coming, FREE._replace(acceleration=0.5)).ok


def test_the_area_holds_the_robots_centre() -> None:
    room_ahead = FREE._replace(area=np.array([-1.0, -1.0, 1.3, 1.0]))
    assert judge(AHEAD, expect(), room_ahead).ok  # it ends at 1.2, within 0.07
    assert judge(AHEAD, expect(), room_ahead._replace(area=np.array([-1.0, -1.0, 1.2, 1.0]))).which == AREA
    outside = FREE._replace(area=np.array([0.1, -1.0, 2.0, 1.0]))
    assert judge(AHEAD, expect(), outside).which == AREA  # pushed backwards it would come farther out
    assert judge(STAND, expect(), outside).ok


def test_what_nobody_has_seen_may_come_from_the_rim() -> None:
    # it drives 1.2 m in 1.5 s; at 1 m/s the unseen has come 1.5 m nearer by then
    assert judge(AHEAD, expect(), FREE._replace(sight=Sight(1.2 + 0.25 + 1.5 + 0.1), unseen=1.0)).ok
    refused = judge(AHEAD, expect(), FREE._replace(sight=Sight(1.2 + 0.25 + 1.5 - 0.05), unseen=1.0))
    assert (refused.which, refused.time) == (UNSEEN, pytest.approx(9 * PERIOD))
    assert (
        judge(AHEAD, expect(), FREE._replace(sight=Sight(1.4), unseen=0.0)).which == UNSEEN
    )  # it stands where nobody looked
    assert judge(STAND, expect(), FREE._replace(sight=Sight(0.3), unseen=100.0)).ok


AHEAD_ONLY = FREE._replace(sight=Sight(9.0, 0.0, math.radians(100), 0.2))
TURN = [(0.0, 1.5)] * 8  # by 103 degrees


def test_it_drives_only_where_it_looks() -> None:
    """Of a sector of 200 degrees ahead: not backwards; on the spot as far as it likes; and not to where it first has to turn."""
    back = [(-0.3, 0.0)] * 4 + [(0.0, 0.0)]
    assert judge(back, expect()).ok
    assert judge(back, expect(), AHEAD_ONLY) == (False, UNSEEN, 0.0)
    assert judge([(0.3, 0.0)] * 2 + back, expect(), AHEAD_ONLY) == (False, UNSEEN, pytest.approx(2 * PERIOD))
    still = np.zeros(5)
    assert judge([(0.3, 0.5)] * 8, expect(), AHEAD_ONLY, still).ok
    assert judge([*TURN, *TURN, (0.0, 0.0)], expect(), AHEAD_ONLY, still).ok
    assert judge([*TURN[:7], (0.3, 0.0), (0.0, 0.0)], expect(), AHEAD_ONLY, still).ok  # 90 degrees
    assert judge([*TURN, (0.3, 0.0), (0.0, 0.0)], expect(), AHEAD_ONLY, still).which == UNSEEN
    assert judge([*TURN, (-0.3, 0.0), (0.0, 0.0)], expect(), AHEAD_ONLY, still).ok  # backwards to where it looked
    assert not judge([*TURN[:7], (0.3, 0.0), (0.0, 0.0)], expect(), AHEAD_ONLY).ok  # up to 7 x 0.01 rad farther


def test_a_base_that_slows_down_from_reverse_is_not_certified_either() -> None:
    plan = drive(np.array([0.0, 0.0, 0.0, -0.2, 0.0]), np.zeros((3, 2)), HOSBOT, 0.1)
    about = tube(plan, room(plan, HOSBOT), 0.1, np.zeros(5), np.zeros(3), False)
    assert certify(plan, about, 0.1, DISC, expect(), FREE).ok
    assert certify(plan, about, 0.1, DISC, expect(), AHEAD_ONLY) == (False, UNSEEN, 0.0)


def test_the_rim_lies_around_the_sensor() -> None:
    for ahead, ok in ((0.2, True), (0.0, False), (-0.2, False)):
        sight = Sight(1.2 + 0.25 + 0.02, 0.0, math.pi, ahead)  # the tube is wider than 0.02 m at the end
        assert judge(AHEAD, expect(), FREE._replace(sight=sight)).ok == ok


@pytest.mark.parametrize(("name", "out"), [("tiago", 0.465), ("hosbot", 0.361)])
def test_part_of_its_own_outline_is_out_of_sight(name: str, out: float) -> None:
    """So something that nobody has seen may touch it at any time, and can't be excluded by any certificate."""
    robot = load_robot(name)
    shape, sight = robot.shape, sight_of(robot, 4.0)
    angles = np.linspace(0.0, 2.0 * math.pi, 721)
    rim = (
        shape.radius * np.column_stack((np.cos(angles), np.sin(angles)))
        if isinstance(shape, Circle)
        else np.array([(x, y) for x in np.linspace(-0.3, 0.3, 61) for y in np.linspace(-0.3, 0.3, 61)])
    )
    assert -min(depth(sight, np.zeros(3), x, y) for x, y in rim.tolist()) == pytest.approx(out, abs=1e-3)


def test_what_is_not_a_number_is_never_certified() -> None:
    nan = math.nan
    assert not judge(AHEAD, expect([(nan, 0.0, 0.35)])).ok
    for bad in (expect(centre=[(nan, 0.0)] * 4), expect(centre=[(9.0, 0.0)] * 4, reach=[nan] * 4)):
        assert not judge(AHEAD, bad).ok
        assert not judge(AHEAD, bad, FREE._replace(acceleration=1.0)).ok
    assert not judge([(nan, 0.0)] * 3, expect(), FREE._replace(sight=Sight(3.0))).ok


def test_a_corner_reaches_farther_than_a_side() -> None:
    square, beside = footprint(rectangle(0.6, 0.6)), expect([(0.54, 0.73, 0.35)])
    assert judge(AHEAD, beside, body=square).ok
    turning = [(0.0, 1.0)] * 5 + [(0.0, 0.0)]
    at_a_corner = expect([(0.0, 0.75, 0.35)])  # 0.4 from the side's edge: the corner comes to 0.424
    still = np.zeros(5)
    assert not judge(turning, at_a_corner, body=square, disturbance=still).ok
    assert judge([(0.0, 0.1)] * 5, at_a_corner, body=square, disturbance=still).ok


def test_braking_by_hand() -> None:
    def braking(state: list[float], limits: DriveLimits, period: float) -> Plan:
        return stopped_after(drive(np.array(state), np.zeros((1, 2)), limits, period), 0, limits, period)

    tail = braking([1.0, 2.0, 0.0, 1.5, 0.0], HOSBOT, 0.1)
    assert len(tail.inputs) == 8 + 1  # 1.5 m/s at 2 m/s^2: 0.75 s; then one period at rest
    assert tail.states[-1] == pytest.approx([1.0 + 1.5**2 / 4.0, 2.0, 0.0])
    assert not tail.velocities[-2:].any()
    at_once = braking([0.0, 0.0, 0.3, 1.0, -1.5], INSTANT, PERIOD)
    assert at_once.states.tolist() == [[0.0, 0.0, 0.3]] * 2
    turning = braking([0.0, 0.0, 0.0, 0.1, 1.0], HOSBOT, 0.1)
    assert len(turning.inputs) == 5 + 1  # 1 rad/s at 2 rad/s^2


@pytest.mark.parametrize("limits", [INSTANT, HOSBOT])
def test_the_longest_certified_part_is_the_longest(benchmark: Any, limits: DriveLimits) -> None:
    rng = np.random.default_rng(8)
    safety, found = Safety(limits, PERIOD, SHOVED, np.zeros(3)), []
    for _ in range(60):
        forecast, _about = benchmark.scene(rng, 12, 0.2, (1.0, 1.0))
        rules = FREE._replace(acceleration=1.0, sight=Sight(float(rng.uniform(1, 4))), unseen=1.0)
        commands = (
            np.column_stack([rng.uniform(-1, 1, 8), rng.uniform(-1, 1, 8)]) if len(found) % 2 else [(1.0, 0.1)] * 12
        )
        plan = drive(np.array([0.0, 0.0, 0.0, 0.3, 0.0]), np.array(commands), limits, PERIOD)
        k, whole, about = longest_certified(plan, DISC, forecast, rules, safety, False, 0)
        accepted = []
        for i in range(len(plan.inputs) + 1):
            stopped = stopped_after(plan, i, limits, PERIOD)
            around = tube(stopped, room(stopped, limits), PERIOD, SHOVED, np.zeros(3), False)
            if certify(stopped, around, PERIOD, DISC, forecast, rules).ok:
                accepted.append(i)
        assert k == max(accepted, default=-1)
        assert len(about.around) == len(whole.inputs)
        assert not whole.velocities[-1].any()
        found.append(k)
    assert len(set(found)) > 4  # nothing, something, everything

"""hp-st's tube: bounds that hold against everything that is tried, are not loose, and agree with what is known by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from benchmark_modules import load_benchmark
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube, drive, room, tube
from clearway.robots import DriveLimits, load_robot

PERIOD = 0.15
RESCUE = DriveLimits(-1.0, 1.0, math.inf, math.inf, 1.5, math.inf, math.inf)
RAMPED = DriveLimits(-1.5, 1.5, 0.5, 2.0, 3.0, 1.0, 2.0)
SHOVED = np.array([0.01, 0.01, 0.0, 0.0, 0.0])
EXACT = np.zeros(3)


@pytest.fixture(scope="module")
def benchmark() -> Any:
    return load_benchmark("certified_tube")


def about(commands: Any, disturbance: FloatArray = SHOVED, start: FloatArray = EXACT) -> tuple[Plan, Tube]:
    """The rescue robot's tube about what `commands` (n, 2) make of it."""
    plan = drive(np.zeros(5), np.array(commands, dtype=np.float64), RESCUE, PERIOD)
    return plan, tube(plan, room(plan, RESCUE), PERIOD, disturbance, start, True)


def test_no_run_ever_leaves_the_tube(benchmark: Any) -> None:
    for row in benchmark.measure(plans=12, runs=4):
        for bound, share in row["worst"].items():
            assert share <= 1.0 + 1e-9, (row["base"], bound)


def test_the_tube_is_not_loose(benchmark: Any) -> None:
    """An adversary that plans ahead comes near the bound after 20 periods, not after one only."""
    for row in benchmark.measure(plans=12, runs=4):
        assert row["worst"]["radius at the end"] > 0.75, row["base"]
        assert row["median"]["radius at the end"] > 0.6, row["base"]


def test_twice_the_disturbance_leaves_it(benchmark: Any) -> None:
    plan, safe = about(np.tile((0.6, 0.4), (10, 1)))
    path, worst = np.empty((10 * 15 + 1, 5)), np.zeros(7)
    benchmark.follow(plan, safe, RESCUE, PERIOD, 2 * SHOVED, EXACT, 6, stream(1, "x"), 0, path, worst)
    assert worst[0] > 1.5


def test_one_period_by_hand() -> None:
    _, safe = about([(0.5, 0.0)])
    assert 0.01 <= safe.radius[1] <= 0.0101  # the disc itself; the polygon around it is 0.9 % larger
    assert safe.heading.tolist() == [0.0, 0.01]
    assert safe.around[0] == safe.radius[1]  # the displacement grows evenly, nothing bends


def test_two_periods_by_hand() -> None:
    """Without room for corrections: two discs, and one turn times the way that is driven after it."""
    plan = drive(np.zeros(5), np.array([(0.8, 0.0), (0.8, 0.0)]), RESCUE, PERIOD)
    safe = tube(plan, np.zeros((2, 2)), PERIOD, SHOVED, EXACT, True)
    expected = 0.02 + 0.8 * PERIOD * 0.01  # to the side
    assert expected <= safe.radius[2] <= 1.009 * expected
    assert safe.heading[2] == pytest.approx(0.02)
    assert not safe.gains.any()


def test_a_robot_at_rest_stays_where_it_is_unless_it_is_pushed_there_too() -> None:
    driven = [(0.5, 0.2), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    _, safe = about(driven)
    assert safe.radius[2] > safe.radius[1]  # it moved when the first of these periods began
    assert safe.radius[2] == safe.radius[3] == safe.radius[4]
    assert safe.heading[2] == safe.heading[4]
    _, pushed = about(driven, np.array([0.01, 0.01, 0.0, 0.0, 1.0]))
    assert pushed.radius[4] > pushed.radius[3] + 0.009
    _, standing = about([(0.0, 0.0)] * 3)
    assert not standing.radius.any()


def test_corrections_never_need_more_than_the_limits_leave() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        commands = np.column_stack([rng.uniform(-1, 1, 20), rng.uniform(-1.5, 1.5, 20)])
        commands[rng.random(20) < 0.3] = (1.0, 1.5)
        plan, safe = about(commands)
        assert (np.abs(plan.inputs) + safe.margin <= (1.0 + 1e-12, 1.5 + 1e-12)).all()
        assert not safe.gains[(commands == (1.0, 1.5)).all(1)].any()  # at both limits there is no room


def test_feedback_keeps_a_driving_robot_close() -> None:
    plan, safe = about(np.tile((0.7, 0.0), (20, 1)))
    blind = tube(plan, np.zeros((20, 2)), PERIOD, SHOVED, EXACT, True)
    assert safe.radius[20] < 0.045
    assert blind.radius[20] > 0.35


def test_the_tube_of_a_beginning_is_the_beginning_of_the_tube() -> None:
    rng = np.random.default_rng(5)
    commands = np.column_stack([rng.uniform(-1, 1, 12), rng.uniform(-1.5, 1.5, 12)])
    _, whole = about(commands)
    _, part = about(commands[:7])
    np.testing.assert_array_equal(part.radius, whole.radius[:8])
    np.testing.assert_array_equal(part.around, whole.around[:7])
    np.testing.assert_array_equal(part.gains, whole.gains[:7])


def test_a_ramped_base_has_no_feedback_and_a_bound_on_its_ramps() -> None:
    plan = drive(np.zeros(5), np.array([(1.0, 1.0)] * 4), RAMPED, 0.1)
    assert plan.velocities[:, 0] == pytest.approx([0.0, 0.05, 0.10, 0.15, 0.20])
    assert plan.velocities[:, 1] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert plan.inputs[:, 0] == pytest.approx([0.025, 0.075, 0.125, 0.175])
    assert plan.swings == pytest.approx(np.tile((0.05, 0.1), (4, 1)))
    assert not room(plan, RAMPED).any()
    safe = tube(plan, room(plan, RAMPED), 0.1, np.zeros(5), EXACT, True)
    x = y = theta = 0.0
    off = []
    for i in range(4000):  # the ramp itself, in steps so fine that they are straight
        t = (i + 0.5) * 1e-4
        x, y, theta = arc(x, y, theta, 0.5 * t, 1.0 * t, 1e-4)
        j = i // 1000
        at = arc(*plan.states[j], *plan.inputs[j], (i + 1 - 1000 * j) * 1e-4)
        off.append(math.hypot(x - at[0], y - at[1]))
        assert off[-1] <= safe.around[j]
    assert math.hypot(*(plan.states[4, :2] - (x, y))) <= safe.radius[4]
    assert 0 < max(off) <= 0.0013  # a quarter of 0.05 m/s times 0.1 s


def test_the_robots_files_are_what_the_benchmark_drives(benchmark: Any) -> None:
    hosbot = load_robot("hosbot").drive
    assert benchmark.limits_of("hosbot")[2:4] == (hosbot.acceleration, hosbot.deceleration)

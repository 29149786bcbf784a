"""Nav2's velocity smoother and collision monitor against plain readings on random input, and in the details that matter."""

from __future__ import annotations

import math
from typing import Any

import commands_oracle as plain
import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.navigators.nav2.collision_monitor import CollisionMonitor
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.monitor import CollisionMonitorParameters
from clearway.navigators.nav2.seams import Velocity
from clearway.navigators.nav2.velocity_smoother import VelocitySmoother, VelocitySmootherParameters

REST = Velocity(0.0, 0.0, 0.0)
FOOTPRINT = np.array([(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)])


@pytest.mark.parametrize("feedback", ["OPEN_LOOP", "CLOSED_LOOP"])
@pytest.mark.parametrize("scale", [False, True])
def test_smoother_against_a_plain_reading(feedback: str, scale: bool) -> None:
    rng = np.random.default_rng(4)
    silent = limited = 0
    for _ in range(20):
        p = VelocitySmootherParameters(
            feedback=feedback,
            scale_velocities=scale,
            max_velocity=(0.5, float(rng.choice((0.0, 0.3))), 1.5),
            min_velocity=(-0.2, -0.3, -1.5),
            max_accel=(*rng.uniform(0.5, 3.0, 2), 3.0),
            max_decel=(*rng.uniform(-3.0, -0.5, 2), -2.0),
            deadband_velocity=tuple(rng.uniform(0.0, 0.05, 3)),
            velocity_timeout=0.4,
        )
        smoother, oracle = VelocitySmoother(p), plain.PlainSmoother(p.model_dump())
        measured, command = REST, REST
        for k in range(150):
            now = 0.05 * k
            if rng.random() < (0.6 if k % 50 < 25 else 0.03):
                if rng.random() < 0.3:
                    command = Velocity(*rng.uniform((-0.5, -0.5, -2.0), (0.8, 0.5, 2.0)))
                smoother.hear(now, command)
                oracle.command, oracle.heard = tuple(command), now
            found, expected = smoother.smooth(now, measured), oracle.timer(now, tuple(measured))
            if expected is None:
                silent += 1
                assert found is None
                continue
            assert found == pytest.approx(expected, abs=1e-12)
            limited += found != pytest.approx(command)
            measured = Velocity(*(0.9 * v for v in found))
    assert silent > 50
    assert limited > 200


def test_smoother_keeps_limits_and_its_own_time() -> None:
    smoother = VelocitySmoother(VelocitySmootherParameters(smoothing_frequency=30.0))
    assert smoother.period == 0.033  # whole milliseconds
    assert smoother.smooth(0.0, REST) is None
    smoother.hear(0.0, Velocity(2.0, 1.0, 0.0))
    speeds = [smoother.smooth(0.0, REST).v_x for _ in range(10)]
    assert np.diff(speeds[:6]) == pytest.approx(np.full(5, 2.5 / 30.0))
    assert speeds[-1] == 0.5  # and the base has no sides
    assert smoother.smooth(1.1, REST).v_x == pytest.approx(0.5 - 2.5 / 30.0)  # nothing heard for over a second


def test_smoother_takes_six_axes_and_refuses_wrong_lists() -> None:
    six = VelocitySmootherParameters(
        max_velocity=(0.4, 0.1, 9.0, 9.0, 9.0, 1.0),
        min_velocity=(-0.4, 0.0, 0.0, 0.0, 0.0, -1.0),
        max_accel=(99.0,) * 6,
        max_decel=(-99.0,) * 6,
        deadband_velocity=(0.0,) * 6,
    )
    smoother = VelocitySmoother(six)
    smoother.hear(0.0, Velocity(1.0, 1.0, 5.0))
    assert smoother.smooth(0.0, REST) == (0.4, 0.1, 1.0)
    for wrong in ({"max_velocity": (0.5, 0.0)}, {"max_decel": (2.5, 0.0, 3.2)}, {"max_accel": (-2.5, 0.0, 3.2)}):
        with pytest.raises(ValueError, match=r"below 0|above 0|takes 3"):
            VelocitySmootherParameters(**wrong)
    with pytest.raises(ValueError, match="as many"):
        VelocitySmootherParameters(max_velocity=(0.5,) * 6)


def monitor(zones: dict[str, dict[str, Any]], **rest: Any) -> CollisionMonitor:
    table = {
        "polygons": tuple(zones),
        "observation_sources": ("scan",),
        "scan": {"type": "scan"},
        **zones,
        **rest,
    }
    return CollisionMonitor(settle(CollisionMonitorParameters, table, "collision_monitor", None))


def random_zone(rng: np.random.Generator) -> tuple[dict[str, Any], Any]:
    """A zone as a file has it, and its shape as the plain reading has it."""
    zone: dict[str, Any] = {
        "action_type": str(rng.choice(("stop", "slowdown", "limit", "approach", "approach"))),
        "min_points": int(rng.integers(1, 6)),
        "trigger_consecutive_points": int(rng.integers(1, 3)),
        "release_consecutive_points": int(rng.integers(1, 3)),
        "slowdown_ratio": float(rng.uniform(0.1, 0.9)),
        "linear_limit": float(rng.uniform(0.05, 0.4)),
        "angular_limit": float(rng.uniform(0.1, 0.8)),
        "time_before_collision": float(rng.uniform(0.5, 3.0)),
        "simulation_time_step": float(rng.choice((0.05, 0.1))),
    }
    if rng.random() < 0.3:
        radius = float(rng.uniform(0.2, 0.6))
        return zone | {"type": "circle", "radius": radius}, radius
    angles = np.sort(rng.uniform(-math.pi, math.pi, 5))
    corners = np.column_stack((np.cos(angles), np.sin(angles))) * rng.uniform(0.2, 0.8, (5, 1))
    text = "[" + ", ".join(f"[{x!r}, {y!r}]" for x, y in corners.tolist()) + "]"
    return zone | {"type": "polygon", "points": text}, [complex(*c) for c in corners.tolist()]


def test_monitor_against_a_plain_reading() -> None:
    rng = np.random.default_rng(17)
    outcomes = {"as it came": 0, "slower": 0, "stopped": 0, "silent": 0}
    for _ in range(120):
        zones = {f"zone{i}": random_zone(rng) for i in range(rng.integers(1, 4))}
        found = monitor({name: zone for name, (zone, _) in zones.items()}, stop_pub_timeout=0.3)
        oracle = plain.PlainMonitor([zone | {"shape": shape} for zone, shape in zones.values()], 0.3)
        points = rng.normal(0.0, 1.0, (rng.integers(0, 40), 2))
        command = Velocity(*rng.uniform((-0.2, -0.1, -1.0), (0.8, 0.1, 1.0)))
        for k in range(12):
            if rng.random() < 0.3:
                points = rng.normal(0.0, 1.0, (rng.integers(0, 40), 2))
            verdict = found.judge(0.1 * k, command, points, 0.1 * k, FOOTPRINT)
            expected = oracle.process(0.1 * k, tuple(command), [complex(*p) for p in points.tolist()])
            if expected is None:
                assert verdict.command is None
                outcomes["silent"] += 1
                continue
            assert verdict.command == pytest.approx(expected, abs=1e-12)
            assert (verdict.zone != "") == (expected != pytest.approx(tuple(command)))
            outcomes["stopped" if expected == plain.REST else "slower" if verdict.zone else "as it came"] += 1
    assert min(outcomes.values()) > 80


def test_monitor_approaches_with_the_footprint_and_stops_without_a_scan() -> None:
    wall = np.column_stack((np.full(21, 1.0), np.linspace(-0.5, 0.5, 21)))
    approach = {"type": "polygon", "action_type": "approach", "time_before_collision": 2.0}
    one = monitor({"FootprintApproach": approach}, source_timeout=0.5)
    verdict = one.judge(0.0, Velocity(0.5, 0.0, 0.0), wall, 0.0, FOOTPRINT)
    assert verdict.zone == "FootprintApproach"
    assert verdict.command.v_x == pytest.approx(
        0.5 * 1.3 / 2.0, abs=0.03
    )  # 0.7 m left, reached in the step that begins at 1.3 s
    assert one.judge(0.0, Velocity(-0.5, 0.0, 0.0), wall, 0.0, FOOTPRINT).command.v_x == -0.5
    assert one.judge(1.0, Velocity(0.5, 0.0, 0.0), wall, 0.4, FOOTPRINT) == (REST, "invalid source")
    never = monitor({"FootprintApproach": approach}, source_timeout=0.0)
    assert never.judge(100.0, Velocity(-0.5, 0.0, 0.0), wall, 0.0, FOOTPRINT).command.v_x == -0.5
    off = monitor({"FootprintApproach": approach}, enabled=False)
    assert off.judge(0.0, Velocity(0.5, 0.0, 0.0), wall, 0.0, FOOTPRINT) == (Velocity(0.5, 0.0, 0.0), "")


def test_a_velocity_polygon_has_the_shape_that_fits_the_command() -> None:
    def shape(ahead: float) -> str:
        return f"[[{ahead}, 0.3], [{ahead}, -0.3], [-0.2, -0.3], [-0.2, 0.3]]"

    slow, fast = ({"points": shape(x), "theta_min": -1.0, "theta_max": 1.0} for x in (0.3, 1.2))
    zone = {
        "type": "velocity_polygon",
        "action_type": "stop",
        "velocity_polygons": ("slow", "fast"),
        "slow": slow | {"linear_min": 0.0, "linear_max": 0.3},
        "fast": fast | {"linear_min": 0.3, "linear_max": 1.0},
    }
    wall = np.column_stack((np.full(21, 1.0), np.linspace(-0.25, 0.25, 21)))
    for holonomic in (False, True):
        one = monitor({"Stop": zone | {"holonomic": holonomic}})
        told = wall, 0.0, FOOTPRINT
        assert one.judge(0.0, Velocity(0.2, 0.0, 0.0), *told).zone == ""
        assert one.judge(0.0, Velocity(0.5, 0.0, 0.0), *told).zone == "Stop"
        assert one.judge(0.0, Velocity(0.2, 0.0, 2.0), *told).zone == "Stop"  # fits neither: that of the last one
        sideways = one.judge(0.0, Velocity(0.0, 0.25, 0.0), *told)
        assert sideways.zone == ""
        assert (one.judge(0.0, Velocity(0.1, 0.5, 0.0), *told).zone == "Stop") == holonomic


def test_wrong_zones_and_sources_are_one_error() -> None:
    stop = {"type": "circle", "radius": 0.3, "action_type": "stop"}
    with pytest.raises(ClearwayError, match="a zone is one of polygon, circle, velocity_polygon"):
        monitor({"Stop": stop | {"type": "square"}})
    with pytest.raises(ClearwayError, match="not among the observation_sources"):
        monitor({"Stop": stop | {"sources_names": ("lidar",)}})
    with pytest.raises(ClearwayError, match="4 or more"):
        monitor(
            {"Stop": {"type": "polygon", "action_type": "stop", "points": "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]]"}}
        )
    with pytest.raises(ClearwayError, match="action_type"):
        monitor({"Stop": {"type": "circle", "radius": 0.3}})
    with pytest.raises(ClearwayError, match="twice"):
        monitor({"Stop": stop}, polygons=("Stop", "Stop"))

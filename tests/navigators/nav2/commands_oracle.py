"""A second, plain reading of Nav2's velocity smoother and collision monitor, step by step as their sources have it.

Read from nav2_velocity_smoother/src/velocity_smoother.cpp and nav2_collision_monitor/src; points and velocities in the
plane are complex numbers.
"""

from __future__ import annotations

import cmath
import math
from typing import Any

Twist = tuple[float, float, float]
REST = (0.0, 0.0, 0.0)


class PlainSmoother:
    """VelocitySmoother with three axes; parameters are a dict by their names."""

    def __init__(self, p: dict[str, Any]) -> None:
        self.p = p
        self.command: Twist | None = None
        self.heard = 0.0
        self.last, self.stopped = REST, True

    def eta(self, now: float, to: float, accel: float, decel: float) -> float:
        dv, f = to - now, self.p["smoothing_frequency"]
        speeding = abs(to) >= abs(now) and now * to >= 0.0
        high, low = (accel / f, -accel / f) if speeding else (-decel / f, decel / f)
        return high / dv if dv > high else low / dv if dv < low else -1.0

    def constrained(self, now: float, to: float, accel: float, decel: float, eta: float) -> float:
        f = self.p["smoothing_frequency"]
        speeding = abs(to) >= abs(now) and now * to >= 0.0
        high, low = (accel / f, -accel / f) if speeding else (-decel / f, decel / f)
        return now + min(max(eta * (to - now), low), high)

    def timer(self, now: float, measured: Twist) -> Twist | None:
        p = self.p
        if self.command is None:
            return None
        if now - self.heard > p["velocity_timeout"]:
            if self.last == REST or self.stopped:
                self.stopped = True
                return None
            self.command = REST
        self.stopped = False
        current = self.last if p["feedback"] == "OPEN_LOOP" else measured
        wanted = [min(max(v, p["min_velocity"][i]), p["max_velocity"][i]) for i, v in enumerate(self.command)]
        eta = 1.0
        if p["scale_velocities"]:
            for i in range(3):
                one = self.eta(current[i], wanted[i], p["max_accel"][i], p["max_decel"][i])
                if one > 0.0 and abs(1.0 - one) > abs(1.0 - eta):
                    eta = one
        out = [self.constrained(current[i], wanted[i], p["max_accel"][i], p["max_decel"][i], eta) for i in range(3)]
        self.last = tuple(out)
        return tuple(0.0 if abs(v) < p["deadband_velocity"][i] else v for i, v in enumerate(out))


def inside(at: complex, shape: list[complex] | float) -> bool:
    if isinstance(shape, float):
        return abs(at) ** 2 < shape**2
    crossings = 0
    for a, b in zip(shape[-1:] + shape[:-1], shape, strict=True):
        if (at.imag <= a.imag) == (at.imag > b.imag):
            crossings += a.real + (at.imag - a.imag) * (b.real - a.real) / (b.imag - a.imag) > at.real
    return crossings % 2 == 1


def collision_time(points: list[complex], shape: Any, least: int, v: Twist, ahead: float, step: float) -> float:
    if sum(inside(p, shape) for p in points) >= least:
        return 0.0
    at, yaw, speed, time = 0j, 0.0, complex(*v[:2]), 0.0
    while time <= ahead:
        at += speed * step
        yaw += v[2] * step
        speed *= cmath.rect(1.0, v[2] * step)
        if sum(inside((p - at) * cmath.rect(1.0, -yaw), shape) for p in points) >= least:
            return time
        time += step
    return -1.0


class PlainMonitor:
    """CollisionMonitor; a zone is a dict of its parameters with `shape` (corners, a radius, or None)."""

    def __init__(self, zones: list[dict[str, Any]], stop_pub_timeout: float) -> None:
        self.zones, self.timeout = zones, stop_pub_timeout
        self.before: Twist = (-1.0, -1.0, -1.0)
        self.stopped_at = 0.0
        for zone in zones:
            zone["state"] = [0, 0, False]

    def triggered(self, zone: dict[str, Any], count: int) -> bool:
        state = zone["state"]
        if count >= zone["min_points"]:
            state[0], state[1] = state[0] + 1, 0
            if state[0] >= zone["trigger_consecutive_points"]:
                state[2] = True
        else:
            state[1], state[0] = state[1] + 1, 0
            if state[1] >= zone["release_consecutive_points"]:
                state[2] = False
        return state[2]

    def process(self, now: float, v: Twist, points: list[complex]) -> Twist | None:
        wanted, stop = v, False
        for zone in self.zones:
            if stop:
                break
            shape, action = zone["shape"], zone["action_type"]
            if shape is None:
                continue
            if action == "approach":
                ahead = zone["time_before_collision"]
                time = collision_time(points, shape, zone["min_points"], v, ahead, zone["simulation_time_step"])
                ratio = time / ahead if time >= 0 else None
            elif not self.triggered(zone, sum(inside(p, shape) for p in points)):
                ratio = None
            elif action == "stop":
                wanted, stop, ratio = REST, True, None
            elif action == "slowdown":
                ratio = zone["slowdown_ratio"]
            else:
                ratio, speed = 1.0, math.hypot(*v[:2])
                if speed:
                    ratio = min(ratio, zone["linear_limit"] / speed)
                if v[2]:
                    ratio = min(ratio, zone["angular_limit"] / abs(v[2]))
            if ratio is not None:
                safe = tuple(ratio * x for x in v)
                if sum(x * x for x in safe) < sum(x * x for x in wanted):
                    wanted = safe
        said: Twist | None = wanted
        if wanted == REST:
            if self.before != REST:
                self.stopped_at = now
            elif now - self.stopped_at > self.timeout:
                said = None
        self.before = wanted
        return said

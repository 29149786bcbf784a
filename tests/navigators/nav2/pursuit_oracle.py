"""A second, plain reading of Nav2's regulated pure pursuit, step by step as its sources have it.

Read from nav2_regulated_pure_pursuit_controller/src and include, and nav2_util/src/controller_utils.cpp; parameters
are a dict by their names, frames are complex numbers.
"""

from __future__ import annotations

import cmath
import math
from itertools import pairwise
from typing import Any

import numpy as np


class Refused(Exception):
    pass


def cells_between(a: tuple[int, int], b: tuple[int, int]) -> list[tuple[int, int]]:
    """Bresenham's line of (column, row) with the error that line_iterator.hpp starts with."""
    dx, dy = abs(b[0] - a[0]), abs(b[1] - a[1])
    step = (1 if b[0] >= a[0] else -1, 1 if b[1] >= a[1] else -1)
    long, short = max(dx, dy), min(dx, dy)
    x, y, error, cells = *a, long // 2, []
    for _ in range(long + 1):
        cells.append((x, y))
        error += short
        aside = error >= long
        if aside:
            error -= long
        if dx >= dy:
            x, y = x + step[0], y + (step[1] if aside else 0)
        else:
            x, y = x + (step[0] if aside else 0), y + step[1]
    return cells


class PlainMap:
    """A costmap with worldToMap and FootprintCollisionChecker."""

    def __init__(self, cost: np.ndarray, origin: complex, resolution: float, tracks_unknown: bool) -> None:
        self.cost, self.origin, self.resolution, self.tracks = cost, origin, resolution, tracks_unknown

    def cell(self, at: complex) -> tuple[int, int] | None:
        off = (at - self.origin) / self.resolution
        if off.real < 0 or off.imag < 0 or off.real >= self.cost.shape[1] or off.imag >= self.cost.shape[0]:
            return None
        return int(off.real), int(off.imag)

    def footprint_cost(self, at: complex, yaw: float, outline: np.ndarray) -> int:
        corners = [self.cell(at + complex(*corner) * cmath.rect(1.0, yaw)) for corner in outline.tolist()]
        if None in corners:
            return 254
        highest = 0
        for k, corner in enumerate(corners[:-1]):
            line = [int(self.cost[c[1], c[0]]) for c in cells_between(corner, corners[k + 1])]
            highest = max(highest, 254 if 254 in line else max(line))
            if highest == 254:
                return 254
        line = [int(self.cost[c[1], c[0]]) for c in cells_between(corners[0], corners[-1])]
        return max(highest, 254 if 254 in line else max(line))

    def in_collision(self, at: complex, yaw: float, outline: np.ndarray) -> bool:
        if self.cell(at) is None:
            return False
        cost = self.footprint_cost(at, yaw, outline)
        return cost >= 254 and not (cost == 255 and self.tracks)


def look_ahead(distance: float, path: list[complex], beyond: bool) -> complex:
    along = 0.0
    for a, b in pairwise(path):
        step = abs(b - a)
        if along + step >= distance:
            return a + (b - a) * ((distance - along) / step) if step else a
        along += step
    if beyond:
        towards = path[-1] - path[-2]
        return path[-1] + cmath.rect(distance - along, cmath.phase(towards))
    return path[-1]


def curvature_of(at: complex) -> float:
    return 2.0 * at.imag / abs(at) ** 2 if abs(at) ** 2 > 0.001 else 0.0


def clamp(value: float, low: float, high: float) -> float:
    return low if value < low else high if value > high else value


def rotate(p: dict[str, Any], dt: float, angle: float, omega: float) -> float:
    sign = 1.0 if angle > 0 else -1.0
    a = p["max_angular_accel"]
    w = clamp(sign * p["rotate_to_heading_angular_vel"], omega - a * dt, omega + a * dt)
    most = math.sqrt(2 * a * abs(angle))
    return sign * most if abs(w) > most else w


def constrained(p: dict[str, Any], curvature: float, cost: int, inscribed: float, path: list[complex]) -> float:
    raw = p["max_linear_vel"]
    bend = near = raw
    if p["use_regulated_linear_velocity_scaling"] and curvature != 0.0:
        radius, least = abs(1.0 / curvature), p["regulated_linear_scaling_min_radius"]
        if radius < least:
            bend = raw * (1 - abs(radius - least) / least)
    if p["use_cost_regulated_linear_velocity_scaling"] and cost not in (0, 255):
        k = p["inflation_cost_scaling_factor"]
        distance = (k * inscribed - math.log(cost) + math.log(253.0)) / k
        if distance < p["cost_scaling_dist"]:
            near = raw * (p["cost_scaling_gain"] * distance / p["cost_scaling_dist"])
    v = max(min(near, bend), p["regulated_linear_scaling_min_speed"])
    left, within = sum(abs(b - a) for a, b in pairwise(path)), p["approach_velocity_scaling_dist"]
    slow = v * (abs(path[-1]) / within if left < within else 1.0)
    v = min(v, max(slow, p["min_approach_linear_velocity"]))
    return clamp(abs(v), 0.0, raw)


def dynamic_window(
    p: dict[str, Any], dt: float, last: tuple[float, float], v: float, bend: float, sign: float
) -> tuple[float, float]:
    bounds = []
    for now, kind in zip(last, ("linear", "angular"), strict=True):
        up, down = p[f"max_{kind}_accel"] * dt, p[f"max_{kind}_decel"] * dt
        high, low = (
            (now + up, now + down) if now > 1e-3 else (now - down, now - up) if now < -1e-3 else (now + up, now - up)
        )
        bounds += [max(low, p[f"min_{kind}_vel"]), min(high, p[f"max_{kind}_vel"])]
    v0, v1, w0, w1 = bounds
    v0, v1 = max(v0, min(0.0, v)), min(v1, max(0.0, v))
    if v0 > v1:
        v0, v1 = (v0, v0) if v0 > max(0.0, v) else (v1, v1)
    if abs(bend) < 1e-3:
        w = 0.0 if w0 <= 0 <= w1 else min((w0, w1), key=abs)
        return (v1 if sign >= 0 else v0), w
    on_line = [(v0, bend * v0), (v1, bend * v1), (w0 / bend, w0), (w1 / bend, w1)]
    inside = [c for c in on_line if v0 <= c[0] <= v1 and w0 <= c[1] <= w1]
    if inside:
        return max(inside, key=lambda c: c[0] * sign)
    gap, best = math.inf, (-math.inf * sign, 0.0)
    for corner in ((v0, w0), (v0, w1), (v1, w0), (v1, w1)):
        here = abs(bend * corner[0] - corner[1]) / math.hypot(bend, 1.0)
        if here < gap or (abs(here - gap) <= 1e-3 and corner[0] * sign > best[0] * sign):
            gap, best = here, corner
    return best


def collision_imminent(
    p: dict[str, Any],
    grid: PlainMap,
    outline: np.ndarray,
    pose: tuple[float, float, float],
    v: float,
    w: float,
    aim: float,
    left: float,
) -> bool:
    at, yaw = complex(*pose[:2]), pose[2]
    if grid.in_collision(at, yaw, outline):
        return True
    if abs(v) < 0.01 and abs(w) > 0.01:
        dt = 2 * math.sin(grid.resolution / 2 / max(abs(complex(*c)) for c in outline.tolist())) / abs(w)
    else:
        dt = grid.resolution / abs(v) if v else math.inf
    time, reach = p["max_allowed_time_to_collision_up_to_carrot"], aim
    least = p["min_distance_to_obstacle"]
    if least > 0:
        time = max(time, least / max(abs(v), p["min_approach_linear_velocity"]))
        if p["use_velocity_scaled_lookahead_dist"]:
            reach = min(
                max(aim, least if p["allow_obstacle_checking_beyond_goal"] else min(least, left)),
                p["max_lookahead_dist"],
            )
    start, i = at, 1
    while i * dt < time:
        i += 1
        at += dt * v * cmath.rect(1.0, yaw)
        yaw += dt * w
        if abs(at - start) > reach:
            break
        if grid.in_collision(at, yaw, outline):
            return True
    return False


def command(
    p: dict[str, Any],
    dt: float,
    pose: tuple[float, float, float],
    measured: tuple[float, float],
    last: tuple[float, float],
    path: list[tuple[float, float, float]],
    there: bool,
    cancelling: bool,
    grid: PlainMap,
    outline: np.ndarray,
    inscribed: float,
) -> tuple[float, float, bool]:
    """Speed, yaw rate, and whether cancelling is finished; raises `Refused` where the source throws."""
    base = [(complex(x, y) - complex(*pose[:2])) * cmath.rect(1.0, -pose[2]) for x, y, _ in path]
    distance = p["lookahead_dist"]
    if p["use_velocity_scaled_lookahead_dist"]:
        distance = clamp(abs(measured[0]) * p["lookahead_time"], p["min_lookahead_dist"], p["max_lookahead_dist"])
    carrot = turn_carrot = look_ahead(distance, base, False)
    if p["use_fixed_curvature_lookahead"]:
        turn_carrot = look_ahead(p["curvature_lookahead_dist"], base, p["interpolate_curvature_after_goal"])
    bend = curvature_of(turn_carrot)
    sign = -1.0 if p["allow_reversing"] and carrot.real < 0 else 1.0
    angle = cmath.phase(sign * turn_carrot)
    finished = False
    if there and p["use_rotate_to_heading"]:
        to_goal = path[-1][2] - pose[2]
        v, w = 0.0, rotate(p, dt, math.atan2(math.sin(to_goal), math.cos(to_goal)), measured[1])
    elif p["use_rotate_to_heading"] and abs(angle) > p["rotate_to_heading_min_angle"]:
        v, w = 0.0, rotate(p, dt, angle, measured[1])
    else:
        cell = grid.cell(complex(*pose[:2]))
        if cell is None:
            raise Refused("off")
        v = sign * constrained(p, bend, int(grid.cost[cell[1], cell[0]]), inscribed, base)
        if cancelling:
            v = measured[0] - sign * dt * p["cancel_deceleration"]
            if (sign > 0 and v <= 0) or (sign < 0 and v >= 0):
                v, finished = 0.0, True
        w = v * bend
        if p["use_dynamic_window"]:
            v, w = dynamic_window(p, dt, last, v, bend, sign)
    left = sum(abs(b - a) for a, b in pairwise(base))
    if p["use_collision_detection"] and collision_imminent(p, grid, outline, pose, v, w, abs(carrot), left):
        raise Refused("collision")
    return v, w, finished

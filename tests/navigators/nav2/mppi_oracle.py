"""A second, plain reading of the critics of nav2_mppi_controller: one sample after another, in doubles, from the C++ sources alone.

Slow, and written to be compared line by line with the sources that each function names. Arrays here are (samples, time
steps), as there.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LETHAL, INSCRIBED, NO_INFORMATION = 254, 253, 255


def normalized(angle: float) -> float:
    """angles::normalize_angle."""
    rest = math.fmod(angle + math.pi, 2.0 * math.pi)
    return rest + math.pi if rest <= 0.0 else rest - math.pi


def power(term: Array, p: int) -> Array:
    """What every critic does with its weighted term."""
    return term**p if p > 1 else term


def constraint(d: dict[str, Any], weight: float, p: int, vx_min: float, vx_max: float, vy_max: float) -> Array:
    """critics/constraint_critic.cpp."""
    excess = np.maximum(d["vx"] - vx_max, 0) + np.maximum(vx_min - d["vx"], 0)
    if d["model"] == "omni":
        excess += np.maximum(np.abs(d["vy"]) - vy_max, 0)
    if d["model"] == "ackermann":
        excess += np.maximum(d["radius"] - np.abs(d["vx"]) / np.maximum(np.abs(d["wz"]), 1e-6), 0)
    return power((excess * d["dt"]).sum(axis=1) * weight, p)


def prefer_forward(d: dict[str, Any], weight: float, p: int, threshold: float) -> Array:
    """critics/prefer_forward_critic.cpp."""
    if d["length"] < threshold:
        return np.zeros(len(d["vx"]))
    return power((np.maximum(-d["vx"], 0) * d["dt"]).sum(axis=1) * weight, p)


def twirling(d: dict[str, Any], weight: float, p: int) -> Array:
    """critics/twirling_critic.cpp."""
    if d["length"] < d["tolerance"]:
        return np.zeros(len(d["vx"]))
    return power(np.abs(d["wz"]).mean(axis=1) * weight, p)


def velocity_deadband(d: dict[str, Any], weight: float, p: int, deadband: tuple[float, float, float]) -> Array:
    """critics/velocity_deadband_critic.cpp."""
    short = np.maximum(abs(deadband[0]) - np.abs(d["vx"]), 0) + np.maximum(abs(deadband[2]) - np.abs(d["wz"]), 0)
    if d["model"] == "omni":
        short += np.maximum(abs(deadband[1]) - np.abs(d["vy"]), 0)
    return power((short * d["dt"]).sum(axis=1) * weight, p)


def goal(d: dict[str, Any], weight: float, p: int, threshold: float) -> Array:
    """critics/goal_critic.cpp."""
    if d["length"] > threshold:
        return np.zeros(len(d["x"]))
    x, y, _ = d["path"][-1]
    return power(np.sqrt((d["x"] - x) ** 2 + (d["y"] - y) ** 2).mean(axis=1) * weight, p)


def goal_angle(d: dict[str, Any], weight: float, p: int, threshold: float, symmetric: bool) -> Array:
    """critics/goal_angle_critic.cpp."""
    if d["length"] > threshold:
        return np.zeros(len(d["x"]))
    yaw = d["path"][-1][2]
    away = np.array([[abs(normalized(yaw - a)) for a in row] for row in d["yaw"]])
    if symmetric:
        other = np.array([[abs(normalized(yaw + math.pi - a)) for a in row] for row in d["yaw"]])
        away = np.minimum(away, other)
    return power(away.mean(axis=1) * weight, p)


def furthest(d: dict[str, Any]) -> int:
    """utils.hpp, findPathFurthestReachedPoint."""
    path = d["path"]
    along = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(path[:, 0]), np.diff(path[:, 1])))))
    best = 0
    for x, y in zip(d["x"], d["y"], strict=True):
        length = np.hypot(np.diff(x), np.diff(y)).sum()
        reach = next((i for i, a in enumerate(along) if a >= length), len(path))
        reach = min(reach, len(path) - 1)
        best = max(best, int(np.argmin((path[: reach + 1, 0] - x[-1]) ** 2 + (path[: reach + 1, 1] - y[-1]) ** 2)))
    return best


def world_to_map(d: dict[str, Any], x: Any, y: Any, kind: type = float) -> tuple[int, int] | None:
    """Costmap2D::worldToMap, or CostCritic's in floats."""
    ox, oy, resolution = kind(d["origin"][0]), kind(d["origin"][1]), kind(d["resolution"])
    x, y = kind(x), kind(y)
    if x < ox or y < oy:
        return None
    column, row = int((x - ox) / resolution), int((y - oy) / resolution)
    return (row, column) if row < d["cost"].shape[0] and column < d["cost"].shape[1] else None


def valid(d: dict[str, Any]) -> list[bool]:
    """utils.hpp, findPathCosts."""
    found = []
    for x, y, _ in d["path"][:-1]:
        cell = world_to_map(d, np.float32(x), np.float32(y))
        if cell is None:
            found.append(False)
            continue
        cost = int(d["cost"][cell])
        found.append({LETHAL: False, INSCRIBED: False, NO_INFORMATION: d["tracks_unknown"]}.get(cost, True))
    return found


def path_follow(d: dict[str, Any], weight: float, p: int, threshold: float, offset: int) -> Array:
    """critics/path_follow_critic.cpp."""
    none = np.zeros(len(d["x"]))
    if len(d["path"]) < 2 or d["length"] < threshold:
        return none
    size = len(d["path"]) - 1
    at, good, free = min(furthest(d) + offset, size), False, valid(d)
    while not good and at < size - 1:
        good = free[at]
        if not good:
            at += 1
    x, y, _ = d["path"][at]
    return power(np.hypot(d["x"][:, -1] - x, d["y"][:, -1] - y) * weight, p)


def path_angle(
    d: dict[str, Any], weight: float, p: int, threshold: float, offset: int, most: float, mode: int
) -> Array:
    """critics/path_angle_critic.cpp."""
    none = np.zeros(len(d["x"]))
    if d["length"] < threshold:
        return none
    x, y, yaw = d["path"][min(furthest(d) + offset, len(d["path"]) - 1)]
    px, py, pyaw = d["pose"]
    towards = math.atan2(y - py, x - px)
    if mode == 0:
        now = abs(normalized(pyaw - towards))
    elif mode == 1:
        now = min(abs(normalized(pyaw - towards)), abs(normalized(normalized(pyaw + math.pi) - towards)))
    else:
        if abs(normalized(yaw - towards)) > math.pi / 2:
            towards = normalized(towards + math.pi)
        now = abs(normalized(pyaw - towards))
    if now < most:
        return none
    term = []
    for ex, ey, last in zip(d["x"][:, -1], d["y"][:, -1], d["yaw"][:, -1], strict=True):
        between = math.atan2(y - ey, x - ex)
        if (mode == 1 and abs(normalized(between - last)) >= math.pi / 2) or (
            mode == 2 and abs(normalized(between - yaw)) >= math.pi / 2
        ):
            between = normalized(between + math.pi)
        term.append(abs(normalized(between - last)))
    return power(np.array(term) * weight, p)


def path_align(
    d: dict[str, Any], weight: float, p: int, threshold: float, offset: int, step: int, occupancy: float, with_yaw: bool
) -> Array:
    """critics/path_align_critic.cpp, and utils.hpp, findClosestPathPt."""
    costs = np.zeros(len(d["x"]))
    segments = 0 if d["length"] < threshold else furthest(d)
    if d["length"] < threshold or segments < offset or segments == 0:
        return costs
    free, blocked = valid(d), 0
    for i in range(segments):
        blocked += not free[i]
        if blocked / segments > occupancy and blocked > 2:
            return costs
    path = d["path"]
    along = [0.0]
    for i in range(1, segments):
        along.append(along[-1] + math.hypot(path[i][0] - path[i - 1][0], path[i][1] - path[i - 1][1]))
    for n in range(len(costs)):
        total, count, point, come = 0.0, 0, 0, 0.0
        for t in range(step, d["x"].shape[1], step):
            x, y = d["x"][n, t], d["y"][n, t]
            come += math.hypot(x - d["x"][n, t - step], y - d["y"][n, t - step])
            before = along[point] if point else 0.0
            for i in range(point + 1, segments):
                if along[i] > come:
                    point = i - 1 if come - before < along[i] - come else i
                    break
                before = along[i]
            else:
                point = segments - 1
            if free[point]:
                count += 1
                away = (path[point][0] - x) ** 2 + (path[point][1] - y) ** 2
                if with_yaw:
                    away += normalized(d["yaw"][n, t] - path[point][2]) ** 2
                total += math.sqrt(away)
        costs[n] = total / count if count else 0.0
    return power(costs * weight, p)


def line_cells(x0: int, y0: int, x1: int, y1: int) -> list[tuple[int, int]]:
    """nav2_util/line_iterator.hpp: cells (x, y)."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx, sy = (1 if x1 >= x0 else -1), (1 if y1 >= y0 else -1)
    long, short = max(dx, dy), min(dx, dy)
    cells, x, y, numerator = [], x0, y0, long // 2
    for _ in range(long + 1):
        cells.append((x, y))
        numerator += short
        aside = numerator >= long
        numerator -= long if aside else 0
        if dx >= dy:
            x, y = x + sx, y + (sy if aside else 0)
        else:
            x, y = x + (sx if aside else 0), y + sy
    return cells


def footprint_cost(d: dict[str, Any], x: float, y: float, yaw: float) -> int:
    """footprint_collision_checker.cpp, footprintCostAtPose."""
    c, s = math.cos(yaw), math.sin(yaw)
    corners = [world_to_map(d, x + (a * c - b * s), y + (a * s + b * c)) for a, b in d["footprint"]]

    def line(a: tuple[int, int], b: tuple[int, int]) -> int:
        worst = 0
        for column, row in line_cells(a[1], a[0], b[1], b[0]):
            cost = int(d["cost"][row, column])
            if cost == LETHAL:
                return LETHAL
            worst = max(worst, cost)
        return worst

    if corners[0] is None:
        return LETHAL
    worst = 0
    for a, b in pairwise(corners):
        if b is None:
            return LETHAL
        assert a is not None
        worst = max(line(a, b), worst)
        if worst == LETHAL:
            return worst
    assert corners[-1] is not None
    return max(line(corners[0], corners[-1]), worst)


def collides(d: dict[str, Any], cost: int, footprint: bool) -> bool:
    """Both critics' inCollision."""
    return {LETHAL: True, INSCRIBED: not footprint, NO_INFORMATION: not d["tracks_unknown"]}.get(cost, False)


def circumscribed_cost(d: dict[str, Any], looks_at_radius: bool) -> float:
    """findCircumscribedCost, and inflation_layer.hpp, computeCost."""
    if d["inflation"] == 0.0:
        return -1.0
    if looks_at_radius and d["inflation"] < d["circumscribed"]:
        return 0.0
    if d["circumscribed"] <= d["inscribed"]:
        return 253.0
    return float(int(252 * math.exp(-d["scaling"] * (d["circumscribed"] - d["inscribed"]))))


def cost(
    d: dict[str, Any],
    weight: float,
    p: int,
    footprint: bool,
    critical: float,
    near: int,
    crash: float,
    near_goal_distance: float,
    step: int,
) -> tuple[Array, bool]:
    """critics/cost_critic.cpp: costs, and whether all collide."""
    possible, near_goal = circumscribed_cost(d, True), d["length"] < near_goal_distance
    costs, all_collide = np.zeros(len(d["x"])), True
    for n in range(len(costs)):
        hit = False
        for t in range(0, d["x"].shape[1], step):
            x, y, yaw = float(d["x"][n, t]), float(d["y"][n, t]), float(d["yaw"][n, t])
            cell = world_to_map(d, x, y, np.float32)
            here = NO_INFORMATION if cell is None else int(d["cost"][cell])
            if here < 1:
                continue
            under = here
            if footprint and (here >= possible or possible < 1.0):
                under = footprint_cost(d, x, y, yaw)
            if collides(d, under, footprint):
                costs[n], hit = crash, True
                break
            if here >= near:
                costs[n] += critical
            elif not near_goal:
                costs[n] += here
        all_collide &= hit
    points = (d["x"].shape[1] - 1) // step + 1
    return power(costs * (weight / 254.0 / points), p), all_collide


def obstacles(
    d: dict[str, Any],
    p: int,
    footprint: bool,
    repulsion: float,
    critical: float,
    crash: float,
    margin: float,
    near_goal_distance: float,
) -> tuple[Array, bool]:
    """critics/obstacles_critic.cpp: costs, and whether all collide."""
    possible, near_goal = circumscribed_cost(d, False), d["length"] < near_goal_distance
    raw, repulsive, all_collide = np.zeros(len(d["x"])), np.zeros(len(d["x"])), True
    for n in range(len(raw)):
        hit = False
        for t in range(d["x"].shape[1]):
            x, y, yaw = float(d["x"][n, t]), float(d["y"][n, t]), float(d["yaw"][n, t])
            cell = world_to_map(d, x, y)
            here, outlined = (NO_INFORMATION, False) if cell is None else (int(d["cost"][cell]), False)
            if cell is not None and footprint and (here >= possible or possible < 1.0):
                here, outlined = footprint_cost(d, x, y, yaw), True
            if here < 1:
                continue
            if collides(d, here, footprint):
                hit = True
                break
            if d["inflation"] == 0.0 or d["scaling"] == 0.0:
                continue
            away = (d["scaling"] * d["inscribed"] - math.log(here) + math.log(253.0)) / d["scaling"]
            if not outlined:
                away -= d["inscribed"]
            if away < margin:
                raw[n] += margin - away
            if not near_goal:
                repulsive[n] += d["inflation"] - away
        if hit:
            raw[n] = crash
        all_collide &= hit
    share = (repulsive - repulsive.min()) / d["x"].shape[1]
    return power(critical * raw + repulsion * share, p), all_collide

"""A second, slow, plain reading of ROS's local planners, to check the compiled ones against."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import numpy as np


def world_to_cell(x, y, origin, resolution, shape):
    if x < origin[0] or y < origin[1]:
        return None
    col, row = int((x - origin[0]) / resolution), int((y - origin[1]) / resolution)
    return (row, col) if row < shape[0] and col < shape[1] else None


def line(a, b):
    """Cells of the rasterised line: the minor coordinate after i steps is floor((major // 2 + i * minor) / major)."""
    (r0, c0), (r1, c1) = a, b
    dr, dc = abs(r1 - r0), abs(c1 - c0)
    sr, sc = (1 if r1 >= r0 else -1), (1 if c1 >= c0 else -1)
    major, minor = max(dr, dc), min(dr, dc)
    cells = []
    for i in range(major + 1):
        off = (major // 2 + i * minor) // major if major else 0
        cells.append((r0 + sr * off, c0 + sc * i) if dc >= dr else (r0 + sr * i, c0 + sc * off))
    return cells


def outline_cells(pose, polygon, scale, origin, resolution, shape):
    """All cells of the outline, None if a corner is off the map."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    corners = []
    for px, py in polygon * scale:
        corner = world_to_cell(pose[0] + px * c - py * s, pose[1] + px * s + py * c, origin, resolution, shape)
        if corner is None:
            return None
        corners.append(corner)
    return [cell for a, b in zip(corners, corners[1:] + corners[:1], strict=True) for cell in line(a, b)]


def footprint_cost(pose, polygon, scale, cost, origin, resolution):
    """Highest cost on the outline, -1 if any is lethal or unknown or off the map."""
    if world_to_cell(pose[0], pose[1], origin, resolution, cost.shape) is None:
        return -1
    cells = outline_cells(pose, polygon, scale, origin, resolution, cost.shape)
    if cells is None:
        return -1
    worst = max(int(cost[cell]) for cell in cells)
    return -1 if worst >= 254 else worst


def plan_cells(plan, cost, origin, resolution):
    """Cells of the densified plan from where it enters the known map to where it leaves it."""
    dense = [plan[0]]
    for a, b in pairwise(plan):
        d = math.hypot(b[0] - a[0], b[1] - a[1])
        steps = math.ceil(d / resolution) if d > resolution else 1
        dense += [(a[0] + j * (b[0] - a[0]) / steps, a[1] + j * (b[1] - a[1]) / steps) for j in range(1, steps)] + [b]
    out = []
    for x, y in (q[:2] for q in dense):
        cell = world_to_cell(x, y, origin, resolution, cost.shape)
        if cell is not None and cost[cell] != 255:
            out.append(cell)
        elif out:
            break
    return out


def distances(cost, targets, free=()):
    """Breadth-first distances: N at a blocked cell that was touched, N + 1 where nothing came."""
    rows, cols = cost.shape
    grid = np.full(cost.shape, rows * cols + 1)
    seen = np.zeros(cost.shape, bool)
    queue = deque()
    for cell in targets:
        if not seen[cell]:
            grid[cell], seen[cell] = 0, True
            queue.append(cell)
    while queue:
        r, c = queue.popleft()
        for q in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
            if 0 <= q[0] < rows and 0 <= q[1] < cols and not seen[q]:
                seen[q] = True
                if cost[q] >= 253 and q not in free:
                    grid[q] = rows * cols
                else:
                    grid[q] = grid[r, c] + 1
                    queue.append(q)
    return grid


def robot_cells(pose, polygon, origin, resolution, shape):
    """Outline and inside, column by column."""
    cells = outline_cells(pose, polygon, 1.0, origin, resolution, shape) or []
    spans = {}
    for r, c in cells:
        low, high = spans.get(c, (r, r))
        spans[c] = (min(low, r), max(high, r))
    return {(r, c) for c, (low, high) in spans.items() for r in range(low, high + 1)}


def speeds(low, high, count):
    if low == high:
        return [low]
    values = list(np.linspace(low, high, max(2, count)))
    if low < 0 < high and not any(abs(v) < 1e-12 for v in values):
        values.append(0.0)
    return sorted(values)


def dwa_rollout(p, pose, v, w):
    """Points (x, y, yaw) of a sample at constant speeds; empty where the generator refuses it."""
    if abs(v) + 1e-4 < p.min_vel_trans and abs(w) + 1e-4 < p.min_vel_theta:
        return []
    if abs(v) - 1e-4 > p.max_vel_trans:
        return []
    n = math.ceil(max(abs(v) * p.sim_time / p.sim_granularity, abs(w) * p.sim_time / p.angular_sim_granularity))
    x, y, yaw = pose
    points = []
    for _ in range(n):
        points.append((x, y, yaw))
        dt = p.sim_time / n
        x, y, yaw = x + v * math.cos(yaw) * dt, y + v * math.sin(yaw) * dt, yaw + w * dt
    return points


def dwa_scores(p, period, pose, velocity, plan, cost, origin, resolution, polygon):
    """{(v, w): cost} of all legal samples, each critic in turn, in the sampler's order."""
    goal = plan[-1]
    far = math.hypot(goal[0] - pose[0], goal[1] - pose[1]) > p.forward_point_distance * math.sqrt(p.cheat_factor)
    towards = math.atan2(goal[1] - pose[1], goal[0] - pose[0])
    nose_plan = np.array(plan)
    nose_plan[-1, 0] += p.forward_point_distance * math.cos(towards)
    nose_plan[-1, 1] += p.forward_point_distance * math.sin(towards)
    cells = plan_cells(plan, cost, origin, resolution)
    path = distances(cost, cells)
    local = distances(cost, cells[-1:])
    front = distances(cost, plan_cells(nose_plan, cost, origin, resolution)[-1:])
    n = cost.size
    out = {}
    low_v, high_v = (
        max(p.min_vel_x, velocity[0] - p.acc_lim_x * period),
        min(p.max_vel_x, velocity[0] + p.acc_lim_x * period),
    )
    reach = p.acc_lim_theta * period
    low_w, high_w = max(-p.max_vel_theta, velocity[1] - reach), min(p.max_vel_theta, velocity[1] + reach)
    for v in speeds(low_v, high_v, p.vx_samples):
        for w in speeds(low_w, high_w, p.vth_samples):
            points = dwa_rollout(p, pose, v, w)
            if not points:
                continue
            scale = 1.0
            if abs(v) > p.scaling_speed:
                scale += p.max_scaling_factor * (abs(v) - p.scaling_speed) / (p.max_vel_trans - p.scaling_speed)
            occ, legal = 0, True
            for q in points:
                here = footprint_cost(q, polygon, scale, cost, origin, resolution)
                cell = world_to_cell(q[0], q[1], origin, resolution, cost.shape)
                nose = world_to_cell(
                    q[0] + p.forward_point_distance * math.cos(q[2]),
                    q[1] + p.forward_point_distance * math.sin(q[2]),
                    origin, resolution, cost.shape,
                )  # fmt: skip
                if here < 0 or cell is None or nose is None or path[cell] >= n or local[cell] >= n:
                    legal = False
                    break
                occ = max(occ, here, int(cost[cell]))
            if legal:
                out[v, w] = p.occdist_scale * occ + resolution * (
                    p.goal_distance_bias * (front[nose] + local[cell])
                    + p.path_distance_bias * (path[cell] + (path[nose] if far else 0))
                )
    return out

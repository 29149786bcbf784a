"""Rolling one velocity sample out, and what the rollout costs where obstacles are: common to both local planners."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Scene, footprint_cost, row_col


@kernel
def approach(target: float, now: float, acceleration: float, dt: float) -> float:
    """The speed after `dt` seconds of accelerating from `now` towards `target`."""
    if target >= now:
        return min(target, now + acceleration * dt)
    return max(target, now - acceleration * dt)


@kernel
def roll(
    pose: FloatArray,
    v_now: float,
    w_now: float,
    v: float,
    w: float,
    acc_v: float,
    acc_w: float,
    dt: float,
    steps: int,
    out: FloatArray,
    u_now: float = 0.0,
    u: float = 0.0,
    acc_u: float = 0.0,
) -> None:
    """Roll a sample (v, w), and u to the left, out with Euler steps, from the current speeds at the given accelerations.

    Each step moves along the heading at its beginning, as simple_trajectory_generator.cpp and
    trajectory_planner.cpp do. The first point is the pose itself; the last one lies a step before the horizon.

    Args:
        pose: (3,) where it begins.
        out: (>= steps, 5) filled with x, y, yaw, cosine, sine.
    """
    x, y, yaw = pose[0], pose[1], pose[2]
    c, s = math.cos(yaw), math.sin(yaw)
    turn_c, turn_s = 1.0, 0.0
    turned_at = 0.0
    for i in range(steps):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = x, y, yaw, c, s
        v_now = approach(v, v_now, acc_v, dt)
        w_now = approach(w, w_now, acc_w, dt)
        x += v_now * c * dt
        y += v_now * s * dt
        if u_now != 0.0 or u != 0.0:
            u_now = approach(u, u_now, acc_u, dt)
            x -= u_now * s * dt
            y += u_now * c * dt
        if w_now != 0.0:
            if w_now != turned_at:  # at a constant rate, a turn by the same angle: no cosine per step
                turned_at = w_now
                turn_c, turn_s = math.cos(w_now * dt), math.sin(w_now * dt)
            c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
            yaw += w_now * dt


@kernel
def occlusion(scene: Scene, points: FloatArray, steps: int, scale: float, total: bool, bound: float) -> float:
    """The highest cost (or, if `total`, the sum) under outline and centre along a rollout; -1 where it is illegal.

    One illegal point is enough, and costs only add up or rise, so the order is free: every eighth point from the far
    end first, where a rollout is likeliest to hit something, then the others. A rollout that passes `bound` can't win
    any more and is left there, with what it had by then.
    """
    cost, frame, polygon = scene.cost, scene.frame, scene.polygon
    worst = 0.0
    for offset in range(1, 9):
        for i in range(steps - offset, -1, -8):
            x, y = points[i, 0], points[i, 1]
            here = footprint_cost(cost, frame, polygon, x, y, points[i, 3], points[i, 4], scale)
            if here < 0:
                return -1.0
            row, col = row_col(frame, x, y)
            both = float(max(here, int(np.int64(cost[row, col]))))
            worst = worst + both if total else max(worst, both)
            if worst > bound:
                return worst
    return worst

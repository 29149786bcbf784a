"""Discs that stand and discs whose whole future is known, for compiled code: where they are and what a point meets."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


class Scene(NamedTuple):
    """What compiled code needs to know of the discs.

    Attributes:
        static: (n, 3) x, y, radius, m.
        moving: (T, m, 2) centres every `dt`, m; NaN: absent.
        radii: (m,) their radii, m.
        speed: (m,) the most that each ever does, m/s.
        dt: Time from a sample of `moving` to the next, s.
        area: (4,) x_min, y_min, x_max, y_max, m.
        goal: (3,) x, y, radius, m.
        v: Top speed of the point that moves among them, m/s.
    """

    static: FloatArray
    moving: FloatArray
    radii: FloatArray
    speed: FloatArray
    dt: float
    area: FloatArray
    goal: FloatArray
    v: float


@kernel
def centre(scene: Scene, disc: int, t: float) -> tuple[float, float, float, float, float]:
    """Where a disc is at time t, its velocity (after a kink: the new one) and its radius. NaN where it is absent."""
    n = scene.static.shape[0]
    if disc < n:
        return scene.static[disc, 0], scene.static[disc, 1], 0.0, 0.0, scene.static[disc, 2]
    j = disc - n
    k = min(max(math.floor(t / scene.dt + 1e-9), 0), scene.moving.shape[0] - 2)
    ux = (scene.moving[k + 1, j, 0] - scene.moving[k, j, 0]) / scene.dt
    uy = (scene.moving[k + 1, j, 1] - scene.moving[k, j, 1]) / scene.dt
    s = t - k * scene.dt
    return scene.moving[k, j, 0] + ux * s, scene.moving[k, j, 1] + uy * s, ux, uy, scene.radii[j]


@kernel
def clear(scene: Scene, points: FloatArray) -> bool:
    """Whether the way (k, 3) t, x, y, straight between its points, keeps out of all discs, between points too; NaN: no."""
    for k in range(points.shape[0] - 1):
        if math.isnan(points[k + 1, 1] + points[k + 1, 2]):
            return False
        duration = points[k + 1, 0] - points[k, 0]
        if duration > 0.0:
            vx, vy = (points[k + 1, 1] - points[k, 1]) / duration, (points[k + 1, 2] - points[k, 2]) / duration
            hit, _ = first_hit(scene, points[k, 1], points[k, 2], points[k, 0], vx, vy, duration, -1, 0.0)
            if hit >= 0:
                return False
    return True


@kernel
def first_hit(
    scene: Scene, x: float, y: float, t: float, vx: float, vy: float, duration: float, own: int, skin: float
) -> tuple[int, float]:
    """What a point first comes within R + skin of that moves from (x, y) at time t with (vx, vy) for `duration` [s].

    `own` is the disc whose edge it leaves: for that one the skin is halved, so that rounding is no contact.

    Returns:
        The disc (static ones first; -1: none) and after how long, s.
    """
    found, best = -1, duration
    n = scene.static.shape[0]
    speed2 = vx * vx + vy * vy
    for i in range(n):
        r = scene.static[i, 2] + (0.5 * skin if i == own else skin)
        wx, wy = x - scene.static[i, 0], y - scene.static[i, 1]
        s = enter(wx, wy, vx, vy, speed2, r)
        if s <= best and s < math.inf:
            found, best = i, s
    own_speed = math.sqrt(speed2)
    last = scene.moving.shape[0] - 1
    for j in range(scene.radii.shape[0]):
        r = scene.radii[j] + (0.5 * skin if n + j == own else skin)
        s = 0.0
        closing = own_speed + scene.speed[j]
        while s < best:
            k = math.floor((t + s) / scene.dt + 1e-9)
            if k >= last:
                break
            end = (k + 1) * scene.dt - t
            ax, ay = scene.moving[k, j, 0], scene.moving[k, j, 1]
            ux, uy = (scene.moving[k + 1, j, 0] - ax) / scene.dt, (scene.moving[k + 1, j, 1] - ay) / scene.dt
            if math.isnan(ux):
                s = end
                continue
            ago = t + s - k * scene.dt
            wx, wy = x + vx * s - ax - ux * ago, y + vy * s - ay - uy * ago
            free = (math.sqrt(wx * wx + wy * wy) - r) / max(closing, 1e-12)
            if free > end - s and closing < math.inf:
                s += free * (1.0 - 1e-12)
                continue
            rx, ry = vx - ux, vy - uy
            into = enter(wx, wy, rx, ry, rx * rx + ry * ry, r)
            if s + into <= end:
                if s + into <= best:
                    found, best = n + j, s + into
                break
            s = end
    return found, best


@kernel
def enter(wx: float, wy: float, vx: float, vy: float, speed2: float, r: float) -> float:
    """When a point at w with velocity v enters the circle of radius r around 0: 0 if it is inside and goes on inwards."""
    b, c = wx * vx + wy * vy, wx * wx + wy * wy - r * r
    if b >= 0.0 or speed2 == 0.0:
        return 0.0 if c < -1e-9 else math.inf
    if c <= 0.0:
        return 0.0
    root = b * b - speed2 * c
    if root <= 0.0:
        return math.inf
    return c / (-b + math.sqrt(root))

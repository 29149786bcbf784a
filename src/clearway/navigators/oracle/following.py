"""Drives a differential-drive base along a way through space and time, and foresees what will come of it."""

from __future__ import annotations

import math

import numpy as np

from clearway.clairvoyant.moving_discs import Scene, centre
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.robots.drive_limits import DriveLimits

AHEAD = 0.35
"""The base aims at where the way will be after this, s."""

_PAUSE = 0.05
"""Below this speed, m/s, the way counts as waiting: the base turns to where it goes on."""


@kernel
def on_way(way: FloatArray, t: float) -> tuple[float, float]:
    """Where a way (k, 3) t, x, y is at time t [s]: straight between its points, at rest before and after."""
    low, high = 0, way.shape[0] - 1
    if t >= way[high, 0]:
        return way[high, 1], way[high, 2]
    while high - low > 1:
        middle = (low + high) // 2
        if way[middle, 0] <= t:
            low = middle
        else:
            high = middle
    span = way[high, 0] - way[low, 0]
    s = min(max((t - way[low, 0]) / span, 0.0), 1.0) if span > 0.0 else 1.0
    return way[low, 1] + s * (way[high, 1] - way[low, 1]), way[low, 2] + s * (way[high, 2] - way[low, 2])


@kernel
def steer(
    way: FloatArray, t: float, x: float, y: float, theta: float, limits: DriveLimits, period: float
) -> tuple[float, float]:
    """The command (v, omega) at time t [s] that brings a base at (x, y, theta) to where the way soon will be.

    Args:
        limits: What the base can do.
        period: Control period, s.
    """
    gx, gy = on_way(way, t + AHEAD)
    gx, gy = gx - x, gy - y
    speed = math.hypot(gx, gy) / AHEAD
    turn = 0.0
    if speed > _PAUSE:
        turn = wrap(math.atan2(gy, gx) - theta)
    else:  # look farther, to face the right way when it goes on
        for k in range(2, 12):
            fx, fy = on_way(way, t + AHEAD * k)
            if math.hypot(fx - x, fy - y) > 2.0 * _PAUSE:
                turn = wrap(math.atan2(fy - y, fx - x) - theta)
                break
    omega = min(max(turn / max(1.5 * period, 0.1), -limits.omega_max), limits.omega_max)
    v = min(max(speed * math.cos(turn), 0.0), limits.v_max) if abs(turn) < 0.5 * math.pi else 0.0
    return v, omega


@kernel
def foresee(
    scene: Scene, way: FloatArray, t: float, pose: FloatArray, limits: DriveLimits, period: float, duration: float,
    first: FloatArray, hold: float,
) -> tuple[float, float]:  # fmt: skip
    """How close an undisturbed base comes to the discs' edges in `duration` [s], and when it first is within one.

    It follows the way; for the first `hold` [s] it drives `first` (2,) v, omega instead.

    Returns:
        The least clearance, m (negative: within an edge), and the time to the first contact, s (`duration`: none).
    """
    x, y, theta = pose[0], pose[1], pose[2]
    n = scene.static.shape[0] + scene.radii.shape[0]
    pieces = 3
    h = period / pieces
    least, contact, gone = math.inf, duration, 0.0
    while gone < duration:
        v, omega = (first[0], first[1]) if gone < hold else steer(way, t + gone, x, y, theta, limits, period)
        for _ in range(pieces):
            x, y, theta = arc(x, y, theta, v, omega, h)
            gone += h
            for disc in range(n):
                cx, cy, _, _, radius = centre(scene, disc, t + gone)
                gap = math.hypot(x - cx, y - cy) - radius
                if gap < least:  # never, where the disc is absent
                    least = gap
                if gap < 0.0 and gone < contact:
                    contact = gone
    return least, contact


@kernel
def evade(
    scene: Scene, way: FloatArray, t: float, pose: FloatArray, limits: DriveLimits, period: float
) -> tuple[float, float]:  # fmt: skip
    """The command that keeps contact off longest, then clearance largest, if it is held for a while before the way is
    taken up again: the last resort."""
    best_v, best_omega, best_contact, best_gap = 0.0, 0.0, -1.0, -math.inf
    first = np.empty(2)
    for i in range(-2, 5):
        first[0] = max(limits.v_max * 0.25 * i, limits.v_min)
        for j in range(-3, 4):
            first[1] = limits.omega_max * j / 3.0
            for k in range(2):
                gap, contact = foresee(scene, way, t, pose, limits, period, 2.5, first, 0.3 + 0.5 * k)
                if contact > best_contact + 1e-9 or (contact > best_contact - 1e-9 and gap > best_gap):
                    best_v, best_omega, best_contact, best_gap = first[0], first[1], contact, gap
    return best_v, best_omega

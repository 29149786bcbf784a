"""Sliding along the edge of a disc that moves, at full speed: how fast, how far, and which way it leads."""

from __future__ import annotations

import math

import numpy as np

from clearway.clairvoyant.moving_discs import Scene, centre, first_hit
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SKIN = 2e-4
"""How far outside a disc's edge the point slides, m."""

STEP = 0.004
"""Of the integration along an edge, s."""


@kernel
def slide(scene: Scene, disc: int, side: int, t: float, phi: float) -> tuple[float, float, float]:
    """How a point slides along an edge at full speed: d phi / dt, and its direction. NaN: the disc is faster."""
    _, _, ux, uy, radius = centre(scene, disc, t)
    nx, ny = math.cos(phi), math.sin(phi)
    along = ux * nx + uy * ny
    rest = scene.v * scene.v - along * along
    if not rest > 0.0:
        return math.nan, 0.0, 0.0
    root = side * math.sqrt(rest)
    dx, dy = along * nx - root * ny, along * ny + root * nx
    return (root - (uy * nx - ux * ny)) / (radius + SKIN), dx / scene.v, dy / scene.v


@kernel
def onward(scene: Scene, disc: int, side: int, t: float, phi: float, until: float) -> float:
    """phi at `until`, sliding on from (t, phi): midpoint steps that end at the kinks of the disc's motion."""
    moving = disc >= scene.static.shape[0]
    while t < until - 1e-12:
        h = min(until - t, STEP)
        if moving:
            kink = (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt
            h = min(h, kink - t)
        rate, _, _ = slide(scene, disc, side, t, phi)
        rate, _, _ = slide(scene, disc, side, t, phi + 0.5 * h * rate)
        phi += h * rate
        t += h
    return phi


@kernel
def edge(scene: Scene, disc: int, side: int, t: float, phi: float, until: float) -> FloatArray:
    """The way along an edge as points (k, 3) t, x, y."""
    n = math.ceil(max(until - t, 0.0) / STEP - 1e-9) + 1
    kinks = int((until - t) / scene.dt) + 2
    points = np.empty((n + kinks, 3))
    k = 0
    while True:
        x, y, _, _, radius = centre(scene, disc, t)
        points[k, 0] = t
        points[k, 1] = x + (radius + SKIN) * math.cos(phi)
        points[k, 2] = y + (radius + SKIN) * math.sin(phi)
        k += 1
        if t >= until - 1e-12 or k >= points.shape[0]:
            break
        after = min(t + STEP, until)
        if disc >= scene.static.shape[0]:
            after = min(after, (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt)
        phi = onward(scene, disc, side, t, phi, after)
        if math.isnan(phi):
            break  # the disc is faster from `until` on, by rounding a moment sooner: so it leaves then
        t = after
    return points[:k]


@kernel
def follow(scene: Scene, disc: int, side: int, t: float, phi: float, limit: float) -> FloatArray:
    """Samples (k, 3) t, phi, angle of the leaving ray, as long as sliding on is possible and may be worth while.

    At a kink of the disc's motion away from the point, rays leave in all directions between those before and after.
    """
    out = np.empty((2000, 3))
    k, fine = 0, 5.0 * STEP
    moving = disc >= scene.static.shape[0]
    began = phi
    before = math.nan
    while k < out.shape[0] - 12:
        x, y, _, _, radius = centre(scene, disc, t)
        px, py = x + (radius + SKIN) * math.cos(phi), y + (radius + SKIN) * math.sin(phi)
        if math.isnan(px) or not (scene.area[0] <= px <= scene.area[2] and scene.area[1] <= py <= scene.area[3]):
            break
        far = math.hypot(scene.goal[0] - px, scene.goal[1] - py) - scene.goal[2]
        if t + far / scene.v >= limit or abs(phi - began) > math.tau:
            break
        if moving and t >= (scene.moving.shape[0] - 1) * scene.dt - 1e-9:
            break
        hit, _ = first_hit(scene, px, py, t, 0.0, 0.0, 1e-12, disc, 0.0)
        rate, dx, dy = slide(scene, disc, side, t, phi)
        if (hit >= 0 and hit != disc) or math.isnan(rate):
            break
        angle = math.atan2(dy, dx)
        if not math.isnan(before):
            turn = wrap(angle - before)
            angle = before + turn
            if turn * side > 0.0:  # towards the disc
                pieces = min(int(abs(turn) / 0.01), 8)
                for i in range(pieces):
                    out[k] = t, phi, before + turn * i / pieces
                    k += 1
        out[k] = t, phi, angle
        k += 1
        step = fine
        kink = (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt if moving else math.inf
        while True:  # short steps where the direction turns fast: where a fast disc's rear goes by
            after = min(t + step, kink)
            later = onward(scene, disc, side, t, phi, after)
            before, lost = angle, False
            if moving:  # the direction just before the kink
                rate, dx, dy = slide(scene, disc, side, max(after - 1e-7, t), later)
                lost = math.isnan(rate) or math.isnan(later)
                before = angle + wrap(math.atan2(dy, dx) - angle)
            if step < 1e-6 or not (lost or abs(before - angle) > 0.03):
                break
            step *= 0.5
        if lost:
            break
        phi = later
        if moving:
            out[k] = max(after - 1e-7, t), phi, before
            k += 1
        t = after
    return out[:k]

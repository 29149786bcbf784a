"""Ways of a point that has time to spare: it waits for a fast disc to pass, and goes through where that has just been."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.clairvoyant.disc_edges import SKIN
from clearway.clairvoyant.moving_discs import Scene, centre, clear, first_hit
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

RELEASE_STEP = 0.01
"""Between releases that are tried, s."""


@kernel
def release_angle(ux: float, uy: float, v: float, branch: int) -> float:
    """Where on a disc with velocity u its edge recedes from a point just at the speed v; NaN where it never does."""
    speed = math.hypot(ux, uy)
    if not speed > v:
        return math.nan
    return math.atan2(-uy, -ux) + 0.5 * branch * math.acos(v / speed)


@kernel
def releases(scene: Scene, x: float, y: float, t: float, limit: float, done: npt.NDArray[np.uint8]) -> FloatArray:
    """Rays that follow a fast disc through the place that it has just left, for a point that waits for that.

    Where the costate is zero before a contact (the point has time to spare), it is normal to the edge after it: the
    point goes straight at full speed to where the disc was, and just touches an edge that recedes at that same speed.
    `done` (m, 2, T) marks the times at which that has been reached already, whatever the way.

    Returns:
        (k, 7) t, phi, angle of the ray, disc, branch (2, -2), number of its stretch without a gap, promised arrival.
    """
    out = np.empty((4096, 7))
    count, stretch = 0, 0
    for j in range(scene.radii.shape[0]):
        if not scene.speed[j] > scene.v:
            continue
        disc = scene.static.shape[0] + j
        for side in range(2):
            branch = 2 - 4 * side
            last = -9
            for k in range(math.ceil(t / RELEASE_STEP), done.shape[2] - 1):
                when = k * RELEASE_STEP
                if when >= limit or count >= out.shape[0]:
                    break
                if done[j, side, k]:
                    continue
                cx, cy, ux, uy, radius = centre(scene, disc, when)
                phi = release_angle(ux, uy, scene.v, branch)
                if math.isnan(phi) or math.isnan(cx):
                    continue
                px, py = cx + (radius + SKIN) * math.cos(phi), cy + (radius + SKIN) * math.sin(phi)
                promise = when + (math.hypot(px - scene.goal[0], py - scene.goal[1]) - scene.goal[2]) / scene.v
                if promise >= limit or math.hypot(px - x, py - y) > scene.v * (when - t):
                    continue
                if not (scene.area[0] <= px <= scene.area[2] and scene.area[1] <= py <= scene.area[3]):
                    continue
                found, _ = approach(scene, x, y, t, disc, branch, when)
                if not found:
                    continue
                done[j, side, k] = 1
                if k != last + 1:
                    stretch += 1
                last = k
                out[count, 0], out[count, 1], out[count, 2] = when, phi, phi + math.pi
                out[count, 3], out[count, 4], out[count, 5], out[count, 6] = disc, branch, stretch, promise
                count += 1
    return out[:count]


@kernel
def approach(
    scene: Scene, x: float, y: float, t: float, disc: int, branch: int, when: float
) -> tuple[bool, FloatArray]:
    """A clear way from (x, y) at time t to the release at `when`: slowly, or after a wait, or with a wait on the way."""
    cx, cy, ux, uy, radius = centre(scene, disc, when)
    phi = release_angle(ux, uy, scene.v, branch)
    nx, ny = math.cos(phi), math.sin(phi)
    points = np.empty((4, 3))
    points[0] = t, x, y
    points[3] = when, cx + (radius + SKIN) * nx, cy + (radius + SKIN) * ny
    for run_up in (0.05, 0.15, 0.4, 1.0, 2.0):
        begin = when - run_up
        px, py = points[3, 1] + scene.v * run_up * nx, points[3, 2] + scene.v * run_up * ny
        needs = math.hypot(px - x, py - y) / scene.v
        if begin - t < needs:
            continue
        hit, _ = first_hit(scene, px, py, begin, -scene.v * nx, -scene.v * ny, run_up, disc, SKIN)
        if hit >= 0:
            continue
        points[2] = begin, px, py
        for middle in range(3):
            points[1] = points[0]
            if middle == 1:
                points[1, 0] = begin - needs
            elif middle == 2:
                points[1] = t + needs, px, py
            if clear(scene, points[:3]):
                return True, points
    return False, points

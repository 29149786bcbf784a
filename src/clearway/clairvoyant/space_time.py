"""The clairvoyant's way: the shortest time to a goal among discs whose whole future is known.

A holonomic point (the caller inflates the obstacles by the robot's radius) that moves at up to `v_max`, in any
direction, and may wait. Two searches that share nothing but the discs: `extremals` builds exact ways, the best of which
is an upper bound once it has been checked, between its points too; `reach` floods a fine grid that errs on the other
side, a lower bound. The gap between the two is the error that is reported.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.clairvoyant.extremals import fastest
from clearway.clairvoyant.moving_discs import Scene, clear
from clearway.clairvoyant.reach import chain, earliest
from clearway.geometry.shapes import FloatArray

TARGET = 0.005
"""The error that `shortest` tries to get below."""

_LAYERS = (150, 300)
"""Of the bound's grid: the finer one only where the first comes near TARGET."""

_FINER = (300, 600)
"""The same, for scenes in which no search gets below TARGET with those: each takes some eight times as long as the one before."""

_LONGEST = 0.1
"""Between two of its layers, m at full speed, at most."""

_GRID = 0.2
"""Between two layers of the grid that finds ways, s at 1 m/s."""


class SpaceTimePath(NamedTuple):
    """A way through space and time.

    Attributes:
        time: How long it takes, s.
        length: Length of the way, m.
        error: Bound on the relative error of `time`: no way is faster than (1 - error) time (see `shortest`).
        points: (k, 3) t [s], x, y [m]; straight at constant speed between two of them (v_max to within 1e-3, where the
            way follows a fast disc's edge); the first is the start, the last is within the goal's radius.
    """

    time: float
    length: float
    error: float
    points: FloatArray


def shortest(
    start: FloatArray,
    goal: FloatArray,
    *,
    goal_radius: float,
    v_max: float,
    static: FloatArray,
    moving: FloatArray,
    radii: FloatArray,
    dt: float,
    area: tuple[float, float, float, float] | None = None,
    horizon: float = 60.0,
    start_time: float = 0.0,
    bound: bool = True,
) -> SpaceTimePath | None:
    """The fastest way from `start` to within `goal_radius` of `goal`.

    Args:
        start: (2,) where it starts, m.
        goal: (2,) where it goes, m.
        goal_radius: How near to the goal it ends, m.
        v_max: Top speed, m/s.
        static: (n, 3) x, y, R [m] of discs that stand, already inflated.
        moving: (T, m, 2) centres [m] of discs at the times 0, dt, 2 dt, ... s; straight at constant speed between; NaN:
            absent (then also in the interval before and after). After the last sample nothing is known: no way goes on
            beyond it unless m = 0.
        radii: (m,) their radii, m, already inflated.
        dt: Time from a sample of `moving` to the next, s.
        area: x_min, y_min, x_max, y_max [m] of where the point may be; None: anywhere.
        horizon: Latest arrival, s after `start_time`.
        start_time: When it starts, on the clock of `moving`, s.
        bound: False skips the bound on the error (`error` is then NaN): for a navigator that only wants the way.

    Returns:
        The way; None if there is none within the horizon (or the start is inside a disc).

    Raises:
        ValueError: an array of the wrong shape, a number that isn't finite, or a speed, radius or dt that isn't positive.
    """
    scene = scene_of(goal, goal_radius, v_max, static, moving, radii, dt, area)
    here = np.ascontiguousarray(start, dtype=np.float64)
    if here.shape != (2,) or not np.isfinite(here).all():
        raise ValueError(f"start is {start!r}; it must be two finite numbers")
    latest = start_time + horizon
    if len(scene.radii):
        latest = min(latest, (len(scene.moving) - 1) * scene.dt)
    still = np.array([[start_time, *here], [start_time + 1e-9, *here]])
    x_min, y_min, x_max, y_max = scene.area
    if not (x_min <= here[0] <= x_max and y_min <= here[1] <= y_max) or not clear(scene, still):
        return None
    if math.hypot(here[0] - scene.goal[0], here[1] - scene.goal[1]) <= goal_radius:
        return SpaceTimePath(0.0, 0.0, 0.0, still[:1])
    best: SpaceTimePath | None = None
    # each costs more, and fewer scenes need it; nothing waits for what stands
    for ways in (_plain, _waiting, _by_grid):
        points = ways(scene, here, start_time, latest, best)
        if points is not None and clear(scene, points):
            time = float(points[-1, 0] - start_time)
            if best is None or time < best.time:
                length = float(np.hypot(*np.diff(points[:, 1:], axis=0).T).sum())
                error = _error(scene, here, start_time, time) if bound else math.nan
                best = SpaceTimePath(time, length, error, points)
        if best is not None and (not best.error > TARGET or len(scene.radii) == 0):
            break
    if best is not None and best.error > TARGET:  # discs that are fast or gaps that are narrow for the grid: finer ones
        best = best._replace(error=min(best.error, _error(scene, here, start_time, best.time, _FINER)))
    return best


def _plain(scene: Scene, start: FloatArray, t: float, latest: float, _: SpaceTimePath | None) -> FloatArray | None:
    return fastest(scene, start, t, latest)


def _waiting(scene: Scene, start: FloatArray, t: float, latest: float, _: SpaceTimePath | None) -> FloatArray | None:
    return fastest(scene, start, t, latest, waits=True)


def _by_grid(scene: Scene, start: FloatArray, t: float, latest: float, best: SpaceTimePath | None) -> FloatArray | None:
    """Along the grid for a while (that finds where to wait, and until when), then one of the extremals."""
    for factor in (1.0,) if best is not None else (1.3, 2.0, math.inf):
        crow = math.hypot(start[0] - scene.goal[0], start[1] - scene.goal[1]) / scene.v
        limit = t + best.time if best is not None else min(t + factor * crow + 1.0, latest)
        delta = _GRID / scene.v * max(1.0, (limit - t) * scene.v / 20.0)  # to bound the memory
        points = chain(scene, start, t, limit, delta)
        if points is not None or limit >= latest:
            break
    found = None
    if points is not None:
        for k in range(1, len(points)):
            rest = fastest(scene, points[k, 1:].copy(), float(points[k, 0]), limit, 60)
            if rest is not None:
                limit, found = float(rest[-1, 0]), np.concatenate([points[: k + 1], rest[1:]])
    return found


def _error(scene: Scene, start: FloatArray, start_time: float, time: float, grids: tuple[int, ...] = _LAYERS) -> float:
    gap = math.hypot(start[0] - scene.goal[0], start[1] - scene.goal[1]) - scene.goal[2]
    error = max(0.0, 1.0 - float(gap / scene.v / time))
    for layers in grids:
        if error <= 1e-9:
            break
        delta = min(time / layers, 150 / layers * _LONGEST / scene.v)
        first = earliest(scene, start, start_time, start_time + time, delta) - start_time
        error = min(error, max(0.0, 1.0 - float(first) / time))
        if error <= TARGET or (grids is _LAYERS and error > 2.0 * TARGET):
            break
    return error


def scene_of(
    goal: FloatArray,
    goal_radius: float,
    v_max: float,
    static: FloatArray,
    moving: FloatArray,
    radii: FloatArray,
    dt: float,
    area: tuple[float, float, float, float] | None,
) -> Scene:
    """The arguments of `shortest` as compiled code wants them, checked."""
    fixed = np.ascontiguousarray(static, dtype=np.float64).reshape(-1, 3)
    reach = np.ascontiguousarray(radii, dtype=np.float64).reshape(-1)
    ways = np.ascontiguousarray(moving, dtype=np.float64)
    if len(reach) == 0:
        ways = np.zeros((2, 0, 2))
    if ways.ndim != 3 or ways.shape[1:] != (len(reach), 2) or len(ways) < 2:
        raise ValueError(f"moving is {np.shape(moving)}; it must be (T >= 2, m, 2) with m = {len(reach)} radii")
    numbers = {"v_max": v_max, "dt": dt, "goal_radius": goal_radius}
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} is {value!r}; it must be a positive number")
    target = np.array([*np.ravel(goal), goal_radius], dtype=np.float64)
    if target.shape != (3,) or not np.isfinite(target).all():
        raise ValueError(f"goal is {goal!r}; it must be two finite numbers")
    if not (np.isfinite(fixed).all() and np.isfinite(reach).all()):
        raise ValueError("static discs and radii must be finite")
    steps = np.diff(ways, axis=0)
    pace = np.hypot(steps[:, :, 0], steps[:, :, 1]) / dt
    speed = np.where(np.isnan(pace).any(axis=0), math.inf, np.nan_to_num(pace).max(axis=0, initial=0.0))
    limits = np.array(area if area is not None else (-math.inf, -math.inf, math.inf, math.inf), dtype=np.float64)
    return Scene(fixed, ways, reach, speed, float(dt), limits, target, float(v_max))

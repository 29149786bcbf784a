"""What somebody who knows only its neighbourhood needs besides: the way to its goal on the map, and past what stands."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import NamedTuple

import numpy as np

from clearway.contract import Goal, Obstacles, Task
from clearway.crowds.bodies import Bodies
from clearway.crowds.ways import COMFORT, Room, Ways, room_of, way_point, ways_to, with_discs
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.inputs import NOTHING
from clearway.robots import DriveLimits

REPLAN = 1.0
"""How long a way holds, s: by then something else may be known to stand in it."""

DEVIATIONS = 3.0
"""Of a place, that its bound is: discs grown by all of them leave no velocity free among people at arm's length."""

_AROUND, _CELL = 4.0, 0.1  # without a map: free cells, so far around start and goal, m


class Seen(NamedTuple):
    """Perceived obstacles, less what is not finite and what the map shows anyway.

    Attributes:
        discs: (n, 5) x, y [m], vx, vy [m/s], radius with a standard deviation of its place [m].
        moving: (n,) bool.
    """

    discs: FloatArray
    moving: np.ndarray[tuple[int], np.dtype[np.bool_]]


def seen(obstacles: Obstacles | None, mapped: bool) -> Seen:
    """What is `Seen` of `obstacles`.

    Args:
        mapped: Whether the map shows structure; trackers then tell of that with a velocity known to be 0.
    """
    if obstacles is None or not len(obstacles):
        return Seen(np.empty((0, 5)), np.empty(0, np.bool_))
    discs = np.column_stack(
        (
            obstacles.position,
            np.nan_to_num(obstacles.velocity, nan=0.0, posinf=0.0, neginf=0.0),
            obstacles.radius + np.nan_to_num(obstacles.error, nan=0.0, posinf=0.0) / DEVIATIONS,
        )
    )
    good = np.isfinite(discs).all(1) & (discs[:, 4] >= 0.0)
    if mapped:
        good &= obstacles.moving | (obstacles.velocity_error != 0.0)
    return Seen(np.ascontiguousarray(discs[good]), obstacles.moving[good])


def unmapped(obstacles: Obstacles | None, mapped: bool) -> Obstacles:
    """Those that the map does not show anyway; `mapped` as in `seen`."""
    if obstacles is None:
        return NOTHING
    if not mapped:
        return obstacles
    keep = obstacles.moving | (obstacles.velocity_error != 0.0)
    return Obstacles(*(getattr(obstacles, f.name)[keep] for f in fields(obstacles)))


def later(others: Seen, time: float) -> Seen:
    """Where these are after `time` [s] if they go on as they do."""
    if time == 0.0 or not len(others.discs):
        return others
    discs = others.discs.copy()
    discs[:, :2] += time * discs[:, 2:4]
    return Seen(discs, others.moving)


def with_others(pose: FloatArray, velocity: FloatArray, radius: float, others: Seen, share: float) -> Bodies:
    """The robot, a disc of `radius` [m] that drives at `velocity` (2,), v and omega, or (3,) with v_y, and all that it sees; it is
    the first.

    Args:
        share: Of avoiding what moves, as it falls to the robot; all of it does for what stands.
    """
    heading = np.array((math.cos(pose[2]), math.sin(pose[2])))
    own = velocity[0] * heading
    if len(velocity) > 2:
        own = own + velocity[2] * np.array((-heading[1], heading[0]))
    n = len(others.discs) + 1
    return Bodies(
        np.vstack((pose[:2], others.discs[:, :2])),
        np.vstack((own, others.discs[:, 2:4])),
        np.concatenate(((radius,), others.discs[:, 4])),
        np.ones(n, np.int64),
        np.concatenate(((share,), np.where(others.moving, share, 1.0))),
    )


class Route:
    """The way to a goal: on the task's map, around what stands.

    Args:
        task: Whose map and area hold; without a map all is free.
        radius: Of the robot, m.
        limits: Of its base.
        ahead: How far along the way it looks for the point to head for, m.
    """

    def __init__(self, task: Task, radius: float, limits: DriveLimits, ahead: float) -> None:
        self._task, self._radius, self._limits, self._ahead = task, radius, limits, ahead
        self._room: Room | None = None
        self._ways: Ways | None = None
        self._goal: Goal | None = None
        self._next = -math.inf

    def wish(self, t: float, pose: FloatArray, goal: Goal, others: Seen) -> tuple[FloatArray, FloatArray]:
        """The point to head for (2,), and the velocity (2,) [m/s] there, slower where the goal is near; zero: there is no way."""
        x, y, left = way_point(self.ways(t, pose, goal, others), float(pose[0]), float(pose[1]), self._ahead)
        point = np.array((x, y))
        away = math.hypot(x - pose[0], y - pose[1])
        if not left < math.inf or away < 1e-9:
            return point, np.zeros(2)
        speed = min(self._limits.v_max, math.sqrt(2.0 * min(self._limits.deceleration, 1e6) * left))
        return point, (point - pose[:2]) * (speed / away)

    def ways(self, t: float, pose: FloatArray, goal: Goal, others: Seen) -> Ways:
        """The ways to `goal` at time `t` [s], past what stands of `others`; anew after `REPLAN`."""
        held = self.held(t, goal)
        if held is not None:
            return held
        if goal is not self._goal:
            self._goal, self._room = goal, None
        if self._room is None:
            self._room = room_of(self._task.map or self._open(pose, goal))
        standing = others.discs[~others.moving][:, (0, 1, 4)]
        room = with_discs(self._room, np.ascontiguousarray(standing), self._radius + COMFORT)
        self._ways = ways_to(np.array(goal.pose[:2], np.float64), room, self._radius)
        self._next = t + REPLAN - 1e-6
        return self._ways

    def held(self, t: float, goal: Goal) -> Ways | None:
        """The last ways, if they are to `goal` and still hold at time `t` [s]."""
        return self._ways if goal is self._goal and t < self._next else None

    def _open(self, pose: FloatArray, goal: Goal) -> OccupancyGrid:
        """A map without walls."""
        ends = np.array((pose[:2], goal.pose[:2]))
        x0, y0, x1, y1 = self._task.area or (*(ends.min(0) - _AROUND), *(ends.max(0) + _AROUND))
        size = (math.ceil((y1 - y0) / _CELL) + 1, math.ceil((x1 - x0) / _CELL) + 1)
        return OccupancyGrid(np.full(size, FREE, np.int8), _CELL, (float(x0), float(y0)))

"""The last word on a command: Nav2's collision monitor.

Behaviour after nav2_collision_monitor/src/{collision_monitor_node,polygon,circle,velocity_polygon}.cpp. It sees what the
lidar sees and heeds neither path nor costmap.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.parameters.monitor import (
    CircleZone,
    CollisionMonitorParameters,
    MonitorSource,
    PolygonZone,
    VelocityRange,
    VelocityZone,
    Zone,
)
from clearway.navigators.nav2.seams import Velocity

_REST = Velocity(0.0, 0.0, 0.0)
_NO_SHAPE: FloatArray = np.empty((0, 2))


class Verdict(NamedTuple):
    """What the collision monitor makes of a command.

    Attributes:
        command: What the base is told; None: nothing.
        zone: The name of the zone that decided it; "": none did, "invalid source": a scan is too old.
    """

    command: Velocity | None
    zone: str


class CollisionMonitor:
    """`collision_monitor`: slows a command down, or stops it, where something is in a zone about the robot."""

    def __init__(self, given: Branch) -> None:
        """
        Args:
            given: Its parameters, with zones and sources inside.
        """
        group = given.group
        if not isinstance(group, CollisionMonitorParameters):
            raise TypeError(f"{type(group).__name__} is no group of a collision monitor")
        self._parameters = group
        self._sources = {name: s.group for name, s in given.children.items() if isinstance(s.group, MonitorSource)}
        self._zones = [_Zone(name, zone) for name, zone in given.children.items() if isinstance(zone.group, Zone)]
        self.reset()

    def reset(self) -> None:
        """Forget everything: a new trial begins."""
        for zone in self._zones:
            zone.reset()
        self._moved = True
        self._stopped_at = 0.0

    def judge(self, now: float, command: Velocity, points: FloatArray, taken: float, footprint: FloatArray) -> Verdict:
        """What becomes of a command.

        Args:
            now: s.
            command: As it came.
            points: (n, 2) where the lidar's rays ended, in base_link, m.
            taken: When, s.
            footprint: (m, 2) the outline in base_link, m, as the local costmap publishes it.
        """
        seen: dict[str, FloatArray] = {}
        for name, source in self._sources.items():
            if not source.enabled or source.type != "scan":
                continue
            limit = self._parameters.source_timeout if source.source_timeout is None else source.source_timeout
            if limit > 0.0 and now - taken > limit:
                return Verdict(self._said(now, _REST), "invalid source")
            seen[name] = points
        found, deciding = command, ""
        for zone in self._zones if self._parameters.enabled else ():
            if not zone.group.enabled:
                continue
            wanted, stops = zone.wants(command, seen, footprint)
            if wanted is not None and (stops or _faster(found, wanted)):
                found, deciding = wanted, zone.name
            if stops:
                break
        return Verdict(self._said(now, found), deciding)

    def _said(self, now: float, command: Velocity) -> Velocity | None:
        """The command, unless the robot has been told to rest long enough."""
        if command != _REST:
            self._moved = True
            return command
        if self._moved:
            self._moved, self._stopped_at = False, now
        elif now - self._stopped_at > self._parameters.stop_pub_timeout:
            return None
        return command


class _Zone:
    """A zone with what it remembers: its shape, and how often something was in it."""

    def __init__(self, name: str, given: Branch) -> None:
        group = given.group
        assert isinstance(group, Zone)
        self.name, self.group = name, group
        self._radius = group.radius if isinstance(group, CircleZone) and group.radius is not None else -1.0
        self._ranges = [
            (r.group, np.array(r.group.points)) for r in given.children.values() if isinstance(r.group, VelocityRange)
        ]
        self._holonomic = isinstance(group, VelocityZone) and group.holonomic
        self._given = np.array(group.points) if isinstance(group, PolygonZone) and group.points else _NO_SHAPE
        # of those zones that a topic would give a shape, the ones that slow down before a contact get the footprint
        approaches = group.action_type == "approach"
        self._as_footprint = isinstance(group, PolygonZone) and not group.points and approaches
        self._least = group.min_points if group.max_points is None else group.max_points + 1
        self.reset()

    def reset(self) -> None:
        """Forget what was in it."""
        self._hits = self._misses = 0
        self._active = False
        self._shape = self._given

    def wants(
        self, command: Velocity, seen: Mapping[str, FloatArray], footprint: FloatArray
    ) -> tuple[Velocity | None, bool]:
        """The command that it wants instead, if any, and whether that is to stop whatever other zones want."""
        group = self.group
        self._update(command, footprint)
        if group.action_type == "none" or (self._radius < 0.0 and len(self._shape) == 0):
            return None, False
        names = tuple(seen) if group.sources_names is None else group.sources_names
        sets = [seen[name] for name in names if name in seen]
        points = sets[0] if len(sets) == 1 else np.vstack([_NO_SHAPE, *sets])
        if group.action_type == "approach":
            left = _time_left(
                points,
                self._shape,
                self._radius,
                self._least,
                *command,
                group.time_before_collision,
                group.simulation_time_step,
            )
            return (None if left < 0.0 else _scaled(command, left / group.time_before_collision)), False
        if not self._triggered(_holds(points, self._shape, self._radius, self._least, 0.0, 0.0, 0.0)):
            return None, False
        if group.action_type == "stop":
            return _REST, True
        if group.action_type == "slowdown":
            return _scaled(command, group.slowdown_ratio), False
        ratio = 1.0
        speed = math.hypot(command.v_x, command.v_y)
        if speed != 0.0:
            ratio = min(ratio, group.linear_limit / speed)
        if command.omega != 0.0:
            ratio = min(ratio, group.angular_limit / abs(command.omega))
        return _scaled(command, max(0.0, ratio)), False

    def _update(self, command: Velocity, footprint: FloatArray) -> None:
        """The shape that holds for a command; where no range of velocities holds it, that of the last one."""
        if self._as_footprint:
            self._shape = footprint
        for velocities, shape in self._ranges:
            if _is_in(command, velocities, self._holonomic):
                self._shape = shape
                return

    def _triggered(self, hit: bool) -> bool:
        group = self.group
        if hit:
            self._hits, self._misses = self._hits + 1, 0
            self._active = self._active or self._hits >= group.trigger_consecutive_points
        else:
            self._hits, self._misses = 0, self._misses + 1
            self._active = self._active and self._misses < group.release_consecutive_points
        return self._active


def _is_in(command: Velocity, r: VelocityRange, holonomic: bool) -> bool:
    """Whether a range of velocities holds a command."""
    if not r.theta_min <= command.omega <= r.theta_max:
        return False
    if not holonomic:
        return r.linear_min <= command.v_x <= r.linear_max
    speed = math.hypot(command.v_x, command.v_y)
    direction = math.atan2(command.v_y, command.v_x) if speed > 0.0 else 0.0
    after, before = direction >= r.direction_start_angle, direction <= r.direction_end_angle
    around = r.direction_start_angle > r.direction_end_angle
    return r.linear_min <= speed <= r.linear_max and ((after or before) if around else (after and before))


def _faster(a: Velocity, b: Velocity) -> bool:
    return b.v_x**2 + b.v_y**2 + b.omega**2 < a.v_x**2 + a.v_y**2 + a.omega**2


def _scaled(v: Velocity, ratio: float) -> Velocity:
    return Velocity(v.v_x * ratio, v.v_y * ratio, v.omega * ratio)


@kernel
def _inside(polygon: FloatArray, x: float, y: float) -> bool:
    """Whether a polygon (m, 2) holds a point, by the edges that a ray to the right crosses (nav2_util's geometry_utils.hpp)."""
    inside = False
    i = polygon.shape[0] - 1
    for j in range(polygon.shape[0]):
        if (y <= polygon[i, 1]) == (y > polygon[j, 1]):
            crossing = polygon[i, 0] + (y - polygon[i, 1]) * (polygon[j, 0] - polygon[i, 0]) / (
                polygon[j, 1] - polygon[i, 1]
            )
            if crossing > x:
                inside = not inside
        i = j
    return inside


@kernel
def _holds(points: FloatArray, polygon: FloatArray, radius: float, least: int, x: float, y: float, yaw: float) -> bool:
    """Whether at least so many of the points (n, 2) are in a polygon, or in a circle if its radius isn't negative, at a pose."""
    c, s = math.cos(yaw), math.sin(yaw)
    reach = radius * radius
    if radius < 0.0:
        for i in range(polygon.shape[0]):
            reach = max(reach if i > 0 else 0.0, polygon[i, 0] ** 2 + polygon[i, 1] ** 2)
    count = 0
    for i in range(points.shape[0]):
        if count >= least:
            break
        dx, dy = points[i, 0] - x, points[i, 1] - y
        squared = dx * dx + dy * dy
        if radius < 0.0:
            if squared <= reach * (1.0 + 1e-9) and _inside(polygon, dx * c + dy * s, dy * c - dx * s):
                count += 1
        elif squared < reach:
            count += 1
    return count >= least


@kernel
def _time_left(
    points: FloatArray,
    polygon: FloatArray,
    radius: float,
    least: int,
    v_x: float,
    v_y: float,
    omega: float,
    ahead: float,
    step: float,
) -> float:
    """How long a command can be driven until enough points are inside, s; -1: at least as long as is looked ahead.

    As in the source, the time that is told is that of the beginning of the step that leads there.
    """
    if _holds(points, polygon, radius, least, 0.0, 0.0, 0.0):
        return 0.0
    x, y, yaw, time = 0.0, 0.0, 0.0, 0.0
    c, s = math.cos(omega * step), math.sin(omega * step)
    while time <= ahead:
        x, y, yaw = x + v_x * step, y + v_y * step, yaw + omega * step
        v_x, v_y = v_x * c - v_y * s, v_x * s + v_y * c
        if _holds(points, polygon, radius, least, x, y, yaw):
            return time
        time += step
    return -1.0

"""Trackers: obstacles with position, velocity and error bounds, from a camera or from a lidar's scans.

`difference` remembers the previous frame only, as paper B does; `kalman` filters. A robot with a camera is told its
obstacles one by one. With a lidar alone they are discs over what the scan shows (see `clusters`): bodies that move,
one disc each, what is pushed, a row of them each (see `rectangles`), and structure (walls, furniture, boxes), many
small ones. Motion is estimated in the frame of the odometry, which is smooth, and moved into the map frame by the
estimated pose: a correction of the localisation is not an obstacle's velocity.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from clearway.contract import Obstacles, Sensing, Task, Tracker
from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.perception import kalman
from clearway.perception.bodies import BodyFollower, DifferenceFollower, Follower
from clearway.perception.candidates import EXACT, sizes_of
from clearway.perception.clusters import (
    NOTHING_KNOWN,
    ClusterParameters,
    known_structure,
    looks_around,
    perceive,
)
from clearway.perception.covering import cover
from clearway.perception.rectangles import RectangleFollower
from clearway.perception.skew import straightened
from clearway.perception.structure import StructureMemory
from clearway.perception.touching import parted
from clearway.quantities import Positive
from clearway.robots import Robot


class TrackerParameters(BaseModel):
    """What is assumed of moving obstacles. No robot's file sets these: they are ours, unless a source is named."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    acceleration: Positive = Field(default=1.0, description="bound along an axis, m/s^2: paper B's obstacles keep below"
                                   " alpha |x_0 - x_att| < 1 but for their initial speed (eqs. 6-7); TIAGo's limit")  # fmt: skip
    walking: Positive = Field(default=2.0, description="the same of somebody whose legs a lidar sees, m/s^2: from a stroll to a"
                              " stand in half a second")  # fmt: skip
    speed: Positive = Field(default=3.0, description="bound, m/s: nine in ten of paper B's obstacles stay below 2.6")
    memory: Positive = Field(default=1.0, description="out of view for longer, an obstacle is forgotten, s")
    coast: float = Field(default=0.5, ge=0, description="out of view for so long, a moving body is still told of, s")
    aside: float = Field(default=2.0, ge=0, description="and for so long if the sensor has turned away from it, s")
    structure_memory: float = Field(default=5.0, ge=0, description="structure that the sensor has turned away from is kept"
                                    " for so long, s: a turn there and back")  # fmt: skip
    watch: Positive = Field(default=2.0, description="how old the scans are that tell whether a body has moved, s")
    pushed: tuple[tuple[Positive, Positive], ...] = Field(default=((2.1, 0.96), (1.1, 0.7)), description="lengths and widths of"
                             " what is pushed about in a house whose map is known, m: a hospital's bed and wheelchair")  # fmt: skip
    clusters: ClusterParameters = ClusterParameters()


class _CameraTracker:
    """What both trackers do with a camera's obstacles: drop what is not finite; never touch those that stand."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget all obstacles."""
        self._t = math.nan
        self._forget()

    def update(self, sensing: Sensing, pose: FloatArray) -> Obstacles:
        """The obstacles now; `pose` is not needed, as a camera's positions are in the map frame.

        Raises:
            ClearwayError: the camera gave nothing.
        """
        seen = sensing.obstacles
        if seen is None:
            raise ClearwayError("the tracker needs the camera's obstacles, and this world gives none")
        seen = _finite(seen)
        dt = sensing.t - self._t
        self._t = sensing.t
        return self._track(seen, sensing.t, dt)

    def _forget(self) -> None:
        raise NotImplementedError

    def _track(self, seen: Obstacles, t: float, dt: float) -> Obstacles:
        raise NotImplementedError


class CameraDifference(_CameraTracker):
    """Velocity = (position now - position in the previous frame) / period; zero, with no bound, at first sight.

    The bound on its error: both positions' errors over the period, and half a period's acceleration.
    """

    def __init__(self, parameters: TrackerParameters) -> None:
        self._p = parameters

    def _forget(self) -> None:
        self._ids, self._before, self._bound = np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty(0)

    def _track(self, seen: Obstacles, t: float, dt: float) -> Obstacles:
        velocity, error = np.zeros_like(seen.position), np.where(seen.moving, np.inf, 0.0)
        if dt > 0.0 and len(self._ids):
            place = kalman.find(self._ids, seen.identity)
            known = (place >= 0) & seen.moving
            at = place[known]
            velocity[known] = (seen.position[known] - self._before[at]) / dt
            bent = 0.5 * math.sqrt(2.0) * self._p.acceleration * dt
            error[known] = (seen.error[known] + self._bound[at]) / dt + bent
        order = np.argsort(seen.identity, kind="stable")
        self._ids, self._before, self._bound = seen.identity[order], seen.position[order], seen.error[order]
        return Obstacles(seen.position, velocity, seen.radius, seen.error, error, seen.identity, seen.moving)


class CameraKalman(_CameraTracker):
    """A constant-velocity Kalman filter for each obstacle that moves; bounds are 3 sigma (98.9 % of a 2-D error)."""

    def __init__(self, parameters: TrackerParameters) -> None:
        self._p = parameters

    def _forget(self) -> None:
        self._filters = np.empty(0, dtype=np.int64), np.empty((0, 4)), np.empty((0, 3)), np.empty(0)

    def _track(self, seen: Obstacles, t: float, dt: float) -> Obstacles:
        p = self._p
        if not dt >= 0.0:
            self._forget()
        *self._filters, at = kalman.advance(  # type: ignore[assignment]
            *self._filters, seen.identity, seen.position, seen.error, p.speed, t, dt if dt >= 0.0 else 0.0,
            kalman.SPREAD * p.acceleration, p.memory,
        )  # fmt: skip
        where, velocity, error, velocity_error = kalman.report(
            self._filters[1], self._filters[2], at, seen.position, seen.error, seen.moving
        )
        return Obstacles(where, velocity, seen.radius, error, velocity_error, seen.identity, seen.moving)


class LidarTracker:
    """Obstacles from scans: `follower` tells which clusters are bodies that move, and how; the rest is structure.

    A body is one disc over its returns, with `error` 3 sigma of a range; structure is small discs with velocity 0 and
    error 0, as they contain the noise. Where the task grants a map, returns near its occupied cells are known
    structure: nothing there moves, a body beside a wall is told from the wall, and what is pushed is followed.
    """

    def __init__(
        self, robot: Robot, parameters: TrackerParameters, follower: Callable[[], Follower], remembers: float
    ) -> None:
        assert robot.lidar is not None
        self._remembers = remembers
        self._p, self._sigma, self._make = parameters, robot.lidar.sigma, follower
        self._legs = robot.lidar.sees_legs
        self._sizes = sizes_of(robot, parameters.clusters)
        self._drive = robot.drive

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget all obstacles; learn the map, if one is granted."""
        self._known = NOTHING_KNOWN if task.map is None else known_structure(task.map, self._p.clusters.known_within)
        self._follower, c = self._make(), self._p.clusters
        followed = task.map is not None and self._remembers > 0.0
        self._rectangles = RectangleFollower(np.array(self._p.pushed).reshape(-1, 2)) if followed else None
        self._memory = StructureMemory(self._remembers, self._sigma, c.range_limit, c.discs - c.discs // 4)

    def update(self, sensing: Sensing, pose: FloatArray) -> Obstacles:
        """The obstacles now, in the map frame by the estimated `pose` (3,).

        Raises:
            ClearwayError: there is no scan.
        """
        scan = sensing.scan
        if scan is None:
            raise ClearwayError("the tracker needs a scan in every control period, and this world gives none")
        c, around = self._p.clusters, looks_around(scan)
        scan = straightened(scan, float(sensing.odom_velocity[1]))
        odom = self._drive.base_link(np.asarray(sensing.odom_pose, dtype=np.float64))
        returns = perceive(scan, odom, c, self._sigma, self._known, pose, self._legs, around)
        returns = parted(returns, scan.angle_increment, self._sizes, max(self._sigma, EXACT))
        bodies = self._follower.update(returns, scan, sensing.t)
        if self._rectangles is not None:
            bodies, returns = self._rectangles.update(returns, scan, bodies, sensing.t)
        structure = bodies.structure
        cores, whole = bodies.cores, len(bodies.x) + len(bodies.cores)
        discs, cells, known = cover(returns, structure, scan.angle_increment, c, c.discs - min(whole, c.discs - 16))
        if len(cores):
            discs, cells = np.concatenate((cores, discs)), np.concatenate((bodies.core_identity, cells))
            known = np.concatenate((np.zeros(len(cores), dtype=np.uint8), known))
        cells, discs, known = self._memory.update(cells, discs, known, scan, returns.sensor, sensing.t)
        n, m = len(bodies.x), len(discs)
        turn = pose[2] - odom[2]
        rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        position = np.concatenate((bodies.x, discs[:, :2]))
        velocity = np.zeros((n + m, 2))
        velocity[:n] = bodies.v @ rotation
        return Obstacles(
            position=(position - odom[:2]) @ rotation + pose[:2],
            velocity=velocity,
            radius=np.concatenate((bodies.radius, discs[:, 2])),
            error=np.concatenate((bodies.error, np.zeros(m))),
            velocity_error=np.concatenate((bodies.v_error, np.where(known, 0.0, bodies.slowest))),
            identity=np.concatenate((bodies.identity, cells)),
            moving=np.arange(n + m) < n,
        )


def _finite(seen: Obstacles) -> Obstacles:
    good = np.isfinite(seen.position).all(axis=1) & np.isfinite(seen.radius) & np.isfinite(seen.error)
    if good.all():
        return seen
    return Obstacles(
        seen.position[good], seen.velocity[good], seen.radius[good], seen.error[good], seen.velocity_error[good],
        seen.identity[good], seen.moving[good],
    )  # fmt: skip


def _difference(robot: Robot, p: TrackerParameters) -> Tracker:
    if robot.camera is not None:
        return CameraDifference(p)
    return LidarTracker(robot, p, lambda: DifferenceFollower(robot, p.clusters, p.speed, p.acceleration), 0.0)


def _kalman(robot: Robot, p: TrackerParameters) -> Tracker:
    if robot.camera is not None:
        return CameraKalman(p)
    return LidarTracker(
        robot,
        p,
        lambda: BodyFollower(
            robot, p.clusters, p.speed, p.acceleration, p.walking, p.memory, p.coast, p.aside, p.watch
        ),
        p.structure_memory,
    )


TRACKERS: dict[str, Callable[[Robot, TrackerParameters], Tracker]] = {"difference": _difference, "kalman": _kalman}
"""Name -> maker."""


def make_tracker(name: str, robot: Robot, parameters: TrackerParameters | None = None) -> Tracker:
    """The tracker `name`, by the robot's camera if it has one, else by its lidar.

    Raises:
        ClearwayError: no such tracker, or the robot has neither.
    """
    if name not in TRACKERS:
        raise unknown("tracking", name, TRACKERS)
    if robot.camera is None and robot.lidar is None:
        raise ClearwayError(f"robot {robot.name!r} has neither a camera nor a lidar to perceive obstacles with")
    return TRACKERS[name](robot, parameters or TrackerParameters())

"""Adaptive Monte Carlo localisation on a likelihood field, as ROS's `amcl` node does it.

Between updates the correction map -> odom is held and the estimate follows the odometry. The first estimate is the
initial cloud's; a later one is taken after each resampling. Two readings differ from the node's source and are listed
in `DECISIONS.md` beside this file: cells are located by their lower corner (the node is half a cell off), and the robot starts
localised.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from clearway.contract import Scan, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.angles import wrap
from clearway.geometry.frames import compose, relative
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.perception import particle_filter as pf
from clearway.perception.parameters import AmclParameters
from clearway.robots import Robot


class Amcl:
    """The localiser `amcl`.

    Attributes:
        parameters: Those of the robot's file.
        poses: (n, 3) the particles, map frame.
        weights: (n,), sum 1.
        updates: How often scan and odometry moved the particles since `reset`.
    """

    def __init__(self, parameters: AmclParameters | None = None) -> None:
        self.parameters = p = parameters or AmclParameters()
        self._anywhere = p.odom_model_type.startswith("omni")
        alpha = (p.odom_alpha1, p.odom_alpha2, p.odom_alpha3, p.odom_alpha4, p.odom_alpha5)
        self._alpha = np.array(alpha if self._anywhere else alpha[:4])
        self._bounds = np.array((p.min_particles, p.max_particles))
        self._corrected = p.odom_model_type.endswith("-corrected")
        self._product = p.laser_model_type == "likelihood_field_prob"
        self._spare = np.empty((p.max_particles, 3))

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Spread the particles around `task.start`.

        Raises:
            ClearwayError: the robot has no lidar, or the task grants no map.
        """
        if robot.lidar is None:
            raise ClearwayError(f"localisation 'amcl' needs a lidar, robot {robot.name!r} has none", field="lidar")
        if task.map is None:
            raise ClearwayError("localisation 'amcl' needs a map, this test grants none; use 'odometry' or 'truth'")
        p = self.parameters
        self._map = task.map
        self._room = room_at(task.map, float(task.start[0]), float(task.start[1]))
        self._rng = np.random.default_rng(rng.integers(2**63))
        spread = np.sqrt(np.array((p.initial_cov_xx, p.initial_cov_yy, p.initial_cov_aa)))
        self.poses = np.asarray(task.start) + spread * self._rng.standard_normal((p.max_particles, 3))
        self.weights = np.full(p.max_particles, 1.0 / p.max_particles)
        self._slow = self._fast = 0.0
        self.updates = 0
        self._last: FloatArray | None = None
        self._correction = np.zeros(3)

    def update(self, sensing: Sensing) -> FloatArray:
        """The estimated pose (3,), map frame; the filter runs when the robot has moved far enough.

        Raises:
            ClearwayError: there is no scan.
        """
        odom, last = sensing.odom_pose, self._last
        if last is None:
            self._correct(odom)
            self._sense(sensing.scan)
            self._last = odom.copy()
        elif self._moved(last, odom):
            move = pf.move_anywhere if self._anywhere else pf.move
            move(self.poses, last, odom, self._alpha, self._corrected, self._rng)
            self._sense(sensing.scan)
            self._last = odom.copy()
        else:
            return compose(self._correction, odom)
        self.updates += 1
        if self.updates % self.parameters.resample_interval == 0:
            self._resample()
            self._correct(odom)
        return compose(self._correction, odom)

    def covariance(self) -> FloatArray:
        """Of the particles about their weighted mean, (3, 3): x, y [m], heading [rad]."""
        about = np.average(np.exp(1j * self.poses[:, 2]), weights=self.weights)
        turned = np.angle(np.exp(1j * self.poses[:, 2]) * np.conj(about))
        off = np.column_stack((self.poses[:, :2], turned))
        return np.asarray(np.cov(off.T, aweights=self.weights, ddof=0))

    def _moved(self, last: FloatArray, odom: FloatArray) -> bool:
        far, turned = self.parameters.update_min_d, self.parameters.update_min_a
        return bool(
            abs(odom[0] - last[0]) > far or abs(odom[1] - last[1]) > far or abs(wrap(odom[2] - last[2])) > turned
        )

    def _correct(self, odom: FloatArray) -> None:
        """StaticPose map -> odom such that the robot now stands where the heaviest cluster is."""
        self._correction = compose(pf.best_cluster(self.poses, self.weights), relative(odom, np.zeros(3)))

    def _sense(self, scan: Scan | None) -> None:
        if scan is None:
            raise ClearwayError("localisation 'amcl' needs a scan in every control period")
        p = self.parameters
        range_max = min(scan.range_max, p.laser_max_range) if p.laser_max_range > 0 else scan.range_max
        range_min = max(scan.range_min, p.laser_min_range) if p.laser_min_range > 0 else scan.range_min
        n = scan.ranges.shape[0]
        step = -(-n // p.laser_max_beams) if self._product else max((n - 1) // (p.laser_max_beams - 1), 1)
        ends = pf.beam_ends(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, step, range_min, range_max)
        field, outside = likelihood_field(
            self._map,
            self._room,
            p.laser_z_hit,
            p.laser_z_rand / range_max,
            p.laser_sigma_hit,
            p.laser_likelihood_max_dist,
            self._product,
        )
        mean = pf.weigh(
            self.poses, self.weights, ends, field, outside, *self._map.origin, self._map.resolution, self._product
        )
        if mean > 0.0:
            self._slow = mean if self._slow == 0.0 else self._slow + p.recovery_alpha_slow * (mean - self._slow)
            self._fast = mean if self._fast == 0.0 else self._fast + p.recovery_alpha_fast * (mean - self._fast)

    def _resample(self) -> None:
        p = self.parameters
        if p.selective_resampling and 1.0 / float((self.weights**2).sum()) > 0.5 * len(self.weights):
            return
        lost = max(1.0 - self._fast / self._slow, 0.0) if self._slow > 0.0 else 0.0
        free = free_corners(self._map) if lost > 0.0 else np.empty((0, 2))
        count = pf.resample(
            self.poses,
            self.weights,
            self._spare,
            free,
            self._map.resolution,
            lost if len(free) else 0.0,
            self._bounds,
            p.kld_err,
            p.kld_z,
            self._rng,
        )
        self.poses = self._spare[:count].copy()
        self.weights = np.full(count, 1.0 / count)
        if lost > 0.0:
            self._slow = self._fast = 0.0


@lru_cache(maxsize=8)
def likelihood_field(
    map: OccupancyGrid, room: int, z_hit: float, z_rand: float, sigma: float, max_distance: float, product: bool
) -> tuple[FloatArray, float]:
    """What a beam that ends in a cell contributes to a particle's weight, and the same for one that ends off the map.

    With p = z_hit exp(-d^2 / 2 sigma^2) + z_rand and d the distance [m] to the nearest face of a wall, cut off at
    `max_distance`: p^3 (`likelihood_field`: weights are 1 + the sum of cubes), or log p (`product`). A face is an
    occupied cell that touches the robot's room: a map that a robot made shows nothing else, while a floor plan shows
    whole walls, inside which every beam would end at distance zero. Kept for the last few maps, by identity: it is
    costly on a large one.

    Args:
        map: What is known of the floor.
        room: Label of the robot's free space, see `rooms`; 0: any.
        z_rand: Density of a random range: its weight over the largest range, 1/m.

    Returns:
        (rows, cols), and the value off the map.
    """
    labels = rooms(map)
    inside = labels == room if room > 0 else labels > 0
    faces = (map.data == OCCUPIED) & binary_dilation(inside, np.ones((3, 3)))
    if faces.any():
        distance = np.minimum(distance_transform_edt(~faces) * map.resolution, max_distance)
    else:
        distance = np.full(map.data.shape, max_distance)
    padded = np.append(distance.ravel(), max_distance)
    p = z_hit * np.exp(-(padded**2) / (2.0 * sigma**2)) + z_rand
    value = np.log(p) if product else p**3
    return np.ascontiguousarray(value[:-1].reshape(distance.shape)), float(value[-1])


@lru_cache(maxsize=8)
def rooms(map: OccupancyGrid) -> np.ndarray:
    """Connected free spaces of a map: (rows, cols) int, 0 where it is not free, else the space's number from 1."""
    labels: np.ndarray = label(map.data == FREE, np.ones((3, 3)))[0]
    return labels


def room_at(map: OccupancyGrid, x: float, y: float) -> int:
    """Number of the connected free space at a point [m]; 0 off the map or where it is not free."""
    col, row = (math.floor((v - o) / map.resolution) for v, o in zip((x, y), map.origin, strict=True))
    rows, cols = map.data.shape
    return int(rooms(map)[row, col]) if 0 <= row < rows and 0 <= col < cols else 0


@lru_cache(maxsize=8)
def free_corners(map: OccupancyGrid) -> FloatArray:
    """Lower corners (k, 2) [m] of the free cells."""
    rows, cols = np.nonzero(map.data == FREE)
    corners: FloatArray = np.asarray(map.origin) + np.column_stack((cols, rows)) * map.resolution
    return corners

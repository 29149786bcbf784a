"""A layered costmap: static, obstacle and inflation layer over one master grid (costmap_2d's Costmap2DROS).

    scan --buffer--> obstacle layer --\\
    map  ----------> static layer  ----+-- update (own rate) --> master grid, uint8
                     inflation layer --/

An update touches the window that changed only: what the rays reached, what they reached the last time, and the
inflation radius around it (LayeredCostmap::updateMap). Behaviour read from ros-planning/navigation, costmap_2d.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.errors import ClearwayError
from clearway.geometry.frames import compose as compose_poses
from clearway.geometry.grid import UNKNOWN as UNKNOWN_CELL
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray, Polygon, Shape, circumscribed_radius, inscribed_radius
from clearway.navigators.common.costmaps import layers
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.common.costmaps.layers import ByteGrid
from clearway.navigators.common.costmaps.parameters import Costmap as CostmapParameters
from clearway.navigators.common.costmaps.parameters import InflationLayer, StaticLayer
from clearway.navigators.common.costmaps.plans import to_frame

_NO_GRID: ByteGrid = np.zeros((0, 0), np.uint8)
_NO_STAMPS: layers.IntGrid = np.zeros((0, 0), np.int32)
_NO_BOUNDS = (1e30, 1e30, -1e30, -1e30)


@dataclass(slots=True, eq=False)
class _Sweep:
    """A buffered scan.

    Attributes:
        t: When it came, s.
        number: Counted from 0.
        points: (n, 2) ends of its rays in the costmap's frame, m.
        marks: (m, 2) those near enough to mark.
        sensor: (3,) its pose in the costmap's frame.
        bounds: (4,) of what its rays touched.
        traced: Whether they were drawn.
    """

    t: float
    number: int
    points: FloatArray
    marks: FloatArray
    sensor: FloatArray
    bounds: FloatArray
    traced: bool = False


def refuse_without_map(parameters: CostmapParameters, name: str) -> None:
    """
    Raises:
        ClearwayError: the costmap `name` has a static layer.
    """
    if parameters.static_layer is not None and parameters.static_layer.enabled:
        raise ClearwayError(
            f"{name} has a static layer, which needs a map, and the task grants none; without a map it needs "
            'rolling_window = true or global_frame = "odom"',
            field=f"navigators.move-base.{name}",
        )


class Costmap:
    """One costmap of a robot.

    Attributes:
        cost: (rows, columns) uint8 master grid; 254 lethal, 253 inscribed, 255 unknown.
        origin: (2,) of its lower-left corner in the costmap's frame, m.
        resolution: Edge of a cell, m.
        footprint: (n, 2) padded outline in base_link, m.
    """

    def __init__(self, parameters: CostmapParameters, shape: Shape, map: OccupancyGrid | None, name: str) -> None:
        """
        Raises:
            ClearwayError: it has a static layer and there is no map.
        """
        self.parameters, self.name = parameters, name
        self.footprint = outline(shape, parameters.footprint_padding)
        polygon = Polygon(tuple((float(x), float(y)) for x, y in self.footprint))
        self.inscribed, self.circumscribed = inscribed_radius(polygon), circumscribed_radius(polygon)
        self.resolution = parameters.resolution
        rows, columns = int(parameters.height / self.resolution), int(parameters.width / self.resolution)
        self.origin = np.array((parameters.origin_x, parameters.origin_y))
        self._static = _NO_GRID
        self._map = map
        if map is None:
            refuse_without_map(parameters, name)
        elif parameters.static_layer is not None and parameters.static_layer.enabled:
            self._static = interpret(map, parameters.static_layer)
            if not parameters.rolling_window:
                self.resolution, self.origin = map.resolution, np.array(map.origin)
                rows, columns = map.data.shape
        self._fill = layers.UNKNOWN if parameters.track_unknown_space else layers.FREE
        self.cost: ByteGrid = np.full((rows, columns), self._fill, np.uint8)
        self._below = np.empty((rows, columns), np.uint8) if parameters.rolling_window and self._static.size else None
        self._new_map = True
        obstacle = parameters.obstacle_layer
        self._obstacle = obstacle if obstacle is not None and obstacle.enabled else None
        self._obstacles, self._obstacle_fill = _NO_GRID, layers.FREE
        self._cleared_by = _NO_STAMPS
        if self._obstacle is not None:
            track = self._obstacle.track_unknown_space
            self._obstacle_fill = layers.UNKNOWN if (self._fill if track is None else track) else layers.FREE
            self._obstacles = np.full((rows, columns), self._obstacle_fill, np.uint8)
            if self._obstacle.observation_persistence > 0:
                self._cleared_by = np.full((rows, columns), -1, np.int32)
        self._sweeps: deque[_Sweep] = deque()
        self._expired: list[_Sweep] = []
        self._count = 0
        self._rolled = True  # the master grid is to be rebuilt
        self._forgotten = False  # a recovery cleared the obstacle layer: everything is to be rebuilt
        inflation = parameters.inflation_layer
        self._inflation = (
            _Inflation(inflation, self.resolution, self.inscribed, rows, columns)
            if inflation is not None and inflation.enabled
            else None
        )

    @property
    def keeps_scans(self) -> bool:
        """Whether every scan is to be buffered, not only the newest at an update."""
        return self._cleared_by.size > 0

    def buffer(self, t: float, scan: Scan, pose: FloatArray) -> None:
        """Take a scan that came at time t [s] with the robot at `pose` (3,), costmap's frame."""
        layer = self._obstacle
        if layer is None:
            return
        beams = layers.directions(scan.ranges.size, scan.angle_min, scan.angle_increment)
        sensor = compose_poses(pose, scan.mount)
        mark_range = layer.obstacle_range if layer.marking else 0.0
        points, marks = layers.scan_points(
            scan.ranges, beams, scan.range_min, scan.range_max, sensor, layer.inf_is_valid, mark_range
        )
        self._sweeps.append(_Sweep(t, self._count, points, marks, sensor, np.array(_NO_BOUNDS)))
        self._count += 1
        keep = layer.observation_persistence
        while len(self._sweeps) > 1 and (keep == 0 or t - self._sweeps[0].t > keep + 1e-9):
            old = self._sweeps.popleft()
            if keep > 0:
                self._expired.append(old)

    def update(self, pose: FloatArray, transform: FloatArray) -> None:
        """Bring the master grid up to date.

        Args:
            pose: (3,) of the robot in the costmap's frame.
            transform: (3,) pose of the costmap's frame in the map.
        """
        rows, columns = self.cost.shape
        if self.parameters.rolling_window:
            self._roll(pose)
        bounds = np.array(_NO_BOUNDS)
        if self._static.size and (self._below is not None or self._new_map):
            layers.widen(bounds, self._map_bounds(transform))
            self._new_map = False
        polygon = self._update_obstacles(pose, bounds)
        if self._inflation is not None:
            self._inflation.widen(bounds)
        if self._rolled:
            window, self._rolled = np.array((0, rows, 0, columns)), False
        else:
            window = cells_within(bounds, self.origin, self.resolution, self.cost.shape)
        if window[1] <= window[0] or window[3] <= window[2]:
            return
        below = self._static
        if self._below is not None and self._map is not None:
            layers.project_static(
                self._static,
                np.array(self._map.origin),
                self._map.resolution,
                transform,
                self._below,
                self.origin,
                self.resolution,
                self._fill,
            )
            below = self._below
        if polygon is not None:
            layers.fill_polygon(self._obstacles, self.origin, self.resolution, polygon, layers.FREE)
        overwrite = self._obstacle is not None and self._obstacle.combination_method == 0
        layers.compose(self.cost, window, self._fill, below, self._obstacles, overwrite)
        if self._inflation is not None:
            self._inflation.apply(self.cost, window)

    def forget(self, x: float, y: float, distance: float, inside: bool) -> None:
        """Make the obstacle layer unknown outside (or inside) a square of edge `distance` around (x, y), m."""
        if self._obstacle is None:
            return
        half = distance / 2
        c0, r0 = ((np.array((x - half, y - half)) - self.origin) / self.resolution).astype(np.int64)
        c1, r1 = ((np.array((x + half, y + half)) - self.origin) / self.resolution).astype(np.int64)
        layers.forget(self._obstacles, c0, r0, c1, r1, inside)
        self._forgotten = True

    def cell(self, x: float, y: float) -> tuple[int, int] | None:
        """(row, column) of the cell that holds (x, y), or None off the map."""
        c, r = (x - self.origin[0]) / self.resolution, (y - self.origin[1]) / self.resolution
        rows, columns = self.cost.shape
        return (int(r), int(c)) if 0 <= c < columns and 0 <= r < rows else None

    def _roll(self, pose: FloatArray) -> None:
        rows, columns = self.cost.shape
        res = self.resolution
        across = int((pose[0] - (columns - 0.5) * res / 2 - self.origin[0]) / res)
        up = int((pose[1] - (rows - 0.5) * res / 2 - self.origin[1]) / res)
        if across == 0 and up == 0:
            return
        self.origin = self.origin + np.array((across, up)) * res
        self._rolled = True
        if self._obstacle is not None:
            self._obstacles = shift(self._obstacles, across, up, self._obstacle_fill)
            if self._cleared_by.size:
                self._cleared_by = shift(self._cleared_by, across, up, -1)

    def _update_obstacles(self, pose: FloatArray, bounds: FloatArray) -> FloatArray | None:
        """Bring the obstacle layer up to date but for the footprint, which is returned if it is to be freed."""
        layer = self._obstacle
        if layer is None:
            return None
        grid, origin, res = self._obstacles, self.origin, self.resolution
        if self._forgotten:
            far = np.array((*origin, origin[0] + grid.shape[1] * res, origin[1] + grid.shape[0] * res))
            layers.widen(bounds, far)
            if self._cleared_by.size and self._sweeps:
                grid[self._cleared_by >= self._sweeps[0].number] = layers.FREE
            self._forgotten = False
        for sweep in self._sweeps:
            if layer.clearing and not sweep.traced:
                x, y = sweep.sensor[0], sweep.sensor[1]
                layers.clear_rays(
                    grid,
                    origin,
                    res,
                    sweep.points,
                    x,
                    y,
                    layer.raytrace_range,
                    sweep.bounds,
                    self._cleared_by,
                    sweep.number,
                )
                sweep.traced = self._cleared_by.size > 0
        if self._sweeps:
            layers.widen(bounds, np.concatenate([sweep.bounds for sweep in self._sweeps]))
            if self._expired:
                gone = np.concatenate([sweep.marks for sweep in self._expired])
                layers.expire_points(grid, origin, res, gone, self._cleared_by, self._sweeps[0].number, bounds)
            layers.mark_points(grid, origin, res, np.concatenate([sweep.marks for sweep in self._sweeps]), bounds)
        self._expired.clear()
        if not layer.footprint_clearing_enabled:
            return None
        polygon = to_frame(self.footprint, pose)
        layers.widen(bounds, np.concatenate((polygon, polygon), axis=1).reshape(-1))  # each corner is a box of its own
        return polygon

    def _map_bounds(self, transform: FloatArray) -> FloatArray:
        if self._below is not None:  # a window in another frame: all of it
            rows, columns = self.cost.shape
            return np.array((*self.origin, *(self.origin + np.array((columns, rows)) * self.resolution)))
        assert self._map is not None
        rows, columns = self._map.data.shape
        corner = np.array(self._map.origin)
        return np.array((*corner, *(corner + np.array((columns, rows)) * self._map.resolution)))


class _Inflation:
    """The inflation layer: tables of its costs, and the queue that `layers.inflate` works with."""

    def __init__(
        self, parameters: InflationLayer, resolution: float, inscribed: float, rows: int, columns: int
    ) -> None:
        self.parameters = parameters
        reach = self._reach = math.ceil(parameters.inflation_radius / resolution)
        across = np.arange(-reach, reach + 1)
        up, across = (axis.reshape(-1) for axis in np.meshgrid(across, across, indexing="ij"))
        distance = np.hypot(across, up)
        ranks = np.unique(distance[distance <= reach])
        cost = inflation_cost(ranks * resolution, inscribed, parameters.cost_scaling_factor)
        ranks, self._cost = ranks[cost > 0], cost[cost > 0]  # no cost changes nothing
        side, outwards = 2 * reach + 1, [0] * distance.size
        self._moves = np.full((distance.size, 4, 4), layers.FAR, np.int32)
        for dx, dy in ((-1, 0), (0, -1), (1, 0), (0, 1)):
            there = np.hypot(across + dx, up + dy)
            for i in np.flatnonzero((there > distance) & (there <= ranks[-1])):
                rank = np.searchsorted(ranks, there[i])
                self._moves[i, outwards[i]] = rank, dx + dy * (columns + 2), dx + dy * columns, dx + dy * side
                outwards[i] += 1
        self._nearest: layers.RankGrid = np.full((rows + 2, columns + 2), -1, np.int16)
        self._tail = np.empty(len(ranks), np.int32)
        self._node = np.empty(
            (5 * rows * columns + len(ranks), 4), np.int32
        )  # each a source, and queued from four sides
        self._last: FloatArray | None = None

    def widen(self, bounds: FloatArray) -> None:
        """Widen what is updated by what was the last time, and by the inflation radius; the first time to everything."""
        before, self._last = self._last, bounds.copy()
        if before is None:
            bounds[:] = -layers.NO_BOUND, -layers.NO_BOUND, layers.NO_BOUND, layers.NO_BOUND
            return
        layers.widen(bounds, before)
        bounds[:2] -= self.parameters.inflation_radius
        bounds[2:] += self.parameters.inflation_radius

    def apply(self, cost: ByteGrid, window: npt.NDArray[np.int64]) -> None:
        """Inflate the lethal cells in and around the window."""
        if self._reach == 0:
            return
        layers.inflate(
            cost,
            window,
            self._reach,
            self._moves,
            self._cost,
            self.parameters.inflate_unknown,
            self._nearest,
            self._tail,
            self._node,
        )


def inflation_cost(distance: FloatArray, inscribed: float, scaling: float) -> ByteGrid:
    """Cost at a distance [m] from an obstacle's cell: 254 there, 253 within the inscribed radius, then exponential decay."""
    decay = np.floor((layers.INSCRIBED - 1) * np.exp(-scaling * np.maximum(distance - inscribed, 0.0)))
    cost = np.where(distance <= inscribed, layers.INSCRIBED, decay)
    return np.where(distance == 0, layers.LETHAL, cost).astype(np.uint8)


def interpret(map: OccupancyGrid, layer: StaticLayer) -> ByteGrid:
    """The static layer's costs of an occupancy grid (StaticLayer::interpretValue)."""
    value = map.data.astype(np.int64)
    known = np.zeros(value.shape, np.uint8)
    if not layer.trinary_costmap:
        known = (value.clip(0) / max(layer.lethal_cost_threshold, 1) * layers.LETHAL).astype(np.uint8)
    known[value >= layer.lethal_cost_threshold] = layers.LETHAL
    known[value == UNKNOWN_CELL] = layers.UNKNOWN if layer.track_unknown_space else layers.FREE
    return np.ascontiguousarray(known)


def cells_within(
    bounds: FloatArray, origin: FloatArray, resolution: float, shape: tuple[int, ...]
) -> npt.NDArray[np.int64]:
    """The window of cells (4,) r0, r1, c0, c1 that `bounds` (4,) smallest x, y, largest x, y touch, held inside the map
    (worldToMapEnforceBounds)."""

    def held(value: float, begin: float, cells: int) -> int:
        if value < begin:
            return 0
        return cells - 1 if value >= resolution * cells + begin else int((value - begin) / resolution)

    columns = [held(bounds[i], origin[0], shape[1]) for i in (0, 2)]
    rows = [held(bounds[i], origin[1], shape[0]) for i in (1, 3)]
    return np.array((rows[0], rows[1] + 1, columns[0], columns[1] + 1))


def shift(grid: npt.NDArray[Any], across: int, up: int, fill: int) -> npt.NDArray[Any]:
    """The grid's window moved by (across, up) cells; what was outside of it is `fill`."""
    rows, columns = grid.shape
    r0, r1, c0, c1 = max(0, -up), rows - max(0, up), max(0, -across), columns - max(0, across)
    if r1 <= r0 or c1 <= c0:
        return np.full_like(grid, fill)
    moved = np.empty_like(grid)
    moved[:r0], moved[r1:], moved[:, :c0], moved[:, c1:] = fill, fill, fill, fill
    moved[r0:r1, c0:c1] = grid[r0 + up : r1 + up, c0 + across : c1 + across]
    return moved

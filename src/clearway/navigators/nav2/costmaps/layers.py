"""Nav2's costmap layers, each with what it holds, how far it changed, and how it is laid over the master grid."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np

from clearway.contract import Scan
from clearway.geometry.frames import compose
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps import layers as shared
from clearway.navigators.common.costmaps.costmap import interpret, shift
from clearway.navigators.common.costmaps.layers import FREE, LETHAL, UNKNOWN, ByteGrid
from clearway.navigators.common.costmaps.parameters import StaticLayer as Interpretation
from clearway.navigators.nav2.costmaps import kernels
from clearway.navigators.nav2.costmaps.kernels import Window
from clearway.navigators.nav2.parameters import costmaps as parameters

_NO_STAMPS: shared.IntGrid = np.zeros((0, 0), np.int32)

_PRECISION = 100
"""Costs are looked up by a distance that is rounded to so many parts of a cell (InflationLayer::COST_LUT_PRECISION)."""


class Place(NamedTuple):
    """Where a costmap is during an update.

    Attributes:
        pose: (3,) of the robot in the costmap's frame.
        polygon: (m, 2) its padded outline there, m.
        transform: (3,) pose of the costmap's frame in the map.
        origin: (2,) of the costmap's lower-left corner, m.
        resolution: m.
    """

    pose: FloatArray
    polygon: FloatArray
    transform: FloatArray
    origin: FloatArray
    resolution: float


class Layer(Protocol):
    """A layer of a costmap.

    Attributes:
        name: In the file.
        clearable: Whether clearing a region clears it.
    """

    name: str
    clearable: bool

    def roll(self, across: int, up: int) -> None:
        """The costmap's window moved by so many cells."""

    def widen(self, place: Place, bounds: FloatArray) -> None:
        """Take in what is new, and widen `bounds` (4,) smallest x, y, largest x, y by what changed."""

    def lay(self, place: Place, master: ByteGrid, window: Window) -> None:
        """Lay it over the master grid."""

    def reset(self) -> None:
        """Forget what was seen."""


class StaticLayer:
    """The map (static_layer.cpp)."""

    clearable = False

    def __init__(self, name: str, own: parameters.StaticLayer, costmap: parameters.Costmap, map: OccupancyGrid) -> None:
        self.name, self._own, self._map = name, own, map
        self._rolling, self._maximum = costmap.rolling_window, costmap.use_maximum
        meaning = Interpretation(
            track_unknown_space=costmap.track_unknown_space,
            lethal_cost_threshold=costmap.lethal_cost_threshold,
            trinary_costmap=costmap.trinary_costmap,
        )
        self._grid = interpret(map, meaning)
        self._new = True
        self._under: FloatArray = np.zeros((0, 2))  # the robot's outline on the map, as of the last news

    def roll(self, across: int, up: int) -> None:
        """See `Layer`: a map does not move."""

    def widen(self, place: Place, bounds: FloatArray) -> None:
        """See `Layer`: everything while it is new, or while the window rolls over it."""
        if not self._rolling and not self._new:
            return
        rows, columns = self._grid.shape
        corner, size = np.array(self._map.origin), np.array((columns, rows)) * self._map.resolution
        if self._rolling:
            corner, size = np.array((-shared.NO_BOUND,) * 2), np.full(2, 2 * shared.NO_BOUND)
        shared.widen(bounds, np.array((*corner, *(corner + size))))
        if self._own.footprint_clearing_enabled:
            shared.widen(bounds, _corners(place.polygon))
            self._under = self._polygon_on_map(place)
        self._new = False

    def lay(self, place: Place, master: ByteGrid, window: Window) -> None:
        """See `Layer`: where it rolls, by the map's cells alone, of which an unknown one costs most."""
        grid, origin, resolution = self._grid, np.array(self._map.origin), self._map.resolution
        if self._own.footprint_clearing_enabled:
            grid = grid.copy() if self._own.restore_cleared_footprint else grid
            shared.fill_polygon(grid, origin, resolution, self._under, FREE)
        if not self._rolling:
            kernels.combine(master, window, grid, 1 if self._maximum else 3)
            return
        below = master.copy()
        shared.project_static(grid, origin, resolution, place.transform, below, place.origin, place.resolution, -1)
        cells = slice(window[0], window[1]), slice(window[2], window[3])
        master[cells] = np.maximum(master, below)[cells] if self._maximum else below[cells]

    def _polygon_on_map(self, place: Place) -> FloatArray:
        t = place.transform
        c, s = math.cos(t[2]), math.sin(t[2])
        return np.ascontiguousarray(place.polygon @ np.array(((c, s), (-s, c))) + t[:2])

    def reset(self) -> None:
        """See `Layer`: all of it is laid anew."""
        self._new = True


class _Sweep(NamedTuple):
    """A buffered scan.

    Attributes:
        t: When it came, s.
        points: (n, 2) ends of its rays in the costmap's frame, m.
        sensor: (3,) its pose there.
    """

    t: float
    points: FloatArray
    sensor: FloatArray


class _Ear:
    """What a layer hears of the lidar through one of its sources (observation_buffer.cpp)."""

    def __init__(self, own: parameters.Source) -> None:
        self.own = own
        self.sweeps: deque[_Sweep] = deque()

    def hear(self, t: float, scan: Scan, beams: FloatArray, sensor: FloatArray) -> None:
        points, _ = shared.scan_points(
            scan.ranges, beams, scan.range_min, scan.range_max, sensor, self.own.inf_is_valid, 0.0
        )
        self.sweeps.append(_Sweep(t, points, sensor))
        keep = self.own.observation_persistence
        while len(self.sweeps) > 1 and (keep == 0 or t - self.sweeps[0].t > keep + 1e-9):
            self.sweeps.popleft()


class ObstacleLayer:
    """What the lidar sees: an obstacle layer, or a voxel layer as it shows in the plane of a lidar.

    Args:
        name: In the file.
        own: Its parameters.
        sources: Those of its sensors.
        shape: (rows, columns) of the costmap.
        unknown: Whether the costmap tells unknown cells from free ones.
        height: Of the lidar above the ground, m; None: it is not known, and no bound of a height keeps it out.
    """

    clearable = True

    def __init__(
        self,
        name: str,
        own: parameters.ObstacleLayer,
        sources: list[parameters.Source],
        shape: tuple[int, int],
        unknown: bool,
        height: float | None,
    ) -> None:
        self.name, self._own = name, own
        self.default = UNKNOWN if unknown else FREE
        self.grid: ByteGrid = np.full(shape, self.default, np.uint8)
        heard = [
            source
            for source in sources
            if source.data_type == "LaserScan" and (height is None or source.keeps_out(height) is None)
        ]
        self._ears = [_Ear(source) for source in heard]
        self._marks = height is None or own.keeps_out(height) is None
        self._voxel = isinstance(own, parameters.VoxelLayer)
        self._clears, self._cleared = True, FREE
        if isinstance(own, parameters.VoxelLayer):
            self._clears = height is None or own.origin_z <= height < own.top
            self._marks = self._marks and own.mark_threshold == 0
            if own.z_voxels > own.unknown_threshold + 1:  # of a column's 16 bits, used or not, one is known
                self._cleared = UNKNOWN
        self._everything = False

    @property
    def keeps_scans(self) -> bool:
        """Whether every scan is to be buffered, not only the newest at an update."""
        return any(ear.own.observation_persistence > 0 for ear in self._ears)

    def hear(self, t: float, scan: Scan, beams: FloatArray, pose: FloatArray) -> None:
        """Take a scan that came at `t` [s] with the robot at `pose` (3,), costmap's frame; `beams` (n, 2) are its directions."""
        sensor = compose(pose, scan.mount)
        for ear in self._ears:
            ear.hear(t, scan, beams, sensor)

    def roll(self, across: int, up: int) -> None:
        """See `Layer`."""
        self.grid = shift(self.grid, across, up, self.default)

    def widen(self, place: Place, bounds: FloatArray) -> None:
        """See `Layer`: rays clear, then points mark."""
        grid, origin, res = self.grid, place.origin, place.resolution
        if self._everything:
            rows, columns = grid.shape
            shared.widen(bounds, np.array((*origin, origin[0] + columns * res, origin[1] + rows * res)))
            self._everything = False
        for ear in self._ears:
            if ear.own.clearing and self._clears:
                for sweep in ear.sweeps:
                    self._clear(ear.own, sweep, origin, res, bounds)
        for ear in self._ears:
            if ear.own.marking and self._marks:
                near, far = ear.own.obstacle_min_range, ear.own.obstacle_max_range
                for sweep in ear.sweeps:
                    x, y = sweep.sensor[0], sweep.sensor[1]
                    kernels.mark(grid, origin, res, sweep.points, x, y, near, far, self._voxel, bounds)
        if self._own.footprint_clearing_enabled:
            shared.widen(bounds, _corners(place.polygon))

    def _clear(
        self, own: parameters.Source, sweep: _Sweep, origin: FloatArray, resolution: float, bounds: FloatArray
    ) -> None:
        grid, points, x, y = self.grid, sweep.points, sweep.sensor[0], sweep.sensor[1]
        near, far = own.raytrace_min_range, own.raytrace_max_range
        if self._voxel:
            kernels.clear_voxel_rays(grid, origin, resolution, points, x, y, near, far, self._cleared, bounds)
        elif near > 0.0:
            kernels.clear_far_rays(grid, origin, resolution, points, x, y, near, far, bounds)
        else:
            shared.clear_rays(grid, origin, resolution, points, x, y, far, bounds, _NO_STAMPS, 0)

    def lay(self, place: Place, master: ByteGrid, window: Window) -> None:
        """See `Layer`."""
        if self._own.footprint_clearing_enabled:
            shared.fill_polygon(self.grid, place.origin, place.resolution, place.polygon, FREE)
        kernels.combine(master, window, self.grid, self._own.combination_method)

    def reset(self) -> None:
        """See `Layer`."""
        self.grid.fill(self.default)

    def forget(self, c0: int, r0: int, c1: int, r1: int, inside: bool) -> None:
        """Make cells unknown: those in the open range (c0, c1) x (r0, r1), or those outside (CostmapLayer::clearArea)."""
        rows, columns = self.grid.shape
        c0, c1 = min(max(c0, 0), columns), min(max(c1, 0), columns)
        r0, r1 = min(max(r0, 0), rows), min(max(r1, 0), rows)
        shared.forget(self.grid, c0, r0, c1, r1, inside)
        self._everything = True


class DenoiseLayer:
    """Frees obstacles of a few cells (denoise_layer.cpp)."""

    clearable = False

    def __init__(self, name: str, own: parameters.DenoiseLayer, unknown_too: bool) -> None:
        self.name, self._own, self._unknown_too = name, own, unknown_too

    def roll(self, across: int, up: int) -> None:
        """See `Layer`: it holds nothing."""

    def widen(self, place: Place, bounds: FloatArray) -> None:
        """See `Layer`: it changes nothing by itself."""

    def lay(self, place: Place, master: ByteGrid, window: Window) -> None:
        """See `Layer`."""
        if self._own.minimal_group_size > 1:
            corners = self._own.group_connectivity_type == 8
            kernels.denoise(master, window, self._own.minimal_group_size, corners, self._unknown_too)

    def reset(self) -> None:
        """See `Layer`: it holds nothing."""


class InflationLayer:
    """Costs around obstacles, by the exact distance to the nearest (inflation_layer.cpp)."""

    clearable = False

    def __init__(self, name: str, own: parameters.InflationLayer, resolution: float, inscribed: float) -> None:
        self.name, self.own = name, own
        self._reach = math.ceil(own.inflation_radius / resolution)
        inscribed = own.custom_inscribed_radius if own.custom_inscribed_radius >= 0.0 else inscribed
        self._costs = inflation_costs(self._reach, resolution, inscribed, own.cost_scaling_factor)
        self._last: FloatArray | None = None
        self._everything = True

    def roll(self, across: int, up: int) -> None:
        """See `Layer`: it holds nothing."""

    def widen(self, place: Place, bounds: FloatArray) -> None:
        """See `Layer`: by the radius around what changes now and what changed the last time."""
        if self._everything:
            self._everything, self._last = False, None
            bounds[:2], bounds[2:] = -shared.NO_BOUND, shared.NO_BOUND
            return
        before, self._last = self._last, bounds.copy()
        if before is not None:
            shared.widen(bounds, before)
        bounds[:2] -= self.own.inflation_radius
        bounds[2:] += self.own.inflation_radius

    def lay(self, place: Place, master: ByteGrid, window: Window) -> None:
        """See `Layer`."""
        if self._reach > 0:
            p = self.own
            kernels.inflate(master, window, self._reach, self._costs, p.inflate_unknown, p.inflate_around_unknown)

    def reset(self) -> None:
        """See `Layer`: all is inflated anew."""
        self._everything = True


def inflation_costs(reach: int, resolution: float, inscribed: float, scaling: float) -> ByteGrid:
    """Cost by squared distance to an obstacle's cell, in cells: (reach^2 + 1,) uint8."""
    cells = np.sqrt(np.arange(reach * reach + 1, dtype=np.float32))
    parts = np.floor(cells * np.float32(_PRECISION) + np.float32(0.5)).astype(np.int64)
    distance = np.minimum(parts, reach * _PRECISION + 1) / _PRECISION * resolution
    decay = np.floor((shared.INSCRIBED - 1) * np.exp(-scaling * np.maximum(distance - inscribed, 0.0)))
    cost = np.where(distance <= inscribed, shared.INSCRIBED, decay)
    return np.where(distance == 0.0, LETHAL, cost).astype(np.uint8)


def _corners(polygon: FloatArray) -> FloatArray:
    """Each corner as a box of its own."""
    return np.concatenate((polygon, polygon), axis=1).reshape(-1)

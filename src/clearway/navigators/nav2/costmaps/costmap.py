"""A costmap of Nav2: its layers in their order over one master grid (nav2_costmap_2d's Costmap2DROS, LayeredCostmap).

    scan --buffer--> obstacle, voxel layers --\\
    map  ----------> static layer  ------------+-- update (own rate) --> master grid, uint8 --view--> plug-ins
                     denoise, inflation -------/
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from clearway.contract import Scan
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import Circle, FloatArray, Polygon, circumscribed_radius, inscribed_radius
from clearway.navigators.common.costmaps.costmap import cells_within, shift
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.common.costmaps.layers import FREE, UNKNOWN, ByteGrid, directions
from clearway.navigators.common.costmaps.plans import to_frame
from clearway.navigators.nav2.costmaps.layers import (
    DenoiseLayer,
    InflationLayer,
    Layer,
    ObstacleLayer,
    Place,
    StaticLayer,
)
from clearway.navigators.nav2.parameters import costmaps as parameters
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.seams import CostView
from clearway.robots import Robot


def has_static_layer(branch: Branch) -> bool:
    """Whether a costmap shows the map."""
    groups = (part.group for part in branch.children.values())
    return any(isinstance(group, parameters.StaticLayer) and group.enabled for group in groups)


def refuse_without_map(name: str, branch: Branch) -> None:
    """
    Raises:
        ClearwayError: the costmap `name` has a static layer.
    """
    if has_static_layer(branch):
        raise ClearwayError(
            f"{name} has a static layer, which needs a map, and the task grants none; take it out of `plugins`",
            field=name,
        )


class Costmap:
    """One costmap of a robot.

    Attributes:
        name: `local_costmap` or `global_costmap`.
        cost: (rows, columns) uint8 master grid; 254 lethal, 253 inscribed, 255 unknown.
        origin: (2,) of its lower-left corner in its frame, m.
        resolution: Edge of a cell, m.
        footprint: (m, 2) padded outline in base_link, m.
        round: Whether the footprint is a radius, so that plans are checked at their centre.
        frame: `map` or `odom`.
        frequency: Of its updates, Hz.
        current: Whether it was updated since it was last cleared.
    """

    def __init__(self, name: str, branch: Branch, robot: Robot, map: OccupancyGrid | None) -> None:
        """
        Raises:
            ClearwayError: it has a static layer and there is no map.
        """
        p = self._parameters = cast("parameters.Costmap", branch.group)
        self.name, self.frame, self.frequency = name, p.global_frame, p.update_frequency
        shape = robot.planner_shape
        if p.footprint:
            shape = Polygon(tuple((float(x), float(y)) for x, y in p.footprint))
        elif "robot_radius" in branch.table:
            shape = Circle(p.robot_radius)
        self.round = isinstance(shape, Circle)
        self.footprint = outline(shape, p.footprint_padding)
        polygon = Polygon(tuple((float(x), float(y)) for x, y in self.footprint))
        self.inscribed, self.circumscribed = inscribed_radius(polygon), circumscribed_radius(polygon)
        self.resolution, self.origin = p.resolution, np.array((p.origin_x, p.origin_y))
        rows, columns = int(p.height / p.resolution), int(p.width / p.resolution)
        if map is None:
            refuse_without_map(name, branch)
        elif has_static_layer(branch) and not p.rolling_window:
            self.resolution, self.origin = map.resolution, np.array(map.origin)
            rows, columns = map.data.shape
        self._default = UNKNOWN if p.track_unknown_space else FREE
        self.cost: ByteGrid = np.full((rows, columns), self._default, np.uint8)
        height = robot.lidar.height if robot.lidar is not None else None
        self._layers = [made for layer in p.plugins if (made := self._layer(layer, branch, map, height)) is not None]
        self._seeing = [layer for layer in self._layers if isinstance(layer, ObstacleLayer)]
        inflations = [layer.own for layer in self._layers if isinstance(layer, InflationLayer)]
        self._scaling = inflations[0].cost_scaling_factor if inflations else 0.0
        self._inflation = inflations[0].inflation_radius if inflations else 0.0
        self.current = True

    def _layer(self, name: str, branch: Branch, map: OccupancyGrid | None, height: float | None) -> Layer | None:
        part, p = branch.children[name], self._parameters
        own = part.group
        if not getattr(own, "enabled", True):
            return None
        match own:
            case parameters.StaticLayer():
                assert map is not None
                return StaticLayer(name, own, p, map)
            case parameters.ObstacleLayer():
                sources = [cast("parameters.Source", source.group) for source in part.children.values()]
                return ObstacleLayer(name, own, sources, self.cost.shape, p.track_unknown_space, height)
            case parameters.DenoiseLayer():
                return DenoiseLayer(name, own, not p.track_unknown_space)
            case parameters.InflationLayer():
                return InflationLayer(name, own, self.resolution, self.inscribed)
        raise TypeError(f"{type(own).__name__} is no layer")

    @property
    def keeps_scans(self) -> bool:
        """Whether every scan is to be buffered, not only the newest at an update."""
        return any(layer.keeps_scans for layer in self._seeing)

    def buffer(self, t: float, scan: Scan, pose: FloatArray) -> None:
        """Take a scan that came at time t [s] with the robot at `pose` (3,), costmap's frame."""
        beams = directions(scan.ranges.size, scan.angle_min, scan.angle_increment)
        for layer in self._seeing:
            layer.hear(t, scan, beams, pose)

    def update(self, pose: FloatArray, transform: FloatArray) -> None:
        """Bring the master grid up to date (LayeredCostmap::updateMap).

        Args:
            pose: (3,) of the robot in the costmap's frame.
            transform: (3,) pose of the costmap's frame in the map.
        """
        if self._parameters.rolling_window:
            self._roll(pose)
        self.current = True
        if not self._layers:
            return
        place = Place(pose, to_frame(self.footprint, pose), transform, self.origin, self.resolution)
        bounds = np.array((math.inf, math.inf, -math.inf, -math.inf))
        for layer in self._layers:
            layer.widen(place, bounds)
        window = cells_within(bounds, self.origin, self.resolution, self.cost.shape)
        if window[1] <= window[0] or window[3] <= window[2]:
            return
        self.cost[window[0] : window[1], window[2] : window[3]] = self._default
        for layer in self._layers:
            layer.lay(place, self.cost, window)

    def view(self) -> CostView:
        """What plug-ins see of it."""
        return CostView(
            self.cost,
            self.origin,
            self.resolution,
            self.footprint,
            self.inscribed,
            self.circumscribed,
            self._scaling,
            self._inflation,
            self._parameters.track_unknown_space,
            self.round,
        )

    def layer_grid(self, name: str) -> ByteGrid | None:
        """A layer's own grid, None if it has none of that name."""
        return next((layer.grid for layer in self._seeing if layer.name == name), None)

    def clear(self, names: tuple[str, ...], pose: FloatArray, distance: float | None, *, around: bool) -> bool:
        """Forget what was seen (clear_costmap_service.cpp); nothing is current until the next update.

        Args:
            names: Layers that are cleared; none: all that can be.
            pose: (3,) of the robot in the costmap's frame.
            distance: Edge of a square around it, m; None: everything.
            around: Whether the square is cleared, and not what lies outside of it.

        Returns:
            Whether all those layers are there and can be cleared.
        """
        known = {layer.name: layer for layer in self._layers}
        if any(name not in known or not known[name].clearable for name in names):
            return False
        if distance is None:
            for layer in self._layers:
                if not names or layer.name in names:
                    layer.reset()
            self.cost.fill(self._default)
        else:
            low = ((pose[:2] - distance / 2 - self.origin) / self.resolution).astype(np.int64)
            high = ((pose[:2] + distance / 2 - self.origin) / self.resolution).astype(np.int64)
            for layer in self._seeing:
                if not names or layer.name in names:
                    layer.forget(int(low[0]), int(low[1]), int(high[0]), int(high[1]), around)
        self.current = False
        return True

    def _roll(self, pose: FloatArray) -> None:
        rows, columns = self.cost.shape
        res = self.resolution
        across = int((pose[0] - columns * res / 2 - self.origin[0]) / res)
        up = int((pose[1] - rows * res / 2 - self.origin[1]) / res)
        if across == 0 and up == 0:
            return
        self.origin = self.origin + np.array((across, up)) * res
        self.cost = shift(self.cost, across, up, self._default)
        for layer in self._layers:
            layer.roll(across, up)

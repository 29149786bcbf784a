"""Files of floor plans: walls and furniture as vectors, the map that a robot is given, and the protocol's line A-B.

A plan is one TOML file. Shipped plans have their ROS map (yaml + pgm) beside it; `python -m
clearway.scenarios.floor_plan_files` writes it anew from the TOML. A bare ROS map serves as a plan too: its occupied cells
are then the walls.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from dataclasses import replace
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path

import numpy as np
from pydantic import Field, ValidationError, model_validator

from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.rasterise import boundaries, explored, outline, rasterise, rectangles
from clearway.geometry.ros_map import read_map, write_map
from clearway.geometry.shapes import Polygon
from clearway.quantities import Coordinate, PoseSpec, Positive, Vertices, Whole
from clearway.reading import read_toml
from clearway.reading.limits import CELLS, CORNERS, DRAWN, FIXTURES, RECTANGLES
from clearway.scenarios.plan import Fixture, FloorPlan, Room
from clearway.scenarios.scenario import ShapeSpec
from clearway.validation import Table, first_problem

Box = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
"""x0, y0, x1, y1 [m], x0 < x1 and y0 < y1."""


FINEST = 0.05
"""Edge [m] of the cells on which ways through a plan are looked for, whatever its map's."""


def _ordered(box: Box | None) -> None:
    if box is not None and not (box[0] < box[2] and box[1] < box[3]):
        raise ValueError(f"{list(box)} must be [x0, y0, x1, y1] with x0 < x1 and y0 < y1")


class WallSpec(Table):
    """A wall: a `box` along the axes, or any polygon as `vertices`."""

    name: str
    box: Box | None = Field(default=None, description="x0, y0, x1, y1, m")
    vertices: Vertices | None = Field(default=None, description="m")

    @model_validator(mode="after")
    def _one_form(self) -> WallSpec:
        if (self.box is None) == (self.vertices is None):
            raise ValueError("a wall has either a box or vertices")
        _ordered(self.box)
        return self

    @property
    def polygon(self) -> Polygon:
        """The wall in the map frame."""
        if self.vertices is not None:
            return Polygon(self.vertices)
        assert self.box is not None
        x0, y0, x1, y1 = self.box
        return Polygon(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


class FurnitureSpec(Table):
    """A piece of furniture as the robot can touch it and its lidar sees it: one closed outline."""

    name: str
    shape: ShapeSpec
    pose: PoseSpec


class RoomSpec(Table):
    """A room's name and floor, for people: nothing that a robot could touch."""

    name: str
    kind: str = ""
    beds: Whole = Field(default=0, ge=0)
    floor: tuple[Box, ...] = Field(min_length=1, max_length=FIXTURES, description="disjoint boxes x0, y0, x1, y1, m")

    @model_validator(mode="after")
    def _boxes(self) -> RoomSpec:
        for box in self.floor:
            _ordered(box)
        return self


class FloorPlanSpec(Table):
    """A floor plan's file."""

    name: str = Field(min_length=1)
    title: str = Field(default="", description="as it is printed")
    map: str | None = Field(default=None, description="ROS map yaml beside this file; default: drawn from the vectors")
    resolution: Positive = Field(default=0.05, ge=0.005, le=1.0, description="of the drawn map, m")
    a: PoseSpec | None = Field(default=None, description="start of the protocol's line, heading to b")
    b: PoseSpec | None = Field(default=None, description="its end, same heading")
    clear: Box | None = Field(default=None, description="x0, y0, x1, y1 of the area kept clear around the line, m")
    area: Box | None = Field(
        default=None,
        description="x0, y0, x1, y1 that a robot's centre is to stay in, m; a plan without walls and map needs it",
    )
    walls: tuple[WallSpec, ...] = Field(
        default=(), max_length=FIXTURES, description="default: without an area the occupied cells of the map"
    )
    furniture: tuple[FurnitureSpec, ...] = Field(default=(), max_length=FIXTURES)
    rooms: tuple[RoomSpec, ...] = Field(default=(), max_length=FIXTURES, description="names and floors, for people")

    @model_validator(mode="after")
    def _consistent(self) -> FloorPlanSpec:
        _ordered(self.clear)
        _ordered(self.area)
        if not self.walls and self.area is None and self.map is None:
            raise ValueError(
                "a plan has walls, a map whose occupied cells they are, or an area that a robot is to stay in"
            )
        if (self.a is None) != (self.b is None):
            raise ValueError("a plan has both a and b, or neither")
        if self.a is not None and self.b is not None:
            if self.a[:2] == self.b[:2]:
                raise ValueError("a and b are the same place; a line has a length")
            along = math.atan2(self.b[1] - self.a[1], self.b[0] - self.a[0])
            if max(abs(math.remainder(h - along, math.tau)) for h in (self.a[2], self.b[2])) > 1e-6:
                raise ValueError(f"a and b must head along the line from a to b ({along:.4f} rad)")
        names = Counter([*(w.name for w in self.walls), *(f.name for f in self.furniture)])
        if twice := sorted(name for name, count in names.items() if count > 1):
            raise ValueError(f"the name {twice[0]!r} stands twice")
        return self


@cache
def _shipped() -> tuple[str, ...]:
    folder = resources.files("clearway.scenarios") / "plans"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def floor_plan_names() -> list[str]:
    """Names of the plans that come with Clearway as files; a suite may bring others, as BARN does its worlds."""
    return list(_shipped())


def is_path(which: str) -> bool:
    """Whether a floor plan is named by its file: the TOML of a plan, or the yaml of a ROS map."""
    return Path(which).suffix in (".toml", ".yaml", ".yml")


def load_file(path: Path) -> FloorPlan:
    """Read a floor plan from its file, again once that has changed.

    Raises:
        ClearwayError: no such file, or a field that is wrong.
    """
    try:
        changed = os.stat(path).st_mtime_ns
    except (OSError, ValueError):
        changed = 0  # reading it says what is wrong
    return _load(path, changed)


def load_shipped(name: str) -> FloorPlan:
    """One of `floor_plan_names()`."""
    return _load(_shipped_file(name), 0)


def _shipped_file(name: str) -> Path:
    return Path(str(resources.files("clearway.scenarios") / "plans" / f"{name}.toml"))


@lru_cache(maxsize=64)
def _load(path: Path, changed: int) -> FloorPlan:
    return _from_toml(path) if path.suffix == ".toml" else _from_map(path)


def read_floor_plan(path: Path) -> FloorPlanSpec:
    """Read and validate a plan's TOML file."""
    try:
        return FloorPlanSpec.model_validate(read_toml(path))
    except ValidationError as error:
        raise first_problem(error, FloorPlanSpec, file=path) from error


def draw_map(spec: FloorPlanSpec, margin: float = 0.2) -> OccupancyGrid:
    """The occupancy grid of a plan: what a perfect mapping run would give.

    The origin lies half a cell off a multiple of the resolution, so that a face drawn on a multiple runs through the
    middle of its cells and the map is unbiased.
    """
    fixtures = _fixtures(spec)
    x0, y0, x1, y1 = _bounds(fixtures)
    k = spec.resolution
    left, low = (round((math.floor((v - margin) / k) - 0.5) * k, 9) for v in (x0, y0))
    cols, rows = (math.ceil((high + margin - start) / k) for high, start in ((x1, left), (y1, low)))
    occupied = rasterise([(f.shape, f.pose) for f in fixtures], (rows, cols), k, (left, low))
    middles = [((a + c) / 2, (b + d) / 2) for room in spec.rooms for a, b, c, d in room.floor]
    seeds = [spec.a[:2]] if spec.a is not None else [p for p in middles if x0 < p[0] < x1 and y0 < p[1] < y1]
    cells = [(int((y - low) / k), int((x - left) / k)) for x, y in seeds]
    if not cells:
        return OccupancyGrid(np.where(occupied, 100, 0).astype(np.int8), k, (left, low))
    return OccupancyGrid(explored(occupied, cells), k, (left, low))


def _fixtures(spec: FloorPlanSpec) -> tuple[Fixture, ...]:
    walls = [Fixture(w.name, "wall", w.polygon, np.zeros(3)) for w in spec.walls]
    return (*walls, *(Fixture(f.name, "furniture", f.shape.shape(), np.array(f.pose)) for f in spec.furniture))


def _bounds(fixtures: tuple[Fixture, ...], area: Box | None = None) -> tuple[float, float, float, float]:
    corners = [] if area is None else [np.array(area).reshape(2, 2)]
    points = np.concatenate([outline(f.shape, f.pose) for f in fixtures] + corners)
    (x0, y0), (x1, y1) = points.min(0), points.max(0)
    return float(x0), float(y0), float(x1), float(y1)


def _from_toml(path: Path) -> FloorPlan:
    spec = read_floor_plan(path)
    if spec.map is not None and not spec.walls and spec.area is None:
        bare = _from_map(path.parent / spec.map)
        own = floor_plan_of(spec.model_copy(update={"area": bare.bounds}))
        _refuse_vast(path, spec, own.fixtures, bare.bounds)
        return replace(own, fixtures=(*bare.fixtures, *own.fixtures), map=bare.map, bounds=bare.bounds, area=None)
    _refuse_vast(path, spec, fixtures := _fixtures(spec), _bounds(fixtures, spec.area))
    return floor_plan_of(spec, None if spec.map is None else read_map(path.parent / spec.map))


def floor_plan_of(spec: FloorPlanSpec, grid: OccupancyGrid | None = None) -> FloorPlan:
    """The floor plan that `spec` describes.

    Args:
        spec: It.
        grid: The map that a robot is given; None: drawn from the vectors.
    """
    fixtures = _fixtures(spec)
    if grid is None and fixtures:  # where nothing stands there is nothing to know
        grid = draw_map(spec)
    a, b = (None if p is None else np.array(p) for p in (spec.a, spec.b))
    rooms = tuple(Room(r.name, r.kind, r.beds, r.floor) for r in spec.rooms)
    bounds = _bounds(fixtures, spec.area)
    return FloorPlan(spec.name, spec.title or spec.name, fixtures, grid, a, b, spec.clear, bounds, rooms, spec.area)


def _refuse_vast(
    path: Path, spec: FloorPlanSpec, fixtures: tuple[Fixture, ...], bounds: tuple[float, float, float, float]
) -> None:
    """Refuse a plan whose grid would fill the memory, or whose line A-B lies outside of it, before anything is drawn."""
    _refuse_extent(path, bounds, min(spec.resolution, FINEST))
    x0, y0, x1, y1 = bounds
    for name, pose in (("a", spec.a), ("b", spec.b)):
        if pose is not None and not (x0 <= pose[0] <= x1 and y0 <= pose[1] <= y1):
            raise ClearwayError(
                f"({pose[0]:g}, {pose[1]:g}) is outside the floor plan (x {x0:g} to {x1:g}, y {y0:g} to {y1:g})",
                file=path,
                field=name,
            )
    outlines = [outline(f.shape, f.pose) for f in fixtures]
    if (corners := sum(map(len, outlines))) > CORNERS:
        raise ClearwayError(f"its walls and furniture have {corners:,} corners; at most {CORNERS:,}", file=path)
    drawn = sum(float(np.prod(np.ptp(o, axis=0) / min(spec.resolution, FINEST) + 1)) for o in outlines)
    if drawn > DRAWN:
        raise ClearwayError(
            f"its walls and furniture cover {drawn:.3g} cells, one on top of the other; at most {DRAWN:,}", file=path
        )


def _refuse_extent(path: Path, bounds: tuple[float, float, float, float], resolution: float) -> None:
    x0, y0, x1, y1 = bounds
    cells = ((x1 - x0) / resolution + 1) * ((y1 - y0) / resolution + 1)
    if cells > CELLS:
        raise ClearwayError(
            f"extends over {x1 - x0:g} m x {y1 - y0:g} m: {cells:.3g} cells of {resolution:g} m; at most {CELLS:,}",
            file=path,
        )


def _from_map(path: Path) -> FloorPlan:
    grid = read_map(path)
    x0, y0 = grid.origin
    rows, cols = grid.data.shape
    bounds = (x0, y0, x0 + cols * grid.resolution, y0 + rows * grid.resolution)
    _refuse_extent(path, bounds, FINEST)
    if (count := rectangles(grid)) > RECTANGLES:
        raise ClearwayError(f"its walls are {count:,} rectangles of cells; at most {RECTANGLES:,} are read", file=path)
    fixtures = tuple(Fixture(_where(shape), "wall", shape, np.zeros(3)) for shape in boundaries(grid))
    return FloorPlan(path.stem, path.stem, fixtures, grid, None, None, None, bounds)


def _where(cells: Polygon) -> str:
    """The name of some of a map's occupied cells: by their middle, which no others have."""
    x, y = np.asarray(cells.vertices).mean(axis=0).round(3) + 0.0  # no -0
    return f"cells at {x:g}, {y:g}"


def write_shipped_maps() -> None:
    """Draw the maps of the shipped plans anew from their TOML files."""
    for name in floor_plan_names():
        path = _shipped_file(name)
        if read_floor_plan(path).walls:
            write_map(path.with_suffix(".yaml"), draw_map(read_floor_plan(path)))


if __name__ == "__main__":
    write_shipped_maps()

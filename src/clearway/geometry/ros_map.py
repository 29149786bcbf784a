"""ROS map files: what `map_server` reads and writes, a yaml beside a pgm or png.

The image's first row is the top of the map (highest y); the yaml's `origin` is the pose of the lower-left pixel's
corner. A pixel v is `p = (255 - v) / 255` occupied (`v / 255` with `negate`): occupied above `occupied_thresh`, free
below `free_thresh`, unknown between (ROS wiki, map_server, trinary mode; the default).
"""

from __future__ import annotations

import contextlib
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError, shown
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.reading import read_pgm, read_png, read_yaml
from clearway.reading.limits import COORDINATE, LENGTH, SHORTEST

PIXEL = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205}
"""What `map_saver` writes for each value."""

_KEYS = {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"}


def read_map(path: str | Path) -> OccupancyGrid:
    """Read a ROS map by its yaml file.

    Raises:
        ClearwayError: a file is missing or damaged, a value is wrong, the map is rotated or isn't trinary.
    """
    return _read(Path(path))[0]


def about_map(path: str | Path) -> list[str]:
    """What a ROS map is, for people: where it lies and what it holds, by which a wrong origin, resolution or threshold shows.

    Raises:
        ClearwayError: as for `read_map`.
    """
    grid, grey_is_free = _read(Path(path))
    (x, y), k, (rows, cols) = grid.origin, grid.resolution, grid.data.shape
    shares = ", ".join(
        f"{100 * np.mean(grid.data == value):.0f} % {name}"
        for value, name in ((FREE, "free"), (OCCUPIED, "occupied"), (UNKNOWN, "unknown"))
    )
    said = [f"x {x:g} to {x + cols * k:g} m, y {y:g} to {y + rows * k:g} m, cells of {k:g} m: {shares}"]
    if grey_is_free:
        said.append(
            f"its grey of {PIXEL[UNKNOWN]}, by which maps are saved where nothing is known, counts as free, as in Nav2; with "
            "free_thresh: 0.196 it is unknown"
        )
    return said


def _read(path: Path) -> tuple[OccupancyGrid, bool]:
    """The map, and whether some of it is free that looks as if its maker had written it as unknown."""
    table = _read_yaml(path)
    for key in ("image", "resolution", "origin"):
        if key not in table:
            raise ClearwayError("is missing", file=path, field=key)
    resolution = _number(table["resolution"], path, "resolution")
    if resolution <= 0:
        raise ClearwayError(f"{resolution} must be greater than 0 m", file=path, field="resolution")
    if not SHORTEST <= resolution <= LENGTH:
        raise ClearwayError(
            f"{resolution:g} m is no edge of a cell; {SHORTEST:g} to {LENGTH:g} m are", file=path, field="resolution"
        )
    origin = table["origin"]
    if not isinstance(origin, list) or len(origin) != 3:
        raise ClearwayError(f"{shown(origin)} must be [x, y, yaw]", file=path, field="origin")
    x, y, yaw = (_number(v, path, "origin") for v in origin)
    if max(abs(x), abs(y)) > COORDINATE:
        raise ClearwayError(
            f"({x:g}, {y:g}) lies farther than {COORDINATE:g} m from where the map is measured",
            file=path,
            field="origin",
        )
    if yaw != 0:
        raise ClearwayError(
            f"a rotated map (yaw {yaw:g}) isn't supported; with yaw 0 its places are turned about its lower-left corner by {-yaw:g} rad",
            file=path,
            field="origin",
        )
    occupied = _number(table.get("occupied_thresh", 0.65), path, "occupied_thresh")
    free = _number(table.get("free_thresh", 0.196), path, "free_thresh")
    if not 0 <= free <= occupied <= 1:
        raise ClearwayError(
            f"free_thresh {free} and occupied_thresh {occupied} must be in order within 0 and 1", file=path
        )
    if (mode := table.get("mode", "trinary")) != "trinary":
        instead = (
            "what lies between the thresholds is unknown with 'trinary'" if mode == "scale" else "save it as 'trinary'"
        )
        raise ClearwayError(f"{shown(mode)} isn't supported; {instead}", file=path, field="mode")
    if not isinstance(name := table["image"], str) or not os.path.isfile(path.parent / name):
        raise ClearwayError(f"{shown(name)} does not exist beside the yaml", file=path, field="image")
    if (negate := table.get("negate", 0)) not in (0, 1):
        raise ClearwayError(f"{shown(negate)} must be 0 or 1", file=path, field="negate")
    image = (read_png if name.lower().endswith(".png") else read_pgm)(path.parent / name)
    pixels = np.arange(image.top + 1, dtype=np.float64) * (255.0 / image.top) / 255.0  # of each value that there may be
    chance = pixels if negate else 1.0 - pixels
    meaning = np.full(chance.shape, UNKNOWN, dtype=np.int8)
    meaning[chance > occupied] = OCCUPIED
    meaning[chance < free] = FREE
    grey = PIXEL[UNKNOWN]
    grey_is_free = image.top == 255 and meaning[grey] == FREE and bool((image.pixels == grey).any())
    return OccupancyGrid(meaning[image.pixels[::-1]], resolution, (x, y)), grey_is_free


def write_map(path: str | Path, grid: OccupancyGrid) -> None:
    """Write `grid` as a ROS map: `path` is the yaml, the pgm goes beside it under the same name."""
    path = Path(path)
    image = path.with_suffix(".pgm")
    path.write_text(
        f"image: {image.name}\nresolution: {grid.resolution!r}\n"
        f"origin: [{float(grid.origin[0])!r}, {float(grid.origin[1])!r}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    pixels = np.full(grid.data.shape, PIXEL[UNKNOWN], dtype=np.uint8)
    pixels[grid.data == OCCUPIED] = PIXEL[OCCUPIED]
    pixels[grid.data == FREE] = PIXEL[FREE]
    rows, cols = (int(n) for n in grid.data.shape)
    image.write_bytes(f"P5\n{cols} {rows}\n255\n".encode() + pixels[::-1].tobytes())


def _read_yaml(path: Path) -> dict[str, Any]:
    table = read_yaml(path)
    if not isinstance(table, dict):
        raise ClearwayError(f"isn't a ROS map's yaml, which has the keys {', '.join(sorted(_KEYS))}", file=path)
    return table


def _number(value: object, path: Path, field: str) -> float:
    if isinstance(value, str):  # YAML 1.1 reads 1e-3 as text
        with contextlib.suppress(ValueError):
            value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ClearwayError(f"{shown(value)} must be a number", file=path, field=field)
    return float(value)

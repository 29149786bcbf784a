"""ROS map files: what `map_server` reads and writes, a yaml beside a pgm.

The image's first row is the top of the map (highest y); the yaml's `origin` is the pose of the lower-left pixel's
corner. A pixel v is `p = (255 - v) / 255` occupied (`v / 255` with `negate`): occupied above `occupied_thresh`, free
below `free_thresh`, unknown between (ROS wiki, map_server, trinary mode; the default).
"""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.shapes import FloatArray

PIXEL = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205}
"""What `map_saver` writes for each value."""

_KEYS = {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"}


def read_map(path: str | Path) -> OccupancyGrid:
    """Read a ROS map by its yaml file.

    Raises:
        ClearwayError: a file is missing or damaged, a value is wrong, the map is rotated or isn't trinary.
    """
    path = Path(path)
    table = _read_yaml(path)
    for key in ("image", "resolution", "origin"):
        if key not in table:
            raise ClearwayError("is missing", file=path, field=key)
    resolution = _number(table["resolution"], path, "resolution")
    if resolution <= 0:
        raise ClearwayError(f"{resolution} must be greater than 0 m", file=path, field="resolution")
    origin = table["origin"]
    if not isinstance(origin, list) or len(origin) != 3:
        raise ClearwayError(f"{origin!r} must be [x, y, yaw]", file=path, field="origin")
    x, y, yaw = (_number(v, path, "origin") for v in origin)
    if yaw != 0:
        raise ClearwayError(
            f"a rotated map (yaw {yaw}) isn't supported; turn the image so that yaw is 0", file=path, field="origin"
        )
    occupied = _number(table.get("occupied_thresh", 0.65), path, "occupied_thresh")
    free = _number(table.get("free_thresh", 0.196), path, "free_thresh")
    if not 0 <= free <= occupied <= 1:
        raise ClearwayError(
            f"free_thresh {free} and occupied_thresh {occupied} must be in order within 0 and 1", file=path
        )
    if (mode := table.get("mode", "trinary")) != "trinary":
        raise ClearwayError(f"{mode!r} isn't supported; use 'trinary'", file=path, field="mode")
    image = path.parent / str(table["image"])
    if not image.is_file():
        raise ClearwayError(f"{str(table['image'])!r} does not exist beside the yaml", file=path, field="image")
    pixels = read_pgm(image) / 255.0
    chance = pixels if table.get("negate", 0) else 1.0 - pixels
    data = np.full(chance.shape, UNKNOWN, dtype=np.int8)
    data[chance > occupied] = OCCUPIED
    data[chance < free] = FREE
    return OccupancyGrid(np.ascontiguousarray(data[::-1]), resolution, (x, y))


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


def read_pgm(path: str | Path) -> FloatArray:
    """The pixels (rows, cols) of a PGM image, plain (P2) or raw (P5), scaled to 0..255 float64; first row on top.

    Raises:
        ClearwayError: not a PGM, or it is cut short.
    """
    path = Path(path)
    raw = path.read_bytes()
    header = re.match(rb"(P[25])((?:\s+|#[^\n]*\n)+)(\d+)((?:\s+|#[^\n]*\n)+)(\d+)((?:\s+|#[^\n]*\n)+)(\d+)", raw)
    if header is None:
        raise ClearwayError("isn't a PGM image (P2 or P5)", file=path)
    cols, rows, top = int(header[3]), int(header[5]), int(header[7])
    if not (cols and rows and 0 < top < 65536):
        raise ClearwayError(f"size {cols} x {rows} or maximum {top} is wrong", file=path)
    body = raw[header.end() :]
    if header[1] == b"P2":
        words = re.sub(rb"#[^\n]*", b"", body).split()
        if not all(w.isdigit() for w in words):
            raise ClearwayError("holds something that isn't a number", file=path)
        values = np.array(words[: rows * cols], dtype=np.float64)
    else:
        comment = re.match(rb"(?:[ \t]*#[^\n]*)?\s", body)  # one white space ends the header
        start, wide = comment.end() if comment else 0, 2 if top > 255 else 1
        end = start + min(rows * cols, (len(body) - start) // wide) * wide
        values = np.frombuffer(body[start:end], dtype=">u2" if wide == 2 else np.uint8).astype(np.float64)
    if values.size < rows * cols:
        raise ClearwayError(f"is cut short: {values.size} of {rows * cols} pixels", file=path)
    if values.max() > top:
        raise ClearwayError(f"a pixel is {values.max():.0f}, above the maximum {top}", file=path)
    return values.reshape(rows, cols) * (255.0 / top)


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        table = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ClearwayError("no such file" if not path.exists() else str(error), file=path) from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ClearwayError(f"not a YAML file: {' '.join(str(error).split())}", file=path) from error
    if not isinstance(table, dict):
        raise ClearwayError(f"isn't a ROS map's yaml, which has the keys {', '.join(sorted(_KEYS))}", file=path)
    return table


def _number(value: object, path: Path, field: str) -> float:
    if isinstance(value, str):  # YAML 1.1 reads 1e-3 as text
        with contextlib.suppress(ValueError):
            value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ClearwayError(f"{value!r} must be a number", file=path, field=field)
    return float(value)

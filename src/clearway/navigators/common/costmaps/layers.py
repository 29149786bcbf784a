"""The costmap layers' inner loops, on uint8 grids (rows, columns) whose row 0 lies at the lowest y.

A grid's frame is the costmap's; `origin` is the lower-left corner of cell (0, 0), `resolution` the edge of a cell,
both in metres. A window is the half-open range of cells [r0, r1) x [c0, c1). Behaviour read from
ros-planning/navigation: costmap_2d/plugins/{static,obstacle,inflation}_layer.cpp, costmap_2d/src/costmap_2d.cpp,
costmap_2d/src/costmap_layer.cpp.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.lines import clipped

ByteGrid = npt.NDArray[np.uint8]
IntGrid = npt.NDArray[np.int32]
RankGrid = npt.NDArray[np.int16]

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
"""Costs with a meaning of their own (costmap_2d/cost_values.h)."""

FAR = np.int16(32767)
"""A rank beyond any."""

NO_BOUND = 3.4e38
"""A bound that holds any map (FLT_MAX, as in the inflation layer)."""

_SHIFT = 40
_ONE = 1 << _SHIFT
"""One as a fixed-point number."""


@kernel
def widen(bounds: FloatArray, by: FloatArray) -> None:
    """Widen `bounds` (4,) smallest x, y, largest x, y by others' (4 n,)."""
    for i in range(0, by.size, 4):
        bounds[0], bounds[1] = min(bounds[0], by[i]), min(bounds[1], by[i + 1])
        bounds[2], bounds[3] = max(bounds[2], by[i + 2]), max(bounds[3], by[i + 3])


@lru_cache(maxsize=4)
def directions(n: int, angle_min: float, increment: float) -> FloatArray:
    """(n, 2) of a scan's beams."""
    angle = angle_min + increment * np.arange(n)
    return np.stack((np.cos(angle), np.sin(angle)), axis=1)


@kernel
def scan_points(
    ranges: FloatArray,
    beams: FloatArray,
    range_min: float,
    range_max: float,
    sensor: FloatArray,
    inf_is_valid: bool,
    mark_range: float,
) -> tuple[FloatArray, FloatArray]:
    """Project a scan as laser_geometry does: a range outside [range_min, range_max) gives no point.

    Args:
        ranges: (n,) m.
        beams: (n, 2) unit vectors in the sensor's frame.
        sensor: (3,) its pose in the costmap's frame.
        inf_is_valid: An infinite range counts as range_max less 0.1 mm.
        mark_range: Farthest mark from the sensor, m.

    Returns:
        the points (m, 2), and (k, 2) those of them nearer than `mark_range`.
    """
    x, y = sensor[0], sensor[1]
    cosine, sine = math.cos(sensor[2]), math.sin(sensor[2])
    points, near = np.empty((ranges.size, 2)), np.empty((ranges.size, 2))
    m, k = 0, 0
    for i in range(ranges.size):
        r = ranges[i]
        if inf_is_valid and r == np.inf:
            r = range_max - 0.0001
        if range_min <= r < range_max:
            bx, by = beams[i, 0], beams[i, 1]
            points[m, 0] = x + r * (cosine * bx - sine * by)
            points[m, 1] = y + r * (sine * bx + cosine * by)
            if r < mark_range:
                near[k, 0], near[k, 1] = points[m, 0], points[m, 1]
                k += 1
            m += 1
    return points[:m], near[:k]


@kernel
def clear_rays(
    grid: ByteGrid,
    origin: FloatArray,
    resolution: float,
    points: FloatArray,
    x: float,
    y: float,
    reach: float,
    bounds: FloatArray,
    cleared_by: IntGrid,
    number: int,
) -> None:
    """Free the cells along the rays from the sensor at (x, y) to the points, at most `reach` metres (Bresenham).

    Args:
        bounds: (4,) smallest x, y, largest x, y that changed; widened.
        cleared_by: (rows, columns) int32, takes the scan's `number` where a ray passes; of size 0 if nobody asks.
    """
    rows, columns = grid.shape
    ox, oy = origin[0], origin[1]
    if x < ox or y < oy:
        return
    c0, r0 = int((x - ox) / resolution), int((y - oy) / resolution)
    if c0 >= columns or r0 >= rows:
        return
    far_x, far_y = ox + columns * resolution, oy + rows * resolution
    low_x, low_y = min(bounds[0], x), min(bounds[1], y)
    high_x, high_y = max(bounds[2], x), max(bounds[3], y)
    cells = grid.reshape(rows * columns)
    keep = cleared_by.size > 0
    stamps = cleared_by.reshape(cleared_by.size)
    longest = math.ceil(reach / resolution)
    last = -1
    for i in range(points.shape[0]):
        px, py = clipped(x, y, points[i, 0], points[i, 1], ox, oy, far_x, far_y)
        if px < ox or py < oy:
            continue
        c1, r1 = int((px - ox) / resolution), int((py - oy) / resolution)
        if c1 >= columns or r1 >= rows:
            continue
        length = math.hypot(px - x, py - y)
        scale = min(1.0, reach / length) if length > 0 else 1.0
        ex, ey = x + (px - x) * scale, y + (py - y) * scale
        low_x, low_y, high_x, high_y = min(low_x, ex), min(low_y, ey), max(high_x, ex), max(high_y, ey)
        end = r1 * columns + c1
        if end == last:
            continue  # the same line again
        last = end
        dx, dy = c1 - c0, r1 - r0
        nx, ny = abs(dx), abs(dy)
        step_x = 1 if dx > 0 else -1
        step_y = columns if dy > 0 else -columns
        distance = math.hypot(dx, dy)
        part = min(1.0, longest / distance) if distance > 0 else 1.0
        if nx >= ny:
            major, minor, step_major, step_minor = nx, ny, step_x, step_y
        else:
            major, minor, step_major, step_minor = ny, nx, step_y, step_x
        # After i steps along the longer side Bresenham's line is (major // 2 + i * minor) // major across. The quotient
        # is held as a fixed-point number, rounded up, which gives the same cells on any map that fits into memory.
        unit = _ONE // max(major, 1) + 1
        across, slope = (major // 2) * unit, minor * unit
        cell = r0 * columns + c0
        if keep:
            for _ in range(min(int(part * major), major) + 1):
                place = np.uint32(cell + (across >> _SHIFT) * step_minor)
                cells[place], stamps[place] = FREE, number
                cell += step_major
                across += slope
        else:
            for _ in range(min(int(part * major), major) + 1):
                cells[np.uint32(cell + (across >> _SHIFT) * step_minor)] = FREE
                cell += step_major
                across += slope
    bounds[0], bounds[1], bounds[2], bounds[3] = low_x, low_y, high_x, high_y


@kernel
def mark_points(grid: ByteGrid, origin: FloatArray, resolution: float, points: FloatArray, bounds: FloatArray) -> None:
    """Make the points' cells lethal; widens `bounds`."""
    rows, columns = grid.shape
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        if px < origin[0] or py < origin[1]:
            continue
        c, r = int((px - origin[0]) / resolution), int((py - origin[1]) / resolution)
        if c >= columns or r >= rows:
            continue
        grid[r, c] = LETHAL
        bounds[0], bounds[1] = min(bounds[0], px), min(bounds[1], py)
        bounds[2], bounds[3] = max(bounds[2], px), max(bounds[3], py)


@kernel
def expire_points(
    grid: ByteGrid,
    origin: FloatArray,
    resolution: float,
    points: FloatArray,
    cleared_by: IntGrid,
    oldest: int,
    bounds: FloatArray,
) -> None:
    """Free the cells that the points of a forgotten scan had marked, where a ray of a scan still kept has passed."""
    rows, columns = grid.shape
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        if px < origin[0] or py < origin[1]:
            continue
        c, r = int((px - origin[0]) / resolution), int((py - origin[1]) / resolution)
        if c < columns and r < rows and cleared_by[r, c] >= oldest:
            grid[r, c] = FREE
            bounds[0], bounds[1] = min(bounds[0], px), min(bounds[1], py)
            bounds[2], bounds[3] = max(bounds[2], px), max(bounds[3], py)


@kernel
def fill_polygon(grid: ByteGrid, origin: FloatArray, resolution: float, polygon: FloatArray, value: int) -> None:
    """Set the cells of a convex polygon (n, 2), outline included, unless a vertex lies off the grid."""
    rows, columns = grid.shape
    n = polygon.shape[0]
    vertex = np.empty((n, 2), np.int64)
    for i in range(n):
        if polygon[i, 0] < origin[0] or polygon[i, 1] < origin[1]:
            return
        vertex[i, 0] = int((polygon[i, 0] - origin[0]) / resolution)
        vertex[i, 1] = int((polygon[i, 1] - origin[1]) / resolution)
        if vertex[i, 0] >= columns or vertex[i, 1] >= rows:
            return
    left, right = vertex[:, 0].min(), vertex[:, 0].max()
    low = np.full(right - left + 1, rows)
    high = np.full(right - left + 1, -1)
    for i in range(n):
        c, r = vertex[i]
        dx, dy = vertex[(i + 1) % n] - vertex[i]
        nx, ny = abs(dx), abs(dy)
        step_c, step_r = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        major, minor = max(nx, ny), min(nx, ny)
        error = major // 2
        for _ in range(major + 1):
            low[c - left], high[c - left] = min(low[c - left], r), max(high[c - left], r)
            error += minor
            turn = error >= major
            if turn:
                error -= major
            if nx >= ny or turn:
                c += step_c
            if nx < ny or turn:
                r += step_r
    for c in range(left, right + 1):
        for r in range(low[c - left], high[c - left] + 1):
            grid[r, c] = value


@kernel
def compose(
    master: ByteGrid, window: npt.NDArray[np.int64], fill: int, below: ByteGrid, obstacles: ByteGrid, overwrite: bool
) -> None:
    """Rebuild a window of the master grid: the static layer (or `fill`), then the obstacle layer.

    Args:
        window: (4,) r0, r1, c0, c1.
        below: The static layer's grid, or one of size 0.
        obstacles: The obstacle layer's grid, or one of size 0.
        overwrite: The obstacle layer overwrites wherever it knows; else the larger cost wins.
    """
    columns = window[3] - window[2]
    blank = np.full(columns, np.uint8(fill))
    for r in range(window[0], window[1]):
        row = master[r, window[2] : window[3]]
        base = below[r, window[2] : window[3]] if below.size else blank
        if obstacles.size == 0:
            row[:] = base
            continue
        top = obstacles[r, window[2] : window[3]]
        if overwrite:
            for c in range(columns):
                row[c] = base[c] if top[c] == UNKNOWN else top[c]
        else:
            for c in range(columns):  # modulo 256 an unknown cell loses against any other
                row[c] = max(np.uint8(top[c] + 1), np.uint8(base[c] + 1)) - np.uint8(1)


@kernel
def project_static(
    static: ByteGrid,
    origin: FloatArray,
    resolution: float,
    transform: FloatArray,
    target: ByteGrid,
    target_origin: FloatArray,
    target_resolution: float,
    fill: int,
) -> None:
    """Lay a static map under a rolling window in another frame: each cell's centre takes the map's cost there.

    Args:
        static: (rows, columns) in the map's frame, with `origin` and `resolution`.
        target: (rows, columns), written.
        transform: (3,) pose of the target's frame in the map's.
        fill: Where the map does not reach; negative: what is there stays.
    """
    cosine, sine = math.cos(transform[2]), math.sin(transform[2])
    for r in range(target.shape[0]):
        y = target_origin[1] + (r + 0.5) * target_resolution
        for c in range(target.shape[1]):
            x = target_origin[0] + (c + 0.5) * target_resolution
            mx = transform[0] + cosine * x - sine * y - origin[0]
            my = transform[1] + sine * x + cosine * y - origin[1]
            if fill >= 0:
                target[r, c] = fill
            if mx >= 0 and my >= 0:
                mc, mr = int(mx / resolution), int(my / resolution)
                if mc < static.shape[1] and mr < static.shape[0]:
                    target[r, c] = static[mr, mc]


@kernel
def forget(grid: ByteGrid, c0: int, r0: int, c1: int, r1: int, inside: bool) -> None:
    """Make cells unknown: those outside of the open range (c0, c1) x (r0, r1), or those inside (CostmapLayer::clearArea)."""
    for r in range(grid.shape[0]):
        for c in range(grid.shape[1]):
            if (c0 < c < c1 and r0 < r < r1) == inside:
                grid[r, c] = UNKNOWN


@kernel
def inflate(
    grid: ByteGrid,
    window: npt.NDArray[np.int64],
    reach: int,
    moves: IntGrid,
    cost_of: ByteGrid,
    unknown_too: bool,
    nearest: RankGrid,
    tail: IntGrid,
    node: IntGrid,
) -> None:
    """Spread the cost of lethal cells around them, each cell from the source that reaches it first.

    Cells are visited in the order of their Euclidean distance to their source, through four-neighbours, as ROS does;
    a cell is queued again only for a source that is nearer than the one that it is queued for. A source spreads only
    outwards: the cell that lies one step nearer to it has always been queued for it, or for a nearer one, before.

    Args:
        window: (4,) r0, r1, c0, c1 of what changed; sources up to `reach` cells around it count.
        moves: ((2 reach + 1)^2, 4, 4) int32. Row (reach + dy) (2 reach + 1) + reach + dx is for a cell that lies (dx,
            dy) from its source: up to four neighbours further out, each with its rank by distance and the steps there
            in `nearest`, in `grid` and in `moves`; rank `FAR` ends the list.
        cost_of: (ranks,) uint8, cost of a rank.
        nearest: (rows + 2, columns + 2) int16, the rank that a cell is queued with; the outermost ring is below any.
        tail: (ranks,) int32, the end of each rank's queue.
        node: (nodes, 4) int32, what is queued: index in `nearest`, in `grid`, row of `moves`, next node.
    """
    rows, columns = grid.shape
    centre, ranks = moves.shape[0] // 2, tail.size
    first, last = max(0, window[2] - 2 * reach) + 1, min(columns, window[3] + 2 * reach) + 1
    for r in range(max(0, window[0] - 2 * reach), min(rows, window[1] + 2 * reach)):
        nearest[r + 1, first:last] = FAR
    nearest, cells = nearest.reshape(nearest.size), grid.reshape(grid.size)
    for rank in range(ranks):  # each queue begins with a node that holds nothing
        tail[rank], node[rank, 3] = rank, -1
    count = ranks
    c0, c1 = max(0, window[2] - reach), min(columns, window[3] + reach)
    lethal = np.uint8(LETHAL)
    for r in range(max(0, window[0] - reach), min(rows, window[1] + reach)):
        for begin in range(c0, c1, 32):  # most have none: one look at 32 cells
            line = grid[r, begin : min(begin + 32, c1)]
            some = False
            for value in line:
                some |= value == lethal
            if not some:
                continue
            for i in range(line.size):
                if line[i] == lethal:
                    cell = (r + 1) * (columns + 2) + begin + i + 1
                    nearest[cell] = 0
                    node[count, 0], node[count, 1], node[count, 2] = cell, r * columns + begin + i, centre
                    node[count, 3] = -1
                    node[tail[0], 3] = count
                    tail[0] = count
                    count += 1
    for rank in range(ranks):
        cost = cost_of[rank]
        current = np.int64(node[rank, 3])
        while current >= 0:
            cell, place, offset = np.int64(node[current, 0]), np.int64(node[current, 1]), np.int64(node[current, 2])
            current = np.int64(node[current, 3])
            if nearest[cell] != rank:
                continue
            old = cells[place]
            if old != UNKNOWN:
                cells[place] = max(cost, old)
            elif cost >= INSCRIBED or (unknown_too and cost > FREE):
                cells[place] = cost
            for k in range(4):
                there = moves[offset, k, 0]
                if there == FAR:
                    break
                beside = cell + moves[offset, k, 1]
                if there >= nearest[beside]:
                    continue
                nearest[beside] = there
                node[count, 0], node[count, 1] = beside, place + moves[offset, k, 2]
                node[count, 2], node[count, 3] = offset + moves[offset, k, 3], -1
                node[tail[there], 3] = count
                tail[there] = count
                count += 1

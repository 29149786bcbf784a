"""What Nav2's layers do otherwise than ROS 1's, compiled; grids and windows as in `common.costmaps.layers`.

Behaviour read from ros-navigation/navigation2: nav2_costmap_2d/plugins/{obstacle,voxel,inflation,denoise}_layer.cpp,
src/costmap_layer.cpp; nav2_util/raytrace_line_2d.hpp; nav2_voxel_grid/voxel_grid.hpp.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.layers import FREE, INSCRIBED, LETHAL, UNKNOWN, ByteGrid
from clearway.navigators.common.costmaps.lines import clipped

Window = npt.NDArray[np.int64]
"""(4,) r0, r1, c0, c1: the half-open range of cells [r0, r1) x [c0, c1)."""

_BACK = 1e-5
"""By so much of its length a ray that leaves the voxel grid ends before its edge."""


@kernel
def combine(master: ByteGrid, window: Window, layer: ByteGrid, method: int) -> None:
    """Lay a layer over the master grid within a window.

    Args:
        master: (rows, columns), written.
        window: Where.
        layer: (rows, columns).
        method: 0: it overwrites where it knows; 1: the larger cost wins, any against unknown; 2: the larger, but an
            unknown cell stays so; 3: it overwrites everywhere.
    """
    for r in range(window[0], window[1]):
        for c in range(window[2], window[3]):
            value, old = layer[r, c], master[r, c]
            if method == 3:
                master[r, c] = value
            elif value == UNKNOWN:
                continue
            elif method == 0 or (method == 1 and old == UNKNOWN) or (old != UNKNOWN and old < value):
                master[r, c] = value


@kernel
def mark(
    grid: ByteGrid,
    origin: FloatArray,
    resolution: float,
    points: FloatArray,
    x: float,
    y: float,
    near: float,
    far: float,
    voxel: bool,
    bounds: FloatArray,
) -> None:
    """Make the cells of those points lethal that lie in range of the sensor at (x, y); widens `bounds`.

    A voxel layer leaves out points at `far` itself; an obstacle layer keeps these, and leaves out cells that are, in
    whole cells, out of range, and everything while the sensor is off the map.
    """
    rows, columns = grid.shape
    ox, oy = origin[0], origin[1]
    c0, r0 = int((x - ox) / resolution), int((y - oy) / resolution)
    if not voxel and (x < ox or y < oy or c0 >= columns or r0 >= rows):
        return
    least, most = math.ceil(near / resolution), math.ceil(far / resolution)
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        squared = (px - x) * (px - x) + (py - y) * (py - y)
        if squared < near * near or squared > far * far or (voxel and squared >= far * far):
            continue
        if px < ox or py < oy:
            continue
        c, r = int((px - ox) / resolution), int((py - oy) / resolution)
        if c >= columns or r >= rows:
            continue
        if not voxel:
            cells = int(math.hypot(c - c0, r - r0))
            if cells > most or cells < least:
                continue
        grid[r, c] = LETHAL
        bounds[0], bounds[1] = min(bounds[0], px), min(bounds[1], py)
        bounds[2], bounds[3] = max(bounds[2], px), max(bounds[3], py)


@kernel
def _clear_line(
    cells: npt.NDArray[np.uint8],
    columns: int,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    most: int,
    least: int,
    value: int,
) -> None:
    """Set the cells on a line between two points [cells], from `least` cells on and at most `most` of it (Bresenham)."""
    length = math.hypot(x1 - x0, y1 - y0)
    if int(length) < least:
        return
    scale, fx, fy = 1.0, x0, y0
    if length > 0.0:
        scale = min(1.0, most / length)
        fx, fy = x0 + (x1 - x0) / length * least, y0 + (y1 - y0) / length * least
    dx, dy = int(x1) - int(fx), int(y1) - int(fy)
    nx, ny = abs(dx), abs(dy)
    step_x, step_y = (1 if dx > 0 else -1), (columns if dy > 0 else -columns)
    if nx >= ny:
        major, minor, step_major, step_minor = nx, ny, step_x, step_y
    else:
        major, minor, step_major, step_minor = ny, nx, step_y, step_x
    cell = int(fy) * columns + int(fx)
    error = major // 2
    for _ in range(min(int(scale * major), major)):
        cells[cell] = value
        cell += step_major
        error += minor
        if error >= major:
            cell += step_minor
            error -= major
    cells[cell] = value


@kernel
def _reached(bounds: FloatArray, x: float, y: float, px: float, py: float, near: float, far: float) -> None:
    """Widen `bounds` by how far a ray from (x, y) to (px, py) clears (ObstacleLayer::updateRaytraceBounds)."""
    length = math.hypot(px - x, py - y)
    if length < near:
        return
    scale = min(1.0, far / length) if length > 0.0 else 1.0
    ex, ey = x + (px - x) * scale, y + (py - y) * scale
    bounds[0], bounds[1] = min(bounds[0], ex), min(bounds[1], ey)
    bounds[2], bounds[3] = max(bounds[2], ex), max(bounds[3], ey)


@kernel
def clear_far_rays(
    grid: ByteGrid,
    origin: FloatArray,
    resolution: float,
    points: FloatArray,
    x: float,
    y: float,
    near: float,
    far: float,
    bounds: FloatArray,
) -> None:
    """What `common.costmaps.layers.clear_rays` does, but from `near` metres of the sensor on."""
    rows, columns = grid.shape
    ox, oy = origin[0], origin[1]
    c0, r0 = int((x - ox) / resolution), int((y - oy) / resolution)
    if x < ox or y < oy or c0 >= columns or r0 >= rows:
        return
    end_x, end_y = ox + columns * resolution, oy + rows * resolution
    cells = grid.reshape(rows * columns)
    most, least = math.ceil(far / resolution), math.ceil(near / resolution)
    bounds[0], bounds[1] = min(bounds[0], x), min(bounds[1], y)
    bounds[2], bounds[3] = max(bounds[2], x), max(bounds[3], y)
    for i in range(points.shape[0]):
        px, py = clipped(x, y, points[i, 0], points[i, 1], ox, oy, end_x, end_y)
        if px < ox or py < oy:
            continue
        c1, r1 = int((px - ox) / resolution), int((py - oy) / resolution)
        if c1 >= columns or r1 >= rows:
            continue
        _clear_line(cells, columns, float(c0), float(r0), float(c1), float(r1), most, least, FREE)
        _reached(bounds, x, y, px, py, near, far)


@kernel
def clear_voxel_rays(
    grid: ByteGrid,
    origin: FloatArray,
    resolution: float,
    points: FloatArray,
    x: float,
    y: float,
    near: float,
    far: float,
    value: int,
    bounds: FloatArray,
) -> None:
    """Clear along rays as a voxel layer does whose rays all lie at one height: they end two cells before their points.

    Args:
        grid: (rows, columns), written.
        origin: (2,) of its corner, m.
        resolution: m.
        points: (n, 2) ends of rays, m.
        x: Of the sensor, m.
        y: Of the sensor, m.
        near: From which distance on they clear, m.
        far: Up to which, m.
        value: What a cleared cell becomes: free, or unknown while most of its column's voxels are.
        bounds: (4,) of what changed, widened.
    """
    rows, columns = grid.shape
    ox, oy = origin[0], origin[1]
    sx, sy = (x - ox) / resolution, (y - oy) / resolution
    if x < ox or y < oy or sx >= columns or sy >= rows:
        return
    end_x, end_y = ox + columns * resolution, oy + rows * resolution
    cells = grid.reshape(rows * columns)
    most, least = math.ceil(far / resolution), math.ceil(near / resolution)
    last = -1
    for i in range(points.shape[0]):
        a, b = points[i, 0] - x, points[i, 1] - y
        length = math.hypot(a, b)
        short = max(min(1.0, (length - 2.0 * resolution) / length), 0.0) if length > 0.0 else 0.0
        px, py = x + short * a, y + short * b
        a, b = px - x, py - y
        t, outside = 1.0, False
        if px < ox:
            t, outside = min(t, (ox - x) / a), True
        if py < oy:
            t, outside = min(t, (oy - y) / b), True
        if px > end_x:
            t, outside = min(t, (end_x - x) / a), True
        if py > end_y:
            t, outside = min(t, (end_y - y) / b), True
        if outside:
            t = t - _BACK if t > 0.0 else t + _BACK if t < 0.0 else t
        px, py = x + a * t, y + b * t
        fx, fy = (px - ox) / resolution, (py - oy) / resolution
        if px < ox or py < oy or fx >= columns or fy >= rows:
            continue
        end = int(fy) * columns + int(fx)
        whole = least == 0 and math.hypot(fx - sx, fy - sy) <= most
        if not whole or end != last:  # else the same line again
            _clear_line(cells, columns, sx, sy, fx, fy, most, least, value)
        last = end if whole else -1
        _reached(bounds, x, y, px, py, near, far)


@kernel
def inflate(
    grid: ByteGrid, window: Window, reach: int, cost_of: ByteGrid, unknown_too: bool, around_unknown: bool
) -> None:
    """Give each cell of a window the cost of its distance to the nearest lethal cell, by exact Euclidean distance.

    Args:
        grid: (rows, columns), written within the window.
        window: Where.
        reach: How far costs go, cells.
        cost_of: (reach^2 + 1,) cost by squared distance in cells.
        unknown_too: Whether unknown cells get any cost, and not that of the inscribed radius only.
        around_unknown: Whether unknown cells count as lethal ones.
    """
    rows, columns = grid.shape
    top, bottom = max(0, window[0] - reach), min(rows, window[1] + reach)
    left, right = max(0, window[2] - reach), min(columns, window[3] + reach)
    height, width, far = bottom - top, right - left, reach + 1
    down = np.empty((height, width), np.int32)  # cells to the nearest source in the same column, at most `far`
    some = np.zeros(height, np.bool_)
    for r in range(height):
        for c in range(width):
            value = grid[top + r, left + c]
            if value == LETHAL or (around_unknown and value == UNKNOWN):
                down[r, c] = 0
            else:
                down[r, c] = min(down[r - 1, c] + 1, far) if r > 0 else far
    for r in range(height - 1, -1, -1):
        for c in range(width):
            if r + 1 < height and down[r + 1, c] + 1 < down[r, c]:
                down[r, c] = down[r + 1, c] + 1
            some[r] |= down[r, c] < far
    across = np.empty(far + 1, np.int64)  # how far a source reaches sideways at a distance down
    for d in range(far + 1):
        across[d] = int(math.sqrt(reach * reach - d * d)) if d <= reach else -1
    nearest = np.empty(width, np.int64)
    beyond = reach * reach + 1
    for r in range(window[0], window[1]):
        row = r - top
        if not some[row]:
            continue
        nearest[:] = beyond
        for c in range(width):
            d = down[row, c]
            if d == far:
                continue
            squared = np.int64(d * d)
            if squared < nearest[c]:
                nearest[c] = squared
            same_left = c > 0 and down[row, c - 1] <= d
            same_right = c + 1 < width and down[row, c + 1] <= d
            if not same_left:  # else that one is nearer to all further left
                for k in range(1, min(across[d], c) + 1):
                    nearest[c - k] = min(nearest[c - k], squared + k * k)
            if not same_right:
                for k in range(1, min(across[d], width - 1 - c) + 1):
                    nearest[c + k] = min(nearest[c + k], squared + k * k)
        for c in range(window[2] - left, window[3] - left):
            if nearest[c] == beyond:
                continue
            cost, old = cost_of[nearest[c]], grid[r, left + c]
            if old == UNKNOWN:
                if cost >= INSCRIBED or (unknown_too and cost > FREE):
                    grid[r, left + c] = cost
            elif cost > old:
                grid[r, left + c] = cost


@kernel
def denoise(grid: ByteGrid, window: Window, least: int, corners: bool, unknown_too: bool) -> None:
    """Free groups of fewer than `least` obstacle cells within a window.

    Args:
        grid: (rows, columns), written.
        window: Where; what lies outside of it is not looked at.
        least: Cells of a group that stays.
        corners: Whether cells that touch at a corner are of one group.
        unknown_too: Whether unknown cells are obstacles.
    """
    r0, r1, c0, c1 = window[0], window[1], window[2], window[3]
    seen = np.zeros((r1 - r0, c1 - c0), np.bool_)
    stack = np.empty(((r1 - r0) * (c1 - c0), 2), np.int32)
    for r in range(r0, r1):
        for c in range(c0, c1):
            if seen[r - r0, c - c0]:
                continue
            count, done = 1, 0
            stack[0, 0], stack[0, 1] = r, c
            while done < count:
                y, x = stack[done, 0], stack[done, 1]
                value = grid[y, x]
                if done == 0:
                    seen[y - r0, x - c0] = True
                    if not (value in (LETHAL, INSCRIBED) or (unknown_too and value == UNKNOWN)):
                        count = 0
                        break
                done += 1
                for j in range(max(y - 1, r0), min(y + 2, r1)):
                    for i in range(max(x - 1, c0), min(x + 2, c1)):
                        if seen[j - r0, i - c0] or not (corners or j == y or i == x):
                            continue
                        other = grid[j, i]
                        if other in (LETHAL, INSCRIBED) or (unknown_too and other == UNKNOWN):
                            seen[j - r0, i - c0] = True
                            stack[count, 0], stack[count, 1] = j, i
                            count += 1
            if 0 < count < least:
                for k in range(count):
                    grid[stack[k, 0], stack[k, 1]] = FREE

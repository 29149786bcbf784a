"""A second, slow, plain reading of Nav2's costmap: one cell, one ray, one layer after another.

Written from nav2_costmap_2d's layered_costmap.cpp, costmap_2d.cpp, the layers' sources and nav2_voxel_grid, without the
compiled ones. Grids are dictionaries of cells (column, row).
"""

from __future__ import annotations

import math

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255


class Grid:
    """What of Costmap2D is used."""

    def __init__(self, columns, rows, resolution, x, y, default):
        self.nx, self.ny, self.res, self.x, self.y, self.default = columns, rows, resolution, x, y, default
        self.at = {(i, j): default for i in range(columns) for j in range(rows)}

    def cell(self, x, y):
        if x < self.x or y < self.y:
            return None
        i, j = int((x - self.x) / self.res), int((y - self.y) / self.res)
        return (i, j) if i < self.nx and j < self.ny else None

    def held(self, x, y):
        i = 0 if x < self.x else self.nx - 1 if x >= self.res * self.nx + self.x else int((x - self.x) / self.res)
        j = 0 if y < self.y else self.ny - 1 if y >= self.res * self.ny + self.y else int((y - self.y) / self.res)
        return i, j

    def move(self, x, y):
        di, dj = int((x - self.x) / self.res), int((y - self.y) / self.res)
        old = self.at
        self.at = {(i, j): old.get((i + di, j + dj), self.default) for i, j in old}
        self.x, self.y = self.x + di * self.res, self.y + dj * self.res


class Bounds:
    def __init__(self):
        self.low, self.high = [1e300, 1e300], [-1e300, -1e300]

    def touch(self, x, y):
        self.low = [min(self.low[0], x), min(self.low[1], y)]
        self.high = [max(self.high[0], x), max(self.high[1], y)]


def line(x0, y0, x1, y1, most, least):
    """Cells of nav2_voxel_grid's raytraceLine with both ends at one height."""
    length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
    if int(length) < least:
        return []
    scale, fx, fy = 1.0, x0, y0
    if length > 0:
        scale = min(1.0, most / length)
        fx, fy = x0 + (x1 - x0) / length * least, y0 + (y1 - y0) / length * least
    dx, dy = int(x1) - int(fx), int(y1) - int(fy)
    sx, sy = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    i, j = int(fx), int(fy)
    cells = []
    if abs(dx) >= abs(dy):
        error = abs(dx) // 2
        for _ in range(min(int(scale * abs(dx)), abs(dx))):
            cells.append((i, j))
            i += sx
            error += abs(dy)
            if error >= abs(dx):
                j += sy
                error -= abs(dx)
    else:
        error = abs(dy) // 2
        for _ in range(min(int(scale * abs(dy)), abs(dy))):
            cells.append((i, j))
            j += sy
            error += abs(dx)
            if error >= abs(dy):
                i += sx
                error -= abs(dy)
    return [*cells, (i, j)]


def inside(polygon, grid):
    """Cells of a convex polygon as setConvexPolygonCost has them: from the lowest to the highest outline cell of a column."""
    corners = [grid.cell(x, y) for x, y in polygon]
    if any(c is None for c in corners):
        return set()
    outline = []
    for (i0, j0), (i1, j1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        dx, dy = i1 - i0, j1 - j0
        sx, sy = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        i, j, long, short = i0, j0, max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
        error = long // 2
        for _ in range(long + 1):
            outline.append((i, j))
            error += short
            turn = error >= long
            error -= long if turn else 0
            if abs(dx) >= abs(dy):
                i, j = i + sx, j + (sy if turn else 0)
            else:
                i, j = i + (sx if turn else 0), j + sy
    spans = {}
    for i, j in outline:
        low, high = spans.get(i, (j, j))
        spans[i] = min(low, j), max(high, j)
    return {(i, j) for i, (low, high) in spans.items() for j in range(low, high + 1)}


class Obstacles:
    """ObstacleLayer, or VoxelLayer with a lidar at one height; one source."""

    def __init__(self, grid, o, voxel):
        self.grid, self.o, self.voxel = grid, o, voxel
        self.scans = []

    def widen(self, bounds, polygon):
        g, o = self.grid, self.o
        for (sx, sy), points in self.scans:
            if o["clearing"]:
                (self.clear_voxels if self.voxel else self.clear)(sx, sy, points, bounds)
        for (sx, sy), points in self.scans:
            for x, y in points if o["marking"] else ():
                squared = (x - sx) ** 2 + (y - sy) ** 2
                if squared < o["obstacle_min_range"] ** 2 or squared > o["obstacle_max_range"] ** 2:
                    continue
                cell = g.cell(x, y)
                if cell is None:
                    continue
                if not self.voxel:
                    at = g.cell(sx, sy)
                    if at is None:
                        continue
                    apart = int(math.hypot(cell[0] - at[0], cell[1] - at[1]))
                    if apart > math.ceil(o["obstacle_max_range"] / g.res):
                        continue
                    if apart < math.ceil(o["obstacle_min_range"] / g.res):
                        continue
                g.at[cell] = LETHAL
                bounds.touch(x, y)
        if o["footprint_clearing_enabled"]:
            for x, y in polygon:
                bounds.touch(x, y)

    def reach(self, sx, sy, x, y, bounds):
        length = math.hypot(x - sx, y - sy)
        if length >= self.o["raytrace_min_range"]:
            scale = min(1.0, self.o["raytrace_max_range"] / length) if length > 0 else 1.0
            bounds.touch(sx + (x - sx) * scale, sy + (y - sy) * scale)

    def clear(self, sx, sy, points, bounds):
        g, o = self.grid, self.o
        at = g.cell(sx, sy)
        if at is None:
            return
        bounds.touch(sx, sy)
        ex, ey = g.x + g.nx * g.res, g.y + g.ny * g.res
        for x, y in points:
            a, b = x - sx, y - sy
            if x < g.x:
                x, y = g.x, sy + b * ((g.x - sx) / a)
            if y < g.y:
                x, y = sx + a * ((g.y - sy) / b), g.y
            if x > ex:
                x, y = ex - 0.001, sy + b * ((ex - sx) / a)
            if y > ey:
                x, y = sx + a * ((ey - sy) / b), ey - 0.001
            to = g.cell(x, y)
            if to is None:
                continue
            most, least = math.ceil(o["raytrace_max_range"] / g.res), math.ceil(o["raytrace_min_range"] / g.res)
            for cell in line(*at, *to, most, least):
                g.at[cell] = FREE
            self.reach(sx, sy, x, y, bounds)

    def clear_voxels(self, sx, sy, points, bounds):
        g, o = self.grid, self.o
        if g.cell(sx, sy) is None:
            return
        ex, ey = g.x + g.nx * g.res, g.y + g.ny * g.res
        for x, y in points:
            length = math.hypot(x - sx, y - sy)
            short = max(min(1.0, (length - 2 * g.res) / length), 0.0)
            a, b = short * (x - sx), short * (y - sy)
            x, y, t, out = sx + a, sy + b, 1.0, False
            for at, step, least, most in ((x, a, g.x, ex), (y, b, g.y, ey)):
                begin = sx if step is a else sy
                if at < least:
                    t, out = min(t, (least - begin) / step), True
                if at > most:
                    t, out = min(t, (most - begin) / step), True
            t -= 1e-5 if out and t > 0 else 0.0
            x, y = sx + a * t, sy + b * t
            if g.cell(x, y) is None:
                continue
            cells = [(sx - g.x) / g.res, (sy - g.y) / g.res, (x - g.x) / g.res, (y - g.y) / g.res]
            most, least = math.ceil(o["raytrace_max_range"] / g.res), math.ceil(o["raytrace_min_range"] / g.res)
            for cell in line(*cells, most, least):
                g.at[cell] = FREE
            self.reach(sx, sy, x, y, bounds)

    def lay(self, master, polygon, cells):
        g = self.grid
        if self.o["footprint_clearing_enabled"]:
            for cell in inside(polygon, g):
                g.at[cell] = FREE
        for cell in cells:
            value, old = g.at[cell], master.at[cell]
            if value == UNKNOWN:
                continue
            method = self.o["combination_method"]
            if method == 0 or (method == 1 and (old == UNKNOWN or old < value)):
                master.at[cell] = value
            if method == 2 and old != UNKNOWN and old < value:
                master.at[cell] = value


class Static:
    """StaticLayer; the map's cells have costs already."""

    def __init__(self, grid, o, rolling):
        self.grid, self.o, self.rolling = grid, o, rolling
        self.news, self.outline = True, []

    def widen(self, bounds, polygon, frame):
        g = self.grid
        if not self.rolling and not self.news:
            return
        if self.rolling:
            bounds.low, bounds.high = [-1e300] * 2, [1e300] * 2
        else:
            bounds.touch(g.x, g.y)
            bounds.touch(g.x + g.nx * g.res, g.y + g.ny * g.res)
        self.news = False
        if self.o["footprint_clearing_enabled"]:
            self.outline = [moved(x, y, frame) for x, y in polygon]
            for x, y in polygon:
                bounds.touch(x, y)

    def lay(self, master, cells, frame):
        kept = dict(self.grid.at)
        if self.o["footprint_clearing_enabled"]:
            for cell in inside(self.outline, self.grid):
                self.grid.at[cell] = FREE
        for i, j in cells:
            value, old = self.grid.at.get((i, j)), master.at[i, j]
            if self.rolling:
                there = moved(master.x + (i + 0.5) * master.res, master.y + (j + 0.5) * master.res, frame)
                if self.grid.cell(*there) is None:
                    continue
                value = self.grid.at[self.grid.cell(*there)]
                master.at[i, j] = max(value, old) if self.o["use_maximum"] else value
            elif not self.o["use_maximum"] or (value != UNKNOWN and (old == UNKNOWN or old < value)):
                master.at[i, j] = value
        if self.o["restore_cleared_footprint"]:
            self.grid.at = kept


def moved(x, y, frame):
    """A point of a frame that has a pose in the map, in the map."""
    c, s = math.cos(frame[2]), math.sin(frame[2])
    return frame[0] + c * x - s * y, frame[1] + s * x + c * y


class Inflation:
    """InflationLayer by brute force: every cell looks at every lethal one near it."""

    def __init__(self, o, inscribed):
        self.o, self.inscribed, self.last, self.all = o, inscribed, None, True

    def widen(self, bounds):
        if self.all:
            self.all, self.last = False, None
            bounds.low, bounds.high = [-1e300] * 2, [1e300] * 2
            return
        before, self.last = self.last, (list(bounds.low), list(bounds.high))
        if before is not None:
            bounds.touch(*before[0])
            bounds.touch(*before[1])
        r = self.o["inflation_radius"]
        bounds.low, bounds.high = [v - r for v in bounds.low], [v + r for v in bounds.high]

    def lay(self, master, cells):
        o, res = self.o, master.res
        reach = math.ceil(o["inflation_radius"] / res)
        if reach == 0:
            return
        window = set(cells)
        sources = [
            cell
            for cell, value in master.at.items()
            if value == LETHAL or (o["inflate_around_unknown"] and value == UNKNOWN)
        ]
        low = (min(i for i, _ in window) - reach, min(j for _, j in window) - reach)
        high = (max(i for i, _ in window) + reach, max(j for _, j in window) + reach)
        sources = [(i, j) for i, j in sources if low[0] <= i <= high[0] and low[1] <= j <= high[1]]
        new = {}
        for i, j in window:
            nearest = min(((i - a) ** 2 + (j - b) ** 2 for a, b in sources), default=10**9)
            if nearest > reach * reach:
                continue
            apart = int(math.sqrt(nearest) * 100 + 0.5) / 100
            if apart == 0:
                cost = LETHAL
            elif apart * res <= self.inscribed:
                cost = INSCRIBED
            else:
                cost = int(252 * math.exp(-o["cost_scaling_factor"] * (apart * res - self.inscribed)))
            old = master.at[i, j]
            if old == UNKNOWN:
                new[i, j] = cost if (cost > 0 if o["inflate_unknown"] else cost >= INSCRIBED) else UNKNOWN
            else:
                new[i, j] = max(old, cost)
        master.at.update(new)


def window(bounds, master):
    i0, j0 = master.held(*bounds.low)
    i1, j1 = master.held(*bounds.high)
    return [(i, j) for i in range(i0, i1 + 1) for j in range(j0, j1 + 1)]


def groups(cells, corners):
    """Connected groups of cells."""
    left, found = set(cells), []
    while left:
        group, todo = set(), [left.pop()]
        while todo:
            i, j = todo.pop()
            group.add((i, j))
            for a in (-1, 0, 1):
                for b in (-1, 0, 1):
                    if (i + a, j + b) in left and (corners or a == 0 or b == 0):
                        left.remove((i + a, j + b))
                        todo.append((i + a, j + b))
        found.append(group)
    return found

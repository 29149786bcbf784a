"""The half-planes that walls leave to a disc: van den Berg et al. 2011, section 5.4, in the details as RVO2 does it."""

from __future__ import annotations

import math

from clearway.crowds.bodies import Bodies, IntArray
from clearway.crowds.half_planes import EPSILON
from clearway.crowds.walls import Walls, from_edge
from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray


@light
def near_edges(x: float, y: float, reach: float, walls: Walls, found: IntArray, distance: FloatArray) -> int:
    """Find the edges that face (x, y) and are nearer to it than `reach` [m], by ascending distance.

    Args:
        found: (m,) int64, written: which; there is room for all edges.
        distance: (m,) written: their squared distances, m^2.

    Returns:
        How many there are.
    """
    count = 0
    for k in range(walls.length.shape[0]):
        rx, ry = x - walls.vertex[k, 0], y - walls.vertex[k, 1]
        side = walls.direction[k, 0] * ry - walls.direction[k, 1] * rx
        if side >= 0.0 or side <= -reach:
            continue
        dx, dy = from_edge(x, y, k, walls)
        d = dx * dx + dy * dy
        if d >= reach * reach:
            continue
        m = count
        while m > 0 and d < distance[m - 1]:
            found[m], distance[m] = found[m - 1], distance[m - 1]
            m -= 1
        found[m], distance[m] = k, d
        count += 1
    return count


@light
def wall_lines(i: int, bodies: Bodies, horizon: float, walls: Walls, edges: IntArray, lines: FloatArray) -> int:
    """Write to `lines` (m, 4) the half-planes of velocities that `edges`, nearest first, leave to body `i`.

    Returns:
        How many there are: an edge behind the line of a nearer one gives none.
    """
    position, velocity, radius = bodies.position[i], bodies.velocity[i], bodies.radius[i]
    count = 0
    for n in range(edges.shape[0]):
        k = edges[n]
        if not _covered(position, radius, horizon, k, walls, lines, count):
            count += _line(position, velocity, radius, horizon, k, walls, lines[count])
    return count


@light
def _covered(
    position: FloatArray, radius: float, horizon: float, k: int, walls: Walls, lines: FloatArray, count: int
) -> bool:  # fmt: skip
    """Whether all of edge `k` lies behind one of the lines that nearer edges made."""
    a, b = walls.vertex[k], walls.vertex[walls.following[k]]
    for j in range(count):
        px, py, dx, dy = lines[j, 0], lines[j, 1], lines[j, 2], lines[j, 3]
        least = radius / horizon - EPSILON
        first = ((a[0] - position[0]) / horizon - px) * dy - ((a[1] - position[1]) / horizon - py) * dx
        if first >= least:
            second = ((b[0] - position[0]) / horizon - px) * dy - ((b[1] - position[1]) / horizon - py) * dx
            if second >= least:
                return True
    return False


@light
def _line(
    position: FloatArray, velocity: FloatArray, radius: float, horizon: float, k: int, walls: Walls, line: FloatArray
) -> int:
    """Write the half-plane that edge `k` leaves to `line` (4,); 0 if it leaves all, else 1."""
    left, right = k, walls.following[k]  # its ends, as seen from the disc
    ex, ey = walls.direction[k, 0], walls.direction[k, 1]
    ax, ay = walls.vertex[left, 0] - position[0], walls.vertex[left, 1] - position[1]
    bx, by = walls.vertex[right, 0] - position[0], walls.vertex[right, 1] - position[1]
    along = -(ax * ex + ay * ey)
    before, beyond = along < 0.0, along > walls.length[k]
    close = abs(ax * ey - ay * ex) <= radius  # to the line through the edge

    if before and ax * ax + ay * ay <= radius * radius:
        if not walls.convex[left]:
            return 0
        return _stop(-ay, ax, line)
    if beyond and bx * bx + by * by <= radius * radius:
        if not walls.convex[right] or bx * walls.direction[right, 1] - by * walls.direction[right, 0] < 0.0:
            return 0  # no corner, or one that the next edge sees to
        return _stop(-by, bx, line)
    if not (before or beyond) and close:
        return _stop(-ex, -ey, line)

    if before and close:  # seen so obliquely that there is nothing but one corner of it
        if not walls.convex[left]:
            return 0
        right, bx, by = left, ax, ay
    elif beyond and close:
        if not walls.convex[right]:
            return 0
        left, ax, ay = right, bx, by
    lx, ly = _tangent(ax, ay, radius) if walls.convex[left] else (-ex, -ey)
    rx, ry = _tangent(bx, by, -radius) if walls.convex[right] else (ex, ey)

    # A leg that leads into the neighbouring edge is that edge; velocities beyond it are its affair.
    leave_left = leave_right = False
    if walls.convex[left]:
        p = walls.preceding[left]
        nx, ny = -walls.direction[p, 0], -walls.direction[p, 1]
        if lx * ny - ly * nx >= 0.0:
            lx, ly, leave_left = nx, ny, True
    if walls.convex[right]:
        nx, ny = walls.direction[right, 0], walls.direction[right, 1]
        if rx * ny - ry * nx <= 0.0:
            rx, ry, leave_right = nx, ny, True

    ax, ay, bx, by, radius = ax / horizon, ay / horizon, bx / horizon, by / horizon, radius / horizon
    fx, fy = velocity[0] - ax, velocity[1] - ay
    gx, gy = velocity[0] - bx, velocity[1] - by
    point = left == right
    cx, cy = bx - ax, by - ay
    t = 0.5 if point else (fx * cx + fy * cy) / (cx * cx + cy * cy)
    on_left, on_right = fx * lx + fy * ly, gx * rx + gy * ry
    if (t < 0.0 and on_left < 0.0) or (point and on_left < 0.0 and on_right < 0.0):
        return _round(ax, ay, fx, fy, radius, line)
    if t > 1.0 and on_right < 0.0:
        return _round(bx, by, gx, gy, radius, line)

    to_edge = to_left = to_right = math.inf
    if not (t < 0.0 or t > 1.0 or point):
        to_edge = (fx - t * cx) ** 2 + (fy - t * cy) ** 2
    if on_left >= 0.0:
        to_left = (fx - on_left * lx) ** 2 + (fy - on_left * ly) ** 2
    if on_right >= 0.0:
        to_right = (gx - on_right * rx) ** 2 + (gy - on_right * ry) ** 2
    if to_edge <= to_left and to_edge <= to_right:
        return _beside(ax, ay, -walls.direction[left, 0], -walls.direction[left, 1], radius, line)
    if to_left <= to_right:
        return 0 if leave_left else _beside(ax, ay, lx, ly, radius, line)
    return 0 if leave_right else _beside(bx, by, -rx, -ry, radius, line)


@light
def _tangent(x: float, y: float, radius: float) -> tuple[float, float]:
    """Unit vector from the origin past the disc of `radius` at (x, y): to its left; with a negative radius to its right."""
    far = x * x + y * y
    leg = math.sqrt(max(far - radius * radius, 0.0))
    return (x * leg - y * radius) / far, (x * radius + y * leg) / far


@light
def _stop(dx: float, dy: float, line: FloatArray) -> int:
    """No velocity to the right of (dx, dy): the disc touches."""
    length = math.sqrt(dx * dx + dy * dy)
    line[0], line[1], line[2], line[3] = 0.0, 0.0, dx / length, dy / length
    return 1


@light
def _round(x: float, y: float, wx: float, wy: float, radius: float, line: FloatArray) -> int:
    """The tangent to the disc of `radius` around (x, y) on the side of w, seen from there."""
    w = math.sqrt(wx * wx + wy * wy)
    line[2], line[3] = wy / w, -wx / w
    line[0], line[1] = x + radius * wx / w, y + radius * wy / w
    return 1


@light
def _beside(x: float, y: float, dx: float, dy: float, radius: float, line: FloatArray) -> int:
    """The line in the direction (dx, dy) that passes (x, y) at `radius`, on its left."""
    line[0], line[1], line[2], line[3] = x - radius * dy, y + radius * dx, dx, dy
    return 1

"""An exact 2-D lidar: the distance along each beam to the nearest segment or circle.

For each primitive the span of beams that can meet it is computed from the angle under which the sensor sees it, and
only these beams are intersected with it. All beams lie `increment` apart, so a primitive costs what it covers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import light
from clearway.geometry.packing import pack, place
from clearway.geometry.shapes import Circle, FloatArray, Shape

_BLUR = 3e-5  # rad: bearings are rough, so spans are widened by more than two of them can be wrong
_NARROW = 3.0
"""Beams within less than half a turn leave most of what is around aside, rad: that needs no look at the bearings."""
_APART = 1e-6  # m: more than rounding takes
_SLACK = 1e-12  # relative: a beam through the corner that two segments share must not slip between them


class Scene(NamedTuple):
    """What a lidar can see. Lengths are metres, in the frame of the owner.

    Attributes:
        segments: (m, 4) x0, y0, x1, y1 of segments, m.
        circles: (k, 3) x, y, radius of circles, m.
        segment_owner: (m,) int64, the body that each segment belongs to.
        circle_owner: (k,) int64, the body that each circle belongs to.
    """

    segments: FloatArray
    circles: FloatArray
    segment_owner: npt.NDArray[np.int64]
    circle_owner: npt.NDArray[np.int64]


class Beams(NamedTuple):
    """A lidar's beams in its own frame: beam i looks along `angle_min + i * increment`.

    Attributes:
        directions: (2, n) unit vectors of the beams.
        angle_min: Direction of beam 0, rad.
        increment: Angle from a beam to the next, rad.
        range_min: Shortest distance that is measured, m.
        range_max: Longest distance that is measured, m.
    """

    directions: FloatArray
    angle_min: float
    increment: float
    range_min: float
    range_max: float


def beams(count: int, angle_min: float, angle_max: float, range_min: float, range_max: float) -> Beams:
    """`count` beams spread evenly from `angle_min` to `angle_max` [rad], both included."""
    increment = (angle_max - angle_min) / (count - 1) if count > 1 else 0.0
    angles = angle_min + increment * np.arange(count)
    directions = np.ascontiguousarray(np.stack([np.cos(angles), np.sin(angles)]))
    return Beams(directions, float(angle_min), float(increment), float(range_min), float(range_max))


def scene(shapes: Sequence[Shape], poses: FloatArray | None = None) -> Scene:
    """The outlines of `shapes`: in one frame where `poses` (n, 3) are given, else each in its own."""
    packed = pack(shapes)
    if poses is not None:
        packed = place(packed, poses)
    rows: list[tuple[float, float, float, float]] = []
    discs: list[tuple[float, float, float]] = []
    row_owner: list[int] = []
    disc_owner: list[int] = []
    for i, shape in enumerate(shapes):
        points = packed.points[packed.first[i] : packed.first[i + 1]]
        if isinstance(shape, Circle):
            discs.append((points[0, 0], points[0, 1], shape.radius))
            disc_owner.append(i)
            continue
        ends = np.roll(points, -1, axis=0)[: len(points) if len(points) > 2 else 1]
        rows += [(p[0], p[1], q[0], q[1]) for p, q in zip(points, ends, strict=False)]
        row_owner += [i] * len(ends)
    return Scene(
        np.array(rows, dtype=np.float64).reshape(-1, 4),
        np.array(discs, dtype=np.float64).reshape(-1, 3),
        np.array(row_owner, dtype=np.int64),
        np.array(disc_owner, dtype=np.int64),
    )


def sweep(fixed: Scene, lidar: Beams, pose: FloatArray) -> FloatArray:
    """Ranges (n,) in metres that a lidar at `pose` (3,) measures without noise; inf where nothing is in range."""
    ranges = np.full(lidar.directions.shape[1], np.inf)
    x, y, theta = (float(p) for p in pose)
    cast(fixed.segments, fixed.circles, x, y, theta, lidar.directions, lidar.angle_min, lidar.increment,
         lidar.range_max, ranges)  # fmt: skip
    ranges[(ranges < lidar.range_min) | (ranges > lidar.range_max)] = np.inf
    return ranges


@light
def cast(
    segments: FloatArray, circles: FloatArray, x: float, y: float, theta: float,
    directions: FloatArray, angle_min: float, increment: float, range_max: float, ranges: FloatArray,
) -> None:  # fmt: skip
    """Lower `ranges` (n,) to the first hit of each beam of a sensor at (x, y, theta) on a fixed scene."""
    c, s = math.cos(theta), math.sin(theta)
    for i in range(segments.shape[0]):
        ax, ay = segments[i, 0] - x, segments[i, 1] - y
        bx, by = segments[i, 2] - x, segments[i, 3] - y
        hit_segment(c * ax + s * ay, c * ay - s * ax, c * bx + s * by, c * by - s * bx,
                    directions, angle_min, increment, range_max, ranges)  # fmt: skip
    for i in range(circles.shape[0]):
        px, py = circles[i, 0] - x, circles[i, 1] - y
        hit_circle(c * px + s * py, c * py - s * px, circles[i, 2],
                   directions, angle_min, increment, range_max, ranges)  # fmt: skip


@light
def cast_moving(
    segments: FloatArray, segment_owner: np.ndarray, circles: FloatArray, circle_owner: np.ndarray, poses: FloatArray,
    x: float, y: float, theta: float,
    directions: FloatArray, angle_min: float, increment: float, range_max: float, ranges: FloatArray,
) -> None:  # fmt: skip
    """`cast` on primitives given in the frames of their owners, which stand at `poses` (m, 3); NaN: absent."""
    c, s = math.cos(theta), math.sin(theta)
    for i in range(segments.shape[0]):
        pose = poses[segment_owner[i]]
        if math.isfinite(pose[0]):
            mc, ms = math.cos(pose[2]), math.sin(pose[2])
            ax = pose[0] + mc * segments[i, 0] - ms * segments[i, 1] - x
            ay = pose[1] + ms * segments[i, 0] + mc * segments[i, 1] - y
            bx = pose[0] + mc * segments[i, 2] - ms * segments[i, 3] - x
            by = pose[1] + ms * segments[i, 2] + mc * segments[i, 3] - y
            hit_segment(c * ax + s * ay, c * ay - s * ax, c * bx + s * by, c * by - s * bx,
                        directions, angle_min, increment, range_max, ranges)  # fmt: skip
    for i in range(circles.shape[0]):
        pose = poses[circle_owner[i]]
        if math.isfinite(pose[0]):
            mc, ms = math.cos(pose[2]), math.sin(pose[2])
            px = pose[0] + mc * circles[i, 0] - ms * circles[i, 1] - x
            py = pose[1] + ms * circles[i, 0] + mc * circles[i, 1] - y
            hit_circle(c * px + s * py, c * py - s * px, circles[i, 2],
                       directions, angle_min, increment, range_max, ranges)  # fmt: skip


@light
def hit_segment(
    ax: float, ay: float, bx: float, by: float,
    directions: FloatArray, angle_min: float, increment: float, range_max: float, ranges: FloatArray,
) -> None:  # fmt: skip
    """Lower `ranges` to where the beams meet the segment a-b, given in the sensor's frame."""
    ex, ey = bx - ax, by - ay
    length = ex * ex + ey * ey
    along = -(ax * ex + ay * ey)
    reach = range_max * range_max
    across = ax * ey - ay * ex  # twice the area of the triangle sensor, a, b
    if along <= 0.0 or length <= 0.0:
        if ax * ax + ay * ay > reach:
            return
    elif along >= length:
        if bx * bx + by * by > reach:
            return
    elif across * across > reach * length:
        return
    if _is_aside(ax, ay, bx, by, 0.0, directions, increment):
        return
    turn = _bearing(across, ax * bx + ay * by)  # under which the sensor sees the segment, from a to b
    if abs(turn) > 3.1:  # nearly on it: which side is a matter of rounding
        _segment_beams(ax, ay, ex, ey, across, 0, directions.shape[1], directions, ranges)
        return
    from_a = _bearing(ay, ax)
    low, high, period, again, last = spans(from_a, from_a + turn, directions.shape[1], angle_min, increment)
    while again <= last:
        begin = max(0, math.floor(low + again * period))
        end = min(directions.shape[1], math.ceil(high + again * period) + 1)
        _segment_beams(ax, ay, ex, ey, across, begin, end, directions, ranges)
        again += 1


@light
def hit_circle(
    px: float, py: float, radius: float,
    directions: FloatArray, angle_min: float, increment: float, range_max: float, ranges: FloatArray,
) -> None:  # fmt: skip
    """Lower `ranges` to where the beams meet the circle around p, given in the sensor's frame."""
    squared = px * px + py * py
    far = range_max + radius
    if squared > far * far:
        return
    power = squared - radius * radius
    if power <= 0.0:  # the sensor is inside
        _circle_beams(px, py, power, 0, directions.shape[1], directions, ranges)
        return
    if _is_aside(px, py, px, py, radius, directions, increment):
        return
    centre = _bearing(py, px)
    half = _bearing(radius, math.sqrt(power))
    low, high, period, again, last = spans(centre - half, centre + half, directions.shape[1], angle_min, increment)
    while again <= last:
        begin = max(0, math.floor(low + again * period))
        end = min(directions.shape[1], math.ceil(high + again * period) + 1)
        _circle_beams(px, py, power, begin, end, directions, ranges)
        again += 1


@light
def _is_aside(
    ax: float, ay: float, bx: float, by: float, radius: float, directions: FloatArray, increment: float
) -> bool:
    """Whether what is within `radius` of the segment a-b lies off the first beam or the last one to the side where there is no other."""
    last = directions.shape[1] - 1
    if abs(increment) * last > _NARROW:
        return False
    fx, fy, lx, ly = directions[0, 0], directions[1, 0], directions[0, last], directions[1, last]
    if increment < 0.0:
        fx, fy, lx, ly = lx, ly, fx, fy
    apart = radius + _APART
    before, after = max(fx * ay - fy * ax, fx * by - fy * bx), min(lx * ay - ly * ax, lx * by - ly * bx)
    return bool(before < -apart or after > apart)


@light
def spans(
    start: float, end: float, count: int, angle_min: float, increment: float
) -> tuple[float, float, float, int, int]:
    """The beams between two bearings [rad]: from `low` to `high` (real indices, a little wide), and again each `period`.

    Returns:
        low, high, period, and the first and last multiple of the period that meets the beams 0 to count - 1: none
        for what a narrow field of view misses, two for what a wide one sees at both its ends.
    """
    if increment == 0.0:  # one beam
        return 0.0, 0.0, 1.0, 0, 0
    inverse = 1.0 / increment
    low, high = (start - angle_min) * inverse, (end - angle_min) * inverse
    if low > high:
        low, high = high, low
    wide = _BLUR * abs(inverse) + 1e-6
    low, high = low - wide, high + wide
    turns = abs(increment) / (2.0 * math.pi)
    return low, high, 1.0 / turns, math.ceil(-high * turns), math.floor((count - 1 - low) * turns)


@light
def _bearing(y: float, x: float) -> float:
    """atan2(y, x) to within 1.2e-5 rad, in a fraction of its time (Abramowitz and Stegun, 4.4.49)."""
    u, v = abs(x), abs(y)
    q = min(u, v) / max(u, v) if u + v > 0.0 else 0.0
    s = q * q
    angle = q * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))))
    if v > u:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return math.copysign(angle, y)


@light
def _segment_beams(
    ax: float, ay: float, ex: float, ey: float, across: float, begin: int, end: int,
    directions: FloatArray, ranges: FloatArray,
) -> None:  # fmt: skip
    """Beam d meets the line a + u e at distance (a x e) / (d x e), with u = (a x d) / (d x e)."""
    for i in range(begin, end):
        dx, dy = directions[0, i], directions[1, i]
        inverse = 1.0 / (dx * ey - dy * ex)
        distance = across * inverse
        u = (ax * dy - ay * dx) * inverse
        hit = (distance >= 0.0) & (u >= -_SLACK) & (u <= 1.0 + _SLACK) & (distance < ranges[i])
        ranges[i] = distance if hit else ranges[i]  # no branch: the loop runs on vector registers


@light
def _circle_beams(
    px: float, py: float, power: float, begin: int, end: int, directions: FloatArray, ranges: FloatArray
) -> None:
    """Beam d meets the circle at distance b -+ sqrt(b^2 - power), with b = d . p and power = p^2 - radius^2; NaN: it doesn't."""
    side = -1.0 if power > 0.0 else 1.0
    for i in range(begin, end):
        b = directions[0, i] * px + directions[1, i] * py
        distance = b + side * math.sqrt(b * b - power)
        hit = (distance >= 0.0) & (distance < ranges[i])
        ranges[i] = distance if hit else ranges[i]  # no branch, as above

"""Clearance: the edge-to-edge gap between two shapes, zero where they touch or overlap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.motion import sinc
from clearway.geometry.packing import boxes, pack, place, to_box, transform
from clearway.geometry.shapes import FloatArray, Shape


class Placed(Protocol):
    """A shape at a pose (3,), or at none where it moves."""

    @property
    def shape(self) -> Shape: ...

    @property
    def pose(self) -> FloatArray | None: ...


def clearance(shape_a: Shape, pose_a: FloatArray, shape_b: Shape, pose_b: FloatArray) -> float:
    """Gap between `shape_a` at `pose_a` (3,) and `shape_b` at `pose_b` (3,), in metres; 0.0 where they overlap."""
    a, b = pack([shape_a]), pack([shape_b])
    at_a, at_b = np.empty_like(a.points), np.empty_like(b.points)
    transform(a.points, float(pose_a[0]), float(pose_a[1]), float(pose_a[2]), at_a)
    transform(b.points, float(pose_b[0]), float(pose_b[1]), float(pose_b[2]), at_b)
    return float(gap(at_a, a.radius[0], at_b, b.radius[0]))


def min_clearance(
    footprint: Shape, poses: FloatArray, bodies: Sequence[Placed], moving_obstacles: FloatArray
) -> FloatArray:
    """Clearance to the nearest body at each sample.

    Args:
        footprint: Footprint of the robot.
        poses: (n, 3) poses of the robot: x, y [m], theta [rad].
        bodies: All that it can hit.
        moving_obstacles: (n, m, 3) poses of those bodies whose pose is None, in their order; NaN where one is absent.

    Returns:
        (n,) metres; inf where there is no body.
    """
    return np.asarray(_sampled(*_arguments(footprint, poses, bodies, moving_obstacles)))


def path_clearance(
    footprint: Shape, poses: FloatArray, bodies: Sequence[Placed], moving_obstacles: FloatArray, tolerance: float = 1e-3
) -> FloatArray:
    """Smallest clearance between each sample and the next, to within `tolerance` [m] above the true minimum.

    Between samples the robot is taken to drive the arc that joins the two poses, a moving obstacle the line. Arguments as for
    `min_clearance`.

    Returns:
        (n,) metres; entry i holds over [sample i, sample i + 1], the last one at the last sample.
    """
    return np.asarray(_between(tolerance, False, *_arguments(footprint, poses, bodies, moving_obstacles)))


def closest_approach(
    footprint: Shape, poses: FloatArray, bodies: Sequence[Placed], moving_obstacles: FloatArray, tolerance: float = 1e-3
) -> float:
    """The smallest of `path_clearance`, in a fraction of its time; inf where there is no body."""
    least = _between(tolerance, True, *_arguments(footprint, poses, bodies, moving_obstacles))
    return float(least.min(initial=math.inf))


def _arguments(footprint: Shape, poses: FloatArray, bodies: Sequence[Placed], moving_obstacles: FloatArray) -> Any:
    """What `_sampled` takes."""
    static = [b for b in bodies if b.pose is not None]
    moving = [b for b in bodies if b.pose is None]
    at = np.array([b.pose for b in static], dtype=np.float64).reshape(-1, 3)
    track = np.ascontiguousarray(moving_obstacles, dtype=np.float64)
    if track.size == 0:
        track = np.full((len(poses), len(moving), 3), np.nan)
    if track.shape != (len(poses), len(moving), 3):
        raise ValueError(
            f"moving_obstacles has shape {track.shape}; {(len(poses), len(moving), 3)} goes with poses and bodies"
        )
    foot = pack([footprint])
    way = np.ascontiguousarray(poses, dtype=np.float64)
    around = boxes(place(pack([b.shape for b in static]), at))
    packed = pack([b.shape for b in static + moving])
    return foot.points, foot.radius[0], foot.reach[0], way, *packed, at, around, track


@light
def gap(a: FloatArray, radius_a: float, b: FloatArray, radius_b: float) -> float:
    """Clearance between two packed shapes with points `a` (k, 2) and `b` (l, 2) in one frame; 0.0 on overlap."""
    near = math.inf
    n, m = a.shape[0], b.shape[0]
    if n == 1 and m == 1:
        near = math.hypot(a[0, 0] - b[0, 0], a[0, 1] - b[0, 1])
    elif n == 1:
        near = _to_outline(a[0, 0], a[0, 1], b)
    elif m == 1:
        near = _to_outline(b[0, 0], b[0, 1], a)
    else:
        if contains(a, b[0, 0], b[0, 1]) or contains(b, a[0, 0], a[0, 1]):
            return 0.0
        squared = math.inf
        i = n - 1 if n > 2 else 0
        for j in range(0 if n > 2 else 1, n):
            p = m - 1 if m > 2 else 0
            for q in range(0 if m > 2 else 1, m):
                d = _edges(a[i, 0], a[i, 1], a[j, 0], a[j, 1], b[p, 0], b[p, 1], b[q, 0], b[q, 1])
                if d <= 0.0:
                    return 0.0
                squared = min(squared, d)
                p = q
            i = j
        near = math.sqrt(squared)
    return max(0.0, near - radius_a - radius_b)


@light
def contains(polygon: FloatArray, x: float, y: float) -> bool:
    """Whether (x, y) lies inside `polygon` (n, 2), by crossing number; nothing lies inside fewer than 3 vertices."""
    inside = False
    n = polygon.shape[0]
    if n < 3:
        return False
    j = n - 1
    for i in range(n):
        yi, yj = polygon[i, 1], polygon[j, 1]
        if (yi > y) != (yj > y) and x < polygon[i, 0] + (polygon[j, 0] - polygon[i, 0]) * (y - yi) / (yj - yi):
            inside = not inside
        j = i
    return inside


@light
def point_to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance from (x, y) to the segment a-b."""
    ex, ey = bx - ax, by - ay
    px, py = x - ax, y - ay
    length = ex * ex + ey * ey
    along = px * ex + py * ey
    if along <= 0.0 or length <= 0.0:
        return px * px + py * py
    if along >= length:
        return (x - bx) ** 2 + (y - by) ** 2
    across = px * ey - py * ex
    return across * across / length


@light
def _to_outline(x: float, y: float, polygon: FloatArray) -> float:
    """Distance from a point to a polygon with its inside, or to a segment."""
    if contains(polygon, x, y):
        return 0.0
    n = polygon.shape[0]
    squared = math.inf
    i = n - 1 if n > 2 else 0
    for j in range(0 if n > 2 else 1, n):
        squared = min(squared, point_to_segment(x, y, polygon[i, 0], polygon[i, 1], polygon[j, 0], polygon[j, 1]))
        i = j
    return math.sqrt(squared)


@light
def _edges(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:  # fmt: skip
    """Squared distance between the segments a-b and c-d; 0.0 where they cross."""
    ex, ey = bx - ax, by - ay
    fx, fy = dx - cx, dy - cy
    c_side = ex * (cy - ay) - ey * (cx - ax)
    d_side = ex * (dy - ay) - ey * (dx - ax)
    if (c_side > 0.0) != (d_side > 0.0):
        a_side = fx * (ay - cy) - fy * (ax - cx)
        b_side = fx * (by - cy) - fy * (bx - cx)
        if (a_side > 0.0) != (b_side > 0.0):
            return 0.0
    return min(
        min(point_to_segment(ax, ay, cx, cy, dx, dy), point_to_segment(bx, by, cx, cy, dx, dy)),
        min(point_to_segment(cx, cy, ax, ay, bx, by), point_to_segment(dx, dy, ax, ay, bx, by)),
    )


@kernel
def _sampled(
    foot: FloatArray, foot_radius: float, foot_reach: float, poses: FloatArray,
    points: FloatArray, first: np.ndarray, radius: FloatArray, reach: FloatArray, at: FloatArray, around: FloatArray,
    moving_obstacles: FloatArray,
) -> FloatArray:  # fmt: skip
    """`min_clearance` on packed shapes, the static ones at `at` (k, 3), in boxes `around` (k, 4), first."""
    n, still = poses.shape[0], at.shape[0]
    best = np.full(n, math.inf)
    robot, body = np.empty_like(foot), np.empty_like(points)
    for b in range(still):
        transform(points[first[b] : first[b + 1]], at[b, 0], at[b, 1], at[b, 2], body[first[b] : first[b + 1]])
    for i in range(n):
        transform(foot, poses[i, 0], poses[i, 1], poses[i, 2], robot)
        for b in range(radius.shape[0]):
            pose = at[b] if b < still else moving_obstacles[i, b - still]
            if not math.isfinite(pose[0]):
                continue
            if b < still:
                apart = to_box(around, b, poses[i, 0], poses[i, 1]) - foot_reach
            else:
                apart = math.hypot(pose[0] - poses[i, 0], pose[1] - poses[i, 1]) - reach[b] - foot_reach
            if apart >= best[i]:
                continue
            shape = body[first[b] : first[b + 1]]
            if b >= still:
                transform(points[first[b] : first[b + 1]], pose[0], pose[1], pose[2], shape)
            best[i] = min(best[i], gap(robot, foot_radius, shape, radius[b]))
    return best


@kernel
def _between(
    tolerance: float, whole: bool,
    foot: FloatArray, foot_radius: float, foot_reach: float, poses: FloatArray,
    points: FloatArray, first: np.ndarray, radius: FloatArray, reach: FloatArray, at: FloatArray, around: FloatArray,
    moving_obstacles: FloatArray,
) -> FloatArray:  # fmt: skip
    """`path_clearance` on packed shapes: bisects each interval until motion bounds leave no room below the best.

    `whole`: below the best of all intervals so far, so that only the smallest of the answers is exact.
    """
    best = _sampled(foot, foot_radius, foot_reach, poses, points, first, radius, reach, at, around, moving_obstacles)
    still = at.shape[0]
    floor = best.min() if whole and best.size > 0 else math.inf
    here, there = np.empty(3), np.empty(3)
    robot, body = np.empty_like(foot), np.empty_like(points)
    start, end, d_start, d_end = np.empty(64), np.empty(64), np.empty(64), np.empty(64)  # the stack of the bisection
    for i in range(poses.shape[0] - 1):
        best[i] = min(best[i], best[i + 1])  # entry i + 1 still holds its sample
        if whole:
            best[i] = floor
        turn = wrap(poses[i + 1, 2] - poses[i, 2])
        chord = math.hypot(poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1])
        for b in range(radius.shape[0]):
            before = at[b] if b < still else moving_obstacles[i, b - still]
            after = at[b] if b < still else moving_obstacles[i + 1, b - still]
            if not (math.isfinite(before[0]) and math.isfinite(after[0])):
                continue
            moved = math.hypot(after[0] - before[0], after[1] - before[1])
            if b < still:
                apart = to_box(around, b, poses[i, 0], poses[i, 1]) - foot_reach
            else:
                apart = math.hypot(before[0] - poses[i, 0], before[1] - poses[i, 1]) - reach[b] - foot_reach
            origin = chord / sinc(0.5 * turn) + moved  # length of the ways that the two origins go
            if apart - origin >= best[i]:
                continue
            bound = origin + abs(turn) * foot_reach + abs(wrap(after[2] - before[2])) * reach[b]
            shape = body[first[b] : first[b + 1]]
            local = points[first[b] : first[b + 1]]
            top = 0
            start[0], end[0] = 0.0, 1.0
            for side in range(2):
                _along_arc(poses[i], poses[i + 1], 1.0 * side, here)
                _along_line(before, after, 1.0 * side, there)
                transform(foot, here[0], here[1], here[2], robot)
                transform(local, there[0], there[1], there[2], shape)
                d = gap(robot, foot_radius, shape, radius[b])
                if side == 0:
                    d_start[0] = d
                else:
                    d_end[0] = d
            while top >= 0:
                s0, s1, d0, d1 = start[top], end[top], d_start[top], d_end[top]
                top -= 1
                if 0.5 * (d0 + d1 - bound * (s1 - s0)) >= best[i] - tolerance or best[i] <= 0.0:
                    continue
                middle = 0.5 * (s0 + s1)
                _along_arc(poses[i], poses[i + 1], middle, here)
                _along_line(before, after, middle, there)
                transform(foot, here[0], here[1], here[2], robot)
                transform(local, there[0], there[1], there[2], shape)
                d = gap(robot, foot_radius, shape, radius[b])
                best[i] = min(best[i], d)
                start[top + 1], end[top + 1], d_start[top + 1], d_end[top + 1] = middle, s1, d, d1
                start[top + 2], end[top + 2], d_start[top + 2], d_end[top + 2] = s0, middle, d0, d
                top += 2
        floor = min(floor, best[i])
    return best


@light
def _along_arc(a: FloatArray, b: FloatArray, s: float, out: FloatArray) -> None:
    """The pose at fraction `s` of the arc of constant speed and yaw rate that is joined to poses `a` and `b` (3,).

    Its start direction is taken relative to the chord, so the way through side slip is an arc as well.
    """
    half = 0.5 * wrap(b[2] - a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    share = s * sinc(s * half) / sinc(half)
    bend = (s - 1.0) * half  # direction of the part's chord relative to the whole chord's
    c, t = math.cos(bend), math.sin(bend)
    out[0] = a[0] + share * (c * dx - t * dy)
    out[1] = a[1] + share * (t * dx + c * dy)
    out[2] = a[2] + 2.0 * s * half


@light
def _along_line(a: FloatArray, b: FloatArray, s: float, out: FloatArray) -> None:
    """The pose at fraction `s` of the line between poses `a` and `b` (3,), turning the shorter way."""
    out[0] = a[0] + s * (b[0] - a[0])
    out[1] = a[1] + s * (b[1] - a[1])
    out[2] = a[2] + s * wrap(b[2] - a[2])

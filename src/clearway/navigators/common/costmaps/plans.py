"""What a local planner sees of the global plan (base_local_planner/src/goal_functions.cpp)."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


@kernel
def local_plan(
    plan: FloatArray, begin: int, pose: FloatArray, frame: FloatArray, reach: float, prune: bool
) -> tuple[FloatArray, int]:
    """The part of a plan within `reach` of the robot, moved into another frame, without what lies behind.

    As in ROS the first pose beyond reach is included, and poses at the beginning are dropped, for good, until one
    lies within 1 m of the robot.

    Args:
        plan: (n, 3) poses, in their own frame.
        begin: Index of its first pose that is not dropped yet.
        pose: (3,) of the robot in its frame.
        frame: (3,) pose of the plan's frame in the target frame.
        reach: How far from the robot the plan is followed, m.
        prune: Whether poses are dropped.

    Returns:
        (k, 3) poses in the target frame, and the new `begin`.
    """
    n = plan.shape[0]
    first = begin
    while first < n and math.hypot(pose[0] - plan[first, 0], pose[1] - plan[first, 1]) > reach:
        first += 1
    last = first
    while last < n:
        last += 1
        if math.hypot(pose[0] - plan[last - 1, 0], pose[1] - plan[last - 1, 1]) > reach:
            break
    if prune:
        while first < last and math.hypot(pose[0] - plan[first, 0], pose[1] - plan[first, 1]) >= 1.0:
            first += 1
            begin += 1
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    moved = np.empty((last - first, 3))
    for i in range(first, last):
        x, y = plan[i, 0], plan[i, 1]
        moved[i - first, 0] = frame[0] + cosine * x - sine * y
        moved[i - first, 1] = frame[1] + sine * x + cosine * y
        moved[i - first, 2] = wrap(plan[i, 2] + frame[2])
    return moved, begin


@kernel
def to_frame(points: FloatArray, frame: FloatArray) -> FloatArray:
    """Points (n, 2) of a frame whose pose in the target frame is `frame` (3,), in the target frame."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    moved = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        moved[i, 0], moved[i, 1] = frame[0] + (cosine * x - sine * y), frame[1] + (sine * x + cosine * y)
    return moved

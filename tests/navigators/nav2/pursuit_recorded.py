"""Inputs on which nav2_regulated_pure_pursuit_controller itself was run (`recordings/README.md`)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from clearway.geometry.shapes import rectangle
from clearway.geometry.streams import stream, uniform
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.nav2.seams import CostView

COUNT = 600
FREQUENCY = 20.0
LENGTH, WIDTH = 0.45, 0.3

_KEY = stream(0, "regulated pure pursuit")
_FLAGS = (
    "use_velocity_scaled_lookahead_dist", "use_fixed_curvature_lookahead", "interpolate_curvature_after_goal",
    "use_regulated_linear_velocity_scaling", "use_cost_regulated_linear_velocity_scaling", "use_rotate_to_heading",
    "allow_reversing", "use_dynamic_window", "use_collision_detection", "allow_obstacle_checking_beyond_goal",
)  # fmt: skip


class Case(NamedTuple):
    """One decision.

    Attributes:
        own: Parameters that are no defaults.
        cost: (60, 60) cells of the costmap.
        tracks_unknown: Whether it tells unknown cells from free ones.
        pose: (3,) of the robot.
        path: (n, 3) in the costmap's frame.
        measured: v [m/s] and omega [rad/s].
        last: The same of the command before.
        there: Whether the goal's place is reached.
        cancelling: Whether it is to come to rest.
        limit: Of the speed, per cent; 0: none.
    """

    own: dict[str, Any]
    cost: np.ndarray
    tracks_unknown: bool
    pose: np.ndarray
    path: np.ndarray
    measured: tuple[float, float]
    last: tuple[float, float]
    there: bool
    cancelling: bool
    limit: float


def case_of(number: int) -> Case:
    """Case `number`, drawn from streams of our own, so that it is the same everywhere."""
    drawn = iter(range(10_000))

    def draw(low: float = 0.0, high: float = 1.0) -> float:
        return low + (high - low) * uniform(_KEY, number, next(drawn))

    own: dict[str, Any] = {name: draw() < 0.5 for name in _FLAGS}
    own["interpolate_curvature_after_goal"] &= own["use_fixed_curvature_lookahead"]
    own |= {
        "max_linear_vel": draw(0.2, 1.0), "min_linear_vel": draw(-0.6, 0.0), "max_angular_vel": draw(0.5, 2.5),
        "min_angular_vel": draw(-2.5, -0.5), "lookahead_dist": draw(0.1, 1.2), "min_lookahead_dist": draw(0.2, 0.4),
        "max_lookahead_dist": draw(0.5, 1.2), "lookahead_time": draw(0.5, 2.0), "curvature_lookahead_dist": draw(0.1, 1.2),
        "regulated_linear_scaling_min_speed": draw(0.0, 0.3), "regulated_linear_scaling_min_radius": draw(0.3, 1.5),
        "min_distance_to_obstacle": -1.0 if draw() < 0.5 else 0.4, "rotate_to_heading_min_angle": draw(0.4, 1.5),
        "cost_scaling_dist": draw(0.2, 0.9), "cost_scaling_gain": draw(0.5, 1.0), "use_cancel_deceleration": True,
        "cancel_deceleration": draw(1.0, 4.0), "approach_velocity_scaling_dist": draw(0.3, 1.0),
    }  # fmt: skip
    cost = np.zeros((60, 60), np.uint8)
    if draw() < 0.7:  # a slope, so that the cost under the robot and on its way differ
        level, rows, columns = draw(0.0, 120.0), draw(-2.0, 2.0), draw(-2.0, 2.0)
        r, c = np.mgrid[:60, :60]
        cost = np.clip(level + rows * (r - 30) + columns * (c - 30), 0.0, 252.0).astype(np.uint8)
    for _ in range(int(draw(0.0, 4.0))):
        row, column = int(draw(0.0, 58.0)), int(draw(0.0, 58.0))
        cost[row : row + 2, column : column + 2] = 254 if draw() < 0.5 else 255
    n = int(draw(2.0, 40.0))
    yaw = draw(-3.0, 3.0) + np.cumsum([draw(-0.26, 0.26) for _ in range(n)])
    path = np.column_stack((np.cumsum(0.06 * np.stack((np.cos(yaw), np.sin(yaw)), axis=1), axis=0), yaw))
    turned = math.pi if draw() < 0.2 else 0.0
    pose = np.array((draw(-0.17, 0.17), draw(-0.17, 0.17), yaw[0] + turned + draw(-0.9, 0.9)))
    if draw() < 0.02:
        pose[0] += 5.0  # off the costmap
    measured, last = (draw(-0.3, 0.8), draw(-1.0, 1.0)), (draw(-0.3, 0.8), draw(-1.0, 1.0))
    there, cancelling, tracks_unknown = draw() < 0.2, draw() < 0.2, draw() < 0.5
    limit = draw(20.0, 90.0) if draw() < 0.2 else 0.0
    return Case(own, cost, tracks_unknown, pose, path, measured, last, there, cancelling, limit)


def view_of(case: Case) -> CostView:
    """The local costmap."""
    shape = rectangle(LENGTH, WIDTH)
    return CostView(
        case.cost, np.array((-1.5, -1.5)), 0.05, outline(shape), WIDTH / 2, math.hypot(LENGTH, WIDTH) / 2, 3.0, 0.5,
        case.tracks_unknown,
    )  # fmt: skip

"""Regulated pure pursuit's arithmetic, compiled: where to aim, how fast, and whether that leads into an obstacle.

Behaviour after nav2_regulated_pure_pursuit_controller/src/{regulated_pure_pursuit_controller,collision_checker}.cpp,
its regulation_functions.hpp and dynamic_window_pure_pursuit_functions.hpp, and nav2_util/src/controller_utils.cpp.
The papers: S. Macenski et al., "Regulated pure pursuit for robot path tracking", Autonomous Robots (2023); F. Ohnishi and
M. Takahashi, "DWPP: dynamic window pure pursuit considering velocity and acceleration constraints", arXiv:2601.15006.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import LETHAL, NO_INFORMATION, Scene, row_col
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.path_handler import path_length

FOUND, OFF_THE_MAP, COLLISION = 0, 1, 2
"""How a search for a command ends: with one, with a robot off its costmap, with an obstacle ahead."""

_SAME_CHORD = 1e-3
"""Squared distance of a point below which no circle is drawn through it, m^2."""

_STRAIGHT = 1e-3
"""Curvature below which a path is straight for the dynamic window, 1/m."""

_EQUALLY_NEAR = 1e-3
"""Corners of the dynamic window are equally near to the path's line within this, m/s."""


class Law(NamedTuple):
    """What regulated pure pursuit needs of its parameters, under their names; `RegulatedPurePursuitParameters` tells of them.

    Attributes:
        period: Control period, s.
        max_linear_vel: As limited just now, m/s.
        min_linear_vel: m/s.
        max_angular_vel: rad/s.
        min_angular_vel: rad/s.
        max_linear_accel: m/s^2.
        max_linear_decel: m/s^2.
        max_angular_accel: rad/s^2.
        max_angular_decel: rad/s^2.
        use_dynamic_window: Whether.
        lookahead_dist: m.
        use_velocity_scaled_lookahead_dist: Whether.
        min_lookahead_dist: m.
        max_lookahead_dist: m.
        lookahead_time: s.
        use_fixed_curvature_lookahead: Whether.
        curvature_lookahead_dist: m.
        interpolate_curvature_after_goal: Whether the curvature's point may lie beyond the path's end.
        use_regulated_linear_velocity_scaling: Whether curves are driven slower.
        regulated_linear_scaling_min_radius: Of a curve at full speed, m.
        regulated_linear_scaling_min_speed: To which curves and obstacles slow the robot, m/s.
        use_cost_regulated_linear_velocity_scaling: Whether obstacles slow the robot.
        cost_scaling_dist: m.
        cost_scaling_gain: Share of the speed.
        inflation_cost_scaling_factor: The inflation layer's, 1/m.
        min_approach_linear_velocity: m/s.
        approach_velocity_scaling_dist: m.
        use_rotate_to_heading: Whether.
        rotate_to_heading_angular_vel: rad/s.
        rotate_to_heading_min_angle: rad.
        allow_reversing: Whether.
        cancel_deceleration: m/s^2.
        use_collision_detection: Whether.
        max_allowed_time_to_collision_up_to_carrot: How far ahead collisions are looked for, s.
        min_distance_to_obstacle: m.
        allow_obstacle_checking_beyond_goal: Whether collisions are looked for beyond the path's end.
    """

    period: float
    max_linear_vel: float
    min_linear_vel: float
    max_angular_vel: float
    min_angular_vel: float
    max_linear_accel: float
    max_linear_decel: float
    max_angular_accel: float
    max_angular_decel: float
    use_dynamic_window: bool
    lookahead_dist: float
    use_velocity_scaled_lookahead_dist: bool
    min_lookahead_dist: float
    max_lookahead_dist: float
    lookahead_time: float
    use_fixed_curvature_lookahead: bool
    curvature_lookahead_dist: float
    interpolate_curvature_after_goal: bool
    use_regulated_linear_velocity_scaling: bool
    regulated_linear_scaling_min_radius: float
    regulated_linear_scaling_min_speed: float
    use_cost_regulated_linear_velocity_scaling: bool
    cost_scaling_dist: float
    cost_scaling_gain: float
    inflation_cost_scaling_factor: float
    min_approach_linear_velocity: float
    approach_velocity_scaling_dist: float
    use_rotate_to_heading: bool
    rotate_to_heading_angular_vel: float
    rotate_to_heading_min_angle: float
    allow_reversing: bool
    cancel_deceleration: float
    use_collision_detection: bool
    max_allowed_time_to_collision_up_to_carrot: float
    min_distance_to_obstacle: float
    allow_obstacle_checking_beyond_goal: bool


class State(NamedTuple):
    """What regulated pure pursuit is told in a control period, beside pose, path and costmap.

    Attributes:
        v: Measured forward speed, m/s.
        omega: Measured yaw rate, rad/s.
        there: Whether the goal's place is reached.
        cancelling: Whether the robot is to come to rest.
        last_v: Last command's speed, m/s.
        last_omega: Last command's yaw rate, rad/s.
        inscribed: The footprint's inscribed radius, m.
        circumscribed: Its circumscribed radius, m.
        tracks_unknown: Whether the costmap tells unknown cells from free ones.
    """

    v: float
    omega: float
    there: bool
    cancelling: bool
    last_v: float
    last_omega: float
    inscribed: float
    circumscribed: float
    tracks_unknown: bool


@kernel
def command(
    law: Law, state: State, pose: FloatArray, path: FloatArray, scene: Scene
) -> tuple[int, float, float, bool, FloatArray]:
    """The command at `pose` (3,) for a path (n, 3) in its frame.

    Returns:
        How it ended, speed, yaw rate, whether a cancelled robot is at rest, and (k, 2) where that leads.
    """
    nowhere = np.empty((0, 2))
    base = _from_robot(pose, path)
    n = base.shape[0]
    distance = law.lookahead_dist
    if law.use_velocity_scaled_lookahead_dist:
        distance = max(law.min_lookahead_dist, min(abs(state.v) * law.lookahead_time, law.max_lookahead_dist))
    aim_x, aim_y = look_ahead(base, distance, False)
    towards_x, towards_y = aim_x, aim_y
    if law.use_fixed_curvature_lookahead:
        towards_x, towards_y = look_ahead(base, law.curvature_lookahead_dist, law.interpolate_curvature_after_goal)
    curvature = _curvature(towards_x, towards_y)
    sign = -1.0 if law.allow_reversing and aim_x < 0.0 else 1.0
    angle = math.atan2(towards_y, towards_x)
    if sign < 0.0:
        angle = wrap(angle + math.pi)

    at_rest = False
    if law.use_rotate_to_heading and state.there:
        v, omega = 0.0, _turn_in_place(law, wrap(path[n - 1, 2] - pose[2]), state.omega)
    elif law.use_rotate_to_heading and abs(angle) > law.rotate_to_heading_min_angle:
        v, omega = 0.0, _turn_in_place(law, angle, state.omega)
    else:
        row, col = row_col(scene.frame, pose[0], pose[1])
        if row < 0:
            return OFF_THE_MAP, 0.0, 0.0, False, nowhere
        v = sign * _regulated_speed(law, curvature, int(scene.cost[row, col]), state.inscribed, base)
        if state.cancelling:
            v = state.v - sign * law.period * law.cancel_deceleration
            if sign * v <= 0.0:
                v, at_rest = 0.0, True
        omega = v * curvature
        if law.use_dynamic_window:
            v, omega = in_dynamic_window(law, state.last_v, state.last_omega, v, curvature, sign)
    if not law.use_collision_detection:
        return FOUND, v, omega, at_rest, nowhere
    limit = math.hypot(aim_x, aim_y)
    free, arc = _ahead(law, state, pose, scene, v, omega, limit, path_length(base))
    return FOUND if free else COLLISION, v, omega, at_rest, arc


@kernel
def _from_robot(pose: FloatArray, path: FloatArray) -> FloatArray:
    """The path's places (n, 2) as seen from the robot."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    base = np.empty((path.shape[0], 2))
    for i in range(path.shape[0]):
        dx, dy = path[i, 0] - pose[0], path[i, 1] - pose[1]
        base[i, 0], base[i, 1] = c * dx + s * dy, c * dy - s * dx
    return base


@kernel
def look_ahead(base: FloatArray, distance: float, beyond: bool) -> tuple[float, float]:
    """The point at `distance` along a path (n, 2); its end, or a point on its prolongation if `beyond`, where it is shorter."""
    last = base.shape[0] - 1
    along = 0.0
    for i in range(1, last + 1):
        dx, dy = base[i, 0] - base[i - 1, 0], base[i, 1] - base[i - 1, 1]
        step = math.hypot(dx, dy)
        if along + step >= distance:
            share = (distance - along) / step if step > 0.0 else 0.0
            return base[i - 1, 0] + share * dx, base[i - 1, 1] + share * dy
        along += step
    x, y = base[last, 0], base[last, 1]
    if beyond and last > 0:
        heading = math.atan2(y - base[last - 1, 1], x - base[last - 1, 0])
        return x + (distance - along) * math.cos(heading), y + (distance - along) * math.sin(heading)
    return x, y


@kernel
def _curvature(x: float, y: float) -> float:
    """Of the circle through the robot, along its heading, and a point, 1/m."""
    squared = x * x + y * y
    return 2.0 * y / squared if squared > _SAME_CHORD else 0.0


@kernel
def _turn_in_place(law: Law, angle: float, omega: float) -> float:
    """The yaw rate that turns by `angle`, reachable from `omega`, and not too fast to stop there."""
    sign = 1.0 if angle > 0.0 else -1.0
    reach = law.max_angular_accel * law.period
    rate = max(omega - reach, min(sign * law.rotate_to_heading_angular_vel, omega + reach))
    stoppable = math.sqrt(2.0 * law.max_angular_accel * abs(angle))
    return sign * stoppable if abs(rate) > stoppable else rate


@kernel
def _regulated_speed(law: Law, curvature: float, cost: int, inscribed: float, base: FloatArray) -> float:
    """The speed for a curvature, a cost under the robot's centre, and the path (n, 2) that is left; 0 or above."""
    full = law.max_linear_vel
    by_curvature = by_cost = full
    if law.use_regulated_linear_velocity_scaling:
        radius = np.inf if curvature == 0.0 else abs(1.0 / curvature)
        if radius < law.regulated_linear_scaling_min_radius:
            by_curvature = full * (
                1.0 - abs(radius - law.regulated_linear_scaling_min_radius) / law.regulated_linear_scaling_min_radius
            )
    if law.use_cost_regulated_linear_velocity_scaling and cost not in (0, NO_INFORMATION):
        distance = (
            law.inflation_cost_scaling_factor * inscribed - math.log(float(cost)) + math.log(253.0)
        ) / law.inflation_cost_scaling_factor
        if distance < law.cost_scaling_dist:
            by_cost = full * (law.cost_scaling_gain * distance / law.cost_scaling_dist)
    v = max(min(by_cost, by_curvature), law.regulated_linear_scaling_min_speed)
    share = 1.0
    if path_length(base) < law.approach_velocity_scaling_dist:
        last = base.shape[0] - 1
        share = math.hypot(base[last, 0], base[last, 1]) / law.approach_velocity_scaling_dist
    v = min(v, max(v * share, law.min_approach_linear_velocity))
    return min(abs(v), full)


@kernel
def _reachable(
    now: float, most: float, least: float, faster: float, slower: float, period: float
) -> tuple[float, float]:
    """The largest and the least speed of the dynamic window around the speed `now`; `slower` is negative."""
    still = 1e-3
    if now > still:
        return min(now + faster * period, most), max(now + slower * period, least)
    if now < -still:
        return min(now - slower * period, most), max(now - faster * period, least)
    return min(now + faster * period, most), max(now - faster * period, least)


@kernel
def in_dynamic_window(
    law: Law, last_v: float, last_omega: float, v: float, curvature: float, sign: float
) -> tuple[float, float]:
    """The command in the dynamic window around the last one, with a speed between 0 and `v`, that keeps best to the curvature."""
    high_v, low_v = _reachable(
        last_v, law.max_linear_vel, law.min_linear_vel, law.max_linear_accel, law.max_linear_decel, law.period
    )
    high_w, low_w = _reachable(
        last_omega, law.max_angular_vel, law.min_angular_vel, law.max_angular_accel, law.max_angular_decel, law.period
    )
    low_v, high_v = max(low_v, min(0.0, v)), min(high_v, max(0.0, v))
    if low_v > high_v:
        if low_v > max(0.0, v):
            high_v = low_v
        else:
            low_v = high_v

    if abs(curvature) < _STRAIGHT:
        nearest = low_w if abs(low_w) <= abs(high_w) else high_w
        return high_v if sign >= 0.0 else low_v, 0.0 if low_w <= 0.0 <= high_w else nearest

    best_v, best_w, found = 0.0, 0.0, False
    for k in range(4):  # where the line omega = curvature * v crosses the window's edges
        if k < 2:
            at_v = low_v if k == 0 else high_v
            at_w = curvature * at_v
        else:
            at_w = low_w if k == 2 else high_w
            at_v = at_w / curvature
        inside = low_v <= at_v <= high_v and low_w <= at_w <= high_w
        if inside and (not found or at_v * sign > best_v * sign):
            best_v, best_w, found = at_v, at_w, True
    if found:
        return best_v, best_w

    nearest_gap = np.inf
    for k in range(4):  # it passes the window by: the corner that is nearest to it
        at_v = low_v if k < 2 else high_v
        at_w = low_w if k % 2 == 0 else high_w
        gap = abs(curvature * at_v - at_w) / math.sqrt(curvature * curvature + 1.0)
        if gap < nearest_gap or (abs(gap - nearest_gap) <= _EQUALLY_NEAR and at_v * sign > best_v * sign):
            nearest_gap, best_v, best_w = gap, at_v, at_w
    return best_v, best_w


@kernel
def _ahead(
    law: Law, state: State, pose: FloatArray, scene: Scene, v: float, omega: float, aim: float, left: float
) -> tuple[bool, FloatArray]:
    """Whether a command is free of obstacles as far as it is looked at, and (k, 2) where it leads.

    Args:
        aim: Distance of the point that is aimed at, m.
        left: Length of the path that is left, m.
    """
    x, y, yaw = pose[0], pose[1], pose[2]
    resolution = scene.frame.resolution
    if abs(v) < 0.01 and abs(omega) > 0.01:
        step = 2.0 * math.sin(resolution / 2.0 / state.circumscribed) / abs(omega)
    else:
        step = resolution / abs(v)
    time, reach = law.max_allowed_time_to_collision_up_to_carrot, aim
    if law.min_distance_to_obstacle > 0.0:
        time = max(time, law.min_distance_to_obstacle / max(abs(v), law.min_approach_linear_velocity))
        if law.use_velocity_scaled_lookahead_dist:
            least = (
                law.min_distance_to_obstacle
                if law.allow_obstacle_checking_beyond_goal
                else min(law.min_distance_to_obstacle, left)
            )
            reach = min(max(aim, least), law.max_lookahead_dist)
    arc = np.empty((max(1, min(10_000, int(time / step) + 2)), 2))
    if _collides(state, scene, x, y, yaw):
        return False, arc[:0]
    count = 0
    for i in range(1, arc.shape[0] + 1):
        if not i * step < time:
            break
        x += step * (v * math.cos(yaw))
        y += step * (v * math.sin(yaw))
        yaw += step * omega
        if math.hypot(x - pose[0], y - pose[1]) > reach:
            break
        arc[count, 0], arc[count, 1] = x, y
        count += 1
        if _collides(state, scene, x, y, yaw):
            return False, arc[:count]
    return True, arc[:count]


@kernel
def _collides(state: State, scene: Scene, x: float, y: float, yaw: float) -> bool:
    """Whether the footprint lies on an obstacle, or on unknown ground that the costmap can't tell; never off the map."""
    if row_col(scene.frame, x, y)[0] < 0:
        return False
    cost = cost_at_pose(scene.cost, scene.frame, scene.polygon, x, y, yaw)
    return cost >= LETHAL and not (cost == NO_INFORMATION and state.tracks_unknown)

"""The dynamic window approach's search: which samples there are, what each costs, which one is the cheapest.

Behaviour after base_local_planner's simple_trajectory_generator, simple_scored_sampling_planner and *_cost_function
sources, with the critics of dwa_local_planner/src/dwa_planner.cpp. One difference in the order of work and none in
the outcome: a sample's cheap grid costs come first, its footprint cost only while it can still win.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Scene, cell_of
from clearway.navigators.common.oscillation import Signs, forbids
from clearway.navigators.move_base.local_planners import mapgrid
from clearway.navigators.move_base.local_planners.mapgrid import (
    BODY,
    NOSE,
    Room,
    Seek,
    lay_plan,
    spread,
    spread_from,
)
from clearway.navigators.move_base.local_planners.sampling import approach, occlusion, roll

_EPSILON = 1e-4  # the generator's slack on its speed limits, m/s and rad/s


class Window(NamedTuple):
    """What the generator and the critics need of `DWAParameters`, for one cycle.

    Attributes:
        max_vel_trans: Largest translational speed, at most the set speed, m/s.
        min_vel_trans: Speed below which a sample is dropped unless it turns fast, m/s.
        max_vel_x: Largest forward speed, at most the set speed, m/s.
        min_vel_x: Least forward speed, m/s.
        max_vel_y: Largest speed to the left, at most the set speed, m/s; 0 for a base that has no sides.
        min_vel_y: Least speed to the left, m/s; likewise.
        max_vel_theta: Largest yaw rate, rad/s.
        min_vel_theta: Yaw rate from which a sample turns fast, rad/s.
        acc_lim_x: Acceleration, m/s^2.
        acc_lim_y: Acceleration to the sides, m/s^2.
        acc_lim_theta: Angular acceleration, rad/s^2.
        period: Control period, s.
        vx_samples: Number of speeds that are tried.
        vy_samples: Number of speeds to the left that are tried.
        vth_samples: Number of yaw rates that are tried.
        use_dwa: Whether samples are what can be reached in a period; else in `sim_time`.
        sim_time: How far ahead a motion is looked at, s.
        sim_granularity: Distance between points that are checked, m.
        angular_sim_granularity: Turn between points that are checked, rad.
        path_bias: Weight of the distance from the plan, per cell.
        align_bias: Weight of the nose's distance from the plan, per cell; 0 near the goal.
        goal_bias: Weight of the distance from the local goal, per cell.
        occ_scale: Weight of the highest cost on the way.
        twirl_scale: Weight of the yaw rate.
        sum_scores: Whether costs are added up along the way; else the highest counts.
        nose: How far ahead of the robot's origin its nose is, m.
        scaling_speed: Speed from which the footprint grows, m/s.
        max_scaling_factor: By what share it has grown at full speed.
    """

    max_vel_trans: float
    min_vel_trans: float
    max_vel_x: float
    min_vel_x: float
    max_vel_y: float
    min_vel_y: float
    max_vel_theta: float
    min_vel_theta: float
    acc_lim_x: float
    acc_lim_y: float
    acc_lim_theta: float
    period: float
    vx_samples: int
    vy_samples: int
    vth_samples: int
    use_dwa: bool
    sim_time: float
    sim_granularity: float
    angular_sim_granularity: float
    path_bias: float
    align_bias: float
    goal_bias: float
    occ_scale: float
    twirl_scale: float
    sum_scores: bool
    nose: float
    scaling_speed: float
    max_scaling_factor: float


@kernel
def velocity_samples(low: float, high: float, count: int) -> FloatArray:
    """At least two evenly spaced speeds from `low` to `high`, and zero where they straddle it (velocity_iterator.h)."""
    if low == high:
        return np.array([low])
    count = max(2, count)
    step = (high - low) / (count - 1)
    out = np.empty(count + 1)
    n = 0
    following = low
    for _ in range(count - 1):
        now = following
        following += step
        out[n] = now
        n += 1
        if now < 0.0 < following:
            out[n] = 0.0
            n += 1
    out[n] = high
    return out[: n + 1]


@kernel
def sample_steps(p: Window, v: float, w: float, u: float = 0.0) -> int:
    """Number of points of a sample's rollout; 0 where the generator refuses the sample."""
    speed = abs(v) if u == 0.0 else math.hypot(v, u)
    if speed + _EPSILON < p.min_vel_trans and abs(w) + _EPSILON < p.min_vel_theta:
        return 0
    if speed - _EPSILON > p.max_vel_trans:
        return 0
    return math.ceil(max(speed * p.sim_time / p.sim_granularity, abs(w) * p.sim_time / p.angular_sim_granularity))


@kernel
def window_of(p: Window, velocity: FloatArray, goal_distance: float) -> tuple[float, float, float, float]:
    """The speeds (v_min, v_max, w_min, w_max) within reach: in one period, or in sim_time without the dynamic window."""
    span, top = p.period, p.max_vel_x
    if not p.use_dwa:
        span = p.sim_time
        top = max(min(top, goal_distance / p.sim_time), p.min_vel_x)
    return (
        max(p.min_vel_x, velocity[0] - p.acc_lim_x * span),
        min(top, velocity[0] + p.acc_lim_x * span),
        max(-p.max_vel_theta, velocity[1] - p.acc_lim_theta * span),
        min(p.max_vel_theta, velocity[1] + p.acc_lim_theta * span),
    )


@kernel
def sideways_of(p: Window, velocity: FloatArray, goal_distance: float) -> tuple[float, float]:
    """The least and the largest speed to the left within reach, as `window_of` has the others; 0 for a base without sides."""
    if p.max_vel_y == 0.0 and p.min_vel_y == 0.0:
        return 0.0, 0.0
    span, top, now = p.period, p.max_vel_y, velocity[2]
    if not p.use_dwa:
        span = p.sim_time
        top = max(min(top, goal_distance / p.sim_time), p.min_vel_y)
    return max(p.min_vel_y, now - p.acc_lim_y * span), min(top, now + p.acc_lim_y * span)


@kernel
def _roll_sample(
    p: Window, pose: FloatArray, velocity: FloatArray, v: float, w: float, u: float, steps: int, out: FloatArray
) -> tuple[float, float, float]:
    """Roll a sample out; returns the speeds that it would command: its own, or what a first step of accelerating gives."""
    dt = p.sim_time / steps
    if p.use_dwa:
        roll(pose, v, w, v, w, 0.0, 0.0, dt, steps, out, u, u, 0.0)
        return v, w, u
    first_v, first_w = approach(v, velocity[0], p.acc_lim_x, dt), approach(w, velocity[1], p.acc_lim_theta, dt)
    first_u = 0.0 if velocity.size < 3 else approach(u, velocity[2], p.acc_lim_y, dt)
    roll(pose, first_v, first_w, v, w, p.acc_lim_x, p.acc_lim_theta, dt, steps, out, first_u, u, p.acc_lim_y)
    return first_v, first_w, first_u


@kernel
def growth(p: Window, v: float, u: float = 0.0) -> float:
    """How much the footprint is enlarged at a speed (obstacle_cost_function.cpp)."""
    speed = abs(v) if u == 0.0 else math.hypot(v, u)
    if speed <= p.scaling_speed or p.max_vel_trans == p.scaling_speed:
        return 1.0
    return p.max_scaling_factor * (speed - p.scaling_speed) / (p.max_vel_trans - p.scaling_speed) + 1.0


@kernel
def search(
    p: Window,
    signs: Signs,
    pose: FloatArray,
    velocity: FloatArray,
    ahead: FloatArray,
    scene: Scene,
    room: Room,
) -> tuple[float, float, float, float, FloatArray]:
    """The cheapest legal sample: its cost (negative if there is none), v, w, speed to the left and rollout (k, 5)."""
    frame = scene.frame
    stride = frame.cols + 2
    path, goal, front, wanted = room.path, room.goal, room.front, room.wanted
    last = ahead.shape[0] - 1
    end_x, end_y = ahead[last, 0], ahead[last, 1]
    left = math.hypot(end_x - pose[0], end_y - pose[1])
    low_v, high_v, low_w, high_w = window_of(p, velocity, left)
    low_u, high_u = sideways_of(p, velocity, left)
    speeds, turns = velocity_samples(low_v, high_v, p.vx_samples), velocity_samples(low_w, high_w, p.vth_samples)
    sides = velocity_samples(low_u, high_u, p.vy_samples)
    n = speeds.size * sides.size * turns.size
    sample_v, sample_w, sample_u = np.empty(n), np.empty(n), np.empty(n)
    begin = np.zeros(n + 1, np.int64)
    longest, k = 0, 0
    for v in speeds:
        for u in sides:
            for w in turns:
                sample_v[k], sample_w[k], sample_u[k] = v, w, u
                steps = sample_steps(p, v, w, u)
                longest = max(longest, steps)
                begin[k + 1] = begin[k] + steps
                k += 1

    # Which cells does each rollout pass, and in which does its nose end?
    points = np.empty((max(longest, 1), 5))
    cells = np.empty(begin[n], np.int32)
    nose = np.full(n, -1, np.int32)
    legal = np.zeros(n, np.bool_)
    command = np.empty((n, 3))
    distinct = np.empty(begin[n] + n, np.int32)
    count = 0
    use_nose = p.goal_bias != 0.0 or p.align_bias != 0.0
    for k in range(n):
        steps = begin[k + 1] - begin[k]
        if steps == 0:
            continue
        v, w, u = _roll_sample(p, pose, velocity, sample_v[k], sample_w[k], sample_u[k], steps, points)
        command[k, 0], command[k, 1], command[k, 2] = v, w, u
        if forbids(signs, v, w, u):
            continue
        inside = True
        for i in range(steps):
            cell = cell_of(frame, points[i, 0], points[i, 1])
            ahead_cell = cell
            if use_nose and p.nose != 0.0:
                nose_x, nose_y = points[i, 0] + p.nose * points[i, 3], points[i, 1] + p.nose * points[i, 4]
                ahead_cell = cell_of(frame, nose_x, nose_y)
            if cell < 0 or ahead_cell < 0:
                inside = False
                break
            cells[begin[k] + i] = cell
            nose[k] = ahead_cell
        if not inside:
            continue
        legal[k] = True
        for i in range(begin[k], begin[k + 1]):
            if wanted[cells[i]] == 0:
                distinct[count] = cells[i]
                count += 1
            wanted[cells[i]] |= BODY
        if wanted[nose[k]] == 0:
            distinct[count] = nose[k]
            count += 1
        wanted[nose[k]] |= NOSE

    # Three waves: from the plan, from the local goal, and from the point that the nose is to reach beyond it.
    unreached = mapgrid.clear(scene.cost, room.blank)
    seek = Seek(distinct, count)
    mapgrid.refill(path, room.blank)
    targets, local_goal = lay_plan(scene, ahead, end_x, end_y, path, room.queue, True)
    spread(room, path, targets, seek, BODY | NOSE, stride, unreached)
    towards = math.atan2(end_y - pose[1], end_x - pose[0])
    front_x, front_y = end_x + p.nose * math.cos(towards), end_y + p.nose * math.sin(towards)
    _, front_goal = lay_plan(scene, ahead, front_x, front_y, path, room.queue, False)
    if front_goal == local_goal:  # both where the plan leaves the map: one wave serves both
        spread_from(room, goal, local_goal, seek, BODY | NOSE, stride, unreached)
        front = goal
    else:
        spread_from(room, goal, local_goal, seek, BODY, stride, unreached)
        spread_from(room, front, front_goal, seek, NOSE, stride, unreached)
    for i in range(count):
        wanted[distinct[i]] = 0

    # Grid costs of each rollout, which bound its cost from below.
    bound = np.full(n, np.inf)
    for k in range(n):
        if not legal[k]:
            continue
        ok = True
        for i in range(begin[k], begin[k + 1]):
            c = cells[i]
            if (p.path_bias != 0.0 and path[c] >= unreached - 1) or (p.goal_bias != 0.0 and goal[c] >= unreached - 1):
                ok = False
                break
        if ok:
            end = cells[begin[k + 1] - 1]
            bound[k] = (
                p.goal_bias * min(front[nose[k]], unreached)
                + p.align_bias * min(path[nose[k]], unreached)
                + p.path_bias * path[end]
                + p.goal_bias * goal[end]
                + p.twirl_scale * abs(command[k, 1])
            )

    # Footprint costs in the order of the bounds, until no sample can win any more. The first sample wins a tie.
    best, best_cost = -1, np.inf
    while True:
        k = int(np.argmin(bound))
        if bound[k] == np.inf or bound[k] > best_cost + 1e-9:
            break
        least = bound[k]
        bound[k] = np.inf
        steps = begin[k + 1] - begin[k]
        total = least
        if p.occ_scale != 0.0:
            _roll_sample(p, pose, velocity, sample_v[k], sample_w[k], sample_u[k], steps, points)
            limit = (best_cost + 1e-9 - least) / p.occ_scale
            occ = occlusion(scene, points, steps, growth(p, command[k, 0], command[k, 2]), p.sum_scores, limit)
            if occ < 0.0:
                continue
            end = cells[begin[k + 1] - 1]
            total = p.occ_scale * occ + p.goal_bias * min(front[nose[k]], unreached)
            total += p.align_bias * min(path[nose[k]], unreached)
            total += p.path_bias * path[end]
            total += p.goal_bias * goal[end]
            total += p.twirl_scale * abs(command[k, 1])
        if total < best_cost or (total == best_cost and k < best):
            best, best_cost = k, total
    if best < 0:
        return -1.0, 0.0, 0.0, 0.0, points[:0]
    steps = begin[best + 1] - begin[best]
    _roll_sample(p, pose, velocity, sample_v[best], sample_w[best], sample_u[best], steps, points)
    return best_cost, command[best, 0], command[best, 1], command[best, 2], points[:steps]


@kernel
def motion_cost(p: Window, pose: FloatArray, velocity: FloatArray, v: float, w: float, u: float, scene: Scene) -> float:
    """The obstacle cost of one motion, -1 where it is illegal; 0 where it is too slow to be rolled out."""
    steps = sample_steps(p, v, w, u)
    if steps == 0 or p.occ_scale == 0.0:
        return 0.0
    points = np.empty((steps, 5))
    _roll_sample(p, pose, velocity, v, w, u, steps, points)
    return occlusion(scene, points, steps, growth(p, v, u), False, np.inf)

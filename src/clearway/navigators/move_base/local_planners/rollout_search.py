"""Trajectory rollout's search: which samples there are, what each costs, which one is taken.

Behaviour after base_local_planner/src/trajectory_planner.cpp, for a differential base. As in `dwa_search`, a
footprint is only laid down where a sample can still win.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import (
    INSCRIBED,
    Scene,
    cell_of,
    footprint_cost,
    free_under_robot,
    line_cost,
    row_col,
)
from clearway.navigators.move_base.local_planners import mapgrid
from clearway.navigators.move_base.local_planners.mapgrid import (
    BODY,
    NOSE,
    GridArray,
    Room,
    Seek,
    lay_plan,
    spread,
    spread_from,
)
from clearway.navigators.move_base.local_planners.sampling import occlusion, roll

BLOCKED, NO_WAY = -1.0, -2.0  # costs of a rollout that hits something, and of one that the goal can't be reached from


class Rollout(NamedTuple):
    """What the search needs of `TrajectoryParameters` and of the planner's state, for one cycle.

    Attributes:
        max_vel_x: Largest forward speed, at most the set speed, m/s.
        min_vel_x: Least forward speed, m/s.
        max_vel_theta: Largest yaw rate to the left, rad/s.
        min_vel_theta: Largest yaw rate to the right, negative, rad/s.
        min_in_place: Least yaw rate of a turn in place, rad/s.
        backup: Speed of backing out when nothing else is legal, negative, m/s.
        acc_lim_x: Acceleration, m/s^2.
        acc_lim_theta: Angular acceleration, rad/s^2.
        period: Control period, s.
        dwa: Whether samples are what can be reached in a period; else in `sim_time`.
        vx_samples: Number of speeds that are tried.
        vtheta_samples: Number of yaw rates that are tried.
        sim_time: How far ahead a motion is looked at, s.
        sim_granularity: Distance between points that are checked, m.
        angular_sim_granularity: Yaw rate for each point that is checked, rad/s.
        path_bias: Weight of the distance from the plan, per cell.
        goal_bias: Weight of the distance from the local goal, per cell.
        occ_scale: Weight of the highest cost on the way.
        lookahead: How far ahead of the robot turns in place are compared, m.
        heading_scoring: Whether the heading at `heading_time` is scored instead of the end.
        heading_time: When the heading is scored, s.
        attractor: Whether the squared distance to the plan's end is scored as the distance from the goal.
        escaping: Whether the robot is backing out.
        no_right: Whether it may not turn right.
        no_left: Whether it may not turn left.
    """

    max_vel_x: float
    min_vel_x: float
    max_vel_theta: float
    min_vel_theta: float
    min_in_place: float
    backup: float
    acc_lim_x: float
    acc_lim_theta: float
    period: float
    dwa: bool
    vx_samples: int
    vtheta_samples: int
    sim_time: float
    sim_granularity: float
    angular_sim_granularity: float
    path_bias: float
    goal_bias: float
    occ_scale: float
    lookahead: float
    heading_scoring: bool
    heading_time: float
    attractor: bool
    escaping: bool
    no_right: bool
    no_left: bool


@kernel
def window_of(p: Rollout, velocity: FloatArray, goal_distance: float) -> tuple[float, float, float, float]:
    """The speeds (v_min, v_max, w_min, w_max) to sample, no faster than reaches the plan's end in sim_time."""
    span = p.period if p.dwa else p.sim_time
    top = min(p.max_vel_x, goal_distance / p.sim_time)
    return (
        max(p.min_vel_x, velocity[0] - p.acc_lim_x * span),
        max(min(top, velocity[0] + p.acc_lim_x * span), p.min_vel_x),
        max(p.min_vel_theta, velocity[1] - p.acc_lim_theta * span),
        min(p.max_vel_theta, velocity[1] + p.acc_lim_theta * span),
    )


@kernel
def samples(p: Rollout, window: tuple[float, float, float, float], out: FloatArray) -> tuple[int, int]:
    """All samples in their order: driving, then turning in place, then backing up.

    Args:
        out: (>= vx * vtheta + vtheta + 1, 3) filled with v, w, and w before the least rate in place was enforced.

    Returns:
        Number of driving samples, number of those and the turning ones.
    """
    low_v, high_v, low_w, high_w = window
    step_v, step_w = (high_v - low_v) / (p.vx_samples - 1), (high_w - low_w) / (p.vtheta_samples - 1)
    n = 0
    v = low_v
    if not p.escaping:
        for _ in range(p.vx_samples):
            out[n, 0], out[n, 1], out[n, 2] = v, 0.0, 0.0
            n += 1
            w = low_w
            for _ in range(p.vtheta_samples - 1):  # the highest rate is left out, as in the real one
                out[n, 0], out[n, 1], out[n, 2] = v, w, w
                n += 1
                w += step_w
            v += step_v
    driving = n
    w = low_w
    for _ in range(p.vtheta_samples):
        limited = max(w, p.min_in_place) if w > 0.0 else min(w, -p.min_in_place)
        out[n, 0], out[n, 1], out[n, 2] = 0.0, limited, w
        n += 1
        w += step_w
    out[n, 0], out[n, 1], out[n, 2] = p.backup, 0.0, 0.0
    return driving, n


@kernel
def sample_steps(p: Rollout, v: float, w: float) -> int:
    """Number of points of a sample's rollout, at least one."""
    if p.heading_scoring:
        steps = int(p.sim_time / p.sim_granularity + 0.5)
    else:
        steps = int(max(abs(v) * p.sim_time / p.sim_granularity, abs(w) / p.angular_sim_granularity) + 0.5)
    return max(steps, 1)


@kernel
def _lay_out(p: Rollout, pose: FloatArray, velocity: FloatArray, sample: FloatArray, out: FloatArray) -> int:
    """Roll one sample (row of `samples`) out from the current speeds; the number of points in `out` (k, 5)."""
    steps = sample_steps(p, sample[0], sample[1])
    dt = p.sim_time / steps
    roll(pose, velocity[0], velocity[1], sample[0], sample[1], p.acc_lim_x, p.acc_lim_theta, dt, steps, out)
    return steps


@kernel
def heading_error(scene: Scene, x: float, y: float, yaw: float, ahead: FloatArray) -> float:
    """Angle between a heading and the farthest point of the plan in sight over cells that the robot's centre may cross."""
    frame = scene.frame
    r0, c0 = row_col(frame, x, y)
    for i in range(ahead.shape[0] - 1, -1, -1):
        r1, c1 = row_col(frame, ahead[i, 0], ahead[i, 1])
        if r1 >= 0 and 0 <= line_cost(scene.cost, r0, c0, r1, c1) < INSCRIBED:
            goal_x, goal_y = frame.x + (c1 + 0.5) * frame.resolution, frame.y + (r1 + 0.5) * frame.resolution
            return abs(wrap(math.atan2(goal_y - y, goal_x - x) - yaw))
    return np.inf


@kernel
def grid_cost(
    p: Rollout, scene: Scene, points: FloatArray, cells: GridArray, ahead: FloatArray, room: Room, impossible: int
) -> float:
    """A rollout's cost without its footprint's part; inf where the goal can't be reached from somewhere on it."""
    path, goal = room.path, room.goal
    steps = cells.size
    end = cells[steps - 1]
    if p.attractor:
        last = ahead.shape[0] - 1
        x, y = points[steps - 1, 0] - ahead[last, 0], points[steps - 1, 1] - ahead[last, 1]
        return float(p.goal_bias * (x * x + y * y))
    if not p.heading_scoring:
        for c in cells:
            if path[c] >= impossible or goal[c] >= impossible:
                return np.inf
        return float(p.path_bias * path[end] + p.goal_bias * goal[end])
    dt = p.sim_time / steps
    time, total = 0.0, 0.0
    for i in range(steps):
        if p.heading_time <= time < p.heading_time + dt:
            c = cells[i]
            if path[c] >= impossible or goal[c] >= impossible:
                return np.inf
            error = heading_error(scene, points[i, 0], points[i, 1], points[i, 2], ahead)
            total = p.path_bias * path[c] + 0.3 * error + p.goal_bias * goal[c]
        time += dt
    return total


@kernel
def _full_cost(
    p: Rollout,
    scene: Scene,
    pose: FloatArray,
    velocity: FloatArray,
    sample: FloatArray,
    bound: float,
    best_cost: float,
    points: FloatArray,
) -> float:
    """A sample's cost with its footprint's part: negative where illegal, above `best_cost` where it can't win."""
    steps = _lay_out(p, pose, velocity, sample, points)
    limit = (best_cost + 1e-9 - bound) / p.occ_scale if p.occ_scale > 0.0 else np.inf
    occ = occlusion(scene, points, steps, 1.0, False, limit)
    return bound + p.occ_scale * occ if occ >= 0.0 else BLOCKED


@kernel
def _why_not(
    p: Rollout,
    scene: Scene,
    pose: FloatArray,
    velocity: FloatArray,
    sample: FloatArray,
    room: Room,
    impossible: int,
    points: FloatArray,
) -> float:
    """What fails first on the way of a sample that is illegal: something is hit, or the goal can't be reached."""
    frame = scene.frame
    for i in range(_lay_out(p, pose, velocity, sample, points)):
        x, y = points[i, 0], points[i, 1]
        if footprint_cost(scene.cost, frame, scene.polygon, x, y, points[i, 3], points[i, 4], 1.0) < 0:
            return BLOCKED
        cell = cell_of(frame, x, y)
        if room.path[cell] >= impossible or room.goal[cell] >= impossible:
            return NO_WAY
    return BLOCKED


@kernel
def search(
    p: Rollout,
    pose: FloatArray,
    velocity: FloatArray,
    check: FloatArray,
    ahead: FloatArray,
    scene: Scene,
    room: Room,
) -> tuple[float, FloatArray, FloatArray, bool, bool]:
    """Find the best sample.

    Args:
        pose: (3,) of the robot, local frame.
        velocity: (2,) its v [m/s] and omega [rad/s].
        check: (2,) a motion to judge beside.
        ahead: (n, 3) the plan, local frame.

    Returns:
        Its cost; its speeds (2,); its rollout (k, 5); whether it is the one that backs up (its cost may then be
        negative, for `TrajectoryPlanner` to judge); whether the motion `check` is legal.
    """
    frame = scene.frame
    stride = frame.cols + 2
    wanted = room.wanted
    last = ahead.shape[0] - 1
    end_x, end_y = ahead[last, 0], ahead[last, 1]
    window = window_of(p, velocity, math.hypot(end_x - pose[0], end_y - pose[1]))
    sample = np.empty((p.vx_samples * p.vtheta_samples + p.vtheta_samples + 2, 3))
    driving, turning = samples(p, window, sample)
    backing, checked = turning, turning + 1
    n = checked + 1
    sample[checked, 0], sample[checked, 1], sample[checked, 2] = check[0], check[1], check[1]
    begin = np.zeros(n + 1, np.int64)
    longest = 1
    for k in range(n):
        steps = sample_steps(p, sample[k, 0], sample[k, 1])
        longest = max(longest, steps)
        begin[k + 1] = begin[k] + steps

    # Which cells does each rollout pass, and which lie ahead of a turn?
    points = np.empty((longest, 5))
    cells = np.empty(begin[n], np.int32)
    nose = np.full(n, -1, np.int32)
    inside = np.ones(n, np.bool_)
    distinct = np.empty(begin[n] + n, np.int32)
    count = 0
    for k in range(n):
        steps = _lay_out(p, pose, velocity, sample[k], points)
        for i in range(steps):
            cell = cell_of(frame, points[i, 0], points[i, 1])
            if cell < 0:
                inside[k] = False
                break
            cells[begin[k] + i] = cell
            if wanted[cell] == 0:
                distinct[count] = cell
                count += 1
            wanted[cell] |= BODY
        if driving <= k < turning and inside[k]:
            i = steps - 1
            nose[k] = cell_of(
                frame, points[i, 0] + p.lookahead * points[i, 3], points[i, 1] + p.lookahead * points[i, 4]
            )
            if nose[k] >= 0:
                if wanted[nose[k]] == 0:
                    distinct[count] = nose[k]
                    count += 1
                wanted[nose[k]] |= NOSE

    unreached = mapgrid.clear(scene.cost, room.blank)
    seek = Seek(distinct, count)
    mapgrid.refill(room.path, room.blank)
    free_under_robot(scene, pose, room.path, unreached)  # in this grid alone, as in the real one
    targets, local_goal = lay_plan(scene, ahead, end_x, end_y, room.path, room.queue, True)
    spread(room, room.path, targets, seek, BODY, stride, unreached)
    spread_from(room, room.goal, local_goal, seek, BODY | NOSE, stride, unreached)
    for i in range(count):
        wanted[distinct[i]] = 0

    bound = np.full(n, np.inf)
    for k in range(n):
        if inside[k]:
            if p.attractor or p.heading_scoring:
                _lay_out(p, pose, velocity, sample[k], points)
            bound[k] = grid_cost(p, scene, points, cells[begin[k] : begin[k + 1]], ahead, room, unreached - 1)

    # Driving: the cheapest, the first one on a tie.
    best, best_cost = -1, np.inf
    left = bound[:driving].copy()
    while driving > 0:
        k = int(np.argmin(left))
        if left[k] == np.inf or left[k] > best_cost:
            break
        left[k] = np.inf
        total = _full_cost(p, scene, pose, velocity, sample[k], bound[k], best_cost, points)
        if total >= 0.0 and (total < best_cost or (total == best_cost and k < best)):
            best, best_cost = k, total

    # Turning in place: at most as dear as the best so far, each one to look nearer to the goal than the last taken.
    step_w = (window[3] - window[2]) / (p.vtheta_samples - 1)
    nearest = np.inf
    for k in range(driving, turning):
        w = sample[k, 2]
        if bound[k] == np.inf or bound[k] > best_cost or nose[k] < 0 or not (w > step_w or w < -step_w):
            continue
        if (w < 0.0 and p.no_right) or (w > 0.0 and p.no_left):
            continue
        look = float(min(room.goal[nose[k]], unreached))
        if look < nearest:
            total = _full_cost(p, scene, pose, velocity, sample[k], bound[k], best_cost, points)
            if 0.0 <= total <= best_cost:
                best, best_cost, nearest = k, total, look

    legal = (
        bound[checked] < np.inf
        and _full_cost(p, scene, pose, velocity, sample[checked], bound[checked], np.inf, points) >= 0.0
    )
    if best < 0:
        best = backing
        best_cost = BLOCKED
        if bound[backing] < np.inf:
            best_cost = _full_cost(p, scene, pose, velocity, sample[backing], bound[backing], np.inf, points)
        else:
            best_cost = _why_not(p, scene, pose, velocity, sample[backing], room, unreached - 1, points)
    steps = _lay_out(p, pose, velocity, sample[best], points)
    return best_cost, sample[best, :2].copy(), points[:steps], best == backing, legal

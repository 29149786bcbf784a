"""Trajectory rollout as ROS's older TrajectoryPlannerROS does it (Gerkey and Konolige 2008), `dwa` true or false.

Behaviour after base_local_planner/src/trajectory_planner{,_ros}.cpp, for a differential base. As in
`clearway.navigators.move_base.dwa`, a footprint is only laid down where a sample can still win.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.move_base import mapgrid
from clearway.navigators.move_base.footprint import (
    INSCRIBED,
    CostArray,
    Scene,
    cell_of,
    footprint_cost,
    free_under_robot,
    line_cost,
    make_scene,
    row_col,
)
from clearway.navigators.move_base.goal import slow_down, turn_rate
from clearway.navigators.move_base.local_interface import LocalResult
from clearway.navigators.move_base.local_parameters import TrajectoryParameters
from clearway.navigators.move_base.mapgrid import (
    BODY,
    NOSE,
    GridArray,
    Room,
    Seek,
    lay_plan,
    make_room,
    spread,
    spread_from,
)
from clearway.navigators.move_base.sampling import occlusion, roll

_STANDING = 1e-2  # m/s and rad/s; fixed in trajectory_planner_ros.cpp
_BLOCKED, _NO_WAY = -1.0, -2.0  # costs of a rollout that hits something, and of one that the goal can't be reached from
_NOTHING: FloatArray = np.empty((0, 2))


class Rollout(NamedTuple):
    """What the search needs of the parameters and of the planner's state, for one cycle. Biases are per cell."""

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
    return bound + p.occ_scale * occ if occ >= 0.0 else _BLOCKED


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
            return _BLOCKED
        cell = cell_of(frame, x, y)
        if room.path[cell] >= impossible or room.goal[cell] >= impossible:
            return _NO_WAY
    return _BLOCKED


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
        pose: (3,). velocity: (2,). check: (2,) a motion to judge beside. ahead: (n, 3) the plan, local frame.

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
        best_cost = _BLOCKED
        if bound[backing] < np.inf:
            best_cost = _full_cost(p, scene, pose, velocity, sample[backing], bound[backing], np.inf, points)
        else:
            best_cost = _why_not(p, scene, pose, velocity, sample[backing], room, unreached - 1, points)
    steps = _lay_out(p, pose, velocity, sample[best], points)
    return best_cost, sample[best, :2].copy(), points[:steps], best == backing, legal


class TrajectoryPlanner:
    """`base_local_planner/TrajectoryPlannerROS`."""

    def __init__(self, parameters: TrajectoryParameters, polygon: FloatArray, period: float) -> None:
        """
        Args:
            polygon: (m, 2) padded outline in base_link, m. period: s, one over the controller's frequency.
        """
        self._parameters = parameters
        self._polygon = np.ascontiguousarray(polygon, dtype=np.float64)
        self._period = period
        self._room: Room | None = None
        self.reset()

    @property
    def prune_plan(self) -> bool:
        """Whether the plan behind the robot is to be forgotten."""
        return self._parameters.prune_plan

    def reset(self) -> None:
        """Forget everything: a new trial."""
        self._latched = self._reached = self._turning = False
        self._turned_right = self._turned_left = False
        self._no_left = self._no_right = False
        self._escaping = False
        self._turned_at = np.zeros(2)
        self._escaped_at = np.zeros(3)

    def set_plan(self) -> None:
        """A new plan: the latch is dropped."""
        self._latched = self._reached = False

    def goal_reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        """Whether the last `compute` found the robot at the goal, turned to it (it need not stand: as in ROS)."""
        return self._reached

    def compute(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        plan: FloatArray,
        goal: FloatArray,
        cost: CostArray,
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
    ) -> LocalResult:
        """Stop and turn where the plan's stretch ends within tolerance, else the best rollout. See `LocalPlanner.compute`."""
        p = self._parameters
        end = plan[-1]
        if self._latched or math.hypot(end[0] - pose[0], end[1] - pose[1]) <= p.xy_goal_tolerance:
            self._latched = self._latched or p.latch_xy_goal_tolerance
            if abs(wrap(end[2] - pose[2])) <= p.yaw_goal_tolerance:
                self._turning = self._latched = False
                self._reached = True
                return LocalResult(0.0, 0.0, True, _NOTHING)
            v, w = self._final_command(pose, velocity, wrap(end[2] - pose[2]))
            # The real one searches here too, for the grids' sake, and its state moves on with what it finds.
            *_, legal = self._search(pose, velocity, (v, w), plan, cost, origin, resolution, speed_limit)
            return LocalResult(v, w, True, _NOTHING) if legal else LocalResult(0.0, 0.0, False, _NOTHING)
        total, v, w, points, _ = self._search(pose, velocity, (0.0, 0.0), plan, cost, origin, resolution, speed_limit)
        if total < 0.0:
            return LocalResult(0.0, 0.0, False, _NOTHING)
        return LocalResult(v, w, True, points[:, :2].copy())

    def _final_command(self, pose: FloatArray, velocity: FloatArray, difference: float) -> tuple[float, float]:
        """(v, omega) at the goal's place: brake, then turn in place."""
        p = self._parameters
        standing = abs(velocity[0]) <= _STANDING and abs(velocity[1]) <= _STANDING
        if not self._turning and not standing:
            return (
                slow_down(float(velocity[0]), p.acc_lim_x * self._period),
                slow_down(float(velocity[1]), p.acc_lim_theta * self._period),
            )
        self._turning = True
        low, high = p.least_goal_turn, p.max_rotational_vel
        return 0.0, turn_rate(difference, float(velocity[1]), p.acc_lim_theta, self._period, low, high)

    def _search(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        check: tuple[float, float],
        plan: FloatArray,
        cost: CostArray,
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
    ) -> tuple[float, float, float, FloatArray, bool]:
        """`search`, and what it means for the flags against oscillation and for the escape (createTrajectories)."""
        if self._room is None or len(self._room.blank) != (cost.shape[0] + 2) * (cost.shape[1] + 2):
            self._room = make_room(cost.shape)
        scene = make_scene(cost, origin, resolution, self._polygon)
        settings = self.window(resolution, speed_limit)
        total, speeds, points, backing, legal = search(
            settings, pose, velocity, np.array(check), plan, scene, self._room
        )
        v, w = float(speeds[0]), float(speeds[1])
        p = self._parameters
        if not backing and not v > 0.0:
            if w < 0.0:
                self._no_left = self._no_left or self._turned_right
                self._turned_right = True
            elif w > 0.0:
                self._no_right = self._no_right or self._turned_left
                self._turned_left = True
            self._turned_at = pose[:2].copy()
        if math.hypot(pose[0] - self._turned_at[0], pose[1] - self._turned_at[1]) > p.oscillation_reset_dist:
            self._turned_right = self._turned_left = self._no_left = self._no_right = False
        if backing and not self._escaping and total > _NO_WAY:
            self._escaped_at = pose.copy()
            self._escaping = True
        moved = math.hypot(pose[0] - self._escaped_at[0], pose[1] - self._escaped_at[1])
        if moved > p.escape_reset_dist or abs(wrap(pose[2] - self._escaped_at[2])) > p.escape_reset_theta:
            self._escaping = False
        if backing and total == _BLOCKED:
            total = 1.0  # backs up even where that seems blocked
        return total, v, w, points, legal

    def window(self, resolution: float, speed_limit: float) -> Rollout:
        """The parameters and the state of one cycle; the forward speed is capped (m/s)."""
        p = self._parameters
        per_cell = resolution if p.meter_scoring else 1.0
        return Rollout(
            max_vel_x=min(p.max_vel_x, speed_limit),
            min_vel_x=p.min_vel_x,
            max_vel_theta=p.max_vel_theta,
            min_vel_theta=p.min_vel_theta,
            min_in_place=p.min_in_place_vel_theta,
            backup=p.escape_vel,
            acc_lim_x=p.acc_lim_x,
            acc_lim_theta=p.acc_lim_theta,
            period=self._period,
            dwa=p.dwa,
            vx_samples=p.vx_samples,
            vtheta_samples=p.vtheta_samples,
            sim_time=p.sim_time,
            sim_granularity=p.sim_granularity,
            angular_sim_granularity=p.angular_sim_granularity,
            path_bias=p.path_bias * per_cell,
            goal_bias=p.goal_bias * per_cell,
            occ_scale=p.occdist_scale,
            lookahead=p.heading_lookahead,
            heading_scoring=p.heading_scoring,
            heading_time=p.heading_scoring_timestep,
            attractor=p.simple_attractor,
            escaping=self._escaping,
            no_right=self._no_right,
            no_left=self._no_left,
        )

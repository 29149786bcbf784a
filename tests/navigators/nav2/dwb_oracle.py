"""A second, plain reading of Nav2's DWB controller, step by step as its sources have it.

Read from nav2_dwb_controller: one_d_velocity_iterator.hpp, xy_theta_iterator.cpp, kinematic_parameters.hpp,
standard_traj_generator.cpp, limited_accel_generator.cpp, dwb_local_planner.cpp, dwb_critics/src/*.cpp, costmap_queue.cpp
and nav_2d_utils/src/path_ops.cpp. Parameters are dicts by their names; each critic is a class of its own.
"""

from __future__ import annotations

import heapq
import math
from itertools import pairwise
from typing import Any

import numpy as np
from pursuit_oracle import PlainMap, cells_between

Pose = tuple[float, float, float]
EPS = float(np.finfo(np.float32).eps)


class Illegal(Exception):
    pass


def turn(a: float, b: float) -> float:
    return math.atan2(math.sin(b - a), math.cos(b - a))


def project(v0: float, accel: float, decel: float, dt: float, target: float) -> float:
    return min(target, v0 + accel * dt) if v0 < target else max(target, v0 + decel * dt)


def iterate(now: float, low: float, high: float, accel: float, decel: float, dt: float, samples: int) -> list[float]:
    now = min(max(now, low), high)
    top, bottom = project(now, accel, decel, dt, high), project(now, accel, decel, dt, low)
    step = 1.0 if abs(bottom - top) < 1e-5 else (top - bottom) / (max(2, samples) - 1)
    found, value, zero = [], bottom, True
    while value <= top + 1e-5:
        found.append(value)
        if zero and value < 0.0 < value + step <= top + 1e-5:
            found.append(0.0)
            zero = False
        value += step
    return found


class Trajectory:
    """Its command, its poses, and the time of each but a repeated last one."""

    def __init__(self, p: dict[str, Any], pose: Pose, now: Pose, sample: Pose) -> None:
        self.velocity = sample
        if p["discretize_by_time"]:
            count = math.ceil(p["sim_time"] / p["time_granularity"])
        else:
            far = math.hypot(*sample[:2]) * p["sim_time"] / p["linear_granularity"]
            count = math.ceil(max(far, abs(sample[2]) * p["sim_time"] / p["angular_granularity"]))
        count = max(1, count)
        dt = self.dt = p["sim_time"] / count
        self.poses, v = [pose], now
        for k in range(count):
            if "Limited" in p["trajectory_generator_name"]:
                v = sample
            else:
                axes = ("x", "y", "theta")
                v = tuple(
                    project(v[i], p[f"acc_lim_{a}"], p[f"decel_lim_{a}"], dt, sample[i]) for i, a in enumerate(axes)
                )
            if k == 0 and p["limit_vel_cmd_in_traj"]:
                self.velocity = v
            x, y, yaw = self.poses[-1]
            x += (v[0] * math.cos(yaw) + v[1] * math.cos(math.pi / 2 + yaw)) * dt
            y += (v[0] * math.sin(yaw) + v[1] * math.sin(math.pi / 2 + yaw)) * dt
            self.poses.append((x, y, yaw + v[2] * dt))
        self.end = count
        if p["include_last_point"]:
            self.poses.append(self.poses[-1])


def adjusted(path: list[Pose], resolution: float) -> list[complex]:
    out, last = [complex(*path[0][:2])], complex(*path[0][:2])
    for pose in path[1:]:
        to = complex(*pose[:2])
        if abs(to - last) ** 2 > resolution**2 * 4.0:
            steps = int((abs(to - last) - 2 * resolution) / resolution) - 1
            out += [last + j * ((to - last) / steps) for j in range(1, steps)]
        out.append(to)
        last = to
    return out


class Critic:
    """What critics are told: parameters `q` of their own, `p` of the controller."""

    def __init__(self, p: dict[str, Any], q: dict[str, Any]) -> None:
        self.p, self.q = p, q
        self.reset()

    def reset(self) -> None: ...

    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        self.grid, self.outline = grid, outline

    def scale(self) -> float:
        return self.q["scale"]

    def debrief(self, now: float, v: Pose) -> None: ...


class RotateToGoal(Critic):
    def reset(self) -> None:
        self.in_window = self.rotating = False

    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        length = sum(math.dist(a[:2], b[:2]) for a, b in pairwise(path))
        near = math.dist(pose[:2], goal[:2]) <= self.p["xy_goal_tolerance"] and length <= 1.0
        self.in_window = self.in_window or near
        self.speed = v[0] ** 2 + v[1] ** 2
        self.rotating = self.rotating or (self.in_window and self.speed <= self.p["trans_stopped_velocity"] ** 2)
        self.goal = goal[2]

    def score(self, t: Trajectory) -> float:
        if not self.in_window:
            return 0.0
        speed = t.velocity[0] ** 2 + t.velocity[1] ** 2
        if not self.rotating:
            if speed >= self.speed:
                raise Illegal
            return speed * self.q["slowing_factor"] + self.rotation(t)
        if speed > 0:
            raise Illegal
        return self.rotation(t)

    def rotation(self, t: Trajectory) -> float:
        ahead = self.q["lookahead_time"]
        yaw = t.poses[-1][2]
        if 0.0 <= ahead < t.end * t.dt:
            i = int(ahead / t.dt)
            a, b = t.poses[i][2], t.poses[i + 1][2]
            yaw = a + (ahead / t.dt - i) * turn(a, b)
        return abs(turn(yaw, self.goal))


class Oscillation(Critic):
    def reset(self) -> None:
        self.sign = [0, 0, 0]
        self.only = [0, 0, 0]

    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        self.pose = pose

    def score(self, t: Trajectory) -> float:
        if any(only * v < 0 for only, v in zip(self.only, t.velocity, strict=True)):
            raise Illegal
        return 0.0

    def debrief(self, now: float, v: Pose) -> None:
        q, flagged = self.q, False
        slow = q["x_only_threshold"] < 0 or abs(v[0]) <= q["x_only_threshold"]
        for i in range(3) if slow else (0,):
            sign = (v[i] > 0) - (v[i] < 0)
            if sign and self.sign[i] == -sign:
                self.only[i], flagged = sign, True
            self.sign[i] = sign or self.sign[i]
        if flagged:
            self.at, self.since = self.pose, now
        if any(self.only):
            far, angle, time = (q[f"oscillation_reset_{name}"] for name in ("dist", "angle", "time"))
            if (
                (far >= 0 and math.dist(self.pose[:2], self.at[:2]) > far)
                or (angle >= 0 and abs(turn(self.pose[2], self.at[2])) > angle)
                or (time >= 0 and now - self.since > time)
            ):
                self.reset()


class BaseObstacle(Critic):
    def score(self, t: Trajectory) -> float:
        scores = [self.pose_score(pose) for pose in t.poses]
        return sum(scores) if self.q["sum_scores"] else scores[-1]

    def pose_score(self, pose: Pose) -> float:
        cell = self.grid.cell(complex(*pose[:2]))
        if cell is None or self.grid.cost[cell[1], cell[0]] >= 253:
            raise Illegal
        return float(self.grid.cost[cell[1], cell[0]])


class ObstacleFootprint(BaseObstacle):
    def scale(self) -> float:
        return self.grid.resolution * self.q["scale"]

    def pose_score(self, pose: Pose) -> float:
        rotated = complex(math.cos(pose[2]), math.sin(pose[2]))
        corners = [self.grid.cell(complex(*pose[:2]) + complex(*c) * rotated) for c in self.outline.tolist()]
        if self.grid.cell(complex(*pose[:2])) is None or None in corners:
            raise Illegal
        costs = [
            self.grid.cost[c[1], c[0]]
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
            for c in cells_between(a, b)
        ]
        if max(costs) >= 254:
            raise Illegal
        return float(max(costs))


class MapGrid(Critic):
    stops = True

    def scale(self) -> float:
        return self.grid.resolution * 0.5 * self.q["scale"]

    def spread(self, sources: list[tuple[int, int]]) -> None:
        """Distances as CostmapQueue spreads them: cells by their distance from the source that reached them first."""
        rows, cols = self.grid.cost.shape
        self.values = np.full((rows, cols), rows * cols + 1.0)
        seen = set(sources)
        queue = [(0, cell, cell) for cell in sources]
        heapq.heapify(queue)
        while queue:
            distance, (x, y), source = heapq.heappop(queue)
            self.values[y, x] = distance
            for cell in ((x - 1, y), (x, y - 1), (x + 1, y), (x, y + 1)):
                if 0 <= cell[0] < cols and 0 <= cell[1] < rows and cell not in seen:
                    seen.add(cell)
                    away = abs(cell[0] - source[0]) + abs(cell[1] - source[1])
                    heapq.heappush(queue, (away, cell, source))

    def on_map(self, path: list[Pose]) -> list[tuple[int, int]]:
        found: list[tuple[int, int]] = []
        for at in adjusted(path, self.grid.resolution):
            cell = self.grid.cell(at)
            if cell is not None and self.grid.cost[cell[1], cell[0]] != 255:
                found.append(cell)
            elif found:
                break
        return found

    def ahead(self, pose: Pose) -> complex:
        nose = self.q.get("forward_point_distance", 0.0)
        return complex(pose[0] + nose * math.cos(pose[2]), pose[1] + nose * math.sin(pose[2]))

    def score(self, t: Trajectory) -> float:
        how = self.q["aggregation_type"]
        score, obstacle = 1.0 if how == "product" else 0.0, self.grid.cost.size
        for pose in t.poses[-1:] if how == "last" and not self.stops else t.poses:
            cell = self.grid.cell(self.ahead(pose))
            if cell is None:
                raise Illegal
            away = self.values[cell[1], cell[0]]
            if self.stops and away in (obstacle, obstacle + 1):
                raise Illegal
            if how == "last":
                score = away
            elif how == "sum":
                score += away
            elif score > 0:
                score *= away
        return score


class PathDist(MapGrid):
    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        super().prepare(grid, outline, pose, v, goal, path)
        self.spread(self.on_map(path))


class GoalDist(MapGrid):
    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        super().prepare(grid, outline, pose, v, goal, path)
        self.spread(self.on_map(path)[-1:])


class PathAlign(PathDist):
    stops = False

    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        super().prepare(grid, outline, pose, v, goal, path)
        self.zero = math.dist(pose[:2], goal[:2]) <= abs(self.q["forward_point_distance"])

    def scale(self) -> float:
        return 0.0 if self.zero else super().scale()


class GoalAlign(GoalDist):
    stops = False

    def prepare(self, grid: PlainMap, outline: np.ndarray, pose: Pose, v: Pose, goal: Pose, path: list[Pose]) -> None:
        nose, towards = self.q["forward_point_distance"], math.atan2(goal[1] - pose[1], goal[0] - pose[0])
        x, y, yaw = path[-1]
        end = (x + nose * math.cos(towards), y + nose * math.sin(towards), yaw)
        super().prepare(grid, outline, pose, v, goal, [*path[:-1], end])


class Twirling(Critic):
    def score(self, t: Trajectory) -> float:
        return abs(t.velocity[2])


class PreferForward(Critic):
    def score(self, t: Trajectory) -> float:
        x, _, theta = t.velocity
        if x < 0.0 or (x < self.q["strafe_x"] and abs(theta) < self.q["strafe_theta"]):
            return self.q["penalty"]
        return abs(theta) * self.q["theta_scale"]


CRITICS = {
    kind.__name__: kind
    for kind in (
        RotateToGoal,
        Oscillation,
        BaseObstacle,
        ObstacleFootprint,
        PathDist,
        GoalDist,
        PathAlign,
        GoalAlign,
        Twirling,
        PreferForward,
    )
}


class PlainDWB:
    """DWBLocalPlanner with its trajectory generator."""

    def __init__(self, p: dict[str, Any], critics: dict[str, dict[str, Any]], period: float) -> None:
        self.p, self.period = p, period
        self.critics = [CRITICS[name](p, q) for name, q in critics.items()]

    def samples(self, now: Pose) -> list[Pose]:
        p = self.p
        reach = (p["sim_period"] or self.period) if "Limited" in p["trajectory_generator_name"] else p["sim_time"]
        axes = []
        for i, axis in enumerate(("x", "y", "theta")):
            high = p[f"max_vel_{axis}"]
            low = -high if axis == "theta" else p[f"min_vel_{axis}"]
            accel, decel = p[f"acc_lim_{axis}"], p[f"decel_lim_{axis}"]
            axes.append(iterate(now[i], low, high, accel, decel, reach, p[f"v{axis}_samples"]))
        return [(x, y, w) for x in axes[0] for y in axes[1] for w in axes[2] if self.valid(x, y, w)]

    def valid(self, x: float, y: float, w: float) -> bool:
        p, squared = self.p, x * x + y * y
        if p["max_speed_xy"] >= 0 and squared > p["max_speed_xy"] ** 2 + EPS:
            return False
        slow = p["min_speed_xy"] >= 0 and squared + EPS < p["min_speed_xy"] ** 2
        if slow and p["min_speed_theta"] >= 0 and abs(w) + EPS < p["min_speed_theta"]:
            return False
        return squared != 0 or w != 0

    def prepare(self, *told: Any) -> None:
        for critic in self.critics:
            critic.prepare(*told)

    def cost(self, t: Trajectory) -> float:
        return sum(c.scale() * c.score(t) for c in self.critics if c.scale() != 0.0)

    def best(self, pose: Pose, now: Pose) -> tuple[float, Trajectory | None]:
        cost, found = math.inf, None
        for sample in self.samples(now):
            t = Trajectory(self.p, pose, now, sample)
            try:
                here = self.cost(t)
            except Illegal:
                continue
            if here < cost:
                cost, found = here, t
        return cost, found

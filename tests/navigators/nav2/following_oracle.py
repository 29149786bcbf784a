"""A second, plain reading of Nav2's path handler and goal checkers, step by step as their sources have it.

Read from nav2_controller/plugins/{feasible_path_handler,simple_goal_checker,position_goal_checker}.cpp and
nav2_util/src/path_utils.cpp; poses are tuples, paths lists of which the beginning is dropped.
"""

from __future__ import annotations

import math
from itertools import pairwise

Pose = tuple[float, float, float]


def turn(a: float, b: float) -> float:
    """The shortest turn from a to b."""
    return math.atan2(math.sin(b - a), math.cos(b - a))


def far(a: Pose, b: Pose) -> float:
    return math.dist(a[:2], b[:2])


def length(path: list[Pose]) -> float:
    return sum(far(a, b) for a, b in pairwise(path))


def within(path: list[Pose], distance: float) -> int:
    """How many of the path's poses come before the one that is further along than `distance`."""
    count, along = 1, 0.0
    for a, b in pairwise(path):
        along += far(a, b)
        if along > distance:
            return count
        count += 1
    return len(path)


def first_constraint(path: list[Pose], inversion: bool, threshold: float) -> int:
    size = len(path)
    if size < 3:
        return size
    rotation_at = inversion_at = size
    before = (0.0, 0.0)
    for i in range(size - 1):
        if rotation_at <= i + 1:
            break
        step = path[i + 1][0] - path[i][0], path[i + 1][1] - path[i][1]
        moves = math.hypot(*step)
        if inversion and moves > 1e-4:
            if i >= 1 and before[0] * step[0] + before[1] * step[1] < 0:
                inversion_at = i + 1
                break
            before = step
        if threshold > 0 and moves < 1e-4 and rotation_at == size:
            total, end = 0.0, i
            while end < size - 1:
                total += abs(turn(path[end][2], path[end + 1][2]))
                if total > threshold:
                    rotation_at = end + 1
                    break
                if end + 2 < size and far(path[end + 1], path[end + 2]) <= 1e-4:
                    end += 1
                    continue
                break
    return min(rotation_at, inversion_at)


class PlainHandler:
    """FeasiblePathHandler, with the whole path and the part up to the next constraint as two lists."""

    def __init__(
        self, prune: float, search: float, inversion: bool, rotation: bool, xy: float, yaw: float, least: float
    ) -> None:
        self.prune, self.search, self.xy, self.yaw = prune, search, xy, yaw
        self.inversion, self.rotation, self.least = inversion, rotation, least if rotation else 0.0

    def set_plan(self, path: list[Pose]) -> None:
        self.whole = list(path)
        self._cut()

    def _cut(self) -> None:
        self.part, self.locale = list(self.whole), 0
        if self.inversion or self.rotation:
            at = first_constraint(self.whole, self.inversion, self.least)
            if at != len(self.whole):
                self.part, self.locale = self.whole[:at], at

    def local_plan(self, pose: Pose, frame: Pose, size: tuple[float, float], origin: tuple[float, float]) -> list[Pose]:
        turned = complex(math.cos(frame[2]), math.sin(frame[2]))
        moved = complex(*frame[:2])
        at = (complex(*pose[:2]) - moved) / turned
        robot = at.real, at.imag, pose[2] - frame[2]
        near = self.part[: within(self.part, self.search)]
        distances = [far(robot, p) for p in near]
        closest = len(near) - 1 - distances[::-1].index(min(distances))
        if len(self.part) > 1 and closest == len(self.part) - 1:
            closest -= 1
        ahead = self.part[closest:]
        found = []
        for x, y, yaw in ahead[: within(ahead, self.prune)]:
            there = complex(x, y) * turned + moved
            if not (0 <= there.real - origin[0] < size[0] and 0 <= there.imag - origin[1] < size[1]):
                break
            found.append((there.real, there.imag, turn(0.0, yaw + frame[2])))
        self.part = ahead
        if self.locale:
            last = self.part[-1]
            if far(robot, last) <= self.xy and abs(turn(robot[2], last[2])) <= self.yaw:
                self.whole = self.whole[self.locale :]
                self._cut()
        return found


class PlainGoalChecker:
    """SimpleGoalChecker, with its member check_xy_."""

    def __init__(self, xy: float, buffer: float, yaw: float, most: float, stateful: bool, symmetric: bool) -> None:
        self.xy, self.buffer, self.yaw, self.most = xy, buffer, yaw, most
        self.stateful, self.symmetric = stateful, symmetric
        self.check_xy = True

    def xy_reached(self, pose: Pose, goal: Pose, left: float) -> bool:
        if left > self.most:
            return False
        if self.check_xy:
            if far(pose, goal) > self.xy:
                return False
            if self.stateful:
                self.check_xy = False
        elif self.stateful and self.buffer > 0.0 and far(pose, goal) > self.xy + self.buffer:
            self.check_xy = True
            return False
        return True

    def reached(self, pose: Pose, goal: Pose, left: float) -> bool:
        if not self.xy_reached(pose, goal, left):
            return False
        headings = [goal[2], goal[2] + math.pi] if self.symmetric else [goal[2]]
        return any(abs(turn(pose[2], h)) <= self.yaw for h in headings)

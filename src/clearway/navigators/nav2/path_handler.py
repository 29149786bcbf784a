"""What of the path a controller follows just now: Nav2's path handler, and its parameters.

Behaviour after nav2_controller/plugins/feasible_path_handler.cpp and nav2_util/src/path_utils.cpp.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import ControllerFailed, CostView, PathHandler
from clearway.quantities import Finite, NonNegative

_STILL = 1e-4
"""A step of the path shorter than this turns in place, m."""

_NO_ROTATION = 1e-6
"""A least rotation below this means that rotations are not looked for, rad."""


class FeasiblePath(Group):
    """`nav2_controller::FeasiblePathHandler` (nav2_controller/plugins/feasible_path_handler.cpp)."""

    prune_distance: NonNegative = Field(default=2.0, description="how much of the path is handed on, along it, m")
    max_robot_pose_search_dist: Finite | None = Field(
        default=None,
        description="how far along the path its nearest pose is looked for, m; negative: to its end; by default half the "
        "local costmap's longer side",
    )
    enforce_path_inversion: bool = Field(
        default=False,
        description="whether a path that turns back is handed on no further than to where it does, until the robot is there",
    )
    enforce_path_rotation: bool = Field(default=False, description="likewise where the path turns in place")
    inversion_xy_tolerance: NonNegative = Field(default=0.2, description="how near to that place is there, m")
    inversion_yaw_tolerance: NonNegative = Field(default=0.4, description="how near to its heading, rad")
    minimum_rotation_angle: NonNegative = Field(default=0.785, description="least turn in place that counts, rad")
    reject_unit_path: bool = Field(default=False, description="whether a path of one pose is refused")


class FeasiblePathHandler:
    """`nav2_controller::FeasiblePathHandler`, a `PathHandler`."""

    def __init__(self, parameters: FeasiblePath) -> None:
        self._parameters = parameters
        self._least_turn = parameters.minimum_rotation_angle if parameters.enforce_path_rotation else 0.0
        self._path: FloatArray = np.empty((0, 3))
        self._begin = self._end = 0  # what of the path is left, up to where it turns back

    def set_plan(self, path: FloatArray) -> None:
        """See `PathHandler`."""
        self._path = np.array(path, dtype=np.float64)
        self._begin, self._end = 0, self._turning_point(0)

    def local_plan(self, pose: FloatArray, frame: FloatArray, view: CostView) -> FloatArray:
        """See `PathHandler`."""
        p = self._parameters
        left = self._end - self._begin
        if left == 0 or (left == 1 and p.reject_unit_path):
            raise ControllerFailed(f"the path has {left} poses")
        grid = view.frame
        search = p.max_robot_pose_search_dist
        if search is None:
            search = max(view.cost.shape) * view.resolution / 2.0
        elif search < 0.0:
            search = math.inf
        local: FloatArray = np.empty((left, 3))
        path = self._path[self._begin : self._end]
        first, count, x, y, yaw = _segment(path, pose, frame, grid, search, p.prune_distance, local)
        if (p.enforce_path_inversion or p.enforce_path_rotation) and self._end < len(self._path):
            last = self._path[self._end - 1]
            near = math.hypot(x - last[0], y - last[1]) <= p.inversion_xy_tolerance
            if near and abs(turn_between(yaw, last[2])) <= p.inversion_yaw_tolerance:
                self._begin, self._end, first = self._end, self._turning_point(self._end), 0
        self._begin += first
        if count == 0:
            raise ControllerFailed("nothing of the path is on the local costmap")
        return local[:count]

    def _turning_point(self, begin: int) -> int:
        """Where the part of the path from `begin` on ends that is handed on first."""
        p = self._parameters
        if p.enforce_path_inversion or p.enforce_path_rotation:
            return begin + _first_constraint(self._path[begin:], p.enforce_path_inversion, self._least_turn)
        return len(self._path)


def make_path_handler(parameters: Group) -> PathHandler:
    """The path handler whose parameters these are.

    Raises:
        TypeError: they are those of something else.
    """
    if isinstance(parameters, FeasiblePath):
        return FeasiblePathHandler(parameters)
    raise TypeError(f"{type(parameters).__name__} is no group of a path handler")


@kernel
def path_length(path: FloatArray) -> float:
    """Length of a path (n, >= 2), m."""
    length = 0.0
    for i in range(1, path.shape[0]):
        length += math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    return length


@kernel
def _after(path: FloatArray, begin: int, distance: float) -> int:
    """Index of the first pose further along a path from `begin` than `distance`, m; its length if there is none."""
    along = 0.0
    n: int = path.shape[0]
    for i in range(begin, n - 1):
        along += math.hypot(path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1])
        if along > distance:
            return i + 1
    return n


@kernel
def _segment(
    path: FloatArray, pose: FloatArray, frame: FloatArray, grid: Frame, search: float, prune: float, out: FloatArray
) -> tuple[int, int, float, float, float]:
    """Write what of a path (n, 3) is followed now into `out` (n, 3), in the frame of `pose` and `grid`.

    Returns:
        Index of its first pose, number of its poses, and the robot's pose in the path's frame.
    """
    c, s = math.cos(frame[2]), math.sin(frame[2])
    dx, dy = pose[0] - frame[0], pose[1] - frame[1]
    x, y, yaw = c * dx + s * dy, c * dy - s * dx, wrap(pose[2] - frame[2])
    n = path.shape[0]
    nearest, first = np.inf, 0
    for i in range(_after(path, 0, search)):
        distance = math.hypot(path[i, 0] - x, path[i, 1] - y)
        if distance <= nearest:
            nearest, first = distance, i
    if n > 1 and first == n - 1:
        first -= 1
    count = 0
    for i in range(first, _after(path, first, prune)):
        px, py = frame[0] + c * path[i, 0] - s * path[i, 1], frame[1] + s * path[i, 0] + c * path[i, 1]
        if row_col(grid, px, py)[0] < 0:
            break
        out[count, 0], out[count, 1], out[count, 2] = px, py, wrap(path[i, 2] + frame[2])
        count += 1
    return first, count, x, y, yaw


@kernel
def _first_constraint(path: FloatArray, inversion: bool, least_turn: float) -> int:
    """Number of poses (n, 3) up to the first cusp (if `inversion`) or turn in place by more than `least_turn`; n without any."""
    n: int = path.shape[0]
    if n < 3:
        return n
    before_x, before_y = 0.0, 0.0
    turn_at = n
    for i in range(n - 1):
        if turn_at <= i + 1:
            break
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        step = math.hypot(dx, dy)
        if inversion and step > _STILL:
            if i >= 1 and before_x * dx + before_y * dy < 0.0:
                return min(turn_at, i + 1)
            before_x, before_y = dx, dy
        if least_turn >= _NO_ROTATION and step < _STILL and turn_at == n:
            turned = 0.0
            for k in range(i, n - 1):
                turned += abs(turn_between(path[k, 2], path[k + 1, 2]))
                if turned > least_turn:
                    turn_at = k + 1
                    break
                if k + 2 >= n or math.hypot(path[k + 2, 0] - path[k + 1, 0], path[k + 2, 1] - path[k + 1, 1]) > _STILL:
                    break
    return turn_at

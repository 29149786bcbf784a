"""Critics of the path: PathAlignCritic, PathFollowCritic, PathAngleCritic.

Behaviour after nav2_mppi_controller/src/critics/{path_align,path_follow,path_angle}_critic.cpp.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ONE, PI, ZERO, Floats, wrapped
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Booleans, Path, Rollouts, add, end_distance
from clearway.navigators.nav2.controllers.mppi.parameters import (
    MPPIParameters,
    PathAlignParameters,
    PathAngleParameters,
    PathFollowParameters,
)

_FORWARD, _EITHER, _FEASIBLE = 0, 1, 2  # PathAngleMode
_QUARTER = np.float32(math.pi / 2.0)
_CELLS = 2048  # some 50 a point of a path of 2 m: in most of them there is nothing to seek


class PathAlignCritic:
    """Mean distance from the path, each point from the one that lies as far along the path."""

    def __init__(self, parameters: PathAlignParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        p = self._parameters
        if rollouts.length < p.threshold_to_consider:
            return False
        reached = rollouts.furthest
        if reached < max(p.offset_from_furthest, 1) or self._occupied(rollouts.valid[:reached]):
            return False
        term = np.zeros_like(costs)
        path, samples, step = rollouts.path, rollouts.samples, p.trajectory_point_step
        near = Path(path.x[:reached], path.y[:reached], path.yaw[:reached])
        along_path(
            samples.x, samples.y, samples.yaw, step, near, rollouts.valid[:reached], p.use_path_orientations, term
        )
        add(costs, term, p.cost_weight, p.cost_power)
        return False

    def _occupied(self, valid: Booleans) -> bool:
        """Whether obstacles stand on too much of the path, the share counted against the whole at each of its points."""
        blocked = len(valid) - int(np.count_nonzero(valid))
        share = np.float32(blocked) / np.float32(len(valid))
        return blocked > 2 and bool(share > np.float32(self._parameters.max_path_occupancy_ratio))


class PathFollowCritic:
    """Distance from the sample's end to a point of the path that is further on than any sample gets."""

    def __init__(self, parameters: PathFollowParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        p, path = self._parameters, rollouts.path
        last = len(path.x) - 1
        if last < 1 or rollouts.length < p.threshold_to_consider:
            return False
        k = min(rollouts.furthest + p.offset_from_furthest, last)
        while k < last - 1 and not rollouts.valid[k]:
            k += 1
        term = np.zeros_like(costs)
        end_distance(rollouts.samples.x[-1], rollouts.samples.y[-1], path.x[k], path.y[k], term)
        add(costs, term, p.cost_weight, p.cost_power)
        return False


class PathAngleCritic:
    """Angle between the sample's last heading and the direction of a point further on, if the robot looks elsewhere now."""

    def __init__(self, parameters: PathAngleParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters
        reverses = controller.vx_min < 0.0 and abs(controller.vx_min) >= 1e-6
        self._mode = _FORWARD if parameters.mode == _EITHER and not reverses else parameters.mode

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        p, path = self._parameters, rollouts.path
        if rollouts.length < p.threshold_to_consider:
            return False
        k = min(rollouts.furthest + p.offset_from_furthest, len(path.x) - 1)
        if self._angle_now(rollouts, k) < p.max_angle_to_furthest:
            return False
        term, samples = np.zeros_like(costs), rollouts.samples
        end_angle(samples.x[-1], samples.y[-1], samples.yaw[-1], path.x[k], path.y[k], path.yaw[k], self._mode, term)
        add(costs, term, p.cost_weight, p.cost_power)
        return False

    def _angle_now(self, rollouts: Rollouts, k: int) -> float:
        """Between the robot's heading and point `k` of the path, rad (utils.hpp, posePointAngle)."""
        path, (x, y, yaw) = rollouts.path, rollouts.pose.astype(np.float32)
        towards = math.atan2(path.y[k] - y, path.x[k] - x)
        if self._mode == _FEASIBLE and _apart(towards, float(path.yaw[k])) > math.pi / 2.0:
            towards += math.pi
        ahead = _apart(towards, float(yaw))
        return min(ahead, math.pi - ahead) if self._mode == _EITHER else ahead


def _apart(a: float, b: float) -> float:
    return abs(math.remainder(a - b, math.tau))


@kernel
def along_path(
    x: Floats, y: Floats, yaw: Floats, step: int, path: Path, valid: Booleans, with_yaw: bool, term: Floats
) -> None:
    """Add to `term` (B,) the mean distance of every `step`-th point of each sample from its point of the path.

    Its point is the one as far along the path as the sample has come; points that aren't valid don't count.
    """
    path_x, path_y, path_yaw = path.x, path.y, path.yaw
    points, (steps, batch) = path_x.shape[0], x.shape
    along = np.zeros(points, np.float32)
    for i in range(1, points):
        dx, dy = path_x[i] - path_x[i - 1], path_y[i] - path_y[i - 1]
        along[i] = along[i - 1] + np.sqrt(dx * dx + dy * dy)
    places, per_metre = _places(along)
    last = np.float32(_CELLS - 1)
    come, total = np.zeros(batch, np.float32), np.zeros(batch, np.float32)
    counted = np.zeros(batch, np.int32)
    for t in range(step, steps, step):
        x0, y0, x1, y1 = x[t - step], y[t - step], x[t], y[t]
        for b in range(batch):
            dx, dy = x1[b] - x0[b], y1[b] - y0[b]
            come[b] += np.sqrt(dx * dx + dy * dy)
        for b in range(batch):
            distance = come[b]
            cell = distance * per_metre
            k = int(places[np.int64(cell if cell < last else last)])
            if k < 0:
                k = _place(along, distance, -k)
            if valid[k]:
                dx, dy = path_x[k] - x1[b], path_y[k] - y1[b]
                squared = dx * dx + dy * dy
                if with_yaw:
                    turn = wrapped(yaw[t, b] - path_yaw[k])
                    squared += turn * turn
                total[b] += np.sqrt(squared)
                counted[b] += 1
    for b in range(batch):
        if counted[b] > 0:
            term[b] += total[b] / np.float32(counted[b])


@kernel
def _place(along: Floats, distance: np.float32, k: int) -> int:
    """Index of the point of a path that is as far along as `distance`, sought from point `k` on, 1 at least."""
    points = along.shape[0]
    while k < points and along[k] <= distance:
        k += 1
    if k == points or distance - along[k - 1] < along[k] - distance:
        k -= 1
    return k


@kernel
def _places(along: Floats) -> tuple[npt.NDArray[np.int32], np.float32]:
    """(_CELLS,) `_place` for all distances in a cell, and cells per metre.

    Where it changes within a cell or one beside it, which allows for rounding: from where on to seek it, negative.
    """
    places = np.empty(_CELLS, np.int32)
    length = along[along.shape[0] - 1]
    if length <= ZERO:
        places[:] = -1
        return places, ZERO
    edge = length / np.float32(_CELLS)
    behind, ahead = 0, 0
    for cell in range(_CELLS):
        behind = _place(along, np.float32(cell - 1) * edge, max(behind, 1))
        ahead = _place(along, np.float32(cell + 2) * edge, max(ahead, 1))
        places[cell] = behind if behind == ahead else -max(behind, 1)
    return places, ONE / edge


@kernel
def end_angle(
    x: Floats,
    y: Floats,
    yaw: Floats,
    point_x: np.float32,
    point_y: np.float32,
    point_yaw: np.float32,
    mode: int,
    term: Floats,
) -> None:
    """Add to `term` (B,) the angle between headings (B,) at points (B,) and the direction of one point.

    Args:
        mode: 1: or its opposite, if that is nearer; 2: or its opposite, if that is nearer to the point's own yaw.
    """
    for b in range(term.shape[0]):
        towards = np.float32(math.atan2(point_y - y[b], point_x - x[b]))
        reference = point_yaw if mode == _FEASIBLE else yaw[b]
        if mode != _FORWARD and abs(wrapped(towards - reference)) >= _QUARTER:
            towards = towards + PI
        term[b] += abs(wrapped(towards - yaw[b]))

"""What critics are told of one decision, and the one way in which they add their costs."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import ByteGrid
from clearway.navigators.common.mppi.functions import Floats
from clearway.navigators.common.mppi.samples import Samples
from clearway.navigators.nav2.seams import CostView, Tolerances

Booleans = npt.NDArray[np.bool_]

_INSCRIBED, _LETHAL, _UNKNOWN = 253, 254, 255


class Path(NamedTuple):
    """The path that the path handler hands on, as float32.

    Attributes:
        x: (n,) m.
        y: (n,) m.
        yaw: (n,) rad.
    """

    x: Floats
    y: Floats
    yaw: Floats


class Rollouts:
    """One decision: the samples and all that they are judged by. Where they get on the path is looked up once, at the first ask."""

    def __init__(
        self,
        samples: Samples,
        pose: FloatArray,
        path: FloatArray,
        tolerances: Tolerances,
        view: CostView,
        dt: np.float32,
        holonomic: bool,
        radius: np.float32,
    ) -> None:
        """
        Args:
            samples: Filled anew for each iteration.
            pose: (3,) of the robot.
            path: (n, 3), n >= 1.
            tolerances: Of the goal checker.
            view: The local costmap.
            dt: Of a time step, s.
            holonomic: Whether the base moves to its sides.
            radius: Least turning radius of a car, m; 0 without one.
        """
        self.samples, self.pose, self.tolerances, self.view = samples, pose, tolerances, view
        self.dt, self.holonomic, self.radius = dt, holonomic, radius
        self.path = Path(*(np.ascontiguousarray(column, np.float32) for column in path.T))
        steps = np.diff(path[:, :2], axis=0)
        self.length = np.float32(np.hypot(steps[:, 0], steps[:, 1]).sum())
        self.frame = view.frame

    @cached_property
    def furthest(self) -> int:
        """Index of the furthest point of the path that a sample gets to, as the first iteration's samples have it."""
        return furthest_reached(self.samples.x, self.samples.y, self.path)

    @cached_property
    def valid(self) -> Booleans:
        """(n - 1,) whether the robot's centre could stand on each point of the path but the last."""
        return valid_points(self.path, self.view.cost, self.frame, self.view.tracks_unknown)


class Critic(Protocol):
    """Judges all samples of a decision (nav2_mppi_controller/include/nav2_mppi_controller/critic_function.hpp)."""

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """Add each sample's cost to `costs` (B,); whether all of them collide, so that no other critic needs to be asked."""


@kernel
def add(costs: Floats, term: Floats, weight: float, power: int) -> None:
    """Add (weight * term)^power to the costs; a power of 0 counts as 1, as in the source."""
    w = np.float32(weight)
    for b in range(costs.shape[0]):
        one = term[b] * w
        total = one
        for _ in range(1, power):
            total *= one
        costs[b] += total


@kernel
def furthest_reached(x: Floats, y: Floats, path: Path) -> int:
    """Index of the furthest point of the path among those nearest to the samples' ends (findPathFurthestReachedPoint).

    A sample's nearest point is sought no further along the path than the sample is long.
    """
    path_x, path_y, points = path.x, path.y, path.x.shape[0]
    along = np.zeros(points, np.float32)
    for i in range(1, points):
        dx, dy = path_x[i] - path_x[i - 1], path_y[i] - path_y[i - 1]
        along[i] = along[i - 1] + np.sqrt(dx * dx + dy * dy)
    steps, batch = x.shape
    length = np.zeros(batch, np.float32)
    for t in range(1, steps):
        x0, y0, x1, y1 = x[t - 1], y[t - 1], x[t], y[t]
        for b in range(batch):
            dx, dy = x1[b] - x0[b], y1[b] - y0[b]
            length[b] += np.sqrt(dx * dx + dy * dy)
    end_x, end_y = x[steps - 1], y[steps - 1]
    furthest = 0
    for b in range(batch):
        within = min(np.searchsorted(along, length[b]), points - 1)
        if within <= furthest:
            continue  # it can't get any further
        nearest, least = 0, np.float32(np.inf)
        for i in range(within + 1):
            dx, dy = path_x[i] - end_x[b], path_y[i] - end_y[b]
            apart = dx * dx + dy * dy
            if apart < least:
                nearest, least = i, apart
        furthest = max(furthest, nearest)
        if furthest == points - 1:
            break
    return furthest


@kernel
def valid_points(path: Path, cost: ByteGrid, frame: Frame, tracks_unknown: bool) -> Booleans:
    """(n - 1,) whether each point but the last lies in the costmap, off what is lethal, inscribed or not known (findPathCosts)."""
    points = path.x.shape[0] - 1
    valid = np.zeros(points, np.bool_)
    for i in range(points):
        row, col = row_col(frame, float(path.x[i]), float(path.y[i]))
        if row >= 0:
            here = int(cost[row, col])
            valid[i] = tracks_unknown if here == _UNKNOWN else here not in (_INSCRIBED, _LETHAL)
    return valid


@kernel
def end_distance(x: Floats, y: Floats, point_x: np.float32, point_y: np.float32, term: Floats) -> None:
    """Add to `term` (B,) the distance of points (B,) from one point, m."""
    for b in range(term.shape[0]):
        dx, dy = x[b] - point_x, y[b] - point_y
        term[b] += np.sqrt(dx * dx + dy * dy)

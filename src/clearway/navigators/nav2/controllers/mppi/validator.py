"""Whether the trajectory that comes out is clear of obstacles, before its first command is sent.

Behaviour after nav2_mppi_controller/include/nav2_mppi_controller/optimal_trajectory_validator.hpp.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import ByteGrid
from clearway.navigators.common.mppi.functions import Floats
from clearway.navigators.nav2.controllers.mppi.parameters import ValidatorParameters
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.seams import CostView

_INSCRIBED, _LETHAL = 253, 254


class TrajectoryValidator:
    """`mppi::DefaultOptimalTrajectoryValidator`."""

    def __init__(self, parameters: ValidatorParameters, dt: np.float32, time_steps: int) -> None:
        """
        Args:
            parameters: Its own.
            dt: Of a time step, s.
            time_steps: Of a trajectory.
        """
        self._outlined = parameters.consider_footprint
        self._points = min(int(np.float32(parameters.collision_lookahead_time) / dt), time_steps)

    def clear(self, trajectory: Floats, view: CostView, frame: Frame) -> bool:
        """Whether nothing that is known stands on the first part of a trajectory (T, 3)."""
        return bool(_clear(trajectory[: self._points], view.cost, frame, view.footprint, self._outlined))


@kernel
def _clear(trajectory: Floats, cost: ByteGrid, frame: Frame, polygon: FloatArray, outlined: bool) -> bool:
    for i in range(trajectory.shape[0]):
        x, y = float(trajectory[i, 0]), float(trajectory[i, 1])
        if outlined:
            if cost_at_pose(cost, frame, polygon, x, y, float(trajectory[i, 2])) == _LETHAL:
                return False
        else:
            row, col = row_col(frame, x, y)
            if row >= 0 and (cost[row, col] == _INSCRIBED or cost[row, col] == _LETHAL):
                return False
    return True

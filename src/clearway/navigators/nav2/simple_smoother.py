"""Nav2's simple smoother: each point is drawn between its neighbours and to where it was, as long as its cell is free.

Behaviour read from ros-navigation/navigation2: nav2_smoother/src/simple_smoother.cpp, nav2_util/include/nav2_util/smoother_utils.hpp.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import FREE, INSCRIBED, UNKNOWN, ByteGrid
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.planners.smoother import orient, turns_at
from clearway.navigators.nav2.seams import CostView
from clearway.quantities import NonNegative, Whole

_SHORTEST = 3
"""Steps that a piece must have more of to be smoothed."""


class SimpleSmoother(Group):
    """`nav2_smoother::SimpleSmoother` (nav2_smoother/src/simple_smoother.cpp)."""

    tolerance: NonNegative = Field(default=1e-10, description="it ends when all points together move less, m")
    max_its: Whole = Field(default=1000, ge=1, description="rounds at which it ends all the same")
    w_data: NonNegative = Field(default=0.2, description="how much a point is drawn to where it was")
    w_smooth: NonNegative = Field(default=0.3, description="how much it is drawn to between its neighbours")
    do_refinement: bool = Field(default=True, description="whether what is smooth is smoothed again")
    refinement_num: Whole = Field(default=2, ge=0, description="how often")
    enforce_path_inversion: bool = Field(
        default=True, description="whether a point at which the path turns back or turns in place stays where it is"
    )

    @model_validator(mode="after")
    def _comes_to_rest(self) -> SimpleSmoother:
        if self.w_data + 4.0 * self.w_smooth > 2.0:
            raise ValueError(
                f"w_data {self.w_data:g} + 4 * w_smooth {self.w_smooth:g} is more than 2: points would swing ever farther"
            )
        return self


class Weights(NamedTuple):
    """What the kernel is given of the parameters.

    Attributes:
        tolerance: It ends when all points together move less, m.
        rounds: At which it ends all the same.
        data: How much a point is drawn to where it was.
        smooth: How much it is drawn to between its neighbours.
        times: How often it is smoothed.
        keeps_turns: Whether points stay where the path turns back or in place.
    """

    tolerance: float
    rounds: int
    data: float
    smooth: float
    times: int
    keeps_turns: bool


def smoothed(path: FloatArray, view: CostView, parameters: SimpleSmoother) -> FloatArray:
    """A path (n, 3) smoothed, given as the costmap is."""
    p = parameters
    times = 1 + (p.refinement_num if p.do_refinement else 0)
    weights = Weights(p.tolerance, p.max_its, p.w_data, p.w_smooth, times, p.enforce_path_inversion)
    frame = view.frame
    new = np.array(path, dtype=np.float64)
    _smooth(new, view.cost, frame, weights)
    return new


@kernel
def _smooth(path: FloatArray, cost: ByteGrid, frame: Frame, weights: Weights) -> None:
    """Smooth a path in place, piece by piece where its turns are kept."""
    first = 0
    if weights.keeps_turns:
        for i in range(1, len(path) - 1):
            turns_back, turns_in_place = turns_at(path, i)
            if turns_back:
                _smooth_piece(path[first : i + 1], cost, frame, weights)
                first = i
            if turns_in_place:
                _smooth_piece(path[first : i + 1], cost, frame, weights)
                first = i
    _smooth_piece(path[first:], cost, frame, weights)


@kernel
def _smooth_piece(path: FloatArray, cost: ByteGrid, frame: Frame, weights: Weights) -> None:
    if len(path) - 1 <= _SHORTEST:
        return
    going_on = True
    for _ in range(weights.times):
        if going_on:
            going_on = _relax(path, cost, frame, weights)
    orient(path, False)


@kernel
def _relax(path: FloatArray, cost: ByteGrid, frame: Frame, weights: Weights) -> bool:
    """Smooth a piece in place; whether it came to rest before it hit something."""
    new, last = path.copy(), path.copy()
    change = weights.tolerance
    rounds, here = 0, FREE
    while change >= weights.tolerance:
        rounds += 1
        change = 0.0
        if rounds >= weights.rounds:
            path[:] = last
            return False
        for i in range(1, len(path) - 1):
            for j in range(2):
                before = new[i, j]
                new[i, j] += weights.data * (path[i, j] - before) + weights.smooth * (
                    new[i + 1, j] + new[i - 1, j] - 2.0 * before
                )
                change += abs(new[i, j] - before)
            row, column = row_col(frame, new[i, 0], new[i, 1])
            if row >= 0:  # off the map the cell of the point before counts, as in the source
                here = int(cost[row, column])
            if here >= INSCRIBED and here != UNKNOWN:
                path[:] = last
                return False
        last[:] = new
    path[:] = new
    return True

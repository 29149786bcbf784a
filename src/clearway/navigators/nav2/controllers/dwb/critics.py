"""What DWB's critics make of a trajectory.

Behaviour after nav2_dwb_controller/dwb_critics/src and costmap_queue. The grids of its critics that count cells know no
obstacles: a cell's value is its distance along rows and columns from the nearest cell of the path, or from the goal's. So
it is here made by two sweeps over the grid, or reckoned where it is asked for.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import INSCRIBED, NO_INFORMATION, Scene, footprint_cost, row_col
from clearway.navigators.common.oscillation import Signs, forbids

ROTATE_TO_GOAL, OSCILLATION, BASE_OBSTACLE, OBSTACLE_FOOTPRINT, TWIRLING, PREFER_FORWARD = range(6)
PATH_DIST, PATH_ALIGN, GOAL_DIST, GOAL_ALIGN = range(6, 10)
"""Kinds of critics; those from PATH_DIST on count cells."""

LAST, SUM, PRODUCT = range(3)
"""How those count the points of a trajectory."""

FAR_FROM_GOAL, SLOWING, ROTATING = range(3)
"""What RotateToGoal is at."""

ILLEGAL = -1.0

IntArray = npt.NDArray[np.int64]


class Critics(NamedTuple):
    """The critics of a file, in its order.

    Attributes:
        kind: (n,) of each.
        scale: (n,) its weight.
        values: (n, 6) what it goes by: RotateToGoal: what it is at, squared measured speed, slowing_factor, lookahead_time, the
            goal's heading; Oscillation: a `Signs`; obstacles: sum_scores; PreferForward: penalty, strafe_x, strafe_theta,
            theta_scale; those that count cells: how, forward_point_distance, column and row of the goal (-1: none), which
            `prepare` finds.
    """

    kind: IntArray
    scale: FloatArray
    values: FloatArray


class Ground(NamedTuple):
    """Where trajectories are judged.

    Attributes:
        scene: Costmap and footprint.
        weights: (n,) of the critics, for this costmap's resolution; 0: is not asked.
        cells: (rows, columns) int32 distance from the path, in cells; more than there are cells: none of it is on the map.
    """

    scene: Scene
    weights: FloatArray
    cells: npt.NDArray[np.int32]


@kernel
def prepare(critics: Critics, scene: Scene, pose: FloatArray, goal: FloatArray, path: FloatArray) -> Ground:
    """Weights, goals' cells and distances from the path for one control period."""
    frame = scene.frame
    weights = critics.scale.copy()
    follows = False
    for i in range(critics.kind.size):
        kind = critics.kind[i]
        if kind >= PATH_DIST:
            weights[i] *= frame.resolution * 0.5
        elif kind == OBSTACLE_FOOTPRINT:
            weights[i] *= frame.resolution
        nose = critics.values[i, 1]
        if kind == PATH_ALIGN and (pose[0] - goal[0]) ** 2 + (pose[1] - goal[1]) ** 2 <= nose * nose:
            weights[i] = 0.0  # near the goal the nose is free
        follows = follows or (weights[i] != 0.0 and kind in (PATH_DIST, PATH_ALIGN))
        if kind in (GOAL_DIST, GOAL_ALIGN):
            last = path.shape[0] - 1
            x, y = path[last, 0], path[last, 1]
            if kind == GOAL_ALIGN:
                towards = math.atan2(goal[1] - pose[1], goal[0] - pose[0])
                x, y = x + nose * math.cos(towards), y + nose * math.sin(towards)
            row, col = _lay(scene, path, x, y, np.empty((0, 0), np.int32))
            critics.values[i, 2], critics.values[i, 3] = col, row
    cells = np.empty((frame.rows, frame.cols), np.int32)
    if follows:
        _distances(scene, path, cells)
    return Ground(scene, weights, cells)


@kernel
def _lay(scene: Scene, path: FloatArray, end_x: float, end_y: float, cells: npt.NDArray[np.int32]) -> tuple[int, int]:
    """Walk along a path (n, >= 2) that ends at another place than its last, from where it enters the known map to where it leaves it.

    Holes wider than two cells are filled (nav_2d_utils's adjustPlanResolution). Each cell is set to 0, unless there are none.

    Returns:
        Row and column of the last cell, -1 if the path is nowhere on the map.
    """
    frame = scene.frame
    last = path.shape[0] - 1
    at_row, at_col = -1, -1
    from_x, from_y = 0.0, 0.0
    for i in range(last + 1):
        to_x, to_y = (end_x, end_y) if i == last else (path[i, 0], path[i, 1])
        pieces = 1
        if i > 0:
            squared = (to_x - from_x) ** 2 + (to_y - from_y) ** 2
            if squared > 4.0 * frame.resolution * frame.resolution:
                pieces = max(1, int((math.sqrt(squared) - 2.0 * frame.resolution) / frame.resolution) - 1)
        for j in range(1, pieces + 1):
            x, y = to_x, to_y
            if j < pieces:
                x, y = from_x + j * ((to_x - from_x) / pieces), from_y + j * ((to_y - from_y) / pieces)
            row, col = row_col(frame, x, y)
            if row >= 0 and scene.cost[row, col] != NO_INFORMATION:
                at_row, at_col = row, col
                if cells.size > 0:
                    cells[row, col] = 0
            elif at_row >= 0:
                return at_row, at_col
        from_x, from_y = to_x, to_y
    return at_row, at_col


@kernel
def _distances(scene: Scene, path: FloatArray, cells: npt.NDArray[np.int32]) -> None:
    """Fill `cells` with the number of steps along rows and columns to the nearest cell of the path."""
    rows, cols = cells.shape
    for r in range(rows):
        for c in range(cols):
            cells[r, c] = rows * cols + 1
    last = path.shape[0] - 1
    if _lay(scene, path, path[last, 0], path[last, 1], cells)[0] < 0:
        return
    for r in range(rows):
        for c in range(cols):
            if r > 0:
                cells[r, c] = min(cells[r, c], cells[r - 1, c] + 1)
            if c > 0:
                cells[r, c] = min(cells[r, c], cells[r, c - 1] + 1)
    for r in range(rows - 1, -1, -1):
        for c in range(cols - 1, -1, -1):
            if r < rows - 1:
                cells[r, c] = min(cells[r, c], cells[r + 1, c] + 1)
            if c < cols - 1:
                cells[r, c] = min(cells[r, c], cells[r, c + 1] + 1)


@kernel
def of_command(critics: Critics, i: int, v: float, u: float, w: float, heading: float) -> float:
    """What a critic that looks at nothing else makes of a command, and of a heading after it; ILLEGAL if it refuses it."""
    values, kind = critics.values, critics.kind[i]
    score = abs(w)
    if kind == ROTATE_TO_GOAL:
        squared = v * v + u * u
        off = abs(wrap(values[i, 4] - heading))
        if values[i, 0] == FAR_FROM_GOAL:
            score = 0.0
        elif values[i, 0] == SLOWING:
            score = ILLEGAL if squared >= values[i, 1] else squared * values[i, 2] + off
        else:
            score = ILLEGAL if v != 0.0 or u != 0.0 else off
    elif kind == OSCILLATION:
        signs = Signs(
            values[i, 0] > 0.0,
            values[i, 1] > 0.0,
            values[i, 2] > 0.0,
            values[i, 3] > 0.0,
            values[i, 4] > 0.0,
            values[i, 5] > 0.0,
        )
        score = ILLEGAL if forbids(signs, v, w, u) else 0.0
    elif kind == PREFER_FORWARD:
        aside = v < 0.0 or (v < values[i, 1] and abs(w) < values[i, 2])
        score = values[i, 0] if aside else abs(w) * values[i, 3]
    return score


@kernel
def heading_at(time: float, headings: FloatArray, steps: int, sim_time: float) -> float:
    """The yaw after `time` [s] on a trajectory; at its end where that is negative or beyond it."""
    at = float(steps) if time < 0.0 or time >= sim_time else time / sim_time * steps
    i = min(int(at), steps - 1)
    yaw: float = headings[i, 0] + (at - i) * (headings[i + 1, 0] - headings[i, 0])
    return yaw


@kernel
def add_least(critics: Critics, ground: Ground, commands: FloatArray, ends: FloatArray, bound: FloatArray) -> None:
    """Add to `bound` (n,) what the critics make of commands (n, 3) and of the trajectories' ends; inf where one refuses it.

    What looks at more than the end adds nothing yet.

    Args:
        ends: (n, 5) x, y, yaw, its cosine, its sine.
    """
    values, cells, cost = critics.values, ground.cells, ground.scene.cost
    frame = ground.scene.frame
    everywhere = float(frame.rows * frame.cols)
    for i in range(critics.kind.size):
        kind, weight = critics.kind[i], ground.weights[i]
        if weight == 0.0 or (kind == ROTATE_TO_GOAL and values[i, 0] == FAR_FROM_GOAL):
            continue
        if kind == OSCILLATION and not values[i].any():
            continue
        nose, how = values[i, 1], values[i, 0]
        strict, by_path = kind in (PATH_DIST, GOAL_DIST), kind in (PATH_DIST, PATH_ALIGN)
        for k in range(bound.size):
            if bound[k] == np.inf:
                continue
            v, u, w = commands[k, 0], commands[k, 1], commands[k, 2]
            if kind in (BASE_OBSTACLE, OBSTACLE_FOOTPRINT):
                row, col = row_col(frame, ends[k, 0], ends[k, 1])
                if row < 0:
                    bound[k] = np.inf
                elif kind == BASE_OBSTACLE:
                    bound[k] = np.inf if cost[row, col] >= INSCRIBED else bound[k] + weight * cost[row, col]
            elif kind < PATH_DIST:
                score = of_command(critics, i, v, u, w, values[i, 4] if values[i, 3] >= 0.0 else ends[k, 2])
                bound[k] = np.inf if score < 0.0 else bound[k] + weight * score
            else:
                row, col = row_col(frame, ends[k, 0] + nose * ends[k, 3], ends[k, 1] + nose * ends[k, 4])
                if row < 0:
                    bound[k] = np.inf
                    continue
                if by_path:
                    away = float(cells[row, col])
                elif values[i, 2] < 0.0:
                    away = everywhere + 1.0
                else:
                    away = abs(col - values[i, 2]) + abs(row - values[i, 3])
                if strict and away >= everywhere:
                    bound[k] = np.inf
                elif how == LAST:
                    bound[k] += weight * away


@kernel
def of_places(
    critics: Critics, i: int, ground: Ground, places: FloatArray, headings: FloatArray, steps: int, twice: bool
) -> float:
    """What a critic makes of a whole trajectory that looks at its points; ILLEGAL if it refuses it."""
    values, cells = critics.values, ground.cells
    cost, frame, polygon = ground.scene.cost, ground.scene.frame, ground.scene.polygon
    kind, how, nose = critics.kind[i], values[i, 0], values[i, 1]
    counts, strict, by_path = kind >= PATH_DIST, kind in (PATH_DIST, GOAL_DIST), kind in (PATH_DIST, PATH_ALIGN)
    everywhere = float(frame.rows * frame.cols)
    score = 1.0 if counts and how == PRODUCT else 0.0
    for k in range(steps if counts and not strict and how == LAST else 0, steps + (2 if twice else 1)):
        j = min(k, steps)
        x, y, c, s = places[j, 0], places[j, 1], headings[j, 1], headings[j, 2]
        if kind == OBSTACLE_FOOTPRINT:
            here = float(footprint_cost(cost, frame, polygon, x, y, c, s, 1.0))
            if here < 0.0:
                return ILLEGAL
        else:
            row, col = row_col(frame, x + nose * c, y + nose * s)
            if row < 0:
                return ILLEGAL
            if kind == BASE_OBSTACLE:
                here = float(cost[row, col])
                if here >= INSCRIBED:
                    return ILLEGAL
            elif by_path:
                here = float(cells[row, col])
            elif values[i, 2] < 0.0:
                here = everywhere + 1.0
            else:
                here = abs(col - values[i, 2]) + abs(row - values[i, 3])
            if strict and here >= everywhere:
                return ILLEGAL
        if counts and how == PRODUCT:
            if score > 0.0:
                score *= here
        elif how == SUM:
            score += here
        else:
            score = here
    return score

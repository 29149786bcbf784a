"""Nav2's planner server: plans when it is asked, and says whether a path is still free.

In Nav2 it has a thread of its own. Here it plans at the end of a control period, so that whoever asked has the path one
period later. Behaviour read from ros-navigation/navigation2: nav2_planner/src/planner_server.cpp,
include/nav2_planner/is_path_valid_service.hpp.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.frames import inverse, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Scene, footprint_cost, make_scene, row_col
from clearway.navigators.common.costmaps.layers import FREE, INSCRIBED, LETHAL, UNKNOWN
from clearway.navigators.nav2.behavior_tree.actions import PlanRequest, ThroughPath, ThroughRequest
from clearway.navigators.nav2.behavior_tree.paths import EMPTY, first_after, moved
from clearway.navigators.nav2.behavior_tree.servers import Error, Job, Validity
from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.parameters import servers as parameters
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.plugins import chosen, make_planner
from clearway.navigators.nav2.seams import CostView, GoalOccupied, NoPath, Planner, StartOccupied


class _Failed(Exception):
    """No path, for a reason that has a code."""

    def __init__(self, error: Error, why: str) -> None:
        super().__init__(why)
        self.error = error


_THROUGH = {
    Error.INVALID_PLANNER: Error.THROUGH_INVALID_PLANNER,
    Error.START_OUTSIDE_MAP: Error.THROUGH_START_OUTSIDE_MAP,
    Error.GOAL_OUTSIDE_MAP: Error.THROUGH_GOAL_OUTSIDE_MAP,
    Error.START_OCCUPIED: Error.THROUGH_START_OCCUPIED,
    Error.GOAL_OCCUPIED: Error.THROUGH_GOAL_OCCUPIED,
    Error.NO_VALID_PATH: Error.THROUGH_NO_VALID_PATH,
}
"""Codes of a path to one goal, and those of a path through several."""


class PlannerServer:
    """Plans paths on the global costmap.

    Args:
        branch: Its parameters, with those of its planners.
        costmap: The global one.
    """

    def __init__(self, branch: Branch, costmap: Costmap) -> None:
        self._partly = cast("parameters.PlannerServer", branch.group).allow_partial_planning
        self._planners: dict[str, Planner] = {name: make_planner(child) for name, child in branch.children.items()}
        for planner in self._planners.values():
            planner.reset()
        self._costmap = costmap
        self._jobs: dict[str, Job] = {}

    def send(self, action: str, request: PlanRequest | ThroughRequest) -> Job:
        """Have a path planned; each of the two actions has its own."""
        job = self._jobs[action] = Job(request)
        return job

    def cancel(self, action: str) -> None:
        """Don't."""
        self._jobs.pop(action, None)

    def think(self, pose: FloatArray, frame: FloatArray) -> None:
        """Plan, if something is to be planned and the costmap is current.

        Args:
            pose: (3,) of the robot in the costmap's frame.
            frame: (3,) pose of the costmap's frame in the map.
        """
        if not self._costmap.current:
            return
        jobs, self._jobs = self._jobs, {}
        for job in jobs.values():
            request: PlanRequest | ThroughRequest = job.request
            start = pose if request.start is None else relative(frame, request.start)
            try:
                if isinstance(request, PlanRequest):
                    job.succeed(moved(self._plan(request.planner, start, relative(frame, request.goal)), frame))
                else:
                    found = self._through(request, start, frame)
                    job.succeed(found._replace(path=moved(found.path, frame)))
            except _Failed as failure:
                job.abort(failure.error, str(failure))

    def _plan(self, name: str, start: FloatArray, goal: FloatArray) -> FloatArray:
        """A path from one pose to another, all in the costmap's frame.

        Raises:
            _Failed: there is none.
        """
        planner = chosen(name, self._planners)
        if planner is None:
            raise _Failed(Error.INVALID_PLANNER, f"there is no planner {name!r}")
        view = self._costmap.view()
        for place, error in ((start, Error.START_OUTSIDE_MAP), (goal, Error.GOAL_OUTSIDE_MAP)):
            if self._off(place, view):
                raise _Failed(error, f"({place[0]:.2f}, {place[1]:.2f}) is off the global costmap")
        try:
            path = planner.plan(start, goal, view)
        except NoPath as failure:
            codes = {StartOccupied: Error.START_OCCUPIED, GoalOccupied: Error.GOAL_OCCUPIED}
            raise _Failed(codes.get(type(failure), Error.NO_VALID_PATH), str(failure)) from failure
        if not len(path):
            raise _Failed(Error.NO_VALID_PATH, "the planner found an empty path")
        return path

    def _through(self, request: ThroughRequest, start: FloatArray, frame: FloatArray) -> ThroughPath:
        """A path through several goals (computePlanThroughPoses), each part from where the one before ends.

        Raises:
            _Failed: there is none; with `allow_partial_planning`, not even to the first.
        """
        if not len(request.goals):
            raise _Failed(Error.NO_VIAPOINTS_GIVEN, "no goals are given")
        path, reached = EMPTY, -1
        for i, goal in enumerate(request.goals):
            try:
                part = self._plan(request.planner, path[-1] if i else start, relative(frame, goal))
            except _Failed as failure:
                if i == 0 or not self._partly:
                    raise _Failed(_THROUGH[failure.error], str(failure)) from failure
                break
            path = np.concatenate((path, part[1:])) if i else part
            reached = i if i < len(request.goals) - 1 else -1
        return ThroughPath(path, reached)

    @staticmethod
    def _off(place: FloatArray, view: CostView) -> bool:
        rows, columns = view.cost.shape
        x, y = (place[:2] - view.origin) / view.resolution
        return not (0 <= x < columns and 0 <= y < rows)

    def invalid_poses(self, request: Validity, pose: FloatArray, frame: FloatArray) -> list[int] | None:
        """Indices of a path's poses that are not free, from the one nearest to the robot on; None if it can't tell now.

        Args:
            request: What is asked.
            pose: (3,) of the robot in the costmap's frame.
            frame: (3,) pose of the costmap's frame in the map.
        """
        costmap = self._costmap
        grid = costmap.cost if not request.layer else costmap.layer_grid(request.layer)
        if not costmap.current or grid is None:
            return None
        path = moved(request.path, inverse(frame))
        begin = int(np.argmin((path[:, 0] - pose[0]) ** 2 + (path[:, 1] - pose[1]) ** 2))
        end = first_after(path, begin, request.lookahead) if request.lookahead > 0.0 else len(path)
        outline = np.array(request.outline) if request.outline else costmap.footprint
        scene = make_scene(grid, costmap.origin, costmap.resolution, outline)
        bad = _invalid(
            scene,
            path,
            begin,
            end,
            costmap.round and not request.outline,
            request.max_cost,
            request.unknown_is_obstacle,
            request.first_only,
        )
        return [int(i) for i in bad]


@kernel
def _invalid(
    scene: Scene,
    path: FloatArray,
    begin: int,
    end: int,
    round: bool,
    max_cost: int,
    unknown_is_obstacle: bool,
    first_only: bool,
) -> FloatArray:
    """Indices of the poses in [begin, end) of a path (n, 3) that are not free: of a round robot by the cost at its centre."""
    found = np.empty(max(end - begin, 0))
    count = 0
    for i in range(begin, end):
        x, y, yaw = path[i, 0], path[i, 1], path[i, 2]
        if round:
            row, col = row_col(scene.frame, x, y)
            cost = np.int64(LETHAL) if row < 0 else np.int64(scene.cost[row, col])
        else:
            cost = np.int64(
                footprint_cost(scene.cost, scene.frame, scene.polygon, x, y, math.cos(yaw), math.sin(yaw), 1.0)
            )
            if cost < 0:
                cost = np.int64(UNKNOWN) if cost == -2 else np.int64(LETHAL)
        if cost == UNKNOWN:
            cost = np.int64(LETHAL) if unknown_is_obstacle else np.int64(FREE)
        if cost >= max_cost or cost == LETHAL or (round and cost == INSCRIBED):
            found[count] = i
            count += 1
            if first_only:
                break
    return found[:count]

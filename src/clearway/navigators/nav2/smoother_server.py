"""Nav2's smoother server: smooths a path on the global costmap when it is asked.

It answers one control period later, as the planner server does. Behaviour read from ros-navigation/navigation2,
nav2_smoother/src/nav2_smoother.cpp.
"""

from __future__ import annotations

from typing import cast

from clearway.geometry.compiled import kernel
from clearway.geometry.frames import inverse
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import LETHAL, Scene, make_scene, row_col
from clearway.navigators.nav2.behavior_tree.paths import moved
from clearway.navigators.nav2.behavior_tree.routes import SmoothRequest
from clearway.navigators.nav2.behavior_tree.servers import Error, Job
from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.plugins import chosen
from clearway.navigators.nav2.simple_smoother import SimpleSmoother, smoothed


class SmootherServer:
    """Smooths paths.

    Args:
        branch: Its parameters, with those of its smoothers.
        costmap: The global one.
    """

    def __init__(self, branch: Branch, costmap: Costmap) -> None:
        self._smoothers = {name: cast("SimpleSmoother", child.group) for name, child in branch.children.items()}
        self._costmap = costmap
        self._job: Job | None = None

    def send(self, request: SmoothRequest) -> Job:
        """Have a path smoothed."""
        self._job = Job(request)
        return self._job

    def cancel(self) -> None:
        """Don't."""
        self._job = None

    def think(self, frame: FloatArray) -> None:
        """Smooth, if something is to be smoothed and the costmap is current.

        Args:
            frame: (3,) pose of the costmap's frame in the map.
        """
        job = self._job
        if job is None or not self._costmap.current:
            return
        self._job = None
        request: SmoothRequest = job.request
        smoother = chosen(request.smoother, self._smoothers)
        if smoother is None:
            known = ", ".join(map(repr, self._smoothers)) or "none"
            job.abort(Error.GOAL_REJECTED, f"there is no smoother {request.smoother!r}; smoother_server has {known}")
            return
        if not len(request.path):
            job.abort(Error.GOAL_REJECTED, "there is no path to smooth")
            return
        view = self._costmap.view()
        path = smoothed(moved(request.path, inverse(frame)), view, smoother)
        if request.checked:
            hit = _first_hit(make_scene(view.cost, view.origin, view.resolution, view.footprint), path)
            if hit >= 0:
                x, y = path[hit, :2]
                job.abort(Error.SMOOTHED_PATH_IN_COLLISION, f"the smoothed path collides at ({x:.2f}, {y:.2f})")
                return
        job.succeed(moved(path, frame))


@kernel
def _first_hit(scene: Scene, path: FloatArray) -> int:
    """Index of the first pose of a path (n, 3) at which the outline is on an obstacle, on unknown ground or off the map; -1: none."""
    for i in range(len(path)):
        x, y = path[i, 0], path[i, 1]
        if row_col(scene.frame, x, y)[0] < 0:
            return i
        if cost_at_pose(scene.cost, scene.frame, scene.polygon, x, y, path[i, 2]) >= LETHAL:
            return i
    return -1

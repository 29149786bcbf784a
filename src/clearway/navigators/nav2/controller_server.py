"""Nav2's controller server: follows a path by its plug-ins, and says when it can't.

Behaviour read from ros-navigation/navigation2, nav2_controller/src/controller_server.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeVar, cast

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.frames import compose, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.rates import EARLY, Rate
from clearway.navigators.nav2.behavior_tree.actions import FollowRequest
from clearway.navigators.nav2.behavior_tree.servers import Error, Job, Tracking
from clearway.navigators.nav2.behaviors import STILL
from clearway.navigators.nav2.goal_checkers import make_goal_checker
from clearway.navigators.nav2.parameters import servers as parameters
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.path_handler import make_path_handler, path_length
from clearway.navigators.nav2.plugins import chosen, make_controller, top_speed
from clearway.navigators.nav2.progress_checkers import make_progress_checker
from clearway.navigators.nav2.seams import (
    Controller,
    ControllerFailed,
    CostView,
    GoalChecker,
    NoValidControl,
    PathHandler,
    ProgressChecker,
    Stopping,
    Velocity,
)

_NOWHERE: FloatArray = np.empty((0, 2))
_Plugin = TypeVar("_Plugin")


class _Aborted(Exception):
    """Following ends with an error."""

    def __init__(self, error: Error, message: str) -> None:
        super().__init__(message)
        self.error = error


class ControllerServer:
    """Follows paths.

    Args:
        branch: Its parameters, with those of its plug-ins.
        rng: Its controllers may draw from.
        speed_limit: m/s; a controller that may go faster is told so.
    """

    def __init__(self, branch: Branch, rng: np.random.Generator, speed_limit: float) -> None:
        p = self._parameters = cast("parameters.ControllerServer", branch.group)
        self._controllers: dict[str, Controller] = {}
        for name in p.controller_plugins:
            controller = make_controller(branch.children[name], p.controller_frequency, rng)
            controller.reset()
            if speed_limit < top_speed(branch.children[name]):
                controller.set_speed_limit(speed_limit, False)
            self._controllers[name] = controller

        def groups(names: Iterable[str]) -> dict[str, Branch]:
            return {name: branch.children[name] for name in names}

        self._goal_checkers: dict[str, GoalChecker] = {
            name: make_goal_checker(b.group) for name, b in groups(p.goal_checker_plugins).items()
        }
        self._progress_checkers: dict[str, ProgressChecker] = {
            name: make_progress_checker(b.group) for name, b in groups(p.progress_checker_plugins).items()
        }
        self._path_handlers: dict[str, PathHandler] = {
            name: make_path_handler(b.group) for name, b in groups(p.path_handler_plugins).items()
        }
        self._rate = Rate(p.controller_frequency)
        self._job: Job | None = None
        self._pending: FollowRequest | None = None
        self._stopping = False
        self._last_valid = 0.0
        self._path: FloatArray = np.empty((0, 3))
        self._begin = 0  # index of the path's segment that was nearest the last time
        self._progress_name = ""

    def send(self, request: FollowRequest, now: float) -> Job:
        """Follow a path from `now` [s] on; one that is followed already is replaced at the next cycle."""
        if self._job is not None and self._job.running and not self._stopping:
            self._pending = request
            self._job.request = request
            return self._job
        if self._stopping:
            self._left()
        self._job, self._pending, self._stopping = Job(request), None, False
        try:
            self._choose(request)
            if self._progress is not None:
                self._progress.reset()
        except _Aborted as failure:
            self._job.abort(failure.error, str(failure))
            return self._job
        self._last_valid = now
        self._rate.restart()
        return self._job

    def cancel(self) -> None:
        """Stop following: the controller brings the robot to rest, or the server does at the next cycle."""
        self._stopping = self._job is not None and self._job.running

    @property
    def running(self) -> bool:
        """Whether a path is followed."""
        return self._job is not None and self._job.running

    @property
    def trajectory(self) -> FloatArray:
        """(k, 2) where the controller's last command leads, in the local costmap's frame."""
        return self._controller.trajectory if self.running else _NOWHERE

    def step(
        self,
        now: float,
        pose: FloatArray,
        velocity: Velocity,
        frame: FloatArray,
        view: CostView,
        *,
        current: bool,
    ) -> Velocity | None:
        """The command of this control period, None: none is given now.

        Args:
            now: s.
            pose: (3,) of the robot in the local costmap's frame.
            velocity: As measured.
            frame: (3,) pose of the path's frame in the local costmap's.
            view: The local costmap.
            current: Whether it is; else it is waited for.
        """
        job = self._job
        if job is None or not job.running or not self._rate.due(now):
            return None
        if self._stopping and self._rests():
            job.succeed()
            self._left()
            return STILL
        if not current:
            return None
        try:
            if self._pending is not None:
                request, self._pending = self._pending, None
                self._choose(request)
            command = self._cycle(now, pose, self._thresholded(velocity), frame, view)
        except _Aborted as failure:
            job.abort(failure.error, str(failure))
            self._left()
            return STILL
        if command is None:
            job.succeed()
            self._left()
            return STILL if self._parameters.publish_zero_velocity else None
        job.feedback = self._tracking(pose, frame)
        return command

    def _rests(self) -> bool:
        return not isinstance(self._controller, Stopping) or self._controller.cancel()

    def _left(self) -> None:
        for controller in self._controllers.values():
            controller.reset()

    def _choose(self, request: FollowRequest) -> None:
        """Take a request's plug-ins and its path."""
        self._controller = _found("controller", request.controller, self._controllers)
        self._goal_checker = _found("goal checker", request.goal_checker, self._goal_checkers)
        self._path_handler = _found("path handler", request.path_handler, self._path_handlers)
        named, checkers = request.progress_checker, self._progress_checkers
        self._progress = _found("progress checker", named, checkers) if named or checkers else None
        if named != self._progress_name and self._progress is not None:
            self._progress_name = named
            self._progress.reset()
        if not len(request.path):
            raise _Aborted(Error.INVALID_PATH, "the path is empty")
        self._path, self._begin = request.path, 0
        self._controller.set_plan(self._path)
        self._path_handler.set_plan(self._path)
        self._goal_checker.reset()

    def _cycle(
        self, now: float, pose: FloatArray, velocity: Velocity, frame: FloatArray, view: CostView
    ) -> Velocity | None:
        """One cycle: the command, or None: the goal is reached."""
        goal = compose(frame, self._path[-1])
        try:
            path = self._path_handler.local_plan(pose, frame, view)
        except ControllerFailed as failure:
            raise _Aborted(Error.INVALID_PATH, str(failure)) from failure
        checker, p = self._goal_checker, self._parameters
        if checker.reached(pose, goal, velocity, path_length(path)):
            return None
        if self._progress is not None and not self._progress.check(now, pose):
            raise _Aborted(Error.FAILED_TO_MAKE_PROGRESS, "the robot does not get on")
        try:
            command = self._controller.compute(now, pose, velocity, path, goal, checker.tolerances(), view)
        except ControllerFailed as failure:
            raise _Aborted(Error.CONTROLLER_UNKNOWN, str(failure)) from failure
        except NoValidControl as failure:
            if p.failure_tolerance == 0.0:
                raise _Aborted(Error.NO_VALID_CONTROL, str(failure)) from failure
            if p.failure_tolerance > 0.0 and now - self._last_valid > p.failure_tolerance + EARLY:
                raise _Aborted(Error.PATIENCE_EXCEEDED, str(failure)) from failure
            return STILL
        self._last_valid = now
        return command

    def _thresholded(self, velocity: Velocity) -> Velocity:
        p = self._parameters
        return Velocity(
            velocity.v_x if abs(velocity.v_x) > p.min_x_velocity_threshold else 0.0,
            velocity.v_y if abs(velocity.v_y) > p.min_y_velocity_threshold else 0.0,
            velocity.omega if abs(velocity.omega) > p.min_theta_velocity_threshold else 0.0,
        )

    def _tracking(self, pose: FloatArray, frame: FloatArray) -> Tracking | None:
        if len(self._path) < 2:
            return None
        on_path = relative(frame, pose)
        found = _track(self._path, on_path, self._begin, self._parameters.search_window)
        self._begin = int(found[0])
        return Tracking(float(found[1]), float(found[2]))


def _found(role: str, name: str, plugins: dict[str, _Plugin]) -> _Plugin:
    plugin = chosen(name, plugins)
    if plugin is None:
        raise _Aborted(Error.INVALID_CONTROLLER, f"there is no {role} {name!r}; there are {', '.join(plugins)}")
    return plugin


@kernel
def _track(path: FloatArray, pose: FloatArray, begin: int, search: float) -> tuple[int, float, float]:
    """Index of the segment of a path (n, >= 2) that is nearest to a pose, distance from it [m] (positive on its left), and the
    angle from the pose's heading to its [rad]; it is looked for from a segment on, up to `search` metres ahead."""
    nearest, at, along = np.inf, begin, 0.0
    for i in range(begin, path.shape[0] - 1):
        if along > search:
            break
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        squared = dx * dx + dy * dy
        px, py = pose[0] - path[i, 0], pose[1] - path[i, 1]
        share = min(max((px * dx + py * dy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
        distance = math.hypot(px - share * dx, py - share * dy)
        if distance < nearest:
            nearest, at = distance, i
        along += math.sqrt(squared)
    if at > path.shape[0] - 2:
        return at, 0.0, 0.0
    dx, dy = path[at + 1, 0] - path[at, 0], path[at + 1, 1] - path[at, 1]
    side = dx * (pose[1] - path[at, 1]) - dy * (pose[0] - path[at, 0])
    return at, nearest if side >= 0.0 else -nearest, wrap(math.atan2(dy, dx) - pose[2])

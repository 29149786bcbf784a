"""The distances to the goal that the search goes by, made anew when what stands or the goal has changed."""

from __future__ import annotations

import numpy as np

from clearway.contract import Observation, Task
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.frame import OdometryFrame
from clearway.navigators.common.route import Route
from clearway.navigators.common.route import seen as perceived
from clearway.navigators.hp_st.environment.field import NO_WAY, Field, field_on_map, look, make_field
from clearway.navigators.hp_st.environment.sight import Sight
from clearway.navigators.hp_st.environment.standing import Standing
from clearway.robots import DriveLimits

_SAME = 1e-3  # m, a goal that has moved by less hasn't moved
_BEYOND = 1.0  # m, which the field reaches beyond what can be driven within the horizon


class GoalDistance:
    """By the ways on the task's map past what isn't on it; without a map, or where all of these are barred, past what is seen to stand.

    Args:
        task: Whose map holds.
        area: (4,) where the robot's centre may be, in metres; +-inf: anywhere.
        radius: Of the robot, with what it keeps from what stands, in metres.
        limits: Of its base.
        horizon: How far ahead it plans, in seconds.
        refresh: After so many periods what a lidar shows is looked at again.
        sight: Of the lidar, where what it has seen to stand is remembered; None: what is told is all there is.
    """

    def __init__(
        self,
        task: Task,
        area: FloatArray,
        radius: float,
        limits: DriveLimits,
        horizon: float,
        refresh: int,
        sight: Sight | None = None,
    ) -> None:
        self._area, self._radius, self._refresh = area, radius, refresh
        self._route = None if task.map is None else Route(task, radius, limits, 0.0)
        self._standing = None if sight is None or task.map is not None else Standing(sight)
        self._half = limits.fastest * horizon + _BEYOND
        self._field: Field | None = None
        self._known, self._age = b"", 0

    def update(
        self,
        observation: Observation,
        frame: OdometryFrame,
        pose: FloatArray,
        goal: FloatArray,
        still: FloatArray,
        eye: FloatArray,
    ) -> Field:
        """The field for a robot at `pose` (3,) with that `goal` (3,), past `still` (s, 3) x, y, R seen from `eye` (3,); these are in `frame`."""
        self._age += 1
        old = self._field
        if old is not None and self._age < self._refresh and np.abs(old.goal - goal[:2]).max() < _SAME:
            return old
        if self._route is not None:
            t, told = observation.t, observation.goal
            ways = self._route.held(t, told)
            if ways is None:
                ways = self._route.ways(t, observation.pose, told, perceived(observation.obstacles, True))
            found = field_on_map(ways, frame, pose, goal, self._half)
            if look(found, float(pose[0]), float(pose[1]))[0] < NO_WAY:
                self._field, self._known, self._age = found, b"", 0
                return found
        return self._past(pose, goal, still if self._standing is None else self._standing.update(eye, still))

    def _past(self, pose: FloatArray, goal: FloatArray, still: FloatArray) -> Field:
        area = self._area
        if not np.isfinite(area).all():
            low, high = np.minimum(pose[:2], goal[:2]) - 4.0, np.maximum(pose[:2], goal[:2]) + 4.0
            area = np.array((*np.floor(low), *np.ceil(high)))
        key = still.tobytes() + goal.tobytes() + area.tobytes()
        if self._field is None or key != self._known:
            discs = still.copy()
            discs[:, 2] += self._radius
            self._field, self._known, self._age = make_field(goal, discs, area), key, 0
        return self._field

"""Directions that may not be reversed until the robot has moved on: common to DWA and DWB.

Behaviour after base_local_planner/src/oscillation_cost_function.cpp, which nav2_dwb_controller's oscillation.cpp takes over.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


class Signs(NamedTuple):
    """Directions that the oscillation critic forbids just now.

    Attributes:
        no_reverse: Whether it may not drive backwards.
        no_forward: Whether it may not drive forwards.
        no_right: Whether it may not turn right.
        no_left: Whether it may not turn left.
        no_strafe_right: Whether it may not move to its right.
        no_strafe_left: Whether it may not move to its left.
    """

    no_reverse: bool = False
    no_forward: bool = False
    no_right: bool = False
    no_left: bool = False
    no_strafe_right: bool = False
    no_strafe_left: bool = False


@kernel
def forbids(signs: Signs, v: float, w: float, u: float) -> bool:
    """Whether a command is in a forbidden direction: forwards, yaw rate, to the left."""
    return (
        (signs.no_reverse and v < 0)
        or (signs.no_forward and v > 0)
        or (signs.no_right and w < 0)
        or (signs.no_left and w > 0)
        or (signs.no_strafe_right and u < 0)
        or (signs.no_strafe_left and u > 0)
    )


class Oscillation:
    """Forbids a reversal of direction until the robot has moved on (oscillation_cost_function.cpp).

    A direction that follows its opposite becomes the only one allowed. Turning counts only while hardly driving.
    """

    def __init__(self, distance: float, angle: float) -> None:
        self._distance, self._angle = distance, angle
        self._since: FloatArray = np.zeros(3)
        self.clear()

    def clear(self) -> None:
        """Allow every direction."""
        self._forward = self._reverse = self._left = self._right = False
        self._strafing = 0  # last to the left: 1, to the right: -1
        self.signs = Signs()

    def update(self, pose: FloatArray, v: float, w: float, min_vel_trans: float, u: float = 0.0) -> None:
        """Note the command (v, w), and u to the left, that was chosen at `pose`."""
        s = self.signs
        changed = False
        if v < 0:
            if self._forward:
                s, changed = s._replace(no_forward=True), True
            self._forward, self._reverse = False, True
        elif v > 0:
            if self._reverse:
                s, changed = s._replace(no_reverse=True), True
            self._forward, self._reverse = True, False
        if abs(v) <= min_vel_trans:
            if u < 0.0:
                if self._strafing > 0:
                    s, changed = s._replace(no_strafe_left=True), True
                self._strafing = -1
            elif u > 0.0:
                if self._strafing < 0:
                    s, changed = s._replace(no_strafe_right=True), True
                self._strafing = 1
            if w < 0:
                if self._left:
                    s, changed = s._replace(no_left=True), True
                self._left, self._right = False, True
            elif w > 0:
                if self._right:
                    s, changed = s._replace(no_right=True), True
                self._left, self._right = True, False
        self.signs = s
        if changed:
            self._since = pose.copy()
        if any(s) and self._moved_on(pose - self._since):
            self.clear()

    def _moved_on(self, moved: FloatArray) -> bool:
        """Whether `moved` (3,), the way from where a direction was forbidden last, is far enough."""
        return bool(moved[0] ** 2 + moved[1] ** 2 > self._distance**2 or abs(moved[2]) > self._angle)

"""What is written down of a trial while it goes on."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.contract import Command
from clearway.geometry.shapes import FloatArray


class Log:
    """Samples of a trial, in arrays that grow.

    Args:
        moving_obstacles: How many there are.
        components: Of a velocity: v, omega and, of an omnidirectional base, v_y.
    """

    def __init__(self, moving_obstacles: int, components: int = 2) -> None:
        self._n, self._last, self._any_moving = 0, -1.0, moving_obstacles > 0
        self._sideways = components > 2
        self._columns: dict[str, Any] = {
            "t": np.empty(512), "motion": np.empty((512, 3 + components)), "estimate": np.empty((512, 3)),
            "command": np.empty((512, components)), "leg": np.empty(512, dtype=np.int64), "moving_obstacles": np.empty((512, moving_obstacles, 3)),
            "cut": np.empty(512, dtype=np.bool_),
        }  # fmt: skip
        self._unpack()

    def add(
        self,
        t: float,
        motion: FloatArray,
        estimate: FloatArray,
        command: Command,
        leg: int,
        moving_obstacles: FloatArray,
    ) -> None:
        """One instant: `t` [s], true pose and velocity (3 + components,), estimate (3,), command, leg, moving obstacles (m, 3).

        The same instant again (contact before anything moved) replaces what stood there.
        """
        i = self._n - 1 if t == self._last else self._n
        if i == len(self._t):
            self._columns = {k: np.concatenate([c, np.empty_like(c)]) for k, c in self._columns.items()}
            self._unpack()
        self._t[i] = self._last = t
        self._motion[i] = motion
        self._estimate[i] = estimate
        told = self._command
        told[i, 0], told[i, 1] = command.v, command.omega
        if self._sideways:
            told[i, 2] = command.v_y
        self._leg[i] = leg
        self._cut[i] = command.cut
        if self._any_moving:
            self._moving_obstacles[i] = moving_obstacles
        self._n = i + 1

    def columns(self) -> dict[str, Any]:
        """The samples under the names that a `Trial` has for them."""
        taken = {name: column[: self._n].copy() for name, column in self._columns.items()}
        motion = taken.pop("motion")
        return taken | {"pose": motion[:, :3].copy(), "velocity": motion[:, 3:].copy()}

    def _unpack(self) -> None:
        self._t, self._motion, self._estimate, self._command, self._leg, self._moving_obstacles, self._cut = (
            self._columns.values()
        )

"""What is written down of a trial while it goes on."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.contract import Command
from clearway.geometry.shapes import FloatArray


class Log:
    """Samples of a trial, in arrays that grow. `take(name)` gives the filled part of one."""

    def __init__(self, movers: int) -> None:
        self._n = 0
        self._columns: dict[str, Any] = {
            "t": np.empty(512), "pose": np.empty((512, 3)), "velocity": np.empty((512, 2)),
            "estimate": np.empty((512, 3)), "command": np.empty((512, 2)), "leg": np.empty(512, dtype=np.int64),
            "movers": np.empty((512, movers, 3)),
        }  # fmt: skip
        self._unpack()

    def add(
        self, t: float, pose: FloatArray, velocity: FloatArray, estimate: FloatArray, command: Command, leg: int,
        movers: FloatArray,
    ) -> None:  # fmt: skip
        """One instant: `t` [s], true pose (3,) and velocity (2,), estimate (3,), command, leg, movers (m, 3).

        The same instant again (contact before anything moved) replaces what stood there.
        """
        i = self._n - 1 if self._n and self._t[self._n - 1] == t else self._n
        if i == len(self._t):
            self._columns = {k: np.concatenate([c, np.empty_like(c)]) for k, c in self._columns.items()}
            self._unpack()
        self._t[i] = t
        self._pose[i] = pose
        self._velocity[i] = velocity
        self._estimate[i] = estimate
        self._command[i, 0] = command.v
        self._command[i, 1] = command.omega
        self._leg[i] = leg
        if len(movers):
            self._movers[i] = movers
        self._n = i + 1

    def take(self, name: str) -> Any:
        """The samples of one column, (n, ...)."""
        return self._columns[name][: self._n].copy()

    def _unpack(self) -> None:
        self._t, self._pose, self._velocity, self._estimate, self._command, self._leg, self._movers = (
            self._columns.values()
        )

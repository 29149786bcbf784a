"""Behaviours that are not Clearway's: what they answer is looked at, so that contact can count on it; what they are shown are
copies, so that they move nobody but their own people.
"""

from __future__ import annotations

import bdb
import copy
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from clearway.foreign import said
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import Cast, Scene

_ROUNDING = 1e-6  # m
_T = TypeVar("_T")


class BehaviourError(Exception):
    """A behaviour raised whatever it was, or answered what can't be."""


class Foreign:
    """A user's behaviour of people. It has a `speed` (n,), the most that each ever moves at [m/s], and a method `step` as
    `Behaviour` has it; people appear where their scenario has them at time 0.

    Args:
        name: Its name or address.
        make: Its class, or another factory.
        cast: With what it is made.

    Raises:
        BehaviourError: it can't be made, or says no speed.
    """

    def __init__(self, name: str, make: Callable[[Cast], Any], cast: Cast) -> None:
        self.members, self._name, self._people = cast.members, name, cast.people
        self._at = np.array([(*person.start, 0.0) for person in cast.people])
        self._inner = self._asked("cannot be made", lambda: make(copy.deepcopy(cast)))
        self.speed = self._asked("says no speed", lambda: np.array(self._inner.speed, dtype=np.float64))
        if self.speed.shape != (len(cast.people),) or not (np.isfinite(self.speed) & (self.speed >= 0.0)).all():
            raise BehaviourError(
                f"the behaviour {name!r} says {self.speed!r} is its speed; one for each of its people is, m/s"
            )

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Have it decide.

        Raises:
            BehaviourError: it raises, or answers anything but a pose for each within its speed.
        """
        shown = copy.deepcopy(scene)
        poses = self._asked(
            f"failed at {t:.2f} s", lambda: np.array(self._inner.step(t, until, shown), dtype=np.float64)
        )
        if poses.shape != self._at.shape:
            raise BehaviourError(
                f"the behaviour {self._name!r} answered poses of shape {poses.shape} at {t:.2f} s; {self._at.shape} are asked"
            )
        for person, before, pose, speed in zip(self._people, self._at, poses, self.speed, strict=True):
            if not np.isfinite(pose).all():
                raise BehaviourError(
                    f"the behaviour {self._name!r} put {person.name!r} at {pose.tolist()} at {t:.2f} s"
                )
            moved = float(np.hypot(*(pose[:2] - before[:2])))
            if moved > speed * (until - t) + _ROUNDING:
                raise BehaviourError(
                    f"the behaviour {self._name!r} moved {person.name!r} at {moved / (until - t):.2f} m/s at {t:.2f} s; it says"
                    f" {speed:g} m/s is the most"
                )
        self._at = poses
        return poses.copy()

    def _asked(self, wrong: str, ask: Callable[[], _T]) -> _T:
        """What its code answers; that may raise anything, `sys.exit()` too."""
        try:
            return ask()
        except (KeyboardInterrupt, bdb.BdbQuit):
            raise
        except BaseException as error:
            raise BehaviourError(f"the behaviour {self._name!r} {wrong}: {said(error)}") from error

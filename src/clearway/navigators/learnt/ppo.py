"""The navigator `ppo`: a policy that comes with Clearway, learnt by `benchmarks/train_ppo.py`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Need, Observation, Obstacles
from clearway.navigators.learnt.navigator import Learnt
from clearway.navigators.learnt.policy import read_npz
from clearway.robots import DriveKind
from clearway.tuning import TunedOn

FILE = Path(__file__).with_name("ppo.npz")
"""Its policy."""
CROWD = 5
"""Among so many people it was always trained."""
ASTERN, WIDTH = 5.0, 0.3
"""Where there are fewer, the others are taken to stand so far behind it, seen from the goal, and to be as broad as there, m."""


class Ppo(Learnt):
    """Sees the five nearest obstacles as discs, and moves a holonomic base without turning it."""

    needs: frozenset[Need] = frozenset({"obstacles"})  # type: ignore[misc]
    drives: frozenset[DriveKind] = frozenset({"omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        TunedOn("crowd", ("crowdnav-disc",), draws=range(2**31, 2**32 - 2000), note="its training"),
    )

    def __init__(self) -> None:
        super().__init__(read_npz(FILE))

    def step(self, observation: Observation) -> Command:
        """As `Learnt.step`; of a crowd as it was trained in, whoever is missing stands far behind."""
        return super().step(replace(observation, obstacles=_crowd(observation)))

    @classmethod
    def files(cls) -> tuple[Path, ...]:
        """Its policy's."""
        return (FILE,)


def _crowd(observation: Observation) -> Obstacles:
    seen = observation.obstacles
    assert seen is not None
    missing = max(CROWD - len(seen), 0)
    away = observation.pose[:2] - observation.goal.pose[:2]
    place = observation.pose[:2] + ASTERN * away / max(float(np.hypot(*away)), 1e-9)
    still, nothing = np.zeros((missing, 2)), np.zeros(missing)
    return Obstacles(
        position=np.concatenate((seen.position, still + place)),
        velocity=np.concatenate((seen.velocity, still)),
        radius=np.concatenate((seen.radius, nothing + WIDTH)),
        error=np.concatenate((seen.error, nothing)),
        velocity_error=np.concatenate((seen.velocity_error, nothing)),
        identity=np.concatenate((seen.identity, -1 - np.arange(missing))),
        moving=np.concatenate((seen.moving, nothing > 0.0)),
    )

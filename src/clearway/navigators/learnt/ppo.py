"""The navigator `ppo`: two policies that come with Clearway, learnt by `benchmarks/train_ppo.py`; which one drives is a matter of the base."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Need, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.navigators.learnt import guiding
from clearway.navigators.learnt.encoding import GOAL
from clearway.navigators.learnt.navigator import Learnt
from clearway.navigators.learnt.policy import read_npz
from clearway.robots import DriveKind, Robot, possible
from clearway.tuning import TunedOn

DISCS, LIDAR = (Path(__file__).with_name(name) for name in ("ppo.npz", "ppo-lidar.npz"))
"""Its policies."""
CROWD = 5
"""Among so many people the one that sees discs was always trained."""
ASTERN, WIDTH = 5.0, 0.3
"""Where there are fewer, the others are taken to stand so far behind it, seen from the goal, and to be as broad as there, m."""
TRAINED = "tiago"
"""Whom the one that sees scans drives."""
NEARER = 0.6
"""By its own estimate, which errs by centimetres, it comes so much nearer to a goal than it has to: a share of the tolerances."""


class Ppo:
    """Moves a holonomic base without turning it, by the five nearest obstacles as discs; drives TIAGo by the scans of its lidar.

    Args:
        policy: A file of `benchmarks/train_ppo.py lidar`, instead of the policy for TIAGo that comes with it.

    Raises:
        ClearwayError: it holds none.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    wants: ClassVar[frozenset[Need]] = frozenset({"scan"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"omnidirectional", "differential"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        TunedOn("crowd", ("crowdnav-disc",), draws=range(2**31, 2**32 - 2000), note="its training"),
    )

    def __init__(self, policy: str = "") -> None:
        self._lidar = read_npz(Path(policy) if policy else LIDAR)
        if (self._lidar.sees, self._lidar.says) != (guiding.SIZE, guiding.ANSWERS) or not self._lidar.acting.normalised:
            raise ClearwayError(
                f"holds no policy for {TRAINED}: one sees {guiding.SIZE} numbers and answers {guiding.ANSWERS} shares of what the base can do",
                file=self._lidar.file,
            )
        self._discs = Learnt(read_npz(DISCS))

    @classmethod
    def files(cls, policy: str = "") -> tuple[Path, ...]:
        """Those of its policies."""
        return (DISCS, Path(policy) if policy else LIDAR)

    def read_parameters(self, robot: Robot) -> None:
        """See that one of its policies can drive `robot`.

        Raises:
            ClearwayError: none can.
        """
        if robot.limits().kind == "omnidirectional":
            self._discs.read_parameters(robot)
        elif robot.name.partition(":")[0] != TRAINED:
            raise ClearwayError(
                f"ppo has no policy for the robot {robot.name!r}: it drives {TRAINED} by its lidar, and holonomic bases among discs; "
                "`benchmarks/train_ppo.py` trains one"
            )
        else:
            self._lidar.seeing.check(robot)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Take over robot and set speed, and forget what was seen. Nothing is drawn from `rng`."""
        self.read_parameters(robot)
        self._by_lidar = robot.limits().kind != "omnidirectional"
        if not self._by_lidar:
            self._discs.reset(task, robot, rng)
            return
        limits = robot.limits(task.speed_limit)
        self._speed, self._limits = np.array([limits.v_max]), limits
        self._guide, self._begun = guiding.Guide(1, robot), False

    def step(self, observation: Observation) -> Command:
        """What the policy makes of what is seen, as far as the base can do it. Of a crowd as it was trained in, whoever is missing stands far
        behind.

        Raises:
            ValueError: it isn't finite.
        """
        if not self._by_lidar:
            return self._discs.step(replace(observation, obstacles=_crowd(observation)))
        seen = self._lidar.seeing.flat(replace(observation, velocity=observation.velocity[:2]))[None]
        if self._begun:
            self._guide.keep(seen)
        else:
            self._guide.begin(seen, np.ones(1, np.bool_))
            self._begun = True
        answers = self._lidar.answer(self._guide.shown(seen, self._speed)[0])
        goal, (x, y, cos, sin) = observation.goal, seen[0, :GOAL].tolist()
        v, omega = self._guide.commands(seen, self._speed, answers[None], NEARER * goal.xy_tolerance)[0].tolist()
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ValueError(f"the policy answers {answers}")
        v, omega, _ = possible(self._limits, v, omega, 0.0)
        turned = abs(math.atan2(sin, cos)) <= NEARER * goal.yaw_tolerance  # both are 0 where the heading is free
        return Command(v, omega, arrived=math.hypot(x, y) <= NEARER * goal.xy_tolerance and turned)


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

"""Navigators whose decisions a policy makes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.contract import Command, Need, Observation, Task
from clearway.errors import ClearwayError
from clearway.navigators.learnt.encoding import Acting, Seeing
from clearway.navigators.learnt.policy import Policy, read_npz, read_onnx
from clearway.robots import DriveKind, Robot, possible


class Learnt:
    """Drives as a policy says.

    Args:
        policy: It.

    Attributes:
        needs: What it has to see.
        drives: Bases that are told as many things as it answers.
    """

    needs: frozenset[Need]  # type: ignore[misc]
    drives: frozenset[DriveKind]

    def __init__(self, policy: Policy) -> None:
        self._policy, self.needs = policy, policy.seeing.needs
        self.drives = frozenset({"omnidirectional"} if policy.says == 3 else {"differential", "ackermann"})
        if policy.says is None:
            self.drives = frozenset({"differential", "ackermann", "omnidirectional"})

    def read_parameters(self, robot: Robot) -> None:
        """See that it can drive `robot`.

        Raises:
            ClearwayError: it can't.
        """
        self._policy.check(robot)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Take over robot and set speed. Nothing is drawn from `rng`."""
        self._policy.check(robot)
        self._robot, self._speed, self._limits = robot, task.speed_limit, robot.limits(task.speed_limit)

    def step(self, observation: Observation) -> Command:
        """What the policy answers to what is seen, as far as the base can do it.

        Raises:
            ValueError: it isn't finite.
        """
        policy = self._policy
        said = policy.acting.command(policy.answer(policy.seeing.flat(observation)), self._robot, self._speed)
        v, omega, v_y = possible(self._limits, said.v, said.omega, said.v_y)
        return Command(v, omega, v_y=v_y)


def npz(file: str) -> Npz:
    """Who makes a navigator of what stands behind `npz:`, a file."""
    return Npz(Path(file))


@dataclass(frozen=True)
class Npz:
    """A policy in a file of ours.

    Attributes:
        file: Its file.
    """

    file: Path

    def __call__(self) -> Learnt:
        """A navigator of it.

        Raises:
            ClearwayError: the file holds none.
        """
        return Learnt(read_npz(self.file))

    def files(self) -> tuple[Path, ...]:
        """Its file."""
        return (self.file,)


def onnx(file: str) -> Onnx:
    """Who makes a navigator of what stands behind `onnx:`, a file."""
    return Onnx(Path(file))


@dataclass(frozen=True)
class Onnx:
    """A policy in ONNX.

    Attributes:
        file: Its file.
    """

    file: Path

    def __call__(self, beams: int = 0, obstacles: int = 0, normalised: bool = True) -> Learnt:
        """A navigator of it.

        Args:
            beams: What it sees: see `clearway.learning.make`.
            obstacles: Likewise.
            normalised: Likewise.

        Raises:
            ClearwayError: the file holds none, or an option is wrong.
        """
        if not isinstance(normalised, bool):
            raise ClearwayError(f"normalised = {normalised!r}; true or false is expected", file=self.file)
        return Learnt(read_onnx(self.file, Seeing(beams, obstacles), Acting(normalised)))

    def files(self, beams: int = 0, obstacles: int = 0, normalised: bool = True) -> tuple[Path, ...]:
        """Its file."""
        return (self.file,)

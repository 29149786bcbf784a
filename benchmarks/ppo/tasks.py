"""What is learnt: in which worlds, what a policy sees there and says, and what a control period is worth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.geometry.shapes import circumscribed_radius
from clearway.learning import Steps, default_rewards, make_vec
from clearway.navigators.learnt import guiding
from clearway.navigators.learnt.encoding import GOAL, OBSTACLE, axes
from clearway.robots import load_robot
from clearway.trials import Outcome

Array = np.ndarray
HALLS = f"{Path(__file__).parent / 'halls.py'}:HALLS"


@dataclass(frozen=True)
class Task:
    """What is learnt: where, with which eyes, and what is dear there beside what `default_rewards` has."""

    suite: str
    options: dict[str, Any]
    beams: int = 0
    obstacles: int = 0
    held: tuple[str, ...] = ()  # axes that are never used
    contact: float = 10.0  # what a contact costs more than other bad ends
    comfort: float = 0.0  # what a period costs in which the nearest obstacle is touched; nothing from COMFORT on
    late: float = 0.0  # what it costs that time is over
    spread: float = 0.6  # of what is tried at first, in shares of what the base can do
    rate: float = 1e-3  # of learning; falls to nothing


TASKS = {
    "discs": Task(
        "crowd", {"batches": ("circle-invisible", "square-invisible")}, obstacles=5, held=("omega",), comfort=1.0
    ),
    "lidar": Task(
        HALLS, {"robot": "tiago", "latency": 0.0}, guiding.BEAMS, comfort=0.03, late=10.0, spread=0.2, rate=3e-4
    ),
}
COMFORT = 0.2
"""Room between robot and obstacle that costs nothing, m."""


class Worlds:
    """Many lanes of a task: a policy sees what they show, and they are told what it says.

    Args:
        task: It.
        lanes: How many.

    Attributes:
        axes: How many things the base is told.
        free: Which of them the policy says.
        care: How much contact and comfort count, from 0 to 1.
    """

    def __init__(self, task: Task, lanes: int) -> None:
        self.task, self.care, self.robot = task, 0.0, load_robot(task.options.get("robot", "crowdnav-disc"))
        self.env = make_vec(
            task.suite,
            num_envs=lanes,
            beams=task.beams,
            obstacles=task.obstacles,
            flat=True,
            reward=self.reward,
            **task.options,
        )
        named = axes(self.robot)
        self.axes, self.free = len(named), [k for k, axis in enumerate(named) if axis not in task.held]

    def reset(self, seed: int) -> Array:
        return self.env.reset(seed=seed)[0]

    def step(self, action: Array) -> tuple[Any, ...]:
        """What is seen, what was seen last of those whose episode is over, and what the worlds say else."""
        seen, *rest, infos = self.env.step(action)
        return seen, _last(seen, infos), *rest, infos

    def nearest(self, seen: Array) -> Array:
        """How far the nearest obstacle that is seen is from the robot's middle, m."""
        x, y, *_, radius, _ = seen[:, GOAL + self.axes :][:, :OBSTACLE].T
        return np.hypot(x, y) - radius

    def reward(self, steps: Steps) -> Array:
        """What a control period is worth to each."""
        task, worth = self.task, default_rewards(steps)
        worth -= self.care * task.contact * np.array([outcome == Outcome.COLLISION for outcome in steps.outcome])
        worth -= task.late * np.array([outcome == Outcome.TIMEOUT for outcome in steps.outcome])
        if task.comfort:
            free = self.nearest(steps.seen) - circumscribed_radius(self.robot.shape)
            worth -= self.care * task.comfort * np.maximum(1.0 - free / COMFORT, 0.0)
        return worth


class Guided(Worlds):
    """Between them and the policy stands `guiding.Guide`; and of each episode what is said is in force one or two control periods later,
    as these worlds have no latency and the tests have: 0.15 s of TIAGo's.

    Args:
        task: See `Worlds`.
        lanes: The same.
        rng: By which that is drawn.
    """

    def __init__(self, task: Task, lanes: int, rng: np.random.Generator) -> None:
        super().__init__(task, lanes)
        self.rng, self.every = rng, np.arange(lanes)
        self.turning, self.tolerance = self.robot.drive.omega_max, self.robot.goal_checker.xy_goal_tolerance
        self.guide = guiding.Guide(lanes, self.robot)
        self.late, self.waiting = np.ones(lanes, int), np.zeros((3, lanes, 2))

    def nearest(self, seen: Array) -> Array:
        """The same of what the lidar sees, no less than the robot's radius."""
        return np.maximum(np.abs(self.guide.points(seen)).min(1), circumscribed_radius(self.robot.shape))

    def reset(self, seed: int) -> Array:
        self.raw = self.env.reset(seed=seed)[0]
        self._begin(np.ones(len(self.raw), bool))
        return self.guide.shown(self.raw, self.speed)

    def step(self, answers: Array) -> tuple[Any, ...]:
        said = self.guide.commands(self.raw, self.speed, answers, self.tolerance)
        self.waiting = np.roll(self.waiting, 1, axis=0)
        self.waiting[0] = said
        v, omega = self.waiting[self.late, self.every].T
        self.raw, *rest, infos = self.env.step(np.stack((v / self.speed, omega / self.turning), axis=1))
        _, terminated, truncated = rest
        last = _last(self.raw, infos)
        self.guide.keep(last)
        shown = seen = self.guide.shown(last, self.speed)
        over = terminated | truncated
        if over.any():
            self._begin(over)
            seen = self.guide.shown(self.raw, self.speed)
        return seen, shown, *rest, infos

    def _begin(self, fresh: Array) -> None:
        self.speed = self.env.most[:, 0].copy()
        self.guide.begin(self.raw, fresh)
        self.waiting[:, fresh] = 0.0
        self.late[fresh] = self.rng.integers(1, 3, int(fresh.sum()))


def _last(seen: Array, infos: dict[str, Any]) -> Array:
    last = seen.copy()
    for j in np.flatnonzero(infos.get("_final_obs", [])):
        last[j] = infos["final_obs"][j]
    return last


def worlds(name: str, lanes: int, rng: np.random.Generator) -> Worlds:
    """Of a task by its name."""
    task = TASKS[name]
    return Guided(task, lanes, rng) if task.beams else Worlds(task, lanes)

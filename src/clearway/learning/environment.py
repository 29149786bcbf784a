"""Gymnasium's environment of one robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.core import RenderFrame

from clearway.contract import Command, Goal
from clearway.errors import ClearwayError, shown, unknown
from clearway.indicators import score_row
from clearway.learning.episode import Episode, Equipment, equipment_of
from clearway.learning.rewards import Reward, Step, default_reward, numbers_of, refuse_no_reward
from clearway.learning.scenes import Scenes
from clearway.learning.spaces import action_space, observation_space, seen
from clearway.navigators.learnt.encoding import Acting, Numbers, Seeing
from clearway.perception.trackers import TRACKERS
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.selecting import text
from clearway.scenarios.suite import Selection
from clearway.trials import Outcome

Observed = dict[str, Numbers] | Numbers


@dataclass(frozen=True, slots=True)
class View:
    """What learners see of their robots, what they say, and for what they are rewarded.

    Attributes:
        seeing: What is seen.
        acting: What is said.
        flat: Whether what is seen comes in a row; else by its parts.
        reward: Of a control period.
        localisation: How a robot knows where it is; None: as each scenario says.
        tracking: How it follows obstacles; None: as each scenario says.
        indicators: Whether `info` holds the trial's indicators when it is over.
    """

    seeing: Seeing
    acting: Acting
    flat: bool
    reward: Reward
    localisation: str | None
    tracking: str | None
    indicators: bool


def view(
    *, beams: int = 0, obstacles: int = 0, flat: bool = False, normalised: bool = True, reward: Reward = default_reward,
    localisation: str | None = None, tracking: str | None = None, indicators: bool = True,
) -> View:  # fmt: skip
    """The same of the options of `make`.

    Raises:
        ClearwayError: one of them is wrong.
    """
    refuse_no_reward(reward)
    for name, given in (("flat", flat), ("normalised", normalised), ("indicators", indicators)):
        if not isinstance(given, bool):
            raise ClearwayError(f"{shown(given)} is none; True or False is", field=name)
    where, how = text(localisation, "localisation"), text(tracking, "tracking")
    if how is not None and how not in TRACKERS:
        raise unknown("tracking", how, TRACKERS)
    return View(Seeing(beams, obstacles), Acting(normalised), flat, reward, where, how, indicators)


def make(suite: Any, robot: Any = None, *, render_mode: str | None = None, **options: Any) -> Alone:
    """An environment of a suite's kind: scenarios of it that no campaign can run.

    Args:
        suite: By name, file or as an object, or one `Scenario`.
        robot: Who is driven, by name, file or as an object; None: the first of the `team` that is selected, else of those that usually
            drive it.
        render_mode: None; for Gymnasium, which asks with it.
        beams: In how many parts the lidar's sweep is cut of each of which the shortest return is seen; 0: none is.
        obstacles: How many tracked obstacles are seen; 0: none.
        flat: Whether what is seen is one `Box`; else a `Dict`.
        normalised: Whether an action is a share of what the base can do, from -1 to 1; else m/s and rad/s.
        reward: What a control period is worth: a function of a `Step`.
        localisation: `truth`, `odometry` or `amcl`; None: as each scenario says.
        tracking: `difference` or `kalman`; None: as each scenario says.
        indicators: Whether `info` holds the trial's indicators when it is over, which takes some milliseconds an episode.
        options: Beside these: which part of the suite, as `clearway.run` has it: `batches`, `configurations`, `speeds`, ...

    Raises:
        ClearwayError: one of them is wrong.
    """
    if render_mode is not None:
        raise ClearwayError(f"{render_mode!r} is none; an episode is drawn by a report", field="render_mode")
    own, where = split(options)
    return Alone(Scenes(suite, robot, where), view(**own))


def split(options: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Those of `view`, and the rest, which select.

    Raises:
        ClearwayError: one is neither.
    """
    own, select = set(view.__annotations__) - {"return"}, {field.name for field in fields(Selection)}
    select = select - {"replay"} | {"people"}  # as `clearway.run` has it
    for name in options:
        if name not in own | select:
            raise unknown("option", name, own | select)
    return {k: v for k, v in options.items() if k in own}, {k: v for k, v in options.items() if k not in own}


class Alone(gymnasium.Env[Observed, npt.NDArray[np.float32]]):
    """One robot in a suite's scenarios.

    An episode terminates with the trial, and is truncated by its time limit. `info` says at its beginning which `scenario` it is, and at
    its end its `outcome`, the `reason` and the trial's `indicators`; where an indicator can't be computed, it is missing. What is seen at the end
    is what was seen before, see `Step`.

    Args:
        scenes: Which scenarios it meets.
        view: What is seen and said.

    Attributes:
        episode: The one under way; None: not begun.

    Raises:
        ClearwayError: the robot can't see that.
    """

    def __init__(self, scenes: Scenes, view: View) -> None:
        first = scenes.outlines()[0]
        self.metadata: dict[str, Any] = {"render_modes": []}
        self.render_mode = None
        self._scenes, self._view, self._robot = scenes, view, scenes.robot
        self._equipment: dict[tuple[str, str], list[Equipment]] = {}
        self._equipped(first)
        self.observation_space: Any = observation_space(view.seeing, self._robot, flat=view.flat)
        self.action_space: Any = action_space(view.acting, self._robot)
        self.episode: Episode | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observed, dict[str, Any]]:
        """Begin the next scenario; with a `seed` what comes from now on depends on it alone. It takes no `options`."""
        super().reset(seed=seed)
        if seed is not None:
            self._scenes.seed(seed)
        while True:
            scenario = self._scenes.draw()
            self.episode = Episode(scenario, self._equipped(scenario))
            if not self.episode.over:  # it may have been placed where another stands
                return self._seen(), {"scenario": scenario.name}

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observed, float, bool, bool, dict[str, Any]]:
        """Drive one control period.

        Raises:
            ValueError: the action is not as many finite numbers as it should be.
            ClearwayError: the reward is no finite number.
            gymnasium.error.ResetNeeded: no episode is under way.
        """
        episode = self.episode
        if episode is None or episode.over:
            raise gymnasium.error.ResetNeeded("the episode is over, or has not begun: call reset()")
        command = self._view.acting.command(action, self._robot, episode.scenario.speed)
        past = Past.of(episode, 0)
        episode.step({0: command})
        reward = past.reward(self._view.reward, episode, command)
        outcome = episode.outcome()
        terminated, truncated = outcome not in (None, Outcome.TIMEOUT), outcome == Outcome.TIMEOUT
        return self._seen(), reward, terminated, truncated, endings(episode, self._view)[0]

    def render(self) -> RenderFrame | list[RenderFrame] | None:
        """Nothing: an episode is drawn by a report."""
        return None

    def _seen(self) -> Observed:
        assert self.episode is not None
        observation = self.episode.seen[0]
        assert observation is not None
        return seen(self._view.seeing, observation, flat=self._view.flat)

    def _equipped(self, scenario: Scenario) -> list[Equipment]:
        """What the robot brings, made once for each way to localise and to track."""
        key = (scenario.localisation, scenario.tracking)
        if key not in self._equipment:
            view = self._view
            self._equipment[key] = equipment_of(scenario, self._robot, view.seeing, view.localisation, view.tracking)
        return self._equipment[key]


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """What was before a robot drove on.

    Attributes:
        robot: Which of the episode's.
        pose: (3,) its true pose.
        goal: Where it was to go.
        leg: Which of its legs that was.
    """

    robot: int
    pose: npt.NDArray[np.float64]
    goal: Goal
    leg: int

    @classmethod
    def of(cls, episode: Episode, robot: int) -> Past:
        """That of `robot` now."""
        drive = episode.drives[robot]
        return cls(robot, drive.world.motion[:3], drive.checker.goal, drive.checker.leg)

    def reward(self, reward: Reward, episode: Episode, command: Command) -> float:
        """What the period is worth in which it was told `command`, which is now over.

        Raises:
            ClearwayError: `reward` says no finite number.
        """
        drive, observation = episode.drives[self.robot], episode.seen[self.robot]
        assert observation is not None
        step = Step(
            self.pose, drive.world.motion[:3], self.goal, command, observation, drive.task.period,
            drive.checker.leg != self.leg, drive.outcome,
        )  # fmt: skip
        return float(numbers_of(reward(step), ()))


def endings(episode: Episode, view: View) -> list[dict[str, Any]]:
    """Of each robot what `info` holds when its trial is over, with its indicators when all are; empty: it goes on."""
    trials = episode.trials() if episode.over and view.indicators else []
    told: list[dict[str, Any]] = [
        {"outcome": str(drive.outcome), "reason": drive.checker.reason} if drive.outcome is not None else {}
        for drive in episode.drives
    ]
    for own, trial in zip(told, trials, strict=False):
        own["indicators"] = {name: value for name, value in score_row(trial).items() if value is not None}
    return told

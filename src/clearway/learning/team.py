"""PettingZoo's parallel environment of several robots in one place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from clearway.errors import ClearwayError
from clearway.learning.environment import Observed, Past, View, endings, split, view
from clearway.learning.episode import Episode, Equipment, equipment_of, robots_of
from clearway.learning.scenes import Scenes
from clearway.learning.spaces import action_space, observation_space, seen
from clearway.scenarios.scenario import Scenario
from clearway.trials import Outcome

try:
    from pettingzoo import ParallelEnv
except ImportError as error:  # pragma: no cover
    raise ClearwayError("several robots take PettingZoo: pip install 'clearway[learning]'") from error


def make_team(suite: Any, robot: Any = None, **options: Any) -> Team:
    """An environment of a suite of several robots; arguments and errors as of `clearway.learning.make`."""
    shown, where = split(options)
    return Team(Scenes(suite, robot, where, several=True), view(**shown))


class Team(ParallelEnv):  # type: ignore[misc]
    """All robots of a suite's scenarios, each an agent by its name; one that has arrived stands and is out of `agents`.

    The `info` of a robot says at its end its `outcome` and the `reason`. Its `indicators` are known when all robots are at their ends: the last
    step has an `info` of each, also of those that were out of `agents` before.

    Args:
        scenes: Which scenarios they meet.
        view: What each sees and says.

    Attributes:
        episode: The one under way; None: not begun.

    Raises:
        ClearwayError: a robot can't see that, or they have different control periods.
    """

    def __init__(self, scenes: Scenes, view: View) -> None:
        self.metadata: dict[str, Any] = {"name": scenes.suite.name, "render_modes": []}
        self.render_mode = None
        self._scenes, self._view = scenes, view
        self.observation_spaces: dict[str, spaces.Space[Any]] = {}
        self.action_spaces: dict[str, spaces.Space[Any]] = {}
        periods = set()
        for scenario in scenes.outlines():
            for name, robot in zip(scenario.names(), robots_of(scenario, scenes.robot), strict=True):
                view.seeing.check(robot)
                saw = observation_space(view.seeing, robot, flat=view.flat)
                said = action_space(view.acting, robot)
                before = self.observation_spaces.setdefault(name, saw), self.action_spaces.setdefault(name, said)
                if before != (saw, said):
                    raise ClearwayError(f"{name!r} is another robot in other scenarios; select fewer", field="suite")
                periods.add(robot.period)
        if len(periods) > 1:
            raise ClearwayError(
                f"the robots' control periods differ: {sorted(periods)} s; one is needed", field="robot"
            )
        self.possible_agents = list(self.action_spaces)
        self.agents: list[str] = []
        self.episode: Episode | None = None
        self._names: list[str] = []

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """What `agent` sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """What `agent` says."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observed], dict[str, dict[str, Any]]]:
        """Begin the next scenario; with a `seed` what comes from now on depends on it alone. It takes no `options`."""
        if seed is not None:
            self._scenes.seed(seed)
        while True:
            scenario = self._scenes.draw()
            self._names = scenario.names()
            self.episode = Episode(scenario, self._equipped(scenario))
            if len(self.episode.observed) == len(self._names):  # nobody was placed where another stands
                break
        self.agents = list(self._names)
        return self._seen(self.agents), {name: {"scenario": scenario.name} for name in self.agents}

    def step(
        self, actions: Mapping[str, npt.NDArray[np.float32]]
    ) -> tuple[
        dict[str, Observed], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:  # fmt: skip
        """Drive one control period.

        Raises:
            ValueError: an agent is left without an action, or one is not as many finite numbers as it should be.
            ClearwayError: a reward is no finite number.
        """
        episode, agents = self.episode, self.agents
        if episode is None or not agents:
            return {}, {}, {}, {}, {}
        if missing := [name for name in agents if name not in actions]:
            raise ValueError(f"no action for {missing[0]!r}; each agent needs one")
        numbers = {self._names.index(name): name for name in agents}
        acting, speed = self._view.acting, episode.scenario.speed
        commands = {k: acting.command(actions[name], episode.robots[k], speed) for k, name in numbers.items()}
        pasts = {k: Past.of(episode, k) for k in numbers}
        episode.step(commands)
        rewards = {name: pasts[k].reward(self._view.reward, episode, commands[k]) for k, name in numbers.items()}
        ends = {name: episode.outcome(k) for k, name in numbers.items()}
        told = endings(episode, self._view)
        infos = {name: told[k] for k, name in enumerate(self._names) if k in numbers or episode.over}
        self.agents = [name for name in agents if ends[name] is None]
        return (
            self._seen(agents),
            rewards,
            {name: end not in (None, Outcome.TIMEOUT) for name, end in ends.items()},
            {name: end == Outcome.TIMEOUT for name, end in ends.items()},
            infos,
        )

    def render(self) -> None:
        """Nothing: an episode is drawn by a report."""

    def _seen(self, agents: list[str]) -> dict[str, Observed]:
        assert self.episode is not None
        found = {}
        for name in agents:
            observation = self.episode.seen[self._names.index(name)]
            assert observation is not None
            found[name] = seen(self._view.seeing, observation, flat=self._view.flat)
        return found

    def _equipped(self, scenario: Scenario) -> list[Equipment]:
        view = self._view
        return equipment_of(scenario, self._scenes.robot, view.seeing, view.localisation, view.tracking)

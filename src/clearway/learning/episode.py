"""A scenario whose robots somebody outside drives, a control period at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.contract import Command, Decision, Need, Observation, Sensing, Task
from clearway.navigators.learnt.encoding import Seeing
from clearway.perception import make_localiser, make_tracker
from clearway.robots import Robot, load_robot
from clearway.scenarios.scenario import Scenario
from clearway.trials import Outcome, Trial
from clearway.world import simulation_of
from clearway.world.drive import Driver
from clearway.world.without_robots import completed

LEARNER = "learner"
"""The navigator's name in the trials of episodes."""


class _Learner:
    """Stands where a navigator would: it is told everything, and asked nothing."""

    needs: ClassVar[frozenset[Need]]

    def __init__(self, needs: frozenset[Need]) -> None:
        self.needs = needs  # type: ignore[misc]

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing is to be prepared."""

    def step(self, observation: Observation) -> Command:
        """Nobody asks."""
        raise NotImplementedError


class Equipment:
    """What a robot brings to its episodes: itself, a localiser and a tracker.

    Args:
        robot: It.
        seeing: What is seen of its observations.
        localisation: How it knows where it is, by name.
        tracking: How it follows obstacles, by name.

    Attributes:
        robot: As given.

    Raises:
        ClearwayError: the robot can't see that, or there is no such localisation or tracking.
    """

    def __init__(self, robot: Robot, seeing: Seeing, localisation: str, tracking: str) -> None:
        seeing.check(robot)
        self.robot = robot
        localiser = make_localiser(localisation, robot)
        tracker = make_tracker(tracking, robot) if seeing.obstacles else None
        self._pilot = compose(_Learner(seeing.needs), localiser, tracker=tracker, decision_limit=None)
        self._names: Any = {"localisation": localisation, "tracking": tracking if seeing.obstacles else ""}

    def driver(self, scenario: Scenario) -> Driver:
        """Who drives it in `scenario`."""
        return Driver(self.robot, self._pilot, LEARNER, map=granted_map(None, scenario), **self._names)

    def observe(self, sensing: Sensing) -> Observation:
        """What a navigator would be told of it."""
        return self._pilot.observe(sensing)


class Episode:
    """From its beginning, where each robot is to be told what to do, to its end.

    Args:
        scenario: The test.
        equipment: Of each of its robots.

    Attributes:
        scenario: As given.
        robots: Who is driven.
        drives: Of each robot.
        observed: By robot what it perceives now, of those that are to be told what to do.
        seen: Of each robot what it perceived last; None: nothing, it began in contact.
        over: Whether all is over.
        traffic: What moves there.

    Raises:
        ClearwayError: the scenario can't be built.
    """

    def __init__(self, scenario: Scenario, equipment: Sequence[Equipment]) -> None:
        self.scenario, self._equipment = scenario, equipment
        self._simulation = simulation_of(scenario, [one.driver(scenario) for one in equipment], raise_errors=True)
        self._due, self.traffic = self._simulation.due(), self._simulation.traffic
        self.robots, self.drives = [one.robot for one in equipment], self._simulation.drives
        self.observed: dict[int, Observation] = {}
        self.seen: list[Observation | None] = [None] * len(equipment)
        self.over = False
        self._go_on()

    def step(self, commands: Mapping[int, Command]) -> None:
        """Drive on until somebody is to be told what to do, or all is over.

        Args:
            commands: By robot, for each in `observed`.
        """
        for k, command in commands.items():
            self.drives[k].follow(Decision(command, self.observed[k].pose.copy()))
        self._go_on()

    def _go_on(self) -> None:
        self.observed = {}
        for due in self._due:
            for k, drive in enumerate(self.drives):
                if drive not in due:
                    continue
                sensing = drive.sense()
                if sensing is None:
                    drive.follow(None)
                else:
                    self.observed[k] = self.seen[k] = self._equipment[k].observe(sensing)
            if self.observed:
                return
        self.over = True

    def outcome(self, robot: int = 0) -> Outcome | None:
        """How the trial of `robot` ended; None: it goes on."""
        return self.drives[robot].outcome

    def trials(self) -> list[Trial]:
        """Of each robot, once all is over: what a navigator would have left that had given these commands."""
        trials = self._simulation.trials()
        errands = completed(self.scenario, trials[0].errands, trials[0].spans)
        return [replace(trial, errands=errands) for trial in trials]


def equipment_of(
    scenario: Scenario, robot: Robot, seeing: Seeing, localisation: str | None, tracking: str | None
) -> list[Equipment]:
    """What each robot of `scenario` brings, whose first is `robot`; names that are None: as the scenario says."""
    where = localisation or scenario.localisation
    return [Equipment(one, seeing, where, tracking or scenario.followed(one)) for one in robots_of(scenario, robot)]


def robots_of(scenario: Scenario, robot: Robot) -> list[Robot]:
    """Those of `scenario`, whose first is `robot`."""
    return [robot, *(robot if other.robot is None else load_robot(other.robot) for other in scenario.robots)]

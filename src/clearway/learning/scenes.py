"""Which scenarios a learner meets: of a suite's kind, and never one that a campaign can run."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.campaigns.objects import names_of, team_of
from clearway.errors import ClearwayError, shown
from clearway.robots import Robot, load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.selecting import selection_of
from clearway.scenarios.suite import LEARNING_DRAWS, LEARNING_SEEDS, Suite
from clearway.scenarios.suites import load_suite, suite_names

ROUNDS = 8
"""Of so many a sample is, where that takes no time: so what is tossed for shows both of its sides."""


class Scenes:
    """Gives one scenario after another, in an order that is drawn: all of a suite before one comes again.

    Each round has a campaign seed of its own, and, where the suite draws its scenarios from seeds, a seed to draw from; both are of
    ranges that no campaign takes.

    Args:
        suite: A suite by name, file or as an object, or one `Scenario`.
        robot: Who drives, by name, file or as an object; None: the first of a team that is selected, else of those that usually drive it.
        selection: Which part of it, in the words of `clearway.run`.
        several: Whether scenarios of several robots are wanted, else those of one.

    Attributes:
        suite: It.
        robot: Who drives.

    Raises:
        ClearwayError: there is no such suite or robot, nothing is selected, or what a campaign runs is: seeds or, of a suite that draws
            its scenarios, one of them by its name or as an object.
    """

    def __init__(self, suite: Any, robot: Any, selection: dict[str, Any], *, several: bool = False) -> None:
        if isinstance(suite, Scenario) and _is_drawn(own := suite.labels.suite):
            raise ClearwayError(
                f"{suite.name!r} is a test of the suite {own!r}, which a campaign runs; {own!r} itself draws others of its kind, and one of your own that is made "
                "of it has labels without a suite",
                field="suite",
            )
        self.suite: Suite = load_suite(_one(suite, "suites"))
        selection = {"replay" if name == "people" else name: value for name, value in selection.items()}
        which = None if robot is None else _one(robot, "robots")
        selection["team"] = team = team_of(selection.get("team", ()))
        if team:
            if which not in (None, team[0]):
                raise ClearwayError(f"a team says who drives; leave out {which!r}", field="robot")
            which = team[0]
        if which is None and not self.suite.robots:
            raise ClearwayError(f"say which robot is to drive the suite {self.suite.name!r}", field="robot")
        self.robot: Robot = load_robot(self.suite.robots[0] if which is None else which)
        if "seeds" in selection:
            first, last = LEARNING_DRAWS
            raise ClearwayError(
                f"what a learner meets is drawn from the seeds {first} to {last - 1}, which no campaign takes; leave it out",
                field="seeds",
            )
        if selection.get("scenarios") and self.suite.generator is not None:
            raise ClearwayError(
                f"{shown(selection['scenarios'])} would be tests that a campaign runs; what a learner meets of {self.suite.name!r} is drawn, and "
                "has other names: leave it out, and select by batches or speeds",
                field="scenarios",
            )
        self._selection, self._several = selection_of(selection), several
        self._rng = np.random.default_rng()
        self._round: list[Scenario] = []
        self._checked: set[tuple[str | None, str | None, float]] = set()

    def seed(self, seed: int) -> None:
        """From now on what comes depends on `seed` alone."""
        self._rng, self._round = np.random.default_rng([seed, *b"scenes"]), []

    def twin(self) -> Scenes:
        """Others of the same kind, in an order of their own."""
        twin = copy(self)
        twin._rng, twin._round = np.random.default_rng(), []
        return twin

    def draw(self) -> Scenario:
        """The next one.

        Raises:
            ClearwayError: it can't be built for this robot.
        """
        if not self._round:
            self._round = self._build(
                int(self._rng.integers(*LEARNING_SEEDS)), int(self._rng.integers(*LEARNING_DRAWS))
            )
            order = self._rng.permutation(len(self._round))
            self._round = [self._round[k] for k in order]
        scenario = self._round.pop()
        self.check(scenario)
        return scenario

    def check(self, scenario: Scenario) -> None:
        """Whether `scenario` can be built for this robot.

        Raises:
            ClearwayError: it can't.
        """
        labels = scenario.labels  # of those that are drawn one stands for all: each is by the same rule
        known = labels.configuration if labels.configuration in self.suite.configurations else None
        alike = (labels.batch, known, scenario.speed)
        if alike not in self._checked:
            for problem in check_scenario(scenario, self.robot):
                raise ClearwayError(problem.problem, file=problem.file, field=f"{scenario.name}: {problem.field}")
            self._checked.add(alike)

    def outlines(self) -> list[Scenario]:
        """Those of some round, without what is drawn."""
        return self._build(LEARNING_SEEDS[0], LEARNING_DRAWS[0], outlines=True)

    def sample(self) -> list[Scenario]:
        """Those of one round as they are drawn, or of several rounds where drawing takes no time; unchecked."""
        generator, (first, _) = self.suite.generator, LEARNING_DRAWS
        quick = generator is not None and not generator.calls(replace(self._selection, seeds=(first, first + 1)))
        return [s for k in range(ROUNDS if quick else 1) for s in self._build(LEARNING_SEEDS[0] + k, first + k)]

    def _build(self, seed: int, draw: int, outlines: bool = False) -> list[Scenario]:
        selection = self._selection
        if self.suite.generator is not None:
            selection = replace(selection, seeds=(draw, draw + 1))
        made = self.suite.build(self.robot, selection, seed, outlines=outlines)
        if not made:
            raise ClearwayError(
                f"the suite {self.suite.name!r} has none of the scenarios {', '.join(selection.scenarios)}",
                field="scenarios",
            )
        kept = [scenario for scenario in made if bool(scenario.robots) == self._several]
        if not kept:
            many, other = ("several robots", "make") if self._several else ("one robot", "make_team")
            raise ClearwayError(
                f"of {self.suite.name!r} no scenario that is selected has {many}; see clearway.learning.{other}",
                field="suite",
            )
        return kept


def _one(given: Any, what: str) -> str:
    """The name of the one suite or robot that was given."""
    names = names_of(given, what)
    if len(names) != 1:
        raise ClearwayError(f"{shown(given)} are {len(names)}; an environment takes one", field=what.removesuffix("s"))
    return names[0]


def _is_drawn(suite: str) -> bool:
    """Whether there is a suite of this name that draws its scenarios."""
    return suite in suite_names() and load_suite(suite).generator is not None

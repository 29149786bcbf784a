"""The trials of a campaign, made when they are asked for and a block of seeds at a time: a million of them take no memory."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from clearway.campaigns.by_robot import is_by_robot, navigator_of, refuse_strangers
from clearway.campaigns.thinking_budget import FREE, ThinkingBudget, read_thinking_budget
from clearway.errors import ClearwayError, nearest
from clearway.reading.limits import TRIALS
from clearway.robots import load_robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, refuse_many
from clearway.scenarios.suites import load_suite

SEEDS = 250
"""Of a block."""
LISTED = 8
"""Blocks whose trials stand for all others in campaign.json: what the code draws from a seed follows from the code."""


@dataclass(frozen=True, slots=True)
class TrialSpec:
    """One trial to run.

    Attributes:
        index: Its number in the results.
        scenario: The test; its outline where it has yet to be drawn (`campaigns.drawing`).
        robot: Who does it: a name, a preset or a file.
        navigator: Who decides: a registered name or an address, or several by robot.
        localisation: How the robot knows where it is, by name.
        tracking: How it follows obstacles, by name.
        setup: How much the navigator may think per control period.
        suite: The suite that the scenario is of, as the user named it.
        member: Which of the scenario's robots it is the trial of.
    """

    index: int
    scenario: Scenario
    robot: str
    navigator: str
    localisation: str
    tracking: str
    setup: ThinkingBudget
    suite: str
    member: int = 0

    @property
    def task(self) -> str:
        """What is to be done, and by which robot: readable, the same for every navigator."""
        return f"{self.scenario.labels.suite}/{self.scenario.name}/{self.robot}"

    @property
    def run(self) -> str:
        """The simulation that gives it, readable; shared with the trials of the scenario's other robots."""
        id = f"{self.task}/{self.navigator}"
        return id if self.setup.name is None else f"{id}/{self.setup.name}"

    @property
    def id(self) -> str:
        """Readable, unique in its campaign."""
        return f"{self.run}/{self.scenario.names()[self.member]}" if self.scenario.robots else self.run

    @property
    def robots(self) -> list[str]:
        """All that drive in its simulation: names, presets or files."""
        return _names(self.scenario, self.robot)

    @property
    def navigators(self) -> list[str]:
        """Who drives these."""
        own = [navigator_of(self.navigator, robot) for robot in self.robots]
        return [own[0], *(other.navigator or mine for other, mine in zip(self.scenario.robots, own[1:], strict=True))]

    @property
    def driver(self) -> str:
        """Who drives the robot of this trial."""
        return self.navigators[self.member]


class Asked(Protocol):
    """Of a campaign's plan what its trials follow from; `CampaignPlan` says what each means."""

    @property
    def suites(self) -> tuple[str, ...]: ...
    @property
    def robots(self) -> tuple[str, ...]: ...
    @property
    def navigators(self) -> tuple[str, ...]: ...
    @property
    def selection(self) -> Selection: ...
    @property
    def seed(self) -> int: ...
    @property
    def localisation(self) -> str | None: ...
    @property
    def tracking(self) -> str | None: ...
    @property
    def setups(self) -> tuple[str, ...]: ...


@dataclass(frozen=True, slots=True)
class _Block:
    """Trials that are made together."""

    suite: str
    robot: str
    navigator: str
    setup: ThinkingBudget
    selection: Selection
    listed: bool


class TrialList(Sequence[TrialSpec]):
    """Every trial of a plan, in the order of the results; of scenarios that are drawn from seeds their outlines.

    Args:
        plan: The campaign.
        sizes: What `sizes` was of the same plan, so that nothing has to be counted or looked at again; None: not known.

    Attributes:
        runs: How many trials each simulation gives.

    Raises:
        ClearwayError: an unknown suite, robot or scenario, a selection that selects nothing, or one trial twice.
    """

    def __init__(self, plan: Asked, sizes: Any = None) -> None:
        self._plan, self._held = plan, dict[tuple[str, str, Selection], list[Scenario]]()
        self._blocks = _blocks(plan)
        self._runs = [] if sizes is None else _expanded(sizes)
        if len(self._runs) != len(self._blocks):
            self._runs = self._counted()
        self.runs = np.concatenate(self._runs)
        self._ends = np.cumsum([runs.sum() for runs in self._runs])

    @property
    def sizes(self) -> list[list[list[int]]]:
        """Of each block how many simulations in a row give how many trials, as JSON values."""
        return [[[len(list(same)), size] for size, same in itertools.groupby(runs.tolist())] for runs in self._runs]

    @property
    def abridged(self) -> bool:
        """Whether `listed` are not all."""
        return not all(block.listed for block in self._blocks)

    def listed(self) -> list[TrialSpec]:
        """The trials that campaign.json tells one by one: of those that are drawn from seeds the first."""
        return [spec for k, block in enumerate(self._blocks) if block.listed for spec in self._made(k)]

    def simulations(self, numbers: Sequence[int] | NDArray[np.int64]) -> Iterator[list[TrialSpec]]:
        """Trials by their numbers, which ascend, simulation by simulation."""
        in_blocks = itertools.groupby(numbers, key=lambda number: int(np.searchsorted(self._ends, number, "right")))
        for k, some in in_blocks:
            made, first = self._made(k), int(self._ends[k]) - int(self._runs[k].sum())
            for _, run in itertools.groupby((made[number - first] for number in some), key=lambda spec: spec.run):
                yield list(run)

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __iter__(self) -> Iterator[TrialSpec]:
        return itertools.chain.from_iterable(map(self._made, range(len(self._blocks))))

    @overload
    def __getitem__(self, at: int) -> TrialSpec: ...
    @overload
    def __getitem__(self, at: slice) -> list[TrialSpec]: ...
    def __getitem__(self, at: int | slice) -> TrialSpec | list[TrialSpec]:
        numbers = range(len(self))[at]
        if isinstance(numbers, int):
            return next(self.simulations([numbers]))[0]
        return [spec for run in self.simulations(numbers) for spec in run]

    def _made(self, k: int) -> list[TrialSpec]:
        """The trials of a block."""
        block, plan = self._blocks[k], self._plan
        every = [(scenario, member) for scenario in self._scenarios(block) for member in scenario.tested()]
        if len(every) != self._runs[k].sum():
            raise ClearwayError(f"the suite {block.suite!r} has other trials than when the campaign was begun")
        return [
            TrialSpec(
                i,
                scenario,
                block.robot,
                block.navigator,
                plan.localisation or scenario.localisation,
                plan.tracking or scenario.followed(load_robot(_names(scenario, block.robot)[member])),
                block.setup,
                block.suite,
                member,
            )
            for i, (scenario, member) in enumerate(every, int(self._ends[k]) - len(every))
        ]

    def _scenarios(self, block: _Block) -> list[Scenario]:
        """The scenarios of a block; the last few blocks' are at hand, for other navigators to meet."""
        key = (block.suite, block.robot, block.selection)
        if key not in self._held:
            robot, seed = load_robot(block.robot), self._plan.seed
            self._held[key] = load_suite(block.suite).build(robot, block.selection, seed, outlines=True)
            if len(self._held) > LISTED:
                del self._held[next(iter(self._held))]
        return self._held[key]

    def _counted(self) -> list[NDArray[np.int64]]:
        """How many trials each simulation of each block gives; all that can be wrong with them is looked at."""
        plan, names, others, total = self._plan, set[str](), dict[str, None](), 0
        wanted = set(plan.selection.scenarios)
        counted: dict[tuple[str, str, Selection], NDArray[np.int64]] = {}
        seeds: dict[str, list[NDArray[np.int64]]] = {robot: [] for robot in plan.robots}
        for block in self._blocks:
            key = (block.suite, block.robot, block.selection)
            if key not in counted:
                scenarios = self._scenarios(block)
                counted[key] = np.array([len(scenario.tested()) for scenario in scenarios], np.int64)
                names |= {scenario.name for scenario in scenarios if scenario.name in wanted}
                others |= dict.fromkeys(
                    one.robot for s in scenarios for one in s.robots if one.robot and not one.navigator
                )
                seeds[block.robot].append(np.array([scenario.seed for scenario in scenarios], np.int64))
            total += int(counted[key].sum())
            refuse_many(total, block.suite)
        _refuse_unknown(plan, names)
        for navigator in filter(is_by_robot, plan.navigators):
            refuse_strangers(navigator, (*plan.robots, *others))
        runs = [counted[(block.suite, block.robot, block.selection)] for block in self._blocks]
        self._runs, self._ends = runs, np.cumsum([one.sum() for one in runs])
        for robot, found in seeds.items():
            values, often = np.unique(np.concatenate(found), return_counts=True)
            if twice := set(values[often > 1].tolist()):
                _refuse_twins([spec for spec in self if spec.robot == robot and spec.scenario.seed in twice])
        return runs


def _names(scenario: Scenario, robot: str) -> list[str]:
    return [robot, *(other.robot or robot for other in scenario.robots)]


def _blocks(plan: Asked) -> list[_Block]:
    """Suites x robots x navigators x set-ups x seeds, in this order."""
    setups = [read_thinking_budget(s) for s in plan.setups] or [FREE]
    found = []
    for suite, robot, navigator, setup in itertools.product(plan.suites, plan.robots, plan.navigators, setups):
        selections = _by_seeds(plan.selection)
        found += [_Block(suite, robot, navigator, setup, s, k < LISTED) for k, s in enumerate(selections)]
    return found


def _by_seeds(selection: Selection) -> list[Selection]:
    """The selection in parts of some seeds each; whole, where it asks for what the scenarios of some seeds may all lack."""
    special = ("configurations", "sizes", "gaps", "obstacle_speeds", "scenarios")
    if selection.seeds is None or any(getattr(selection, name) for name in special):
        return [selection]
    first, last = selection.seeds
    return [dataclasses.replace(selection, seeds=(a, min(a + SEEDS, last))) for a in range(first, last, SEEDS)] or [
        selection
    ]


def _expanded(sizes: Any) -> list[NDArray[np.int64]]:
    """What `TrialList.sizes` says; nothing if it is something else."""
    try:
        if not sum(count for block in sizes for count, _ in block) <= TRIALS:
            return []
        return [
            np.repeat([size for _, size in block], [count for count, _ in block]).astype(np.int64) for block in sizes
        ]
    except (TypeError, ValueError):
        return []


def _refuse_twins(specs: Sequence[TrialSpec]) -> None:
    """Complain of two trials that are the same: their results would count as independent."""
    seen: dict[tuple[str, str, str | None, int, int], list[TrialSpec]] = {}
    for spec in specs:
        alike = seen.setdefault((spec.robot, spec.navigator, spec.setup.name, spec.scenario.seed, spec.member), [])
        for other in alike:
            if other.id == spec.id or _test(other) == _test(spec):
                raise ClearwayError(
                    f"the trials {other.id!r} and {spec.id!r} are one and the same, and would count as two; list each value "
                    "and each scenario once",
                    file=spec.suite if spec.suite.endswith(".toml") else None,
                )
        alike.append(spec)


def _test(spec: TrialSpec) -> str:
    return spec.scenario.model_dump_json(exclude={"name", "labels"})


def _refuse_unknown(plan: Asked, found: set[str]) -> None:
    """Complain of the first scenario that is asked for and that no suite has."""
    missing = [name for name in plan.selection.scenarios if name not in found]
    if not missing:
        return
    every = dataclasses.replace(plan.selection, scenarios=(), seeds=None)  # frozen ones: their names are alike
    known = [
        scenario.name
        for suite in plan.suites
        for robot in plan.robots
        for scenario in load_suite(suite).build(load_robot(robot), every, plan.seed)
    ]
    close = nearest(missing[0], known)
    raise ClearwayError(
        f"no scenario of {', '.join(map(repr, plan.suites))} that is selected has the name {missing[0]!r}"
        + (f"; did you mean {close!r}?" if close else ""),
        field="scenarios",
    )

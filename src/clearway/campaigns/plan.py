"""What a campaign is asked to do, and the list of trials that follows from it."""

from __future__ import annotations

import dataclasses
import difflib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from clearway.campaigns.by_robot import is_by_robot, navigator_of, refuse_strangers
from clearway.campaigns.mistaken import refuse_mistaken
from clearway.campaigns.thinking_budget import FREE, ThinkingBudget, read_thinking_budget
from clearway.errors import ClearwayError, shown, unknown
from clearway.geometry.grid import OccupancyGrid
from clearway.reading.limits import LONGEST_NAME, SECONDS, WHOLE
from clearway.robots import load_robot, robot_names
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import refuse_many
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials.keeping import KEEPS, Keep


@dataclass(frozen=True, slots=True)
class CampaignPlan:
    """Suites x robots x navigators x set-ups, in this order. Everything that decides the results' bits is in here.

    Attributes:
        suites: Names, or paths of TOML files.
        robots: Names, presets or files; empty: the suites' usual ones. Of a selected team its first.
        navigators: Registered names, or addresses such as `my_pkg:MyNavigator`; or by robot, as `campaigns.by_robot` has it.
        selection: Which part of each suite.
        seed: Of the whole campaign.
        localisation: `truth`, `odometry` or `amcl`; None: as each scenario says.
        map: The path of a ROS map that a robot built; None: the floor plan's true map.
        tracking: How obstacles are followed, `difference` or `kalman`; None: as each scenario says.
        setups: How much a navigator may think per control period, as `read_thinking_budget` has it; empty: no bound.
        decision_limit: Wall clock after which a decision counts as hung and the trial as failed, s; None: never.
        options: What a navigator's constructor is given, by the navigator's name.
        keep: What is kept of each trial beside its row in the table: `trajectories` (everything), of `failures` everything, or
            nothing but the `table`.
    """

    suites: tuple[str, ...]
    robots: tuple[str, ...] = ()
    navigators: tuple[str, ...] = ("move-base",)
    selection: Selection = field(default_factory=Selection)
    seed: int = 0
    localisation: str | None = None
    map: str | None = None
    tracking: str | None = None
    setups: tuple[str, ...] = ()
    decision_limit: float | None = 10.0
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    keep: Keep = "trajectories"

    def __post_init__(self) -> None:
        for name in ("suites", "navigators"):
            if not getattr(self, name):
                raise ClearwayError("at least one is needed", field=name)
        if self.keep not in KEEPS:
            raise unknown("what is to be kept", self.keep, KEEPS, field="keep")
        limit = self.decision_limit
        if limit is not None and not 0.0 < limit <= SECONDS:
            raise ClearwayError(
                f"{limit:g} s is no limit on a decision; more than 0 and at most {SECONDS:g} s are",
                field="decision_limit",
            )
        if (seeds := self.selection.seeds) is not None:
            refuse_many(seeds[1] - seeds[0], ", ".join(self.suites))
        if not 0 <= self.seed < WHOLE:
            raise ClearwayError(f"{shown(self.seed)} is no seed; 0 to 2^63 - 1 are", field="seed")
        object.__setattr__(self, "setups", tuple(str(read_thinking_budget(s).name) for s in self.setups))
        for name in ("suites", "robots", "navigators", "setups"):
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ClearwayError(f"{next(v for v in values if values.count(v) > 1)!r} stands twice", field=name)
        if any(len(name) > LONGEST_NAME for name in self.navigators):
            raise ClearwayError(
                f"its name, with its options, has more than {LONGEST_NAME} characters", field="navigators"
            )
        for suite in self.suites:
            refuse_mistaken(suite, "suite", "scenario")
        if team := self.selection.team:
            if self.robots not in ((), team[:1]):
                raise ClearwayError("a team says which robots take part; leave out --robot", field="team")
            object.__setattr__(self, "robots", team[:1])
        for robot in dict.fromkeys((*self.robots, *team)):
            refuse_mistaken(robot, "robot")
        if not self.robots:
            object.__setattr__(self, "robots", _usual_robots(self.suites))

    def to_json(self) -> dict[str, Any]:
        """The plan as JSON values."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> CampaignPlan:
        """The plan again.

        Raises:
            ClearwayError: the values are not those of a plan.
        """
        values = {"keep": "trajectories", **values}  # of before there was a choice
        try:
            plan = TypeAdapter(cls).validate_json(json.dumps(values), strict=True)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise ClearwayError(
                f"{shown(first['input'])} is none of a campaign's plan: {first['msg'].lower()}",
                field=".".join(["plan", *map(str, first["loc"])]),
            ) from error
        made = plan.to_json()
        selection = made["selection"]
        for where, given, wanted in (
            ("plan", values, made),
            ("plan.selection", values.get("selection", {}), selection),
        ):
            for key in sorted(wanted.keys() ^ given.keys()):
                what = "is missing" if key in wanted else "is no field of a campaign's plan"
                raise ClearwayError(f"{key!r} {what}", field=where)
        return plan

    def specs(self) -> list[TrialSpec]:
        """Every trial, in the order of the results; of scenarios that are drawn from seeds their outlines.

        Raises:
            ClearwayError: an unknown suite, robot or scenario, or a selection that selects nothing.
        """
        built: list[tuple[str, str, str, ThinkingBudget, Scenario]] = []
        setups = [read_thinking_budget(s) for s in self.setups] or [FREE]
        refuse_namesakes(dict.fromkeys((*self.robots, *self.selection.team)))
        for name in self.suites:
            suite = load_suite(name)
            for robot in self.robots:
                scenarios = suite.build(load_robot(robot), self.selection, self.seed, outlines=True)
                trials = sum(len(s.tested()) for s in scenarios)
                refuse_many(len(built) + trials * len(self.navigators) * len(setups), name)
                built += [(name, robot, n, u, s) for n in self.navigators for u in setups for s in scenarios]
        _refuse_unknown(self, {s.name for *_, s in built})
        for navigator in filter(is_by_robot, self.navigators):
            others = (other.robot for *_, s in built for other in s.robots if other.robot and not other.navigator)
            refuse_strangers(navigator, (*self.robots, *others))
        every = [(*asked, member) for asked in built for member in asked[-1].tested()]
        specs = [
            TrialSpec(
                i,
                s,
                robot,
                navigator,
                self.localisation or s.localisation,
                self.tracking or s.tracking,
                setup,
                suite,
                member,
            )
            for i, (suite, robot, navigator, setup, s, member) in enumerate(every)
        ]
        _refuse_twins(specs)
        return specs


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
        return [self.robot, *(other.robot or self.robot for other in self.scenario.robots)]

    @property
    def navigators(self) -> list[str]:
        """Who drives these."""
        own = [navigator_of(self.navigator, robot) for robot in self.robots]
        return [own[0], *(other.navigator or mine for other, mine in zip(self.scenario.robots, own[1:], strict=True))]

    @property
    def driver(self) -> str:
        """Who drives the robot of this trial."""
        return self.navigators[self.member]


def refuse_namesakes(robots: Iterable[str], *, twice: bool = False) -> None:
    """Complain of a robot that bears the name of another one: results know robots by their names.

    Args:
        robots: Names, presets or files.
        twice: Whether one and the same robot may be named in two ways.

    Raises:
        ClearwayError: there is one.
    """
    shipped, named = robot_names(), dict[str, str]()
    for which in robots:
        robot = load_robot(which)
        other = named.setdefault(robot.name, which)
        if other == which and which != robot.name and robot.name in shipped and load_robot(robot.name) != robot:
            other = robot.name
        same = other != which and load_robot(other) == robot
        if other != which and not (same and twice):
            what = "the same one: take one away" if same else "another one: give it a name of its own"
            raise ClearwayError(
                f"{robot.name!r} is the name of the robot {other!r} too, which is {what}", file=which, field="name"
            )


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


def _refuse_unknown(plan: CampaignPlan, found: set[str]) -> None:
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
    close = difflib.get_close_matches(missing[0], known, n=1, cutoff=0.5)
    raise ClearwayError(
        f"no scenario of {', '.join(map(repr, plan.suites))} that is selected has the name {missing[0]!r}"
        + (f"; did you mean {close[0]!r}?" if close else ""),
        field="scenarios",
    )


def granted_map(plan: str | None, scenario: Scenario) -> OccupancyGrid | None:
    """The map that a task grants: the campaign's own, or the floor plan's; None where none is known.

    Args:
        plan: The campaign's `map`: the path of a ROS map, `true` or None for the floor plan's.
        scenario: The test.

    Raises:
        ClearwayError: a file is missing or wrong.
    """
    from clearway.scenarios.floorplan import load_floor_plan

    if plan in (None, "true"):
        return load_floor_plan(scenario.floor_plan).map
    return _read_map(str(plan)) if load_floor_plan(scenario.floor_plan).map is not None else None


@cache
def _read_map(path: str) -> OccupancyGrid:
    from clearway.geometry.ros_map import read_map

    return read_map(Path(path)).read_only()


def _usual_robots(suites: tuple[str, ...]) -> tuple[str, ...]:
    usual = tuple(dict.fromkeys(robot for suite in suites for robot in load_suite(suite).robots))
    if not usual:
        raise ClearwayError(f"say which robot is to drive the suite {suites[0]!r}", field="robots")
    return usual

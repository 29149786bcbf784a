"""What a campaign is asked to do, and the list of trials that follows from it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from clearway.campaigns.mistaken import refuse_mistaken
from clearway.campaigns.thinking_budget import read_thinking_budget
from clearway.campaigns.trial_list import TrialList, TrialSpec
from clearway.errors import ClearwayError, shown, unknown
from clearway.geometry.grid import OccupancyGrid
from clearway.reading.limits import LONGEST_NAME, SECONDS
from clearway.robots import load_robot, robot_names
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.selecting import text
from clearway.scenarios.suite import LEARNING_DRAWS, LEARNING_SEEDS, refuse_many
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials.keeping import KEEPS, Keep

__all__ = ["CampaignPlan", "TrialList", "TrialSpec", "granted_map", "refuse_namesakes"]


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
        for name in ("localisation", "tracking", "map", "keep"):
            text(getattr(self, name), name)
        if self.keep not in KEEPS:
            raise unknown("what is to be kept", str(self.keep), KEEPS, field="keep")
        limit = self.decision_limit
        if limit is not None and not 0.0 < limit <= SECONDS:
            raise ClearwayError(
                f"{limit:g} s is no limit on a decision; more than 0 and at most {SECONDS:g} s are",
                field="decision_limit",
            )
        if (seeds := self.selection.seeds) is not None:
            refuse_many(seeds[1] - seeds[0], ", ".join(self.suites))
            if seeds[1] > LEARNING_DRAWS[0]:
                raise ClearwayError(
                    f"'{seeds[0]}:{seeds[1]}' reaches beyond 2^31, where the seeds are that learners meet",
                    field="seeds",
                )
        whole = isinstance(self.seed, Integral) and not isinstance(self.seed, bool)
        if not whole or not 0 <= self.seed < LEARNING_SEEDS[0]:
            raise ClearwayError(
                f"{shown(self.seed)} is no seed; 0 to 2^62 - 1 are, above are those of learners", field="seed"
            )
        object.__setattr__(self, "seed", int(self.seed))  # NumPy's can't be written down
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

    def trials(self, sizes: Any = None) -> TrialList:
        """Every trial, in the order of the results, made when it is asked for.

        Args:
            sizes: What `TrialList.sizes` was of the same plan; None: not known.

        Raises:
            ClearwayError: an unknown suite, robot or scenario, or a selection that selects nothing.
        """
        refuse_namesakes(dict.fromkeys((*self.robots, *self.selection.team)))
        return TrialList(self, sizes)

    def specs(self) -> list[TrialSpec]:
        """Every trial, in the order of the results; of scenarios that are drawn from seeds their outlines.

        Raises:
            ClearwayError: as for `trials`.
        """
        return list(self.trials())


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

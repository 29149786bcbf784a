"""Everything that can be wrong with a campaign, looked at before its first trial runs."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from clearway.campaigns.by_robot import navigator_of
from clearway.campaigns.drawing import drawn
from clearway.campaigns.pilot import dismiss, prepare_limit
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map, refuse_namesakes
from clearway.campaigns.pool import Fate, Pool
from clearway.campaigns.provenance import code_of
from clearway.campaigns.robot_tables import in_file_of, unread_tables
from clearway.campaigns.tuning import tuned_on
from clearway.contract import Navigator
from clearway.errors import ClearwayError, unknown
from clearway.geometry.grid import OCCUPIED, OccupancyGrid
from clearway.imports import refuse_clashes
from clearway.navigators.registry import (
    check_drive,
    check_parameters,
    make_navigator,
    navigator_class,
    navigator_names,
    needs_of,
    split_options,
    wants_of,
)
from clearway.perception import make_localiser, make_tracker
from clearway.robots import Robot, load_robot
from clearway.scenarios.behaviours import find_behaviour
from clearway.scenarios.check import check_scenario
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import beyond_reach
from clearway.tuning import TunedOn

ALL = "all"
"""As a navigator's name: each registered one that is `able`."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a navigator once it was made.

    Attributes:
        code: The digest of its code and of the files that its options name, None of Clearway's own without such files.
        tuned_on: On what it says that its parameters were chosen; None if it says nothing.
        needs: What its observations must hold.
        privileged: Whether it is a reference, which may know what others can't.
        alone: What it drives by that two robots can't share; empty: nothing.
    """

    code: str | None
    tuned_on: tuple[TunedOn, ...] | None
    needs: frozenset[str]
    privileged: bool
    alone: str


def check_plan(plan: CampaignPlan, specs: Iterable[TrialSpec], work: Pool | None = None) -> dict[str, Known]:
    """Look at everything that can be wrong before the first trial runs; of scenarios that are drawn, at the first of a kind.

    Args:
        plan: The campaign.
        specs: Its trials.
        work: Where navigators are made to see whether they can be; None: in this process.

    Returns:
        What each navigator is known by.

    Raises:
        ClearwayError: the first thing that is wrong.
    """
    seen: set[tuple[str, str, str, bool, frozenset[str]]] = set()
    has_map: dict[bytes, bool] = {}
    driven, driving, together = dict[str, None](), dict[str, None](), dict[tuple[str, ...], None]()
    calls: list[tuple[CampaignPlan, TrialSpec, bool]] = []
    for spec in specs:
        scenario = spec.scenario
        said = f"{spec.robot}\n{scenario.model_dump_json(exclude={'name', 'seed', 'labels'})}"  # repetitions are alike
        if (content := hashlib.sha256(said.encode()).digest()) not in has_map:
            for problem in check_scenario(drawn(plan, spec).scenario, load_robot(spec.robot)):
                file = spec.suite if spec.suite.endswith(".toml") else problem.file
                raise ClearwayError(problem.problem, file=file, field=f"{scenario.name}: {problem.field}")
            granted = granted_map(plan.map, scenario)
            if granted is not None and plan.map not in (None, "true"):
                _refuse_another_place(str(plan.map), granted, scenario)
            has_map[content] = granted is not None
        driven |= dict.fromkeys(spec.robots)
        driving |= dict.fromkeys(spec.navigators)
        together[tuple(spec.navigators)] = None
        for which, navigator in zip(spec.robots, spec.navigators, strict=True):
            people = frozenset(person.behaviour for person in scenario.people)
            combination = (which, navigator, spec.localisation, has_map[content], people)
            if combination not in seen:
                seen.add(combination)
                calls.append((plan, replace(spec, robot=which, navigator=navigator), has_map[content]))
    refuse_namesakes(driven, twice=True)
    for name in plan.options:
        if name not in driving:
            raise unknown("navigator", name, driving, field="options")
    behaviours = (person.behaviour for _, spec, _ in calls for person in spec.scenario.people)
    refuse_clashes(dict.fromkeys([*(split_options(name)[0] for name in driving), *behaviours]))
    limit = prepare_limit(plan.decision_limit)
    work = work or Pool(0, Path())
    found = dict(work.each(_check_combination, calls, patience=limit, fallen=_cannot_be_made))
    for names in together:
        _refuse_sharing([(name, found[name].alone) for name in names if found[name].alone], work.workers)
    return {name: found[name] for name in driving}


def able(plan: CampaignPlan, among: Iterable[str] = ()) -> tuple[tuple[str, ...], dict[str, str]]:
    """Of navigators those that can drive a campaign's trials, and why the others can't.

    Args:
        plan: The campaign, whoever its navigators are.
        among: Who is asked about, by name or by robot; empty: all registered ones, of which those that are told the future are not
            among the able, as nobody could buy one.

    Raises:
        ClearwayError: it is wrong whoever drives.
    """
    kinds: dict[tuple[str, str, bool], tuple[TrialSpec, bool]] = {}
    for spec in plan.specs():
        has_map = granted_map(plan.map, spec.scenario) is not None
        for robot in spec.robots:
            kinds.setdefault((robot, spec.localisation, has_map), (replace(spec, robot=robot), has_map))
    named, why = tuple(dict.fromkeys(among)), dict[str, str]()
    asked = named or tuple(navigator_names())
    for name in asked:
        try:
            known = [
                _check_combination(plan, replace(spec, navigator=navigator_of(name, spec.robot)), has)[1]
                for spec, has in kinds.values()
            ]
        except ClearwayError as error:
            why[name] = error.problem
            continue
        if not named and any(one.privileged for one in known):
            why[name] = "it is told the future"
    return tuple(name for name in asked if name not in why), why


def too_fast(specs: Iterable[TrialSpec]) -> list[str]:
    """A sentence for each robot that can't drive the set speed of some of its trials."""
    speeds: dict[str, set[float]] = {}
    for spec in specs:
        speeds.setdefault(spec.robots[spec.member], set()).add(spec.scenario.speed)
    robots = {which: load_robot(which) for which in speeds}
    said = (beyond_reach(speeds[which], robot.title, robot.drive.v_max) for which, robot in robots.items())
    return [sentence for sentence in said if sentence]


def _refuse_another_place(file: str, known: OccupancyGrid, scenario: Scenario) -> None:
    """Refuse a map that knows of no floor where a robot starts, or is to go to."""
    for robot in scenario.members():
        places = {"the start": robot.start} | {f"the goal of leg {leg.name!r}": leg.goal for leg in robot.legs}
        for place, pose in places.items():
            cell = tuple(math.floor((pose[k] - known.origin[k]) / known.resolution) for k in (1, 0))
            inside = all(0 <= c < n for c, n in zip(cell, known.data.shape, strict=True))
            if not inside or known.data[cell] == OCCUPIED:
                raise ClearwayError(
                    f"{place} of the scenario {scenario.name!r}, ({pose[0]:g}, {pose[1]:g}), is {'in a wall of' if inside else 'outside'} "
                    "this map: it is to be of the floor plan that the trials run on, in the same frame",
                    file=file,
                )


def _refuse_sharing(drivers: list[tuple[str, str]], workers: int) -> None:
    """Refuse that two robots drive at once by the same; `drivers` are a simulation's navigators that have something for themselves, and what."""
    taken: dict[str, str] = {}
    for name, alone in drivers:
        if alone in taken:
            raise ClearwayError(
                f"navigator {name!r} drives by {alone}, and so does {taken[alone]!r}, which would drive another robot at the same time; "
                "give each robot its own"
            )
        taken[alone] = name
        if workers > 1:
            raise ClearwayError(
                f"{workers} robots would drive at once, and navigator {name!r} drives one, by {alone}; say 1",
                field="workers",
            )


def _cannot_be_made(fate: Fate, plan: CampaignPlan, spec: TrialSpec, has_map: bool) -> tuple[str, Known]:
    why = " ".join(str(fate).split())  # what it raised may have lines
    raise ClearwayError(f"navigator {spec.navigator!r} cannot be made: the process in which it was tried {why}")


def _check_combination(plan: CampaignPlan, spec: TrialSpec, has_map: bool) -> tuple[str, Known]:
    """Whether the robot, with what it is told, can do what its navigator and its localiser take; the navigator's code."""
    robot = load_robot(spec.robot)
    for person in spec.scenario.people:
        find_behaviour(person.behaviour)
    navigator = make_navigator(spec.navigator, **plan.options.get(spec.navigator, {}))
    try:
        return spec.navigator, _checked(plan, spec, robot, navigator, has_map)
    finally:
        dismiss(navigator, plan.decision_limit)


def _checked(plan: CampaignPlan, spec: TrialSpec, robot: Robot, navigator: Navigator, has_map: bool) -> Known:
    needs = needs_of(spec.navigator, navigator)
    wants_of(spec.navigator, navigator)
    check_drive(spec.navigator, navigator, robot)
    with in_file_of(spec.robot, robot):
        for problem in unread_tables(robot):
            raise problem
        make_localiser(spec.localisation, robot)
        check_parameters(spec.navigator, navigator, robot, mapped=has_map)
    tests = tuned_on(spec.navigator, navigator)
    if "obstacles" in needs:
        make_tracker(spec.tracking, robot)
    if "scan" in needs and robot.lidar is None:
        raise ClearwayError(f"navigator {spec.navigator!r} needs scans, and the robot {spec.robot!r} has no lidar")
    if spec.localisation == "amcl" and (robot.lidar is None or not has_map):
        lacks = (
            f"the robot {spec.robot!r} has no lidar"
            if robot.lidar is None
            else f"{spec.scenario.floor_plan!r} has no map"
        )
        raise ClearwayError(f"localisation 'amcl' cannot work: {lacks}; use 'odometry' or 'truth'")
    slowest: float = getattr(navigator, "slowest", 0.0)
    if plan.decision_limit is not None and slowest >= plan.decision_limit:
        raise ClearwayError(
            f"{plan.decision_limit:g} s are no longer than navigator {spec.navigator!r} may take for a decision, {slowest:g} s; "
            f"allow {math.ceil(slowest) + 1} s, or have it be less patient",
            field="decision_limit",
        )
    privileged = getattr(navigator_class(spec.navigator), "privileged", False) is True
    alone: str = getattr(navigator, "alone", "")
    return Known(code_of(spec.navigator, plan.options.get(spec.navigator, {})), tests, needs, privileged, alone)

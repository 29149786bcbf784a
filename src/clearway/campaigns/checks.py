"""Everything that can be wrong with what a user has or names, looked at from every room."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from clearway.campaigns.conformance import check_navigator
from clearway.campaigns.pilot import DECISION_LIMIT, dismiss, guarded, prepare_limit
from clearway.campaigns.plan import refuse_namesakes
from clearway.campaigns.provenance import code_of
from clearway.campaigns.robot_tables import table_problems
from clearway.errors import ClearwayError, nearest, shown
from clearway.foreign import said
from clearway.geometry.ros_map import about_map
from clearway.navigators.registry import (
    NAVIGATORS,
    check_drive,
    check_parameters,
    make_navigator,
    navigator_class,
    navigator_names,
    split_options,
)
from clearway.reading import read_toml
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.test_plan import is_test_plan
from clearway.registry import in_a_line
from clearway.robots import Robot, load_robot, robot_names
from clearway.scenarios import check
from clearway.scenarios.behaviours import find_behaviour
from clearway.scenarios.check import check_plan
from clearway.scenarios.files import SuiteSpec, kind_of, load_suite_file, scenarios_in
from clearway.scenarios.floor_plan_files import floor_plan_names
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Suite
from clearway.scenarios.suites import Selection, load_suite, suite_names
from clearway.statistics.criteria import criteria_problems, is_criteria

ROBOT = "tiago"
"""Who drives, unless somebody or the suite says otherwise."""

Said = tuple[bool | None, str]
"""Whether something is as it should be, None if that could not be tested; and what, for people."""


def findings(target: str, robot: str | None = None, decision_limit: float | None = DECISION_LIMIT) -> Iterator[Said]:
    """What is right and wrong with something, each as soon as it is known.

    Args:
        target: A file; a robot (with a preset, if wanted) or a floor plan by name; a suite or a navigator by name or address.
        robot: Who drives; None: the suite's usual robots, or `tiago`.
        decision_limit: Wall clock after which a navigator's decision counts as hung, s; None: never.

    Raises:
        ClearwayError: there is no such thing.
    """
    driver = load_robot(robot or ROBOT)
    path = Path(target)
    if NAVIGATORS.scheme_of(target) is not None:
        yield from _navigator(target, driver, decision_limit)
    elif path.suffix in (".toml", ".yaml", ".yml"):
        own = _usual_robots(path) if robot is None else []
        wrong = [e for e in own if isinstance(e, ClearwayError)]
        drivers = [r for r in own if isinstance(r, Robot)] or [driver]
        told = dict.fromkeys(map(str, wrong + [e for d in drivers for e in check_file(path, d)]))
        yield from ((False, problem) for problem in told)
        yield from ((True, text) for text in about_file(path))
    elif target.partition(":")[0] in robot_names():
        yield from ((False, str(problem)) for problem in table_problems(load_robot(target)))
        yield True, f"the robot {load_robot(target).title!r} is read"
    elif target in suite_names() or _is_suite_at(target):
        yield from _suite(target, robot)
    elif target in floor_plan_names():
        yield from ((False, str(problem)) for problem in check_plan(load_floor_plan(target), driver))
        yield True, f"the floor plan {load_floor_plan(target).title!r} is read"
    elif ":" not in target and os.path.isfile(target) and not target.endswith(".py"):
        raise ClearwayError("is no TOML file; into recordings looks `clearway import --list`", file=target)
    else:
        if ":" not in target and not target.endswith(".py") and split_options(target)[0] not in navigator_names():
            raise _nothing_of(target)
        yield from _navigator(target, driver, decision_limit)


def _navigator(name: str, robot: Robot, decision_limit: float | None) -> Iterator[Said]:
    """What is said of a navigator; first by who makes it, if that has `findings()` of its own."""
    if (own := getattr(navigator_class(name), "findings", None)) is not None:
        yield from own()
    try:
        code_of(name)
    except ClearwayError as error:
        yield False, str(error)
    for f in check_navigator(lambda: make_navigator(name), robot, name=name, decision_limit=decision_limit):
        text = str(ClearwayError(f.detail, field=f.name)) if f.passed is False else f"{f.name}: {f.detail}"
        yield f.passed, text if f.detail else f.name


def _is_suite_at(target: str) -> bool:
    """Whether `target` is the address of a suite that is written in Python."""
    where = split_options(target)[0]
    return ":" in where and isinstance(NAVIGATORS.find(where), Suite)


def _suite(name: str, robot: str | None) -> Iterator[Said]:
    """Each scenario of a suite, repetitions once, with each of its robots, and what they name."""
    suite, named = load_suite(name), dict[str, None]()
    for driver in map(load_robot, (robot,) if robot else suite.robots or (ROBOT,)):
        try:
            scenarios = suite.build(driver, Selection(), 0)
        except ClearwayError:
            raise
        except Exception as error:  # a user's own `make`
            yield False, str(ClearwayError(f"its scenarios cannot be made: {in_a_line(error)}", file=name))
            continue
        named |= dict.fromkeys(str(problem) for problem in _code_problems(scenarios, name, driver))
        kinds = {s.model_dump_json(exclude={"name", "seed", "labels"}): s for s in scenarios}
        wrong = False
        for scenario in kinds.values():
            for e in check.check_scenario(scenario, driver):
                wrong = True
                yield False, str(ClearwayError(e.problem, file=name, field=f"{scenario.name}: {e.field}"))
        if not wrong:
            yield True, f"{driver.name}: {len(scenarios)} scenarios, {len(kinds)} without repetitions"
    yield from ((False, problem) for problem in named)


def _usual_robots(path: Path) -> list[Robot | ClearwayError]:
    """The robots that a suite's file names, or what is wrong with them; none where it is no such file, or a wrong one, as `check_file` says."""
    try:
        names = load_suite_file(path).robots if path.suffix == ".toml" and kind_of(read_toml(path)) is SuiteSpec else ()
    except ClearwayError:
        return []
    found = list[Robot | ClearwayError]()
    for i, name in enumerate(names):
        try:
            found.append(load_robot(name))
        except ClearwayError as error:
            found.append(ClearwayError(str(error), file=path, field=f"robots.{i}"))
    return found


def _nothing_of(target: str) -> ClearwayError:
    kinds = {"navigator": navigator_names(), "robot": robot_names(), "suite": suite_names(), "plan": floor_plan_names()}
    every = {name: kind for kind, names in kinds.items() for name in names}
    close = nearest(target, every)
    hint = f"did you mean the {every[close]} {close!r}? " if close else ""
    return ClearwayError(
        f"there is no file, robot, suite, floor plan or navigator {shown(target)}; {hint}`clearway list` shows what there is"
    )


def check_file(path: Path, robot: Robot) -> list[ClearwayError]:
    """What is wrong with a scenario, suite, robot, floor plan, test plan, map or criteria file.

    A robot's file is also read as its navigators, localisers and mapper would, with each of its presets; of a test plan
    its recordings are looked at.

    Args:
        path: The file.
        robot: Who would drive the scenarios.
    """
    if _is_plan(path):
        return problems_of(path)
    if _holds(path, is_criteria):
        return criteria_problems(path)
    found = check.check_file(path, robot)
    if found or path.suffix != ".toml":
        return found
    if (kind := kind_of(read_toml(path))) is not Robot:
        return list(_code_problems(scenarios_in(path), path, robot)) if kind in (Scenario, SuiteSpec) else []
    told: dict[tuple[str | None, str], ClearwayError] = {}
    try:
        refuse_namesakes([str(path)])
    except ClearwayError as error:
        told[(error.field, error.problem)] = error
    for preset in ("", *load_robot(str(path)).presets):
        where, before = (f"{path}:{preset}", f"presets.{preset}.") if preset else (str(path), "")
        for e in table_problems(load_robot(where)):
            told.setdefault(
                (e.field, e.problem),
                ClearwayError(e.problem, file=path, field=f"{before}{e.field or ''}".rstrip(".") or None),
            )
    return list(told.values())


def _code_problems(scenarios: Iterable[Scenario], file: str | Path, robot: Robot) -> Iterator[ClearwayError]:
    """What scenarios name and nobody has, or can't be used: behaviours of their people, navigators of their other robots."""
    named: dict[tuple[str | None, ...], tuple[str, Callable[[], object]]] = {}
    for scenario in scenarios:
        for i, person in enumerate(scenario.people):
            found = partial(find_behaviour, person.behaviour)
            named.setdefault((person.behaviour,), (f"people.{i}.behaviour", found))
        for i, other in enumerate(scenario.robots):
            if other.navigator is not None:
                driven = partial(_drives, other.navigator, other.robot, robot)
                named.setdefault((other.navigator, other.robot), (f"robots.{i}.navigator", driven))
    for field, look in named.values():
        try:
            guarded(prepare_limit(DECISION_LIMIT), "to be made", look)
        except Exception as error:
            yield ClearwayError(str(error) if isinstance(error, ClearwayError) else said(error), file=file, field=field)


def _drives(navigator: str, which: str | None, tested: Robot) -> None:
    """See that `navigator` can be made and can drive the robot `which` of a scenario, where that is None one like the tested robot.

    Raises:
        ClearwayError: it can't, or doesn't.
    """
    driver, robot = make_navigator(navigator), load_robot(which) if which else tested
    try:
        check_drive(navigator, driver, robot)
        check_parameters(navigator, driver, robot)
    finally:
        dismiss(driver, DECISION_LIMIT)


def about_file(path: Path) -> list[str]:
    """What a file is about, where that is worth saying beside its problems: how far a test plan is done, where a map lies."""
    if path.suffix in (".yaml", ".yml"):
        try:
            return about_map(path)
        except ClearwayError:
            return []
    return summary(path) if _is_plan(path) else []


def _is_plan(path: Path) -> bool:
    return _holds(path, is_test_plan)


def _holds(path: Path, kind: Callable[[dict[str, Any]], bool]) -> bool:
    try:
        return path.suffix == ".toml" and kind(read_toml(path))
    except ClearwayError:
        return False

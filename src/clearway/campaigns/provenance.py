"""What a campaign's results say of where they come from: what was asked, with which versions, on which machine."""

from __future__ import annotations

import dataclasses
import datetime
import json
import os
import platform
from collections.abc import Mapping, Sequence
from typing import Any

from clearway.campaigns import source
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.geometry.grid import OccupancyGrid
from clearway.given import given
from clearway.indicators import INDICATORS
from clearway.navigators.registry import files_of, navigator_class, split_options
from clearway.robots import load_robot, robot_names
from clearway.scenarios.behaviours import BEHAVIOURS
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import RobotBodySpec
from clearway.scenarios.suites import load_suite
from clearway.versions import version_of


def asked_of_plan(
    plan: CampaignPlan, specs: Sequence[TrialSpec], code: Mapping[str, str | None] | None = None
) -> dict[str, Any]:
    """What campaign.json holds of a simulated campaign, and resuming and rerunning compare: all that decides the bits.

    Robots are there in full, by the names that they bear; of each task (a scenario, and the robot that it was made for), of
    each floor plan, of the map and of code there is a digest. Where scenarios are drawn from seeds, a task's digest is that of
    its outline, whose name has the seed: what is drawn follows from it and the generator's code.

    Args:
        plan: The campaign.
        specs: Its trials.
        code: `code_of` each navigator, where that is known; None: to be found here.
    """
    others = (name for spec in specs if spec.scenario.robots for name in spec.robots)
    known = {robot.name: robot for robot in map(load_robot, dict.fromkeys([*plan.robots, *others]))}
    robots = {name: json.loads(robot.model_dump_json()) for name, robot in known.items()}  # JSON knows no infinity
    floors = dict.fromkeys(spec.scenario.floor_plan for spec in specs)
    tasks = {spec.task: spec.scenario.model_dump_json() for spec in specs}
    driving = dict.fromkeys(name for spec in specs for name in spec.navigators)
    code = {name: code_of(name, plan.options.get(name, {})) for name in driving} if code is None else dict(code)
    people = dict.fromkeys(person.behaviour for spec in specs for person in spec.scenario.people)
    code |= {f"behaviour {n}": source.of_object(BEHAVIOURS.find(n)) for n in people if n not in BEHAVIOURS.shipped}
    if plan.selection.seeds is not None:
        code |= {
            f"suite {name}": source.of_object(g.draw)
            for name in plan.suites
            if (g := load_suite(name).generator) is not None
        }
    own = () if plan.map in (None, "true") else (granted_map(plan.map, spec.scenario) for spec in specs)
    grid = next((grid for grid in own if grid is not None), None)
    suites = {load_suite(name).name: _about(name, specs) for name in plan.suites}
    return asked_of(robots, suites, code) | {
        "plan": json.loads(json.dumps(plan.to_json())),
        "map": None if grid is None else _grid(grid),
        "floor_plans": {name: _floor(load_floor_plan(name)) for name in sorted(floors)},
        "bodies": {name: source.digest(load_robot(name).model_dump_json()) for name in sorted(_bodies(specs))},
        "tasks": {task: source.digest(scenario) for task, scenario in tasks.items()},
    }


def code_of(navigator: str, options: Mapping[str, Any] | None = None) -> str | None:
    """A digest of the code of a navigator that is not Clearway's, and of its user's files; None: of one without either.

    Args:
        navigator: Its name, with its options or without.
        options: What else its constructor is given.

    Raises:
        ClearwayError: it cannot say which files, or one can't be read.
    """
    name, options = split_options(navigator)[0], split_options(navigator)[1] | dict(options or {})
    handed = given(name)
    made = navigator_class(navigator) if handed is None else handed.thing
    code = source.of_object(made) if handed is None else handed.code
    if not (paths := files_of(navigator, made, options)):
        return code
    return " ".join(filter(None, (code, source.of_files(paths))))


def _bodies(specs: Sequence[TrialSpec]) -> set[str]:
    """The robots of others, as files, whose bodies obstacles have."""
    shapes = (obstacle.shape for spec in specs for obstacle in spec.scenario.obstacles)
    return {shape.robot for shape in shapes if isinstance(shape, RobotBodySpec)} - set(robot_names())


def _about(name: str, specs: Sequence[TrialSpec]) -> dict[str, Any]:
    """A suite, and what its scenarios gave the robot: whether a map, and how the ground moved it."""
    scenarios = [spec.scenario for spec in specs if spec.suite == name]
    pushes = {s.disturbance for s in scenarios if s.disturbance is not None}
    return load_suite(name).about() | {
        "map": any(load_floor_plan(plan).map is not None for plan in dict.fromkeys(s.floor_plan for s in scenarios)),
        "disturbances": sorted((push.model_dump() for push in pushes), key=lambda push: tuple(push.values())),
    }


def asked_of(
    robots: Mapping[str, Any], suites: Mapping[str, Any], code: Mapping[str, str | None] | None = None
) -> dict[str, Any]:
    """What every campaign.json holds, of simulations and of recordings.

    Args:
        robots: In full.
        suites: What a report has to know of them.
        code: A digest of the code of each navigator that is not Clearway's; None: of one that is.
    """
    others = {f"indicator {name}": source.of_object(indicator.function) for name, indicator in INDICATORS.items()}
    found = {"clearway": source.of_clearway()} | {n: d for n, d in (others | dict(code or {})).items() if d is not None}
    about = {"clearway": version_of("clearway"), "versions": versions(), "code": found}
    return about | {"robots": dict(robots), "suites": dict(suites)}


def versions() -> dict[str, str]:
    """The versions of Python and of the packages on which the bits may depend."""
    return {"python": platform.python_version()} | {name: version_of(name) for name in ("numba", "numpy", "scipy")}


def machine() -> dict[str, Any]:
    """The machine that a campaign runs on: stored, never compared."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}


def now() -> str:
    """The time, UTC, to the second."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _floor(plan: FloorPlan) -> str:
    """A digest of what stands in a floor plan and of its map."""
    bodies = [(f.name, f.kind, dataclasses.asdict(f.shape), f.pose.tolist()) for f in plan.fixtures]
    return source.digest(json.dumps([bodies, plan.area]), "" if plan.map is None else _grid(plan.map))


def _grid(grid: OccupancyGrid) -> str:
    return source.digest(json.dumps([grid.resolution, grid.origin, grid.data.shape]), grid.data.tobytes())

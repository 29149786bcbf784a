"""What a campaign's results say of where they come from: what was asked, with which versions, on which machine."""

from __future__ import annotations

import dataclasses
import datetime
import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.geometry.grid import OccupancyGrid
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.suites import load_suite


def asked_of_plan(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> dict[str, Any]:
    """What campaign.json holds of a simulated campaign, and resuming and rerunning compare: all that decides the bits.

    Of each task (a scenario with its floor plan, and the robot that it was made for) it is a digest.
    """
    robots = {name: json.loads(load_robot(name).model_dump_json()) for name in plan.robots}  # JSON knows no infinity
    floors = {name: _floor(load_floor_plan(name)) for name in {spec.scenario.floor_plan for spec in specs}}
    tasks = {spec.task: (spec.scenario.model_dump_json(), floors[spec.scenario.floor_plan]) for spec in specs}
    own = () if plan.map in (None, "true") else (granted_map(plan.map, spec.scenario) for spec in specs)
    grid = next((grid for grid in own if grid is not None), None)
    suites = {load_suite(name).name: _about(name, specs) for name in plan.suites}
    return asked_of(robots, suites) | {
        "plan": json.loads(json.dumps(plan.to_json())),
        "map": None if grid is None else _grid(grid),
        "tasks": {task: _digest(*parts) for task, parts in tasks.items()},
    }


def _about(name: str, specs: Sequence[TrialSpec]) -> dict[str, Any]:
    """A suite, and what its scenarios gave the robot: whether a map, and how the ground moved it."""
    scenarios = [spec.scenario for spec in specs if spec.suite == name]
    pushes = {s.disturbance for s in scenarios if s.disturbance is not None}
    return load_suite(name).about() | {
        "map": any(load_floor_plan(plan).map is not None for plan in dict.fromkeys(s.floor_plan for s in scenarios)),
        "disturbances": sorted((push.model_dump() for push in pushes), key=lambda push: tuple(push.values())),
    }


def asked_of(robots: Mapping[str, Any], suites: Mapping[str, Any]) -> dict[str, Any]:
    """What every campaign.json holds, of simulations and of recordings: versions, the robots in full, and of the suites
    what a report has to know."""
    about = {"clearway": _version("clearway"), "versions": versions()}
    return about | {"robots": dict(robots), "suites": dict(suites)}


def versions() -> dict[str, str]:
    """The versions of Python and of the packages on which the bits may depend."""
    return {"python": platform.python_version()} | {name: _version(name) for name in ("numba", "numpy", "scipy")}


def machine() -> dict[str, Any]:
    """The machine that a campaign runs on: stored, never compared."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}


def now() -> str:
    """The time, UTC, to the second."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _floor(plan: FloorPlan) -> str:
    """A digest of what stands in a floor plan and of its map."""
    bodies = [(f.name, f.kind, dataclasses.asdict(f.shape), f.pose.tolist()) for f in plan.fixtures]
    return _digest(json.dumps([bodies, plan.area]), "" if plan.map is None else _grid(plan.map))


def _grid(grid: OccupancyGrid) -> str:
    return _digest(json.dumps([grid.resolution, grid.origin, grid.data.shape]), grid.data.tobytes())


def _digest(*parts: str | bytes) -> str:
    seen = hashlib.sha256()
    for part in parts:
        seen.update(part.encode("utf-8", "backslashreplace") if isinstance(part, str) else part)
    return seen.hexdigest()[:16]

"""What a campaign's results say of where they come from: what was asked, with which versions, on which machine."""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.robots import load_robot


def asked_of_plan(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> dict[str, Any]:
    """What campaign.json holds of a simulated campaign, and resuming compares: everything that decides the bits."""
    robots = {name: json.loads(load_robot(name).model_dump_json()) for name in plan.robots}  # JSON knows no infinity
    seen = hashlib.sha256()
    for spec in specs:
        seen.update(spec.id.encode("utf-8", "backslashreplace"))
        seen.update(spec.scenario.model_dump_json().encode())
    grid = None if plan.map in (None, "true") else granted_map(plan.map, specs[0].scenario)
    if grid is not None:
        seen.update(grid.data.tobytes())
    return asked_of(robots) | {"plan": json.loads(json.dumps(plan.to_json())), "scenarios": seen.hexdigest()}


def asked_of(robots: Mapping[str, Any]) -> dict[str, Any]:
    """What every campaign.json holds, of simulations and of recordings: versions, and the robots in full."""
    return {"clearway": _version("clearway"), "versions": versions(), "robots": dict(robots)}


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

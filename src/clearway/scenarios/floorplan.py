"""Finds floor plans: those that come with Clearway, those that suites bring, and files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from clearway.errors import ClearwayError, unknown
from clearway.scenarios.floor_plan_files import floor_plan_names, is_path, load_file, load_shipped
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.suites import examples_of_floor_plans, own_floor_plans


def load_floor_plan(which: str) -> FloorPlan:
    """Read a floor plan: one that comes with Clearway or with a suite, by name; the path of a plan's TOML file or of a ROS
    map's yaml.

    Raises:
        ClearwayError: no such plan, or a file or field that is wrong.
    """
    if which in floor_plan_names():
        return load_shipped(which)
    return load_file(Path(which)) if is_path(which) else _of_a_suite(which)


@lru_cache(maxsize=64)
def _of_a_suite(name: str) -> FloorPlan:
    makers = own_floor_plans()
    if name not in makers and Path(name).suffix in (".pgm", ".png"):
        raise ClearwayError("is the image of a map; name the yaml beside it, which says where it lies", file=name)
    if name not in makers:
        raise unknown("floor plan", Path(name).name, [*floor_plan_names(), *examples_of_floor_plans()])
    return makers[name]()

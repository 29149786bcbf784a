"""`clearway list`: what there is."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli._options import Json, tell

if TYPE_CHECKING:
    from clearway.robots import Robot


def list_(
    what: Annotated[
        str, typer.Argument(help="suites, robots, floor-plans, navigators, indicators or formats; all by default.")
    ] = "all",
    as_json: Json = False,
) -> None:
    """List suites, robots, floor plans, navigators, indicators and formats of recordings."""
    from clearway.errors import unknown
    from clearway.indicators import INDICATORS
    from clearway.navigators.registry import drives_of, navigator_class, navigator_names
    from clearway.recordings.formats import formats
    from clearway.robots import load_robot, robot_names
    from clearway.scenarios.floor_plan_files import floor_plan_names
    from clearway.scenarios.floorplan import load_floor_plan
    from clearway.scenarios.suites import load_suite, suite_names

    def _navigator(name: str, made_by: Any) -> dict[str, str]:
        title = (made_by.__doc__ or "").partition("\n")[0]
        return {"title": title, "drives": ", ".join(sorted(drives_of(name, made_by)))}

    tables: dict[str, Callable[[], Mapping[str, Any]]] = {
        "suites": lambda: {n: load_suite(n).title for n in suite_names()},
        "robots": lambda: {n: _robot(load_robot(n)) for n in robot_names()},
        "floor-plans": lambda: {n: load_floor_plan(n).title for n in floor_plan_names()},
        "navigators": lambda: {n: _navigator(n, navigator_class(n)) for n in navigator_names()},
        "indicators": lambda: {n: f"{i.title} [{i.unit}]" if i.unit else i.title for n, i in INDICATORS.items()},
        "formats": lambda: {
            n: f.title + (f" ({', '.join(f.suffixes)})" if f.suffixes else "") for n, f in formats().items()
        },
    }
    if what != "all" and what not in tables:
        raise unknown("list", what, tables)
    chosen = {name: table() for name, table in tables.items() if what in ("all", name)}
    if as_json:
        tell(chosen, indent=2)
        return
    for kind, rows in chosen.items():
        typer.echo(kind)
        lines = [(name, *(about.values() if isinstance(about, dict) else (about,))) for name, about in rows.items()]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        for line in lines:
            typer.echo("  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(line, widths, strict=True)).rstrip())


def _robot(robot: Robot) -> dict[str, str]:
    """What is told of a robot: its title, its drive, the length and width of what touches, its lidar."""
    from clearway.geometry.shapes import Circle

    shape, lidar = robot.shape, robot.lidar
    if isinstance(shape, Circle):
        size = f"{2 * shape.radius:.2f} m round"
    else:
        length, width = (max(along) - min(along) for along in zip(*shape.vertices, strict=True))
        size = f"{length:.2f} x {width:.2f} m"
    if lidar is None:
        seen = "no lidar"
    else:
        span = math.degrees(lidar.angle_max - lidar.angle_min)
        around = span * lidar.beams > 359.9 * (lidar.beams - 1)  # the last beam is a step short of the first
        seen = f"lidar of {360.0 if around else span:.0f} degrees, {lidar.beams} beams, {lidar.range_max:g} m"
    return {"title": robot.title, "drive": robot.limits().kind, "size": size, "lidar": seen}

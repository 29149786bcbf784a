"""`clearway list`: what there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def list_(
    what: Annotated[
        str, typer.Argument(help="suites, robots, floor-plans, navigators, indicators or formats; all by default.")
    ] = "all",
    as_json: Json = False,
) -> None:
    """List suites, robots, floor plans, navigators, indicators and formats of recordings."""
    from clearway.errors import unknown
    from clearway.indicators import INDICATORS
    from clearway.navigators.registry import navigator_class, navigator_names
    from clearway.recordings.formats import formats
    from clearway.robots import load_robot, robot_names
    from clearway.scenarios.floor_plan_files import floor_plan_names
    from clearway.scenarios.floorplan import load_floor_plan
    from clearway.scenarios.suites import load_suite, suite_names

    tables: dict[str, Callable[[], dict[str, str]]] = {
        "suites": lambda: {n: load_suite(n).title for n in suite_names()},
        "robots": lambda: {n: load_robot(n).title for n in robot_names()},
        "floor-plans": lambda: {n: load_floor_plan(n).title for n in floor_plan_names()},
        "navigators": lambda: {n: (navigator_class(n).__doc__ or "").partition("\n")[0] for n in navigator_names()},
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
        width = max(map(len, rows), default=0)
        for name, title in rows.items():
            typer.echo(f"  {name:<{width}}  {title}".rstrip())

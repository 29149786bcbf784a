"""`clearway run`: run suites and report on them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json


def run(
    suites: Annotated[list[str] | None, typer.Argument(help="Suites: names, or TOML files of your own.")] = None,
    robots: Annotated[list[str] | None, typer.Option("--robot", "-r", help="Robot; repeat for several.")] = None,
    navigators: Annotated[
        list[str] | None, typer.Option("--navigator", "-n", help="Navigator: name or my_pkg:MyNavigator; repeatable.")
    ] = None,
    batches: Annotated[list[str] | None, typer.Option("--batch", help="Only these batches.")] = None,
    configurations: Annotated[
        list[str] | None, typer.Option("--configuration", help="Only these configurations.")
    ] = None,
    speeds: Annotated[list[float] | None, typer.Option("--speed", help="Only these set speeds, m/s.")] = None,
    obstacle_speeds: Annotated[
        list[float] | None, typer.Option("--obstacle-speed", help="Only these speeds of the moving obstacle, m/s.")
    ] = None,
    sizes: Annotated[list[float] | None, typer.Option("--size", help="Only these obstacle edges, m.")] = None,
    gaps: Annotated[list[float] | None, typer.Option("--gap", help="Only these gaps, in multiples of d_base.")] = None,
    worlds: Annotated[list[int] | None, typer.Option("--worlds", help="Only these worlds (barn).")] = None,
    official: Annotated[
        bool, typer.Option("--official", help="BARN's official set: 50 worlds, ten runs each.")
    ] = False,
    repetitions: Annotated[int | None, typer.Option(min=1, help="Repetitions of each configuration.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the whole campaign.")] = 0,
    plan: Annotated[str | None, typer.Option(help="Another floor plan for the suite, such as ward.")] = None,
    localisation: Annotated[str | None, typer.Option(help="truth, odometry or amcl; default: the scenario's.")] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", help="A map that the robot built (map.yaml) instead of the true one.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; default: one a core.")] = None,
    out: Annotated[Path | None, typer.Option(help="Results directory; default: results/NAME.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Complete a campaign that was interrupted.")] = False,
    no_report: Annotated[bool, typer.Option("--no-report", help="Only the results, no page.")] = False,
    as_json: Json = False,
) -> None:
    """Run suites with robots and navigators, score every trial, and write the report."""
    raise NotImplementedError

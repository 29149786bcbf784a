"""`clearway break`: search for the smallest scenario that breaks a navigator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli import _options
from clearway.cli._options import Json, tell


def break_(
    suite: Annotated[
        str,
        typer.Argument(
            help="A suite by name, or a TOML file: of a scenario with a table [family] what that says varies, of any other"
            " everything continuous.",
            autocompletion=_options.suites_beginning,
        ),
    ],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", "-r", help="Robot; default: the suite's first.", autocompletion=_options.robots_beginning
        ),
    ] = None,
    navigator: Annotated[
        str,
        typer.Option("--navigator", "-n", help="Navigator.", autocompletion=_options.navigators_beginning),
    ] = "move-base",
    guarantee: Annotated[
        str | None, typer.Option(help="Mode of a navigator that has several: passive, evasive, none.")
    ] = None,
    failure: Annotated[
        str,
        typer.Option(
            "--failure",
            "-f",
            help="What counts as a break: 'contact while moving', contact, timeout, livelock, or an indicator beyond a limit"
            " as 'MDO<0.1'.",
        ),
    ] = "contact while moving",
    trials: Annotated[int, typer.Option(min=1, help="Trials at most, without those of shrinking.")] = 500,
    breaks: Annotated[int, typer.Option(min=1, help="Different breaks that are enough.")] = 3,
    method: Annotated[
        str | None,
        typer.Option(
            help="screen (what looks hardest before any trial), gp (a Gaussian process over margins), or random;"
            " default: screen for a contact, else gp."
        ),
    ] = None,
    no_shrink: Annotated[bool, typer.Option("--no-shrink", help="Leave breaks as they are found.")] = False,
    rarity: Annotated[
        int,
        typer.Option(
            min=0,
            help="At most how many trials more may tell how rare a break is, with an interval; 0: none. 10000 suffice down to 1e-5.",
        ),
    ] = 0,
    batches: _options.Batches = None,
    configurations: _options.Configurations = None,
    speeds: _options.Speeds = None,
    scenarios: Annotated[list[str] | None, typer.Option("--scenario", help="Only these scenarios, by name.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Of the search.")] = 0,
    localisation: Annotated[str | None, typer.Option(help="truth, odometry or amcl; default: the scenario's.")] = None,
    tracking: Annotated[str | None, typer.Option(help="difference or kalman; default: the scenario's.")] = None,
    workers: Annotated[int | None, typer.Option(min=0, max=1024, help="Processes; default: one a core.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for what is found; default: results/break-SUITE.")] = None,
    no_report: Annotated[bool, typer.Option("--no-report", help="No page with replays of the breaks.")] = False,
    as_json: Json = False,
) -> None:
    """Search for the smallest scenarios in which a navigator fails, and write each as a file that `run` replays."""
    from clearway import api
    from clearway.cli._progress import Progress, stoppable, written

    with stoppable("what was tried is lost; the same command begins again"), Progress("trials") as progress:
        found = api.find_breaks(
            suite,
            robot=robot,
            navigator=navigator,
            guarantee=guarantee,
            failure=failure,
            trials=trials,
            breaks=breaks,
            method=method,
            shrink=not no_shrink,
            rarity=rarity,
            batches=batches or (),
            configurations=configurations or (),
            speeds=speeds or (),
            scenarios=scenarios or (),
            seed=seed,
            localisation=localisation,
            tracking=tracking,
            workers=workers,
            out=out,
            progress=progress,
        )
    page = None if no_report or found.results is None else written(api.open_results(found.results.path))
    if as_json:
        tell(found.to_json() | {"path": str(found.path), "report": page and str(page)})
    else:
        typer.echo(str(found))
        if page is not None:
            typer.echo(f"report: {page}")
    if found.failed:
        typer.echo(
            f"in {found.failed} of {found.trials} trials the navigator itself, or a behaviour of the scenario's people, failed; see search.csv",
            err=True,
        )
    if found.breaks or found.failed:
        raise typer.Exit(1)

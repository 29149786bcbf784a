"""`clearway protocol`: what to do in the lab, as a test plan to fill in and a run sheet to print."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli import _options


def protocol(
    suite: Annotated[
        str,
        typer.Argument(
            help="A suite: a name or a TOML file. A test plan: only its --sheet and --ticks.", show_default=False
        ),
    ],
    robot: _options.RobotName = "tiago",
    batches: _options.Batches = None,
    configurations: _options.Configurations = None,
    speeds: _options.Speeds = None,
    obstacle_speeds: _options.ObstacleSpeeds = None,
    sizes: _options.Sizes = None,
    gaps: _options.Gaps = None,
    repetitions: _options.Repetitions = None,
    seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Of the suite: shifts when moving obstacles start.")
    ] = 0,
    floor_plan: _options.FloorPlanName = None,
    criteria: Annotated[
        Path | None,
        typer.Option(
            help="Criteria (TOML) that the trials are to be held against: as many as are planned for them, in a drawn order."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The test plan's file; default: it is printed.")] = None,
    sheet: Annotated[Path | None, typer.Option(help="Write the run sheet, an HTML page to print (A4).")] = None,
    ticks: Annotated[
        Path | None,
        typer.Option(help="Write the sheet as a page on which to tick, in a browser; it saves the ticks as JSON."),
    ] = None,
) -> None:
    """Write the test plan of a suite for real robots (TOML, to fill in), its run sheet and the page to tick on.

    Overwrites nothing.
    """
    from dataclasses import replace

    from clearway.errors import ClearwayError
    from clearway.recordings.lab.plan_file import load_test_plan
    from clearway.recordings.protocol.lab_trials import behind, labels_in, scenarios
    from clearway.recordings.protocol.protocol import is_plan_file, parsed, refuse_existing, skeleton, write_new
    from clearway.recordings.protocol.run_sheet import sheet_of
    from clearway.recordings.protocol.tick_page import tick_page
    from clearway.scenarios.suites import Selection
    from clearway.statistics import load_criteria
    from clearway.statistics import repetitions as planned_repetitions

    refuse_existing(out, sheet, ticks)
    if is_plan_file(suite):
        if criteria is not None:
            raise ClearwayError(
                "chooses the trials of a plan that is yet to be written; leave it out", field="--criteria"
            )
        if (sheet is None and ticks is None) or out is not None:
            raise ClearwayError(
                "is a test plan already; --sheet FILE writes its run sheet, --ticks FILE the page to tick on",
                file=suite,
            )
        made = load_test_plan(suite)
        known = behind(made, Path(suite).parent)
    else:
        selection = Selection(
            batches=tuple(batches or ()),
            configurations=tuple(configurations or ()),
            speeds=tuple(speeds or ()),
            obstacle_speeds=tuple(obstacle_speeds or ()),
            sizes=tuple(sizes or ()),
            gaps=tuple(gaps or ()),
            repetitions=repetitions,
            floor_plan=floor_plan,
        )
        if criteria is not None:
            once = replace(selection, repetitions=1)
            tests = labels_in(parsed(skeleton(suite, robot, once, seed=seed)))
            needed = planned_repetitions(
                load_criteria(criteria),
                [{n: v for n, v in test.items() if n not in ("navigator", "localisation")} for test in tests],
            )
            selection = selection if repetitions is not None else replace(selection, repetitions=needed)
        drawn = criteria is not None
        folder, table = None if out is None else out.parent, None if ticks is None else f"{ticks.stem}.json"
        text = skeleton(suite, robot, selection, seed=seed, folder=folder, ticks=table, drawn=drawn)
        made, known = parsed(text), scenarios(suite, robot, selection, seed, drawn=drawn)
        if out is None:
            typer.echo(text, nl=False)
        else:
            write_new(out, text)
            typer.echo(f"test plan: {out} ({len(made.trials)} trials)")
    printed = out is None and not is_plan_file(suite)
    if sheet is not None:
        write_new(sheet, sheet_of(made, known))
        typer.echo(f"run sheet: {sheet}", err=printed)
    if ticks is not None:
        plan = Path(suite) if is_plan_file(suite) else out
        write_new(ticks, tick_page(made, plan or ticks, known))
        typer.echo(f"page to tick on: {ticks}", err=printed)

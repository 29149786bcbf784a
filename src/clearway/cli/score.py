"""`clearway score`: recordings of a real robot, by a test plan."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def score(
    test_plan: Annotated[Path, typer.Argument(help="The test plan (TOML); `clearway protocol` writes its skeleton.")],
    out: Annotated[Path | None, typer.Option(help="Results directory; default: results/NAME-OF-THE-PLAN.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, max=1024, help="Processes; default: one a core.")] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the scoring in --out, which was interrupted, or whose plan has grown."
        ),
    ] = False,
    watch: Annotated[
        Path | None, typer.Option(help="Score each recording as it comes into this folder; Ctrl-C ends it.")
    ] = None,
    criteria: Annotated[
        Path | None,
        typer.Option(help="Criteria (TOML): whether they are met so far, after every trial; the page begins with it."),
    ] = None,
    no_report: Annotated[bool, typer.Option("--no-report", help="Only the results, no page.")] = False,
    as_json: Json = False,
) -> None:
    """Score recordings of a real robot: the same indicators, statistics and report as simulated ones.

    A trial whose recording can't be used is aborted, with the reason, and the others are scored; the exit code is then 1. A verdict by --criteria
    does not change it; `clearway accept` has it as its exit code.
    """
    from dataclasses import asdict

    from clearway import api
    from clearway.cli._day import followed
    from clearway.cli._progress import Progress, stoppable, written
    from clearway.errors import ClearwayError
    from clearway.reports.acceptance import text
    from clearway.reports.findings import Findings
    from clearway.reports.recordings import reader_notes
    from clearway.reports.selection import BOUNDED, between
    from clearway.reports.text import headline
    from clearway.trials.trial import UNUSABLE

    if resume and out is None:
        raise ClearwayError("say with --out which results to complete", field="--resume")
    if criteria is not None:
        api.accept(criteria, test_plan=test_plan)  # complains before anything is scored
    with stoppable(), Progress("trials") as progress:
        if watch is None:
            results = api.score(test_plan, out=out, workers=workers, resume=resume, progress=progress)
        else:
            again = f"clearway score {test_plan} --watch {watch}" + ("" if out is None else f" --out {out}")
            again += "" if criteria is None else f" --criteria {criteria}"
            rounds = api.watch(test_plan, watch, out=out, workers=workers)
            results = followed(rounds, again=again, report=not no_report, criteria=criteria, plan=test_plan)
    verdict = None if criteria is None else api.accept(criteria, results, test_plan=test_plan)
    page = None if no_report else written(results, verdict)
    confirm = [(n, what) for n, what in enumerate(results.trials["to_confirm"].to_pylist()) if what]
    spoilt = int(any(UNUSABLE in str(reason) for reason in results.trials["reason"].to_pylist()))
    if as_json:
        about = {"results": str(results.path), "report": page and str(page), "trials": len(results)}
        tell(about | {"to_confirm": dict(confirm)} | ({} if verdict is None else {"verdict": asdict(verdict)}))
        raise typer.Exit(spoilt)
    typer.echo(headline(results.trials))
    if verdict is not None:
        typer.echo(text(verdict))
    named = [f"trial {i}, no. {number} of the test plan" for i, number in enumerate(results.campaign["numbers"])]
    for number, what in confirm:
        typer.echo(f"to confirm  {named[number]}: {what}")
    for number, near in enumerate(results.trials["near_tolerance"].to_pylist()):
        if near:
            typer.echo(f"near its tolerance  {named[number]}: {near}")
    for note in reader_notes(Findings(results)):
        typer.echo(f"read  {note}")
    for number, row in enumerate(results.trials.to_pylist()):
        if known := [f"{name} {found}" for name in BOUNDED if (found := between(row, name))]:
            typer.echo(f"within bounds  {named[number]}: {', '.join(known)}")
    typer.echo(f"results: {results.path}" if page is None else f"report: {page}")
    raise typer.Exit(spoilt)

"""The command line: one file a verb, no logic. Heavy imports stand inside the verbs, so that help answers at once.

Exit codes: 0 done; 1 done, but something is wrong with what was examined (a check found a problem, a navigator
failed, a trial that was run again has other bits, a search found a break, a tuning shows no gain); 2 the input is wrong; 130 interrupted. Only `accept` has others, as 1 and 2 are
verdicts there (`cli/accept.py`).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from clearway.cli import (
    accept,
    break_,
    check,
    compare,
    examples,
    export,
    identify,
    import_,
    list_,
    live,
    localise,
    map_,
    merge,
    protocol,
    replay,
    report,
    requirement,
    rerun,
    run,
    samples,
    schema,
    score,
    tune,
)
from clearway.cli._options import alone
from clearway.errors import ClearwayError

app = typer.Typer(
    name="clearway",
    help="Measure how well mobile robots find their way among people and obstacles.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
VERBS: dict[str, Callable[..., None]] = {
    "run": run.run,
    "live": live.live,
    "merge": merge.merge,
    "rerun": rerun.rerun,
    "break": break_.break_,
    "tune": tune.tune,
    "protocol": protocol.protocol,
    "import": import_.import_,
    "score": score.score,
    "localise": localise.localise,
    "identify": identify.identify,
    "map": map_.map_,
    "accept": accept.accept,
    "report": report.report,
    "replay": replay.replay,
    "export": export.export,
    "compare": compare.compare,
    "requirement": requirement.requirement,
    "list": list_.list_,
    "check": check.check,
    "schema": schema.schema,
    "samples": samples.samples,
    "examples": examples.examples,
}
for name, verb in VERBS.items():
    app.command(name, cls=accept.Accept if name == "accept" else None)(alone(verb))


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"clearway {version('clearway')}")
        raise typer.Exit


@app.callback()
def _top(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: shows the errors that a user can mend in one line, without a traceback."""
    try:
        app(prog_name="clearway")
    except ClearwayError as error:
        typer.echo(f"clearway: {error}", err=True)
        sys.exit(2)
    except MemoryError:
        typer.echo("clearway: there is not enough memory for this", err=True)
        sys.exit(2)

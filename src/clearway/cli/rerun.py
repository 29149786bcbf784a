"""`clearway rerun`: one trial again, alone, and whether it goes as before."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from clearway.cli._options import Json, ResultsDirectory, tell


def rerun(
    results: ResultsDirectory,
    trial: Annotated[int, typer.Option(min=0, help="The trial's number in trials.csv.")],
    navigator: Annotated[
        str | None, typer.Option("--navigator", "-n", help="Another navigator on the very same scenario.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Make a results directory of this one trial, with its report and replay.")
    ] = None,
    debugger: Annotated[
        bool, typer.Option("--pdb", help="Stop in Python's debugger where the navigator raises an error.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Run one trial again, alone and in this process, and compare it with the stored one, bit by bit.

    No limit on a decision's wall clock applies, so that a debugger may stop it. Exit code 1: the bits are not the same.
    """
    from clearway import api
    from clearway.cli._progress import stoppable
    from clearway.indicators import row_schema
    from clearway.reports import write_replay, write_report
    from clearway.trials import BROKEN

    with stoppable(), _post_mortem(debugger):
        again = api.rerun(results, trial, navigator=navigator, out=out, raise_errors=debugger)
    pages: dict[str, Path] = {}
    if again.results is not None:
        pages = {"results": again.results.path, "report": write_report(again.results.path)}
        pages["replay"] = write_replay(again.results, 0)
    wrong = again.difference is not None
    if as_json:
        about: dict[str, Any] = {"trial": trial, "id": again.id, "navigator": again.navigator, "said": str(again)}
        about |= {"same_bits": None if not again.same_navigator or (again.compared_by_row and not wrong) else not wrong}
        about |= {"outcome": again.now.outcome.value, "reason": again.now.reason, "changed": again.changed}
        tell(about | {name: str(page) for name, page in pages.items()})
    else:
        typer.echo(str(again))
        units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in row_schema()}
        named = {f"{name} [{units[name]}]" if units[name] else name: both for name, both in again.changed.items()}
        for name, (before, now) in named.items():
            typer.echo(f"  {name:<{max(map(len, named))}}  {_cell(before)} -> {_cell(now)}")
        for name, page in pages.items():
            typer.echo(f"{name}: {page}")
    if again.now.outcome in BROKEN and again.now.events:
        typer.echo(again.now.events[-1].detail, err=True)
    if wrong:
        raise typer.Exit(1)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "-" if value is None or value == "" else str(value)


@contextmanager
def _post_mortem(wanted: bool) -> Iterator[None]:
    """Where it is wanted: opens the debugger on an error, or on Ctrl-C, at the line where it came."""
    import bdb
    import pdb
    import traceback

    from clearway.errors import ClearwayError

    try:
        yield
    except ClearwayError:
        raise
    except (Exception, KeyboardInterrupt) as error:
        if not wanted or isinstance(error.__cause__, bdb.BdbQuit | SystemExit):
            raise
        traceback.print_exception(error)
        pdb.post_mortem(error.__traceback__)
        raise typer.Exit(1) from None

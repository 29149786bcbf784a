"""`clearway accept`: a verdict by criteria, valid however often it is asked for."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from clearway.cli._options import Json, tell
from clearway.errors import ClearwayError

WRONG, BROKEN = 64, 70
"""Exit codes of wrong input and of a failure of Clearway itself, as sysexits.h has them: 1 and 2 are verdicts here."""


class Accept(TyperCommand):
    """The command, of which a wrong option has the exit code of wrong input."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """As every command does; a usage error is told apart from a verdict."""
        try:
            return super().make_context(*arguments, **options)
        except Exception as error:
            if hasattr(error, "exit_code") and not isinstance(error, typer.Exit):
                error.exit_code = WRONG
            raise


def apart(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb, of which whatever goes wrong has an exit code that is no verdict."""

    @wraps(verb)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            verb(*arguments, **options)
        except typer.Exit:
            raise
        except KeyboardInterrupt:
            raise typer.Exit(130) from None
        except ClearwayError as error:
            typer.echo(f"clearway: {error}", err=True)
            raise typer.Exit(WRONG) from None
        except MemoryError:
            typer.echo("clearway: there is not enough memory for this", err=True)
            raise typer.Exit(BROKEN) from None
        except Exception:
            traceback.print_exc()
            raise typer.Exit(BROKEN) from None

    return run


@apart
def accept(
    criteria: Annotated[Path, typer.Argument(help="The criteria (TOML).", show_default=False)],
    results: Annotated[
        list[Path] | None,
        typer.Argument(help="Results directories, of simulations or recordings, in the order in which they were made."),
    ] = None,
    plan: Annotated[
        bool,
        typer.Option("--plan", help="Before the first trial: how many trials it takes, and how probably it ends how."),
    ] = False,
    rates: Annotated[
        list[float] | None, typer.Option("--rate", help="With --plan: a true share of conforming trials; repeatable.")
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write a JUnit file, a test case a criterion.")] = None,
    report: Annotated[
        bool, typer.Option("--report", help="Write the report of the last results; its page begins with the verdict.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Is the robot accepted? Trials held against criteria: accepted, rejected, or go on, about so many more trials.

    The verdict may be asked for after every trial. Exit codes: 0 accepted, 1 rejected, 2 go on; 64 wrong input, 70 an error of Clearway.
    """
    from dataclasses import asdict

    from clearway import api
    from clearway.cli._progress import written
    from clearway.reports.acceptance import plan_text, text
    from clearway.statistics import Decision

    if plan or rates:
        if not plan:
            raise ClearwayError("belongs to --plan", field="--rate")
        if results or junit or report:
            raise ClearwayError("is made before the first trial; leave the results out", field="--plan")
        found = api.acceptance_plan(criteria, rates or ())
        if as_json:
            tell([asdict(one) for one in found], indent=2)
        else:
            typer.echo(plan_text(found))
        return
    if not results:
        raise ClearwayError("say which results are to be judged; --plan needs none", file=criteria)
    opened = [api.open_results(path) for path in results]
    verdict = api.accept(criteria, *opened, junit=junit)
    page = written(opened[-1], verdict) if report else None
    if as_json:
        tell(asdict(verdict) | {"report": page and str(page)}, indent=2)
    else:
        typer.echo(text(verdict) + (f"\nreport: {page}" if page else ""))
    raise typer.Exit({Decision.ACCEPTED: 0, Decision.REJECTED: 1, Decision.GO_ON: 2}[verdict.decision])

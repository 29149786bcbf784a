"""`clearway samples`: how many trials show a reliability at a confidence."""

from __future__ import annotations

from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def samples(
    reliability: Annotated[float, typer.Option(help="Share of successes to be shown, in (0, 1).")] = 0.90,
    confidence: Annotated[float, typer.Option(help="Confidence of the one-sided statement, in (0, 1).")] = 0.95,
    failures: Annotated[int, typer.Option(min=0, help="Failures that may occur.")] = 0,
    as_json: Json = False,
) -> None:
    """How many trials show reliability R at confidence C (exact binomial, one-sided)."""
    from clearway.statistics import samples_needed

    n = samples_needed(reliability, confidence, failures)
    if as_json:
        tell({"reliability": reliability, "confidence": confidence, "failures": failures, "trials": n})
    else:
        allowed = "none of them failing" if failures == 0 else f"at most {failures} of them failing"
        typer.echo(f"{n} trials, {allowed}, show a reliability of {reliability:.15g} at {confidence:.15g} confidence")

"""Tells how a day in the lab goes on, in the terminal and on a page that loads itself anew."""

from __future__ import annotations

import html
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from clearway.errors import ClearwayError
from clearway.placing import placed

if TYPE_CHECKING:
    from clearway.api import Results
    from clearway.campaigns.watching import Round
    from clearway.statistics import Verdict

PAGE = "live.html"
"""Beside the report."""
REFRESH = 3
"""s after which the page is loaded anew."""
SHARE = 10
"""How many times as long as it took the report is not written again: recordings that come in would wait."""


def followed(
    rounds: Iterator[Round], *, again: str, report: bool, criteria: Path | None = None, plan: Path | None = None
) -> Results:
    """The results when every trial is done; until then, each round is told.

    Args:
        rounds: Where the day stands, time and again.
        again: The command, for the one who stops it.
        report: Whether to write the report, too.
        criteria: By which each round has a verdict; None: none is asked for.
        plan: The test plan of the trials, for the verdict.

    Raises:
        KeyboardInterrupt: Ctrl-C; the message says how to go on.
    """
    from clearway import api

    try:
        last = _told_to_the_end(rounds, report, criteria, plan)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"stopped; what is scored stays, go on with `{again}`") from None
    assert last.results is not None
    return api.open_results(last.results.path)


def _told_to_the_end(rounds: Iterator[Round], report: bool, criteria: Path | None, plan: Path | None) -> Round:
    from clearway import api

    page: Path | None = None
    due = 0.0
    for last in rounds:
        verdict, said = _verdict(last, criteria, plan)
        lines = [*said, *told(last)]
        if page is None and last.results is not None:
            page = last.results.path / PAGE
            lines = [f"page     {page}", *lines]
        if page is not None:
            with placed(page.parent) as new:  # a browser may load it at any moment
                (new / PAGE).write_text(
                    page_of([*said, *told(last)], finished=last.finished, report=report), encoding="utf-8"
                )
        for line in lines:
            typer.echo(line, err=True)
        if last.results is not None and report and not last.finished and (began := time.monotonic()) >= due:
            api.open_results(last.results.path).report(verdict)  # the last one is written with the results
            due = time.monotonic() + SHARE * (time.monotonic() - began)
    return last


def _verdict(now: Round, criteria: Path | None, plan: Path | None) -> tuple[Verdict | None, list[str]]:
    """The verdict as far as trials are scored, and what is said of it; a mistake in a file must not end the day."""
    from clearway import api
    from clearway.reports.acceptance import sentence

    if criteria is None or now.problem:
        return None, []
    try:
        verdict = api.accept(criteria, *([] if now.results is None else [now.results]), test_plan=plan)
    except ClearwayError as error:
        return None, [f"problem  {error}"]
    return verdict, [f"verdict  {sentence(verdict)}"]


def told(now: Round) -> list[str]:
    """A round in lines."""
    if now.problem:
        return [f"problem  {now.problem}", *([f"next     {now.coming}"] if now.coming else [])]
    lines = [f"scored   {now.done} of {now.trials}{_ended(now)}"]
    lines += [f"repeat   no. {number}: {why}" for number, why in now.repeat.items()]
    lines += [
        f"unclear  no. {n}: {why}; tick why (aborted, stopped, person helped), or repeat it"
        for n, why in now.unclear.items()
    ]
    if now.results is not None:
        numbers, confirm = now.results.campaign["numbers"], now.results.trials["to_confirm"].to_pylist()
        lines += [f"confirm  no. {n}: {text}" for n, text in zip(numbers, confirm, strict=True) if text]
    lines += [f"waiting  for {name}" for name in now.waits]
    return [*lines, f"next     {now.coming}" if now.coming else "next     nothing: every trial was driven"]


def _ended(now: Round) -> str:
    if now.results is None:
        return ""
    count = Counter(now.results.trials["outcome"].to_pylist())
    return ": " + ", ".join(f"{n} {outcome}" for outcome, n in sorted(count.items()))


def page_of(lines: list[str], *, finished: bool, report: bool) -> str:
    """The page, one file without scripts."""
    link = '<p><a href="index.html">The report</a></p>' if report else ""
    again = "" if finished else f'<meta http-equiv="refresh" content="{REFRESH}">'
    rows = "".join(
        f"<tr><th>{html.escape(kind)}</th><td>{html.escape(text.strip())}</td></tr>"
        for kind, _, text in (line.partition(" ") for line in lines)
    )
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">{again}<title>The day</title><style>'
        "body{font:16pt/1.5 sans-serif;margin:2em auto;max-width:50em}th{text-align:left;vertical-align:top;padding-right:1em}"
        f"</style></head><body><table>{rows}</table>{link}</body></html>\n"
    )

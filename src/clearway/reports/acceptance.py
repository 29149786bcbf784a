"""A verdict in words: for a terminal, for the report's page, and as a JUnit file for a CI server."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clearway.foreign import printable
from clearway.placing import placed
from clearway.reports.grid import Cell, Column, Grid, grid
from clearway.reports.grid import text as words
from clearway.statistics import Decision, Judged, Outlook, Verdict
from clearway.statistics.acceptance import more_trials

NAMED = 8
"""Trials that are listed by number."""


def sentence(verdict: Verdict) -> str:
    """The verdict on whom, in a sentence."""
    who = verdict.system or "the robot"
    met = sum(j.decision is Decision.ACCEPTED for j in verdict.criteria)
    of = f"{met} of {len(verdict.criteria)} criteria are met"
    match verdict.decision:
        case Decision.ACCEPTED:
            said = f"{who} is accepted: {of}"
        case Decision.REJECTED:
            broken = [j.name for j in verdict.criteria if j.decision is Decision.REJECTED]
            said = f"{who} is rejected: {'; '.join(broken)}"
        case Decision.GO_ON:
            more = "too near a limit to say how many more trials"
            if verdict.more is not None:
                more = f"about {more_trials(verdict.more)}" if verdict.more else "by what nobody could judge yet"
            said = f"go on, {more}: {of}, none is broken"
    return f"{verdict.title}: {said}" if verdict.title else said


def reasons(judged: Judged) -> list[str]:
    """Why a criterion stands where it does, and which trials to look at, a line each."""
    lines = [judged.why]
    if judged.decision is Decision.GO_ON:
        parts = []
        if judged.more:
            parts.append(f"about {more_trials(judged.more)}, if they go on as so far")
        elif judged.more is None and judged.trials:
            parts.append("more trials than can be told: the share lies too near its limit")
        if judged.least is not None:
            parts.append(f"at least {more_trials(judged.least)} before it can be accepted, even if none of them fails")
        lines += ["; ".join(parts)] if parts else []
    if judged.failed:
        without = f" ({judged.missing:,} of them without a value)" if judged.missing else ""
        lines.append(f"failed: {_trials(judged.failed)}{without}")
    if judged.unjudged:
        lines.append(f"not to be judged yet: {_trials(judged.unjudged)}")
    return lines


def text(verdict: Verdict) -> str:
    """The verdict for a terminal."""
    lines = [f"{str(verdict.decision).upper()}  {sentence(verdict)}"]
    for j in verdict.criteria:
        lines.append(f"{j.decision:<9} {_titled(j)} ({_counts(j)})")
        lines += [f"          {line}" for line in reasons(j)]
    lines += [f"note      {note}" for note in verdict.notes]
    return printable("\n".join(lines))


def plan_text(plan: Sequence[Outlook]) -> str:
    """What the criteria will take, for a terminal."""
    lines = []
    for o in plan:
        lines.append(f"{o.demand}{f', {o.group}' if o.group else ''}")
        decided = (
            f"plan {o.planned:,} trials"
            if o.planned
            else f"no plan: {o.most:,} trials don't decide it in nine of ten cases"
        )
        lines.append(f"  {decided}; {o.least:,} accept if none fails")
        lines.append(
            f"  {'true share':>10}  {'accepted':>8}  {'rejected':>8}  {'undecided':>9}  {'trials: mean':>12}  {'half':>7}  {'nine of ten':>11}"
        )
        for p in o.prospects:
            left = max(0.0, 1 - p.accepted - p.rejected)
            half, ninth = (f"{n:,}" if n is not None else f"> {o.most:,}" for n in (p.median, p.ninth))
            lines.append(
                f"  {p.rate:>10.4g}  {p.accepted:>8.3f}  {p.rejected:>8.3f}  {left:>9.3f}  {p.expected:>12,.0f}  {half:>7}  {ninth:>11}"
            )
    return printable("\n".join(lines))


def criteria_grid(verdict: Verdict) -> Grid:
    """The criteria as a table for the page, trials that failed as links where one results directory holds them all."""
    rows: list[list[Cell | str]] = []
    for j in verdict.criteria:
        at = "" if j.decided is None else f"after {j.decided:,} trials"
        shares = "–" if j.shares is None else f"{j.shares.low:.3f} to {j.shares.high:.3f}"
        look = (*j.failed, *j.unjudged)
        linked = tuple(number for _, number in look[:NAMED]) if verdict.tables == 1 else ()
        why = reasons(j)
        strong = j.decision is Decision.REJECTED
        rows.append(
            [_titled(j), Cell(str(j.decision), at, strong), _counts(j), shares, Cell(". ".join(why), trials=linked)]
        )
    heads: list[Column | str] = [words(n) for n in ("criterion", "verdict", "trials", "possible shares", "why")]
    return grid(
        "Each criterion, looked at after every trial; the possible shares hold at all times at once", heads, rows
    )


def on_page(verdict: Verdict) -> dict[str, Any]:
    """What the page begins with, as its template asks for it."""
    heading = {Decision.ACCEPTED: "Accepted", Decision.REJECTED: "Rejected", Decision.GO_ON: "Go on"}[verdict.decision]
    return {
        "kind": verdict.decision.name.lower(),
        "heading": heading,
        "sentence": sentence(verdict),
        "criteria": criteria_grid(verdict),
        "notes": verdict.notes,
    }


def write_junit(verdict: Verdict, file: Path) -> None:
    """Write the verdict as a JUnit file: a test case a criterion; one on which there is no verdict yet is an error.

    Raises:
        ClearwayError: it can't be written.
    """
    cases = verdict.criteria
    count = {d: sum(j.decision is d for j in cases) for d in Decision}
    suite = ET.Element(
        "testsuite", name=_plain(verdict.title or "acceptance"), tests=str(len(cases)),
        failures=str(count[Decision.REJECTED]), errors=str(count[Decision.GO_ON]), skipped="0",
    )  # fmt: skip
    for j in cases:
        case = ET.SubElement(suite, "testcase", name=_plain(_titled(j)), classname=_plain(verdict.system or "robot"))
        if j.decision is Decision.ACCEPTED:
            continue
        tag = "failure" if j.decision is Decision.REJECTED else "error"
        said = ET.SubElement(case, tag, message=_plain(reasons(j)[0]), type=str(j.decision))
        said.text = _plain("\n".join(reasons(j)))
    ET.SubElement(suite, "system-out").text = _plain(text(verdict))
    ET.indent(suite)
    with placed(file.parent) as new:
        (new / file.name).write_bytes(ET.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n")


def _titled(j: Judged) -> str:
    name = j.demand if j.demand.startswith(j.name) else f"{j.name}: {j.demand}"
    return f"{name}, {j.group}" if j.group else name


def _counts(j: Judged) -> str:
    unknown = f", {j.unknown:,} not to be judged yet" if j.unknown else ""
    return f"{j.conforming:,} of {j.trials:,} conform{unknown}"


def _trials(found: Sequence[tuple[int, int]]) -> str:
    several = len({table for table, _ in found}) > 1
    names = [f"{number} of results {table + 1}" if several else str(number) for table, number in found[:NAMED]]
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return f"trial{'s' if len(found) > 1 else ''} {', '.join(names)}{more}"


def _plain(words: str) -> str:
    """Without what XML can't hold."""
    return "".join(c if c.isprintable() or c == "\n" else " " for c in words)

"""Suites beside what others published of them, batch by batch."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.reports import tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Rows, grid, num, span, text
from clearway.reports.selection import Row, is_recorded
from clearway.reports.suites import SuiteAbout
from clearway.statistics import success_interval


def published(f: Findings) -> list[Grid]:
    """A table for each suite of which somebody published figures, with the batches that were run here."""
    return [table for suite in f.suites.values() if (table := _beside(f, suite)) is not None]


def _beside(f: Findings, suite: SuiteAbout) -> Grid | None:
    rows = [r for r in f.rows if r["suite"] == suite.name and not is_recorded(r)]
    there = dict.fromkeys(r["batch"] for r in rows)
    batches = [b for b in dict.fromkeys(p.batch for p in suite.published) if b in there]
    if not batches:
        return None
    lines: Rows = []
    groups: list[int] = []
    for batch in batches:
        groups.append(len(lines))
        lines += [
            [
                Cell(batch, strong=True), Cell(p.who, "published"), str(p.trials), num(p.success, 3),
                NONE if p.collision is None else num(p.collision, 3), num(p.time),
            ]
            for p in suite.published if p.batch == batch
        ]  # fmt: skip
        for system in f.systems:
            ours = [r for r in f.of(system) if r["suite"] == suite.name and r["batch"] == batch and not is_recorded(r)]
            if ours:
                lines.append([Cell(batch, strong=True), Cell(f.name(system)), *_shares(ours)])
    caption = f"{suite.title}: beside what is published, with exact 95 % intervals of what was run here; the time is the mean of the successes"
    said = tuning.sentence(rows)
    return grid(
        f"{caption}; {said}" if said else caption,
        [text("Batch"), text("System"), "n", "success", "contact", "time (s)"],
        lines,
        groups,
    )


def _shares(rows: Sequence[Row]) -> list[Cell | str]:
    told = success_interval(sum(bool(r["success"]) for r in rows), len(rows))
    touched = sum(r["outcome"] == "collision" for r in rows) / len(rows)
    times = [r["CT"] for r in rows if r["success"] and r["CT"] is not None]
    time = sum(times) / len(times) if times else None
    share = Cell(num(told.estimate, 3), span(told.low, told.high, 3))
    return [str(len(rows)), share, num(touched, 3), num(time)]

"""The table of runs in which several robots were tested together: what they did as a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.indicators.fleet import FLEET, waiting
from clearway.indicators.indicator import Value
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, span, text
from clearway.reports.selection import Row, System, systems
from clearway.statistics import mean_interval


@dataclass(frozen=True, slots=True)
class Run:
    """One simulation of several tested robots.

    Attributes:
        row: Of its first robot's trial.
        systems: What was tested, each kind once.
        robots: How many were tested.
        values: Of the indicators of `FLEET`, by name.
        waiting: Who waited for whom, s.
    """

    row: Row
    systems: tuple[System, ...]
    robots: int
    values: dict[str, Value]
    waiting: dict[tuple[str, str], float]


def runs(f: Findings) -> list[Run]:
    """All of them, in the order of the results; a robot that was tested alone among others makes none, nor do results of
    before a row told what is needed."""
    by_number, found = {r["trial"]: r for r in f.rows}, []
    for numbers in f.results.runs.values() if "arrived" in f.results.trials.column_names else ():
        if len(numbers) > 1:
            rows = [by_number[n] for n in numbers]
            values = {one.name: one.function(rows) for one in FLEET}
            found.append(Run(rows[0], tuple(systems(rows)), len(numbers), values, waiting(rows)))
    return found


def fleets(f: Findings, runs: Sequence[Run]) -> Grid | None:
    """By system, test and number of robots; None without such runs."""
    groups: dict[tuple[tuple[System, ...], str, str, int], list[Run]] = {}
    for run in runs:
        key = (run.systems, f.batch(run.row), run.row["configuration"], run.robots)
        groups.setdefault(key, []).append(run)
    rows: Rows = []
    for (tested, batch, configuration, robots), there in groups.items():
        all_there = sum(run.values["makespan"].value is not None for run in there)
        cells: list[Cell | str] = [
            Cell(" and ".join(f.name(s) for s in tested), strong=True), f"{batch}, {configuration}", str(robots), str(len(there)), str(all_there),
        ]  # fmt: skip
        cells += [_mean([run.values[name].value for run in there]) for name in ("makespan", "sum_of_times")]
        cells += [f"{sum(run.values[name].value or 0.0 for run in there):.0f}" for name in ("contacts", "deadlocks")]
        waits = [(s, who, run) for run in there for who, s in run.waiting.items()]
        total = sum(s for s, *_ in waits)
        if waits:
            longest, (who, whom), run = max(waits, key=lambda one: one[0])
            cells.append(
                Cell(num(total / len(there), 1), f"{who} for {whom}, {num(longest, 1)} s", trials=(run.row["trial"],))
            )
        else:
            cells.append(NONE)
        rows.append(cells)
    heads: Heads = [
        text("Robots' navigator"), text("Test"), "robots", "runs", "all arrived", "makespan (s)", "sum of times (s)", "contacts", "deadlocks",
        "waited, all together (s)",
    ]  # fmt: skip
    return grid(
        "Fleets: of the runs in which all arrived the mean time until the last one had, and that of all robots together, with 95 % intervals "
        "(t). A contact of two robots counts once; a deadlock is a circle of robots that stood for the last 5 s and waited for each other. A "
        "robot waits for the nearest other one while it stands within 1 m of it: seconds a run, and below who waited longest for whom.",
        heads, rows,
    ) if rows else None  # fmt: skip


def _mean(values: Sequence[float | None]) -> Cell:
    known = np.array([v for v in values if v is not None], dtype=np.float64)
    if not len(known):
        return Cell(NONE)
    interval = mean_interval(known, bounds=(0.0, np.inf))
    return Cell(num(float(known.mean()), 1), "" if interval is None else span(interval.low, interval.high, 1))

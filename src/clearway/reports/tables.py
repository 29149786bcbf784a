"""The report's tables as CSV, numbers unrounded: for a spreadsheet, or a reviewer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from clearway.reports.barn import barn
from clearway.reports.decision_time import decision_times
from clearway.reports.findings import BREAKDOWN, Findings
from clearway.reports.fleets import Run
from clearway.reports.parameters import every_parameter
from clearway.statistics import GROUP

NAMES = {
    "summary": "every indicator by robot, navigator, suite, batch and speed",
    "success": "success rates with intervals",
    "significance": "all tests between set speeds, three analyses each",
    "correlations": "Pearson's r of every pair, per robot and pooled",
    "breakdown": "completion time and its parts",
    "parameters": "every parameter of the robots with its source",
    "decision-times": "how long decisions took, in seconds of wall clock",
    "trials": "all trials",
    "fleets": "runs of several robots: makespan, sum of times, contacts, deadlocks, who waited for whom how long, s",
    "barn": "world by world beside the published runs (the BARN Challenge's suites only)",
}


def write_tables(f: Findings, runs: Sequence[Run], folder: Path) -> list[str]:
    """Write the CSV files of the findings and the `runs` of several robots into `folder`; returns the names of those that were written, without `.csv`."""
    import pyarrow as pa

    summary = [{k: v for k, v in r.items() if k not in ("range_low", "range_high")} for r in f.described]
    tables: dict[str, Any] = {
        "summary": pa.Table.from_pylist(summary),
        "success": pa.Table.from_pylist(f.rates),
        "significance": f.speed_tests,
        "correlations": f.correlation_table,
        "breakdown": pa.Table.from_pylist(_breakdown(f)),
        "parameters": pa.Table.from_pylist(_parameters(f)),
        "trials": f.results.trials,
    }
    courses = [
        {"robot": s.robot, "navigator": s.navigator, "setup": s.setup, **asdict(c)} for s in f.systems if (b := barn(f, s)) for c in b.courses
    ]  # fmt: skip
    if took := decision_times(f):
        tables["decision-times"] = pa.Table.from_pylist([asdict(s) | asdict(t) for s, t in took.items()])
    if courses:
        tables["barn"] = pa.Table.from_pylist(courses)
    if runs:
        tables["fleets"] = pa.Table.from_pylist([_run(run) for run in runs])
    import pyarrow.csv

    from clearway.trials.csv_table import without_formulas

    written = []
    for name, table in tables.items():
        if table.num_columns:
            pyarrow.csv.write_csv(without_formulas(table), folder / f"{name}.csv")
            written.append(name)
    return written


def _run(run: Run) -> Mapping[str, Any]:
    labels = {c: run.row[c] for c in ("run", "suite", "batch", "configuration", "speed", "repetition")}
    tested = " and ".join(f"{s.robot} {s.navigator}" for s in run.systems)
    values = {name: value.value for name, value in run.values.items()}
    waits = "; ".join(f"{who} for {whom} {seconds:.2f}" for (who, whom), seconds in run.waiting.items())
    return (
        labels
        | {"tested": tested, "robots": run.robots}
        | values
        | {"waited": sum(run.waiting.values()), "waits": waits}
    )


def _breakdown(f: Findings) -> list[Mapping[str, Any]]:
    names = ("CT", *BREAKDOWN)
    keys = dict.fromkeys(tuple(r[c] for c in GROUP) for r in f.described)
    values = {(*(r[c] for c in GROUP), r["indicator"]): r["mean"] for r in f.described}
    return [
        dict(zip(GROUP, key, strict=True)) | {n: values.get((*key, n)) for n in names}
        for key in keys
    ]  # fmt: skip


def _parameters(f: Findings) -> list[Mapping[str, Any]]:
    return [
        {"robot": name, "parameter": parameter, "value": value, "source": where}
        for name, robot in f.robots.items() if robot is not None
        for parameter, value, where in every_parameter(robot)
    ]  # fmt: skip

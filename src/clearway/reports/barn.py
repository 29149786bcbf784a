"""The suite `barn` beside the published runs of the real move_base, in sum and world by world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.reports import tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import Cell, Grid, Heads, Rows, grid, num, p_value, percent, span, text
from clearway.reports.selection import Row, System, is_recorded
from clearway.scenarios.barn import PUBLISHED_TASK, TASKS, PublishedRun, published_runs, worlds
from clearway.scenarios.suite import Section
from clearway.statistics import FEWEST, spearman, success_interval

TOP_SPEED = 2.0
"""m/s, of BARN's score: a run's time is held against the reference path's length over it."""


@dataclass(frozen=True, slots=True)
class Course:
    """One of BARN's worlds.

    Attributes:
        world: Its number.
        published: Share of success of the published runs.
        here: Share of success here.
        published_time: Mean time of the published successes, s; None: there is none.
        here_time: Mean time of the successes here, s; None: there is none.
        runs: Number of runs here.
    """

    world: int
    published: float
    here: float
    published_time: float | None
    here_time: float | None
    runs: int


@dataclass(frozen=True, slots=True)
class Barn:
    """What the report shows of the suite for one system.

    Attributes:
        summary: Success and times, published and here.
        agreement: How well the two agree, in a sentence.
        courses: The worlds, one by one.
        table: The same as a table.
    """

    summary: Grid
    agreement: str
    courses: tuple[Course, ...]
    table: Grid


def barn(f: Findings, system: System) -> Barn | None:
    """None where the suite was not run, or only on worlds without a published run."""
    suites = f.asked(Section.PUBLISHED_BARN_RUNS)
    rows = [r for r in f.of(system) if r["suite"] in suites and not is_recorded(r)]
    number = {r["trial"]: world_of(r) for r in rows}
    there = {n for n in number.values() if n is not None}
    published = [p for p in published_runs() if p.world in there]
    known = {p.world for p in published}
    rows = [r for r in rows if number[r["trial"]] in known]
    if not rows:
        return None
    here: dict[int | None, list[Row]] = {}
    for row in rows:
        here.setdefault(number[row["trial"]], []).append(row)
    courses = tuple(
        _course(w, [p for p in published if p.world == w], here[w]) for w in sorted({p.world for p in published})
    )
    found = spearman(np.array([c.published for c in courses]), np.array([c.here for c in courses]))
    agreement = f"Rank correlation of the success rate per world (Spearman, {found.n} worlds): "
    if len(courses) < FEWEST:
        agreement = f"Of fewer than {FEWEST} worlds with a published run nothing is said about how well the two agree."
    elif found.r is None:
        agreement += "not defined, as one of the two has the same rate everywhere."
    else:
        agreement += f"{num(found.r)} {span(found.low, found.high)}, p {p_value(found.p)}."
    times = [(c.published_time, c.here_time) for c in courses if c.published_time and c.here_time]
    timed = spearman(*np.array(times).T) if len(times) > 2 else None
    if timed is not None and timed.r is not None:
        agreement += f" Of the mean time of successes ({timed.n} worlds): {num(timed.r)} {span(timed.low, timed.high)}."
    return Barn(_summary(f, system, published, rows), agreement, courses, _table(f, system, courses))


def world_of(row: Row) -> int | None:
    """The number of the world that a trial was driven in, from its floor plan's name."""
    name = str(row["floor_plan"]).removeprefix("barn-")
    return int(name) if name.isdigit() else None


def _course(world: int, published: Sequence[PublishedRun], rows: Sequence[Row]) -> Course:
    def mean(values: Sequence[float]) -> float | None:
        return sum(values) / len(values) if values else None

    return Course(
        world,
        sum(p.success for p in published) / len(published),
        sum(bool(r["success"]) for r in rows) / len(rows),
        mean([p.time for p in published if p.success]),
        mean([r["barn_time"] for r in rows if r["barn_time"] is not None]),
        len(rows),
    )


def _score(run: PublishedRun) -> float:
    best = worlds()[run.world].length(TASKS[PUBLISHED_TASK]) / TOP_SPEED
    return best / min(max(run.time, 2 * best), 8 * best) if run.success else 0.0


def _summary(f: Findings, system: System, published: Sequence[PublishedRun], rows: Sequence[Row]) -> Grid:
    n, k = len(published), len(rows)
    shares: tuple[tuple[str, Callable[[PublishedRun], bool], Callable[[Row], bool]], ...] = (
        ("success", lambda p: p.success, lambda r: bool(r["success"])),
        ("collision", lambda p: p.collided, lambda r: r["outcome"] == "collision"),
        ("timeout", lambda p: p.timed_out, lambda r: r["outcome"] == "timeout"),
    )
    lines: Rows = []
    for name, theirs, ours in shares:
        a, b = success_interval(sum(map(theirs, published)), n), success_interval(sum(map(ours, rows)), k)
        lines.append([
            Cell(name, strong=True), Cell(num(a.estimate, 3), span(a.low, a.high, 3)), Cell(num(b.estimate, 3), span(b.low, b.high, 3)),
            num(b.estimate - a.estimate, 3),
        ])  # fmt: skip
    other = k - sum(bool(r["success"]) or r["outcome"] in ("collision", "timeout") for r in rows)
    lines.append([Cell("any other end", strong=True), "0.000", num(other / k, 3), num(other / k, 3)])
    time_p = float(np.mean([p.time for p in published if p.success])) if any(p.success for p in published) else None
    times = [r["barn_time"] for r in rows if r["barn_time"] is not None]
    time_h = float(np.mean(times)) if times else None
    lines.append(
        [Cell("mean time of successes (s)", strong=True), num(time_p, 1), num(time_h, 1), percent(time_h, time_p)]
    )
    score_p, scores = float(np.mean([_score(p) for p in published])), [r["barn_score"] or 0.0 for r in rows]
    lines.append(
        [
            Cell("score", strong=True),
            num(score_p, 3),
            num(float(np.mean(scores)), 3),
            num(float(np.mean(scores)) - score_p, 3),
        ]
    )
    return grid(
        f"{f.name(system)}: the worlds that were run, beside the published runs of the real move_base in the same worlds "
        "(95 % exact binomial intervals, which take runs of one world as independent)"
        + (
            ". The published runs were driven under an older task, start at x = -2 and arrival within 0.5 m: the suite "
            f"{PUBLISHED_TASK} is that task"
            if any(r["suite"] != PUBLISHED_TASK for r in rows)
            else ""
        )
        + (f"; {said}" if (said := tuning.sentence(rows)) else ""),
        [text("Quantity"), f"published (n {n})", f"here (n {k})", "difference"],
        lines,
    )


def _table(f: Findings, system: System, courses: Sequence[Course]) -> Grid:
    rows: Rows = [
        [Cell(str(c.world), strong=True), num(c.published, 2), num(c.here, 2), num(c.published_time, 1), num(c.here_time, 1), str(c.runs)]
        for c in courses
    ]  # fmt: skip
    columns: Heads = [
        "world",
        "success, published",
        "success, here",
        "time, published (s)",
        "time, here (s)",
        "runs here",
    ]
    return grid(f"{f.name(system)}: world by world", columns, rows)

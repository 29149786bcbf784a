"""A whole tuning: from a task to a file with better parameters, a Pareto front, and what they are worth on held-out trials."""

from __future__ import annotations

import csv
import math
import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.errors import ClearwayError
from clearway.improving.objective import SUCCESS, Limit, Objective, together
from clearway.improving.page import FRONT, write_page
from clearway.improving.preparing import Prepared, check_ends, prepared
from clearway.improving.search import Candidate, Record, best
from clearway.improving.task import Task, read_task
from clearway.improving.trials import Bench
from clearway.improving.tuning import Gain, Tuning, doubts
from clearway.indicators import INDICATORS
from clearway.placing import make_folder
from clearway.reports.comparison_page import write_comparison
from clearway.reports.page import PAGE
from clearway.scenarios.suites import load_suite
from clearway.statistics import Comparison, compare
from clearway.trials.store import Results, refuse_results
from clearway.tuning import TunedOn

CANDIDATES, BEST, BEFORE, AFTER, COMPARISON = "candidates.csv", "front.csv", "before", "after", "comparison"
"""What lies in a tuning's folder, beside its page, its figure and the parameters that were found."""


def tune(
    task: Task | str | Path, out: Path, *, workers: int | None = None, progress: ProgressCallback | None = None
) -> Tuning:
    """Search for better parameters, and compare what is found with what came in, on held-out trials.

    Writes into `out`: the parameters that were found, in the format that came in; `candidates.csv`, all that were tried;
    `front.csv` and `front.svg`, the Pareto front; `index.html`, all of it as a page; the results directories `before` and `after` of the held-out trials, and a page of their
    `comparison`.

    Args:
        task: What is to be tuned, or the TOML file that says so.
        out: The folder, made if it isn't there.
        workers: How many processes; None: one a core. The results don't depend on it, unless the search has a limit in minutes.
        progress: Told how far it is.

    Raises:
        ClearwayError: something in the task is wrong, before anything runs; or an indicator of the objective can't be computed of
            any of the first trials; or `out` already holds what would be written.
    """
    task = task if isinstance(task, Task) else read_task(task)
    _refuse_taken(out, task)
    ready = prepared(task)
    asked, objective, groups = ready.asked, ready.objective, ready.groups
    tell, processes = progress or silent, workers_of(workers, least=0)
    with tempfile.TemporaryDirectory(prefix="clearway-tune-") as scratch, pool(processes, out) as work:
        folder = Path(scratch)
        known = check_plan(asked.training, asked.training.specs(), work)
        check_plan(asked.held_out, asked.held_out.specs(), work)
        check_ends(asked, ready.settings, folder)
        make_folder(out)
        bench = Bench(asked.training, groups, known, ready.settings, objective.indicators, folder, work)
        record = Record(objective, bench, asked.search.trials, [dict(ready.before)])
        record.told = lambda done, note: tell(done, asked.search.trials, note)
        _refuse_never(record, objective, min(asked.search.first, len(groups)), asked)
        ranked = best(record, asked.variables, asked.search, len(groups))
    found = _result(ready, record, ranked, out, workers, tell)
    write_page(found, asked, objective.goals, record.candidates(), len(groups))
    return found


def _result(
    ready: Prepared, record: Record, ranked: Sequence[int], out: Path, workers: int | None, tell: ProgressCallback
) -> Tuning:
    asked, objective, before, trials = ready.asked, ready.objective, ready.before, len(ready.groups)
    every = record.candidates()
    whole = [c for c in every if c.score.trials == trials]
    front = tuple(c for c in whole if not any(objective.dominated(c.score, o.score) for o in whole))
    _write_table(out / CANDIDATES, objective, every)
    _write_table(out / BEST, objective, front)
    warnings = []
    if ready.same_places:
        warnings.append("the held-out trials are in places of training; only noise and timing are others")
    chosen = record.values[ranked[0]]
    scores = {c.number: c.score for c in whole}
    if ranked[0] == 0 or scores[ranked[0]].order >= scores[0].order:
        return Tuning(
            out, None, asked.robot, asked.navigator, before, dict(before), len(record.answers), front, (), (), None,
            tuple(warnings),
        )  # fmt: skip
    if math.isinf(scores[ranked[0]].excess) or scores[ranked[0]].excess > 0:
        warnings.append("the constraints are not all kept, even in training")
    written = ready.settings.write(chosen, out, _called(asked), [_tuned_on(asked)])
    tell(len(record.answers), asked.search.trials, "held-out trials")
    first = run_campaign(asked.held_out, out / BEFORE, workers)
    tuned = replace(asked.held_out, robots=(written.robot,), navigators=(written.navigator,))
    second = run_campaign(tuned, out / AFTER, workers)
    names = [n for n in objective.indicators if n != SUCCESS] or ["CT"]
    found = compare(first.trials, second.trials, names=("before", "after"), indicators=names)
    write_comparison([found], out / COMPARISON)
    gains = tuple(_gain(goal.indicator, goal.sign, found, first, second) for goal in objective.goals)
    limits = []
    for limit in objective.limits:
        was, now = (_over(results, limit) for results in (first, second))
        limits.append((str(limit), was, now, now >= limit.limit if limit.at_least else now <= limit.limit))
    warnings += doubts(gains, tuple(limits), found.pairs)
    return Tuning(
        out, written.files[0] if written.files else None, written.robot, written.navigator, before, chosen, len(record.answers),
        front, gains, tuple(limits), found, tuple(warnings),
    )  # fmt: skip


def _called(asked: Task) -> str:
    """What the file of the parameters that are found is called, without its suffix."""
    return f"{Path(asked.robot.removesuffix('.toml').partition(':')[0]).name.removesuffix('.toml')}-tuned"


def _refuse_taken(out: Path, asked: Task) -> None:
    """Complain of a folder with anything in it that would be written: at its end a tuning would lose what it ran for.

    Raises:
        ClearwayError: there is something.
    """
    refuse_results(out)
    names = {CANDIDATES, BEST, FRONT, PAGE, BEFORE, AFTER, COMPARISON}
    mine = re.compile(
        rf"{re.escape(_called(asked))}(-\d+)?(\.\w+)?"
    )  # YAML files have their own suffix, and a number each
    for path in sorted(out.iterdir()) if out.is_dir() else ():
        if path.name in names or mine.fullmatch(path.name):
            raise ClearwayError(
                "is already there, and a tuning overwrites nothing; choose another directory", file=path
            )


def _gain(indicator: str, sign: int, found: Comparison, first: Results, second: Results) -> Gain:
    unit = INDICATORS[indicator].unit
    was, now = (float(np.mean(v)) if (v := _numbers(r, indicator)) else math.nan for r in (first, second))
    if indicator == SUCCESS:
        if (pairs := found.success.get(None)) is None:
            return Gain(indicator, unit, was, now, math.nan, math.nan, math.nan, 0)
        low, high = pairs.difference.low, pairs.difference.high
        centre = (pairs.only_b - pairs.only_a) / pairs.n
        verdict = 0 if pairs.p > 0.05 else (-sign if pairs.only_b > pairs.only_a else sign)
        return Gain(indicator, unit, was, now, centre, low, high, verdict)
    rows = [r for r in found.differences.to_pylist() if r["batch"] is None and r["indicator"] == indicator]
    if not rows or rows[0]["mean_difference"] is None:
        return Gain(indicator, unit, was, now, math.nan, math.nan, math.nan, 0)
    row = rows[0]
    low, high = (math.nan if row[end] is None else row[end] for end in ("boot_low", "boot_high"))
    shown_at_all = row["p_holm"] is not None and row["p_holm"] <= 0.05 and (low > 0.0 or high < 0.0)
    verdict = 0 if not shown_at_all else (-sign if row["mean_difference"] > 0 else sign)
    return Gain(indicator, unit, was, now, row["mean_difference"], low, high, verdict)


def _over(results: Results, limit: Limit) -> float:
    """A constraint's value over all trials; nan: of none."""
    value = together([{limit.indicator: v} for v in _numbers(results, limit.indicator)], limit.indicator, limit.over)
    return math.nan if value is None else value


def _numbers(results: Results, indicator: str) -> list[float]:
    return [float(v) for v in results.trials[indicator].to_pylist() if v is not None]


def _refuse_never(record: Record, objective: Objective, trials: int, asked: Task) -> None:
    """Complain of an indicator that can be computed of none of the first trials with what came in; one of the objective may
    wait for success."""
    [score] = record.scores([0], range(trials), "what came in")
    answers = [record.answers[0, t] for t in range(trials)]
    never = [
        ("objective", goal.indicator)
        for goal, mean in zip(objective.goals, score.goals, strict=True)
        if math.isnan(mean) and _needs_no_success(goal.indicator, record, trials)
    ]
    never += [("constraints", c.indicator) for c in objective.limits if together(answers, c.indicator) is None]
    for field, indicator in never:
        raise ClearwayError(
            f"{indicator!r} can be computed of none of the first {trials} training trials, so nothing can be tuned by it",
            file=asked.file, field=field,
        )  # fmt: skip


def _needs_no_success(indicator: str, record: Record, trials: int) -> bool:
    """Whether trials that succeeded are among those of which it could not be computed, or it is not known which did."""
    known = [record.answers[0, t].get(SUCCESS) for t in range(trials)]
    return indicator != SUCCESS and (any(known) or all(v is None for v in known))


def _tuned_on(asked: Task) -> TunedOn:
    plan = asked.training
    draws = None if plan.selection.seeds is None else range(*plan.selection.seeds)
    note = ", ".join(v.name for v in asked.variables)
    return TunedOn(
        load_suite(plan.suites[0]).name, floor_plan=plan.selection.floor_plan or "", draws=draws, seeds=(plan.seed,),
        speeds=plan.selection.speeds, note=note,
    )  # fmt: skip


def _write_table(file: Path, objective: Objective, candidates: Sequence[Candidate]) -> None:
    names = list(candidates[0].values) if candidates else []
    with file.open("w", encoding="utf-8", newline="") as text:
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(["candidate", *names, "trials", *(g.indicator for g in objective.goals), "broken_constraints"])
        for one in candidates:
            cells = ["" if math.isnan(v) else f"{v:.6g}" for v in one.score.goals]
            rows.writerow(
                [one.number, *(one.values[n] for n in names), one.score.trials, *cells, f"{one.score.excess:.6g}"]
            )

"""Scores recordings of a real robot by a test plan, into the same results directory as a campaign's."""

from __future__ import annotations

import json
import os
from collections.abc import Generator, Sequence
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Any

from clearway.campaigns.campaign import ProgressCallback, asked_of, finished_in_turn, machine, now, stoppable
from clearway.campaigns.worker import Done, settle
from clearway.errors import ClearwayError
from clearway.indicators import row_schema, score_row
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of, references
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.test_plan import RecordedTrialSpec
from clearway.trials.store import Results, TrialStore, refuse_results, write_partial


class Unusable(ClearwayError):
    """A trial's recording, or what the plan says of it, is wrong."""


def score_plan(
    plan: Path,
    out: Path,
    *,
    workers: int | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
) -> Results:
    """Import, score and store every attempt of a test plan.

    An attempt without a file counts as attempted; one that is marked `attempted = false` is left out.

    Args:
        plan: the test plan's TOML. out: the results directory, made if it isn't there. workers: processes; None: one a
        core. resume: go on where an interrupted scoring stopped. progress: told how far it is.

    Raises:
        ClearwayError: something in the plan or in a file is wrong (whatever can be seen without reading whole files is
        told before anything is written), or `out` can't be used.
    """
    plan, out = Path(plan), Path(out)
    if workers is not None and workers < 1:
        raise ClearwayError(f"{workers} is wrong: at least 1", field="workers")
    if not resume:
        refuse_results(out)
    lab, tell = Lab(plan), progress or (lambda done, total, note="": None)
    tell(0, len(lab.plan.trials), "looking into the files")
    if problems := problems_of(plan):
        more = f" (and {len(problems) - 1} more; `clearway check {plan}` lists them)" if len(problems) > 1 else ""
        first = problems[0]
        raise ClearwayError(first.problem + more, file=first.file, field=first.field)
    attempted = [i for i, t in enumerate(lab.plan.trials) if t.attempted or lab.files(t)]
    if not attempted:
        raise ClearwayError(
            "no trial has a file, and none is marked as attempted; there is nothing to score", file=plan
        )
    left_out = len(lab.plan.trials) - len(attempted)
    run = machine() | {"started": now(), "test_plan": str(plan)}
    with (
        TrialStore(out, _asked(lab, attempted), len(attempted), row_schema(), run=run, resume=resume) as store,
        stoppable(store),
    ):
        try:
            while missing := store.missing():
                jobs = _by_file(lab, [(i, attempted[i]) for i in missing])
                done = store.total - len(missing)
                tell(done, store.total, f"{left_out} not attempted yet" if left_out else "")
                with closing(_scored(plan, jobs, store, workers or os.cpu_count() or 1)) as results:
                    for several in results:
                        done += len(several)
                        tell(done, store.total)
            return store.finish({"finished": now()})
        except Unusable:
            store.withdraw()  # the plan has to be mended, and a mended plan is another campaign
            raise


def _scored(
    plan: Path, jobs: Sequence[list[tuple[int, int]]], store: TrialStore, workers: int
) -> Generator[list[Done]]:
    calls = [(_score_and_keep, (plan, job, store.partial, store.key)) for job in jobs]
    return finished_in_turn(calls, min(workers, len(calls)), store.path)


def _score_and_keep(
    plan: Path, job: list[tuple[int, int]], folder: Path, key: str, parent: int | None = None
) -> list[Done]:
    """Score the trials of one file; `job`: (index in the store, index in the plan)."""
    if parent is not None:
        settle(parent)
    lab = _lab(plan, plan.stat().st_mtime_ns)
    done = []
    for index, number in job:
        try:
            trial = assemble(lab, number)
        except ClearwayError as error:
            raise Unusable(error.problem, file=error.file, field=error.field) from error
        row = {"id": _id(lab.plan.trials[number])} | score_row(trial)
        write_partial(folder, key, index, trial, row)
        done.append(Done(index, trial.outcome, trial.reason))
    return done


@lru_cache(maxsize=1)
def _lab(plan: Path, changed: int) -> Lab:
    return Lab(plan)


def _by_file(lab: Lab, trials: Sequence[tuple[int, int]]) -> list[list[tuple[int, int]]]:
    """Trials that lie in one file together: it is read once for all of them."""
    jobs: dict[str, list[tuple[int, int]]] = {}
    for index, number in trials:
        jobs.setdefault(lab.plan.trials[number].file or f"none {index}", []).append((index, number))
    return list(jobs.values())


def _id(spec: RecordedTrialSpec) -> str:
    """A trial's name in the tables, built as the protocol names its scenarios."""
    values = (("v", spec.speed), ("o", spec.obstacle_speed), ("s", spec.size), ("d", spec.gap))
    parts = [spec.batch, spec.configuration, *(f"{letter}{value:g}" for letter, value in values if value is not None)]
    return "-".join([*parts, f"r{spec.repetition}"])


def _asked(lab: Lab, attempted: Sequence[int]) -> dict[str, Any]:
    """What campaign.json holds and resuming compares: the plan as it was, and what its files held."""
    robots = {} if lab.robot is None else {str(lab.plan.test.robot): json.loads(lab.robot.model_dump_json())}
    read = {file for _, _, file, _ in references(lab.plan)} | {s.table for s in lab.plan.sources.values() if s.table}
    whole = json.loads(lab.plan.model_dump_json(by_alias=True))
    trials = whole.pop("trial")
    return asked_of(robots) | {
        "scored": lab.path.name,
        "test_plan": whole,
        "attempted": [trials[i] for i in attempted],
        "not_attempted": len(trials) - len(attempted),
        "files": {file: lab.digest(file) for file in sorted(read) if (lab.folder / file).exists()},
    }

"""Scores recordings of a real robot by a test plan, into the same results directory as a campaign's."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from clearway.campaigns.interruption import interruptible
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.campaigns.provenance import asked_of, machine, now
from clearway.errors import ClearwayError
from clearway.indicators import row_schema, score_row
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of, references
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.test_plan import RecordedTrialSpec
from clearway.scenarios.suites import load_suite, suite_names
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
        plan: The test plan's TOML.
        out: The results directory, made if it isn't there.
        workers: How many processes; None: one a core.
        resume: Whether to go on where an interrupted scoring stopped.
        progress: Told how far it is.

    Raises:
        ClearwayError: something in the plan or in a file is wrong (whatever can be seen without reading whole files is
            told before anything is written), or `out` can't be used.
        CampaignInterrupted: Ctrl-C; `out` can be resumed.
    """
    plan, out, processes = Path(plan), Path(out), workers_of(workers)
    if not resume:
        refuse_results(out)
    lab, tell = Lab(plan), progress or silent
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
        interruptible(store),
        pool(processes, out) as work,
    ):
        try:
            while missing := store.missing():
                jobs = _by_file(lab, [(i, attempted[i]) for i in missing])
                done = store.total - len(missing)
                tell(done, store.total, f"{left_out} not attempted yet" if left_out else "")
                for several in work.each(_score_and_keep, [(plan, job, store.partial, store.key) for job in jobs]):
                    done += several
                    tell(done, store.total)
            return store.finish({"finished": now()})
        except Unusable:
            store.withdraw()  # the plan has to be mended, and a mended plan is another campaign
            raise


def _score_and_keep(plan: Path, job: list[tuple[int, int]], folder: Path, key: str) -> int:
    """Score the trials of one file, `job`: (index in the store, index in the plan). How many they are."""
    lab = _lab(plan, plan.stat().st_mtime_ns)
    for index, number in job:
        try:
            trial = assemble(lab, number)
        except ClearwayError as error:
            raise Unusable(error.problem, file=error.file, field=error.field) from error
        row = {"id": _id(lab.plan.trials[number])} | score_row(trial)
        write_partial(folder, key, index, trial, row)
    return len(job)


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
    robots = {} if lab.robot is None else {lab.robot.name: json.loads(lab.robot.model_dump_json())}
    read = {file for _, _, file, _ in references(lab.plan)} | {s.table for s in lab.plan.sources.values() if s.table}
    whole = json.loads(lab.plan.model_dump_json(by_alias=True))
    trials = whole.pop("trial")
    suite = lab.plan.test.suite
    suites = {suite: load_suite(suite).about()} if suite in suite_names() else {}
    return asked_of(robots, suites) | {
        "scored": lab.path.name,
        "test_plan": whole,
        "attempted": [trials[i] for i in attempted],
        "not_attempted": len(trials) - len(attempted),
        "files": {file: lab.digest(file) for file in sorted(read) if (lab.folder / file).exists()},
    }

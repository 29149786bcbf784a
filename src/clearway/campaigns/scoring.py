"""Scores recordings of a real robot by a test plan, into the same results directory as a campaign's."""

from __future__ import annotations

import json
import pickle
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from clearway.campaigns.growth import kept_of
from clearway.campaigns.interruption import interruptible
from clearway.campaigns.mistaken import refuse_mistaken
from clearway.campaigns.pool import Fate, pool, workers_of
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.campaigns.provenance import asked_of, machine, now
from clearway.errors import ClearwayError
from clearway.indicators import row_schema, score_row
from clearway.recordings.lab.assemble import assemble, unusable
from clearway.recordings.lab.checks import findings
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.recording_checks import Finding, references
from clearway.recordings.lab.test_plan import RecordedTrialSpec, by_number
from clearway.scenarios.suites import load_suite, suite_names
from clearway.trials.store import Results, TrialStore, refuse_results, write_partial


def score_plan(
    plan: Path,
    out: Path,
    *,
    workers: int | None = None,
    resume: bool = False,
    unready: Collection[Path] = (),
    progress: ProgressCallback | None = None,
) -> Results:
    """Import, score and store every attempt of a test plan.

    An attempt without a file counts as attempted; one that is marked `attempted = false` is left out. One whose recording can't
    be used is aborted, with the reason, and stops none of the others.

    Args:
        plan: The test plan's TOML.
        out: The results directory, made if it isn't there.
        workers: How many processes; None: one a core.
        resume: Whether to go on where an interrupted scoring stopped, or with a plan that has grown: trials are scored
            that are new, or of which the plan or a file now says something else.
        unready: Recordings that are still being written, and count as not there.
        progress: Told how far it is.

    Raises:
        ClearwayError: something is wrong in the plan or in what all of its trials need, no recording can be used, or `out`
            can't be.
        CampaignInterrupted: Ctrl-C; `out` can be resumed.
    """
    plan, out, processes = Path(plan), Path(out), workers_of(workers)
    refuse_mistaken(plan, "test plan")
    if not resume:
        refuse_results(out)
    lab, tell = Lab(plan, load_test_plan(plan, unready)), progress or silent
    tell(0, len(lab.plan.trials), "looking into the files")
    recorded = {i for i, t in enumerate(lab.plan.trials) if lab.files(t)}
    attempted = [i for i, t in enumerate(lab.plan.trials) if t.attempted or lab.files(t)]
    if not attempted:
        raise ClearwayError(
            "no trial has a file, and none is marked as attempted; there is nothing to score", file=plan
        )
    left_out = len(lab.plan.trials) - len(attempted)
    asked = _asked(lab, attempted)
    kept = kept_of(out, asked) if resume else None
    fresh = [n for i, n in enumerate(attempted) if i not in (kept or ())]
    found = findings(plan, plan=lab.plan, fresh=fresh)
    _refuse(plan, found, recorded)
    known = {i: f.error for f in reversed(found) for i in f.trials}
    run = machine() | {"started": now(), "test_plan": str(plan)}
    said = pickle.dumps(lab.plan)
    with (
        TrialStore(out, asked, len(attempted), row_schema(), run=run, resume=resume, kept=kept) as store,
        interruptible(store),
        pool(processes, out) as work,
    ):
        wrong: dict[int, ClearwayError] = {}
        while missing := store.missing():
            jobs = _by_file(lab, [(i, attempted[i]) for i in missing])
            done = store.total - len(missing)
            tell(done, store.total, f"{left_out} not attempted yet" if left_out else "")
            for several, unused in work.each(
                _score_and_keep,
                [(plan, said, job, _of(job, known), store.partial, store.key) for job in jobs],
                fallen=_fallen,
            ):
                wrong |= unused
                done += several
                tell(done, store.total)
        if recorded and recorded == set(wrong):
            store.withdraw()  # the plan has to be mended, and a mended plan is another campaign
            _refuse(plan, [Finding(wrong[i]) for i in sorted(wrong)], recorded)
        return store.finish({"finished": now()})


def _refuse(plan: Path, found: Sequence[Finding], recorded: Collection[int]) -> None:
    """Nothing, where trials can be scored: what is wrong lies in the recordings of some of them.

    Raises:
        ClearwayError: it lies in the plan, or in every recording; the first of it.
    """
    wanting = {i for f in found for i in f.trials}
    wrong = [f for f in found if not f.trials] or (list(found) if recorded and wanting >= set(recorded) else [])
    if wrong:
        more = f" (and {len(wrong) - 1} more; `clearway check {plan}` lists them)" if len(wrong) > 1 else ""
        first = wrong[0].error
        raise ClearwayError(first.problem + more, file=first.file, field=first.field)


def _of(job: Sequence[tuple[int, int]], known: Mapping[int, ClearwayError]) -> dict[int, ClearwayError]:
    return {number: known[number] for _, number in job if number in known}


def _score_and_keep(
    plan: Path, said: bytes, job: Sequence[tuple[int, int]], known: Mapping[int, ClearwayError], folder: Path, key: str
) -> tuple[int, dict[int, ClearwayError]]:
    """Score the trials of one file.

    Args:
        plan: The test plan.
        said: What it said when scoring began, pickled: files that come in meanwhile are another scoring's.
        job: Its trials: (index in the store, index in the plan).
        known: Why recordings can't be used, as far as that is known, by index in the plan.
        folder: Where finished trials are kept.
        key: The campaign's.

    Returns:
        How many they are, and why recordings can't be used, by index in the plan.
    """
    lab = _lab(plan, said, key)
    wrong = dict(known)
    for index, number in job:
        try:
            trial = unusable(lab, number, wrong[number]) if number in wrong else assemble(lab, number)
        except Exception as error:  # nothing that a file holds may cost an evening's other trials
            wrong[number] = by_number(error if isinstance(error, ClearwayError) else _unforeseen(error), plan)
            trial = unusable(lab, number, wrong[number])
        row = {"id": _id(lab.plan.trials[number])} | score_row(trial)
        write_partial(folder, key, index, trial, row)
    return len(job), wrong


def _unforeseen(what: object) -> ClearwayError:
    return ClearwayError(f"unforeseen, please report it: {type(what).__name__}: {what}")


def _fallen(
    fate: Fate,
    plan: Path,
    said: bytes,
    job: Sequence[tuple[int, int]],
    known: Mapping[int, ClearwayError],
    folder: Path,
    key: str,
) -> tuple[int, dict[int, ClearwayError]]:
    """The same where no worker could complete it."""
    why = ClearwayError(f"reading it ended the process: {fate}", file=plan)
    return _score_and_keep(
        plan, said, job, dict.fromkeys((number for _, number in job), why) | dict(known), folder, key
    )


@lru_cache(maxsize=1)
def _lab(plan: Path, said: bytes, key: str) -> Lab:
    """The plan at work; `key` tells what its files held."""
    return Lab(plan, pickle.loads(said))


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
        "numbers": [i + 1 for i in attempted],
        "not_attempted": len(trials) - len(attempted),
        "files": {file: lab.digest(file) for file in sorted(read) if (lab.folder / file).exists()},
    }

"""Runs a campaign: checks everything first, then many trials on many cores, each kept as soon as it is finished."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clearway.campaigns.interruption import interruptible
from clearway.campaigns.on_dask import on_dask
from clearway.campaigns.plan import CampaignPlan, TrialList, TrialSpec
from clearway.campaigns.plan_checks import Known, check_plan, too_fast
from clearway.campaigns.pool import Pool, pool, workers_of
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.campaigns.provenance import asked_of_plan, machine, now
from clearway.campaigns.shards import Shard, shard_of
from clearway.campaigns.tuning import all_by_files, in_words
from clearway.campaigns.worker import keep_fallen, patience_of, run_and_keep
from clearway.errors import ClearwayError
from clearway.indicators import row_schema
from clearway.trials import BROKEN
from clearway.trials.store import Results, TrialStore, refuse_results
from clearway.trials.store_results import CAMPAIGN, SHARD, SIMULATIONS, how_to_go_on, read_campaign


def run_campaign(
    plan: CampaignPlan,
    out: Path,
    workers: int | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
    shard: Shard | None = None,
    scheduler: str | None = None,
    told: Callable[[str], None] | None = None,
) -> Results:
    """Run every trial of a plan, or of a shard of it, and store the results.

    They are the same bytes whatever the number of workers, and whether or not the campaign was interrupted; wall-clock
    figures are kept apart in timing.parquet and thinking.parquet.

    Args:
        plan: What to run.
        out: The results directory, made if it isn't there.
        workers: How many processes; None: one a core. A trial with which two of them die in turn, or one doesn't come
            back, is recorded as failed. 0: this process, as a debugger needs it: a decision may take as long as it likes,
            and an error of a navigator is raised instead of being recorded as a failed trial.
        resume: Whether to go on with a campaign in `out` that was interrupted.
        progress: Told how far it is.
        scheduler: The address of a dask.distributed scheduler, whose workers run the trials; None: `workers` processes here.
        shard: Which part of the plan to run, for `merge_shards` to put together with the others; None: all of it.
        told: Called before the first trial with a sentence for each robot that can't drive the set speed of some of them.

    Raises:
        ClearwayError: something in the plan is wrong (before anything runs), `out` can't be used, or the disk is full.
        CampaignInterrupted: Ctrl-C; `out` can be resumed.
    """
    out, tell, processes = Path(out), progress or silent, workers_of(workers, least=0)
    if not resume:
        refuse_results(out)
    begun = (out / CAMPAIGN).exists()
    old = read_campaign(out) if begun else {}
    trials = plan.trials(old.get(SIMULATIONS) if old.get("plan") == json.loads(json.dumps(plan.to_json())) else None)
    mine = np.arange(len(trials)) if shard is None else shard.part(trials.runs)
    listed = trials.listed()
    with pool(processes, out) as work:
        known = check_plan(plan, listed if begun else trials, work)
    if told is not None:
        for sentence in too_fast(listed):
            told(sentence)
    files = all_by_files(plan, listed)
    asked = asked_of_plan(plan, listed, {name: known[name].code for name in files})
    chosen = {
        name: in_words((*(one.tuned_on or ()), *files.get(name, ())) if files.get(name) else one.tuned_on)
        for name, one in known.items()
    }
    if trials.abridged:
        asked |= {SIMULATIONS: trials.sizes}
    if shard is not None:
        asked |= {SHARD: shard.to_json(len(trials))}
    run = machine() | {"started": now(), "tuned_on": chosen}
    with (
        TrialStore(out, asked, len(mine), row_schema(), run=run, resume=resume) as store,
        interruptible(store),
        pool(processes, out) as work,
    ):
        if begun and trials.abridged:  # the others have not been looked at by this process
            known |= check_plan(plan, chain.from_iterable(_runs(trials, mine, store.missing())), work)
        while missing := store.missing():
            _run_all(plan, _runs(trials, mine, missing), len(missing), known, store, work, tell, scheduler)
        return store.finish({"finished": now()})


def resume_campaign(
    out: Path,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
    scheduler: str | None = None,
) -> Results:
    """Complete a campaign by the plan that its campaign.json holds.

    Args:
        out: The results directory.
        workers: How many processes; None: one a core.
        progress: Told how far it is.
        scheduler: As for `run_campaign`.

    Raises:
        ClearwayError: as for `run_campaign`; or `out` holds no campaign.
        CampaignInterrupted: Ctrl-C; `out` can be resumed.
    """
    out = Path(out)
    shard = shard_of(read_campaign(out), out / CAMPAIGN)
    return run_campaign(planned(out), out, workers, resume=True, progress=progress, shard=shard, scheduler=scheduler)


def planned(out: Path) -> CampaignPlan:
    """The plan of the campaign in a results directory, finished or not.

    Raises:
        ClearwayError: there is none.
    """
    campaign = read_campaign(Path(out))
    if not isinstance(campaign.get("plan"), dict):
        raise ClearwayError("its results were not made by a campaign; there is nothing to run", file=out)
    return CampaignPlan.from_json(campaign["plan"])


def _runs(trials: TrialList, mine: NDArray[np.int64], missing: Sequence[int]) -> Iterator[list[TrialSpec]]:
    """The missing trials, simulation by simulation.

    Args:
        trials: Those of the whole campaign.
        mine: The numbers there of those that are to be run.
        missing: Which of these are missing.
    """
    for run in trials.simulations(mine[missing]):
        yield [dataclasses.replace(spec, index=int(np.searchsorted(mine, spec.index))) for spec in run]


def _run_all(
    plan: CampaignPlan,
    runs: Iterator[list[TrialSpec]],
    count: int,
    known: Mapping[str, Known],
    store: TrialStore,
    work: Pool,
    tell: ProgressCallback,
    scheduler: str | None,
) -> None:
    done, failed = store.total - count, 0
    tell(done, store.total, _first_note())
    debugged = work.workers == 0 and scheduler is None
    if debugged:
        plan = dataclasses.replace(plan, decision_limit=None)
    if scheduler is None:
        calls = ((plan, run, known, store.partial, store.key, debugged) for run in runs)
        finished = work.each(run_and_keep, calls, patience=patience_of(plan), fallen=keep_fallen)
    else:
        finished = on_dask(scheduler, plan, runs, count, known, store)
    try:
        for results in finished:
            for result in results:
                done += 1
                failed += result.outcome in BROKEN
                tell(done, store.total, f"{failed} failed: {_one_line(result.reason)}" if failed else "")
    except Exception as error:
        if debugged:
            error.add_note(
                f"{done} of {store.total} trials are finished; `{how_to_go_on(store.path)}` goes on, as long as no code is edited"
            )
        raise


def _first_note() -> str:
    """Says so when the kernels have yet to be compiled."""
    from clearway.geometry import compiled

    package = Path(compiled.__file__).parent.parent
    return "" if any(package.glob("world/__pycache__/*.nbi")) else "compiling once, about a minute"


def _one_line(text: str) -> str:
    return text.strip().splitlines()[-1][:120] if text.strip() else ""

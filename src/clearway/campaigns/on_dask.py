"""Trials run by the workers of a dask.distributed scheduler, which need neither the memory nor the disk of this machine.

A task is a few simulations. Its worker makes them in a process of Clearway's own, as they are made here, so that a navigator that
hangs or crashes costs one trial and not the worker; it sends back the finished trials, and this process keeps them. The scheduler
gives the task of a worker that has died to another one.
"""

from __future__ import annotations

import logging
import os
import queue
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from clearway.campaigns import source
from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import Known
from clearway.campaigns.pool import Pool
from clearway.campaigns.provenance import versions
from clearway.campaigns.worker import Done, keep_fallen, patience_of, run_and_keep
from clearway.errors import ClearwayError
from clearway.foreign import said
from clearway.given import packed, unpack
from clearway.trials.journal import JOURNALS
from clearway.trials.store import TrialStore, put_partial

_ANSWERS = 10.0
"""s within which a scheduler has to answer."""
_ABSENT = 60.0
"""s for which there may be no worker."""
_LARGEST = 16
"""Simulations of a task, at most."""
_AHEAD = 3
"""Tasks that are given to the scheduler for each thread of its workers: so it never waits, and none holds them all."""
_KEPT = "what is finished is kept, --resume goes on from there"


def on_dask(
    address: str,
    plan: CampaignPlan,
    runs: Iterable[Sequence[TrialSpec]],
    count: int,
    known: Mapping[str, Known],
    store: TrialStore,
) -> Iterator[list[Done]]:
    """Run simulations, and keep their trials in the store.

    Args:
        address: Of the scheduler.
        plan: The campaign.
        runs: The trials of each simulation.
        count: How many trials they are.
        known: Of each navigator.
        store: Where the finished trials go.

    Yields:
        What there is to tell of the trials of each simulation, in the order in which they end.

    Raises:
        ClearwayError: dask is not installed; the scheduler isn't there or goes away; there are no workers, they are not of this
            version, or too many died with a task.
    """
    with _client(address) as client:
        threads = _threads(client, address, store)
        size = max(1, min(_LARGEST, count // (4 * threads)))
        rest = iter(runs)
        expected, objects, folder, patience = about(), packed(), os.getcwd(), patience_of(plan)
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        tasks: dict[str, Any] = {}
        while True:
            while len(tasks) < _AHEAD * threads and (some := [list(run) for run in islice(rest, size)]):
                task = client.submit(
                    run_there, plan, some, dict(known), store.key, patience, folder, objects, expected, pure=False
                )
                tasks[task.key] = task
                task.add_done_callback(ended.put)
            if not tasks:
                return
            task = _next(ended, client, address, store)
            for done, records in _answer(task, address, store):
                put_partial(store.partial, records)
                yield done
            del tasks[task.key]


def about() -> dict[str, str]:
    """What has to be the same wherever trials of one campaign are run."""
    return {"code of Clearway": source.of_clearway()} | versions()


def run_there(
    plan: CampaignPlan,
    runs: Sequence[Sequence[TrialSpec]],
    known: Mapping[str, Known],
    key: str,
    patience: float | None,
    folder: str,
    objects: bytes,
    expected: Mapping[str, str],
) -> list[tuple[list[Done], bytes]]:
    """What a worker of dask does: run simulations in a process of their own.

    Args:
        plan: The campaign.
        runs: The trials of each simulation.
        known: Of each navigator.
        key: The store's.
        patience: How long a simulation may be silent, s of wall clock; None: as long as it likes.
        folder: The current directory of who asks: names of files are seen from there, if it is there.
        objects: What a Python program has handed over instead of names.
        expected: `about` of who asks.

    Returns:
        Of each simulation what there is to tell of its trials, and these as the store keeps them.

    Raises:
        ClearwayError: another version of Clearway, Python or a library; or as for `run_and_keep`.
    """
    for name, here in about().items():
        if expected.get(name) != here:
            raise ClearwayError(
                f"a worker of dask has another {name} than this process: {here}, not {expected.get(name)}; install the same there",
                field="scheduler",
            )
    unpack(objects)
    found = []
    with tempfile.TemporaryDirectory(prefix="clearway-") as at:
        work = Pool(1, Path(at), folder if os.path.isdir(folder) else None)
        calls = [(plan, run, known, Path(at), key) for run in runs]
        try:
            for done in work.each(run_and_keep, calls, patience=patience, fallen=keep_fallen):
                journals = list(Path(at).glob(JOURNALS))
                found.append((done, b"".join(journal.read_bytes() for journal in journals)))
                for journal in journals:
                    journal.unlink()
        finally:
            work.close()
    return found


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """A connection to the scheduler, whose own complaints are not printed: what matters is raised."""
    try:
        import distributed
    except ImportError as error:
        raise ClearwayError("dask is not installed; pip install 'clearway[dask]'", field="engine") from error
    made: Any = distributed.Client
    log = logging.getLogger("distributed")
    level, log.level = log.level, logging.CRITICAL + 1
    others = [
        logging.getLogger(name) for name in list(logging.root.manager.loggerDict) if name.startswith("distributed.")
    ]
    levels = [other.level for other in others]
    for other in others:
        other.setLevel(logging.CRITICAL + 1)
    try:
        try:
            client: Any = made(address, timeout=_ANSWERS, set_as_default=False)
        except Exception as error:
            raise ClearwayError(
                f"no scheduler of dask answers at {address!r} ({said(error)}); `dask scheduler` starts one and prints its address",
                field="scheduler",
            ) from None
        try:
            yield client
        finally:
            client.close(timeout=2.0)
    finally:
        log.setLevel(level)
        for other, before in zip(others, levels, strict=True):
            other.setLevel(before)


def _threads(client: Any, address: str, store: TrialStore) -> int:
    """How many tasks the workers can do at a time, once there is one."""
    try:
        client.wait_for_workers(1, timeout=_ABSENT)
        return max(1, sum(map(int, client.nthreads().values())))
    except Exception:
        raise _without_workers(address, store) from None


def _next(ended: queue.SimpleQueue[Any], client: Any, address: str, store: TrialStore) -> Any:
    """The task that ends next.

    Raises:
        ClearwayError: none can end any more.
    """
    since = time.monotonic()
    while True:
        try:
            return ended.get(timeout=1.0)
        except queue.Empty:
            now = time.monotonic()
        if client.status != "running":
            if now - since > _ANSWERS:
                raise _gone(address, store)
            continue
        try:
            if client.nthreads():
                since = now
        except Exception:
            continue  # it is going, which its status tells soon
        if now - since > _ABSENT:
            raise _without_workers(address, store)


def _answer(task: Any, address: str, store: TrialStore) -> list[tuple[list[Done], bytes]]:
    if task.status in ("cancelled", "lost"):
        raise _gone(address, store)
    error = task.exception() if task.status == "error" else None
    if isinstance(error, ClearwayError):
        raise error
    if error is not None:
        if type(error).__name__ == "KilledWorker":
            why = "several workers died in turn with the same trials: are they short of memory?"
        else:
            why = f"a worker of dask could not run its trials: {said(error)}"
        raise ClearwayError(f"{why} ({_KEPT})", file=store.path)
    found: list[tuple[list[Done], bytes]] = task.result()
    return found


def _gone(address: str, store: TrialStore) -> ClearwayError:
    return ClearwayError(f"the scheduler of dask at {address!r} has gone; {_KEPT}", file=store.path)


def _without_workers(address: str, store: TrialStore) -> ClearwayError:
    return ClearwayError(
        f"the scheduler of dask at {address!r} has no workers; `dask worker {address}` starts one ({_KEPT})",
        file=store.path,
    )

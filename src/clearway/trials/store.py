"""Writes a results directory, trial by trial, so that a run killed at any moment can go on where it stopped.

While a campaign runs, finished trials stand in the journals under `OUT/.partial/` (`clearway.trials.journal`), one a process.
When all are there, the final files are assembled in the order of the trials: the same bytes, however the trials came in.
Files, and the folders that name them, are on the disk before the next step counts on them, so that a loss of power is
no more than a kill: a trial that was told finished is there afterwards.
See `clearway.trials.store_results` for reading.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import pyarrow as pa

from clearway.errors import ClearwayError
from clearway.placing import make_folder, sync
from clearway.trials.assembly import assemble
from clearway.trials.differences import first_in_json
from clearway.trials.journal import JOURNALS, Journals, append, record
from clearway.trials.store_results import (
    CAMPAIGN,
    DIGESTS,
    PARTIAL,
    SCHEMA,
    Results,
    digest,
    how_to_go_on,
    open_results,
    read_campaign,
    seal,
)
from clearway.trials.store_tables import FILES, Tables
from clearway.trials.trial import Trial
from clearway.trials.trial_tables import from_tables, to_tables

__all__ = ["Results", "TrialStore", "open_results", "refuse_results", "write_partial"]

_KEPT = f"{PARTIAL}.kept"
_DONE = ".finished"


class TrialStore:
    """An open results directory that trials are being written to; a context manager that holds its lock.

    Args:
        path: The directory, made if it isn't there.
        asked: What was asked, as JSON: stored in campaign.json, and compared on resuming.
        total: How many trials there will be, numbered from 0.
        schema: Arrow schema of the rows (`clearway.indicators.row_schema()`), units in the fields' metadata.
        run: Who and where, as JSON: stored under `run`, not compared.
        resume: Go on with a campaign that was interrupted.
        kept: With `resume`, the trials of the campaign in `path` that are the same in this one, which takes its place: their
            numbers now and then; None: it is the same campaign.

    Raises:
        ClearwayError: the directory is in use, holds results, something else or another campaign, or can't be written.
    """

    def __init__(
        self,
        path: Path,
        asked: Mapping[str, Any],
        total: int,
        schema: Any,
        *,
        run: Mapping[str, Any] | None = None,
        resume: bool = False,
        kept: Mapping[int, int] | None = None,
    ) -> None:
        self.path, self.total = Path(path), total
        self._schema, self._lock = schema, _lock(self.path)
        try:
            self.key = _key(asked, total)
            self._journals = Journals(self.partial, self.key, total)
            if resume and kept is not None:
                self._campaign = self._grow(dict(asked), dict(run or {}), kept)
            else:
                self._campaign = self._begin(dict(asked), dict(run or {}), resume)
        except BaseException:
            os.close(self._lock)
            raise

    @property
    def partial(self) -> Path:
        """Where the finished trials of an unfinished campaign lie."""
        return self.path / PARTIAL

    @property
    def finished(self) -> bool:
        """Whether the final files are all in place."""
        return not self.partial.exists()

    def missing(self) -> list[int]:
        """Which trials are not there, in order; where all are, which are damaged."""
        return [] if self.finished else self._journals.missing()

    def done(self) -> int:
        """How many trials have been finished, damaged or not."""
        return self.total if self.finished else self._journals.done()

    def finish(
        self, run: Mapping[str, Any] | None = None, trials: Iterable[tuple[Tables, dict[str, Any]]] | None = None
    ) -> Results:
        """Assemble the final files, put them in place, and drop the partial ones.

        Args:
            run: What campaign.json is to say under `run` beside what it says already.
            trials: The tables and the row of each trial, in order; None: what was written to `partial`.

        Raises:
            ClearwayError: a trial is missing, or the disk is full; nothing is lost then.
        """
        if not self.finished:
            new = self.partial / "final"
            with _writing(self.path):
                shutil.rmtree(new, ignore_errors=True)
                for kind in FILES.values():
                    (new / kind.path).parent.mkdir(parents=True, exist_ok=True)
                assemble(self._finished() if trials is None else trials, new, results_schema(self._schema), self.total)
                digests, folders = {}, {self.path}
                for file in sorted(p for p in new.rglob("*") if p.is_file()):
                    sync(file)
                    digests[file.relative_to(new).as_posix()] = digest(file)
                    place = self.path / file.relative_to(new)
                    place.parent.mkdir(exist_ok=True)
                    os.replace(file, place)
                    folders.add(place.parent)
                for folder in sorted(folders, reverse=True):
                    sync(folder)
                self._campaign["run"] |= {**(run or {}), DIGESTS: digests}
                digests[CAMPAIGN] = seal(self._campaign)
                _write_whole(self.path / CAMPAIGN, _pretty(self._campaign))
                os.replace(self.partial, self.path / _DONE)
                sync(self.path)
        shutil.rmtree(self.path / _DONE, ignore_errors=True)
        return open_results(self.path)

    def withdraw(self) -> None:
        """Take away what was begun, finished trials too: for a campaign that can't be completed as it was asked."""
        if not self.finished:
            for name in ("trials.parquet", "trials.csv", *(file.path for file in FILES.values())):
                (self.path / name).unlink(missing_ok=True)
            shutil.rmtree(self.partial, ignore_errors=True)
            (self.path / CAMPAIGN).unlink(missing_ok=True)
            for folder in {file.path.rpartition("/")[0] for file in FILES.values()}:
                with suppress(OSError):  # it holds something else too
                    (self.path / folder).rmdir()

    def close(self) -> None:
        """Let go of the directory."""
        if self._lock >= 0:
            os.close(self._lock)
        self._lock = -1

    def __enter__(self) -> TrialStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _finished(self) -> Iterator[tuple[Tables, dict[str, Any]]]:
        if missing := self.missing():
            raise ClearwayError(
                f"trial {missing[0]} is missing or damaged; run the campaign again with --resume", file=self.partial
            )
        for index in range(self.total):
            if (trial := self._journals.read(index)) is None:
                raise ClearwayError(f"trial {index} is damaged; --resume runs it again", file=self.partial)
            yield trial

    def _begin(self, asked: dict[str, Any], run: dict[str, Any], resume: bool) -> dict[str, Any]:
        campaign = self._said(asked, run)
        for left in self.path.glob(f"{PARTIAL}-*"):  # by a process that was killed while it wrote campaign.json
            left.unlink()
        shutil.rmtree(self.path / _KEPT, ignore_errors=True)
        if not (self.path / CAMPAIGN).exists():
            foreign = sorted(p.name for p in self.path.iterdir() if not p.name.startswith(PARTIAL))
            if foreign:
                raise ClearwayError(
                    f"is not empty and holds no Clearway results ({foreign[0]} is there); choose another directory",
                    file=self.path,
                )
            try:
                self.partial.mkdir(exist_ok=True)  # before campaign.json: one without the other means finished
                sync(self.path)
                _write_whole(self.path / CAMPAIGN, _pretty(campaign))
            except OSError as error:
                shutil.rmtree(self.partial, ignore_errors=True)
                raise ClearwayError(f"cannot be written: {error.strerror or error}", file=self.path) from error
            return campaign
        old = read_campaign(self.path)
        if not resume:
            refuse_results(self.path)
        for name, value in (json.loads(json.dumps(asked)) | {"trials": self.total}).items():
            if (differs := first_in_json(name, old.get(name), value)) is not None:
                at, had, asks = differs
                raise ClearwayError(
                    f"cannot resume: its campaign differs in {at}: it has {_brief(had)}, now {_brief(asks)} is asked; put back "
                    "what it was, or choose another directory",
                    file=self.path / CAMPAIGN,
                )
        return old

    def _said(self, asked: dict[str, Any], run: dict[str, Any]) -> dict[str, Any]:
        return {"format": "clearway results", "schema": SCHEMA, **asked, "trials": self.total, "run": run}

    def _grow(self, asked: dict[str, Any], run: dict[str, Any], kept: Mapping[int, int]) -> dict[str, Any]:
        """Begin a campaign in place of another, with its trials that are the same. Whenever it is stopped, none is lost for
        good: a trial that does not bear the campaign's key is run again."""
        campaign, old = self._said(asked, run), read_campaign(self.path)
        with _writing(self.path):
            fresh = self.path / _KEPT
            shutil.rmtree(fresh, ignore_errors=True)
            fresh.mkdir()
            for index, (trial, row) in zip(kept, _earlier(self.path, old, kept.values()), strict=True):
                if trial is not None:
                    write_partial(fresh, self.key, index, trial, row)
            self.partial.mkdir(exist_ok=True)
            for file in self.partial.glob(JOURNALS):
                file.unlink()
            for file in fresh.iterdir():
                os.replace(file, self.partial / file.name)
            fresh.rmdir()
            sync(self.path)
            _write_whole(self.path / CAMPAIGN, _pretty(campaign))
        return campaign


def _key(asked: Mapping[str, Any], total: int) -> str:
    """What tells a campaign's partial files from another's."""
    return hashlib.sha256(json.dumps([SCHEMA, asked, total], sort_keys=True).encode()).hexdigest()


def _earlier(
    path: Path, campaign: Mapping[str, Any], numbers: Iterable[int]
) -> Iterator[tuple[Trial | None, dict[str, Any]]]:
    """Trials of a campaign, finished or not, with their rows; None where one is not there."""
    if not (path / PARTIAL).exists():
        results = open_results(path)
        for number in numbers:
            yield results.trial(number), results.trials.slice(number, 1).to_pylist()[0]
        return
    key = _key(
        {n: v for n, v in campaign.items() if n not in ("format", "schema", "trials", "run")}, campaign["trials"]
    )
    journals = Journals(path / PARTIAL, key, campaign["trials"])
    journals.done()
    for number in numbers:
        found = journals.read(number)
        yield (None, {}) if found is None else (from_tables(found[0]), found[1])


def refuse_results(path: Path) -> None:
    """Nothing, unless `path` already holds results: they are never overwritten.

    Raises:
        ClearwayError: it does.
    """
    if not os.path.exists(path / CAMPAIGN):
        return
    unfinished = (path / PARTIAL).exists()
    state = "an unfinished campaign" if unfinished else "the results of a campaign"
    go_on = f"complete it with `{how_to_go_on(path)}`, or " if unfinished else ""
    raise ClearwayError(f"already holds {state}; {go_on}choose another directory", file=path)


def write_partial(folder: Path, key: str, index: int, trial: Trial, row: Mapping[str, Any]) -> None:
    """Write one finished trial into the `partial` folder of the store with `key`; any process may.

    Raises:
        ClearwayError: it can't be written, such as on a full disk.
    """
    duration = float(trial.t[-1]) if len(trial.t) else None
    put_partial(folder, record(key, index, to_tables(index, trial), {"duration": duration, **row, "trial": index}))


def put_partial(folder: Path, records: bytes) -> None:
    """Put finished trials, as `write_partial` wrote them elsewhere, into the `partial` folder of a store.

    Raises:
        ClearwayError: as for `write_partial`.
    """
    with _writing(folder):
        append(folder, records)


def results_schema(schema: Any) -> Any:
    """The Arrow schema of `trials.parquet`, given that of a row; the first two columns and the last are the store's own."""
    first = [
        pa.field("trial", pa.int32(), metadata={"unit": "", "title": "number, from 0; the key of every other file"}),
        pa.field(
            "id", pa.string(), metadata={"unit": "", "title": "suite/scenario/robot/navigator, and the set-up if any"}
        ),
    ]
    duration = pa.field(
        "duration", pa.float64(), metadata={"unit": "s", "title": "of the whole trial, simulated or recorded"}
    )
    return pa.schema([*first, *(f for f in schema if f.name not in ("trial", "id")), duration])


def _brief(value: Any) -> str:
    """A value of campaign.json, such as a whole robot, in no more than a line."""
    text = json.dumps(value)
    return "nothing" if value is None else text if len(text) <= 80 else f"{text[:77]}..."


def _pretty(campaign: Mapping[str, Any]) -> bytes:
    return (json.dumps(campaign, indent=2, ensure_ascii=False) + "\n").encode("utf-8", "backslashreplace")


def _write_whole(file: Path, content: bytes) -> None:
    """Put `content` into `file` whole or not at all, and on the disk for good."""
    new = (
        file.with_name(f"{PARTIAL}-{file.name}-{os.getpid()}")
        if file.name == CAMPAIGN
        else file.with_suffix(f".{os.getpid()}")
    )
    try:
        with open(new, "wb") as f:
            f.write(content)
            f.flush()
            os.fsync(f.fileno())
        os.replace(new, file)
        sync(file.parent)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


@contextmanager
def _writing(what: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ClearwayError(
            f"cannot be written: {error.strerror or error}; what is finished is kept, --resume goes on from there",
            file=error.filename or what,
        ) from error


def _lock(path: Path) -> int:
    """Make the directory and lock it against other processes; the lock goes with the process, however it ends."""
    try:
        make_folder(path)
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise ClearwayError(f"cannot be made: {error.strerror}", file=path) from error
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(handle)
        raise ClearwayError(
            "another process is writing to this directory; wait for it, or choose another", file=path
        ) from error
    return handle

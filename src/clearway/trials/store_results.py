"""Reads a results directory: the table of trials, and any trial in full."""

from __future__ import annotations

import hashlib
import json
import os
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from clearway.errors import ClearwayError
from clearway.reading import read_json
from clearway.trials.journal import count
from clearway.trials.keeping import KEEPS, Keep, is_kept, is_outline
from clearway.trials.store_tables import FILES, Tables
from clearway.trials.trial import Trial
from clearway.trials.trial_tables import from_tables

SCHEMA = 9
"""Version of the layout; goes up when a file changes so that an older Clearway would misread it."""

CAMPAIGN, PARTIAL = "campaign.json", ".partial"

SHARD = "shard"
"""What campaign.json calls the part of a campaign that a directory holds, if it is no whole one."""

SIMULATIONS = "simulations"
"""What campaign.json calls how many trials each simulation of a campaign gives that has too many to tell of each."""

DIGESTS = "sha256"
"""What campaign.json calls, under `run`, the digests of the finished files."""

_READING = (pa.ArrowException, OSError, KeyError, ValueError, TypeError, IndexError)


class Results:
    """A finished results directory, read-only.

    Attributes:
        path: The directory.
        campaign: What campaign.json holds: what was asked, versions, seeds, machine.
    """

    def __init__(self, path: Path, campaign: dict[str, Any]) -> None:
        self.path, self.campaign = path, campaign
        self._files: dict[str, _File] = {}

    @cached_property
    def trials(self) -> pa.Table:
        """One row a trial, as in trials.parquet; a column's unit is in its field's metadata."""
        return _reading(
            self.path / "trials.parquet",
            lambda file: pq.read_table(file, memory_map=False, page_checksum_verification=True),
        )

    @cached_property
    def timing(self) -> pa.Table:
        """Wall-clock figures: a row a trial (`trial`) and figure (`name`, `value`)."""
        return _reading(self.path / FILES["timing"].path, pq.read_table)

    @property
    def runs(self) -> dict[str, list[int]]:
        """The numbers of the trials of each simulation that several robots share, by the column `run`; what they did together
        `clearway.indicators.fleet` tells."""
        found: dict[str, list[int]] = {}
        for number, run in enumerate(self.trials["run"].to_pylist() if "run" in self.trials.column_names else ()):
            if run:
                found.setdefault(run, []).append(number)
        return found

    def __len__(self) -> int:
        return int(self.campaign["trials"])

    def __iter__(self) -> Iterator[Trial]:
        return (self.trial(i) for i in range(len(self)))

    def __repr__(self) -> str:
        return f"<Results {self.path}: {len(self)} trials>"

    def trial(self, index: int) -> Trial:
        """Trial number `index` (the column `trial`) in full.

        Raises:
            ClearwayError: there is no such trial, it was not kept (`--keep`), or a file is damaged.
        """
        trial = self.remains(index)
        if is_outline(trial):
            raise ClearwayError(
                f"of trial {index} only the row in the table was kept (--keep {self.keep}); `clearway rerun {self.path} --trial "
                f"{index} --out DIR` runs it again and keeps all of it",
                file=self.path,
            )
        return trial

    def remains(self, index: int) -> Trial:
        """Trial number `index` in full, or what is left of it where it was not kept: see `keeping.outline`.

        Raises:
            ClearwayError: there is no such trial, or a file is damaged.
        """
        tables = self.tables(index)
        trial: Trial = _reading(self.path / FILES["attempts"].path, lambda _: from_tables(tables))
        return trial

    @property
    def keep(self) -> Keep:
        """What was to be kept of each trial."""
        plan = self.campaign.get("plan")
        said = plan.get("keep") if isinstance(plan, dict) else None
        return said if said in KEEPS else "trajectories"

    def kept(self, row: Mapping[str, Any]) -> bool:
        """Whether all of the trial with this row in the table was kept."""
        return is_kept(self.keep, row)

    def tables(self, index: int) -> Tables:
        """The rows of trial number `index` in each of the files, by their names in `FILES`.

        Raises:
            ClearwayError: as for `trial`.
        """
        if not 0 <= index < len(self):
            raise ClearwayError(f"there is no trial {index}; it holds 0 to {len(self) - 1}", file=self.path)
        tables: Tables = {name: self._file(name).rows("trial", index) for name in FILES if name != "fixtures"}
        if tables["attempts"].num_rows != 1:
            raise ClearwayError(f"is damaged: it has no trial {index}", file=self.path / FILES["attempts"].path)
        key = tables["attempts"].column("fixtures")[0].as_py()
        tables["fixtures"] = self._file("fixtures").rows("fixtures", key)
        return tables

    def _file(self, name: str) -> _File:
        if name not in self._files:
            self._files[name] = _File(self.path / FILES[name].path, FILES[name].schema)
        return self._files[name]


def open_results(path: str | Path) -> Results:
    """Open a finished results directory.

    Raises:
        ClearwayError: not a results directory, unfinished, damaged, or written by a newer version of Clearway.
    """
    folder = Path(path)
    campaign = read_campaign(folder)
    if (folder / PARTIAL).exists():
        done = count(folder / PARTIAL)
        raise ClearwayError(
            f"unfinished: {done} of {campaign['trials']} trials are done; complete it with `{how_to_go_on(folder)}`",
            file=folder,
        )
    for name in ("trials.parquet", *(file.path for file in FILES.values())):
        if not (folder / name).is_file():
            raise ClearwayError("is missing: the results directory is damaged", file=folder / name)
        if _reading(folder / name, digest) != campaign["run"].get(DIGESTS, {}).get(name):
            raise ClearwayError(
                "is damaged or was edited: its SHA-256 is not the one in campaign.json; restore it from a copy, or run "
                "the campaign again",
                file=folder / name,
            )
    if seal(campaign) != campaign["run"][DIGESTS].get(CAMPAIGN):
        raise ClearwayError(
            "was edited: what it says is no longer what was run; restore it from a copy", file=folder / CAMPAIGN
        )
    results = Results(folder, campaign)
    for name in FILES:
        results._file(name)
    return results


def read_campaign(folder: Path) -> dict[str, Any]:
    """What campaign.json holds.

    Raises:
        ClearwayError: it is missing, damaged, not ours, or from a newer version.
    """
    file = folder / CAMPAIGN
    if not os.path.isdir(folder):
        raise ClearwayError("no such directory" if not os.path.exists(folder) else "is not a directory", file=folder)
    if not os.path.exists(file):
        raise ClearwayError("is not a Clearway results directory: it has no campaign.json", file=folder)
    try:
        campaign = read_json(file)
    except ClearwayError as error:
        raise ClearwayError(f"is damaged: it {error.problem}", file=file) from error
    if not isinstance(campaign, dict) or campaign.get("format") != "clearway results":
        raise ClearwayError("was not written by Clearway", file=file)
    schema = campaign.get("schema")
    if not isinstance(campaign.get("run"), dict) or not isinstance(campaign["run"].get(DIGESTS, {}), dict):
        raise ClearwayError("is damaged: it does not say who ran it", file=file)
    if type(schema) is not int or type(campaign.get("trials")) is not int or campaign["trials"] < 0:
        raise ClearwayError("is damaged: it lacks its schema or its number of trials", file=file)
    if schema > SCHEMA:
        raise ClearwayError(
            f"was written by a newer Clearway ({campaign.get('clearway', '?')}, schema {schema}; this one reads up to "
            f"schema {SCHEMA}); upgrade Clearway",
            file=file,
        )
    if schema < SCHEMA:
        raise ClearwayError(
            f"was written by an older Clearway (schema {schema}; this one reads schema {SCHEMA}); run it again",
            file=file,
        )
    return campaign


def digest(file: Path) -> str:
    """The SHA-256 of a file, in hexadecimal."""
    with open(file, "rb") as f:
        return hashlib.file_digest(f, "sha256").hexdigest()


def seal(campaign: Mapping[str, Any]) -> str:
    """The digest of what a finished campaign.json says, itself left out."""
    run = campaign["run"]
    others = {name: value for name, value in run[DIGESTS].items() if name != CAMPAIGN}
    said = json.dumps({**campaign, "run": {**run, DIGESTS: others}}, sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()


def how_to_go_on(folder: Path) -> str:
    """The command that completes the unfinished results in `folder`."""
    run = read_campaign(folder)["run"]
    if "shards" in run:
        return f"clearway merge SHARD... --out {folder}"
    plan = run.get("test_plan")
    return f"clearway run --resume {folder}" if plan is None else f"clearway score {plan} --out {folder} --resume"


class _File:
    """A Parquet file whose rows are grouped by a sorted key column; reads the rows of one key."""

    def __init__(self, path: Path, schema: Any) -> None:
        self._path = path
        self._file = _reading(
            path, lambda file: pq.ParquetFile(file, memory_map=False, page_checksum_verification=True)
        )
        missing = [n for n in schema.names if n not in self._file.schema_arrow.names]
        if missing:
            raise ClearwayError(f"is damaged: it has no column {missing[0]!r}", file=path)
        self._cached: tuple[int, pa.Table, Any] = (-1, None, None)
        self._bounds: tuple[list[Any], list[Any], list[int]] | None = None

    def rows(self, column: str, key: Any) -> pa.Table:
        """The rows whose `column` is `key`, in order."""
        return _reading(self._path, lambda _: self._rows(column, key))

    def _rows(self, column: str, key: Any) -> pa.Table:
        first, last, numbers = self._groups(column)
        for at in range(bisect_left(last, key), bisect_right(first, key)):
            if self._cached[0] != numbers[at]:
                table = self._file.read_row_group(numbers[at]).combine_chunks()
                self._cached = (numbers[at], table, table.column(column).to_numpy())
            _, table, keys = self._cached
            begin, end = np.searchsorted(keys, key, "left"), np.searchsorted(keys, key, "right")
            if begin < end:
                return table.slice(begin, end - begin)
        return self._file.schema_arrow.empty_table()

    def _groups(self, column: str) -> tuple[list[Any], list[Any], list[int]]:
        """The least and the greatest key of each row group that has rows, and its number."""
        if self._bounds is None:
            meta = self._file.metadata
            at = next(i for i in range(meta.num_columns) if meta.schema.column(i).path == column)
            groups = [(i, meta.row_group(i)) for i in range(meta.num_row_groups)]
            seen = [(i, group.column(at).statistics) for i, group in groups if group.num_rows]
            if not all(s is not None and s.has_min_max for _, s in seen):
                raise ValueError(f"its row groups do not say which {column!r} they hold")
            self._bounds = [s.min for _, s in seen], [s.max for _, s in seen], [i for i, _ in seen]
        return self._bounds


def _reading(file: Path, read: Any) -> Any:
    try:
        return read(file)
    except ClearwayError:
        raise
    except _READING as error:
        text = " ".join(str(error).split())
        raise ClearwayError(f"is damaged or not what it should be: {text[:200]}", file=file) from error

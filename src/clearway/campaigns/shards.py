"""A campaign run in shards, each by itself on a machine of its own, and put together again: the same bytes however it was split.

A shard is a results directory like any other. Its simulations are every N-th one of the campaign, so that trials of one kind,
which stand together and cost alike, are shared out evenly.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from clearway.campaigns.progress import ProgressCallback, silent
from clearway.campaigns.provenance import now
from clearway.errors import ClearwayError, shown
from clearway.indicators import row_schema
from clearway.trials.differences import first_in_json
from clearway.trials.store import Results, TrialStore, open_results, refuse_results
from clearway.trials.store_results import PARTIAL, SHARD, read_campaign
from clearway.trials.store_tables import Tables

MOST = 100_000
"""Shards of a campaign: more than any cluster takes as one array of jobs."""
_NOT_ASKED = ("format", "schema", "trials", "run", SHARD)
"""What campaign.json holds beside what was asked of the whole campaign."""


@dataclass(frozen=True, slots=True)
class Shard:
    """One of the parts of a campaign that are run apart.

    Attributes:
        number: Which one, from 1.
        of: How many there are.

    Raises:
        ClearwayError: there is no such part.
    """

    number: int
    of: int

    def __post_init__(self) -> None:
        if not (1 <= self.number <= self.of <= MOST):
            raise ClearwayError(
                f"{self} is no shard: 1/{self.of} to {self.of}/{self.of} are"
                if 1 <= self.of <= MOST
                else f"{self} is no shard: a campaign has 1 to {MOST} of them",
                field="shard",
            )

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def part(self, runs: NDArray[np.int64]) -> NDArray[np.int64]:
        """The numbers of its trials in the campaign; those of one simulation stay together.

        Args:
            runs: How many trials each simulation of the campaign gives.

        Raises:
            ClearwayError: there are none.
        """
        count = len(runs)
        if self.number > count:
            raise ClearwayError(
                f"the shard {self} has no trial: the campaign has {count} simulations, so at most {count} shards",
                field="shard",
            )
        mine = np.arange(count) % self.of == self.number - 1
        return np.flatnonzero(np.repeat(mine, runs))

    def to_json(self, total: int) -> dict[str, int]:
        """What campaign.json holds of it.

        Args:
            total: How many trials the whole campaign has.
        """
        return asdict(self) | {"total": total}


def read_shard(text: str) -> Shard:
    """The shard that is written as `3/40`, the third of forty.

    Raises:
        ClearwayError: it is written otherwise, or there is no such shard.
    """
    if not (found := re.fullmatch(r"\s*(\d{1,9})\s*/\s*(\d{1,9})\s*", text, re.ASCII)):
        raise ClearwayError(f"{shown(text)} is no shard; 3/40 is the third of forty", field="shard")
    return Shard(*map(int, found.groups()))


def shard_of(campaign: dict[str, Any], file: Path) -> Shard | None:
    """Which shard a campaign.json is of; None: a whole campaign.

    Args:
        campaign: What it holds.
        file: Where, for the error.

    Raises:
        ClearwayError: it says something else.
    """
    said = campaign.get(SHARD)
    if said is None:
        return None
    wanted = ("number", "of", "total")
    if not isinstance(said, dict) or sorted(said) != sorted(wanted) or any(type(said[n]) is not int for n in wanted):
        raise ClearwayError(f"is damaged: {shown(said)} is no shard", file=file, field=SHARD)
    return Shard(said["number"], said["of"])


def merge_shards(folders: Iterable[Path], out: Path, progress: ProgressCallback | None = None) -> Results:
    """Put the shards of a campaign together: the same files as if it had been run in one piece.

    Whenever it is stopped, the shards are what they were, and the same call begins again.

    Args:
        folders: The results directories of all shards, in any order.
        out: The results directory of the whole.
        progress: Told how far it is.

    Raises:
        ClearwayError: a shard is missing, there twice, unfinished, damaged, of another campaign or none at all; or `out` can't be
            used.
    """
    out, tell = Path(out), progress or silent
    if not (out / PARTIAL).exists():
        refuse_results(out)
    shards = _together([Path(folder) for folder in folders])
    results = [open_results(folder) for folder in shards]
    first = results[0].campaign
    asked, total = {name: value for name, value in first.items() if name not in _NOT_ASKED}, first[SHARD]["total"]
    if (held := sum(len(one) for one in results)) != total:
        raise ClearwayError(f"the shards hold {held} trials and their campaign has {total}; run them again", file=out)
    with TrialStore(out, asked, total, row_schema(), run=_run(results), resume=(out / PARTIAL).exists()) as store:
        try:
            return store.finish({"merged": now()}, trials=_counted(results, total, tell))
        except BaseException as error:
            store.withdraw()
            with suppress(OSError):  # it holds something else
                out.rmdir()
            if isinstance(error, ClearwayError) and error.problem.startswith("cannot be written"):
                problem = error.problem.partition(";")[0]
                raise ClearwayError(f"{problem}; the shards are as they were", file=error.file) from error
            raise


def _together(folders: Sequence[Path]) -> list[Path]:
    """The folders in the order of their shards.

    Raises:
        ClearwayError: they are not the shards of one campaign, each once.
    """
    found: dict[int, Path] = {}
    first: dict[str, Any] = {}
    for folder in folders:
        campaign = read_campaign(folder)
        shard = shard_of(campaign, folder)
        if shard is None:
            raise ClearwayError(
                "holds a whole campaign, and no shard of one: it has nothing to be merged with", file=folder
            )
        if shard.number in found:
            raise ClearwayError(f"shard {shard} is there twice: it is in {found[shard.number]} too", file=folder)
        found[shard.number] = folder
        first = first or campaign
        for name in sorted({*first, *campaign} - {"format", "schema", "trials", "run"}):
            was, now_ = ({k: v for k, v in c.get(name, {}).items() if k != "number"} if name == SHARD else c.get(name)
                         for c in (first, campaign))  # fmt: skip
            if (differs := first_in_json(name, was, now_)) is not None:
                at, other, own = differs
                raise ClearwayError(
                    f"is no shard of the campaign that {folders[0]} is one of: they differ in {at}, which is {shown(own)} "
                    f"here and {shown(other)} there",
                    file=folder,
                )
    if not found:
        raise ClearwayError("say which shards are to be merged")
    of = first[SHARD]["of"]
    if lacking := [number for number in range(1, of + 1) if number not in found]:
        named = ", ".join(map(str, lacking[:10])) + (f" and {len(lacking) - 10} more" if len(lacking) > 10 else "")
        one = len(lacking) == 1
        raise ClearwayError(
            f"{'shard' if one else 'shards'} {named} of {of} {'is' if one else 'are'} missing; run "
            f"{'it' if one else 'them'} with --shard {lacking[0]}/{of}{'' if one else ' and so on'}, or name the "
            f"{'directory' if one else 'directories'} too"
        )
    return [found[number] for number in range(1, of + 1)]


def _in_order(results: Sequence[Results]) -> Iterator[tuple[Tables, dict[str, Any]]]:
    """The trials of the whole campaign: a simulation of each shard in turn, until all have had their last."""
    runs = [_runs(one) for one in results]
    number = 0
    for one, run in itertools.cycle(zip(results, runs, strict=True)):
        numbers = next(run, None)
        if numbers is None:
            return
        for index in numbers:
            yield _renumbered(one, index, number)
            number += 1


def _runs(results: Results) -> Iterator[list[int]]:
    """The numbers of the trials of each simulation, in order."""
    for _, run in itertools.groupby(enumerate(results.trials["run"].to_pylist()), key=lambda one: one[1] or one[0]):
        yield [number for number, _ in run]


def _renumbered(results: Results, index: int, number: int) -> tuple[Tables, dict[str, Any]]:
    tables = results.tables(index)
    for name, table in tables.items():
        if "trial" in table.column_names:
            at = table.column_names.index("trial")
            numbers = pa.array([number] * table.num_rows, table.schema.field(at).type)
            tables[name] = table.set_column(at, table.schema.field(at), numbers)
    return tables, results.trials.slice(index, 1).to_pylist()[0] | {"trial": number}


def _counted(results: Sequence[Results], total: int, tell: ProgressCallback) -> Iterator[tuple[Tables, dict[str, Any]]]:
    done = 0
    for done, trial in enumerate(_in_order(results), 1):
        yield trial
        tell(done, total)
    if done != total:
        raise ClearwayError(
            f"of the shards' {total} trials {total - done} have no place in their campaign; run them again"
        )


def _run(results: Sequence[Results]) -> dict[str, Any]:
    """Who ran it, when and where: as the first shard says, with what each says for itself."""
    runs = [one.campaign["run"] for one in results]
    about = ("system", "processor", "cores", "started", "finished")
    shards = [{name: run.get(name) for name in about} for run in runs]
    first = {name: value for name, value in runs[0].items() if name != "sha256"}
    times = {"started": min(str(run["started"]) for run in runs), "finished": max(str(run["finished"]) for run in runs)}
    return first | times | {"shards": shards}

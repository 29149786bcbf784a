"""Puts finished trials together into the files of a results directory, some at a time: memory stays bounded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from clearway.trials.csv_table import without_formulas
from clearway.trials.store_tables import FILES, Tables

TRIALS_A_GROUP = 32
"""Trials in one row group of the files of trajectories and diagnostics, at least: it follows from the trials alone, so that the
bytes don't depend on who wrote when."""
MOST_GROUPS = 2048
"""Row groups of a file, unless they would be large: what a file says of each of them is held in memory, written and read."""
LARGE = 1 << 18
"""Rows of a large group: it ends there, however few trials it has beyond the least."""
ROWS_A_GROUP = 512 * TRIALS_A_GROUP
"""Rows in one row group of the table of trials."""


def assemble(trials: Iterable[tuple[Tables, dict[str, Any]]], folder: Path, schema: Any, total: int) -> None:
    """Write the final files.

    Args:
        trials: The tables and the row of each, in order.
        folder: Where to; it has the folders of `FILES`.
        schema: The Arrow schema of the table of trials.
        total: How many trials there are.
    """
    fixtures: dict[str, pa.Table] = {}
    with ExitStack() as files:

        def parquet(path: str, schema: Any) -> pq.ParquetWriter:
            return files.enter_context(pq.ParquetWriter(folder / path, schema, **_layout(schema)))

        writers = {name: parquet(file.path, file.schema) for name, file in FILES.items() if name != "fixtures"}
        table = parquet("trials.parquet", schema)
        text = files.enter_context(pyarrow.csv.CSVWriter(folder / "trials.csv", schema))

        def written() -> Iterator[pa.Table]:
            """The rows of one group after another, when their trials are written."""
            for group in _groups(trials, total):
                for tables, _ in group:
                    fixtures.setdefault(tables["fixtures"].column("fixtures")[0].as_py(), tables["fixtures"])
                for name, writer in writers.items():
                    _write(writer, [tables[name] for tables, _ in group])
                yield pa.Table.from_pylist([row for _, row in group], schema=schema)

        for rows in _by_size(written()):
            text.write_table(without_formulas(_write(table, rows)))
    plans = [fixtures[k] for k in sorted(fixtures)] or [FILES["fixtures"].schema.empty_table()]
    layout = _layout(FILES["fixtures"].schema)
    pq.write_table(pa.concat_tables(plans).combine_chunks(), folder / FILES["fixtures"].path, **layout)


def _groups(
    trials: Iterable[tuple[Tables, dict[str, Any]]], total: int
) -> Iterator[list[tuple[Tables, dict[str, Any]]]]:
    """The trials of one row group after another."""
    most, group, rows = max(TRIALS_A_GROUP, -(-total // MOST_GROUPS)), list[tuple[Tables, dict[str, Any]]](), 0
    for trial in trials:
        group.append(trial)
        rows += max(table.num_rows for table in trial[0].values())
        if len(group) == most or (len(group) >= TRIALS_A_GROUP and rows >= LARGE):
            yield group
            group, rows = [], 0
    if group:
        yield group


def _by_size(tables: Iterable[pa.Table]) -> Iterator[list[pa.Table]]:
    """The tables that make one row group of the table of trials after another."""
    some, rows = list[pa.Table](), 0
    for table in tables:
        some.append(table)
        rows += table.num_rows
        if rows >= ROWS_A_GROUP:
            yield some
            some, rows = [], 0
    if some:
        yield some


def _write(writer: pq.ParquetWriter, tables: list[pa.Table]) -> pa.Table:
    """Write tables as one row group."""
    together = pa.concat_tables(tables).combine_chunks()
    writer.write_table(together, row_group_size=max(1, together.num_rows))
    return together


def _layout(schema: Any) -> dict[str, Any]:
    """How a Parquet file is written: measured numbers hardly repeat, so a dictionary only makes them larger."""
    words = [f.name for f in schema if not (pa.types.is_floating(f.type) or pa.types.is_nested(f.type))]
    return {"compression": "zstd", "compression_level": 3, "version": "2.6", "use_dictionary": words,
            "write_page_checksum": True}  # fmt: skip

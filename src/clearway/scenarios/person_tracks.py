"""The ways of recorded people, from the CSV files that a scenario names."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.reading.bounded import read_bytes
from clearway.reading.limits import POINTS

MOST = 10 << 20
"""Bytes of such a file."""
COLUMNS = ("t", "x", "y")


def with_tracks(table: dict[str, Any], path: Path) -> dict[str, Any]:
    """A scenario's table, or a suite's, in which the `track` of nobody is the name of a file.

    Args:
        table: As it was read.
        path: Its file, from whose folder others are seen.

    Raises:
        ClearwayError: such a file can't be read, or is no table of numbers with these columns.
    """
    changed = dict(table)
    if isinstance(people := table.get("people"), list):
        changed["people"] = [_followed(person, path) for person in people]
    if isinstance(scenarios := table.get("scenario"), list):
        changed["scenario"] = [with_tracks(one, path) if isinstance(one, dict) else one for one in scenarios]
    return changed


def _followed(person: Any, path: Path) -> Any:
    if not (isinstance(person, dict) and isinstance(person.get("track"), str)):
        return person
    return person | {"track": read_track(path.parent / person["track"])}


def read_track(file: Path) -> list[tuple[float, ...]]:
    """(t [s], x [m], y [m]) of each row of a CSV file with a header, which may have other columns too.

    Raises:
        ClearwayError: it can't be read, or is no table of numbers with these columns.
    """
    try:
        rows = list(csv.DictReader(read_bytes(file, MOST).decode("utf-8").splitlines(), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ClearwayError(f"is no CSV file: {error}", file=file) from error
    if missing := [name for name in COLUMNS if not rows or name not in rows[0]]:
        raise ClearwayError(f"has no column {missing[0]!r}; {', '.join(COLUMNS)} are needed (s, m, m)", file=file)
    if len(rows) > POINTS:
        raise ClearwayError(f"has {len(rows):,} rows; at most {POINTS:,} are", file=file)
    return [
        tuple(_number(row[name], f"row {k}, {name}", file) for name in COLUMNS) for k, row in enumerate(rows, start=1)
    ]


def _number(text: str | None, field: str, file: Path) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise ClearwayError(f"{text!r} is no number", file=file, field=field) from None

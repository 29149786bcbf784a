"""The ways of recorded people, from the CSV files that a scenario names."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError, shown
from clearway.reading.bounded import read_bytes
from clearway.reading.limits import POINTS, ROW, SAMPLES, TRACK

COLUMNS = ("t", "x", "y")

_Track = list[tuple[float, ...]]


def with_tracks(table: dict[str, Any], path: Path) -> dict[str, Any]:
    """A scenario's table, or a suite's, in which the `track` of nobody is the name of a file.

    Args:
        table: As it was read.
        path: Its file, from whose folder others are seen.

    Raises:
        ClearwayError: such a file can't be read, or is no table of numbers with these columns; or all have too many rows.
    """
    return _Tracks(path).put_into(table)


class _Tracks:
    """The tracks that one file names, each read once, and how many samples they have where they stand."""

    def __init__(self, path: Path) -> None:
        self._path, self._read, self._samples = path, dict[str, _Track](), 0

    def put_into(self, table: dict[str, Any]) -> dict[str, Any]:
        changed = dict(table)
        if isinstance(people := table.get("people"), list):
            changed["people"] = [self._followed(person) for person in people]
        if isinstance(scenarios := table.get("scenario"), list):
            changed["scenario"] = [self.put_into(one) if isinstance(one, dict) else one for one in scenarios]
        return changed

    def _followed(self, person: Any) -> Any:
        if not (isinstance(person, dict) and isinstance(name := person.get("track"), str)):
            return person
        if name not in self._read:
            self._read[name] = read_track(self._path.parent / name)
        self._samples += len(self._read[name])
        if self._samples > SAMPLES:
            raise ClearwayError(
                f"its people have tracks of more than {SAMPLES:,} samples together; leave some out, 10 a second are enough",
                file=self._path,
                field="people",
            )
        return person | {"track": self._read[name]}


def read_track(file: Path) -> _Track:
    """(t [s], x [m], y [m]) of each row of a CSV file with a header, which may have other columns too.

    Raises:
        ClearwayError: it can't be read, or is no table of numbers with these columns, or larger than is read.
    """
    try:
        lines = read_bytes(file, TRACK).decode("utf-8-sig").splitlines()
        if len(lines) > POINTS + 1:
            raise ClearwayError(f"has {len(lines) - 1:,} rows; at most {POINTS:,} are", file=file)
        for k, line in enumerate(lines, start=1):
            if len(line) > ROW:
                raise ClearwayError(f"has {len(line):,} characters; at most {ROW:,} are", file=file, field=f"line {k}")
        return list(_numbers(csv.reader(lines, strict=True), file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ClearwayError(f"is no CSV file: {error}", file=file) from error


def _numbers(rows: Iterator[list[str]], file: Path) -> Iterator[tuple[float, ...]]:
    head = next(rows, [])
    for name in COLUMNS:
        if head.count(name) != 1:
            has = "has no column" if name not in head else "has more than one column"
            raise ClearwayError(f"{has} {name!r}; {', '.join(COLUMNS)} are needed (s, m, m)", file=file)
    places = [(name, head.index(name)) for name in COLUMNS]
    for k, row in enumerate(filter(None, rows), start=1):
        yield tuple(_number(row[at] if at < len(row) else "", f"row {k}, {name}", file) for name, at in places)


def _number(text: str, field: str, file: Path) -> float:
    try:
        return float(text)
    except ValueError:
        raise ClearwayError(f"{shown(text)} is no number", file=file, field=field) from None

"""What the operators ticked beside the trials, from a table (CSV, or the JSON that the run sheet's page saves) of its own."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError, unknown
from clearway.reading import limits, read_bytes, read_json
from clearway.recordings.lab.test_plan import RecordedTrialSpec, TestPlan

COLUMNS = {
    "trial": "number", "no.": "number", "start": "start", "driven": "attempted", "touched": "contact", "contact": "contact",
    "person helped": "intervention", "helped": "intervention", "help": "intervention", "stopped": "stopped", "stop": "stopped",
    "aborted": "aborted", "abort": "aborted", "recorded": "recorded", "file": "file", "remark": "note", "note": "note",
}  # fmt: skip
"""Headings, in small letters, and the trial's field that each is."""
YES, NO = ("x", "yes", "y", "true", "1", "\u2713", "\u2714"), ("no", "n", "false", "0")
TEXTS = ("start", "file", "note")
TIMED = ("contact", "intervention")
NUMBER = r"\d+(?:\.\d+)?"
TIMES = rf"{NUMBER} ?s(?:[;,] ?{NUMBER} ?s)*"
"""When it was instead of yes, s on the first source's clock: `12.5 s; 31 s`."""


def with_ticks(plan: TestPlan, folder: Path) -> TestPlan:
    """The plan with what the operators ticked; as it is where there is no such table, or not yet.

    A trial with anything in its row was driven, unless `driven` says no. An empty cell says nothing.

    Args:
        plan: The plan.
        folder: Its folder.

    Raises:
        ClearwayError: a heading, a number or a cell can't be read, or disagrees with the plan.
    """
    file = None if plan.test.ticks is None else folder / plan.test.ticks
    if file is None or not file.exists():
        return plan
    trials, lines = list(plan.trials), dict[int, str]()
    for line, row in _rows(file):
        cells = dict(_cells(row, file, line))
        index = _index(cells.pop("number", ""), len(trials), file, line)
        if index in lines:
            raise ClearwayError(f"trial {index + 1} is in {lines[index]}, too; one row a trial", file=file, field=line)
        lines[index] = line
        if cells:
            trials[index] = _ticked(trials[index], cells, file, line)
    return plan.model_copy(update={"trials": tuple(trials)})


def _rows(file: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Where each row is, and its cells by their headings."""
    if file.suffix.lower() == ".json":
        found = read_json(file)
        if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
            raise ClearwayError('is not a list of rows such as {"trial": 1, "touched": "no"}', file=file)
        yield from ((f"row {i}", row) for i, row in enumerate(found, 1))
        return
    try:
        text = read_bytes(file, limits.JSON).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ClearwayError("is not text in UTF-8; save it as CSV UTF-8", file=file) from error
    first = text.partition("\n")[0]
    reader = csv.reader(io.StringIO(text), delimiter=max(",;\t", key=first.count))
    try:
        heads = next(reader, [])
        for cells in reader:
            if len(cells) > len(heads) and any(c.strip() for c in cells[len(heads) :]):
                raise ClearwayError(
                    f"has {len(cells)} cells under {len(heads)} headings", file=file, field=f"line {reader.line_num}"
                )
            if any(c.strip() for c in cells):
                yield f"line {reader.line_num}", dict(zip(heads, cells, strict=False))
    except csv.Error as error:
        raise ClearwayError(f"is not CSV: {error}", file=file, field=f"line {reader.line_num}") from error


def _cells(row: Mapping[str, Any], file: Path, line: str) -> Iterator[tuple[str, str]]:
    """Fields of a trial with what is said of them."""
    for head, cell in row.items():
        name = str(head).strip().lower()
        if not name:
            continue
        if name not in COLUMNS:
            raise unknown("heading", name, COLUMNS, file=file, field=line)
        if text := "" if cell is None else str(cell).strip():
            yield COLUMNS[name], text


def _index(number: str, trials: int, file: Path, line: str) -> int:
    if not (number.isascii() and number.isdigit() and 1 <= int(number) <= trials):
        raise ClearwayError(
            f"{number!r} is no trial of the plan, which has 1 to {trials}", file=file, field=f"{line}: trial"
        )
    return int(number) - 1


def _ticked(trial: RecordedTrialSpec, cells: Mapping[str, str], file: Path, line: str) -> RecordedTrialSpec:
    said: dict[str, Any] = {"attempted": True}
    for name, text in cells.items():
        if name in TEXTS:
            said[name] = f"{trial.note}; {text}" if name == "note" and trial.note else text
        elif text.lower() in (*YES, *NO):
            said[name] = text.lower() in YES
        elif name in TIMED and re.fullmatch(TIMES, text):
            said |= {name: True, f"{name}_at": tuple(float(n) for n in re.findall(NUMBER, text))}
        else:
            raise ClearwayError(
                f"{text!r} is neither yes (x, 1) nor no (0){', nor when it was, as 12.5 s' if name in TIMED else ''}",
                file=file,
                field=f"{line}: {name}",
            )
    for name in ("contact", "intervention", "stopped", "aborted"):
        own = getattr(trial, name)
        if name in said and own is not None and own != said[name] and (own or name == "contact"):
            raise ClearwayError(
                f"is {str(said[name]).lower()} here and {str(own).lower()} in the plan",
                file=file,
                field=f"{line}: {name}",
            )
    if trial.file and "file" in said and said["file"] != trial.file:
        raise ClearwayError(
            f"is {said['file']!r} here and {trial.file!r} in the plan", file=file, field=f"{line}: file"
        )
    return trial.model_copy(update=said)

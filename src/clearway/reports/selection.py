"""Which trials a figure or a table is about: rows of the trials' table by their labels, and the representative one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from clearway.errors import ClearwayError, unknown
from clearway.indicators import COLUMNS, shown_digits
from clearway.reports import paper
from clearway.trials.store import Results
from clearway.trials.trial import AS_PLACED, ASSISTED, BROKEN_OFF, GOING_ON, NOT_RECORDED, UNUSABLE

Row: TypeAlias = Mapping[str, Any]
SELECTABLE = (*(column.name for column in COLUMNS if column.selectable), "trial")
"""What trials can be selected by."""

UNNAMED = "recorded"
"""The navigator of a test plan that names none."""


@dataclass(frozen=True, slots=True)
class System:
    """What is being tested.

    Attributes:
        robot: The robot, by its name.
        navigator: The navigator, by its name.
        setup: How long it may think, by the set-up's number; None: as long as it likes.
    """

    robot: str
    navigator: str
    setup: str | None = None

    def of(self, rows: Iterable[Row]) -> list[Row]:
        """Its rows, in order."""
        return [r for r in rows if system_of(r) == self]


class _Columns(dict[str, list[Any]]):
    """The columns of a table as lists, each made when it is first asked for; equal words are one object."""

    def __init__(self, table: Any) -> None:
        super().__init__()
        self.table, self.names = table, frozenset(table.column_names)

    def __missing__(self, name: str) -> list[Any]:
        if name not in self.names:
            raise KeyError(name)
        cells = self.table[name].to_pylist()
        one: dict[Any, Any] = {}
        self[name] = [one.setdefault(c, c) for c in cells] if cells and isinstance(cells[0], str) else cells
        return self[name]


class _View(Mapping[str, Any]):
    """A row of a table, of which nothing is copied: a hundred thousand rows of a hundred columns are a gigabyte as dicts."""

    __slots__ = ("_at", "_columns")

    def __init__(self, columns: _Columns, at: int) -> None:
        self._columns, self._at = columns, at

    def __getitem__(self, name: str) -> Any:
        return self._columns[name][self._at]

    def get(self, name: str, default: Any = None) -> Any:
        return self._columns[name][self._at] if name in self._columns.names else default

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns.table.column_names)

    def __len__(self) -> int:
        return len(self._columns.table.column_names)


def rows_in(table: Any) -> list[Row]:
    """The rows of an Arrow table, by column."""
    columns = _Columns(table)
    return [_View(columns, at) for at in range(table.num_rows)]


def system_of(row: Row) -> System:
    """What a row tested."""
    return System(row["robot"], row["navigator"], row.get("setup"))


def systems(rows: Iterable[Row]) -> list[System]:
    """What was tested, in the order of the campaign."""
    return list(dict.fromkeys(system_of(r) for r in rows))


def rows_of(results: Results, **selection: Any) -> list[Row]:
    """The rows whose columns have these values (one value, or a collection of which one must match).

    Raises:
        ClearwayError: an unknown column, or nothing is left; the message says what there is.
    """
    rows = rows_in(results.trials)
    for column, value in selection.items():
        if column not in SELECTABLE:
            raise unknown("selection", column, SELECTABLE)
        wanted = set(value) if isinstance(value, list | tuple | set | frozenset) else {value}
        found = [r for r in rows if r[column] in wanted]
        if not found:
            there = ", ".join(sorted({str(r[column]) for r in rows}))
            raise ClearwayError(f"no trial with {column} {value!r} among the selected; there is {there}", field=column)
        rows = found
    return rows


def table_of(results: Results, rows: Sequence[Row]) -> Any:
    """These rows as an Arrow table with the columns of the trials' table."""
    numbers = {number: i for i, number in enumerate(results.trials["trial"].to_pylist())}
    return results.trials.take([numbers[r["trial"]] for r in rows])


def configuration_of(row: Row) -> tuple[str, str, str]:
    """A row's suite, batch and configuration."""
    return row["suite"], row["batch"], row["configuration"]


def configurations(rows: Iterable[Row]) -> list[tuple[str, str, str]]:
    """(suite, batch, configuration) in the order of the campaign."""
    return list(dict.fromkeys(map(configuration_of, rows)))


def distinct(rows: Iterable[Row], column: str) -> list[Any]:
    """The values that a column has, sorted, without None."""
    return sorted({r[column] for r in rows if r[column] is not None})


def representative(rows: Sequence[Row]) -> Row | None:
    """The trial to show for these: at the lowest set speed, in the conditions of paper A's Fig. 5 where it was run in them.

    Of the successful ones among these the one with the median CT (the lower of the two in the middle, the first of
    several alike); without a success the first, for a figure must not hide that all of them failed. None: no rows.
    """
    if not rows:
        return None
    slowest = min((r["speed"] for r in rows), key=by_speed)
    there = [r for r in rows if r["speed"] == slowest]
    there = [r for r in there if _as_in_figure_5(r)] or there
    there = [r for r in there if not is_recorded(r) or r["duration"]] or there  # of some attempts nothing was recorded
    good = [r for r in there if r["success"] and r["CT"] is not None]
    return sorted(good, key=lambda r: (r["CT"], r["trial"]))[(len(good) - 1) // 2] if good else there[0]


def _as_in_figure_5(row: Row) -> bool:
    wanted = paper.FIGURE_5.get((row["batch"], row["configuration"]), {})
    return all(row[column] == value for column, value in wanted.items())


def driver(navigator: str) -> str:
    """A navigator's name in a sentence; who drove a recorded robot a test plan need not say."""
    return "an unnamed navigator" if navigator == UNNAMED else navigator


def is_recorded(row: Row) -> bool:
    """Whether a trial was measured; a table from before there were recordings has simulated ones only."""
    return row.get("source") == "recorded"


def moving_at_contact(row: Row) -> bool:
    """Whether the robot moved when it touched something."""
    return row.get("moved_at_contact") in ("robot", "both")


def placed_in_contact(row: Row) -> bool:
    """Whether the robot touched something as the trial began."""
    return str(row["reason"] or "").endswith(AS_PLACED)


def by_speed(speed: float | None) -> tuple[bool, float]:
    """Sorts set speeds, unknown ones last."""
    return speed is None, speed or 0.0


def at_speed(speed: float | None) -> str:
    """A set speed in words."""
    return "unknown set speed" if speed is None else f"{speed:g} m/s"


def with_uncertainty(row: Row, name: str, digits: int) -> str:
    """A trial's value of an indicator with its expanded uncertainty where it has one, such as `0.052 ± 0.003`."""
    u = row.get(f"{name}_U")
    if not u:
        return f"{row[name]:.{digits}f}"
    digits = shown_digits(u, digits)
    return f"{row[name]:.{digits}f} ± {u:.{digits}f}"


BOUNDED = {"MDO": 3, "PL": 2, "TCS": 1}
"""Indicators that a recording may tell within bounds only, with the digits that are shown."""


def between(row: Row, name: str) -> str:
    """The bounds of such an indicator, as `0.021 to 0.350` or `at least 0.021`; empty where it has none."""
    least, most = (row.get(f"{name}_at_{end}") for end in ("least", "most"))
    digits = BOUNDED.get(name, 0)
    if least is None:
        return ""
    return f"at least {least:.{digits}f}" if most is None else f"{least:.{digits}f} to {most:.{digits}f}"


def label(row: Row) -> str:
    """A trial's conditions in words, such as `SO parallel, 0.6 m/s, 0.15 m, 1.5 d_base, repetition 2`."""
    parts = [f"{row['batch']} {row['configuration']}", at_speed(row["speed"])]
    if row["obstacle_speed"] is not None:
        parts.append(f"obstacle {row['obstacle_speed']:g} m/s")
    if row["size"] is not None:
        parts.append(f"{row['size']:g} m")
    if row["gap"] is not None:
        parts.append(f"gap {row['gap']:g} d_base")
    return ", ".join([*parts, f"repetition {row['repetition']}"])


def verdict(row: Row) -> str:
    """`success`, or how the trial failed."""
    if row["success"]:
        return "success"
    if row["success"] is None:
        return f"{row['outcome']}, not judged"
    failure = str(row["failure"] or row["outcome"])
    if placed_in_contact(row):
        return "placed in contact"
    if failure == "aborted":
        return _broken_off(row) if is_recorded(row) else "gave up"
    return _FAILED.get(failure, failure.replace("_", " "))


def _broken_off(row: Row) -> str:
    """Why a measured attempt came to no end: a person, the robot or the data."""
    reason = str(row["reason"] or "")
    if reason.startswith(BROKEN_OFF):
        return "stopped"
    if reason.startswith(ASSISTED):
        return "helped"
    if UNUSABLE in reason:
        return "recording can't be used"
    if not row["duration"]:
        return NOT_RECORDED
    return "recording cut off" if reason.endswith(GOING_ON) else "did not finish"


_FAILED = {
    "DE": "missed the position", "OE": "missed the heading", "DE+OE": "missed position and heading", "timeout": "out of time",
    "collision at rest": "hit while it stood", "livelock": "made no headway",
}  # fmt: skip
"""How a trial failed, in words for people."""

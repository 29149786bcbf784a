"""What a column of `trials.parquet` is: declared once, with its name, kind, unit, text, and how to get it of a trial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from clearway.trials import Trial

Cell: TypeAlias = str | float | int | bool | None


class Kind(StrEnum):
    """What a column's cells are."""

    NUMBER = "number"
    SHARE = "share"  # a ratio, or a percentage
    COUNT = "count"
    BOOLEAN = "boolean"
    WORD = "word"

    @property
    def arrow(self) -> str:
        """The name of its Arrow type."""
        return {Kind.COUNT: "int64", Kind.BOOLEAN: "bool", Kind.WORD: "string"}.get(self, "double")


@dataclass(frozen=True, slots=True)
class Column:
    """A column that is no indicator.

    Attributes:
        name: Its name.
        kind: What its cells are.
        text: What it says, for the reference.
        value: Gives the cell of a trial; None where it does not apply.
        unit: Its unit, empty without one.
        selectable: Whether figures and tables can be narrowed by it.
        arrow: The name of its Arrow type, where that of its kind is too narrow.
    """

    name: str
    kind: Kind
    text: str
    value: Callable[[Trial], Cell]
    unit: str = ""
    selectable: bool = False
    arrow: str | None = None

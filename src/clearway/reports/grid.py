"""A table for people: a caption, columns, and cells that are already text. And how numbers become text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

NONE = "–"


@dataclass(frozen=True, slots=True)
class Column:
    """A heading.

    Attributes:
        name: What is printed.
        number: Whether its cells are numbers, set to the right.
        title: What a pointer on it shows; empty: nothing.
    """

    name: str
    number: bool = True
    title: str = ""


@dataclass(frozen=True, slots=True)
class Cell:
    """Text, a quieter second part, whether it stands out, and numbers of trials, each a link to its replay.

    Attributes:
        text: What is printed.
        small: A quieter second part.
        strong: Whether it stands out.
        trials: Numbers of trials, each a link to its replay.
    """

    text: str
    small: str = ""
    strong: bool = False
    trials: tuple[int, ...] = ()

    @property
    def plain(self) -> str:
        """All of it in a line."""
        return " ".join(
            [part for part in (self.text, *(f"#{n}" for n in self.trials), self.small.replace("\n", " ")) if part]
        )


Heads: TypeAlias = "list[Column | str]"
Rows: TypeAlias = "list[list[Cell | str]]"
"""What a table is made from; see `grid`."""


@dataclass(frozen=True, slots=True)
class Grid:
    """A table.

    Attributes:
        caption: What the table shows.
        columns: Its headings.
        rows: Each as many cells as columns.
        groups: Numbers of the rows before which a line is drawn.
    """

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: frozenset[int] = field(default_factory=frozenset)


def grid(
    caption: str, columns: Sequence[Column | str], rows: Sequence[Sequence[Cell | str]], groups: Sequence[int] = ()
) -> Grid:
    """A `Grid`; a plain string stands for a column of numbers, or for a cell."""
    return Grid(
        caption,
        tuple(c if isinstance(c, Column) else Column(c) for c in columns),
        tuple(tuple(c if isinstance(c, Cell) else Cell(c) for c in row) for row in rows),
        frozenset(groups),
    )


def text(name: str, title: str = "") -> Column:
    """A column of words."""
    return Column(name, number=False, title=title)


def num(value: float | None, digits: int = 2) -> str:
    """A number with `digits` decimals and a real minus sign."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:.{digits}f}".replace("-", "−")


def counted(n: int, what: str) -> str:
    """`n` of `what`, which is more than one unless `n` is 1."""
    return f"{n} {what}{'' if n == 1 else 's'}"


def span(low: float | None, high: float | None, digits: int = 2) -> str:
    """An interval in brackets; empty where it is unknown."""
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return ""
    return f"[{num(low, digits)}, {num(high, digits)}]"


def rate(percent: float) -> str:
    """A share in per cent; 0 and 100 only where it is none or all."""
    return num(percent, 1 if percent not in (0.0, 100.0) and round(percent) in (0, 100) else 0)


def rate_ends(low: float, high: float) -> tuple[str, str]:
    """The ends of its interval, in per cent: however many trials there are, not all will succeed for sure, nor none."""
    return rate(low) if round(low) == 100 else num(low, 0), rate(high) if round(high) == 0 else num(high, 0)


def p_value(p: float | None) -> str:
    """A p with two significant digits, small ones as a power of ten."""
    if p is None:
        return NONE
    if p >= 0.001:
        return f"{p:.3f}" if p < 0.0995 else f"{p:.2f}"
    mantissa, exponent = f"{p:.1e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPTS)}"


_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def percent(ours: float | None, theirs: float | None) -> str:
    """By how much ours differs from theirs."""
    if ours is None or not theirs:
        return NONE
    return f"{100 * (ours - theirs) / theirs:+.1f} %".replace("-", "−")

"""What a file may hold, however it is written: bounds on depth, number and size of its values."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import ClearwayError
from clearway.reading.limits import ENTRIES, NESTING, TEXT, WHOLE


def refuse_monsters(table: object, file: Path | None, *, entries: int = ENTRIES, texts: bool = True) -> None:
    """Refuse values that nobody means.

    Args:
        table: What was read.
        file: Where it was read from.
        entries: How many there may be.
        texts: Whether texts, keys too, are to be short and free of NUL.

    Raises:
        ClearwayError: It is nested too deep, has too many entries, or holds a number or a text that is too large.
    """
    waiting: list[tuple[object, tuple[object, ...]]] = [(table, ())]
    count = 0
    while waiting:  # by hand: recursion would end where the nesting does not
        value, where = waiting.pop()
        if isinstance(value, dict | list):
            count += len(value)
            if count > entries:
                raise ClearwayError(f"has more than {entries:,} entries, the most that are read", file=file)
            if len(where) >= NESTING:
                raise _too_deep(file, where)
            for key, inside in value.items() if isinstance(value, dict) else enumerate(value):
                if texts and isinstance(key, str) and (len(key) > TEXT or "\0" in key):
                    raise ClearwayError(f"a key has at most {TEXT:,} characters, and no NUL among them", file=file)
                waiting.append((inside, (*where, key)))
        elif isinstance(value, int):
            if not -WHOLE <= value < WHOLE:
                raise ClearwayError(
                    "a whole number lies between -2^63 and 2^63 - 1; this one does not", file=file, field=_field(where)
                )
        elif texts and isinstance(value, str):
            if len(value) > TEXT:
                raise ClearwayError(
                    f"a text has at most {TEXT:,} characters; this one has {len(value):,}",
                    file=file,
                    field=_field(where),
                )
            if "\0" in value:
                raise ClearwayError("a text cannot hold NUL", file=file, field=_field(where))


def too_deep(file: Path | None) -> ClearwayError:
    """The error for a file whose tables or arrays stand too deep within each other."""
    return ClearwayError(
        f"is nested deeper than {NESTING} tables or arrays; nothing that is read here needs that", file=file
    )


def _too_deep(file: Path | None, where: tuple[object, ...]) -> ClearwayError:
    return ClearwayError(too_deep(None).problem, file=file, field=_field(where[:4]))


def _field(where: tuple[object, ...]) -> str:
    return ".".join(str(step) for step in where)

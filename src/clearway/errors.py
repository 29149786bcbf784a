"""The one error that a user may meet: says where, what was found, and what would be right."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ClearwayError(Exception):
    """Something that the caller gave is wrong. The message is one clear sentence, meant to be shown as it is.

    Args:
        problem: What is wrong, with the offending value and what would be right.
        file: The file it stands in, if there is one.
        field: The field (dotted path) it stands in, if there is one.
    """

    def __init__(self, problem: str, *, file: object = None, field: str | None = None) -> None:
        self.problem, self.file, self.field = problem, None if file is None else str(file), field
        where = ": ".join(part for part in (self.file, field) if part)
        super().__init__(f"{where}: {problem}" if where else problem)


def unknown(
    kind: str, value: str, choices: Iterable[str], *, file: object = None, field: str | None = None
) -> ClearwayError:
    """The error for a name that isn't known: lists what is, the closest name first."""
    names = sorted(choices)
    close = difflib.get_close_matches(value, names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return ClearwayError(f"unknown {kind} {value!r}; {hint}known: {', '.join(names) or 'none'}", file=file, field=field)

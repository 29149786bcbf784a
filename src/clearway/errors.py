"""The one error that a user may meet: says where, what was found, and what would be right."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

LONGEST = 4000
"""Characters of a message."""


class _Brief(reprlib.Repr):
    """Cut to what a line holds; a table's keys stay in their order."""

    def repr_dict(self, x: dict[Any, Any], level: int) -> str:
        shown = [f"{self.repr1(key, level - 1)}: {self.repr1(x[key], level - 1)}" for key in islice(x, self.maxdict)]
        return "{...}" if level <= 0 else "{" + ", ".join(shown + ["..."] * (len(x) > self.maxdict)) + "}"


_BRIEF = _Brief()
_BRIEF.maxlevel, _BRIEF.maxlist, _BRIEF.maxtuple, _BRIEF.maxdict = 3, 12, 12, 6
_BRIEF.maxstring = _BRIEF.maxother = _BRIEF.maxlong = 100


class ClearwayError(Exception):
    """Something that the caller gave is wrong. The message is one clear sentence, meant to be shown as it is.

    Args:
        problem: What is wrong, with the offending value and what would be right; or an error, whose message says it: Gymnasium raises
            what a worker raised anew as `type(error)(error)`.
        file: The file it stands in, if there is one.
        field: The field (dotted path) it stands in, if there is one.

    Attributes:
        others: What else is wrong, where all of it was looked for.
    """

    others: tuple[ClearwayError, ...] = ()

    def __init__(self, problem: str | Exception, *, file: object = None, field: str | None = None) -> None:
        self.problem, self.file, self.field = str(problem), None if file is None else str(file), field
        where = ": ".join(_cut(part, LONGEST // 10) for part in (self.file, field) if part)
        text = _cut(self.problem, LONGEST)
        where, text = _printable(where, but=""), _printable(text, but="\n")
        super().__init__(f"{where}: {text}" if where else text)


@contextmanager
def noted(wrong: list[ClearwayError]) -> Iterator[None]:
    """Note what is wrong in a block instead of raising it, so that what comes behind is looked at too."""
    try:
        yield
    except ClearwayError as error:
        wrong += [error, *error.others]


def refuse(wrong: Iterable[ClearwayError]) -> None:
    """Raise the first of what was found wrong, which holds the others; nothing of the kind is told twice.

    Raises:
        ClearwayError: something was.
    """
    told = {str(error): error for error in reversed(list(wrong))}
    if told:
        *others, first = told.values()
        first.others = tuple(reversed(others))
        raise first


def shown(value: object) -> str:
    """`value` as a message shows it: what a file holds may be endless, and what is shown of it is not."""
    try:
        return _BRIEF.repr(value)
    except Exception:
        return f"<{type(value).__name__}>"


def unknown(
    kind: str, value: str, choices: Iterable[str], *, file: object = None, field: str | None = None
) -> ClearwayError:
    """The error for a name that isn't known: lists what is, the closest name first."""
    names = sorted(choices)
    close = nearest(value, names)
    hint = f"did you mean {close!r}? " if close else ""
    return ClearwayError(
        f"unknown {kind} {shown(value)}; {hint}known: {', '.join(names) or 'none'}", file=file, field=field
    )


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str | None:
    """The known name that is most like `name`, which may be endless; None where none is at least so alike (0 to 1)."""
    close = difflib.get_close_matches(name[:LONGEST], list(known), n=1, cutoff=likeness)
    return close[0] if close else None


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most * 2 // 3]} ... {text[-most // 4 :]}"


def _printable(text: str, but: str) -> str:
    """Without characters that would steer a terminal, `but` those."""
    return "".join(c if c.isprintable() or c in but else repr(c)[1:-1] for c in text)

"""What became of each parameter in a user's files: read, ignored, missing here, or unknown to everybody."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from clearway.errors import ClearwayError, nearest

Status = Literal["read", "default", "ignored", "missing", "unknown"]
STATUSES: dict[Status, str] = {
    "read": "holds",
    "default": "is not in the file, and what holds without it differs between versions or keeps out the lidar",
    "ignored": "means nothing here, for the reason that stands beside it",
    "missing": "would mean something and is not built; what is closest stands beside it",
    "unknown": "is read by nobody, in ROS neither",
}
"""What may become of a parameter."""


class Row(NamedTuple):
    """A parameter.

    Attributes:
        status: What became of it, a key of `STATUSES`.
        name: With all that it stands in, dotted.
        value: As a file has it; empty: none is worth showing.
        default: What would hold without it, where that differs; else empty.
        note: Why, or what is closest.
    """

    status: Status
    name: str
    value: str = ""
    default: str = ""
    note: str = ""

    def __str__(self) -> str:
        shown = f" = {self.value}" if self.value else ""
        shown += f" (default {self.default})" if self.default else ""
        return f"{self.status:<8}  {self.name}{shown}" + (f": {self.note}" if self.note else "")


@dataclass(frozen=True, slots=True)
class ParameterTable:
    """What became of all parameters of a file, or of the files in a folder.

    Attributes:
        source: The file or folder.
        about: Whose defaults hold.
        rows: The parameters, in the order of the files.
        problems: What would keep it from being driven with.
    """

    source: str
    about: str
    rows: tuple[Row, ...]
    problems: tuple[ClearwayError, ...] = field(default=())

    @property
    def all_known(self) -> bool:
        """Whether nothing is wrong and no name is unknown."""
        return not self.problems and not any(row.status == "unknown" for row in self.rows)

    def __str__(self) -> str:
        lines = [str(row) for status in STATUSES for row in self.rows if row.status == status]
        counts = {status: sum(row.status == status for row in self.rows) for status in STATUSES}
        told = ", ".join(f"{n} {status}" for status, n in counts.items() if n)
        return "\n".join(
            [
                *lines,
                *(f"problem   {p}" for p in self.problems),
                f"{self.source}: {told or 'no parameters'}; {self.about}",
            ]
        )


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The hint for a name that nobody reads; empty if none is near."""
    close = nearest(name, known)
    return f"did you mean {close!r}?" if close else ""


def as_written(value: Any) -> str:
    """A value as a YAML file has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{...}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(as_written, value))}]"
    return f"{value}" if isinstance(value, str) else f"{value!r}"

"""What all groups of Nav2's parameters have in common."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict

from clearway.errors import ClearwayError


class Group(BaseModel):
    """A namespace of Nav2's parameters: its fields are read, with Nav2's names and the defaults of its branch `main`.

    Attributes:
        IGNORED: Names that Nav2 reads and that mean nothing here, each with a short sentence why.
        MISSING: Names that Nav2 reads, or values of a field, that would mean something and are not built, each with what is closest.
        RENAMED: Names of older versions, each with what it is called now.
        NOTES: What is to be said of names that are read.
        OFFERED: Names that a list of it may have without a plug-in of theirs in the file.
        JAZZY: Defaults that differ in the branch `jazzy`; `NAME.plugin` is the plug-in that a namespace has by default.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    IGNORED: ClassVar[dict[str, str]] = {}
    MISSING: ClassVar[dict[str, str]] = {}
    RENAMED: ClassVar[dict[str, str]] = {}
    NOTES: ClassVar[dict[str, str]] = {}
    OFFERED: ClassVar[tuple[str, ...]] = ()
    JAZZY: ClassVar[dict[str, Any]] = {}

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """The namespaces inside this one that `table`, its parameters, asks for, and what reads each."""
        return {}

    @classmethod
    def beside(cls, table: dict[str, Any]) -> str | None:
        """The namespace inside this one whose parameters stand beside this one's own in `table`, not below its name."""
        return None


Readers = dict[str, type[Group] | ClearwayError]
"""Namespaces by their names, each with what reads it, or with why nothing does."""

"""What a file format is to Clearway: how it is recognised, listed, read and, where a round trip needs it, written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from clearway.recordings.recording import Contents, Recording, Want, contents_of

HEAD = 65536
"""Bytes of a file's beginning that a `sniff` is shown."""


@dataclass(frozen=True, slots=True)
class Format:
    """A file format. All its functions raise ClearwayError and nothing else, whatever the file holds, within bounded memory.

    Attributes:
        name: Its name, as in `--format`.
        title: Its name for people.
        suffixes: The usual endings, with the dot.
        sniff: Whether a file is one of these, from its path and its first bytes (at most `HEAD`; none for a folder);
            never raises.
        read: Reads everything that is wanted of a file.
        look: Says what a file holds, reading as little as it can.
        write: Puts a recording into a file of this format; None where there is no need.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    read: Callable[[Path, Want], Recording]
    look: Callable[[Path], Contents]
    write: Callable[[Path, Recording], None] | None = None


def look_by(read: Callable[[Path, Want], Recording]) -> Callable[[Path], Contents]:
    """A `look` that reads all of a file to say what it holds."""
    return lambda path: contents_of(read(path, Want()))

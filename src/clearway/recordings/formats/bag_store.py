"""What every bag is made of, whatever its container: channels, the times of their messages, and the messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_limits import Broken

Times = npt.NDArray[np.int64]
"""(n,) ns of UNIX time at which messages were recorded, in the file's order."""

Message = tuple[int, int, bytes]
"""A channel's number, when it was recorded [ns], and its bytes."""

NEVER, EVER = -(2**63), 2**63 - 1
"""ns before and after everything."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One publisher's topic in one file.

    Attributes:
        number: Its number within the file.
        topic: The topic's name.
        type: Type of its messages, as the file writes it.
        encoding: How messages are written: `ros1`, `cdr` or what the file says.
        schema: How the definition is written: `ros1msg`, `ros2msg`, `ros2idl` or empty.
        definition: Definition of the messages; empty where the file has none.
    """

    number: int
    topic: str
    type: str
    encoding: str
    schema: str = ""
    definition: str = ""


class Store(Protocol):
    """One file of a bag, open. All its methods raise ClearwayError and nothing else."""

    @property
    def channels(self) -> Mapping[int, Channel]:
        """By their numbers."""

    @property
    def times(self) -> Mapping[int, Times]:
        """When the messages of each channel were recorded, from the index: nothing is decompressed."""

    def messages(self, numbers: frozenset[int], start: int = NEVER, end: int = EVER) -> Iterator[Message]:
        """The messages of some channels that were recorded from `start` to `end` [ns], in the file's order."""

    def close(self) -> None:
        """Give the file back."""


class OneFile:
    """A container that is one file, open: it is walked at once, and given back if that fails.

    Args:
        path: The file to read.
        named: What it is called for people, where `path` is a copy.
        mend: What its users can do about a damaged one.
    """

    def __init__(self, path: Path, named: Path, mend: str) -> None:
        self._path, self._mend = named, mend
        self.channels: dict[int, Channel] = {}
        self.times: dict[int, Times] = {}
        self._file = open(path, "rb")  # noqa: SIM115 - `close` gives it back
        try:
            self._walk(path.stat().st_size)
        except Broken as error:
            self.close()
            raise self._damaged(f"{error}") from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self._file.close()

    def _walk(self, size: int) -> None:
        """Find the channels and the times of their messages in a file of `size` bytes."""
        raise NotImplementedError

    def _damaged(self, why: str) -> ClearwayError:
        return ClearwayError(f"is damaged: {why}; {self._mend}", file=self._path)


def joined(parts: Mapping[int, list[Times]]) -> dict[int, Times]:
    """The times of each channel as one array."""
    return {number: np.concatenate(them) for number, them in parts.items() if them}

"""Opens files that may be anything: only regular ones, and no more of them than is asked for."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from clearway.errors import ClearwayError

_KINDS = {
    stat.S_IFDIR: "a directory",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """A regular file, open for reading, for as long as the context lasts.

    Raises:
        ClearwayError: There is none of that name, it is something else, or it can't be read.
    """
    try:
        handle = os.open(
            path, os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0)
        )  # a pipe must not be waited for
    except (OSError, ValueError) as error:
        raise ClearwayError(_why(error), file=path) from error
    mode = os.fstat(handle).st_mode
    if not stat.S_ISREG(mode):
        os.close(handle)
        raise ClearwayError(f"is {_KINDS.get(stat.S_IFMT(mode), 'something else')}, not a file", file=path)
    with os.fdopen(handle, "rb") as file:
        try:
            yield file
        except OSError as error:
            raise ClearwayError(_why(error), file=path) from error


def read_bytes(path: Path, most: int) -> bytes:
    """What a regular file holds.

    Args:
        path: Of the file.
        most: Bytes that it may have.

    Raises:
        ClearwayError: It has more, or can't be read.
    """
    with opened(path) as file:
        found = take(file, most + 1)
    if len(found) > most:
        raise ClearwayError(f"is larger than the {size(most)} that are read of such a file", file=path)
    return found


def take(file: BinaryIO, most: int) -> bytes:
    """Up to `most` bytes of an open file.

    Raises:
        OSError: It would have to be waited for: a part of /proc that only looks like a file.
    """
    found: bytes | None = file.read(most)
    if found is None:
        raise OSError(errno.EAGAIN, "it has nothing to read yet")
    return found


def _why(error: OSError | ValueError) -> str:
    if isinstance(error, ValueError):
        return "no such file: no file's name has such characters"
    if error.errno == errno.ENOENT:
        return "no such file"
    return f"cannot be read: {error.strerror or error}"


def size(count: int) -> str:
    """So many bytes, in words."""
    return f"{count >> 20} MB" if count >= 1 << 20 else f"{count >> 10} kB"


def is_there(path: Path) -> bool:
    """Whether there is such a file; of a text that no path can be there is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long; a null character
        return False

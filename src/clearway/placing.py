"""Files that are there whole or not at all: written beside their place, and moved there once they are finished."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from clearway.errors import ClearwayError


@contextmanager
def placed(folder: Path) -> Iterator[Path]:
    """A folder to write into; when the block under `with` is over, what lies in it is moved into `folder`.

    After an error, a full disk for one, nothing is left. `folder` is made if it isn't there, and stays if all went well.

    Raises:
        ClearwayError: something can't be written.
    """
    made: list[Path] = []
    try:
        made += make_folder(folder)
        with working_folder(folder, "writing") as new:
            try:
                yield new
            except ClearwayError as error:
                file = None if error.file is None else error.file.replace(str(new), str(folder))
                raise ClearwayError(error.problem, file=file, field=error.field) from error
            for path in sorted(new.rglob("*")):
                sync(path)
            for path in sorted(new.iterdir()):
                os.replace(path, folder / path.name)
            sync(folder)
    except BaseException as error:
        for empty in made:
            with suppress(OSError):
                empty.rmdir()
        if isinstance(error, OSError):
            raise ClearwayError(f"cannot be written: {error.strerror or error}", file=folder) from error
        raise


def make_folder(folder: Path) -> list[Path]:
    """Make a folder and those that it lies in, each with its name on the disk for good.

    Returns:
        Those that were not there, the innermost first.

    Raises:
        OSError: it can't be made.
    """
    new, at = [], folder
    while not os.path.exists(at):
        new.append(at)
        at = at.parent
    folder.mkdir(parents=True, exist_ok=True)
    for made in new:
        sync(made.parent)
    return new


@contextmanager
def working_folder(where: Path, name: str) -> Iterator[Path]:
    """A new folder `where`/.NAME-..., which is gone afterwards. Those that were left by processes that were killed go too.

    Raises:
        OSError: it can't be made.
    """
    for left in where.glob(f".{name}-*"):
        with suppress(OSError), _locked(left):
            shutil.rmtree(left, ignore_errors=True)
    new = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=where))
    new.chmod(0o777 & ~_umask())
    try:
        with _locked(new):
            yield new
    finally:
        shutil.rmtree(new, ignore_errors=True)


def sync(path: Path) -> None:
    """Have a file, or the names in a folder, on the disk for good; nothing where folders can't be asked to."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError:
        if not path.is_dir():  # some network file systems have no such thing for folders, some folders can't be read
            raise


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """A lock that goes with the process, however it ends."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask

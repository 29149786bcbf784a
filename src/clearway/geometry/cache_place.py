"""Where compiled kernels are kept: beside the source, or in the user's own cache, or, where neither can be written, for a while.

A container often has its packages on a read-only disk and a user without a home. Numba then refuses to import a kernel.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path
from typing import Any, cast

import numba
from numba.misc.appdirs import AppDirs

VARIABLE = "NUMBA_CACHE_DIR"
"""The environment's variable by which Numba, here and in worker processes, is told where its cache is."""


def settle_cache(package: Path = Path(__file__).parents[1]) -> Path | None:
    """Have kernels cached in a temporary folder, and say so on stderr, where Numba finds no place that can be written.

    Args:
        package: Clearway's own folder, beside whose files the caches lie by default.

    Returns:
        The temporary folder; None where none is needed.
    """
    if os.environ.get(VARIABLE) or _writable(package):
        return None
    directories: Any = AppDirs  # as Numba asks for its own
    if _writable(Path(directories(appname="numba", appauthor=False).user_cache_dir)):
        return None
    folder, config = _own_folder(), cast(Any, numba.config)
    os.environ[VARIABLE] = config.CACHE_DIR = str(folder)
    print(
        f"clearway: neither {package} nor the user's cache can be written, so compiled kernels are kept in {folder}; to keep "
        f"them for good, set {VARIABLE} to a folder of yours",
        file=sys.stderr,
    )
    return folder


def _writable(folder: Path) -> bool:
    """Whether a file can be made in the folder, which is made if it isn't there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _own_folder() -> Path:
    """A temporary folder that nobody else can write into: what is read from a cache is run."""
    folder = Path(tempfile.gettempdir()) / f"clearway-kernels-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
            return folder
    except OSError:  # somebody's file has its name
        pass
    return Path(tempfile.mkdtemp(prefix="clearway-kernels-"))

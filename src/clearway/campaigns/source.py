"""The digest of source text: what shows that a campaign goes on with the code that it began with."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from types import ModuleType
from typing import Any

from clearway.imports import with_imports
from clearway.reading import opened

_CLEARWAY = Path(__file__).parents[1]
_APART = ("reports", "cli")
"""Rooms of Clearway that decide no bit of a result."""
_CODE = (".py", ".pyd", ".so", ".toml", ".json", ".yaml", ".csv", ".gz")


def digest(*parts: str | bytes) -> str:
    """A short digest of texts and bytes, in their order."""
    seen = hashlib.sha256()
    for part in parts:
        seen.update(part.encode("utf-8", "backslashreplace") if isinstance(part, str) else part)
    return seen.hexdigest()[:16]


@cache
def of_clearway() -> str:
    """Of what decides the bits of Clearway's own results: its code, robots, stand-ins, floor plans and suites."""
    files = (f for f in _code_below(_CLEARWAY) if f.relative_to(_CLEARWAY).parts[0] not in _APART)
    return _of_files(files, _CLEARWAY)


def of_object(thing: Any) -> str | None:
    """Of the code that a class or function of somebody else's stands in, with its version if it was installed; None for
    Clearway's own.

    A package counts whole, with its data; a file that stands alone counts with those that it imports from beside it.
    """
    module = sys.modules.get(getattr(thing, "__module__", None) or type(thing).__module__)
    if module is None or getattr(module, "__file__", None) is None:
        return "unknown"
    file = Path(str(module.__file__)).resolve()
    if file.is_relative_to(_CLEARWAY):
        return None
    top = module.__name__.partition(".")[0]
    folders = [Path(p).resolve() for p in getattr(sys.modules.get(top), "__path__", ())]
    if folders:
        found = digest(*(_of_files(_all_below(folder), folder) for folder in folders))
    else:
        found = _of_files(with_imports(file), file.parent)
    return " ".join(filter(None, (_version(module), found)))


def of_files(files: Iterable[Path]) -> str:
    """Of the contents of files, in their order.

    Raises:
        ClearwayError: one is not there, or can't be read.
    """
    return digest(*map(_of_file, files))


def _version(module: ModuleType) -> str | None:
    for name in packages_distributions().get(module.__name__.partition(".")[0], ()):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return None


def _code_below(folder: Path) -> Iterator[Path]:
    return (f for f in folder.rglob("*") if f.suffix in _CODE and f.is_file())


def _all_below(folder: Path) -> Iterator[Path]:
    """The files of a package, weights and tables too; not what Python and Numba keep there, what is hidden, and results."""
    for place, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if f != "__pycache__" and not f.startswith(".")]
        if "campaign.json" in files:
            folders.clear()
        else:
            yield from (Path(place, f) for f in files if not f.startswith(".") and Path(place, f).is_file())


def _of_files(files: Iterable[Path], root: Path) -> str:
    named = sorted((f.relative_to(root).as_posix() if f.is_relative_to(root) else f.name, f) for f in files)
    return digest(*(part for name, file in named for part in (name, _of_file(file))))


def _of_file(file: Path) -> bytes:
    with opened(file) as content:  # weights may be large
        seen = hashlib.sha256()
        while piece := content.read(1 << 20):
            seen.update(piece)
    return seen.digest()

"""How Clearway compiles its hot path: one decorator, so that every kernel is compiled alike.

Kernels are compiled at their first call and cached beside the source. Numba looks only at the kernel's own file, at its
time and size, to tell whether the cache still holds; here it looks at the text of that file and of every file of
Clearway that it imports, at any depth. An edit in a kernel that others call thus never leaves stale machine code
behind, and a fresh checkout of the same text compiles nothing again.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*(?:from|import) clearway\.([\w.]+)(?: import (?:\(([\w,\s]*)\)|([\w, ]*)))?", re.MULTILINE)


def kernel(function: _F) -> _F:
    """Compile `function` with Numba: cached, without the GIL, IEEE arithmetic (no fastmath: same bits everywhere)."""
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    file: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    source = Path(function.__code__.co_filename)
    if hasattr(file, "_source_stamp") and source.is_relative_to(_PACKAGE):
        file._source_stamp = fingerprint(source)
    return cast(_F, compiled)


@cache
def fingerprint(source: Path) -> str:
    """A hash of a file of Clearway and of every file of Clearway that it imports, at any depth."""
    seen = hashlib.sha256()
    for file in sorted(_reached(source)):
        seen.update(_text(file).encode())
    return seen.hexdigest()


def _reached(source: Path) -> set[Path]:
    found, new = set(), [source]
    while new:
        file = new.pop()
        if file not in found:
            found.add(file)
            new += _imported(file)
    return found


@cache
def _imported(source: Path) -> list[Path]:
    files = []
    for module, several, one_line in _IMPORT.findall(_text(source)):
        names = several or one_line
        place = _PACKAGE.joinpath(*module.split("."))
        candidates = [place.with_suffix(".py"), *(place / f"{name.strip()}.py" for name in names.split(","))]
        files += [file for file in candidates if file.is_file()]
    return files


@cache
def _text(source: Path) -> str:
    return source.read_text(encoding="utf-8")

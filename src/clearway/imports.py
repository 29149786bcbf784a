"""Modules that are files of the user's: each may import what lies beside it, as where `python FILE` runs it."""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType

from clearway.errors import ClearwayError

_READ: dict[Path, tuple[ModuleType, dict[Path, int | None]]] = {}
"""The modules that were read, each with when what it was read from had last changed."""


def module_of(file: Path) -> ModuleType:
    """The module that a Python file is; it is read again once it, or one that it imports from beside it, has changed.

    Args:
        file: Its path, in full.

    Raises:
        ClearwayError: what it imports from beside it has the name of another module.
        BaseException: whatever the file raises.
    """
    if file in _READ:
        module, stamps = _READ[file]
        names = _names(stamps, file)
        if stamps == _stamps(stamps):
            _look_beside(file, names)  # what comes after a trial has taken that back
            return module
        for name in tuple(sys.modules):
            if name.partition(".")[0] in names:
                del sys.modules[name]
    files = with_imports(file)
    _look_beside(file, names := _names(files, file))
    _check_names(file, names)
    place = hashlib.sha256(os.fsencode(file)).hexdigest()[:8]  # a file of the same name may lie elsewhere
    name = f"clearway_own_{file.stem}_{place}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None  # a .py file always has both
    assert spec.loader is not None
    stamps, module = _stamps(files), importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look a class's module up by name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    _READ[file] = module, stamps
    return module


def refuse_clashes(addresses: Iterable[str]) -> None:
    """Refuse files, among addresses, that import different modules of one name from beside them: a process can hold only one.

    Raises:
        ClearwayError: two do.
    """
    taken: dict[str, Path] = {}
    files = (Path(address.rpartition(":")[0]).resolve() for address in addresses)
    for file in (f for f in files if f.suffix == ".py" and f.is_file()):
        for name in sorted(_names(with_imports(file), file)):
            if (other := taken.setdefault(name, file)).parent != file.parent:
                raise _clash(name, file, f"{other} imports another of that name")


def with_imports(file: Path) -> set[Path]:
    """A Python file, and the files beside it, or in packages beside it, that it imports, at any depth."""
    found, new = set[Path](), [file]
    while new:
        now = new.pop()
        if now not in found:
            found.add(now)
            new += [f for folder, name in _imported(now, file.parent) for f in _files_of(name, folder)]
    return found


def _stamps(files: Iterable[Path]) -> dict[Path, int | None]:
    return {file: file.stat().st_mtime_ns if file.is_file() else None for file in files}


def _names(files: Iterable[Path], file: Path) -> set[str]:
    """The modules and packages beside `file` that these files are, or belong to; itself is none."""
    return {f.relative_to(file.parent).parts[0].removesuffix(".py") for f in files if f != file}


def _look_beside(file: Path, names: set[str]) -> None:
    """Have modules found beside `file`, if any of these names are there to be found."""
    if names and str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))  # last: what lies there by chance takes no other module's place
        importlib.invalidate_caches()


def _check_names(file: Path, names: set[str]) -> None:
    """See that the modules of these names are those beside `file`.

    Raises:
        ClearwayError: one is another.
    """
    for name in sorted(names):
        if (found := _where(name)) not in [f.resolve() for f in (file.with_name(f"{name}.py"), file.with_name(name))]:
            raise _clash(name, file, f"that is the name of {found or 'a module of Python'} too")


def _clash(name: str, file: Path, other: str) -> ClearwayError:
    return ClearwayError(f"imports {name!r} from beside it, but {other}; give one of the two another name", file=file)


def _where(name: str) -> Path | None:
    """The file that a module is read from, or the folder of a package; None: it is built into Python."""
    spec = importlib.util.find_spec(name)
    if spec is not None and spec.submodule_search_locations:
        return Path(next(iter(spec.submodule_search_locations))).resolve()
    return Path(str(spec.origin)).resolve() if spec is not None and spec.has_location else None


def _imported(file: Path, beside: Path) -> Iterator[tuple[Path, str]]:
    """The modules that a file may import: in which folder each is looked for, and its name; none of what can't be parsed."""
    try:
        nodes = ast.walk(ast.parse(file.read_bytes()))
    except (SyntaxError, ValueError):
        return
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((beside, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            folder = Path(os.path.normpath(file.parent / "/".join([".."] * (node.level - 1)))) if node.level else beside
            if folder.is_relative_to(beside):
                yield from ((folder, ".".join(filter(None, (node.module, alias.name)))) for alias in node.names)


def _files_of(name: str, folder: Path) -> Iterator[Path]:
    """The files that are read when a module is imported: its own, and those of the packages that it is in."""
    for part in name.split("."):
        folder /= part
        yield from (f for f in (folder.with_name(f"{part}.py"), folder / "__init__.py") if f.is_file())

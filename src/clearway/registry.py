"""Finds things by name: what comes with Clearway, what other packages register as entry points, and a user's own by address.

An address is `pkg.module:THING`, or `path/to/file.py:THING` for a file that is not installed.
"""

from __future__ import annotations

import ast
import importlib
import os
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from clearway.errors import ClearwayError, unknown
from clearway.foreign import said
from clearway.given import given
from clearway.imports import module_of

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Registry:
    """The things of one kind.

    Attributes:
        kind: What one is called, such as `navigator`.
        group: The entry-point group under which other packages register theirs.
        shipped: Name -> address of those that come with Clearway, known even where no package metadata is installed
            (a source checkout on the path).
        schemes: What an address may begin with, before a colon, instead of a module -> address of the function that is given
            the rest of it and returns the thing.
    """

    kind: str
    group: str
    shipped: Mapping[str, str]
    schemes: Mapping[str, str] = field(default_factory=dict)

    def addresses(self) -> dict[str, str]:
        """Name -> address of all of them.

        Raises:
            ClearwayError: two packages register different ones under one name.
        """
        return self.collect(_points(self.group))

    def collect(self, points: Iterable[EntryPoint]) -> dict[str, str]:
        """Name -> address of those that come with Clearway and of these entry points.

        Raises:
            ClearwayError: two have one name and different addresses.
        """
        found = dict(self.shipped)
        for point in sorted(points, key=lambda p: (p.name, p.value)):
            if found.setdefault(point.name, point.value) != point.value:
                raise ClearwayError(
                    f"two {self.kind}s are registered as {point.name!r}: {found[point.name]} and {point.value}; "
                    "uninstall or rename one"
                )
        return found

    def all_of(self, kind: type[T]) -> dict[str, T]:
        """Name -> thing of every one that is registered, each of which has to be of this type and bear its name.

        Raises:
            ClearwayError: one is not, or can't be imported.
        """
        found = {name: self.find(name) for name in sorted(self.addresses())}
        for name, thing in found.items():
            if not isinstance(thing, kind):
                raise ClearwayError(
                    f"the {self.kind} {name!r} is a {type(thing).__name__}; {kind.__name__} is expected"
                )
            if (own := getattr(thing, "name", name)) != name:
                raise ClearwayError(
                    f"the {self.kind} that is registered as {name!r} calls itself {own!r}; name it alike"
                )
        return found

    def find(self, which: str) -> Any:
        """The thing of a registered name, or at an address.

        Raises:
            ClearwayError: no such name, module, file or attribute, or its module fails to import.
        """
        if (handed := given(which)) is not None:
            return handed.thing
        if (scheme := self.scheme_of(which)) is not None:
            return self._at(self.schemes[scheme])(which.removeprefix(f"{scheme}:"))
        if ":" in which:
            return self._at(which)
        addresses = self.addresses()
        if which not in addresses and (which.endswith(".py") or "." in which):
            raise self._half_an_address(which, addresses)
        if which not in addresses:
            raise unknown(self.kind, which, addresses)
        return self._at(addresses[which])

    def scheme_of(self, which: str) -> str | None:
        """What of `schemes` an address begins with; None: nothing."""
        scheme, colon, _ = which.partition(":")
        return scheme if colon and scheme in self.schemes else None

    def _half_an_address(self, which: str, known: Iterable[str]) -> ClearwayError:
        """The error for a file or module of which nothing is named."""
        if not which.endswith(".py"):
            where, _, name = which.rpartition(".")
            error = unknown(self.kind, which, known)
            return ClearwayError(f"{error.problem}; one of your own is named as {where or 'my_pkg'}:{name}")
        if not os.path.isfile(which):
            return ClearwayError("no such file", file=which)
        names = _classes(Path(which))
        if not names:
            return ClearwayError(f"defines no class; write {which}:NAME for the {self.kind} in it", file=which)
        return ClearwayError(f"say which {self.kind} of it: {' or '.join(f'{which}:{n}' for n in names)}", file=which)

    def _at(self, address: str) -> Any:
        where, _, attribute = address.rpartition(":")
        if not where or not attribute:
            raise ClearwayError(f"{self.kind} {address!r} is not an address; write my_pkg.module:NAME")
        module = self._module(where, address)
        found: Any = module
        for part in attribute.split("."):
            if not hasattr(found, part):
                names = [n for n, v in vars(module).items() if not (n.startswith("_") or isinstance(v, ModuleType))]
                raise unknown(self.kind, attribute, names, file=where)
            found = getattr(found, part)
        return found

    def _module(self, where: str, address: str) -> ModuleType:
        try:
            if where.endswith(".py"):
                file = Path(where).resolve()
                if not os.path.isfile(file):
                    raise ClearwayError("no such file", file=file)
                return module_of(file)
            if "" not in sys.path and str(Path.cwd()) not in sys.path:
                sys.path.append(str(Path.cwd()))  # as `python -m` does: the user's package may lie where they stand
            return importlib.import_module(where)
        except (ClearwayError, KeyboardInterrupt):
            raise
        except ModuleNotFoundError as error:
            if error.name is not None and (where == error.name or where.startswith(error.name + ".")):
                raise ClearwayError(
                    f"{self.kind} {address!r}: there is no module {error.name!r} (installed, or below {Path.cwd()})"
                ) from error
            raise ClearwayError(f"{self.kind} {address!r} cannot be imported: {in_a_line(error)}") from error
        except BaseException as error:  # sys.exit() too
            raise ClearwayError(f"{self.kind} {address!r} cannot be imported: {in_a_line(error)}") from error


def _classes(file: Path) -> list[str]:
    """The classes that a file defines, without running it."""
    try:
        found = ast.parse(file.read_bytes()).body
    except (OSError, SyntaxError, ValueError):
        return []
    return [node.name for node in found if isinstance(node, ast.ClassDef) and not node.name.startswith("_")]


def in_a_line(error: BaseException) -> str:
    """An exception in one line, with the line of code that raised it."""
    place, traceback = "", error.__traceback__
    while traceback is not None:
        code = traceback.tb_frame.f_code
        place, traceback = f" ({Path(code.co_filename).name}:{traceback.tb_lineno})", traceback.tb_next
    if isinstance(error, SyntaxError) and error.filename:
        place = f" ({Path(error.filename).name}:{error.lineno})"
    text = f"SyntaxError: {error.msg}" if isinstance(error, SyntaxError) else said(error)
    return f"{' '.join(text.split())}{place}"


@cache
def _points(group: str) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=group))

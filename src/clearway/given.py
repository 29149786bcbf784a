"""Objects that a Python program hands over instead of names: navigators, robots, scenarios, suites of a notebook or a script.

Each gets a name, under which it is found in this process and in the workers that are handed it. Results record that name; in
another process nobody finds the object by it, and whoever asks is told so.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from clearway.errors import ClearwayError
from clearway.foreign import said

PREFIX = "object:"
"""How the name of such an object begins."""


@dataclass(frozen=True, slots=True, eq=False)
class Given:
    """An object that was handed over.

    Attributes:
        thing: It.
        code: A digest of its source text, `unknown` where nobody has that.
    """

    thing: Any
    code: str


_GIVEN: dict[str, Given] = {}
_packed: bytes | None = None
_unpacked = b""


def give(name: str, thing: Any) -> str:
    """Have `thing` found by a name, which is returned; what had that name before is forgotten."""
    global _packed
    found = f"{PREFIX}{name}"
    if found not in _GIVEN or _GIVEN[found].thing is not thing:
        _GIVEN[found], _packed = Given(thing, _source(thing)), None
    return found


def given(name: str) -> Given | None:
    """What was handed over under this name; None for any other name.

    Raises:
        ClearwayError: it is the name of an object, and this process was given none.
    """
    if not name.startswith(PREFIX):
        return None
    if name not in _GIVEN:
        raise ClearwayError(
            f"{name!r} was an object of a Python program, which cannot be found again by its name; hand it over again in Python, "
            "or put it into a module or a file of its own and name that"
        )
    return _GIVEN[name]


def address_of(thing: Any) -> str | None:
    """The address `module:NAME` by which any process finds a class or function; None if there is none."""
    module, name = getattr(thing, "__module__", None), getattr(thing, "__qualname__", "")
    if module in (None, "__main__") or not all(part.isidentifier() for part in name.split(".")):
        return None
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return f"{module}:{name}" if found is thing and _importable(module) else None


def packed() -> bytes:
    """All that was handed over, for workers; empty for nothing.

    Raises:
        ClearwayError: something of it can't be taken to another process.
    """
    global _packed
    if not _GIVEN:
        return b""
    if _packed is None:
        import cloudpickle  # classes of a notebook by their code, as joblib does it

        for module in _homeless():
            cloudpickle.register_pickle_by_value(module)
        try:
            _packed = cloudpickle.dumps(_GIVEN)
        except Exception as error:
            raise ClearwayError(
                f"what was handed over cannot be taken to worker processes ({said(error)}); workers=0 runs it in this one"
            ) from error
    return _packed


def unpack(objects: bytes) -> None:
    """Take over what the parent was given; nothing happens if it is what it was before."""
    global _unpacked
    if objects != _unpacked:
        import pickle

        _GIVEN.clear()
        _GIVEN.update(pickle.loads(objects) if objects else {})
        _unpacked = objects


def _homeless() -> Iterator[Any]:
    """The modules of what was given that a worker couldn't import."""
    for one in _GIVEN.values():
        name = getattr(one.thing, "__module__", None) or type(one.thing).__module__
        if name != "__main__" and not _importable(name) and name in sys.modules:
            yield sys.modules[name]


def _importable(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _source(thing: Any) -> str:
    """A digest of the source of a function, or of a class's methods and those of its bases."""
    kinds = thing.__mro__ if isinstance(thing, type) else (thing if inspect.isfunction(thing) else type(thing),)
    functions = [f for kind in kinds for f in (vars(kind).values() if isinstance(kind, type) else (kind,))]
    try:
        texts = [inspect.getsource(f) for f in functions if inspect.isfunction(f)]
    except (OSError, TypeError):
        return "unknown"
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16] if texts else "unknown"

"""How Clearway compiles its hot path: one decorator, so that every kernel is compiled alike.

Kernels are compiled at their first call and cached beside the source. Numba looks only at the kernel's own file, at its
time and size, to tell whether the cache still holds; here it looks at the text of that file and of every file of
Clearway that it imports, at any depth. An edit in a kernel that others call thus never leaves stale machine code
behind, and a fresh checkout of the same text compiles nothing again.

For Numba the literal in `f(x, 2)` is a type, and `f` is compiled for each such value that another kernel calls it with.
Here it is compiled once for all of them, and for other kernels otherwise than for Python (`dispatcher.py`);
`benchmarks/compile_time.py` tells what is compiled, and why.
"""

from __future__ import annotations

import gc
import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba.core import errors, event, types

from clearway.geometry.dispatcher import Kernel

_F = TypeVar("_F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "_nrt": True,  # else a kernel that a light one calls would be compiled as that is
    "no_cfunc_wrapper": True,  # nobody asks for a C callback, and making one for each kernel is 5 % of compiling
}
_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*(?:from|import) clearway\.([\w.]+)(?: import (?:\(([\w,\s]*)\)|([\w, ]*)))?", re.MULTILINE)


class _CollectsRarely(event.Listener):  # type: ignore[misc]
    """While Numba compiles: the cycle collector, which goes through all that a compiler makes again and again, is 16 % of it."""

    def __init__(self) -> None:
        self._depth, self._usual = 0, gc.get_threshold()  # Numba compiles under one lock

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._usual = gc.get_threshold()
            gc.set_threshold(max(200_000, self._usual[0]) if self._usual[0] else 0, *self._usual[1:])
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0:
            gc.set_threshold(*self._usual)


event.register("numba:compile", _CollectsRarely())  # type: ignore[no-untyped-call]


def kernel(function: _F) -> _F:
    """Compile `function` with Numba: cached, without the GIL, IEEE arithmetic (no fastmath: same bits everywhere)."""
    return cast(_F, _compiled(function, _OPTIONS))


def light(function: _F) -> _F:
    """A kernel that makes no array, and is given none by those that it calls: compiled without counting who holds which.

    Numba counts an array up and down again whenever it is taken from a NamedTuple or a part of it is looked at, in steps on which all
    cores agree. In a small kernel that can be most of the time. Whoever calls one holds all that it is given. One that makes an array, or hands one on, is refused when it is compiled.
    """
    return _light(function, _OPTIONS)


def inlined(function: _F) -> _F:
    """A light kernel that is compiled anew into each that calls it: for what is called in a loop that is to run on vector registers."""
    return _light(function, _OPTIONS | {"forceinline": True})


def _light(function: _F, options: dict[str, Any]) -> _F:
    compiled = _compiled(function, options | {"_nrt": False})
    compiler = compiled.called._compiler
    compile_ = compiler.compile

    def checked(args: Any, return_type: Any) -> Any:
        name = f"{function.__module__}.{function.__qualname__}"
        try:
            result = compile_(args, return_type)
        except errors.NumbaError as error:
            raise TypeError(f"{name} can't be compiled; if it makes an array, it is to be a kernel: {error}") from error
        if _gets_arrays(result):
            raise TypeError(f"{name} hands arrays on, as only a kernel may")
        return result

    compiler.compile = checked
    return cast(_F, compiled)


def uncompiled(function: _F) -> _F:
    """What a kernel was made of: for a few numbers quicker in Python than a call of the kernel."""
    return cast(_F, cast(Any, function).py_func)


def _gets_arrays(result: Any) -> bool:
    """Whether what was compiled answers with an array, or is answered with one by a kernel: who gets one has to count."""
    types_of, answers = result.type_annotation.typemap, [result.signature.return_type]
    for call, signature in result.type_annotation.calltypes.items():
        if getattr(call, "op", None) == "call" and isinstance(types_of[call.func.name], types.Dispatcher):
            answers.append(signature.return_type)
    return any(map(_counted, answers))


def _counted(answer: types.Type) -> bool:
    """Whether something of this type is counted, or holds what is."""
    if isinstance(answer, types.BaseTuple):
        return any(_counted(part) for part in cast(Any, answer))
    return not isinstance(answer, types.Number | types.Boolean | types.NoneType)


def _compiled(function: Any, options: dict[str, Any]) -> Kernel:
    compiled = Kernel(function, {}, {"nopython": True, "boundscheck": None, **options})
    compiled.enable_caching()
    source = Path(function.__code__.co_filename)
    for kept in (compiled, compiled.called):
        file: Any = cast(Any, kept)._cache._cache_file
        if hasattr(file, "_source_stamp") and source.is_relative_to(_PACKAGE):
            file._source_stamp = fingerprint(source)
            file._load_index = _heeding_what_is_gone(file._load_index)
    return compiled


def _heeding_what_is_gone(load: Callable[[], Any]) -> Callable[[], Any]:
    """`load`, for which a cache that names a type of ours that has moved since is empty: Numba reads it before its stamp."""

    def load_index() -> Any:
        try:
            return load()
        except (AttributeError, ImportError):
            return {}

    return load_index


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

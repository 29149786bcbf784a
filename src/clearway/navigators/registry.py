"""Finds navigators: those registered under the entry-point group `clearway.navigators`, and a user's own by address.

An address is `pkg.module:Class`, or `path/to/file.py:Class` for a file that is not installed. Options for its
constructor may stand behind either, as in `hp-tmpc[solver=genetic,prediction_horizon=10]`: a variant with a name of its
own in the results.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from clearway.contract import Navigator
from clearway.errors import ClearwayError, unknown
from clearway.robots import Robot

GROUP = "clearway.navigators"
"""The entry-point group that navigators register under."""

SHIPPED = {
    "move-base": "clearway.navigators.move_base:MoveBase",
    "hp-tmpc": "clearway.navigators.hp_tmpc:HpTmpc",
    "hp-st": "clearway.navigators.hp_st:HpSt",
    "hp-st-foresight": "clearway.navigators.hp_st:HpStForesight",
    "hl-rrt": "clearway.navigators.hl_rrt:HlRrt",
    "colregs-apf": "clearway.navigators.colregs_apf:ColregsApf",
    "colregs-apf-retuned": "clearway.navigators.colregs_apf:RetunedColregsApf",
    "oracle": "clearway.navigators.oracle:Oracle",
}
"""Known even where no package metadata is installed (a source checkout on the path)."""


def navigator_names() -> list[str]:
    """Names of the registered navigators, sorted.

    Raises:
        ClearwayError: two packages register different navigators under one name.
    """
    return sorted(_registered())


def navigator_class(name: str) -> Callable[..., Navigator]:
    """The class (or other factory) behind a registered name or an address, whatever options stand behind it.

    Raises:
        ClearwayError: no such name, module, file or attribute, or its module fails to import.
    """
    name, _ = split_options(name)
    if ":" in name:
        return _at(name)
    registered = _registered()
    if name not in registered:
        raise unknown("navigator", name, registered)
    return _at(registered[name])


def make_navigator(name: str, **options: Any) -> Navigator:
    """A new navigator by registered name or address; `options` go to its constructor.

    Raises:
        ClearwayError: it can't be found, imported or constructed.
    """
    factory = navigator_class(name)
    try:
        navigator = factory(**(split_options(name)[1] | options))
    except ClearwayError:
        raise
    except Exception as error:
        raise ClearwayError(f"navigator {name!r} cannot be made: {_words(error)}") from error
    for method in ("reset", "step"):
        if not callable(getattr(navigator, method, None)):
            raise ClearwayError(
                f"{name!r} is not a navigator: it has no method {method}(); see clearway.contract.Navigator"
            )
    return navigator


def check_parameters(name: str, navigator: Navigator, robot: Robot) -> Any:
    """Have `navigator`, which goes by `name`, read its parameters for `robot`; what it made of them, None if it reads none.

    Raises:
        ClearwayError: one of them is wrong, in the robot's file or among the navigator's options.
    """
    read = getattr(navigator, "read_parameters", None)
    try:
        return None if read is None else read(robot)
    except ClearwayError:
        raise
    except Exception as error:
        raise ClearwayError(f"navigator {name!r} cannot read its parameters: {_words(error)}") from error


def split_options(name: str) -> tuple[str, dict[str, Any]]:
    """The name without its options, and these: numbers, true and false as such, all else as text.

    Raises:
        ClearwayError: the brackets don't hold `option=value` parts.
    """
    if not name.endswith("]"):
        return name, {}
    plain, _, inside = name[:-1].partition("[")
    options: dict[str, Any] = {}
    for part in inside.split(","):
        option, equals, value = (text.strip() for text in part.partition("="))
        if not (option.isidentifier() and equals and value):
            raise ClearwayError(f"navigator {name!r}: {part.strip()!r} is not an option; write name[option=value,...]")
        try:
            options[option] = json.loads(value)
        except json.JSONDecodeError:
            options[option] = value
    return plain, options


def with_option(name: str, option: str, value: str) -> str:
    """The name with `option=value` behind what stands in its brackets already: `hp-st` -> `hp-st[without=reverse]`."""
    head = f"{name[:-1]}," if name.endswith("]") else f"{name}["
    return f"{head}{option}={value}]"


@cache
def _registered() -> dict[str, str]:
    """Name -> address of every registered navigator."""
    return _collect(entry_points(group=GROUP))


def _collect(points: Any) -> dict[str, str]:
    found = dict(SHIPPED)
    point: EntryPoint
    for point in sorted(points, key=lambda p: (p.name, p.value)):
        if found.setdefault(point.name, point.value) != point.value:
            raise ClearwayError(
                f"two navigators are registered as {point.name!r}: {found[point.name]} and {point.value}; "
                "uninstall or rename one"
            )
    return found


def _at(address: str) -> Callable[..., Navigator]:
    where, _, attribute = address.rpartition(":")
    if not where or not attribute:
        raise ClearwayError(f"navigator {address!r} is not an address; write my_pkg.module:MyNavigator")
    module = _module(where, address)
    found: Any = module
    for part in attribute.split("."):
        if not hasattr(found, part):
            callables = [n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__]
            raise unknown("navigator class", attribute, callables, file=where)
        found = getattr(found, part)
    if not callable(found):
        raise ClearwayError(f"navigator {address!r} is a {type(found).__name__}, not a class that makes a navigator")
    factory: Callable[..., Navigator] = found
    return factory


def _module(where: str, address: str) -> ModuleType:
    try:
        if where.endswith(".py"):
            return _from_file(str(Path(where).resolve()))
        if "" not in sys.path and str(Path.cwd()) not in sys.path:
            sys.path.append(str(Path.cwd()))  # as `python -m` does: the user's package may lie where they stand
        return importlib.import_module(where)
    except ClearwayError:
        raise
    except ModuleNotFoundError as error:
        if error.name is not None and (where == error.name or where.startswith(error.name + ".")):
            raise ClearwayError(
                f"navigator {address!r}: there is no module {error.name!r} (installed, or below {Path.cwd()})"
            ) from error
        raise ClearwayError(f"navigator {address!r} cannot be imported: {_words(error)}") from error
    except Exception as error:
        raise ClearwayError(f"navigator {address!r} cannot be imported: {_words(error)}") from error


@cache
def _from_file(path: str) -> ModuleType:
    file = Path(path)
    if not file.is_file():
        raise ClearwayError("no such file", file=file)
    name = f"clearway_own_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None  # a .py file always has both
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look a class's module up by name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _words(error: BaseException) -> str:
    """An exception in one line, with the line of code that raised it."""
    place, traceback = "", error.__traceback__
    while traceback is not None:
        code = traceback.tb_frame.f_code
        place, traceback = f" ({Path(code.co_filename).name}:{traceback.tb_lineno})", traceback.tb_next
    if isinstance(error, SyntaxError) and error.filename:
        place = f" ({Path(error.filename).name}:{error.lineno})"
    text = " ".join(str(error.msg if isinstance(error, SyntaxError) else error).split())
    return f"{type(error).__name__}: {text}{place}"

"""Copies of what a navigator answers and shows, in plain types of ours: nothing of its own code comes further than here."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np

from clearway.contract import Command, Diagnostics
from clearway.foreign import plain_text
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray

MOST_TEXTS = 100
"""Texts that a command may hold."""
MOST_DRAWINGS = 10_000
"""Named lines and circles that diagnostics may hold at once."""
MOST_SHOWN = 100_000_000
"""Bytes of diagnostics that a trial may hold."""
_MOST_ITERATIONS = 2**63 - 1


def plain_command(answer: object) -> Command:
    """The command that a navigator answered.

    Raises:
        TypeError, ValueError: it isn't what `Command` says, or not finite.
    """
    if not isinstance(answer, Command):
        raise TypeError(f"the navigator answered {_brief(answer)}; a Command is expected")
    return Command(
        v=_finite(answer.v, "the command's v"),
        omega=_finite(answer.omega, "the command's omega"),
        arrived=None if answer.arrived is None else _truth(answer.arrived, "the command's `arrived`"),
        gave_up=None if answer.gave_up is None else plain_text(answer.gave_up, "the command's `gave_up`"),
        status=plain_text(answer.status, "the command's `status`"),
        cut=_truth(answer.cut, "the command's `cut`"),
        violated=_texts(answer.violated, "the command's `violated`"),
        v_y=_finite(answer.v_y, "the command's v_y"),
    )


def plain_diagnostics(shown: object, room: int = MOST_SHOWN) -> tuple[Diagnostics, int]:
    """What a navigator showed, to the millimetre: it is for drawing, and the navigator goes on using its arrays.

    Args:
        shown: What `diagnostics()` returned.
        room: How many bytes it may have.

    Returns:
        The copy, and how many bytes it has, roughly.

    Raises:
        TypeError, ValueError: it isn't what `Diagnostics` says, or too much.
    """
    if not isinstance(shown, Diagnostics):
        raise TypeError(f"diagnostics() returned a {type(shown).__name__}, not a Diagnostics")
    field = shown.field
    found = Diagnostics(
        polylines=_drawn(shown.polylines, "polylines", 2, room),
        circles=_drawn(shown.circles, "circles", 3, room),
        tube=None if shown.tube is None else _points(shown.tube, 3, room),
        tree=None if shown.tree is None else _points(shown.tree, 4, room),
        field=None if field is None else _grid(field, room),
        status=plain_text(shown.status, "the status of its diagnostics"),
        iterations=_iterations(shown.iterations),
    )
    drawings = [*found.polylines.values(), *found.circles.values(), found.tube, found.tree]
    size = sum(a.nbytes + 100 for a in drawings if a is not None)
    size += 0 if found.field is None else found.field.data.nbytes
    _refuse_much(size, room)
    return found, size


def _finite(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise TypeError(f"{what} is {_brief(value)}, not a number")
    try:
        number = float.__float__(value) if isinstance(value, float) else float(value)
    except OverflowError:
        raise ValueError(f"{what} is a whole number too large for any speed") from None
    if not math.isfinite(number):
        raise ValueError(f"{what} = {number} is not finite")
    return number


def _truth(value: object, what: str) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{what} is {_brief(value)}, not True or False")
    return bool(value)


def _texts(values: object, what: str) -> tuple[str, ...]:
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise TypeError(f"{what} is {_brief(values)}, not a tuple of texts")
    texts = tuple(plain_text(value, what) for value in islice(values, MOST_TEXTS + 1))
    if len(texts) > MOST_TEXTS:
        raise ValueError(f"{what} holds more than {MOST_TEXTS} texts")
    return texts


def _drawn(drawings: object, what: str, width: int, room: int) -> dict[str, FloatArray]:
    if not isinstance(drawings, Mapping):
        raise TypeError(f"the {what} of its diagnostics are a {type(drawings).__name__}, not a mapping")
    if len(drawings) > MOST_DRAWINGS:
        raise ValueError(f"its diagnostics hold {len(drawings)} {what}; at most {MOST_DRAWINGS} are kept")
    return {plain_text(name, f"a name of its {what}"): _points(line, width, room) for name, line in drawings.items()}


def _points(values: Any, width: int, room: int) -> FloatArray:
    _refuse_much(getattr(values, "size", 0) * 8, room)
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":
        raise TypeError(f"diagnostics() gave an array of {given.dtype} where numbers are expected")
    found: FloatArray = given.astype(np.float64).round(3)
    if found.ndim != 2 or found.shape[1] != width:
        raise ValueError(f"diagnostics() gave an array of shape {found.shape} where (n, {width}) is expected")
    return found


def _grid(field: object, room: int) -> OccupancyGrid:
    if not isinstance(field, OccupancyGrid):
        raise TypeError(f"the field of its diagnostics is a {type(field).__name__}, not an OccupancyGrid")
    cells = np.asarray(field.data)
    if cells.ndim != 2 or cells.dtype.kind not in "fiub":
        raise TypeError(
            f"the field of its diagnostics has cells {cells.dtype} {cells.shape}; rows of numbers are expected"
        )
    _refuse_much(cells.size, room)
    x, y = (_finite(value, "the field's origin") for value in field.origin)
    return OccupancyGrid(cells.astype(np.int8), _finite(field.resolution, "the field's resolution"), (x, y))


def _iterations(value: object) -> int:
    number = int(value) if isinstance(value, int | np.integer) else int(_finite(value, "the number of iterations"))
    if not 0 <= number <= _MOST_ITERATIONS:
        raise ValueError(f"diagnostics() gave {_brief(value)} iterations")
    return number


def _refuse_much(size: int, room: int) -> None:
    if size > room:
        raise ValueError(f"its diagnostics hold more than {MOST_SHOWN:.0e} bytes in a trial")


def _brief(value: object) -> str:
    return f"a {type(value).__name__}" if not isinstance(value, bool | int | float | str | None) else f"{value!r:.100}"

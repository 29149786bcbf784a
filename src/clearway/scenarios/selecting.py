"""What a Python program gives where several values may stand: one stands for itself alone, and what is of another type is told by its
name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Any

from clearway.errors import ClearwayError, shown
from clearway.scenarios.replay import Replay
from clearway.scenarios.suite import Selection, seed_range


def strings(values: Any, field: str) -> tuple[str, ...]:
    """Names as they were given, one or several; anything else is told by its `field`."""
    return tuple(_each(values, field, str, "a name"))


def numbers(values: Any, field: str) -> tuple[float, ...]:
    """Numbers as they were given, one or several; anything else is told by its `field`."""
    return tuple(float(value) for value in _each(values, field, Real, "a number"))


def whole_numbers(values: Any, field: str) -> tuple[int, ...]:
    """Whole numbers, likewise."""
    return tuple(int(value) for value in _each(values, field, Integral, "a whole number"))


def number(value: Any, field: str) -> float | None:
    """A number, or None; anything else is told by its `field`."""
    return None if value is None else float(_one(value, field, Real, "a number"))


def whole_number(value: Any, field: str) -> int | None:
    """A whole number, or None, likewise."""
    return None if value is None else int(_one(value, field, Integral, "a whole number"))


def text(value: Any, field: str) -> str | None:
    """A name, or None, likewise."""
    return None if value is None else str(_one(value, field, str, "a name"))


def selection_of(given: Mapping[str, Any]) -> Selection:
    """The part of a suite that fields of a `Selection` say, each as a Python program gives it.

    Raises:
        ClearwayError: one is of another type.
    """
    return Selection(**{name: _READ[name](value, name) for name, value in given.items()})


def _seeds(value: Any, field: str) -> tuple[int, int] | None:
    if value is None:
        return None
    if isinstance(value, str):
        return seed_range(value)
    try:
        first, last = whole_numbers(value, field)
    except (ClearwayError, ValueError):
        raise ClearwayError(
            f"{shown(value)} is no range of seeds; (0, 200) are the seeds 0 to 199", field=field
        ) from None
    return first, last


def _people(value: Any, field: str) -> Replay | None:
    if not isinstance(value, Replay | None):
        raise ClearwayError(f"{shown(value)} is no `Replay`, as `recorded_people` reads one", field="people")
    return value


_READ: Mapping[str, Callable[[Any, str], Any]] = {
    **dict.fromkeys(("batches", "configurations", "scenarios", "ideal", "team"), strings),
    **dict.fromkeys(("speeds", "sizes", "gaps", "obstacle_speeds"), numbers),
    **dict.fromkeys(("disturbance", "latency"), number),
    "worlds": whole_numbers, "repetitions": whole_number, "floor_plan": text, "seeds": _seeds, "replay": _people,
}  # fmt: skip


def _each(values: Any, field: str, kind: type, what: str) -> tuple[Any, ...]:
    try:
        found = (values,) if isinstance(values, str) else tuple(values)  # a name is no list of its letters
    except TypeError:
        found = (values,)
    return tuple(_one(value, field, kind, what) for value in found)


def _one(value: Any, field: str, kind: type, what: str) -> Any:
    if not isinstance(value, kind) or isinstance(value, bool):
        raise ClearwayError(f"{shown(value)} is not {what}", field=field)
    return value

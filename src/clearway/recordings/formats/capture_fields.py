"""What the cells of a capture's header and of its rotation columns mean: units, rates, dates, names, orientations."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.recording import Want

UNITS = {
    "mm": 0.001,
    "millimeter": 0.001,
    "millimeters": 0.001,
    "millimetres": 0.001,
    "cm": 0.01,
    "centimeter": 0.01,
    "centimeters": 0.01,
    "centimetres": 0.01,
    "dm": 0.1,
    "m": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "metres": 1.0,
    "in": 0.0254,
    "inch": 0.0254,
    "inches": 0.0254,
    "ft": 0.3048,
    "feet": 0.3048,
}
"""m, by what files call it, in lower case."""

_UNLABELLED = re.compile(r"(?:[^:]*:)?(?:\*\d+|u_\d+|unlabell?ed[ _:-]?\d*|uname\*?\d*)", re.IGNORECASE)


def unit(text: str, *, file: Path, field: str) -> float:
    """Metres in one of the unit that a file names.

    Raises:
        ClearwayError: it names none, or one that isn't known: lengths are never guessed.
    """
    known = UNITS.get(text.strip().strip("()[]").lower())
    if known is None:
        what = f"{text.strip()[:40]!r} is no unit of length" if text.strip() else "the unit of length is missing"
        raise ClearwayError(f"{what}; it has to be one of mm, cm, m, in, ft", file=file, field=field)
    return known


def rate_of(text: str, *, file: Path, field: str, value: float | None) -> float:
    """A sampling rate in Hz, `value` being what `text` says.

    Raises:
        ClearwayError: it is none.
    """
    if value is None or not 1e-3 <= value <= 1e6:
        raise ClearwayError(
            f"{text.strip()[:40]!r} is no sampling rate; a number of Hz is needed", file=file, field=field
        )
    return value


def unique(names: Iterable[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of which every later one of the same gets a number, and a note if that was needed."""
    taken: set[str] = set()
    again: list[str] = []
    out: list[str] = []
    count: dict[str, int] = {}
    for name in names:
        new = name
        while new in taken:
            count[name] = count.get(name, 1) + 1
            new = f"{name} ({count[name]})"
        if new != name:
            again.append(name)
        taken.add(new)
        out.append(new)
    listed = ", ".join(repr(n) for n in dict.fromkeys(again))
    return tuple(out), (f"several things are called {listed[:200]}; the later ones got a number",) if again else ()


def is_unlabelled(name: str) -> bool:
    """Whether a trajectory was seen, but not said whose it is (`*12`, `U_12`, `Unlabeled 1189`)."""
    return _UNLABELLED.fullmatch(name) is not None


def wanted_of(names: Collection[str], want: Want) -> list[str]:
    """The trajectories that are wanted; where nothing is named and some are labelled, only these."""
    every = want.names is not None or all(map(is_unlabelled, names))
    return [name for name in names if want.has(name) and (every or not is_unlabelled(name))]


def timestamp(text: str, patterns: Sequence[str]) -> float | None:
    """UNIX time of a date that names no time zone, taken as UTC; None if it is no date."""
    for pattern in patterns:
        try:
            return datetime.strptime(text.strip(), pattern).replace(tzinfo=UTC).timestamp()
        except (ValueError, OverflowError):
            continue
    return None


def xyzw(values: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of length one; NaN where there is none."""
    with np.errstate(all="ignore"):
        length = np.linalg.norm(values, axis=1, keepdims=True)
        known = np.isfinite(length) & (length > 0.5) & (length < 2.0)  # rounded, not some other thing
        return np.asarray(np.where(known, values / length, np.nan))


def euler(values: FloatArray, order: str) -> FloatArray:
    """Quaternions (n, 4) of angles (n, 3) in degrees about the axes in `order`, as in scipy; NaN where one is missing."""
    out = np.full((len(values), 4), np.nan)
    known = np.isfinite(values).all(axis=1) & (np.abs(values) < 1e6).all(axis=1)
    if known.any():
        out[known] = Rotation.from_euler(order, values[known], degrees=True).as_quat()
    return out

"""Numbers and outlines as the fields of files have them: really numbers (no text, no true), finite, and within what can be
meant."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from clearway.reading.limits import COORDINATE, LENGTH, NUMBER, SECONDS, SHORTEST, SPEED, TURN, VERTICES

DEGREES = r"\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*(?:deg|degrees|°)\s*"
"""How an angle is written in degrees: "180 deg"."""


def _sane(value: float) -> float:
    if abs(value) > NUMBER:
        raise ValueError(f"{value:g} cannot be meant: it is beyond {NUMBER:g}")
    return value


# No bound of these may be one that a field sets for itself: of two, pydantic keeps the type's.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False), AfterValidator(_sane)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0), AfterValidator(_sane)]
NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0), AfterValidator(_sane)]
Rate = Annotated[float, Field(strict=True, gt=0)]
"""A limit, which may be infinite."""
Delay = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=2)]
"""s; what is later than that nobody can drive with."""
Whole = Annotated[int, Field(strict=True)]
Seed = Annotated[int, Field(strict=True, ge=0, lt=2**63)]

Coordinate = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-COORDINATE, le=COORDINATE)]
"""x or y, m."""


def _radians(value: Any) -> Any:
    """What is written in degrees as radians, anything else as it is."""
    if not isinstance(value, str):
        return value
    if (found := re.fullmatch(DEGREES, value[:100])) is None:
        raise ValueError(f'{value[:40]!r} is no angle; radians as a number, or degrees as "90 deg"')
    return math.radians(float(found[1]))


def _turn(value: float) -> float:
    if abs(value) > TURN and math.isfinite(value):
        raise ValueError(
            f"{value:g} is more than a full turn; angles are in radians: {value:g} degrees are {math.radians(value):.6g}, and can "
            f'be written as "{value:g} deg"'
        )
    return value


def _tolerance(value: float) -> float:
    _turn(value)
    if math.pi < value < 0.99 * math.tau:
        raise ValueError(
            f"{value:g} is more than half a turn, so that any heading is within it; angles are in radians: {value:g} degrees are "
            f'{math.radians(value):.6g}, and can be written as "{value:g} deg"; inf: the heading is free'
        )
    return value


_TEXT = WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "pattern": f"^{DEGREES}$"}]})

Angle = Annotated[
    float, Field(strict=True, allow_inf_nan=False), BeforeValidator(_radians), AfterValidator(_turn), _TEXT
]
"""rad, within a full turn either way; or text in degrees, such as "90 deg"."""
AngleTolerance = Annotated[
    float, Field(strict=True, gt=0), BeforeValidator(_radians), AfterValidator(_tolerance), _TEXT
]
"""How far off an angle may be, likewise; inf: it is free."""
PositiveAngle = Annotated[
    float, Field(strict=True, allow_inf_nan=False, gt=0), BeforeValidator(_radians), AfterValidator(_tolerance), _TEXT
]
"""The same, which can't be free."""
AngleSpread = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=0), BeforeValidator(_radians), AfterValidator(_turn), _TEXT
]
"""Standard deviation of an angle, likewise."""
Length = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=SHORTEST, le=LENGTH)]
"""Of a thing, m."""
Distance = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=LENGTH)]
"""m."""
Speed = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=SPEED)]
"""m/s."""
Duration = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=SECONDS)]
"""s."""
Point = tuple[Coordinate, Coordinate]
"""x, y [m]."""
PoseSpec = tuple[Coordinate, Coordinate, Angle]
"""x [m], y [m], theta [rad]."""


def _simple(vertices: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """The vertices of a polygon, if it runs counter-clockwise, encloses an area and neither crosses nor touches itself."""
    p = np.array(vertices)
    q = np.roll(p, -1, axis=0)
    if (same := np.flatnonzero((p == q).all(axis=1))).size:
        i = int(same[0])
        if i == len(p) - 1:
            raise ValueError("the last vertex is the first one again; leave it out")
        raise ValueError(f"vertices {i} and {i + 1} are the same place")
    if (p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]).sum() <= 0:
        raise ValueError("vertices must run counter-clockwise around a positive area")
    if np.ptp(p, axis=0).max() > LENGTH:
        raise ValueError(f"it extends over more than {LENGTH:g} m")

    def side(a: Any, b: Any, c: Any) -> Any:
        """On which side of the edges from a to b the points c are: (edges, points)."""
        d, e = (b - a)[:, None, :], c[None, :, :] - a[:, None, :]
        return np.sign(d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0])

    apart = side(p, q, p) * side(p, q, q) > 0  # (i, j): edge j lies on one side of the line through edge i
    low, high = np.minimum(p, q), np.maximum(p, q)
    beside = ((low[:, None] > high[None]) | (low[None] > high[:, None])).any(axis=2)
    meets = ~(apart | apart.T | beside)
    n = len(p)
    first, second = np.nonzero(np.triu(meets, 2))
    distinct = second - first != n - 1  # the last edge and the first share a vertex
    if distinct.any():
        k = int(np.flatnonzero(distinct)[0])
        raise ValueError(
            f"the outline crosses or touches itself: the edges behind vertices {first[k]} and {second[k]} meet"
        )
    d, e = q - p, np.roll(q, -1, axis=0) - q
    back = (d[:, 0] * e[:, 1] == d[:, 1] * e[:, 0]) & ((d * e).sum(axis=1) < 0)
    if back.any():
        raise ValueError(f"the outline goes back on itself at vertex {(int(np.flatnonzero(back)[0]) + 1) % n}")
    return vertices


Vertices = Annotated[tuple[Point, ...], Field(min_length=3, max_length=VERTICES), AfterValidator(_simple)]
"""Of a simple polygon, counter-clockwise, m."""

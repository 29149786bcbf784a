"""Outlines as ROS has them: a text with a list of points."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator

from clearway.errors import shown
from clearway.reading.limits import VERTICES

Points = tuple[tuple[float, float], ...]


class WrittenAs(NamedTuple):
    """The type that a file has for a field whose own is another.

    Attributes:
        kind: bool, int, float, str or tuple.
    """

    kind: type


def points_of(text: Any) -> Any:
    """The points in a text such as "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]]", m; none of "" and "[]".

    Raises:
        ValueError: it isn't three points or more of two numbers each.
    """
    if not isinstance(text, str):
        return text
    inside = text.strip()
    if inside in ("", "[]"):
        return ()
    wrong = ValueError(
        f'{shown(text)} is no outline; write "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]", in metres'
    )
    if not (inside.startswith("[") and inside.endswith("]")):
        raise wrong
    inside = inside[1:-1]
    if re.sub(r"\[[^\[\]]*\]", "", inside).strip(" ,\t\n"):
        raise wrong
    try:
        points = tuple(
            tuple(map(float, re.split(r"[\s,]+", p.strip(" ,\t\n")))) for p in re.findall(r"\[([^\[\]]*)\]", inside)
        )
    except ValueError:
        raise wrong from None
    if any(len(p) != 2 or not all(map(math.isfinite, p)) for p in points):
        raise wrong
    if not 3 <= len(points) <= VERTICES:
        raise ValueError(f"has {len(points)} points; an outline has 3 to {VERTICES}")
    return points


Outline = Annotated[Points, BeforeValidator(points_of), WrittenAs(str)]
"""Of a robot or a zone, (x, y) in m each; empty: none is given."""

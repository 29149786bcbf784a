"""Poses on the command line: radians, or degrees as text; what must be degrees is refused."""

from __future__ import annotations

import math

import pytest

from clearway.cli._options import numbers
from clearway.errors import ClearwayError


def test_radians_and_degrees() -> None:
    assert numbers("1,0,1.5", "--start", (3,), angle=2) == [1.0, 0.0, 1.5]
    assert numbers("1, -2, 90 deg", "--start", (3,), angle=2) == [1.0, -2.0, pytest.approx(math.pi / 2)]
    assert numbers("400,0", "--goal", (2, 3), angle=2) == [400.0, 0.0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1,0,90", '--start: .*90 is more than a full turn.*1.5708, and can be written as "90 deg"'),
        ("1,0", "--start: '1,0' is not 3 numbers"),
        ("1,0,north", '--start: .*is no angle; radians as a number, or degrees as "90 deg"'),
        ("1,east,0", "--start: 'east': is no number"),
        ("1,nan,0", "--start: 'nan': is no number"),
        ("", "--start: .*is no number"),
    ],
)
def test_what_is_none(text: str, says: str) -> None:
    with pytest.raises(ClearwayError, match=says):
        numbers(text, "--start", (3,), angle=2)

"""Puts two sources of one trial on one clock, by how fast the robot drove and turned in both."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import Motion


@dataclass(frozen=True, slots=True)
class Offset:
    """Clock of b against a's.

    Attributes:
        seconds: to add to b's stamps for a's clock. sigma: its standard uncertainty, s. correlation: agreement of the
        two motions there, 1 if they are the same. note: in a sentence. drift: s of b gained on a per s, 0 if none was seen.
    """

    seconds: float
    sigma: float
    correlation: float
    note: str
    drift: float = 0.0


def offset(a: Motion, b: Motion, *, within: tuple[float, float] | None = None) -> Offset:
    """What to add to b's stamps; looked for `within` (least, most) s if given, else everywhere."""
    raise NotImplementedError


def resample(motion: Motion, t: FloatArray) -> Motion:
    """`motion` at `t` (n,) s, linear between samples; NaN through gaps and outside."""
    raise NotImplementedError

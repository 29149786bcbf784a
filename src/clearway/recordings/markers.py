"""From markers or tracks to motion: which markers make a body, names put right, poses fitted, gaps, filter, uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from clearway.geometry.shapes import FloatArray
from clearway.recordings.base import Base
from clearway.recordings.motion import Motion
from clearway.recordings.plan import MotionSpec
from clearway.recordings.recording import Points, Track


@dataclass(frozen=True, slots=True, eq=False)
class MarkerSet:
    """The markers of one rigid body: names (m) as the file has them; model: (m, 3) m where they sit on it, in any frame
    of the body (base_link, if its `base` is to be None), None: learnt from the capture."""

    names: tuple[str, ...]
    model: FloatArray | None = None


def resolve(
    names: Sequence[str], wanted: Sequence[str] | str, *, file: object = None, field: str | None = None
) -> tuple[str, ...]:
    """The markers out of `names` (of a file) that `wanted` says: names, or a prefix that ends in `:`."""
    raise NotImplementedError


def learnt(points: Points, spec: MarkerSet, cleaning: MotionSpec) -> MarkerSet:
    """The set with the model that the capture itself shows, in a frame that is the same for every capture of it: z up,
    origin in the markers' centroid, x towards the first marker. Learn once and use for all trials of a robot."""
    raise NotImplementedError


def motion_of_markers(
    points: Points,
    spec: MarkerSet,
    cleaning: MotionSpec,
    base: Base | None,
    *,
    file: object = None,
    field: str | None = None,
) -> Motion:
    """How a body moved, from its markers; base None: the motion of the model's own frame."""
    raise NotImplementedError


def motion_of_track(
    track: Track,
    cleaning: MotionSpec,
    base: Base | None,
    *,
    heading: Literal["measured", "travel"] = "measured",
    file: object = None,
    field: str | None = None,
) -> Motion:
    """How a body moved, from a track of poses."""
    raise NotImplementedError

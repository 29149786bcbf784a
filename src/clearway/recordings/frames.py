"""Ties a source's frame to the map: by holds of the robot on known poses, by surveyed points, or as given."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import Motion


@dataclass(frozen=True, slots=True, eq=False)
class Tie:
    """A source's frame in the map.

    Attributes:
        pose: (3,) of the source's frame in the map: m, m, rad. sigma: (2,) standard uncertainty of a place at `pivot`
        [m] and of the heading [rad], NaN if unknown; farther off the lever arm adds. residuals: (k,) m, how far each
        hold or point lies from where the tie puts it. note: what was done, in a sentence. pivot: (2,) m, in the source's
        frame.
    """

    pose: FloatArray
    sigma: FloatArray
    residuals: FloatArray
    note: str
    pivot: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """The robot at rest: pose (3,) in the source's frame (theta NaN without a heading), sigma (2,) m and rad."""

    pose: FloatArray
    sigma: FloatArray


def hold(
    motion: Motion, span: tuple[float, float] | None = None, *, moved: float = 0.005, turned: float = 0.01
) -> Hold:
    """Where the robot stood in `span` [s on the motion's clock]; an error if it moved more than `moved` m, `turned` rad."""
    raise NotImplementedError


def tie_by_holds(measured: FloatArray, known: FloatArray, sigma: tuple[float, float] = (0.005, 0.01)) -> Tie:
    """From poses (k, 3) in the source's frame and the same in the map; `sigma` of one pair: m, rad. NaN heading: unknown."""
    raise NotImplementedError


def tie_by_points(measured: FloatArray, known: FloatArray, sigma: float = 0.005) -> Tie:
    """From k >= 2 places (k, 2) in the source's frame and the same in the map; `sigma` of one pair: m."""
    raise NotImplementedError


def given(pose: FloatArray, sigma: tuple[float, float] | None = None) -> Tie:
    """The tie that somebody measured: `pose` (3,), `sigma` m at the frame's origin and rad, None if unknown."""
    raise NotImplementedError


def apply(tie: Tie, motion: Motion) -> Motion:
    """`motion` in the map, its uncertainty grown by the tie's."""
    raise NotImplementedError

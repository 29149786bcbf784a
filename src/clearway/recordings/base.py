"""From what was fitted (a marker set, a rigid body of the file) to base_link: the transform, and how surely it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import Motion


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """base_link in the frame of what was fitted: a point x of base_link lies at rotation @ x + point.

    Attributes:
        rotation: (3, 3). point: (3,) m. sigma: standard uncertainty of its position [m, one axis] and heading [rad].
        residual: of whatever it was found by, m, None if it was given. note: how it was found, a sentence.
    """

    rotation: FloatArray
    point: FloatArray
    sigma: tuple[float, float]
    residual: float | None
    note: str


def from_offset(offset: Sequence[float], sigma: tuple[float, float] = (0.0, 0.0)) -> Base:
    """The base whose pose (x [m], y [m], theta [rad]) in the frame of the body was given."""
    raise NotImplementedError


def from_coordinates(
    coordinates: FloatArray, names: Sequence[str], model: FloatArray | None = None, *, field: str | None = None
) -> Base:
    """The base from its markers' coordinates (m, 3) in base_link; `model` (m, 3): the same markers as the capture has
    them (`markers.learnt`), None: the coordinates themselves are the model, so that it needs no transform."""
    raise NotImplementedError


def from_static_and_straight(
    static: Motion | None,
    pose: FloatArray | None,
    straight: Motion,
    *,
    turn: Motion | None = None,
    placed: tuple[float, float] = (0.0, 0.0),
    field: str | None = None,
) -> Base:
    """The base from the body at rest on a known pose (3,) of base_link in `static`'s frame and a straight drive forward.

    All motions are of the body itself (made with base=None, same model). `turn`: a turn in place, instead of `static`
    or beside it. `placed`: standard uncertainty [m, rad] with which the robot was placed on `pose`.
    """
    raise NotImplementedError

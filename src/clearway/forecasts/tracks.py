"""What is known of the obstacles that are followed: one row of arrays each, and what is perceived of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.forecasts.bounds import RECENT
from clearway.forecasts.models import FAMILIES, OSCILLATION, Filters, Models
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

FIRST, SEEN, MOVED = 0, 1, 2
"""Columns of `Tracks.clock`."""


class Tracks(NamedTuple):
    """Room for C tracks; the first `count` rows that its owner knows of are in use.

    Attributes:
        label: (C,) int64, the identity that perception gives it now.
        identity: (C,) int64, the identity that the forecaster gives it.
        clock: (C, 3) when it began, when it was perceived last, and when perceived last as one that moves, s.
        changes: (C,) how many changes of its kind of motion were seen.
        size: (C, 2) its radius and the error of its last place, m.
        mean: (C, 2, 5, 3), see `models.begin`.
        cov: (C, 5, 6), see `models.begin`.
        turn: (C, R, 4), see `models.begin`.
        turn_cov: (C, R, 4), see `models.begin`.
        osc: (C, 2, B, 4), see `oscillations`.
        osc_cov: (C, 2, B, 10), see `oscillations`.
        family: (C, 6 + R), see `mixture.weigh`.
        stiff: (C, 2, B), see `mixture.weigh`.
        disc: (C, 6), see `bounds.start`.
        recent: (C, RECENT, 4), see `bounds.start`.
    """

    label: npt.NDArray[np.int64]
    identity: npt.NDArray[np.int64]
    clock: FloatArray
    changes: FloatArray
    size: FloatArray
    mean: FloatArray
    cov: FloatArray
    turn: FloatArray
    turn_cov: FloatArray
    osc: FloatArray
    osc_cov: FloatArray
    family: FloatArray
    stiff: FloatArray
    disc: FloatArray
    recent: FloatArray


def room(models: Models, capacity: int) -> Tracks:
    """Empty room for `capacity` tracks."""
    bank, turns, c = len(models.stiffness), len(models.turn), capacity
    return Tracks(
        np.zeros(c, dtype=np.int64), np.zeros(c, dtype=np.int64), np.zeros((c, 3)), np.zeros(c), np.zeros((c, 2)),
        np.zeros((c, 2, OSCILLATION, 3)), np.zeros((c, OSCILLATION, 6)), np.zeros((c, turns, 4)), np.zeros((c, turns, 4)),
        np.zeros((c, 2, bank, 4)), np.zeros((c, 2, bank, 10)), np.zeros((c, FAMILIES + turns)), np.zeros((c, 2, bank)),
        np.zeros((c, 6)), np.zeros((c, RECENT, 4)),
    )  # fmt: skip


def keep(tracks: Tracks, rows: npt.NDArray[np.int64], capacity: int) -> Tracks:
    """The tracks of `rows` in this order, with room for `capacity`."""
    moved = []
    for a in tracks:
        b = np.zeros((capacity, *a.shape[1:]), dtype=a.dtype)
        b[: len(rows)] = a[rows]
        moved.append(b)
    return Tracks(*moved)


class Perceived(NamedTuple):
    """The m obstacles that are perceived, map frame; see `Obstacles`.

    Attributes:
        place: (m, 2) m.
        error: (m,) its bound, m.
        velocity: (m, 2) m/s.
        velocity_error: (m,) its bound, m/s.
        radius: (m,) m.
        label: (m,) int64, the identity that perception gives it.
        moving: (m,) bool.
    """

    place: FloatArray
    error: FloatArray
    velocity: FloatArray
    velocity_error: FloatArray
    radius: FloatArray
    label: npt.NDArray[np.int64]
    moving: npt.NDArray[np.bool_]


class Limits(NamedTuple):
    """Numbers of the parameters that the kernels need; what they are for stands there.

    Attributes:
        speed: Speed that no obstacle exceeds, m/s.
        acceleration: Bound on an obstacle's acceleration, m/s^2.
        usual_speed: Standard deviation of a component of a new obstacle's velocity, m/s.
        switching: Rate at which the kind of motion changes, 1/s.
        refuted: Probability below which a kind of motion is begun anew.
        surprise: Squared deviations of the best model beyond which all begins anew.
        agree: Standard deviations within which two hypotheses are one.
        least: Probability below which a hypothesis is left out.
        patience: What is added to an obstacle's age when the changes seen of it are made a rate, s.
        velocities: Whether measured velocities are taken in, too.
    """

    speed: float
    acceleration: float
    usual_speed: float
    switching: float
    refuted: float
    surprise: float
    agree: float
    least: float
    patience: float
    velocities: bool


@kernel
def filters_of(tracks: Tracks, i: int) -> Filters:
    """The filters of track `i`; what is written into them is written into the track."""
    return Filters(
        tracks.mean[i], tracks.cov[i], tracks.turn[i], tracks.turn_cov[i], tracks.osc[i], tracks.osc_cov[i],
        tracks.family[i], tracks.stiff[i],
    )  # fmt: skip

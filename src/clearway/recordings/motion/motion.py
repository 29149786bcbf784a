"""What becomes of markers and tracks: how one body moved on the floor, how surely, and what had to be done for it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from pydantic import Field

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.quantities import NonNegative, Positive
from clearway.validation import Table


class NeverSeen(ClearwayError):
    """A recording that should show a body does not show it once."""


class MotionSpec(Table):
    """How markers become motion: [motion] of a test plan."""

    cutoff: Positive | Literal["residual", "none"] = Field(
        default="residual",
        description="of the zero-phase Butterworth low-pass: Hz, chosen by residual analysis, or none",
    )
    spline: NonNegative = Field(default=0.2, description="longest gap that is filled by a spline, s")
    residual: Positive = Field(default=0.01, description="largest rms residual of a rigid fit that is believed, m")


@dataclass(frozen=True, slots=True)
class Gap:
    """A stretch in which a body was not fully seen.

    Attributes:
        start: When it begins, s.
        end: When it ends, s.
        filled: What it was filled from; empty: left open.
    """

    start: float
    end: float
    filled: Literal["markers", "spline", ""]


@dataclass(frozen=True, slots=True)
class Quality:
    """How good a motion is.

    Attributes:
        rate: Median sampling rate, Hz.
        seen: Share of the samples that were measured.
        gaps: All gaps, in order.
        residual: Root mean square residual of the rigid fit, m; None where nothing was fitted.
        residual_max: Largest residual of the rigid fit, m; None where nothing was fitted.
        swapped: Number of samples in which two markers had changed names and were put back.
        refused: Number of samples that no rigid body explains, left open.
        noise: Standard deviation of a marker's coordinate, m, None if unknown.
        cutoff: Cut-off of the low-pass, Hz; None: not filtered.
    """

    rate: float
    seen: float
    gaps: tuple[Gap, ...] = ()
    residual: float | None = None
    residual_max: float | None = None
    swapped: int = 0
    refused: int = 0
    noise: float | None = None
    cutoff: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How one body moved on the floor.

    Attributes:
        t: (n,) s, strictly increasing, on the source's clock.
        pose: (n, 3) x, y [m], theta [rad, unwrapped], in the source's frame until a tie
            (`clearway.recordings.alignment.frames`) moves it to the map; NaN where it is unknown, theta NaN throughout
            for a source without heading.
        velocity: (n, 2) v along the body's x [m/s] and omega [rad/s] (v = |dp/dt| where there is no heading), NaN where
            unknown.
        sigma: (n, 2) standard uncertainty of position [m] and heading [rad], None if unknown.
        quality: How good it is.
        notes: What was done, in sentences.
        residual: (n,) rms of the rigid fit in each frame, m, NaN where nothing was fitted; None without markers.
    """

    t: FloatArray
    pose: FloatArray
    velocity: FloatArray
    sigma: FloatArray | None
    quality: Quality
    notes: tuple[str, ...] = field(default=())
    residual: FloatArray | None = None

    @property
    def wrapped(self) -> FloatArray:
        """(n, 3) the pose with theta in [-pi, pi)."""
        pose = self.pose.copy()
        pose[:, 2] = np.remainder(pose[:, 2] + np.pi, 2 * np.pi) - np.pi
        return pose

    @property
    def told(self) -> dict[str, Any]:
        """What a trial's provenance says of it, as JSON."""
        return asdict(self.quality) | {"notes": list(self.notes)}

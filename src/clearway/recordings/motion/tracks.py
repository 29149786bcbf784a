"""From tracks (a rigid body of the file, a topic, a pedestrian) to motion: base_link, floor, headings, jumps, filter."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import filtering
from clearway.recordings.motion.base import Base
from clearway.recordings.motion.cleaning import clean
from clearway.recordings.motion.gaps import known, runs, usual_step
from clearway.recordings.motion.motion import Motion, MotionSpec, NeverSeen, Quality
from clearway.recordings.motion.rests import ARM, STILL
from clearway.recordings.recording import Track

LEANING = math.radians(3)
"""A body that leans more than this isn't a robot on a floor, or its frame isn't level; it is said."""

FAST = 50.0
"""Hz; slower tracks are localisation, odometry or annotation: residual analysis has no band of pure noise there."""

SELDOM, BLUNT = 5.0, 0.5
"""Hz; of fewer samples a second, and below this cut-off, starts and stops would be lost with the noise."""

SLIGHT = STILL / 3
"""m/s; a standard deviation of speed by which what stands still hardly ever seems to move."""

LEAP = (0.1, 5.0)
"""m, m/s: a step longer than the first and the second times its duration is a jump."""

MOVES = 0.05
"""m/s; a body that is slower shows no direction of travel."""


def unwrapped(theta: FloatArray) -> FloatArray:
    """Headings without leaps of a turn, NaN where they were (each taken on from the last that is there)."""
    out = np.full_like(theta, np.nan)
    there = np.isfinite(theta)
    out[there] = np.unwrap(theta[there])
    return out


def tilt_note(leaning: FloatArray) -> list[str]:
    """What to say of how far a body leans (k,) [rad]."""
    if not len(leaning):
        return []
    usual = float(np.quantile(leaning, 0.95))
    if usual <= LEANING:
        return []
    return [
        f"leans by {math.degrees(usual):.1f} degrees (in a twentieth of its frames more): base_link is projected straight"
        " down; is the frame's z up, and is the body's z?"
    ]


def motion_of_track(
    track: Track,
    cleaning: MotionSpec,
    base: Base | None,
    *,
    heading: Literal["measured", "travel"] = "measured",
    file: object = None,
    field: str | None = None,
) -> Motion:
    """How a body moved on the floor, from a track of poses; `base`: where base_link is in the frame of the track's child.

    A track of at least 50 Hz is cleaned as markers are, a slower one only if a cut-off is given, or if its noise hides when the robot stands. Jumps (a localisation
    that corrects itself) stay in place, nothing is smoothed across them. A measured twist is the velocity. The
    uncertainty is what the file states; of a body that a capture tracked without stating one, what its noise shows.

    Args:
        heading: `travel`: the body looks where it goes (a pedestrian, a track without orientation): NaN while it
            stands; reverse can't be told from forward.

    Raises:
        ClearwayError: nothing is known, or a base is to be applied without a measured heading.
    """
    here = known(track.position[:, :2])
    if not here.any():
        raise NeverSeen("the track holds no position", file=file, field=field)
    notes: list[str] = []
    pose = np.full((len(track.t), 3), np.nan)
    turned = track.orientation if heading == "measured" else None
    if turned is None:
        if base is not None and (np.abs(base.point[:2]).max() > 0 or not np.allclose(base.rotation, np.eye(3))):
            raise ClearwayError(
                "base_link lies beside what was tracked, and without a measured heading nobody knows where; use a track"
                " with orientations, or no offset",
                file=file,
                field=field,
            )
        pose[here, :2] = track.position[here, :2]
    else:
        rotation, leaning = _rotations(turned)
        point = np.zeros(3) if base is None else base.point
        at = np.where(np.isfinite(track.position), track.position, 0.0) + rotation @ point
        facing = rotation if base is None else rotation @ base.rotation
        pose[:, :2] = np.where(here[:, None], at[:, :2], np.nan)
        pose[:, 2] = unwrapped(np.arctan2(facing[:, 1, 0], facing[:, 0, 0]))
        pose[~known(pose)] = np.nan
        if not np.isfinite(pose).any():
            raise ClearwayError("the track holds no orientation with a position", file=file, field=field)
        lean = leaning if base is None else np.arccos(np.clip(facing[:, 2, 2], -1.0, 1.0))
        notes += tilt_note(lean[np.isfinite(lean)])
    there = np.isfinite(pose[:, 0])
    jumps = _jumps(track.t, pose)
    if len(jumps):
        far = max(float(math.hypot(*(pose[j, :2] - pose[j - 1, :2]))) for j in jumps)
        notes.append(f"jumps {len(jumps)} times, by up to {far:.2f} m: left in place, and counted as path")
    step = usual_step(track.t)
    rate = 1 / step if step else 0.0
    wanted = not isinstance(cleaning.cutoff, str) or rate > 0.99 * FAST  # stamps are rounded
    raw = _raw_variance(pose)
    if cleaning.cutoff == "residual":
        quiet = _quiet(raw[0], rate) if heading == "measured" else None
        if quiet is not None and not (wanted and quiet >= filtering.LOWEST):
            notes.append(f"filtered at {quiet:.2g} Hz: its noise looks like motion while the robot stands")
            cleaning, wanted = cleaning.model_copy(update={"cutoff": quiet}), True
        elif not wanted:
            notes.append(
                f"not filtered: residual analysis needs at least {FAST:.0f} samples a second, these are {rate:.3g}"
            )
    cleaned = clean(track.t, pose, raw, cleaning, breaks=jumps, wanted=wanted)
    out, velocity = cleaned.pose, cleaned.velocity
    if heading == "travel":
        out = out.copy()
        out[:, 2], velocity = _travelled(track.t, out, velocity)
        notes.append(f"looks where it goes; no heading below {MOVES} m/s")
    if track.twist is not None:
        measured = known(track.twist)
        velocity = np.where(measured[:, None], track.twist, velocity)
    sigma = _sigma(track, cleaned.variance, base)
    if base is not None:
        notes.append(base.note)
    quality = Quality(rate=rate, seen=float(there.mean()), gaps=cleaned.gaps, cutoff=cleaned.cutoff)
    return Motion(track.t, out, velocity, sigma, quality, (*notes, *cleaned.notes))


def _rotations(orientation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation matrices (n, 3, 3) of quaternions (n, 4) xyzw, and how far z leans (n,) [rad]; NaN for NaN and for zero."""
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.linalg.norm(orientation, axis=1)
        good = np.isfinite(size) & (size > 0.5) & (size < 2.0)
    x, y, z, w = (orientation / np.where(good, size, 1.0)[:, None]).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    rotation = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
    rotation[~good] = np.nan
    return rotation, np.arccos(np.clip(rotation[:, 2, 2], -1.0, 1.0))


def _jumps(t: FloatArray, pose: FloatArray) -> Any:
    """Samples that a body can't have reached from the one before."""
    if len(t) < 2:
        return np.empty(0, dtype=int)
    far = np.hypot(*np.diff(pose[:, :2], axis=0).T)
    with np.errstate(invalid="ignore"):
        return 1 + np.flatnonzero(far > LEAP[0] + LEAP[1] * np.diff(t))


def _raw_variance(pose: FloatArray) -> FloatArray:
    """(n, 2) of the noise of the samples, as third differences show it: what decides about rest and the filter."""
    there = np.isfinite(pose[:, 0])
    position = filtering.jitter(pose[there, :2])
    heading = filtering.jitter(pose[there, 2:]) if np.isfinite(pose[there, 2]).all() else math.nan
    return np.broadcast_to(np.square((position, heading)), (len(pose), 2)).copy()


def _quiet(variance: FloatArray, rate: float) -> float | None:
    """The cut-off [Hz] that leaves white noise of that `variance` (2,) a speed that is no motion; None: it shows none as it is, or too seldom
    is it sampled to tell.

    At a cut-off f noise of sigma a sample has a speed of (2 pi f) sigma (2 f / (3 rate))^(1/2).
    """
    noise = float(np.sqrt(variance[0] + np.nan_to_num(ARM**2 * variance[1])))
    if rate < SELDOM or noise * rate / math.sqrt(2.0) <= SLIGHT:
        return None
    wanted = (SLIGHT / (2 * math.pi * noise)) ** (2 / 3) * (1.5 * rate) ** (1 / 3)
    return float(np.clip(wanted, BLUNT, 0.99 * filtering.highest(rate)))


def _sigma(track: Track, left: FloatArray, base: Base | None) -> FloatArray | None:
    """What the file states stays as it is (a localisation's error is no noise that a filter takes away)."""
    if track.sigma is not None:
        variance = np.where(np.isfinite(left[:, :1]), np.square(track.sigma), np.nan)
    elif track.kind == "body":
        variance = left
    else:
        return None
    return np.sqrt(variance + (0.0 if base is None else np.square(base.sigma)))


def _travelled(t: FloatArray, pose: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heading (n,) along the path, NaN where the body is slow, and the velocity with it."""
    theta, out = np.full(len(t), np.nan), np.full_like(velocity, np.nan)
    rows = np.flatnonzero(np.isfinite(pose[:, 0]))
    if len(rows) < 2:
        return theta, out
    rate = np.gradient(pose[rows, :2], t[rows], axis=0)
    speed = np.hypot(rate[:, 0], rate[:, 1])
    theta[rows] = np.where(speed >= MOVES, np.arctan2(rate[:, 1], rate[:, 0]), np.nan)
    theta = unwrapped(theta)
    out[rows, 0] = speed
    good = np.isfinite(theta)
    for a, b in runs(good):
        if b - a > 1:
            out[a:b, 1] = np.gradient(theta[a:b], t[a:b])
    return theta, out

"""One way from raw poses to clean ones, for markers and tracks alike: gaps, rest, low-pass, velocity, and what noise is left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import filtering
from clearway.recordings.motion.gaps import fill, known, stretches, usual_step
from clearway.recordings.motion.motion import Gap, MotionSpec


@dataclass(frozen=True, slots=True, eq=False)
class Cleaned:
    """Poses without noise and short gaps.

    Attributes:
        pose: (n, 3) x, y [m], theta [rad].
        velocity: (n, 2) v [m/s] and omega [rad/s].
        variance: (n, 2) of position (one axis) [m^2] and heading [rad^2].
        gaps: The gaps, filled by spline or left open.
        cutoff: Cut-off of the low-pass, Hz; None: not filtered.
        notes: What was done, in sentences.
    """

    pose: FloatArray
    velocity: FloatArray
    variance: FloatArray
    gaps: tuple[Gap, ...]
    cutoff: float | None
    notes: tuple[str, ...]


def clean(
    t: FloatArray,
    pose: FloatArray,
    variance: FloatArray,
    spec: MotionSpec,
    *,
    correlation: float = 0.0,
    breaks: Any = (),
    wanted: bool = True,
) -> Cleaned:
    """Clean a pose (n, 3) [NaN where unknown, heading unwrapped, NaN throughout without one] at the stamps t (n,) [s].

    A body at rest is held where it is on average while it rests: noise would otherwise become path (0.5 mm on the
    eight markers, standing 10 s at 100 Hz: 46 mm even after a low-pass of 6 Hz). Then each stretch between open gaps is
    low-passed for itself.

    Args:
        variance: (n, 2) of the raw position and heading.
        correlation: Correlation of the noise of neighbouring samples.
        breaks: Indices before which the pose jumps and nothing is smoothed across.
        wanted: Whether to filter at all; False: no filter, whatever `spec` says.
    """
    columns = 3 if np.isfinite(pose[:, 2]).any() else 2
    filled = fill(t, pose[:, :columns], spec.spline)
    out = filled.pose
    spread = np.where(np.isfinite(out[:, :1]), variance, np.nan)
    bridged = known(out) & ~known(pose[:, :columns])
    spread[bridged, 0] = filled.variance[bridged, :2].mean(axis=1)
    spread[bridged, 1] = filled.variance[bridged, 2] if columns == 3 else np.nan
    parts = _split(stretches(t, known(out), spec.spline), breaks)
    cutoff: float | None = None
    notes: tuple[str, ...] = ()
    if spec.cutoff == "none" and wanted:
        notes = ("not filtered: noise makes the path longer than it was",)
    elif wanted and parts:
        cutoff, notes = _filter(t, out, spread, parts, spec, correlation)
    velocity = np.full((len(t), 2), np.nan)
    for a, b in parts:
        velocity[a:b] = filtering.velocity(t[a:b], out[a:b])
    whole = np.full((len(t), 3), np.nan)
    whole[:, :columns] = out
    return Cleaned(whole, velocity, spread, filled.gaps, cutoff, notes)


def _split(parts: list[tuple[int, int]], breaks: Any) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    for a, b in parts:
        first, last = np.searchsorted(breaks, (a, b - 1), side="right")
        found += pairwise([a, *(int(c) for c in breaks[first:last]), b])
    return found


def _filter(
    t: FloatArray,
    pose: FloatArray,
    variance: FloatArray,
    parts: list[tuple[int, int]],
    spec: MotionSpec,
    correlation: float,
) -> tuple[float | None, tuple[str, ...]]:
    """StaticPose and low-pass `pose` in place, and let its `variance` follow; the cut-off, and notes."""
    finite = [column[np.isfinite(column)] for column in variance.T]
    noise = np.array([math.sqrt(np.median(column)) if len(column) else 0.0 for column in finite])
    rests = {part: filtering.at_rest(t[slice(*part)], pose[slice(*part)], noise, correlation) for part in parts}
    step = usual_step(t)
    rate = 1 / step if step else 0.0
    position, heading = _signals(t, pose, parts, rests)
    if spec.cutoff == "residual":
        about = filtering.residual_analysis(position, rate, correlation)
        turn = filtering.residual_analysis(heading, rate, correlation) if heading else None
        cutoff = max(about.cutoff, turn.cutoff) if turn is not None else about.cutoff
    else:
        assert not isinstance(spec.cutoff, str)
        cutoff = spec.cutoff
    notes = []
    if rate <= 0 or cutoff >= filtering.highest(rate) * (1 + 1e-9):
        return None, (
            f"not filtered: a low-pass of {cutoff:g} Hz needs more than {cutoff / 0.4:.3g} samples a second, these are"
            f" {rate:.3g}",
        )
    lost = [
        filtering.distortion(signal, cutoff, rate, filtering.tail_noise(signal, rate, correlation), correlation)
        for signal in (position, heading)
    ]
    still = 0.0
    for (a, b), rest in rests.items():
        blurred = np.stack([filtering.averaged(c, t[a:b], 1 / cutoff) for c in variance[a:b].T], axis=1)
        grown = (1 + correlation) / (1 - correlation)
        blurred = np.maximum(blurred, 0.0)  # a running mean falls below zero by rounding
        left = blurred * filtering.gain(b - a, cutoff, rate, correlation)[:, None] + lost
        for c, d in rest:
            left[c:d] = variance[a + c : a + d].mean(axis=0) * min(1.0, grown / (d - c))
            pose[a + c : a + d] = pose[a + c : a + d].mean(axis=0)
            still += float(t[a + d - 1] - t[a + c])
        pose[a:b] = filtering.smooth(t[a:b], pose[a:b], cutoff)
        variance[a:b] = left
    if still:
        notes.append(f"held at its mean while it rested: {still:.1f} s in {sum(map(len, rests.values()))} stretches")
    return cutoff, tuple(notes)


def _signals(
    t: FloatArray, pose: FloatArray, parts: list[tuple[int, int]], rests: dict[tuple[int, int], Any]
) -> tuple[list[tuple[FloatArray, Any]], list[tuple[FloatArray, Any]]]:
    """Position and heading of every stretch, evenly sampled, each with a mask of where the body moves."""
    position, heading = [], []
    for a, b in parts:
        moves = np.ones(b - a, dtype=bool)
        for c, d in rests[a, b]:
            moves[c:d] = False
        x, s = pose[a:b], t[a:b]
        if not filtering.even(s):
            count = min(math.ceil((s[-1] - s[0]) / usual_step(t)), 4 * len(s)) + 1
            grid = np.linspace(s[0], s[-1], count)
            moves = moves[np.clip(np.searchsorted(s, grid), 0, len(s) - 1)]
            x = np.stack([np.interp(grid, s, column) for column in x.T], axis=1)
        position.append((x[:, :2], moves))
        if pose.shape[1] == 3:
            heading.append((x[:, 2:], moves))
    return position, heading

"""Time stamps as files have them: duplicated, out of order, jumping, in another unit than they are taken for. Here they become
strictly increasing, and it is said how."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.recording import FARTHEST

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units of time that stamps are written in."""
FEW = 20
"""Samples below which nothing can be said of their rate."""
LONGEST_STEP, LONGEST, FASTEST = 5.0, 12 * 3600.0, 20_000.0
"""s, s, Hz: of what moves in a test nobody takes samples farther apart, for so long, or so fast."""
RATES, DURATIONS, SPEEDS = (1.0, 10_000.0), (1.0, 6 * 3600.0), (0.02, 30.0)
"""Hz, s, m/s: what would make sense."""
CREEPING, MOVED, RACING = 0.01, 0.5, 200.0
"""m/s, m, m/s: what moves by more than the second is faster than the first, and nothing is as fast as the third."""
LEAP = 3600.0
"""s; two neighbouring stamps that are farther apart were not taken on one clock."""


def must_be(
    unit: str, t: FloatArray, position: FloatArray | None, how: str, *, file: object, field: str, said: bool
) -> None:
    """Nothing, unless stamps make no sense in the unit that they are taken to be in, and do in another.

    Args:
        unit: That unit, a key of `SECONDS`.
        t: (n,) stamps, s.
        position: (n, 3) of what moved, m, NaN where unseen; None: nobody knows.
        how: What to do about it, with `{other}` for the unit that fits and `{unit}` for this one.
        file: The file, for the error.
        field: The field, for the error.
        said: Whether somebody said that this is the unit; then only more samples a second than can be taken are refused, and what
            races.

    Raises:
        ClearwayError: the stamps make no sense; names the unit in which they would. So many samples a second as nobody takes are
            refused where no unit makes sense of them, too.
    """
    steps = np.diff(t)
    steps = steps[steps > 0]
    if len(steps) < FEW or not np.isfinite(t).all():
        return
    step, lasts, fastest, moved = float(np.median(steps)), float(t.max() - t.min()), *_motion(t, position)
    slow, racing = moved > MOVED and fastest < CREEPING, moved > MOVED and fastest > RACING
    if not (1 / step > FASTEST or racing or (not said and (step > LONGEST_STEP or lasts > LONGEST or slow))):
        return
    for other, seconds in SECONDS.items():
        by = seconds / SECONDS[unit]
        sensible = (RATES[0] <= 1 / (step * by) <= RATES[1]) and (DURATIONS[0] <= lasts * by <= DURATIONS[1])
        if other != unit and sensible and (moved <= MOVED or SPEEDS[0] <= fastest / by <= SPEEDS[1]):
            raise ClearwayError(
                f"read in {unit} it lasts {_lasting(lasts)} with a sample every {step:.3g} s"
                + (f", and moves at {fastest:.2g} m/s" if moved > MOVED else "")
                + f"; in {other} it lasts {_lasting(lasts * by)}, at {1 / (step * by):.4g} Hz: "
                + how.format(other=repr(other), unit=repr(unit)),
                file=file,
                field=field,
            )
    if 1 / step > FASTEST and not said:
        raise ClearwayError(
            f"a sample every {step:.3g} s, {1 / step:.3g} Hz: nobody takes so many; mend the file's rate or times",
            file=file,
            field=field,
        )


def _motion(t: FloatArray, position: FloatArray | None) -> tuple[float, float]:
    """How fast something usually is when it is fast, m/s, and by how much it moved, m; 0 where nobody knows."""
    if position is None:
        return 0.0, 0.0
    seen = (np.abs(position) <= FARTHEST).all(axis=1)
    order = np.argsort(t[seen], kind="stable")
    at, where = t[seen][order], position[seen][order]
    apart = max(1, len(at) // 200)
    lasts = at[apart:] - at[:-apart]
    if not (lasts > 0).any():
        return 0.0, 0.0
    far = np.linalg.norm(where[apart:] - where[:-apart], axis=1)[lasts > 0] / lasts[lasts > 0]
    return float(np.quantile(far, 0.9)), float(np.ptp(where, axis=0).max())


def _lasting(seconds: float) -> str:
    return f"{seconds / 3600:.1f} h" if seconds >= 3600 else f"{seconds:.3g} s"


def in_order(t: FloatArray, *, file: object, field: str, sort: bool = False) -> tuple[Any, tuple[str, ...]]:
    """Which samples to keep, in which order, so that time strictly increases: (k,) int indices, and notes.

    Of several samples with one stamp the first is kept. Stamps that go backwards are put in order where `sort` says
    that arrival and stamping may differ (messages), and are an error where they can't (frames of a capture).

    Args:
        t: (n,) s.

    Raises:
        ClearwayError: a stamp is not finite, time goes backwards though it must not, or leaps by more than an hour.
    """
    t = np.asarray(t, dtype=np.float64)
    notes = []
    if len(bad := np.flatnonzero(~np.isfinite(t))):
        raise ClearwayError(
            f"the time of sample {bad[0]} is {t[bad[0]]}; every sample needs one", file=file, field=field
        )
    order = np.arange(len(t))
    if len(back := np.flatnonzero(np.diff(t) < 0)):
        i = int(back[0])
        if not sort:
            raise ClearwayError(
                f"time goes backwards from {t[i]:.6f} s to {t[i + 1]:.6f} s at sample {i + 1}; it has to increase",
                file=file,
                field=field,
            )
        order = np.argsort(t, kind="stable")
        notes.append(f"{field}: {len(back)} samples were out of order; put in order by their stamps")
    steps = np.diff(t[order])
    if len(steps) and steps.max() > LEAP:
        i = int(steps.argmax())
        raise ClearwayError(
            f"time leaps by {steps[i]:.0f} s after {t[order][i]:.6f} s; give a span on one side of it, or mend the clock",
            file=file,
            field=field,
        )
    keep = np.concatenate(([True], steps > 0)) if len(t) else np.zeros(0, dtype=bool)
    if not keep.all():
        notes.append(f"{field}: {int((~keep).sum())} samples had the stamp of the one before; dropped")
    return order[keep], tuple(notes)

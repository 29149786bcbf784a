"""Time stamps as files have them: duplicated, out of order, jumping. Here they become strictly increasing, and it is said how."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray

LEAP = 3600.0
"""s; two neighbouring stamps that are farther apart were not taken on one clock."""


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

"""Reads the people of a recording, in any format that `clearway import` reads, for the suite `replayed`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reading.limits import COORDINATE, POINTS, TURN
from clearway.recordings.lab.unplanned import Found, motions
from clearway.recordings.motion.motion import MotionSpec
from clearway.scenarios.people import HURRY
from clearway.scenarios.replay import MOST_TIMES, Replay, Walk

STEP = 0.1
"""Of a track that has more samples, one in so many s is kept: somebody at 5 m/s goes 0.5 m in it."""
MOST = 200_000
"""Samples of all people together: they stand in campaign.json, 30 bytes each. The ETH and UCY sets have up to 22,000."""


def replay_of(
    file: str | Path,
    start: Sequence[float],
    goal: Sequence[float],
    at: Sequence[float] = (),
    *,
    bodies: Sequence[str] = (),
    format: str | None = None,
) -> Replay:
    """As `clearway.recorded_people` says, to which it gives what was given."""
    begin = _pose(start, "start", (3,))
    end = _pose(goal, "goal", (2, 3))
    if len(at) > MOST_TIMES:
        raise ClearwayError(f"{len(at)} times; at most {MOST_TIMES} are", field="at")
    for t in at:
        if not math.isfinite(t):
            raise ClearwayError(f"{t!r} is no time, s", field="at")
    if len(set(at)) < len(at):
        raise ClearwayError(f"{next(t for t in at if list(at).count(t) > 1):g} s stands twice", field="at")
    found = list(motions(file, bodies, MotionSpec(), format=format))
    walks = tuple(itertools.chain.from_iterable(_walks(one) for one in found))
    if not walks:
        why = next((one.problem for one in found if one.problem), "nobody was seen for two samples in a row")
        raise ClearwayError(f"nobody walks in it: {why}", file=file, field="body")
    if (count := sum(len(walk.track) for walk in walks)) > MOST:
        raise ClearwayError(
            f"{count:,} samples of people; at most {MOST:,} are: name some of them", file=file, field="body"
        )
    for walk in walks:
        _refuse_flying(walk, file)
    notes = dict.fromkeys(note for one in found if one.motion is not None for note in one.motion.notes)
    first = (begin[0], begin[1], begin[2])
    return Replay(Path(file).name, walks, first, end, tuple(map(float, at)), tuple(notes))


def _pose(values: Sequence[float], field: str, lengths: tuple[int, ...]) -> tuple[float, ...]:
    form = "x, y [m] and theta [rad]" if lengths == (3,) else "x, y [m], and theta [rad] unless the heading is free"
    numbers = tuple(float(v) for v in values)
    if len(numbers) not in lengths or not all(map(math.isfinite, numbers)):
        raise ClearwayError(f"{', '.join(f'{v:g}' for v in numbers)} is no {field}: {form}", field=field)
    if max(map(abs, numbers[:2])) > COORDINATE or any(abs(angle) > TURN for angle in numbers[2:]):
        raise ClearwayError(f"{', '.join(f'{v:g}' for v in numbers)} is no {field} in metres and radians", field=field)
    return numbers


def _walks(found: Found) -> Iterator[Walk]:
    """A body's walks: as long as it was seen without a break."""
    motion = found.motion
    if motion is None:
        return
    seen: Any = np.isfinite(motion.pose[:, :2]).all(axis=1)
    for gap in motion.quality.gaps:
        if not gap.filled:
            seen[(motion.t > gap.start) & (motion.t < gap.end)] = False
    breaks = {gap.start for gap in motion.quality.gaps if not gap.filled}
    cut = np.flatnonzero(~(seen[:-1] & seen[1:]) | np.isin(motion.t[:-1], list(breaks))) + 1
    parts = [p for p in np.split(np.column_stack([motion.t, motion.pose[:, :2]]), cut) if _finite(p)]
    several = len(parts) > 1
    for k, part in enumerate(parts, start=1):
        kept = _thinned(part)
        for n, piece in enumerate(range(0, max(len(kept) - 1, 1), POINTS - 1)):
            samples = kept[piece : piece + POINTS]
            name = f"{found.name}, {k}" if several else found.name
            yield Walk(name if n == 0 else f"{name} ({n + 1})", tuple((t, x, y) for t, x, y in samples.tolist()))


def _finite(part: FloatArray) -> bool:
    return len(part) > 1 and bool(np.isfinite(part).all())


def _thinned(part: FloatArray) -> FloatArray:
    """The samples (n, 3) of `part`, no two within `STEP`, with the first and the last one."""
    kept = [0]
    for k in range(1, len(part) - 1):
        if part[k, 0] - part[kept[-1], 0] >= STEP - 1e-6 and part[-1, 0] - part[k, 0] >= STEP - 1e-6:
            kept.append(k)
    return np.round(part[[*kept, len(part) - 1]], 4)


def _refuse_flying(walk: Walk, file: str | Path) -> None:
    """Complain of somebody who moves as nobody does.

    Raises:
        ClearwayError: who, when and how fast.
    """
    for (t0, *a), (t1, *b) in itertools.pairwise(walk.track):
        if math.dist(a, b) > HURRY * (t1 - t0):
            raise ClearwayError(
                f"{walk.name!r} goes at {math.dist(a, b) / (t1 - t0):.1f} m/s at {t0:g} s; nobody exceeds {HURRY:g} m/s:"
                " are these people, and x and y metres?",
                file=file,
                field="body",
            )

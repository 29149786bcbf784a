"""Where the moving bodies are: knots in time, interpolated in compiled code.

A track is a table of knots (time since the leg began, x, y, theta). Between two knots a body moves on a line at
constant speed and turns the shorter way; it is absent before its first knot, after its last one, and between a knot
and one that is NaN. A way along a polyline has two knots at each corner, so that the heading follows the path; any
other motion arrives as dense knots; of a body that decides they are laid while the trial goes on (`laid`). A body that oscillates, or moves as one of `scenarios.motions`, keeps its time from the
start of the trial.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import light
from clearway.geometry.oscillator import trajectory
from clearway.geometry.shapes import FloatArray
from clearway.scenarios import motions
from clearway.scenarios.motions import MotionSpec
from clearway.scenarios.scenario import LONGEST_SWING, LegSpec, ObstacleSpec, OscillationSpec, RunSpec

KNOT = 0.015
"""Time between the knots of an oscillation, s: a tenth of paper B's sampling time. A line between two of them is off by
at most (acceleration) x KNOT^2 / 8, 0.03 mm at 1 m/s^2."""
_NONE: FloatArray = np.zeros((0, 4))
ROOM = 256
"""Knots for which there is room in the track of a body that decides, see `laid`."""
ROBOTS_ROOM = 4096
"""The same of a robot: half of them are enough for the longest control period, 10 s, and for what is looked at 2 s late, at `laid.APART`."""


class Tracks(NamedTuple):
    """The tracks of m bodies in l legs.

    Attributes:
        knots: (k, 4) s since the leg began, x, y [m], theta [rad], all tracks one after another.
        rows: (l, m, 2) int64; the knots of body j in leg i are knots[rows[i, j, 0]:rows[i, j, 1]]; none: absent.
        speed: (m,) m/s, the most that each ever does; inf for one that jumps.
        lasting: (m,) whether a body's time runs on from leg to leg, its knots counted from the start of the trial.
    """

    knots: FloatArray
    rows: npt.NDArray[np.int64]
    speed: FloatArray
    lasting: npt.NDArray[np.bool_]


def tracks(
    obstacles: Sequence[ObstacleSpec], legs: Sequence[str], duration: float = 0.0, deciders: int = 0, robots: int = 0
) -> Tracks:
    """The tracks of the moving ones among `obstacles` in the legs with these names.

    Args:
        duration: How long the trial may take, s; that far an oscillation is laid out.
        deciders: So many bodies more, after the obstacles, decide.
        robots: So many robots come after these.

    Raises:
        ClearwayError: a run is for a leg that doesn't exist, two runs of an obstacle overlap in time, or something
            oscillates (or the like) in a trial that may take longer than an hour.
    """
    for obstacle in obstacles:
        for run in obstacle.runs:
            if run.leg not in legs:
                problem = f"{run.leg!r} is not a leg of this scenario; legs: {', '.join(legs)}"
                raise ClearwayError(problem, field=f"obstacles.{obstacle.name}.runs.leg")
        if obstacle.lasting is not None and duration > 2.0 * LONGEST_SWING + 1.0:  # see `longest`
            problem = (
                f"the legs may take {duration:g} s together; with something that oscillates, at most {LONGEST_SWING:g}"
            )
            raise ClearwayError(problem, field="legs.time_limit")
    parts = [
        [_NONE if o.lasting or o.behaviour else _knots(o, [r for r in o.runs if r.leg == leg]) for o in obstacles]
        for leg in legs
    ]
    for j, obstacle in enumerate(obstacles):
        if obstacle.lasting is not None:
            parts[0][j] = swing(obstacle.lasting, duration)
        elif obstacle.behaviour is not None:
            parts[0][j] = np.full((ROOM, 4), np.nan)
    for k, part in enumerate(parts):
        rooms = [ROOM] * deciders + [ROBOTS_ROOM] * robots
        part += [np.full((room, 4), np.nan) if k == 0 else _NONE for room in rooms]
    more = deciders + robots
    decides = [*(o.behaviour is not None for o in obstacles), *(True for _ in range(more))]
    lasts = [*(o.lasting is not None for o in obstacles), *(False for _ in range(more))]
    found = stack(parts, [a or b for a, b in zip(decides, lasts, strict=True)])
    found.rows[:, decides, 1] = found.rows[:, decides, 0]  # nothing is laid yet
    return found


def longest(legs: Sequence[LegSpec]) -> float:
    """How long a trial of these legs may take, s: a leg whose clock starts late may take its limit twice."""
    return sum(leg.time_limit * (2.0 if leg.clock_starts_after > 0.0 else 1.0) for leg in legs) + 1.0


def stack(parts: Sequence[Sequence[FloatArray]], lasting: Sequence[bool] | None = None) -> Tracks:
    """Tracks from `parts`: by leg, by body, (k, 4) knots with times that don't fall.

    Args:
        lasting: See `Tracks`; of such a body only the knots of the first leg count. Default: none is.
    """
    flat = [p for leg in parts for p in leg]
    ends = np.cumsum([len(p) for p in flat], dtype=np.int64)
    rows = (
        np.stack([ends - [len(p) for p in flat], ends], axis=1).astype(np.int64) if flat else np.zeros((0, 2), np.int64)
    )
    bodies = len(parts[0]) if parts else 0
    speed = np.array([max((_top_speed(leg[j]) for leg in parts), default=0.0) for j in range(bodies)], dtype=np.float64)
    rows, lasts = rows.reshape(len(parts), bodies, 2), np.array(lasting or [False] * bodies, dtype=np.bool_)
    rows[:, lasts] = rows[:1, lasts]
    return Tracks(np.ascontiguousarray(np.concatenate([np.zeros((0, 4)), *flat])), rows, speed, lasts)


def swing(motion: OscillationSpec | MotionSpec, duration: float) -> FloatArray:
    """Knots (k, 4) of an oscillation or another motion for `duration` [s] and a little more; the body doesn't turn."""
    if not isinstance(motion, OscillationSpec):
        way = motions.knots(motion, duration)
        return np.column_stack([way, np.where(np.isnan(way[:, 1]), np.nan, 0.0)])
    start, velocity, attraction, stiffness = (
        np.array(v, dtype=np.float64) for v in (motion.start, motion.velocity, motion.attraction, motion.stiffness)
    )
    count = math.ceil(duration / KNOT) + 1
    states = trajectory(start, velocity, attraction, stiffness, KNOT, count)
    return np.column_stack([KNOT * np.arange(count + 1), states[:, :2], np.zeros(count + 1)])


def line(run: RunSpec) -> FloatArray:
    """Knots (k, 4) of one pass along `run.path`."""
    path = np.array(run.path, dtype=np.float64)
    steps = np.diff(path, axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    keep = length > 0.0
    steps, length, start, end = steps[keep], length[keep], path[:-1][keep], path[1:][keep]
    if len(length) == 0:
        raise ClearwayError(f"the path {list(run.path)} has no length", field="runs.path")
    times = run.delay + np.concatenate([[0.0], np.cumsum(length)]) / run.speed
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    begin = np.column_stack([times[:-1], start, heading])
    finish = np.column_stack([times[1:], end, heading])
    return np.ascontiguousarray(np.stack([begin, finish], axis=1).reshape(-1, 4))


def _knots(obstacle: ObstacleSpec, runs: Iterable[RunSpec]) -> FloatArray:
    parts = sorted((line(r) for r in runs), key=lambda p: float(p[0, 0]))
    joined = [np.zeros((0, 4))]
    for i, part in enumerate(parts):
        if i and part[0, 0] < parts[i - 1][-1, 0]:
            raise ClearwayError("two runs overlap in time", field=f"obstacles.{obstacle.name}.runs")
        if i:
            joined.append(np.array([[parts[i - 1][-1, 0], np.nan, np.nan, np.nan]]))
        joined.append(part)
    return np.concatenate(joined)


def _top_speed(knots: FloatArray) -> float:
    if len(knots) < 2:
        return 0.0
    step = np.diff(knots, axis=0)
    way = np.hypot(step[:, 1], step[:, 2])
    if np.isnan(way).any() or (way[step[:, 0] <= 0.0] > 0.0).any():
        return math.inf  # it comes back somewhere else
    moving = step[:, 0] > 0.0
    return float((way[moving] / step[moving, 0]).max(initial=0.0))


@light
def knot_at(knots: FloatArray, begin: int, end: int, t: float) -> int:
    """The last of the knots [begin:end] that is not after time `t` [s since the leg began]; begin - 1 if all of them are."""
    low, high = begin - 1, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if knots[middle, 0] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@light
def pose_at(knots: FloatArray, begin: int, end: int, t: float, out: FloatArray) -> bool:
    """Write the pose at time `t` [s since the leg began] of the track knots[begin:end] to `out` (3,), NaN if absent.

    Returns:
        Whether the body is present.
    """
    out[:] = math.nan
    if end - begin < 1 or t < knots[begin, 0] or t > knots[end - 1, 0]:
        return False
    low = knot_at(knots, begin, end, t)
    if low == end - 1:
        out[0], out[1], out[2] = knots[low, 1], knots[low, 2], knots[low, 3]
    else:
        on_line(knots, low, t, out)
    return math.isfinite(out[0])


@light
def place(tracks: Tracks, leg: int, since: FloatArray, t: float, out: FloatArray) -> None:
    """Write the poses of all bodies at time `t` [s] of leg number `leg` to `out` (m, 3), NaN where one is absent.

    Args:
        since: (m,) when the clock of each began, s.
    """
    for m in range(len(since)):
        pose_at(tracks.knots, tracks.rows[leg, m, 0], tracks.rows[leg, m, 1], t - since[m], out[m])


@light
def place_twice(tracks: Tracks, leg: int, since: FloatArray, t: float, other: float, out: FloatArray) -> None:
    """The same for times `t` and `other` [s], to `out` (2, m, 3)."""
    place(tracks, leg, since, t, out[0])
    place(tracks, leg, since, other, out[1])


@light
def on_line(knots: FloatArray, low: int, t: float, out: FloatArray) -> None:
    """Write the pose at time `t` [s] on the line from knot `low` to the next one to `out` (3,); at its end too."""
    s = (t - knots[low, 0]) / (knots[low + 1, 0] - knots[low, 0])
    out[0] = knots[low, 1] + s * (knots[low + 1, 1] - knots[low, 1])
    out[1] = knots[low, 2] + s * (knots[low + 1, 2] - knots[low, 2])
    out[2] = wrap(knots[low, 3] + s * wrap(knots[low + 1, 3] - knots[low, 3]))

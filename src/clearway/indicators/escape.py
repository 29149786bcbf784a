"""Whether a robot could still have got away: a search over its manoeuvres among obstacles whose future is known.

An escape is a manoeuvre of the base (its speeds, backwards where it can, its accelerations), undisturbed, that touches
nothing up to a given time. Bodies move as they did, and after the end of the record as `prolonged` says. It is looked
for in three steps, the dearer ones only if there is no answer yet:

1. a narrow beam search: from the robot's true state on, each `STEP` every kept state is carried on by every pair of
   target speeds, looked at each `STEP / _LOOKS`; of what touches nothing, one state a cell is kept, and of these so many;
2. backwards in time, from where a disc no larger than the robot that drives in any direction at its top speed could
   still get away (`_viability`): where even that can't, there is none;
3. a wide beam search among the places that are left, half of its states being those deepest inside of them, half spread
   evenly over all.

So "there was one" is proved by the manoeuvre that was found (between two looks no disc of 0.6 m is grazed by more than
1 cm); "there was none" is as sure as the search is wide, which tests hold against random driving and wider searches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, FloatArray, circumscribed_radius, inscribed_radius
from clearway.indicators.legs import stretches
from clearway.robots.drive_limits import DriveLimits, immediate
from clearway.trials import Body, Trial

STEP = 0.15
"""s between two decisions of the search."""
_LOOKS = 3
SEARCHES = ((3, 3, 48), (5, 7, 400))
"""Forward speeds, yaw rates and states kept of each search."""
_CELL, _HEADING, _COARSE = 0.04, 0.25, 0.25
"""m and rad: states nearer than this to each other count as one; m of a cell in which berths are compared."""
_GRID = 40
"""Cells from the middle to the edge of the viability's grid, at most; no cell is smaller than `_CELL`."""
_FIT, _FITS = 3.0, 1e-3
"""s of a moving obstacle's last motion that its prolongation is fitted to, and how well it has to fit, m."""


def escapes(trial: Trial, begin: float, until: float) -> bool | None:
    """Whether the robot, as it was at `begin` [s], could have gone on to `until` [s] without touching anything.

    None where nobody knows: the trial lacks footprint, limits, speed, a pose, or a body's outline, or the base is of another
    kind than those whose manoeuvres are searched, `differential`.
    """
    a = trial.attempt
    if a.footprint is None or a.limits is None or trial.velocity is None or len(trial.t) < 2:
        return None
    if a.limits.kind != "differential":
        return None
    state = state_at(trial, begin)
    if not np.isfinite(state).all() or not all(b.outlined for b in a.bodies):
        return None
    steps = max(math.ceil((until - begin) / STEP - 1e-9), 1)
    times: FloatArray = begin + STEP / _LOOKS * np.arange(1.0, steps * _LOOKS + 1)
    bodies, tracks = _near(trial, state, times)
    narrow, *wider = SEARCHES
    if _found(trial, state, bodies, tracks, None, *narrow):
        return True
    viable = _viability(trial, state, bodies, tracks)
    return bool(viable.depth[0].max() > 0.0) and any(
        _found(trial, state, bodies, tracks, viable, *search) for search in wider
    )


@dataclass(frozen=True, slots=True, eq=False)
class Viability:
    """Where one who drives in any direction could still get away, on a grid around the robot.

    Attributes:
        corner: (2,) m, of the grid.
        cell: m.
        depth: (n + 1, k, k) m after each step, by x and y: how far the nearest place is from which one cannot; 0 there.
    """

    corner: FloatArray
    cell: float
    depth: FloatArray

    def at(self, states: FloatArray, step: int) -> FloatArray:
        """(n,) depth at `states` (n, 5) after `step` steps."""
        i, j = np.floor((states[:, :2] - self.corner) / self.cell).astype(np.int64).T
        most = self.depth.shape[1] - 1
        return np.asarray(self.depth[step, np.clip(i, 0, most), np.clip(j, 0, most)])


def _viability(trial: Trial, state: FloatArray, bodies: Sequence[Body], tracks: FloatArray) -> Viability:
    """From the last of the `tracks` (n, k, 3) back to the robot at `state` (5,)."""
    a = trial.attempt
    assert a.footprint is not None
    assert a.limits is not None
    ahead, steps = a.limits.fastest * STEP, len(tracks) // _LOOKS
    cell = max(_CELL, ahead * steps / _GRID)
    half = math.ceil(ahead * steps / cell) + 2
    centres = cell * np.arange(-half, half + 1)
    cells = np.stack(np.meshgrid(centres + state[0], centres + state[1], indexing="ij"), axis=-1).reshape(-1, 2)
    poses = np.column_stack([cells, np.zeros(len(cells))])
    disc, size = Circle(inscribed_radius(a.footprint)), 2 * half + 1
    still, moving = [b for b in bodies if b.pose is not None], [b for b in bodies if b.pose is None]
    away = min_clearance(disc, poses, still, np.empty((len(poses), 0, 3)))
    depth = np.zeros((steps + 1, size, size))
    reach = np.ones((size, size), dtype=np.bool_)  # from where what is left at the next step can be reached
    for k in range(steps, -1, -1):
        free = away
        if k:
            moving_obstacles = np.broadcast_to(tracks[k * _LOOKS - 1], (len(poses), *tracks.shape[1:]))
            free = np.minimum(away, min_clearance(disc, poses, moving, moving_obstacles))
        left = reach & (free.reshape(size, size) > -0.5 * cell)
        if not left.any():
            break
        depth[k] = (
            distance_transform_edt(np.pad(left, 1, constant_values=True))[1:-1, 1:-1] * cell
            if not left.all()
            else ahead
        )
        reach = distance_transform_edt(~left) * cell <= ahead + 0.7 * cell
    around = depth[0, half - 1 : half + 2, half - 1 : half + 2].copy()
    depth[0] = 0.0
    depth[0, half - 1 : half + 2, half - 1 : half + 2] = around
    return Viability(state[:2] - (half + 0.5) * cell, cell, depth)


def _found(
    trial: Trial,
    state: FloatArray,
    bodies: Sequence[Body],
    tracks: FloatArray,
    viable: Viability | None,
    speeds: int,
    turns: int,
    width: int,
) -> bool:
    """Whether a beam search from `state` (5,) reaches the end of the `tracks` (n, k, 3) of the moving `bodies`."""
    a = trial.attempt
    assert a.footprint is not None
    assert a.limits is not None
    targets = commands(a.limits, speeds, turns)
    kept = state[None]
    for k in range(0, len(tracks), _LOOKS):
        kept, ways = _carried(kept, targets, a.limits)
        at = np.repeat(tracks[k : k + _LOOKS], len(kept), axis=0)
        gaps = min_clearance(a.footprint, ways.reshape(-1, 3), bodies, at).reshape(_LOOKS, -1).min(axis=0)
        clear, worth = gaps > 0.0, gaps
        if viable is not None:
            worth = viable.at(kept, k // _LOOKS + 1)
            clear &= worth > 0.0
        if not clear.any():
            return False
        kept = _thinned(kept[clear], worth[clear], width, moving=not immediate(a.limits))
    return True


def prolonged(trial: Trial, times: FloatArray) -> FloatArray:
    """(n, m, 3) poses of the moving obstacles at `times` (n,), NaN while absent; headings as they were last.

    Between samples by cubic splines. After the record each coordinate goes on by the linear recurrence
    x[k+1] = a x[k] + b x[k-1] + c that its last 3 s fit: rest, constant speed and acceleration and (damped) oscillation
    go on exactly; where no stable recurrence fits to 1 mm, or less than five samples are known, at the last velocity. What was
    carried is absent meanwhile, and where it was before tells nothing of where it goes on.
    """
    period = float(trial.t[1] - trial.t[0]) if len(trial.t) > 1 else trial.attempt.period
    out = np.full((len(times), trial.moving_obstacles.shape[1], 3), np.nan)
    for m in range(trial.moving_obstacles.shape[1]):
        for part in stretches(trial, m):
            t = trial.t[part]
            here = ((times >= t[0]) | (part.start == 0)) & ((times <= t[-1]) | (part.stop == len(trial.t)))
            out[here, m] = _stretched(t, trial.moving_obstacles[part, m], period, times[here])
    return out


def _stretched(t: FloatArray, poses: FloatArray, period: float, times: FloatArray) -> FloatArray:
    """(n, 3) the same at `times` (n,) of one that was at `poses` (k, 3) at `t` (k,) [s]."""
    from scipy.interpolate import CubicSpline  # here: it takes long to load, and only moving obstacles need it

    out = np.empty((len(times), 3))
    if not len(times):
        return out
    early = len(t) > 2 and t[-1] - t[-2] < period * (1 - 1e-6)  # contact ends a period early
    known = t[: len(t) - early]
    more = max(math.ceil((float(times[-1]) - float(known[-1])) / period) + 1, 0)
    knots = np.concatenate([known, known[-1] + period * np.arange(1, more + 1)])
    for axis in (0, 1):
        values = _continued(poses[: len(known), axis], more, max(round(_FIT / period), 5))
        if np.isfinite(values).all() and len(knots) > 3:
            out[:, axis] = CubicSpline(knots, values)(times)
        else:
            out[:, axis] = np.interp(times, knots, values)
    out[:, 2] = poses[np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1), 2]
    return out


def _continued(x: FloatArray, more: int, most: int) -> FloatArray:
    """`x` (n,) with `more` samples behind it."""
    finite = np.isfinite(x[::-1])
    tail = x[len(x) - (len(x) if finite.all() else int(np.argmin(finite))) :][-most:]
    if not len(tail):
        return np.concatenate([x, np.full(more, np.nan)])
    a, b, c = _recurrence(tail - tail[-1])
    ahead = [float(tail[-2] - tail[-1]) if len(tail) > 1 else 0.0, 0.0]
    for _ in range(more):
        ahead.append(a * ahead[-1] + b * ahead[-2] + c)
    return np.concatenate([x, tail[-1] + np.array(ahead[2:])])


def _recurrence(x: FloatArray) -> tuple[float, float, float]:
    """a, b, c of x[k+1] = a x[k] + b x[k-1] + c."""
    if len(x) >= 5:
        known = np.column_stack([x[1:-1], x[:-2], np.ones(len(x) - 2)])
        found = np.linalg.lstsq(known, x[2:], rcond=1e-9)[0]
        fits = float(np.abs(known @ found - x[2:]).max()) <= _FITS
        if fits and float(np.abs(np.roots([1.0, -found[0], -found[1]])).max(initial=0.0)) <= 1.0 + 1e-3:
            a, b, c = found.tolist()
            return a, b, c
    return 2.0, -1.0, 0.0


def state_at(trial: Trial, at: float) -> FloatArray:
    """(5,) x, y, theta, v, omega at `at` [s]; the speeds are those of the sample before."""
    assert trial.velocity is not None
    pose = np.column_stack([trial.pose[:, :2], np.unwrap(trial.pose[:, 2])])
    i = int(np.clip(np.searchsorted(trial.t, at + 1e-9, side="right") - 1, 0, len(trial.t) - 1))
    return np.array([*(np.interp(at, trial.t, column) for column in pose.T), *trial.velocity[i]])


def _near(trial: Trial, state: FloatArray, times: FloatArray) -> tuple[list[Body], FloatArray]:
    """The bodies that the robot could meet by the last of `times` (n,), and the poses (n, k, 3) of those that move."""
    a = trial.attempt
    assert a.footprint is not None
    assert a.limits is not None
    fastest = a.limits.fastest
    own, still = circumscribed_radius(a.footprint), [b for b in a.bodies if b.pose is not None]
    reach = own + fastest * (float(times[-1]) - float(times[0]) + STEP)
    close = [b for b in still if min_clearance(a.footprint, state[None, :3], [b], np.empty((1, 0, 3)))[0] <= reach]
    moving, tracks = [b for b in a.bodies if b.pose is None], prolonged(trial, times)
    spread = own + fastest * (times - times[0] + STEP)
    away = np.hypot(tracks[:, :, 0] - state[0], tracks[:, :, 1] - state[1]) - spread[:, None]
    met = [k for k, b in enumerate(moving) if (away[:, k] <= circumscribed_radius(b.shape)).any()]
    return [*close, *(moving[k] for k in met)], np.ascontiguousarray(tracks[:, met])


def commands(limits: DriveLimits, speeds: int, turns: int) -> FloatArray:
    """(k, 2) target speeds: all pairs of forward speeds (rest among them) and yaw rates."""
    forward = np.unique(np.append(np.linspace(limits.v_min, limits.v_max, speeds), 0.0))
    return np.array([(v, w) for v in forward for w in np.linspace(-limits.omega_max, limits.omega_max, turns)])


def _carried(states: FloatArray, commands: FloatArray, limits: DriveLimits) -> tuple[FloatArray, FloatArray]:
    """Each of `states` (n, 5) under each of `commands` (k, 2): the states (n k, 5) a step later, and the poses on the
    way (`_LOOKS`, n k, 3)."""
    goal = np.tile(commands, (len(states), 1))
    states, ways = np.repeat(states, len(commands), axis=0), np.empty((_LOOKS, len(goal), 3))
    for k in range(_LOOKS):
        states = stepped(states, goal, limits, STEP / _LOOKS)
        ways[k] = states[:, :3]
    return states, ways


def stepped(states: FloatArray, goal: FloatArray, limits: DriveLimits, h: float) -> FloatArray:
    """`states` (n, 5) `h` seconds later, each on its way to the speeds `goal` (n, 2) within `limits`."""
    x, y, theta, before, turned = states.T
    v = _ramp(before, goal[:, 0], limits.acceleration * h, limits.deceleration * h)
    w = _ramp(turned, goal[:, 1], limits.angular_acceleration * h, limits.angular_deceleration * h)
    mean_v = 0.5 * (before + v) if np.isfinite(limits.acceleration) else v
    mean_w = 0.5 * (turned + w) if np.isfinite(limits.angular_acceleration) else w
    half = 0.5 * h * mean_w
    chord = h * mean_v * np.sinc(half / np.pi)
    return np.column_stack(
        [x + chord * np.cos(theta + half), y + chord * np.sin(theta + half), theta + 2.0 * half, v, w]
    )


def _ramp(now: FloatArray, goal: FloatArray, faster: float, slower: float) -> FloatArray:
    """Speeds (n,) after they went from `now` towards `goal`, growing by `faster` or declining by `slower` at most; to
    change its sign one comes to zero first."""
    goal = np.where((now * goal < 0.0) & (np.abs(now) > slower), 0.0, goal)
    most = np.where(np.abs(goal) > np.abs(now), faster, slower)
    return np.asarray(now + np.clip(goal - now, -most, most))


def _thinned(states: FloatArray, worth: FloatArray, width: int, *, moving: bool) -> FloatArray:
    """One of `states` (n, 5) a cell, that of most `worth` (n,); at most `width` of them."""
    order = np.argsort(-worth, kind="stable")
    states = states[order]
    cells = np.column_stack([np.floor(states[:, :2] / _CELL), np.floor(states[:, 2] / _HEADING)])
    if moving:  # what it can do next depends on how fast it is
        cells = np.column_stack([cells, np.floor(states[:, 3:] / 0.2)])
    states = states[np.sort(_firsts(cells))]
    if len(states) <= width:
        return states
    wide = np.sort(
        _firsts(np.column_stack([np.floor(states[:, :2] / _COARSE), np.floor(states[:, 2] / (4 * _HEADING))]))
    )
    wide = wide[: width // 2]
    rest = np.setdiff1d(np.arange(len(states)), wide)
    rest = rest[np.lexsort(states[rest].T[:3])]
    even = rest[np.linspace(0, len(rest) - 1, width - len(wide)).round().astype(np.int64)]
    return np.asarray(states[np.concatenate([wide, even])])


def _firsts(cells: FloatArray) -> np.ndarray:
    """The number of the first row of each cell."""
    whole = cells.astype(np.int64)
    low = whole.min(axis=0)
    size = whole.max(axis=0) - low + 1
    key = np.zeros(len(whole), dtype=np.int64)
    for column in range(whole.shape[1]):
        key = key * size[column] + (whole[:, column] - low[column])
    return np.asarray(np.unique(key, return_index=True)[1])

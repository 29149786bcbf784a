"""Obstacles as perceived in, forecast out: the door of this room."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway import contract
from clearway.contract import Obstacles
from clearway.errors import ClearwayError
from clearway.forecasts.bounds import BENT, TOO_FAST, words
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.models import models
from clearway.forecasts.parameters import ForecastParameters
from clearway.forecasts.tracks import MOVED, SEEN, SWAPPED, Limits, foresee, keep, match, move_on, room, take_in
from clearway.geometry.shapes import FloatArray

_ROOM = 32
_EXACT = 1e-3
"""m, the deviation that a perfect forecast admits: truth is interpolated."""


class Forecaster:
    """Tracks what is perceived and says where it will be.

    What is not finite in place, radius or error is left out. An obstacle that is perceived as standing is told in
    `still` and not tracked, unless it was seen moving; then its track goes on, for when it moves again.

    Args:
        parameters: see there. period: control period, s; what comes sooner or later is taken as it comes. step: s
            between a forecast's instants. count: K, of steps.

    Raises:
        ClearwayError: period or step is not above 0, or count is negative.
    """

    def __init__(self, parameters: ForecastParameters, period: float, step: float, count: int) -> None:
        _check(step, count)
        if not (math.isfinite(period) and period > 0.0):
            raise ClearwayError(f"{period!r} is no control period; it must be above 0 s", field="period")
        p = self._p = parameters
        self._step, self._count = float(step), int(count)
        self._models = models(p, self._step, self._count)
        self._limits = Limits(
            p.speed, p.acceleration, p.usual_speed, p.switching, p.refuted, p.surprise, p.agree, p.least, p.patience
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._t, self._n, self._fresh = math.nan, 0, -1
        self._tracks = room(self._models, _ROOM)

    def update(self, t: float, obstacles: Obstacles) -> tuple[Forecast, tuple[str, ...]]:
        """What is perceived at `t` [s]: the forecast from there, and the violated assumptions, in words.

        A time that stands still adds nothing; one that goes back begins all tracks anew.

        Raises:
            ClearwayError: `t` is not finite.
        """
        if not math.isfinite(t):
            raise ClearwayError(f"{t!r} is no time to forecast from", field="t")
        told: list[str] = []
        dt = t - self._t
        if dt < 0.0:
            told.append(f"time went back by {-dt:g} s: all obstacles are tracked anew")
            self.reset()
        self._t = t
        seen = _finite(obstacles)
        self._drop(t)
        if dt > 0.0 and self._n:
            move_on(self._tracks, self._n, self._models, self._limits, dt)
        self._take(t, seen, told)
        return self._forecast(t, seen), tuple(told)

    def _drop(self, t: float) -> None:
        """Forget tracks that were not perceived, or not perceived as moving, for too long."""
        stale = t - self._tracks.clock[: self._n, SEEN : MOVED + 1].min(axis=1) > self._p.memory + 1e-9
        if stale.any():
            rows = np.flatnonzero(~stale)
            self._tracks, self._n = keep(self._tracks, rows, len(self._tracks.label)), len(rows)

    def _take(self, t: float, seen: Obstacles, told: list[str]) -> None:
        tracks, n, m = self._tracks, self._n, len(seen)
        if not m:
            return
        since = t - tracks.clock[:n, SEEN]
        row, what, amount = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64), np.empty(m)
        place = np.ascontiguousarray(seen.position, dtype=np.float64)
        error = np.ascontiguousarray(seen.error, dtype=np.float64)
        label = np.ascontiguousarray(seen.identity, dtype=np.int64)
        match(tracks, n, self._p.speed, place, error, label, since, row, what, amount)
        begun = np.flatnonzero((row < 0) & seen.moving)
        row[begun] = np.arange(n, n + len(begun))
        if n + len(begun) > len(tracks.label):
            tracks = self._tracks = keep(tracks, np.arange(n), 2 * (n + len(begun)))
        if len(begun):
            self._name(tracks.identity, n, label[begun])
        self._n = n + len(begun)

        used = np.flatnonzero(row >= 0)  # those that stand and have never moved have none
        row, what, amount = row[used], what[used], amount[used]
        place, error, label = place[used], error[used], label[used]
        known = np.minimum(0.5 * seen.velocity_error[used], self._p.usual_speed)  # a bound is about two sigma
        velocity = np.ascontiguousarray(seen.velocity[used], dtype=np.float64)
        blind = ~(np.isfinite(velocity).all(axis=1) & (known < self._p.usual_speed))
        velocity[blind], known[blind] = 0.0, self._p.usual_speed
        apart = np.zeros(len(tracks.label))
        apart[:n] = since
        take_in(
            tracks, self._models, self._limits, t, apart, place, error, velocity, np.maximum(known, 0.05), row, what
        )
        for k in np.flatnonzero((what == TOO_FAST) | (what == BENT)).tolist():
            i, p = int(row[k]), self._p
            name, since_i = int(tracks.identity[i]), float(apart[i])
            told.append(words(int(what[k]), name, float(amount[k]), since_i, p.speed, p.acceleration))
        told += [
            f"obstacle {tracks.identity[row[k]]}: perceived under the identity {label[k]}"
            for k in np.flatnonzero((what == SWAPPED) & (tracks.label[row] != label)).tolist()
        ]
        tracks.label[row] = label
        tracks.size[row, 0], tracks.size[row, 1] = seen.radius[used], error
        tracks.clock[row, SEEN] = t
        moves = row[seen.moving[used]]
        tracks.clock[moves, MOVED] = t

    def _name(self, identity: npt.NDArray[np.int64], n: int, labels: npt.NDArray[np.int64]) -> None:
        """Our identity of new tracks: perception's, unless another track has that."""
        taken = set(identity[:n].tolist())
        for k, label in enumerate(labels.tolist()):
            if label in taken:
                while self._fresh in taken:
                    self._fresh -= 1
                label = self._fresh
            taken.add(label)
            identity[n + k] = label

    def _forecast(self, t: float, seen: Obstacles) -> Forecast:
        tracks, k, h = self._tracks, self._count, self._p.hypotheses
        clock = tracks.clock[: self._n]
        rows = np.flatnonzero(clock[:, MOVED] == clock[:, SEEN])
        n = len(rows)
        path, sigma, weight = np.empty((n, h, k + 1, 2)), np.empty((n, h, k + 1)), np.empty((n, h))
        centre, reach, speed = np.empty((n, k + 1, 2)), np.empty((n, k + 1)), np.empty(n)
        if n:
            foresee(
                tracks, rows, self._models, self._limits, self._step, path, sigma, weight, centre, reach, speed
            )  # fmt: skip
        return Forecast(
            self._step, _still(seen), path, sigma, weight, tracks.size[rows, 0], centre, reach, speed,
            tracks.identity[rows], t - clock[rows, SEEN],
        )  # fmt: skip


class PerfectForecaster:
    """The true future of what has been perceived so far: a reference, for privileged navigators.

    Args:
        parameters: see there. truth: time [s] -> (n, 4) x, y, radius, presence. step: s. count: K, of steps.

    Raises:
        ClearwayError: step is not above 0, or count is negative.
    """

    def __init__(self, parameters: ForecastParameters, truth: contract.Forecast, step: float, count: int) -> None:
        _check(step, count)
        self._p, self._truth, self._step, self._count = parameters, truth, float(step), int(count)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._rows: dict[int, int] = {}

    def update(self, t: float, obstacles: Obstacles) -> tuple[Forecast, tuple[str, ...]]:
        """As `Forecaster.update`; nothing is ever violated. What has been perceived is remembered for ever.

        Raises:
            ClearwayError: `t` is not finite.
        """
        if not math.isfinite(t):
            raise ClearwayError(f"{t!r} is no time to forecast from", field="t")
        seen, now = _finite(obstacles), self._truth(t)
        there = now[:, 3] > 0.0
        for j in np.flatnonzero(seen.moving).tolist():
            off = np.where(there, np.hypot(now[:, 0] - seen.position[j, 0], now[:, 1] - seen.position[j, 1]), np.inf)
            if len(off) and np.isfinite(off.min()):
                self._rows.setdefault(int(off.argmin()), int(seen.identity[j]))
        rows = np.array([r for r in self._rows if there[r]], dtype=np.int64)
        n, k, h = len(rows), self._count, self._p.hypotheses
        future = np.stack([self._truth(t + j * self._step)[rows] for j in range(k + 1)], axis=1) if n else np.zeros(
            (0, k + 1, 4)
        )  # fmt: skip
        for j in range(1, k + 1):  # where one vanishes it is held
            gone = ~(future[:, j, 3] > 0.0)
            future[gone, j, :2] = future[gone, j - 1, :2]
        centre = np.ascontiguousarray(future[:, :, :2])
        way = np.hypot(*np.moveaxis(np.diff(centre, axis=1), 2, 0)) if k else np.zeros((n, 0))
        weight = np.zeros((n, h))
        weight[:, 0] = 1.0
        return Forecast(
            self._step, _still(seen), np.repeat(centre[:, None], h, axis=1), np.full((n, h, k + 1), _EXACT), weight,
            np.ascontiguousarray(now[rows, 2]), centre, np.full((n, k + 1), _EXACT), way.max(axis=1, initial=0.0) / self._step,
            np.array([self._rows[r] for r in rows.tolist()], dtype=np.int64), np.zeros(n),
        ), ()  # fmt: skip


def _check(step: float, count: int) -> None:
    if not (math.isfinite(step) and step > 0.0):
        raise ClearwayError(f"{step!r} is no step of a forecast; it must be above 0 s", field="step")
    if count < 0:
        raise ClearwayError(f"{count!r} is no number of steps; it must not be negative", field="count")


def _finite(o: Obstacles) -> Obstacles:
    """Those whose place, radius and error are finite (and not negative)."""
    good = np.isfinite(o.position).all(axis=1) & np.isfinite(o.radius) & (o.error >= 0.0) & np.isfinite(o.error)
    if good.all():
        return o
    return Obstacles(
        o.position[good], o.velocity[good], o.radius[good], o.error[good], o.velocity_error[good], o.identity[good],
        o.moving[good],
    )  # fmt: skip


def _still(seen: Obstacles) -> FloatArray:
    fixed = ~seen.moving
    return np.column_stack([seen.position[fixed], seen.radius[fixed] + seen.error[fixed]])

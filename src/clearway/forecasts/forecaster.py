"""Obstacles as perceived in, forecast out: the door of this room."""

from __future__ import annotations

import math

import numpy as np

from clearway import contract
from clearway.contract import Obstacles
from clearway.errors import ClearwayError
from clearway.forecasts.avoidance.rules import Avoidance
from clearway.forecasts.bounds import HELD, words
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.models import models
from clearway.forecasts.parameters import ForecastParameters
from clearway.forecasts.tracking import NEW, SWAPPED, Matches, advance, foresee
from clearway.forecasts.tracks import MOVED, SEEN, Limits, Perceived, keep, room
from clearway.geometry.shapes import FloatArray

_ROOM = 32
_ROUNDING = 1e-9  # s
_EXACT = 1e-3
"""m, the deviation that a perfect forecast admits: truth is interpolated."""


class Forecaster:
    """Tracks what is perceived and says where it will be.

    What is not finite in place, radius or error is left out. An obstacle that is perceived as standing is told in
    `still` and not tracked, unless it was seen moving; then its track goes on, for when it moves again.

    Args:
        parameters: What is assumed and expected of obstacles.
        period: Control period, s; what comes sooner or later is taken as it comes.
        step: Time between a forecast's instants, s.
        count: Number of steps, K.

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
        self._avoidance = Avoidance(p.avoidance, p.least)
        self._limits = Limits(
            p.speed,
            p.acceleration,
            p.usual_speed,
            p.switching,
            p.refuted,
            p.surprise,
            p.agree,
            p.least,
            p.patience,
            p.velocities,
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._t, self._n = math.nan, 0
        self._avoidance.reset()
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
        self._make_room(t, len(seen))
        told += self._advance(t, dt, seen)
        found = self._forecast(t, seen)
        if self._n:
            self._avoidance.update(dt, found)
        return found, tuple(told)

    def _make_room(self, t: float, new: int) -> None:
        """Forget tracks that were not perceived, or not perceived as moving, for too long; have room for `new` ones."""
        rows, capacity = self._n, len(self._tracks.label)
        if rows:
            last = self._tracks.clock[:rows, SEEN : MOVED + 1]
            if t - last.min() > self._p.memory + _ROUNDING:
                fresh = np.flatnonzero(t - last.min(axis=1) <= self._p.memory + _ROUNDING)
                self._tracks, self._n = keep(self._tracks, fresh, capacity), len(fresh)
        if self._n + new > capacity:
            self._tracks = keep(self._tracks, np.arange(self._n), 2 * (self._n + new))

    def _advance(self, t: float, dt: float, seen: Obstacles) -> list[str]:
        m, p, tracks = len(seen), self._p, self._tracks
        row, what, amount = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64), np.empty(m)
        since = np.empty(len(tracks.label))
        perceived = Perceived(
            _floats(seen.position), _floats(seen.error), _floats(seen.velocity), _floats(seen.velocity_error),
            _floats(seen.radius), np.array(seen.identity, dtype=np.int64),
            np.array(seen.moving, dtype=np.bool_),
        )  # fmt: skip
        self._n = advance(
            tracks, self._n, self._models, self._limits, t, dt, perceived, since, Matches(row, what, amount)
        )
        told = []
        for j in np.flatnonzero((row >= 0) & (what != HELD) & (what != NEW)).tolist():
            i, kind = int(row[j]), int(what[j])
            name = int(tracks.identity[i])
            if kind == SWAPPED:
                told.append(f"obstacle {name}: perceived under the identity {int(seen.identity[j])}")
            else:
                told.append(words(kind, name, float(amount[j]), float(since[i]), p.speed, p.acceleration))
        return told

    def _forecast(self, t: float, seen: Obstacles) -> Forecast:
        n, k, h = self._n, self._count, self._p.hypotheses
        whole = Forecast(
            self._step, _still(seen), np.empty((n, h, k + 1, 2)), np.empty((n, h, k + 1)), np.empty((n, h)), np.empty(n),
            np.empty((n, k + 1, 2)), np.empty((n, k + 1)), np.empty(n), np.empty(n, dtype=np.int64), np.empty(n),
        )  # fmt: skip
        n = foresee(self._tracks, n, self._models, self._limits, t, whole)
        return whole._replace(**{name: getattr(whole, name)[:n] for name in Forecast._fields[2:]})


class PerfectForecaster:
    """The true future of what has been perceived so far: a reference, for privileged navigators.

    Args:
        parameters: What is assumed and expected of obstacles.
        truth: As `Task.obstacle_oracle`: time [s] -> (n, 4) x, y, radius, presence.
        step: Time between a forecast's instants, s.
        count: Number of steps, K.

    Raises:
        ClearwayError: step is not above 0, or count is negative.
    """

    def __init__(self, parameters: ForecastParameters, truth: contract.ObstacleOracle, step: float, count: int) -> None:
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
                row, name = int(off.argmin()), int(seen.identity[j])
                if row not in self._rows:
                    self._rows[row] = -1 - row if name in self._rows.values() else name
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


def _floats(a: FloatArray) -> FloatArray:
    return np.array(a, dtype=np.float64, order="C")  # those of an observation can't be written


def _finite(o: Obstacles) -> Obstacles:
    """Those whose place, radius and error are finite, and the error not negative."""
    with np.errstate(invalid="ignore"):  # inf - inf
        total = float(o.position.sum()) + float(o.radius.sum()) + float(o.error.sum())
    if math.isfinite(total) and o.error.min(initial=0.0) >= 0.0:
        return o  # nearly always
    good = np.isfinite(o.position).all(axis=1) & np.isfinite(o.radius) & (o.error >= 0.0) & np.isfinite(o.error)
    return Obstacles(
        o.position[good], o.velocity[good], o.radius[good], o.error[good], o.velocity_error[good], o.identity[good],
        o.moving[good],
    )  # fmt: skip


def _still(seen: Obstacles) -> FloatArray:
    fixed = ~seen.moving
    if not fixed.any():
        return np.empty((0, 3))
    return np.column_stack([seen.position[fixed], seen.radius[fixed] + seen.error[fixed]])

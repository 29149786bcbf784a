"""From commands and measured velocities to how a base answers: least squares over all readings at once.

How fast a base goes in the end is read off, not assumed: a command that was held for a while has a level of its own, as bases cut what
their wheels can't do. What is told of an answer is what it can foretell: it is fitted on each half of the recording and judged on the
other one, beside a base that would do at once what it is told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.identifying.response import Response, answer

KINDS = ("v", "omega")
"""The velocities, in the order in which they are commanded and measured."""
LATENCY, LAG, RATE = (-0.5, 2.0), (1e-4, 3.0), (0.05, 50.0)
"""What is looked for: s, s, m/s^2 or rad/s^2. A latency below 0 is that of clocks that differ."""
TRIED = ((0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6), (0.02, 0.1, 0.4), (0.5, 2.0, 10.0))
"""Latencies, lags and accelerations from the best of which the search begins."""
SHOWS = 0.02
"""Share of the error by which a lag has to better the fit; else it is none, as a short one and a latency look alike."""
HELD, LEVELS = 1.0, 24
"""s that a command is held in all, if what it comes to is to be a level of its own; at most so many have one."""
BLOCK, FEWEST = 4.0, 6
"""s of which a block is, and how many in which the base moves there must be."""
MOVES = 0.05
"""Of the fastest reading, below which a base stands."""
DRAWS = 100
"""Of blocks, for the intervals."""
AT_ONCE = Response(0.0, LAG[0], 1e6, 1e6)
"""A base that does what it is told."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its interval.

    Attributes:
        value: What fits best.
        low: Lower end of its 95 % interval, by drawing blocks of the recording again.
        high: Upper end of it.
    """

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3g} ({self.low:.3g} to {self.high:.3g})"


@dataclass(frozen=True, slots=True)
class Answered:
    """How one velocity of a base answers.

    Attributes:
        velocity: Which one: `v`, m/s, or `omega`, rad/s.
        readings: How many were used.
        acceleration: Bound of how fast it grows, m/s^2 or rad/s^2; None: none shows.
        deceleration: Bound of how fast it falls, m/s^2 or rad/s^2; None: none shows.
        reached: For each command that was held: its v [m/s] and omega [rad/s], and what this velocity came to.
        error: Root mean square of what it foretells less what was measured, on blocks on which it wasn't fitted, m/s or rad/s.
        error_at_once: The same of a base that goes at once as fast as it is to go in the end, which is read off all of the recording.
        error_of_robot: The same of a robot's file, with what each command comes to read off as well; None where none is given.
    """

    velocity: str
    readings: int
    acceleration: Estimate | None
    deceleration: Estimate | None
    reached: tuple[tuple[float, float, float], ...]
    error: float
    error_at_once: float
    error_of_robot: float | None


@dataclass(frozen=True, slots=True)
class Identified:
    """How a base answers its commands.

    Attributes:
        latency: From a command's stamp until the base's controller follows it, by the stamps of what is measured, s.
        lag: Time constant of its motors, s; None: none shows.
        answers: What holds of each velocity that was commanded.
        blocks: In how many blocks of the recording it moves.
    """

    latency: Estimate
    lag: Estimate | None
    answers: tuple[Answered, ...]
    blocks: int


def identify(
    when: FloatArray, commands: FloatArray, at: FloatArray, measured: FloatArray, robot: tuple[Response, ...] = ()
) -> Identified:
    """How a base answers.

    Args:
        when: (k,) times of its commands, s, increasing.
        commands: (k, m) v [m/s], and omega [rad/s] where m is 2.
        at: (n,) times of its measured velocities, s, increasing.
        measured: (n, m) the same velocities; NaN where one wasn't measured.
        robot: (m) how a robot's file says that they answer, to be judged beside; empty: none is given.

    Raises:
        ClearwayError: It moves too little.
    """
    there = at >= when[0] if len(when) else np.zeros(len(at), dtype=bool)
    if not there.any():
        raise ClearwayError("nothing is measured after a first command", field="command")
    axes = [_Axis.of(when, commands, at[there], measured[there, k], k) for k in range(commands.shape[1])]
    axes = [axis for axis in axes if axis.moving.any()]
    fit = _Fit(axes, np.floor((at[there] - when[0]) / BLOCK).astype(np.int64))
    if len(fit.blocks) < FEWEST:
        raise ClearwayError(
            f"by its commands the base moves in {len(fit.blocks)} stretches of {BLOCK:g} s; {FEWEST} are needed: drive ahead, stop, turn,"
            " stop, for a minute or two",
            field="command",
        )
    rng, n = np.random.default_rng(0), len(fit.blocks)
    half = rng.permutation(n) % 2
    every = np.ones(n, dtype=np.bool_)
    whole, without = (fit.search(np.ones(n), lags) for lags in (True, False))
    lags = fit.error([(whole, every)]) < (1.0 - SHOWS) * fit.error([(without, every)])
    whole = whole if lags else without
    halves = [(fit.search((half == k).astype(float), lags), half != k) for k in (0, 1)]
    draws = np.array(
        [fit.again(whole, rng.multinomial(n, np.full(n, 1 / n)).astype(float), lags) for _ in range(DRAWS)]
    )
    ends = np.quantile(fit.values(draws), (0.025, 0.975), axis=0)
    found = [Estimate(float(x), float(a), float(b)) for x, a, b in zip(fit.values(whole), *ends, strict=True)]
    answers = []
    for i, axis in enumerate(axes):
        levels = fit.levels(whole, i)
        up, down = (None if x.high > 0.9 * RATE[1] else x for x in found[2 + 2 * i : 4 + 2 * i])
        error = [fit.off(i, fit.response(x, i), fit.levels(x, i), judged) for x, judged in halves]
        at_once = fit.off(i, AT_ONCE, levels, every)
        answers.append(
            Answered(
                KINDS[axis.kind],
                int(np.isfinite(axis.measured).sum()),
                up,
                down,
                tuple((v, omega, float(level)) for (v, omega), level in zip(axis.held, levels[1:], strict=True)),
                _rms(error),
                _rms([at_once]),
                _rms([fit.off(i, robot[axis.kind], levels, every)]) if robot else None,
            )
        )
    return Identified(found[0], found[1] if lags else None, tuple(answers), n)


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """One velocity: which of `KINDS`, its commands, the level (k,) that each has or -1, what was commanded where there is one, the readings,
    in which of these it moves, and what it comes to at each level about."""

    kind: int
    when: FloatArray
    told: FloatArray
    level: npt.NDArray[np.int64]
    held: list[tuple[float, float]]
    at: FloatArray
    measured: FloatArray
    moving: npt.NDArray[np.bool_]
    about: FloatArray

    @classmethod
    def of(cls, when: FloatArray, commands: FloatArray, at: FloatArray, measured: FloatArray, kind: int) -> _Axis:
        told = np.ascontiguousarray(commands[:, kind])
        ends = np.append(when[1:], max(at[-1], when[-1]))
        pairs, of = np.unique(np.round(commands, 3), axis=0, return_inverse=True)
        of = of.ravel()
        total = np.bincount(of, ends - when, minlength=len(pairs))
        long = [
            int(g) for g in np.argsort(-total, kind="stable")[:LEVELS] if total[g] >= HELD and pairs[g, kind] != 0.0
        ]
        level, about = np.full(len(when), -1, dtype=np.int64), np.empty(len(long))
        for j, g in enumerate(long):
            level[of == g] = j
            late = np.zeros(len(at), dtype=bool)
            for begin, end in zip(when[of == g], ends[of == g], strict=True):
                late |= (at > begin + 0.6 * (end - begin)) & (at <= end)
            late &= np.isfinite(measured)
            about[j] = np.median(measured[late]) if late.any() else pairs[g, kind]
        speed = np.nan_to_num(np.abs(measured))
        command = told[np.searchsorted(when, at, side="right") - 1]
        moving = (speed > MOVES * np.quantile(speed, 0.99)) | (command != 0.0)
        moving &= np.isfinite(measured) & bool(told.any()) & bool(speed.any())
        return cls(
            kind,
            when,
            told,
            level,
            [(row[0], row[1] if len(row) > 1 else 0.0) for row in pairs[long].tolist()],
            at,
            measured,
            moving,
            about,
        )

    @property
    def fastest(self) -> float:
        """m/s or rad/s"""
        return float(np.max(np.abs(self.measured[self.moving])))

    def foretold(self, response: Response, levels: FloatArray) -> FloatArray:
        """(n,) what a base would do that answers so; `levels` are the share that it comes to of a command without a level of its own, and the levels."""
        goal, out = levels[0] * self.told, np.empty(len(self.at))
        goal[self.level >= 0] = levels[1 + self.level[self.level >= 0]]
        answer(self.when, goal, response, self.at, out)
        return out


@dataclass(eq=False)
class _Fit:
    """Readings in blocks, and what is varied: latency, ln(lag), of each velocity ln(acceleration) and ln(deceleration), then of each its levels.

    Attributes:
        axes: The velocities.
        block: (n,) int64 in which block each reading is.
        blocks: (b,) int64 those in which the base moves.
        scale: (m,) of each velocity, what counts as an ordinary error of what is foretold.
    """

    axes: list[_Axis]
    block: npt.NDArray[np.int64]
    blocks: npt.NDArray[np.int64] = field(init=False)
    scale: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        moving = np.zeros(len(self.block), dtype=bool)
        for axis in self.axes:
            moving |= axis.moving
        self.blocks = np.unique(self.block[moving])
        self.scale = np.ones(len(self.axes))

    def response(self, x: FloatArray, i: int) -> Response:
        latency, lag, up, down = x[0], *np.exp([x[1], *x[2 + 2 * i : 4 + 2 * i]])
        return Response(float(latency), float(lag), float(up), float(down))

    def levels(self, x: FloatArray, i: int) -> FloatArray:
        """Of velocity `i`, as `_Axis.foretold` has them."""
        begin = 2 + 2 * len(self.axes) + sum(1 + len(axis.about) for axis in self.axes[:i])
        return x[begin : begin + 1 + len(self.axes[i].about)]

    def values(self, x: FloatArray) -> FloatArray:
        """(..., 2 + 2 m) latency, lag, accelerations and decelerations of one `x` or of many."""
        shown = np.exp(x[..., : 2 + 2 * len(self.axes)])
        shown[..., 0] = x[..., 0]
        return shown

    def off(self, i: int, response: Response, levels: FloatArray, judged: npt.NDArray[np.bool_]) -> FloatArray:
        """What velocity `i` is foretold less what was measured, while it moves in the blocks that are `judged` (b,)."""
        axis = self.axes[i]
        here = axis.moving & np.isin(self.block, self.blocks[judged])
        return (axis.foretold(response, levels) - axis.measured)[here]

    def error(self, fits: list[tuple[FloatArray, npt.NDArray[np.bool_]]]) -> float:
        """How far all velocities are off what each fit foretells where it is judged, each by its fastest reading."""
        every = range(len(self.axes))
        off = [_rms([self.off(i, self.response(x, i), self.levels(x, i), judged) for x, judged in fits]) for i in every]
        return float(np.hypot.reduce([o / self.axes[i].fastest for i, o in enumerate(off)]))

    def search(self, counts: FloatArray, lags: bool) -> FloatArray:
        """What fits best, with each block counted as often; `lags`: whether the motors may."""
        told = [value for axis in self.axes for value in (1.0, *(held[axis.kind] for held in axis.held))]
        seen = [value for axis in self.axes for value in (1.0, *axis.about)]
        starts = [
            np.array([latency, *np.log([lag, *[rate] * 2 * len(self.axes)]), *levels])
            for levels in (told, seen)
            for latency in TRIED[0]
            for lag in (TRIED[1] if lags else LAG[:1])
            for rate in TRIED[2]
        ]
        self.scale[:] = 1.0
        self.scale[:] = [axis.fastest for axis in self.axes]
        starts.sort(key=lambda x: float(np.abs(self._residuals(x, counts)).sum()))
        for i, axis in enumerate(self.axes):
            off = axis.foretold(self.response(starts[0], i), self.levels(starts[0], i)) - axis.measured
            self.scale[i] = max(0.5 * float(np.sqrt(np.mean(off[axis.moving] ** 2))), 1e-3 * axis.fastest)
        tries = [self._least(x, counts, lags) for x in starts[:3]]
        return min(tries, key=lambda t: t[0])[1]

    def again(self, x: FloatArray, counts: FloatArray, lags: bool) -> FloatArray:
        """What fits best near `x`."""
        return self._least(x, counts, lags)[1]

    def _least(self, x: FloatArray, counts: FloatArray, lags: bool) -> tuple[float, FloatArray]:
        low, high, unit = self._bounds(lags)
        found = least_squares(
            self._residuals,
            np.clip(x, low + 1e-9, high - 1e-9),
            bounds=(low, high),
            x_scale=unit,
            loss="soft_l1",
            max_nfev=100,
            args=(counts,),
        )
        return float(found.cost), found.x

    def _bounds(self, lags: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Least and greatest, and by how much a number is varied."""
        rows = [(*LATENCY, 0.05), (*np.log(LAG if lags else (LAG[0], 1.001 * LAG[0])), 0.3)] + [
            (*np.log(RATE), 0.3)
        ] * 2 * len(self.axes)
        for axis in self.axes:
            rows.append((0.3, 1.5, 0.1))
            farthest = [
                max(abs(a), abs(held[axis.kind])) for a, held in zip(axis.about.tolist(), axis.held, strict=True)
            ]
            rows += [(-1.2 * a - 0.05, 1.2 * a + 0.05, 0.05) for a in farthest]
        low, high, unit = np.array(rows).T
        return low, high, unit

    def _residuals(self, x: FloatArray, counts: FloatArray) -> FloatArray:
        weight = np.zeros(int(self.blocks.max()) + 2)
        weight[self.blocks] = np.sqrt(counts)
        here = weight[np.clip(self.block, -1, len(weight) - 1)]
        off = []
        for i, axis in enumerate(self.axes):
            out = axis.foretold(self.response(x, i), self.levels(x, i)) - axis.measured
            off.append(np.where(np.isfinite(out), out, 0.0) * here / self.scale[i])
        return np.concatenate(off)


def _rms(parts: list[FloatArray]) -> float:
    every = np.concatenate(parts)
    return math.sqrt(float(np.mean(every**2))) if len(every) else math.nan

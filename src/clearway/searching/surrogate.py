"""A Gaussian process over margins (Kriging; Rasmussen and Williams 2006) says where the next trial may fail.

The first trials go anywhere by chance; of later ones one in four does. The others go where the process expects the least margin, among
many members drawn by chance and neighbours of the best so far. It is told ranks rather than margins, as these may be anything from
millimetres to 100 m, and takes much of them to be noise. A break counts as the greatest margin: the next one shall be another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy
from scipy import linalg, special
from scipy.spatial.distance import cdist

from clearway.geometry.shapes import FloatArray
from clearway.searching.candidates import NOISES, WORST, Candidate, Space, Tried, anywhere

_FIRST = 10
"""Trials by chance at first."""
_CHANCE = 0.25
"""Share of later ones that goes by chance. Margins of chaotic trials may lead nowhere: then it is chance that finds a break."""
_DRAWN = 400
"""Members by chance among which the least margin is sought."""
_BEST, _STEPS, _SMOOTH = 5, (0.02, 0.2), 0.03
"""As many neighbours of so many of the best are among them, whose numbers have a standard deviation in the unit cube between these two;
of a family whose noise is no more than this. Elsewhere it would be too greedy: a navigator that keeps its distance has many trials that
come equally near, and none of them need lie near a break."""
_LENGTH = 0.5
"""Over which length margins resemble each other, in diagonals of the unit cube."""
_WITHIN, _BETWEEN = 0.7, 0.3
"""Variances of a margin's normal score within a family and between families."""
_NOISES = (0.001, 0.03, 0.3, 1.0)
"""Variances of what nothing explains; in each family the likeliest is taken."""
_HOPE = 1.0
"""Standard deviations below what is expected that are hoped for."""
_REMEMBERED = 400
"""Trials of a family that count, those with the least margins."""


class Surrogate:
    """Goes where a Gaussian process expects the least margin.

    Args:
        space: What is searched.
        batch: How many trials can run at once.
        seed: Of its draws.
    """

    def __init__(self, space: Space, batch: int, seed: int) -> None:
        self._space, self._batch, self._rng = space, batch, np.random.default_rng(seed)
        self._tried: list[Candidate] = []
        self._margins: list[float] = []
        self._known: dict[int, _Process] = {}

    def ask(self) -> list[Candidate]:
        """As many as can run at once, each the best of members of its own."""
        first = len(self._tried) < _FIRST
        return [
            anywhere(self._space, self._rng) if first or self._rng.random() < _CHANCE else self._best()
            for _ in range(self._batch)
        ]

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """What came of these."""
        self._tried += candidates
        self._margins += [WORST if t is None or t.broken else min(t.margin, WORST) for t in tried]
        scores = special.ndtri((scipy.stats.rankdata(self._margins) - 0.5) / len(self._margins))
        bases = np.array([c.base for c in self._tried])
        for base in {c.base for c in self._tried}:
            own = np.flatnonzero(bases == base)
            own = own[np.argsort(scores[own])[:_REMEMBERED]]
            self._known[base] = _Process(np.array([self._tried[i].point for i in own]), scores[own])

    def _best(self) -> Candidate:
        members = [anywhere(self._space, self._rng) for _ in range(_DRAWN)]
        best = [self._tried[i] for i in np.argsort(self._margins)[:_BEST]]
        smooth = [one for one in best if self._known[one.base].noise <= _SMOOTH]
        if smooth:
            members += [self._near(smooth[int(i)]) for i in self._rng.integers(len(smooth), size=_DRAWN)]
        hoped = np.full(len(members), -_HOPE * math.sqrt(_WITHIN + _BETWEEN))
        for base in {m.base for m in members} & set(self._known):
            those = [i for i, m in enumerate(members) if m.base == base]
            hoped[those] = self._known[base].hoped(np.array([members[i].point for i in those]))
        return members[int(hoped.argmin())]

    def _near(self, one: Candidate) -> Candidate:
        length = math.exp(self._rng.uniform(*np.log(_STEPS)))
        steps = length * self._rng.standard_normal(len(one.point))
        return Candidate(one.base, np.clip(one.point + steps, 0.0, 1.0), int(self._rng.integers(NOISES)))


class _Process:
    """What is known of the margins of one family.

    Args:
        points: (n, k) where it was tried.
        scores: (n,) the margins' normal scores.

    Attributes:
        noise: Variance of what nothing explains, the likeliest of `_NOISES`.
    """

    def __init__(self, points: FloatArray, scores: FloatArray) -> None:
        self._points, likeliest = points, -math.inf
        alike = _alike(points, points)
        for noise in _NOISES:
            factor = linalg.cholesky(alike + noise * np.eye(len(points)), lower=True)
            halves = linalg.solve_triangular(factor, scores, lower=True)
            likely = -0.5 * float(halves @ halves) - float(np.log(np.diag(factor)).sum())
            if likely > likeliest:
                likeliest, self.noise, self._factor, self._halves = likely, noise, factor, halves

    def hoped(self, points: FloatArray) -> FloatArray:
        """(m,) the least score that is to be hoped for at points (m, k)."""
        parts = linalg.solve_triangular(self._factor, _alike(self._points, points), lower=True)
        variance = np.maximum(_WITHIN + _BETWEEN - np.square(parts).sum(axis=0), 0.0)
        found: FloatArray = self._halves @ parts - _HOPE * np.sqrt(variance)
        return found


def _alike(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n, m) covariance of the margins at points (n, k) and (m, k) of a family."""
    distances = cdist(a, b, "sqeuclidean") / a.shape[1]
    similar: FloatArray = _BETWEEN + _WITHIN * np.exp(-distances / (2.0 * _LENGTH**2))
    return similar

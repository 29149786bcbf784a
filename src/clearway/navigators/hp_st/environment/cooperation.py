"""Whether those around make room for the robot: by Bayes' rule, from contacts that were foretold and did not come.

Forecasts expect nobody to see the robot. Where they foretell again and again that somebody will be where the robot is half a second later, and
nobody ever is, those around see to it themselves.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from scipy.special import chndtr

from clearway.forecasts.forecast import Forecast
from clearway.geometry.shapes import FloatArray

AHEAD = 0.5
"""So long before a contact is foretold, s. Who makes room has done so earlier; who was missed by chance is soon beside the robot."""
MOVES = 0.3
"""Who is slower than that, m/s, may have been about to stop."""
SEEN = 0.3
"""Who was seen no longer ago than that, s, is there, and was no error of the tracker's."""
SUREST = 0.95
"""No forecast is surer than that."""
FORGETS = 20.0
"""Others come: what was learnt counts less by the factor e in so long a time, s."""
PRIOR = 0.5
"""Probability at first that nobody makes room."""


class Cooperation:
    """What is known of it so far.

    Args:
        inscribed: Radius of the disc about the pose that the robot's outline holds, m.
        period: Control period, s.
        spread: Standard deviation of the robot's own place, m.

    Attributes:
        doubt: Probability that nobody makes room.
    """

    def __init__(self, inscribed: float, period: float, spread: float) -> None:
        self._inscribed, self._period, self._spread = inscribed, period, spread
        self._foretold = deque[Forecast](maxlen=max(1, round(AHEAD / period)))
        self.doubt = PRIOR

    def look(self, pose: FloatArray, forecast: Forecast) -> None:
        """A period later: the robot is at `pose` (3,), unhurt, and `forecast` begins there."""
        if len(self._foretold) == self._foretold.maxlen:
            share = self._period / AHEAD  # of the evidence: what is foretold in each period is nearly the same
            missed = (1.0 - self._chance(self._foretold[0], pose, forecast)) ** share
            odds = (self.doubt / (1.0 - self.doubt) * missed) ** math.exp(-self._period / FORGETS)
            self.doubt = odds / (1.0 + odds)
        self._foretold.append(forecast)

    def _chance(self, foretold: Forecast, pose: FloatArray, now: Forecast) -> float:
        """By what was `foretold`, the probability of a contact at `pose` (3,) with the likeliest of those who still are in view."""
        k = min(len(self._foretold), foretold.path.shape[2] - 1)
        begin, end = foretold.path[:, 0, 0], foretold.path[:, 0, k]
        counts = np.hypot(*(end - begin).T) > MOVES * k * foretold.step
        counts &= np.isin(foretold.identity, now.identity[now.age <= SEEN])
        if not counts.any():
            return 0.0
        at, sigma = foretold.path[counts, :, k], np.hypot(foretold.sigma[counts, :, k], self._spread)
        away = np.hypot(at[..., 0] - pose[0], at[..., 1] - pose[1])
        within = self._inscribed + foretold.radius[counts, None]
        hit = chndtr((within / sigma) ** 2, 2.0, (away / sigma) ** 2)  # of a place that errs alike in all directions
        chance = float((foretold.weight[counts] * hit).sum(axis=1).max())
        return min(chance, SUREST) if math.isfinite(chance) else 0.0

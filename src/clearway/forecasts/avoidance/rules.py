"""Where obstacles go if they keep out of each other's way, by ORCA or by social force.

Each rule infers what everybody wants, moves all on together, and gathers evidence of its own: how well it foretold velocities, beside
constant velocity. By that the likelier one is believed, of each obstacle, beside the models that know of one obstacle only.

Nobody is expected to see the robot: whoever does makes more room than was foretold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.walls import walls_of
from clearway.forecasts.avoidance import orca, social_force
from clearway.forecasts.avoidance.intents import MOST, Intents, nobody
from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

FIRST, GROWTH = 0.02, 0.05
"""Standard deviation of a place that is foretold: now, m, and how it grows, m/s."""
_WALLS = walls_of([])


class _Rule(NamedTuple):
    """A rule by which obstacles may avoid each other.

    Attributes:
        learn: What is known of everybody, from what was known and where they are now.
        move_on: Where all go from there.
        beliefs: So many numbers are kept of each one's wishes.
    """

    learn: Callable[..., Intents]
    move_on: Callable[..., None]
    beliefs: int


_RULES = {
    "orca": _Rule(orca.learn, orca.move_on, orca.WISHES),
    "social-force": _Rule(social_force.learn, social_force.move_on, social_force.BELIEFS),
}


class Avoidance:
    """Obstacles that may avoid each other.

    Args:
        rules: By which rules, see `parameters.Rules`.
        least: A hypothesis less probable than that is left out.
    """

    def __init__(self, rules: bool | Sequence[str], least: float) -> None:
        names = (["orca"] if rules else []) if isinstance(rules, bool) else rules
        self._rules, self._least = [_RULES[name] for name in names], least
        self.reset()

    def reset(self) -> None:
        """Forget everybody."""
        self.known = [nobody(rule.beliefs) for rule in self._rules]

    def update(self, dt: float, forecast: Forecast) -> None:
        """Learn from what a forecast says is there now, and add to its hypotheses where all go by each rule.

        Args:
            dt: Time since what is known was learnt, s; not above 0, or NaN: nothing is learnt from that.
            forecast: Updated: `path`, `sigma` and `weight`.
        """
        if not self._rules:
            return
        place, error = np.ascontiguousarray(forecast.centre[:, 0]), forecast.reach[:, 0].copy()
        path = np.empty((len(self._rules), len(place), forecast.path.shape[2], 2))
        evidence, wants = np.empty(path.shape[:2]), np.empty(path.shape[:2], np.bool_)
        for k, (rule, known) in enumerate(zip(self._rules, self.known, strict=True)):
            now = rule.learn(known, dt, forecast.identity, place, forecast.radius, error, _WALLS)
            rule.move_on(now, _WALLS, forecast.radius, forecast.step, path[k])
            evidence[k], wants[k] = now.evidence, np.isfinite(now.wish[:, 0])
            self.known[k] = now._replace(evidence=evidence[k])
        limit(evidence)
        believe(evidence, wants, path, self._least, forecast)


@kernel
def limit(evidence: FloatArray) -> None:
    """Limit the `evidence` (r, n) for each rule and each obstacle: what the rules differ by stays, while one is likely."""
    for i in range(evidence.shape[1]):
        best = evidence[:, i].max()
        for k in range(evidence.shape[0]):
            lowered = MOST - (best - evidence[k, i]) if best > MOST else evidence[k, i]
            evidence[k, i] = max(lowered, -MOST)


@kernel
def believe(
    evidence: FloatArray, wants: npt.NDArray[np.bool_], path: FloatArray, least: float, forecast: Forecast
) -> None:
    """Put the likeliest rule's path among each one's hypotheses, with the probability that its evidence gives it, for the least
    probable of those.

    Args:
        evidence: (r, n) for each rule.
        wants: (r, n) whether each knows a wish.
        path: (r, n, K + 1, 2) m, by each.
        least: A hypothesis less probable than that is left out.
        forecast: Updated.
    """
    weight, last = forecast.weight, forecast.weight.shape[1] - 1
    for i in range(evidence.shape[1]):
        best = -1
        for k in range(evidence.shape[0]):
            if wants[k, i] and (best < 0 or evidence[k, i] > evidence[best, i]):
                best = k
        if best < 0:
            continue
        share = 1.0 / (1.0 + math.exp(-evidence[best, i]))
        if share < max(least, 0.5 if last == 0 else 0.0):
            continue
        rest = weight[i, :last].sum()
        weight[i, :last] *= (1.0 - share) / rest if last > 0 else 0.0
        at = last
        while at > 0 and weight[i, at - 1] < share:
            weight[i, at], forecast.path[i, at], forecast.sigma[i, at] = (
                weight[i, at - 1], forecast.path[i, at - 1], forecast.sigma[i, at - 1],
            )  # fmt: skip
            at -= 1
        weight[i, at] = share if last > 0 else 1.0
        for j in range(path.shape[2]):
            forecast.path[i, at, j] = path[best, i, j]
            forecast.sigma[i, at, j] = FIRST + GROWTH * j * forecast.step

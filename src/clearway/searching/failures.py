"""What counts as a break, and how far a trial is from it: a margin that is positive for a trial that holds, and falls as it comes
nearer to failing, so that a search knows which way to go.

| failure | margin |
|---|---|
| `contact while moving` | smallest distance from what the test placed while the robot moves, m; at contact minus its speed, m/s |
| `contact` | smallest distance from what the test placed, m; at contact minus its speed, m/s |
| `timeout` | the least time left at a goal, s; at a timeout minus the distance that was left, m |
| `livelock` | 20 s less the longest time without 0.5 m of progress, s |
| `MDO<0.1`, any indicator | what is left to the limit, in the indicator's unit |

A test without obstacles has the distance from walls.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clearway.contract import PLACED
from clearway.errors import ClearwayError, unknown
from clearway.indicators import INDICATORS, NotComputable, failure
from clearway.indicators.avoidable import touched_body
from clearway.indicators.clearance import clearances, scenes
from clearway.indicators.legs import contact_time, ground_speed, refined
from clearway.indicators.success import AT_REST
from clearway.scenarios.scenario import Scenario
from clearway.trials import Outcome, Trial
from clearway.world.goal_and_progress_checker import PATIENCE, PROGRESS

MOVING, CONTACT, TIMEOUT, LIVELOCK = "contact while moving", "contact", "timeout", "livelock"
_HOLDS = 1e-6
"""The least margin of a trial that holds."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A kind of failure that is searched for.

    Attributes:
        name: As the user wrote it.
        unit: Of the margin of a trial that holds.
        indicator: The indicator whose limit it is; empty for the others.
        limit: That limit, in the indicator's unit.
        beyond: Whether it is a failure to be above the limit, rather than below.
    """

    name: str
    unit: str
    indicator: str = ""
    limit: float = math.nan
    beyond: bool = False

    @property
    def touches(self) -> bool:
        """Whether it is a contact."""
        return self.name in (MOVING, CONTACT)

    def margin(self, trial: Trial) -> float:
        """How far the trial is from failing so; 0 or less: it does.

        Raises:
            NotComputable: the indicator can't be computed of it.
        """
        if self.indicator:
            found = INDICATORS[self.indicator].function(trial)
            if found.value is None:
                raise NotComputable(found.why)
            left = self.limit - found.value if self.beyond else found.value - self.limit
            return left if left != 0.0 else _HOLDS  # the limit itself is kept
        broken, left = _MARGINS[self.name](trial)
        return min(left, -_HOLDS) if broken else max(left, _HOLDS)

    def possible(self, scenario: Scenario) -> bool:
        """Whether a trial of the scenario can end so at all."""
        return self.name != LIVELOCK or scenario.livelock


def failure_named(text: str) -> Failure:
    """The failure that `text` names.

    Raises:
        ClearwayError: it names none.
    """
    words = " ".join(text.split())
    if words in _MARGINS:
        return Failure(words, "m" if words in (MOVING, CONTACT) else "s")
    limit = re.fullmatch(r"(\w+) ?([<>]) ?([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)", words)
    if limit is None:
        raise unknown("failure", text, [*_MARGINS, "INDICATOR<LIMIT", "INDICATOR>LIMIT"], field="failure")
    name, sign, number = limit.groups()
    if name not in INDICATORS:
        raise unknown("indicator", name, INDICATORS, field="failure")
    try:
        value = float(number)
    except ValueError:
        raise ClearwayError(f"{number!r} is no number; as in 'MDO<0.1'", field="failure") from None
    indicator = INDICATORS[name]
    if indicator.upside_down(sign == "<"):
        other = f"{name}{'>' if sign == '<' else '<'}{value:g}"
        raise ClearwayError(f"{name} is the better the {indicator.better}: write {other!r}", field="failure")
    least, greatest = indicator.bounds
    if value <= least if sign == "<" else value >= greatest:
        raise ClearwayError(f"no trial can fail so: {name} lies from {least:g} to {greatest:g}", field="failure")
    return Failure(f"{name}{sign}{value:g}", INDICATORS[name].unit, name, value, sign == ">")


def _clearance(trial: Trial, *, moving: bool) -> float:
    """Smallest distance edge to edge, m; inf where nothing was near."""
    whole = refined(trial)
    try:
        parts = scenes(whole, PLACED)
    except NotComputable:
        try:
            parts = scenes(whole, None)
        except NotComputable:
            return math.inf
    least = math.inf
    for part in parts:
        gaps = clearances(part)
        if moving and trial.velocity is not None:
            moves = (np.abs(trial.velocity) >= AT_REST).any(axis=1).astype(np.float64)
            gaps = gaps[np.interp(part.drive.t, trial.t, moves) > 0.0]
        least = min(least, float(gaps.min(initial=math.inf)))
    return least


def _touched(trial: Trial, *, moving: bool) -> tuple[bool, float]:
    touches = contact_time(trial) is not None
    if touches and (not moving or failure(trial) == Outcome.COLLISION.value):
        return True, -float(ground_speed(trial.velocity[-1:])[0]) if trial.velocity is not None else 0.0
    least = _clearance(trial, moving=moving)
    return False, least if math.isfinite(least) else 100.0


def _out_of_time(trial: Trial) -> tuple[bool, float]:
    legs = trial.attempt.legs
    if trial.outcome is Outcome.TIMEOUT:
        left = legs[trial.spans[-1].leg].goal[:2] - trial.pose[-1, :2]
        return True, -float(np.hypot(*left))
    return False, min((legs[s.leg].time_limit - (s.end - s.start) for s in trial.spans), default=math.inf)


def _stuck(trial: Trial) -> tuple[bool, float]:
    longest = 0.0
    for span in trial.spans:
        driven = (trial.t >= span.start) & (trial.t <= span.end)
        times, places = trial.t[driven], trial.pose[driven, :2]
        since = 0
        for k in range(len(times)):
            if math.dist(places[k], places[since]) > PROGRESS:
                since = k
            longest = max(longest, float(times[k] - times[since]))
    return trial.outcome is Outcome.LIVELOCK, PATIENCE - longest


_MARGINS: dict[str, Callable[[Trial], tuple[bool, float]]] = {
    MOVING: lambda trial: _touched(trial, moving=True),
    CONTACT: lambda trial: _touched(trial, moving=False),
    TIMEOUT: _out_of_time,
    LIVELOCK: _stuck,
}
"""Whether it failed so, and how far it is from that."""


def party(trial: Trial) -> str:
    """Whom the robot touched, in words; empty for nobody."""
    body = touched_body(trial)
    return "" if body is None else f"{body.name} ({body.kind.value})"

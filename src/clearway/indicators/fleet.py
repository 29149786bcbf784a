"""What the robots of one run did as a fleet: one pure function an indicator, of the rows in the table of all of its tested robots.

Each row holds what its own trial tells: when it arrived, what it touched, for whom it waited, who blocked it at last. Makespan
and sum of times (sum of costs) are those of multi-agent path finding (Stern et al. 2019). A robot waits for the nearest other one
while it stands within `NEAR` of its outline. A deadlock is a circle of robots that did not arrive, each of which stood for the
last `LAST` of its trial and waited for the next.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.contract import BodyKind, EventKind
from clearway.geometry.distance import min_clearance
from clearway.indicators.indicator import Value
from clearway.indicators.legs import ground_speed, legs_reached
from clearway.indicators.success import AT_REST
from clearway.trials import Trial

NEAR = 1.0
"""m, outline to outline; who stands further from any other robot waits for none of them."""
LAST = 5.0
"""s."""
Row: TypeAlias = Mapping[str, Any]
"""Of the trials' table."""


@dataclass(frozen=True, slots=True)
class FleetIndicator:
    """An indicator of how well a run of several robots went.

    Attributes:
        name: What it is called.
        title: How it is printed.
        unit: `s`, or empty for a count.
        function: The rows of a run -> Value; never raises for want of data.
    """

    name: str
    title: str
    unit: str
    function: Callable[[Sequence[Row]], Value]


# --- of one trial -----------------------------------------------------------------------------------------------------


def arrived(trial: Trial) -> float | None:
    """When the robot had arrived at the last of its goals, s since the run began; None: it did not."""
    there = trial.spans and len(legs_reached(trial)) == len(trial.attempt.legs)
    return float(max(span.end for span in trial.spans)) if there else None


def waits(trial: Trial) -> dict[str, float]:
    """For how long a robot stood near each other one, the nearest at the time, by name; s. Empty without other robots, or where
    nobody knows."""
    rest = _rest(trial)
    seconds: dict[str, float] = {}
    for i, (name, gap) in _nearest(trial, np.flatnonzero(rest)).items():
        if gap < NEAR:
            seconds[name] = seconds.get(name, 0.0) + float(trial.t[i + 1] - trial.t[i])
    return seconds


def waited_for(trial: Trial) -> str:
    """The same as JSON, the longest first; empty where it waited for nobody."""
    found = sorted(waits(trial).items(), key=lambda one: (-one[1], one[0]))
    return json.dumps(dict(found)) if found else ""


def blocked_by(trial: Trial) -> str:
    """For whom a robot waited that did not arrive; empty: it did, touched something, drove, or nobody was near."""
    n = len(trial.t)
    if n < 2 or arrived(trial) is not None:
        return ""
    if any(event.kind == EventKind.CONTACT for event in trial.events):
        return ""
    if not _rest(trial)[np.searchsorted(trial.t, trial.t[-1] - LAST) :].all() or trial.t[-1] < LAST:
        return ""
    name, gap = _nearest(trial, np.array([n - 1])).get(n - 1, ("", math.inf))
    return name if gap < NEAR else ""


def _rest(trial: Trial) -> npt.NDArray[np.bool_]:
    """(n - 1,) whether the robot stood from a sample to the next."""
    if trial.velocity is None:
        return np.zeros(max(len(trial.t) - 1, 0), np.bool_)
    still = (ground_speed(trial.velocity) < AT_REST) & (np.abs(trial.velocity[:, 1]) < AT_REST)
    return np.asarray(still[:-1] & still[1:])


def _nearest(trial: Trial, at: npt.NDArray[np.int64]) -> dict[int, tuple[str, float]]:
    """The nearest other robot at each of these samples, and its distance from outline to outline, m."""
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    robots = [k for k, body in enumerate(moving) if body.kind == BodyKind.ROBOT]
    footprint = trial.attempt.footprint
    if footprint is None or not robots or not len(at):
        return {}
    gaps = np.stack(
        [min_clearance(footprint, trial.pose[at], [moving[k]], trial.moving_obstacles[at][:, [k]]) for k in robots]
    )
    return {
        int(i): (moving[robots[k]].name, float(gaps[k, j]))
        for j, (i, k) in enumerate(zip(at.tolist(), gaps.argmin(axis=0).tolist(), strict=True))
    }


# --- of a run ---------------------------------------------------------------------------------------------------------


def waiting(rows: Sequence[Row]) -> dict[tuple[str, str], float]:
    """Who waited for whom in a run, and for how long, s."""
    return {(r["member"], name): seconds for r in rows for name, seconds in json.loads(r["waits"] or "{}").items()}


def makespan(rows: Sequence[Row]) -> Value:
    """When the last robot had arrived, s since the run began."""
    return _of_times(rows, max)


def sum_of_times(rows: Sequence[Row]) -> Value:
    """The times of all robots until they had arrived, s."""
    return _of_times(rows, math.fsum)


def contacts(rows: Sequence[Row]) -> Value:
    """How often a robot touched something; of two robots that touched each other, once."""
    pairs = {frozenset({r["member"], r["touched_body"]}) for r in rows if r["touched"] == BodyKind.ROBOT}
    return Value(float(len(pairs) + sum(r["contacts"] or 0 for r in rows if r["touched"] != BodyKind.ROBOT)))


def deadlocks(rows: Sequence[Row]) -> Value:
    """How many circles of robots waited for each other when their trials ended."""
    blocked = {r["member"]: r["blocked_by"] for r in rows}
    circles = set()
    for start in blocked:
        way: list[str] = []
        at = start
        while at and at not in way:
            way.append(at)
            at = blocked.get(at)
        if at:
            circles.add(frozenset(way[way.index(at) :]))
    return Value(float(len(circles)))


def _of_times(rows: Sequence[Row], put_together: Callable[[list[float]], float]) -> Value:
    for r in rows:
        if r["arrived"] is None:
            return Value(None, f"{r['member']} did not arrive ({r['outcome']})")
    return Value(put_together([float(r["arrived"]) for r in rows]))


FLEET = (
    FleetIndicator("makespan", "makespan", "s", makespan),
    FleetIndicator("sum_of_times", "sum of times", "s", sum_of_times),
    FleetIndicator("contacts", "contacts", "", contacts),
    FleetIndicator("deadlocks", "deadlocks", "", deadlocks),
)
"""In the order of the table."""

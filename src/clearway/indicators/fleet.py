"""What the robots of one run did as a fleet: one pure function an indicator, of the trials of all of its tested robots.

Makespan and sum of times (sum of costs) are those of multi-agent path finding (Stern et al. 2019). A robot waits for the nearest other
one while it stands within `NEAR` of its outline. A deadlock is a circle of robots that did not arrive, each of which stood for
the last `LAST` of its trial and waited for the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.contract import BodyKind, EventKind
from clearway.geometry.distance import min_clearance
from clearway.indicators.indicator import Value
from clearway.indicators.legs import ended, ground_speed, legs_reached
from clearway.indicators.success import AT_REST
from clearway.trials import Trial

NEAR = 1.0
"""m, outline to outline; who stands further from any other robot waits for none of them."""
LAST = 5.0
"""s."""


@dataclass(frozen=True, slots=True)
class FleetIndicator:
    """An indicator of how well a run of several robots went.

    Attributes:
        name: What it is called.
        title: How it is printed.
        unit: `s`, or empty for a count.
        function: The trials of a run -> Value; never raises for want of data.
    """

    name: str
    title: str
    unit: str
    function: Callable[[Sequence[Trial]], Value]


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
    """The same in words, the longest first."""
    found = sorted(waits(trial).items(), key=lambda one: (-one[1], one[0]))
    return ", ".join(f"{name} {seconds:.1f} s" for name, seconds in found)


def waiting(trials: Sequence[Trial]) -> dict[tuple[str, str], float]:
    """Who waited for whom in a run, and for how long, s."""
    return {(trial.attempt.member, name): seconds for trial in trials for name, seconds in waits(trial).items()}


def makespan(trials: Sequence[Trial]) -> Value:
    """When the last robot had arrived, s since the run began."""
    return _of_times(trials, max)


def sum_of_times(trials: Sequence[Trial]) -> Value:
    """The times of all robots until they had arrived, s."""
    return _of_times(trials, math.fsum)


def contacts(trials: Sequence[Trial]) -> Value:
    """How often a robot touched something; of two robots that touched each other, once."""
    found = set()
    for trial in trials:
        for k, event in enumerate(trial.events):
            if event.kind == EventKind.CONTACT:
                body = None if event.body is None else trial.attempt.bodies[event.body]
                met = body is not None and body.kind == BodyKind.ROBOT
                found.add(frozenset({trial.attempt.member, body.name if met and body else f"event {k}"}))
    return Value(float(len(found)))


def deadlocks(trials: Sequence[Trial]) -> Value:
    """How many circles of robots waited for each other when their trials ended."""
    blocked = {trial.attempt.member: _blocked_by(trial) for trial in trials}
    circles = set()
    for start in blocked:
        way: list[str] = []
        at: str | None = start
        while at is not None and at not in way:
            way.append(at)
            at = blocked.get(at)
        if at is not None:
            circles.add(frozenset(way[way.index(at) :]))
    return Value(float(len(circles)))


def _of_times(trials: Sequence[Trial], put_together: Callable[[list[float]], float]) -> Value:
    for trial in trials:
        if len(legs_reached(trial)) < len(trial.attempt.legs):
            return Value(None, f"{trial.attempt.member} did not arrive ({ended(trial)})")
    return Value(put_together([max(span.end for span in trial.spans) for trial in trials]))


def _blocked_by(trial: Trial) -> str | None:
    """For whom a robot waited that did not arrive; None: it did, touched something, drove, or nobody was near."""
    n = len(trial.t)
    if n < 2 or len(legs_reached(trial)) == len(trial.attempt.legs):
        return None
    if any(event.kind == EventKind.CONTACT for event in trial.events):
        return None
    if not _rest(trial)[np.searchsorted(trial.t, trial.t[-1] - LAST) :].all() or trial.t[-1] < LAST:
        return None
    name, gap = _nearest(trial, np.array([n - 1])).get(n - 1, ("", math.inf))
    return name if gap < NEAR else None


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


FLEET = (
    FleetIndicator("makespan", "makespan", "s", makespan),
    FleetIndicator("sum_of_times", "sum of times", "s", sum_of_times),
    FleetIndicator("contacts", "contacts", "", contacts),
    FleetIndicator("deadlocks", "deadlocks", "", deadlocks),
)
"""In the order of the table."""

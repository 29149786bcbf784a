"""The people of a scenario as they walk where no robot drives: the same floor, obstacles and seed.

What their robots cost people is told by the difference. It is simulated once a scenario in a process, and again only if a trial
asks for what comes later, or where obstacles go by the robot's legs, which each trial drives at other times. Nobody is sensed and
nothing is driven in it, so it takes a small part of a trial's time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.trials import Errand, Span
from clearway.world.arrivals import Arrivals
from clearway.world.behaviours.foreign import BehaviourError
from clearway.world.behaviours.registry import behaviours_of
from clearway.world.bodies import bodies_of, moving_obstacles_of
from clearway.world.tracks import longest, tracks
from clearway.world.traffic import AFTER, Traffic

_SECOND = 1.0


def completed(scenario: Scenario, errands: Sequence[Errand], spans: Sequence[Span]) -> tuple[Errand, ...]:
    """The errands of a trial of `scenario` with what the same people do without robots.

    Nobody knows it where robots drive there that are not tested, as nobody knows how people walk among these alone, nor where a
    behaviour of the people fails without robots.

    Args:
        scenario: The test.
        errands: With what they did among the robots.
        spans: When its own robot drove its legs: obstacles that go by these begin at the same instants.
    """
    if not errands or len(scenario.tested()) <= len(scenario.robots):
        return tuple(replace(errand, until=math.nan) for errand in errands)
    begun: list[tuple[int, float]] = []
    if any(o.runs for o in scenario.obstacles):
        last = len(scenario.legs) - 1
        begun = [(span.leg + 1, span.end) for span in spans if span.reached and span.leg < last]
    try:
        return _walk_of(scenario, tuple(begun)).completed(errands)
    except BehaviourError:
        return tuple(replace(errand, until=math.nan) for errand in errands)


@lru_cache(maxsize=4096)
def _walk_of(scenario: Scenario, begun: tuple[tuple[int, float], ...]) -> _Walk:
    return _Walk(scenario, begun)


class _Walk:
    """What is known of one scenario: a few numbers a person."""

    def __init__(self, scenario: Scenario, begun: tuple[tuple[int, float], ...]) -> None:
        self._scenario, self._begun = scenario, begun
        self._arrivals, self._over = Arrivals((), 0), False

    def completed(self, errands: Sequence[Errand]) -> tuple[Errand, ...]:
        plan = load_floor_plan(self._scenario.floor_plan)
        bodies = bodies_of(plan.fixtures, self._scenario)
        first = len(bodies) - len(self._scenario.people)
        wanted = {errand.body - first: errand.place for errand in errands}
        if not self._over and not (self._arrivals.reached and self._arrivals.come(wanted)):
            self._arrivals, self._over = _walked(self._scenario, self._begun, wanted)
        found = []
        for errand in errands:
            came = self._arrivals.at(errand.body - first, errand.place)
            found.append(errand if came is None else replace(errand, arrived_without=came.t, path_without=came.path))
        return tuple(found)


def _walked(scenario: Scenario, begun: Sequence[tuple[int, float]], wanted: dict[int, int]) -> tuple[Arrivals, bool]:
    """Let the people walk until they are where they are `wanted`, or as long as with a robot; whether it was that long."""
    bodies = bodies_of(load_floor_plan(scenario.floor_plan).fixtures, scenario)
    moving, legs = moving_obstacles_of(scenario), [leg.name for leg in scenario.legs]
    time = max(longest(member.legs) for member in scenario.members())
    way = tracks(moving, legs, time, len(scenario.people))
    arrivals = Arrivals(scenario.people, len(moving))
    traffic = Traffic(way, behaviours_of(scenario, bodies), legs, robots=0, arrivals=arrivals)
    traffic.start()
    t, due = 0.0, list(begun)
    while t < time + AFTER and not arrivals.come(wanted):
        t += _SECOND
        while due and due[0][1] <= t:
            leg, at = due.pop(0)
            traffic.decide_until(at)
            traffic.begin_leg(leg, at)
        traffic.decide_until(t)
    return arrivals, t >= time + AFTER

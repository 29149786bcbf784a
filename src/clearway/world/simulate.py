"""Runs trials: the world on one side, pilots on the other, a checker between them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from clearway.contract import BodyKind, Budget, Pilot, Task
from clearway.errors import ClearwayError
from clearway.geometry.read_only import read_only
from clearway.robots import Robot
from clearway.robots.ideal import ideal
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.trials import Attempt, Body, Errand, Trial
from clearway.versions import version_of
from clearway.world.arrivals import Arrivals
from clearway.world.attempt import attempt_of, placed, run_of
from clearway.world.behaviours.registry import behaviours_of
from clearway.world.bodies import bodies_of, moving_obstacles_of
from clearway.world.drive import Drive, Driver, thinking_of, timing
from clearway.world.goal_and_progress_checker import GoalAndProgressChecker
from clearway.world.together import together
from clearway.world.tracks import Tracks, longest, tracks
from clearway.world.traffic import Traffic
from clearway.world.world import World

_Area = tuple[float, float, float, float]


def simulate(scenario: Scenario, robot: Robot, pilot: Pilot, *, raise_errors: bool = False, **more: Any) -> Trial:
    """Run `scenario` with `robot`, driven by `pilot`; of one that has more robots, see `simulate_all`.

    Args:
        raise_errors: Whether an error of the pilot is raised, as a debugger needs it.
        more: What else `Driver` tells of it.

    Returns:
        The trial. A pilot that raises, or whose command isn't finite, ends it as `navigator_failed`.

    Raises:
        ClearwayError: the scenario can't be built, or has more robots.
    """
    (trial,) = simulate_all(scenario, [Driver(robot, pilot, **more)], raise_errors=raise_errors)
    return trial


def simulate_all(scenario: Scenario, drivers: Sequence[Driver], *, raise_errors: bool = False) -> list[Trial]:
    """Run `scenario` with all its robots, and give the trial of each.

    Args:
        scenario: The test.
        drivers: Of its own robot, then of its other `robots` in their order.
        raise_errors: Whether an error of a pilot is raised, as a debugger needs it.

    Raises:
        ClearwayError: the scenario can't be built, or has more robots or fewer than there are drivers.
    """
    return _simulated(simulation_of(scenario, drivers, raise_errors=raise_errors))


def simulation_of(scenario: Scenario, drivers: Sequence[Driver], *, raise_errors: bool = False) -> Simulation:
    """`scenario` at its beginning, with all its robots; arguments and errors as of `simulate_all`."""
    plan, others = load_floor_plan(scenario.floor_plan), scenario.robots
    if len(drivers) != 1 + len(others):
        raise ClearwayError(
            f"{scenario.name!r} has {1 + len(others)} robots; {len(drivers)} are driven", field="robots"
        )
    robots = [driver.robot for driver in drivers]
    own = scenario.members()
    time = max(longest(s.legs) for s in own)
    moving, legs = moving_obstacles_of(scenario), [leg.name for leg in scenario.legs]
    way = tracks(moving, legs, time, len(scenario.people), len(drivers) if others else 0)
    bodies = [bodies_of(plan.fixtures, scenario, robots, member) for member in range(len(drivers))]
    run = run_of(scenario, robots, [driver.navigator for driver in drivers], drivers[0].setup)
    return Simulation(own, bodies, way, drivers, plan.area, raise_errors, run)


def simulate_in(
    bodies: Sequence[Body],
    tracks: Tracks,
    scenario: Scenario,
    robot: Robot,
    pilot: Pilot,
    *,
    area: _Area | None = None,
    raise_errors: bool = False,
    **more: Any,
) -> Trial:
    """As `simulate`, among `bodies` wherever they come from; `tracks` of those without a pose, in their order; `area`
    as in `Task`."""
    (trial,) = _simulated(Simulation([scenario], [bodies], tracks, [Driver(robot, pilot, **more)], area, raise_errors))
    return trial


class Simulation:
    """A scenario under way: what moves there, and the drive of each robot.

    Args:
        scenarios: The scenario as each robot has it.
        bodies: What is around each.
        tracks: Of what moves.
        drivers: Who drives them.
        area: As in `Task`.
        raise_errors: Whether an error of a pilot is raised, as a debugger needs it.
        run: The trials' common run, see `Attempt`.

    Attributes:
        drives: Of each robot.
        traffic: What moves there.
    """

    def __init__(
        self, scenarios: Sequence[Scenario], bodies: Sequence[Sequence[Body]], tracks: Tracks, drivers: Sequence[Driver],
        area: _Area | None, raise_errors: bool, run: str = "",
    ) -> None:  # fmt: skip
        self._begun, first = perf_counter(), scenarios[0]
        self._scenarios, self._names = scenarios, [scenario.member for scenario in scenarios]
        self._people = [k for k, body in enumerate(bodies[0]) if body.kind == BodyKind.PERSON]
        unpiloted = [b for b in bodies[0] if b.name not in self._names or b.kind != BodyKind.ROBOT]
        arrivals = Arrivals(first.people, len(moving_obstacles_of(first)))
        legs, behaviours = [leg.name for leg in first.legs], behaviours_of(first, unpiloted)
        self.traffic = Traffic(tracks, behaviours, legs, len(drivers), arrivals)
        self._attempts: list[Attempt] = []
        self.drives: list[Drive] = []
        for scenario, around, driver in zip(scenarios, bodies, drivers, strict=True):
            attempt = attempt_of(
                scenario, driver.robot, around, navigator=driver.navigator, localisation=driver.localisation,
                privileged=driver.privileged, setup=driver.setup, tracking=driver.tracking, run=run,
            )  # fmt: skip
            self._attempts.append(attempt)
            self.drives.append(_drive(scenario, attempt, driver, self.traffic, area, raise_errors))

    def due(self) -> Iterator[Sequence[Drive]]:
        """Drive until all trials are over, see `clearway.world.together`: whose periods begin has to decide before it goes on."""
        return together(self.drives, self._names, self.traffic)

    def trials(self) -> list[Trial]:
        """The trial of each robot, once all are over."""
        wall = perf_counter() - self._begun
        trials = [_trial(*one, wall) for one in zip(self._scenarios, self._attempts, self.drives, strict=True)]
        errands = _errands(self.traffic, self._people)
        return [replace(trial, errands=errands) for trial in trials]


def _simulated(simulation: Simulation) -> list[Trial]:
    """The trial of each robot, each driven by its pilot."""
    for due in simulation.due():
        for drive in due:
            drive.decide()
    return simulation.trials()


def _errands(traffic: Traffic, people: Sequence[int]) -> tuple[Errand, ...]:
    """What became of the people, who are these of the bodies."""
    found = []
    places, until = traffic.walk_on()
    for k, place in places.items():
        came = traffic.arrivals.at(k, place)
        how = (math.nan, math.nan) if came is None else (came.t, came.path)
        found.append(Errand(people[k], place, *how, until=until))
    return tuple(found)


def _drive(
    scenario: Scenario, attempt: Attempt, driver: Driver, traffic: Traffic, area: _Area | None, raise_errors: bool
) -> Drive:
    robot, start = driver.robot, np.array(scenario.start, dtype=np.float64)
    world = World(
        ideal(robot, scenario.ideal), placed(start, scenario), scenario.speed, attempt.bodies, traffic, scenario.seed, scenario.disturbance,
        scenario.latency,
    )  # fmt: skip
    checker = GoalAndProgressChecker(attempt.legs, scenario.legs, scenario.livelock, world.state)
    task = Task(
        period=robot.period,
        speed_limit=scenario.speed,
        start=read_only(start),
        map=None if driver.map is None else driver.map.read_only(),
        area=area,
        budget=driver.budget or Budget(),
        time_limit=max(leg.time_limit for leg in scenario.legs),
        obstacle_oracle=world.obstacles_at if driver.privileged else None,
        latency=world.latency,
    )
    return Drive(driver, world, checker, task, np.random.default_rng([scenario.seed, *b"pilot"]), raise_errors)


def _trial(scenario: Scenario, attempt: Attempt, drive: Drive, wall: float) -> Trial:
    columns, checker, world = drive.log.columns(), drive.checker, drive.world
    if drive.task.budget == Budget() and not columns["cut"].any():
        columns["cut"] = None  # nothing could have cut it
    assert drive.outcome is not None
    return Trial(
        attempt=attempt,
        **columns,
        spans=tuple(checker.spans),
        events=tuple(checker.events),
        outcome=drive.outcome,
        reason=checker.reason,
        snapshots=tuple(drive.snapshots),
        between=world.between.instants(float(columns["t"][-1])),
        provenance={
            "source": "simulation",
            "clearway": version_of("clearway"),
            "scenario": scenario.name,
            "seed": scenario.seed,
        },
        timing=timing(wall, drive.thinking, attempt.period),
        thinking=thinking_of(drive, columns["t"]),
    )

"""Runs one trial: the world on one side, a pilot on the other, a checker between them."""

from __future__ import annotations

import math
import traceback
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter

import numpy as np

from clearway.contract import Budget, Command, Decision, EventKind, Pilot, Task
from clearway.foreign import said, traced
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.read_only import read_only
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Snapshot, Trial
from clearway.world.behaviours.registry import behaviours_of
from clearway.world.bodies import bodies_of, moving_obstacles_of
from clearway.world.goal_and_progress_checker import GoalAndProgressChecker
from clearway.world.log import Log
from clearway.world.tracks import Tracks, longest, tracks
from clearway.world.world import World

_SAME = 1e-9  # s
SHARP = 0.005
"""Relative error up to which a clairvoyant's limit is one to compare with."""


def simulate(
    scenario: Scenario,
    robot: Robot,
    pilot: Pilot,
    *,
    navigator: str,
    localisation: str,
    map: OccupancyGrid | None,
    privileged: bool = False,
    budget: Budget | None = None,
    real_time: bool = False,
    setup: str | None = None,
    tracking: str = "",
    raise_errors: bool = False,
) -> Trial:
    """Run `scenario` with `robot`, driven by `pilot`.

    Args:
        navigator: Name of the pilot's navigator, for the record.
        localisation: Name of its localiser, for the record.
        map: What the robot is told of the floor, None for nothing.
        privileged: Whether it is told the truth about the obstacles' future.
        budget: Budget of a decision; default: none.
        real_time: Whether time passes while the pilot thinks: its command is followed as much later, and until it has
            decided it is not asked again. The first decision counts as instant: it may load or compile code.
        setup: Name of the budget, for the record.
        tracking: Name of what follows obstacles, for the record.
        raise_errors: Whether an error of the pilot is raised, as a debugger needs it.

    Returns:
        The trial. A pilot that raises, or whose command isn't finite, ends it as `navigator_failed`.

    Raises:
        ClearwayError: the scenario can't be built.
    """
    plan = load_floor_plan(scenario.floor_plan)
    way = tracks(
        moving_obstacles_of(scenario), [leg.name for leg in scenario.legs], longest(scenario.legs), len(scenario.people)
    )
    return simulate_in(
        bodies_of(plan.fixtures, scenario), way, scenario, robot, pilot, navigator=navigator, localisation=localisation,
        map=map, area=plan.area, privileged=privileged, budget=budget, real_time=real_time, setup=setup, tracking=tracking,
        raise_errors=raise_errors,
    )  # fmt: skip


def simulate_in(
    bodies: Sequence[Body],
    tracks: Tracks,
    scenario: Scenario,
    robot: Robot,
    pilot: Pilot,
    *,
    navigator: str,
    localisation: str,
    map: OccupancyGrid | None = None,
    area: tuple[float, float, float, float] | None = None,
    privileged: bool = False,
    budget: Budget | None = None,
    real_time: bool = False,
    setup: str | None = None,
    tracking: str = "",
    raise_errors: bool = False,
) -> Trial:
    """As `simulate`, among `bodies` wherever they come from; `tracks` of those without a pose, in their order; `area`
    as in `Task`."""
    begun = perf_counter()
    start = np.array(scenario.start, dtype=np.float64)
    attempt = attempt_of(
        scenario, robot, bodies, navigator=navigator, localisation=localisation, privileged=privileged, setup=setup,
        tracking=tracking,
    )  # fmt: skip
    placed = _placed(start, scenario)
    world = World(
        robot, placed, scenario.speed, bodies, tracks, scenario.seed, scenario.disturbance, behaviours_of(scenario, bodies),
        [leg.name for leg in scenario.legs], scenario.latency,
    )  # fmt: skip
    checker = GoalAndProgressChecker(attempt.legs, scenario.legs, scenario.livelock, world.state)
    task = Task(
        period=robot.period,
        speed_limit=scenario.speed,
        start=read_only(start),
        map=None if map is None else map.read_only(),
        area=area,
        budget=budget or Budget(),
        time_limit=max(leg.time_limit for leg in scenario.legs),
        obstacle_oracle=world.obstacles_at if privileged else None,
        latency=world.latency,
    )
    drive = _Drive(world, checker, pilot, robot, raise_errors, real_time)
    outcome = drive.to_the_end(task, np.random.default_rng([scenario.seed, *b"pilot"]))
    columns = drive.log.columns()
    if task.budget == Budget() and not columns["cut"].any():
        columns["cut"] = None  # nothing could have cut it
    return Trial(
        attempt=attempt,
        **columns,
        spans=tuple(checker.spans),
        events=tuple(checker.events),
        outcome=outcome,
        reason=checker.reason,
        snapshots=tuple(drive.snapshots),
        between=world.between.instants(),
        provenance={"source": "simulation", "clearway": _version(), "scenario": scenario.name, "seed": scenario.seed},
        timing=_timing(perf_counter() - begun, drive.thinking, robot.period),
    )


class _Drive:
    """The loop over control periods, and what it leaves behind."""

    def __init__(
        self,
        world: World,
        checker: GoalAndProgressChecker,
        pilot: Pilot,
        robot: Robot,
        raise_errors: bool,
        real_time: bool = False,
    ) -> None:
        self._world, self._checker, self._pilot, self._robot = world, checker, pilot, robot
        self._raise_errors, self._real_time = raise_errors, real_time
        self.log = Log(len(world.moving_obstacles))
        self.snapshots: list[Snapshot] = []
        self.thinking: list[float] = []

    def to_the_end(self, task: Task, rng: np.random.Generator) -> Outcome:
        """Drive until the checker ends the trial."""
        world, checker, log, thinking = self._world, self._checker, self.log, self.thinking
        decide, period = self._pilot.decide, self._robot.period
        estimate, command, leg = task.start, Command(0.0, 0.0), 0
        count, t, status, called = 0, 0.0, "", False
        busy = 0.0  # until then the pilot thinks
        touched = world.touching()
        if touched is not None:
            return self._contact(0.0, touched, estimate, command, " where it was placed")
        try:
            self._pilot.reset(task, self._robot, rng)
        except Exception as error:
            if self._raise_errors:
                raise
            return self._failed(0.0, error, estimate, command)
        while True:
            t = count * period
            now, leg = world.state, checker.leg
            asked = t >= busy - _SAME
            if asked:
                sensing = world.sensing(t, checker.goal)
                before = perf_counter()
                try:
                    decision = decide(sensing)
                    thinking.append(perf_counter() - before)
                    estimate, command = _sound(decision, estimate)
                except Exception as error:
                    if self._raise_errors:
                        raise
                    return self._failed(t, error, estimate, command)
                if self._real_time and len(thinking) > 1:
                    busy = t + thinking[-1]
                if decision.diagnostics is not None:
                    self.snapshots.append(Snapshot(t, decision.diagnostics))
                if command.status != status:
                    status = command.status
                    checker.events.append(Event(t, EventKind.STATUS, status))
                checker.events += [Event(t, EventKind.ASSUMPTION, text) for text in command.violated]
                called = checker.called(estimate, command)
                if called:
                    command = replace(command, v=0.0, omega=0.0)
                world.send(command.v, command.omega, t, max(busy - t, 0.0))
            log.add(t, now[:5], estimate, command, leg, world.moving_obstacles)
            outcome = checker.judge(t, now, called, command.gave_up)
            if outcome is not None:
                return outcome
            if checker.leg != leg:
                world.begin_leg(checker.leg, t)
            driven, touched = world.advance(t)
            if touched is not None:
                return self._contact(t + driven, touched, estimate, command)
            count += 1

    def _contact(self, t: float, body: Body, estimate: FloatArray, command: Command, where: str = "") -> Outcome:
        self._record(t, estimate, command)
        own, other = abs(float(self._world.state[3])), self._world.speed_of(body, t)
        return self._checker.stop(
            t, Outcome.COLLISION, EventKind.CONTACT,
            f"{body.kind} {body.name!r} at {other:.3f} m/s, robot at {own:.3f} m/s",
            f"contact with {body.kind} {body.name!r}{where}",
            self._world.bodies.index(body),
        )  # fmt: skip

    def _failed(self, t: float, error: Exception, estimate: FloatArray, command: Command) -> Outcome:
        self._record(t, estimate, command)
        frames = traceback.extract_tb(error.__traceback__)
        place = f" ({frames[-1].filename}:{frames[-1].lineno})" if len(frames) > 1 else ""
        return self._checker.stop(t, Outcome.NAVIGATOR_FAILED, EventKind.ERROR, traced(error), f"{said(error)}{place}")

    def _record(self, t: float, estimate: FloatArray, command: Command) -> None:
        """The last instant, with the estimate and the command that were in force."""
        world = self._world
        self.log.add(t, world.state[:5], estimate, command, self._checker.leg, world.moving_obstacles)


def _sound(decision: Decision, before: FloatArray) -> tuple[FloatArray, Command]:
    """The estimate and the command of a decision that is what it should be.

    Raises:
        TypeError, ValueError: it isn't.
    """
    command, estimate = decision.command, decision.estimate
    if not isinstance(command, Command):
        raise TypeError(f"the navigator answered {command!r}; a Command is expected")
    if not (math.isfinite(command.v) and math.isfinite(command.omega)):
        raise ValueError(f"the command v = {command.v}, omega = {command.omega} is not finite")
    estimate = np.asarray(estimate, dtype=np.float64)
    if estimate.shape != before.shape or not all(map(math.isfinite, estimate.tolist())):
        raise ValueError(f"the estimated pose {estimate!r} is not three finite numbers")
    return estimate, command


def _placed(start: FloatArray, scenario: Scenario) -> FloatArray:
    """Where the robot truly stands: uniformly within the placement error of its start, drawn from the seed."""
    key = stream(scenario.seed, "placement")
    radius = scenario.placement_xy * math.sqrt(uniform(key, 0, 0))
    angle = 2.0 * math.pi * uniform(key, 0, 1)
    turn = scenario.placement_yaw * (2.0 * uniform(key, 0, 2) - 1.0)
    error = (radius * math.cos(angle), radius * math.sin(angle), turn)
    return np.array([a + b for a, b in zip(start.tolist(), error, strict=True)])


def attempt_of(
    scenario: Scenario,
    robot: Robot,
    bodies: Sequence[Body],
    *,
    navigator: str,
    localisation: str,
    privileged: bool = False,
    setup: str | None = None,
    tracking: str = "",
) -> Attempt:
    """What a trial in simulation attempts.

    Args:
        scenario: The test.
        robot: Who is to do it.
        bodies: What it can hit, as `clearway.world.bodies` has it.
        navigator: Who decides, by name.
        localisation: How the robot knows where it is, by name.
        privileged: Whether the navigator is told the truth about the obstacles' future.
        setup: The name of the bound on its thinking, None without one.
        tracking: How obstacles are followed, by name; empty if they aren't.
    """
    optimal = scenario.optimal if scenario.optimal is not None and scenario.optimal.error <= SHARP else None
    legs: list[Leg] = []
    at = np.array(scenario.start, dtype=np.float64)
    for spec in scenario.legs:
        goal = np.array(spec.goal, dtype=np.float64)
        xy, yaw = spec.tolerances(robot.tolerances)
        told = spec.tolerances(robot.planner_tolerances)
        legs.append(Leg(spec.name, at, goal, xy, yaw, spec.scored, spec.time_limit, *told))
        at = goal
    return Attempt(
        labels=Labels(speed=scenario.speed, setup=setup, **scenario.labels.model_dump()),
        robot=robot.name,
        navigator=navigator,
        localisation=localisation,
        footprint=robot.shape,
        legs=tuple(legs),
        bodies=tuple(bodies),
        speed_limit=scenario.speed,
        period=robot.period,
        reference_length=scenario.reference_length,
        floor_plan=scenario.floor_plan,
        scenario=scenario.name,
        seed=scenario.seed,
        privileged=privileged,
        tracking=tracking,
        optimal_time=None if optimal is None else optimal.time,
        shortest_path=scenario.shortest,
        limits=robot.limits(scenario.speed),
        sight=robot.camera.range if robot.camera else robot.lidar.range_max if robot.lidar else None,
    )


def _timing(wall: float, thinking: Sequence[float], period: float) -> dict[str, float]:
    """The trial's wall clock, and that of its decisions but for the first, which may load or compile code."""
    counted = np.array(thinking[1:])
    if not len(counted):
        return {"wall": wall}
    p50, p99 = np.percentile(counted, [50, 99])
    return {
        "wall": wall,
        "decide_count": float(len(counted)),
        "decide_mean": float(counted.mean()),
        "decide_p50": float(p50),
        "decide_p99": float(p99),
        "decide_max": float(counted.max()),
        "decide_overrun": float((counted > period).mean()),
    }


@cache
def _version() -> str:
    try:
        return version("clearway")
    except PackageNotFoundError:
        return "unknown"

"""One robot on its way through a trial: it senses, decides and drives, and a checker says when it is over."""

from __future__ import annotations

import math
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from clearway.contract import Budget, Command, Decision, EventKind, Pilot, Sensing, Task
from clearway.foreign import said, traced
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.robots import Robot
from clearway.trials import Body, Event, Outcome, Snapshot
from clearway.trials.trial import AS_PLACED
from clearway.world.goal_and_progress_checker import GoalAndProgressChecker
from clearway.world.log import Log
from clearway.world.traffic import Traffic
from clearway.world.world import World

_SAME = 1e-9  # s


@dataclass(frozen=True, slots=True, eq=False)
class Driver:
    """A robot of a simulation, and who drives it.

    Attributes:
        robot: The robot.
        pilot: Who drives it.
        navigator: Name of the pilot's navigator, for the record.
        localisation: Name of its localiser, for the record.
        map: What the robot is told of the floor, None for nothing.
        privileged: Whether it is told the truth about the obstacles' future.
        budget: Budget of a decision; default: none.
        real_time: Whether time passes while the pilot thinks: its command is followed as much later, and until it has
            decided it is not asked again. The first decision counts as instant: it may load or compile code.
        setup: Name of the budget, for the record.
        tracking: Name of what follows obstacles, for the record.
    """

    robot: Robot
    pilot: Pilot
    navigator: str
    localisation: str
    map: OccupancyGrid | None = None
    privileged: bool = False
    budget: Budget | None = None
    real_time: bool = False
    setup: str | None = None
    tracking: str = ""


class Drive:
    """The control periods of one robot, and what they leave behind.

    Args:
        driver: Who drives which robot.
        world: The robot's.
        checker: Of its trial.
        task: What the pilot is told.
        rng: What the pilot draws from.
        raise_errors: Whether an error of the pilot is raised.

    Attributes:
        world: As given.
        checker: As given.
        task: As given.
        outcome: How its trial ended; None: it goes on.
        halted: Whether it stands for good.
        log: The samples.
        snapshots: What the navigator showed of its thinking.
        thinking: How long each decision took, s of wall clock.
        thought_at: When each was asked for, s.
    """

    def __init__(
        self, driver: Driver, world: World, checker: GoalAndProgressChecker, task: Task, rng: np.random.Generator,
        raise_errors: bool,
    ) -> None:  # fmt: skip
        self.world, self.checker = world, checker
        self.task, self._rng, self._raise_errors, self._real_time = task, rng, raise_errors, driver.real_time
        self._robot, self._pilot, self._decide, self._period = (
            driver.robot, driver.pilot, driver.pilot.decide, driver.robot.period,
        )  # fmt: skip
        self.outcome: Outcome | None = None
        self.halted = False
        self.log = Log(len(world.moving_obstacles), len(world.motion) - 3)
        self.snapshots: list[Snapshot] = []
        self.thinking: list[float] = []
        self.thought_at: list[float] = []
        self._count, self._busy, self._status, self._called = 0, 0.0, "", False  # busy: until then the pilot thinks
        self._estimate, self._command = task.start, Command(0.0, 0.0)
        self._driven = self._period
        self._touched: Body | None = None

    @property
    def end(self) -> float:
        """When its control period ends, s."""
        return (self._count + 1) * self._period

    def begin(self) -> None:
        """Time 0: the pilot is told its task."""
        self.world.begin()
        touched = self.world.touching()
        if touched is not None:
            self._contact(0.0, 0.0, touched, f" {AS_PLACED}")
            return
        try:
            self._pilot.reset(self.task, self._robot, self._rng)
        except Exception as error:
            self._fail(0.0, error)

    def decide(self) -> None:
        """A control period begins: sense, have the pilot decide, and follow that."""
        decision, sensing = None, self.sense()
        if sensing is not None:
            t, before = self._count * self._period, perf_counter()
            try:
                decision = self._decide(sensing)
                self.thinking.append(perf_counter() - before)
                self.thought_at.append(t)
            except Exception as error:
                self._fail(t, error)
        self.follow(decision)

    def sense(self) -> Sensing | None:
        """With what the pilot is asked as a control period begins; None: it isn't, as it still thinks or the trial is over."""
        t = self._count * self._period
        return self.world.sensing(t, self.checker.goal) if self.outcome is None and t >= self._busy - _SAME else None

    def follow(self, decision: Decision | None) -> None:
        """Say what is to be driven in the control period: None: as in the one before. A robot whose trial is over comes to rest."""
        t = self._count * self._period
        if decision is not None:
            try:
                sound = _sound(decision, self._estimate)
            except Exception as error:
                self._fail(t, error)
            else:
                self._heed(t, decision, *sound)
        if self.outcome is None:
            now, leg, command = self.world.motion, self.checker.leg, self._command
            self.log.add(t, now, self._estimate, command, leg, self.world.moving_obstacles)
            self.outcome = self.checker.judge(t, now, self._called, command.gave_up)
            if self.outcome is None and self.checker.leg != leg:
                self.world.begin_leg(self.checker.leg, t)
        if self.outcome is not None and not self.halted:
            if self.world.stands:
                self._halt(t)
            else:
                self.world.send(0.0, 0.0, t)

    def _heed(self, t: float, decision: Decision, estimate: FloatArray, command: Command) -> None:
        checker = self.checker
        if self._real_time and len(self.thinking) > 1:
            self._busy = t + self.thinking[-1]
        if decision.diagnostics is not None:
            self.snapshots.append(Snapshot(t, decision.diagnostics))
        if command.status != self._status:
            self._status = command.status
            checker.events.append(Event(t, EventKind.STATUS, self._status))
        if command.violated:
            checker.events += [Event(t, EventKind.ASSUMPTION, text) for text in command.violated]
        self._called = checker.called(estimate, command)
        if self._called:
            command = replace(command, v=0.0, omega=0.0, v_y=0.0)
        self._estimate, self._command = estimate, command
        self.world.send(command.v, command.omega, max(self._busy, t), command.v_y)

    def rehearse(self, traffic: Traffic) -> None:
        """Tell all others the way that it would take in its period if nothing else moved."""
        t = self._count * self._period
        traffic.see(self.world.member, t, self._period, self.world.rehearse(t))

    def look(self) -> tuple[float, Body | None]:
        """Drive its period, as often as asked: until when it gets [s], and what it touches there, if anything."""
        t = self._count * self._period
        self._driven, self._touched = self.world.drive(t)
        return t + self._driven, self._touched

    def ride(self) -> Body | None:
        """Drive its period while a crowd decides: what it touches, if anything."""
        self._driven, self._touched = self.world.drive_among(self._count * self._period, self.end)
        return self._touched

    def keep(self) -> None:
        """What it drove when it last looked is what happened."""
        self.world.keep(self._count * self._period, self._driven)
        self._count += 1

    def collide(self, touched: Body, at: float | None = None) -> None:
        """It touches something: where its last look ended, or before, at time `at` [s]; it stays there."""
        t = self._count * self._period
        if at is not None:
            self._driven = min(max(at - t, 0.0), self._period)
            self.world.halt(t, self._driven)
        self.keep()
        if self.outcome is None:
            self._contact(t, self._driven, touched)
        else:
            self._halt(t + self._driven)

    def _contact(self, t: float, driven: float, body: Body, where: str = "") -> None:
        self._record(t + driven)
        own, other = math.hypot(self.world.motion[3], *self.world.motion[5:6]), self.world.speed_of(body, t + driven)
        self.outcome = self.checker.stop(
            t + driven, Outcome.COLLISION, EventKind.CONTACT,
            f"{body.kind} {body.name!r} at {other:.3f} m/s, robot at {own:.3f} m/s",
            f"contact with {body.kind} {body.name!r}{where}",
            self.world.bodies.index(body),
        )  # fmt: skip
        self._halt(t + driven)

    def _fail(self, t: float, error: Exception) -> None:
        if self._raise_errors:
            raise error
        self._record(t)
        frames = traceback.extract_tb(error.__traceback__)
        place = f" ({frames[-1].filename}:{frames[-1].lineno})" if len(frames) > 1 else ""
        self.outcome = self.checker.stop(
            t, Outcome.NAVIGATOR_FAILED, EventKind.ERROR, traced(error), f"{said(error)}{place}"
        )

    def _halt(self, t: float) -> None:
        self.halted = True
        self.world.stay(t)

    def _record(self, t: float) -> None:
        """The last instant, with the estimate and the command that were in force."""
        self.log.add(t, self.world.motion, self._estimate, self._command, self.checker.leg, self.world.moving_obstacles)


def thinking_of(drive: Drive, t: FloatArray) -> FloatArray:
    """(n,) how long the decision at each of `t` (n,) [s] took, as `Trial` has it."""
    out = np.full(len(t), np.nan)
    out[np.searchsorted(t, drive.thought_at[1:])] = drive.thinking[1:]
    return out


def _sound(decision: Decision, before: FloatArray) -> tuple[FloatArray, Command]:
    """The estimate and the command of a decision that is what it should be.

    Raises:
        TypeError, ValueError: it isn't.
    """
    command, estimate = decision.command, decision.estimate
    if not isinstance(command, Command):
        raise TypeError(f"the navigator answered {command!r}; a Command is expected")
    if not (math.isfinite(command.v) and math.isfinite(command.omega) and math.isfinite(command.v_y)):
        raise ValueError(f"the command v = {command.v}, omega = {command.omega}, v_y = {command.v_y} is not finite")
    estimate = np.asarray(estimate, dtype=np.float64)
    if estimate.shape != before.shape or not all(map(math.isfinite, estimate.tolist())):
        raise ValueError(f"the estimated pose {estimate!r} is not three finite numbers")
    return estimate, command


def timing(wall: float, thinking: Sequence[float], period: float) -> dict[str, float]:
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

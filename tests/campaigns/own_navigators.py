"""Navigators for the tests of campaigns: one that drives, and some that misbehave."""

from __future__ import annotations

import math
import time

import numpy as np

from clearway.contract import Command, Observation, Task
from clearway.errors import ClearwayError
from clearway.robots import Robot
from clearway.tuning import TunedOn


class Drives:
    """Turns to the goal and drives there; its rng makes it wobble."""

    needs = frozenset({"scan"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.rng, self.v_max = rng, min(task.speed_limit, robot.drive.v_max)

    def step(self, o: Observation) -> Command:
        dx, dy = o.goal.pose[:2] - o.pose[:2]
        near = math.hypot(dx, dy) < 0.5 * o.goal.xy_tolerance
        error = math.remainder((o.goal.pose[2] if near else math.atan2(dy, dx)) - o.pose[2], math.tau)
        v = 0.0 if near else max(0.0, math.cos(error)) * min(self.v_max, math.hypot(dx, dy))
        return Command(v, max(-1.0, min(1.0, 2 * error)) + 0.02 * self.rng.normal())


class Raises(Drives):
    def step(self, o: Observation) -> Command:
        if o.t > 1.0:
            raise RuntimeError("lost\nthe way")
        return super().step(o)


class NotANumber(Drives):
    def step(self, o: Observation) -> Command:
        return Command(math.nan, 0.0)


class Hangs(Drives):
    def step(self, o: Observation) -> Command:
        while o.t > 1.0:
            time.sleep(0.01)
        return super().step(o)


class Slow(Drives):
    """Takes a few tenths of a second for a trial."""

    def step(self, o: Observation) -> Command:
        time.sleep(0.001)
        return super().step(o)


class Patient(Drives):
    slowest = 9.5


class Alone(Drives):
    alone = "the only stack there is"


class Dodges(Drives):
    """Steers away from what is near, ahead, and in the way: it sees obstacles, no scan."""

    needs = frozenset({"obstacles"})

    def step(self, o: Observation) -> Command:
        assert o.obstacles is not None
        assert o.scan is None
        wanted = super().step(o)
        aside = 0.0
        for (x, y), radius in zip(o.obstacles.position - o.pose[:2], o.obstacles.radius, strict=True):
            gap = math.hypot(x, y) - radius
            bearing = math.remainder(math.atan2(y, x) - o.pose[2], math.tau)
            if gap < 0.8 and abs(bearing) < 1.2:
                aside = max(aside, 0.8 - gap)
        if aside > 0.45:
            return Command(0.0, 0.5)
        return Command(wanted.v * (1.0 - aside), wanted.omega + 2.0 * aside)


class Knows(Dodges):
    """Is told the truth about the obstacles."""

    privileged = True


class Exits(Drives):
    def step(self, o: Observation) -> Command:
        raise SystemExit(3)


class Particular(Drives):
    """Reads parameters, and finds them wrong."""

    def read_parameters(self, robot: Robot) -> None:
        raise ClearwayError("2 is wrong", file="mine", field="braveness")


class Careless(Drives):
    """Has a fault where it reads its parameters."""

    def read_parameters(self, robot: Robot) -> float:
        return float(robot.navigators["careless"]["braveness"])


class Tuned(Drives):
    """Says on what its speed was chosen."""

    tuned_on = (TunedOn("hospital", floor_plan="hall", seeds=(5,), note="its speed"),)


class Mistaken(Drives):
    tuned_on = "hospital"

"""What the tests of hp-st share: its inputs as a navigator makes them, and a small world to drive it in.

Bases, weights and settings are those of a navigator that has been reset, so that a test names only what it changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import perceived
from clearway.contract import Budget, Command, Goal, Observation, Obstacles, Task
from clearway.forecasts.forecast import Forecast
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st import HpSt
from clearway.navigators.hp_st.environment.contact import Base, PredictedObstacles, predicted_obstacles
from clearway.navigators.hp_st.environment.field import make_field
from clearway.navigators.hp_st.search.candidates import distinct
from clearway.navigators.hp_st.search.costs import SearchCosts
from clearway.navigators.hp_st.search.layer import Problem
from clearway.navigators.hp_st.search.search import search
from clearway.navigators.hp_st.search.tree import Tree, leaf, trace
from clearway.navigators.hp_st.ways import Settings
from clearway.robots import Robot, load_robot

RESCUE = load_robot("rescue:unlimited")
"""Takes up what it is told at once, so that what a test expects can be said in closed form."""
PERIOD = RESCUE.period
OWN, OTHER = 0.25, 0.35
"""Radii of the rescue robot and of the suites' obstacles, m."""
SQUARE = np.array([-7.0, -7.0, 7.0, 7.0])
"""As large as the suites' square."""
Path = Callable[[float], tuple[float, float]]


def area(x_min: float, y_min: float, x_max: float, y_max: float) -> FloatArray:
    return np.array([x_min, y_min, x_max, y_max])


@dataclass
class Finder:
    """The search of a navigator for a robot: `look(start, goal)` is a tree with all that it was made of."""

    base: Base
    costs: SearchCosts
    settings: Settings
    obstacles: PredictedObstacles = field(init=False)
    tree: Tree = field(init=False)

    def look(
        self,
        goal: Sequence[float],
        start: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0),
        still: Sequence[Sequence[float]] = (),
        moving_obstacles: Sequence[Path] = (),
        inside: FloatArray = SQUARE,
        beam: int | None = None,
    ) -> Tree:
        """Search from `start` to `goal` past discs `still` (x, y, R) and `moving_obstacles`, whose future is known."""
        forecast = foreseen(still, moving_obstacles, self.settings.period, self.settings.periods)
        grown = forecast.still + np.array([0.0, 0.0, self.base.foot.circumscribed + self.costs.margin])
        distances = make_field(np.array([*goal, 0.0]), grown, inside)
        self.obstacles = predicted_obstacles(forecast, self.settings.spread)
        problem = Problem(
            np.array(start, dtype=np.float64), self.base, self.obstacles, distances, inside, self.costs,
            self.settings.controls, np.zeros((0, 2)),
        )  # fmt: skip
        self.tree = search(problem, self.settings.layers, beam or self.settings.wide, np.inf)
        return self.tree

    def best(self) -> tuple[FloatArray, FloatArray]:
        """States (k + 1, 5) and commands (k, 2) of the best way."""
        return trace(self.tree, *leaf(self.tree))

    def ways(self, most: int = 4) -> list[FloatArray]:
        """States of the best way and of the best of each other topology."""
        ends = distinct(
            self.tree, self.obstacles, self.costs.stride, *leaf(self.tree), most, self.settings.apart
        )  # fmt: skip
        return [trace(self.tree, *end)[0] for end in ends.tolist()]


def finder(robot: Robot = RESCUE, speed: float = 1.0, **options: Any) -> Finder:
    """What `HpSt(**options)` searches with."""
    navigator = HpSt(**options)
    navigator.reset(Task(robot.period, speed, np.zeros(3)), robot, np.random.default_rng(0))
    costs = navigator._wishes._replace(reach=0.1)
    return Finder(navigator._base, costs, navigator._settings)


def foreseen(still: Sequence[Sequence[float]], moving_obstacles: Sequence[Path], step: float, count: int) -> Forecast:
    """The certain future of discs."""
    n, k = len(moving_obstacles), count + 1
    at = np.array([[m(i * step) for i in range(k)] for m in moving_obstacles], dtype=np.float64).reshape(n, 1, k, 2)
    speed = np.hypot(*np.moveaxis(np.diff(at[:, 0], axis=1), 2, 0)).max(axis=1, initial=0.0) / step
    return Forecast(
        step, np.array(still, dtype=np.float64).reshape(-1, 3), at, np.full((n, 1, k), 1e-3), np.ones((n, 1)),
        np.full(n, OTHER), at[:, 0].copy(), np.zeros((n, k)), speed, np.arange(n), np.zeros(n),
    )  # fmt: skip


def line(x: float, y: float, vx: float, vy: float) -> Path:
    return lambda t: (x + vx * t, y + vy * t)


def obstacles(
    position: Any = (),
    radius: Any = OTHER,
    velocity: Any = 0.0,
    error: Any = 0.01,
    moving: Any = True,
    names: Any = None,
) -> Obstacles:
    """As perceived: whatever is given once holds for all."""
    return perceived.obstacles(position, velocity, radius, error=error, identity=names, moving=moving)


def goal(x: float, y: float, tolerance: float = 0.2) -> Goal:
    return Goal(np.array([x, y, 0.0]), tolerance, math.inf)


def observation(
    t: float, pose: Any, aim: Goal, seen: Obstacles | None, velocity: Any = (0.0, 0.0)
) -> Observation:  # fmt: skip
    pose = np.array(pose, dtype=np.float64)
    return Observation(t, pose, np.array(velocity, dtype=np.float64), pose.copy(), aim, obstacles=seen)


def begun(
    robot: Robot = RESCUE, speed: float = 1.0, within: tuple[float, float, float, float] | None = None,
    budget: Budget | None = None, **options: Any,
) -> HpSt:  # fmt: skip
    """A navigator at the beginning of a trial."""
    navigator = HpSt(**options)
    task = Task(robot.period, speed, np.zeros(3), area=within, budget=budget or Budget())
    navigator.reset(task, robot, np.random.default_rng(0))
    return navigator


@dataclass
class Drive:
    """What came of `drive`."""

    poses: list[FloatArray] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    contact: Command | None = None
    arrived: bool = False

    @property
    def violated(self) -> list[str]:
        return [text for c in self.commands for text in c.violated]


def drive(
    navigator: HpSt,
    aim: tuple[float, float],
    look: Callable[[float, FloatArray], Obstacles] = lambda t, pose: obstacles(),
    periods: int = 100,
    start: Sequence[float] = (0.0, 0.0, 0.0),
    push: float = 0.0,
    seed: int = 0,
    touches: Callable[[float, FloatArray], bool] = lambda t, pose: False,
) -> Drive:
    """Drive the rescue robot, which does what it is told at once, until it arrives, is touched, or time is over.

    Args:
        look: what is perceived at a time from a pose. push: radius of the disc [m] and bound [rad] of the displacement
        at the end of each period in which it moves. touches: asked ten times a period.
    """
    rng, target, parts = np.random.default_rng(seed), goal(*aim), 10
    pose, velocity, went = np.array(start, dtype=np.float64), np.zeros(2), Drive()
    for k in range(periods):
        t = k * PERIOD
        command = navigator.step(observation(t, pose, target, look(t, pose.copy()), velocity))
        went.poses.append(pose)
        went.commands.append(command)
        went.arrived = bool(command.arrived)
        if went.arrived:
            break
        for i in range(1, parts + 1):
            between = np.array(arc(*pose, command.v, command.omega, i * PERIOD / parts))
            if touches(t + i * PERIOD / parts, between):
                went.contact = command
                return went
        pose = between
        if command.v != 0.0 or command.omega != 0.0:
            angle, far, turn = rng.uniform(0.0, math.tau), push * math.sqrt(rng.random()), push * rng.uniform(-1, 1)
            pose = pose + np.array([far * math.cos(angle), far * math.sin(angle), turn])
        velocity = np.array([command.v, command.omega])
    return went

"""Tasks and observations for navigators that are asked by wire, without a world."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from clearway.contract import Command, Goal, Navigator, Observation, Obstacles, Scan, Task
from clearway.geometry.grid import OccupancyGrid
from clearway.robots import load_robot

PLANNERS = Path(__file__).with_name("wire_planners.py")


def address(kind: str) -> str:
    """Of one of the planners."""
    return f"exec:{sys.executable} {PLANNERS} {kind}"


def begin(navigator: Navigator, seed: int = 0) -> None:
    """Tell it a task with a map."""
    grid = OccupancyGrid(np.array([[0, 100, -1], [0, 0, 0]], dtype=np.int8), 0.05, (-1.0, 2.0))
    task = Task(0.1, 0.6, np.array([1.0, 2.0, 0.5]), map=grid)
    navigator.reset(task, load_robot("tiago"), np.random.default_rng(seed))


def observations(count: int) -> Iterator[Observation]:
    """What one sees that stands, and is sent to a second goal after half of them."""
    goals = [Goal(np.array([5.0, y, 0.25]), 0.2, math.inf, leg) for leg, y in enumerate((1.0, 2.0))]
    ranges = np.array([1.5, math.inf, 0.1 + 0.2])
    scan = Scan(ranges, -0.5, 0.5, 0.05, 25.0, np.array([0.2, 0.0, 0.0]))
    seen = Obstacles(
        np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[0.1, 0.0], [0.0, -0.1]]), np.array([0.3, 0.4]), np.zeros(2),
        np.array([0.5, math.inf]), np.array([7, 2**40]), np.array([True, False]),
    )  # fmt: skip
    for k in range(count):
        yield Observation(0.1 * k, np.array([0.0, k, 0.5]), np.zeros(2), np.zeros(3), goals[2 * k >= count], scan, seen)


def drive(navigator: Navigator, count: int = 20) -> list[Command]:
    """What it answers."""
    return [navigator.step(observation) for observation in observations(count)]

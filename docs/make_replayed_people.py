"""Makes the recording that comes with the suite `replayed`: two streams of people who cross on an open floor.

    python docs/make_replayed_people.py

They walk by Clearway's own social force and are kept as an overhead camera over a square would see them: 2.5 times a second, to the centimetre.
"""

from __future__ import annotations

import csv
import math
import sys
from importlib import resources
from pathlib import Path
from typing import ClassVar

import numpy as np

import clearway
from clearway.contract import Command, Need, Observation, Task
from clearway.robots import Robot
from clearway.scenarios.people import PersonSpec, StopSpec
from clearway.scenarios.scenario import LegSpec, Scenario

FILE = Path(str(resources.files("clearway.scenarios"))) / "replayed_people" / "crossing.csv"
STREAM, EVERY, FROM, SIDE = 16, 3.4, 7.5, 6.5
"""People in a stream, s from one to the next, m from the middle where they begin, half the edge of what the camera sees, m."""
STEP, SECONDS = 0.4, 66.0


class Stands:
    """A robot that stays away."""

    needs: ClassVar[frozenset[Need]] = frozenset()

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing is to be known."""

    def step(self, observation: Observation) -> Command:
        """It stands."""
        return Command(0.0, 0.0)


def walker(k: int, east: bool) -> PersonSpec:
    """Number `k` of a stream to the east or to the north, which waits for its turn and walks across."""
    side = 0.9 * ((k * 5) % 4 - 1.5) + 0.13 * (k % 3)
    places = [
        (-FROM - 0.8 * k, side),
        (-FROM, side),
        (FROM, side + 0.4 * ((k * 3) % 5 - 2)),
        (FROM + 2.0 + 0.8 * k, side),
    ]
    at = [p if east else (p[1], p[0]) for p in places]
    wait = EVERY * k * (1.0 if east else 1.1)
    return PersonSpec(
        name=f"{'east' if east else 'north'} {k + 1}",
        start=at[0],
        route=(StopSpec(at=at[0], wait=wait), *(StopSpec(at=p) for p in at[1:])),
        sees_robots=False,
        radius=0.25,
    )


def rows() -> list[tuple[float, int, float, float]]:
    """t [s], who, x, y [m], as the file has them."""
    leg = LegSpec(name="away", goal=(-24.0, 0.0, 0.0), time_limit=SECONDS)
    people = tuple(walker(k, east) for k in range(STREAM) for east in (True, False))
    trial = clearway.simulate(
        Scenario(
            name="crossing", floor_plan="open-25", start=(-24.0, -24.0, 0.0), legs=(leg,), speed=0.6, people=people,
            localisation="truth", seed=1,
        ),
        "tiago",
        Stands,
    )  # fmt: skip
    found = []
    for t in np.arange(0.0, trial.t[-1], STEP):
        here = trial.moving_obstacles[int(np.argmin(np.abs(trial.t - t)))]
        for who, (x, y, _) in enumerate(here.tolist(), start=1):
            if max(abs(x), abs(y)) <= SIDE and math.isfinite(x):
                found.append((round(float(t), 1), who, round(x, 2), round(y, 2)))
    return found


if __name__ == "__main__":
    with open(sys.argv[1] if len(sys.argv) > 1 else FILE, "w", newline="", encoding="utf-8") as out:
        csv.writer(out, lineterminator="\n").writerows([("t", "id", "x", "y"), *rows()])

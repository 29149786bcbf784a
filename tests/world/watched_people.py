"""People who are watched while they walk, as the tests of people share them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from worlds import Pilot, body, constant, make_robot, make_scenario, run_among

from clearway.geometry.shapes import FloatArray, rectangle
from clearway.trials import Body, Trial

RULES = ("orca", "social-force", "headed-social-force")
AWAY = (0.0, -20.0, 0.0)
WALL = [body(rectangle(0.2, 6.0), 0.0, 3.6, name="left"), body(rectangle(0.2, 6.0), 0.0, -3.6, name="right")]
"""A wall along y with a door of 1.2 m at the origin."""


def walker(
    name: str, start: tuple[float, float], *route: tuple[float, float], wait: float = 0.0, **more: Any
) -> dict[str, Any]:
    return {"name": name, "start": start, "route": [{"at": p, "wait": wait} for p in route], "speed": 1.2} | more


def watch(
    people: Sequence[dict[str, Any]], seconds: float = 15.0, start: Any = AWAY, pilot: Pilot | None = None,
    walls: Sequence[Body] = (), seed: int = 5, things: Sequence[dict[str, Any]] = (), **robot: Any,
) -> Trial:  # fmt: skip
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": seconds}]
    scenario = make_scenario(people=people, start=start, legs=legs, seed=seed, obstacles=things)
    return run_among(walls, pilot or constant(0.0), scenario, make_robot(**robot))


def nearest(trial: Trial) -> float:
    """The least distance of two people's middles, m."""
    m = trial.moving_obstacles
    pairs = itertools.combinations(range(m.shape[1]), 2)
    return min(float(np.hypot(*(m[:, i, :2] - m[:, j, :2]).T).min()) for i, j in pairs)


def ends(trial: Trial, people: Sequence[dict[str, Any]]) -> FloatArray:
    """How far everybody is from the last place of the route at the end, m."""
    goals = np.array([p["route"][-1]["at"] for p in people])
    return np.hypot(*(trial.moving_obstacles[-1, :, :2] - goals).T)


def lane(width: float) -> list[Body]:
    """Two walls along x, so far apart."""
    return [body(rectangle(40.0, 0.2), 0.0, y, name=f"wall {y}") for y in (0.5 * width + 0.1, -0.5 * width - 0.1)]

"""Draws the suites `sar-team` and `sar-team-held-out`: obstacles as in paper B's confined cases, among which each robot has a start and
a goal of its own.

What each start, goal and obstacle has to keep is kept one after another; the whole is refused where a robot has no way past what stands.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.geometry.streams import stream, uniform
from clearway.robots.robot import RESCUE, load_robot
from clearway.scenarios import sar_rules as rules
from clearway.scenarios.sar_draws import Case, layout_of
from clearway.scenarios.sar_rules import OBSTACLES, RADIUS, Layout
from clearway.scenarios.static_way import static_way
from clearway.stand_ins import stand_ins

TEAM = stand_ins("team")
KINDS = (f"{RESCUE}:scout", f"{RESCUE}:carrier", RESCUE)
"""Who the others are beside a mixed team's first robot, in turn."""
WIDEST = max(circumscribed_radius(load_robot(kind).shape) for kind in KINDS)
"""Radius of the largest of these, m."""
MOST = 8
STREAMS = Case("streams", TEAM["streams"]["static"], TEAM["streams"]["moving"], closing_gap=False, confined=True)
"""Of the suite that is held out: every second robot starts at the one side of the square, the others at the opposite one, and all cross."""
_DRAWS, _TRIES = 200, 2000
_Point = tuple[float, float]
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True, eq=False)
class TeamLayout:
    """What is drawn.

    Attributes:
        ends: Start and goal of each robot, m.
        layout: The obstacles.
    """

    ends: tuple[tuple[_Point, _Point], ...]
    layout: Layout


def draw(case: Case, robots: int, seed: int, kind: str = "held out") -> TeamLayout:
    """The scenario of `case` for so many `robots` that `seed` gives; `kind` names a family of its own for the same seeds.

    Raises:
        ClearwayError: none of very many draws holds what it must.
    """
    key = stream(seed, f"team of {robots}, {case.name}, {kind}")
    for attempt in range(_DRAWS):
        found = _attempt(case, robots, (uniform(key, attempt, i) for i in itertools.count()))
        if found is not None:
            return found
    raise ClearwayError(
        f"{case.name} with {robots} robots, seed {seed}: none of {_DRAWS} draws is solvable", field="seeds"
    )


def _attempt(case: Case, robots: int, u: Iterator[float]) -> TeamLayout | None:
    ends = _ends(robots, u, case == STREAMS)
    if ends is None:
        return None
    starts, goals = ([list(end[k]) for end in ends] for k in range(2))
    still = _one_by_one(case.static, lambda _: _static(u), lambda at, placed: _is_clear(at, placed, starts + goals))
    if still is None:
        return None
    single = replace(case, static=0, moving=1)
    moving = _one_by_one(
        case.moving,
        lambda _: layout_of(single, np.array([next(u) for _ in range(7)])),
        lambda one, placed: (
            not rules.leavers(one).any() and _is_clear(one.start[0], [*still, *(p.start[0] for p in placed)], starts)
        ),
    )
    if moving is None or not _solvable(ends, np.array(still)):
        return None
    start, velocity, attraction, stiffness = (
        np.concatenate([getattr(one, part) for one in moving])
        for part in ("start", "velocity", "attraction", "stiffness")
    )
    return TeamLayout(ends, Layout(np.array(still), start, velocity, attraction, stiffness))


def _ends(robots: int, u: Iterator[float], streams: bool) -> tuple[tuple[_Point, _Point], ...] | None:
    low, high = TEAM["margin"], rules.SIZE - TEAM["margin"]
    band = TEAM["streams"]["band"]

    def anywhere() -> tuple[_Point, _Point]:
        x, y, to_x, to_y = (round(low + (high - low) * next(u), 4) for _ in range(4))
        return (x, y), (to_x, to_y)

    def across(placed: int) -> tuple[_Point, _Point]:
        y, to_y = (round(low + (high - low) * next(u), 4) for _ in range(2))
        x, to_x = round(low + band * next(u), 4), round(high - band * next(u), 4)
        return ((x, y), (to_x, to_y)) if placed % 2 == 0 else ((to_x, to_y), (x, y))

    def fits(end: tuple[_Point, _Point], placed: list[tuple[_Point, _Point]]) -> bool:
        near = (math.dist(a, b) < TEAM["apart"] for other in placed for a, b in zip(end, other, strict=True))
        return math.dist(*end) >= TEAM["way"] and not any(near)

    found = _one_by_one(robots, lambda placed: across(placed) if streams else anywhere(), fits)
    return None if found is None else tuple(found)


def _static(u: Iterator[float]) -> FloatArray:
    low, high = OBSTACLES["region"]
    return np.round([low + (high - low) * next(u) for _ in range(2)], 4)


def _one_by_one(count: int, one: Callable[[int], _T], fits: Callable[[_T, list[_T]], bool]) -> list[_T] | None:
    """`count` draws of `one`, which is told how many there are, each of which fits beside those before; None if no more fits."""
    placed: list[_T] = []
    for _ in range(count):
        found = next((drawn for drawn in (one(len(placed)) for _ in range(_TRIES)) if fits(drawn, placed)), None)
        if found is None:
            return None
        placed.append(found)
    return placed


def _is_clear(at: FloatArray, placed: list[FloatArray], ends: list[list[float]]) -> bool:
    """Whether an obstacle at `at` (2,) overlaps none of those `placed` and leaves room at the `ends`."""
    others = np.array(placed).reshape(-1, 2)
    return bool(
        (np.hypot(*(others - at).T) >= 2.0 * RADIUS).all()
        and (np.hypot(*(np.array(ends) - at).T) >= TEAM["clear"] + RADIUS).all()
    )


def _solvable(ends: tuple[tuple[_Point, _Point], ...], still: FloatArray) -> bool:
    """Whether the widest of the robots has a way from each start to its goal past what stands."""
    discs = np.column_stack([still, np.full(len(still), WIDEST + RADIUS)])
    return all(static_way(np.array(a), np.array(b), discs, rules.AREA) is not None for a, b in ends)

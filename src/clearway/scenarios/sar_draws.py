"""Draws search-and-rescue scenarios until one holds what it must: the generator behind the suites `sar-*`.

Every number comes from a stream keyed by (what is drawn, seed), draw by draw, so that a seed gives the same scenario for
ever, whichever others are drawn. Drawn numbers are rounded to 0.1 mm before they are used: files of them stay small.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clearway.clairvoyant.space_time import shortest
from clearway.errors import ClearwayError
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import bits, stream, uniform
from clearway.scenarios import sar_rules as rules
from clearway.scenarios.sar_motions import misspecified
from clearway.scenarios.sar_rules import OBSTACLES, Layout
from clearway.scenarios.scenario import OptimalSpec
from clearway.scenarios.static_way import static_way

DRAWS = 50_000
"""So many draws are tried for one scenario before the generator gives up."""
SECONDS = 60.0
"""A clairvoyant at 1 m/s that hasn't arrived by then counts as stuck, s; the straight way takes 15 s."""
_ROUNDS = 64


@dataclass(frozen=True, slots=True)
class Case:
    """One of paper B's cases, or a harder one.

    Attributes:
        name: Name of the batch.
        static: How many obstacles stand.
        moving: How many obstacles move.
        closing_gap: Whether two of them close in on the robot's way.
        confined: Whether the whole swing stays in the square and near its attraction; else literal, which lets an
            obstacle swing far out of it.
        speed: Set speed, m/s.
        misspecified: Whether obstacles move as no forecast models it (`sar_motions`).
        one_by_one: Whether what an obstacle has to keep on its own is drawn until it is kept, obstacle by obstacle,
            before layouts are refused for the rest: the same distribution, in reach for crowds.
    """

    name: str
    static: int
    moving: int
    closing_gap: bool
    confined: bool = False
    speed: float = rules.SPEED
    misspecified: bool = False
    one_by_one: bool = False

    @property
    def seconds(self) -> float:
        """A clairvoyant that hasn't arrived by then counts as stuck, s."""
        return SECONDS / self.speed

    @property
    def numbers(self) -> int:
        """How many numbers a layout takes."""
        return 2 * self.static + 7 * self.moving


_CALM: float = rules.HARDER["speed"]
_CROWD: tuple[int, int] = (rules.HARDER["static"], rules.HARDER["moving"])
CASES = {
    case.name: case
    for case in (
        Case("case 1", 6, 5, closing_gap=False),
        Case("case 2", 8, 8, closing_gap=True),
        Case("case 1 confined", 6, 5, closing_gap=False, confined=True),
        Case("case 2 confined", 8, 8, closing_gap=True, confined=True),
        Case("case 3", *_CROWD, closing_gap=True, confined=True, speed=_CALM, one_by_one=True),
        Case("stress", 8, 8, closing_gap=True, speed=_CALM),
        Case("misspecified", 8, 8, closing_gap=True, misspecified=True),
    )
}


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A scenario's obstacles.

    Attributes:
        seed: Seed that they were drawn from.
        layout: Where they are and how they move.
        optimal: The clairvoyant's limit.
        refused: Why earlier draws were refused, and how many of them.
    """

    seed: int
    layout: Layout
    optimal: OptimalSpec
    refused: dict[str, int] = field(default_factory=dict)

    @property
    def draws(self) -> int:
        """How many draws it took."""
        return sum(self.refused.values()) + 1


def generate(case: Case, seed: int, kind: str = "held out") -> Drawn:
    """The scenario of `case` that `seed` gives; `kind` names a family of its own for the same seeds (the frozen ones').

    Raises:
        ClearwayError: none of very many draws holds what it must.
    """
    key = stream(seed, f"{case.name}, {kind}")
    refused: Counter[str] = Counter()
    for attempt in range(DRAWS):
        found = examine(case, draw(case, key, attempt), np.uint64(bits(key, attempt, case.numbers)))
        if not isinstance(found, str):
            return Drawn(seed, *found, dict(refused))
        refused[found] += 1
    why = ", ".join(f"{reason} {100 * n / DRAWS:.1f} %" for reason, n in refused.most_common())
    raise ClearwayError(
        f"{case.name}, seed {seed}: none of {DRAWS} draws makes a solvable scenario ({why})", field="seeds"
    )


def draw(case: Case, key: np.uint64, attempt: int) -> Layout:
    """One draw, good or bad."""
    if not case.one_by_one:
        return layout_of(case, _uniforms(key, attempt, case.numbers))
    u = _uniforms(key, _ROUNDS * attempt, case.numbers)
    layout = layout_of(case, u)
    for again in range(1, _ROUNDS):
        bad = np.concatenate([np.repeat(rules.crowding(layout.static), 2), np.repeat(_strays(case, layout), 7)])
        if not bad.any():
            break
        u = np.where(bad, _uniforms(key, _ROUNDS * attempt + again, len(u)), u)
        layout = layout_of(case, u)
    return layout


def _strays(case: Case, layout: Layout) -> npt.NDArray[np.bool_]:
    """(m,) which of the moving ones break a rule that has nothing to do with the others."""
    crowding = rules.crowding(layout.start)
    return crowding | rules.leavers(layout) if case.confined else crowding


def layout_of(case: Case, u: FloatArray) -> Layout:
    """The layout that the numbers `u` from (0, 1) stand for."""
    n, m = case.static, case.moving
    low, high = OBSTACLES["region"]
    span = high - low
    static = low + span * u[: 2 * n].reshape(n, 2)
    u = u[2 * n :].reshape(m, 7)
    attraction, start = low + span * u[:, 0:2], low + span * u[:, 2:4]
    if case.confined:
        near = np.maximum(attraction - OBSTACLES["confined"], low), np.minimum(attraction + OBSTACLES["confined"], high)
        start = near[0] + (near[1] - near[0]) * u[:, 2:4]
    velocity = OBSTACLES["speed"] * (2.0 * u[:, 4:6] - 1.0)
    static, attraction, start, velocity = (np.round(v, 4) for v in (static, attraction, start, velocity))
    stiffness = 0.2 * (1.0 + 4.0 * u[:, 6:7]) / (OBSTACLES["span"] + np.abs(start - attraction))
    return Layout(static, start, velocity, attraction, np.round(stiffness, 6))


@kernel
def _uniforms(key: np.uint64, attempt: int, count: int) -> FloatArray:
    """The numbers of one draw, from (0, 1)."""
    u = np.empty(count)
    for i in range(count):
        u[i] = uniform(key, attempt, i)
    return u


def examine(case: Case, layout: Layout, key: np.uint64) -> tuple[Layout, OptimalSpec] | str:
    """A layout that holds what it must and the clairvoyant's limit of it, else the first reason why it doesn't.

    Args:
        key: Of the stream for what is drawn only now: misspecified motions, with which the layout is returned.
    """
    if rules.overlaps(layout):
        return "overlap"
    if rules.crowds_an_end(layout):
        return "start or goal crowded"
    if case.confined and rules.leavers(layout).any():
        return "leaves the arena"
    path = static_path(layout)
    if path is None:
        return "no static way"
    if case.misspecified:
        layout = misspecified(layout, path, key)
    if case.closing_gap and rules.closing_gap(layout, path, case.speed) is None:
        return "no closing gap"
    limit = clairvoyant(layout, case)
    return "not solvable" if limit is None else (layout, limit)


def static_path(layout: Layout) -> FloatArray | None:
    """(k, 2) the shortest way from start to goal past what stands alone; None if there is none."""
    return static_way(rules.START, rules.GOAL, inflated(layout.static), rules.AREA)


def inflated(at: FloatArray) -> FloatArray:
    """(n, 3) the discs that the robot's centre must not enter around obstacles at `at` (n, 2)."""
    return np.column_stack([at, np.full(len(at), rules.APART)])


def clairvoyant(layout: Layout, case: Case) -> OptimalSpec | None:
    """The best that one who knows the future can do at the case's set speed; None if even that doesn't arrive."""
    m = len(layout.start)
    found = shortest(
        rules.START,
        rules.GOAL,
        goal_radius=rules.TOLERANCE,
        v_max=case.speed,
        static=inflated(layout.static),
        moving=np.ascontiguousarray(layout.motion(case.seconds)[:, :, :2]),
        radii=np.full(m, rules.APART),
        dt=rules.SAMPLE,
        area=rules.AREA,
        horizon=case.seconds,
    )
    if found is None:
        return None
    return OptimalSpec(time=round(found.time, 4), path=round(found.length, 4), error=math.ceil(1e5 * found.error) / 1e5)

"""Draws more worlds of DynaBARN's kind: the generator behind the suites `dynabarn` and `dynabarn-held-out`.

The rule is that of the authors' program (`aninair1905/DynaBARN` at 791d977): a cylinder crosses a rectangle along a polynomial through
points of a grid of 1 m, from one place of its border to another, at a speed that is drawn anew from key frame to key frame. With which
arguments the published worlds were made is not said; those here were read off them (DECISIONS.md). Every number comes from a stream
keyed by (geometry, kind, seed), so that a seed gives the same world for ever.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.quantities import PoseSpec
from clearway.scenarios.spline import SHORTEST_ROUND, SOONEST, Keyframe, SplineSpec, knots

ACROSS = 10
"""Key frames of each way that lie at equal distances along x, from edge to edge."""
STEP = 0.1
"""Between two speeds at which a cylinder may go, m/s."""
_TRIES = 1000
_SAME = 1e-6
"""What differs by less than this is rounding, m."""
Keyframes = tuple[Keyframe, ...]
_Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Kind:
    """How many cylinders there are, and how they go.

    Attributes:
        name: Of the batch.
        cylinders: The least and the most in a world.
        order: Of their polynomials, the same.
        speed: The lowest [m/s] and one above the highest; between them in steps of `STEP`.
        spread: The least and the most standard deviation of a cylinder's speed, m/s.
    """

    name: str
    cylinders: tuple[int, int]
    order: tuple[int, int]
    speed: tuple[float, float]
    spread: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Geometry:
    """What tells one of the suites from the other.

    Attributes:
        suite: Its name.
        title: Of its floor.
        half: Half the edges of the rectangle that the cylinders cross along x and y, whole metres.
        beyond: So far around it lies the edge of the floor, which no cylinder reaches, m.
        radius: Of the cylinders, m.
        kinds: By which worlds are drawn.
    """

    suite: str
    title: str
    half: tuple[int, int]
    beyond: float
    radius: float
    kinds: tuple[Kind, ...]

    @property
    def start(self) -> PoseSpec:
        """Of the robot, 1 m outside of the rectangle."""
        return (self.half[0] + 1.0, 0.0, 3.14)

    @property
    def goal(self) -> PoseSpec:
        """Straight ahead, 1 m inside of the opposite edge, as the runner sends it; the heading never matters, as a run ends before."""
        return (1.0 - self.half[0], 0.0, 0.0)

    @property
    def length(self) -> float:
        """The way that the score is reckoned by, m: straight from the start to the goal."""
        return 2.0 * self.half[0]

    @property
    def edge(self) -> tuple[float, float]:
        """Of the floor, from its middle along x and y, m: no cylinder leaves it."""
        return (self.half[0] + self.beyond, self.half[1] + self.beyond)


PUBLISHED = Geometry(
    "dynabarn",
    "DynaBARN, open floor",
    (10, 10),
    4.0,
    0.5,
    (
        Kind("easy", (5, 14), (1, 2), (0.5, 1.0), (0.0, 0.1)),
        Kind("medium", (15, 19), (3, 4), (1.0, 1.5), (0.05, 0.25)),
        Kind("hard", (20, 24), (4, 5), (1.5, 2.0), (0.05, 0.35)),
    ),
)
HELD_OUT = Geometry(
    "dynabarn-held-out",
    "DynaBARN, open floor, held out",
    (8, 12),
    4.0,
    0.35,
    (
        Kind("easy", (11, 14), (1, 2), (0.25, 0.75), (0.0, 0.1)),
        Kind("medium", (17, 20), (3, 4), (0.75, 1.25), (0.05, 0.25)),
        Kind("hard", (22, 25), (4, 5), (1.25, 1.75), (0.05, 0.35)),
    ),
)
"""Shorter and wider; speeds halfway between those of neighbouring kinds, where standing is the lowest; so many for each square metre as halfway
between them and above; thinner cylinders."""


def draw(geometry: Geometry, kind: Kind, seed: int, family: str = "held out") -> tuple[Keyframes, ...]:
    """The key frames of each cylinder of the world that `seed` gives; `family` names worlds of their own for the same seeds.

    Raises:
        ClearwayError: none of very many draws makes a way that stays on the floor.
    """
    key = stream(seed, f"{geometry.suite} {kind.name} {family}")
    count = _whole(uniform(key, 0, 0), kind.cylinders)
    found = []
    for cylinder in range(1, count + 1):
        u = (uniform(key, cylinder, i) for i in itertools.count())
        ways = (_way(geometry, kind, u) for _ in range(_TRIES))
        way = next((way for way in ways if way is not None), None)
        if way is None:
            raise ClearwayError(f"{geometry.suite}, {kind.name}, seed {seed}: no way stays on the floor", field="seeds")
        found.append(way)
    return tuple(found)


def _way(geometry: Geometry, kind: Kind, u: Iterator[float]) -> Keyframes | None:
    """The key frames of a cylinder; None if it does what none of Clearway's may."""
    points = _points(geometry.half, _whole(next(u), kind.order), u)
    if points is None:
        return None
    if next(u) < 0.5:
        points.reverse()
    times = _times(points, kind, u)
    frames = tuple((round(t, 2), round(x, 2), round(y, 2)) for t, (x, y) in zip(times, points, strict=True))
    soonest = min(b[0] - a[0] for a, b in itertools.pairwise(frames))
    if soonest < SOONEST or frames[-1][0] < SHORTEST_ROUND:
        return None
    motion = SplineSpec(kind="spline", keyframes=frames)
    far = np.nanmax(np.abs(knots(motion, motion.period)[:, 1:]), axis=0)
    return frames if (far < np.array(geometry.edge) - geometry.radius).all() else None


def _points(half: tuple[int, int], order: int, u: Iterator[float]) -> list[_Point] | None:
    """Places along a polynomial of this order within the rectangle, from border to border along x; None: there is no polynomial."""
    a, b = half
    drawn = [(float(_whole(next(u), (-a, a))), float(_whole(next(u), (-b, b)))) for _ in range(order + 1)]
    drawn = list(dict.fromkeys(drawn))
    if not any(x for x, _ in drawn):
        return None
    x, y = np.array(drawn).T
    polynomial = np.polyfit(x, y, order, full=True)[0]  # two points above each other: the nearest to both
    even = [(float(x), float(np.polyval(polynomial, x))) for x in np.linspace(-a, a, ACROSS)]
    ends = [(x, y) for y in (-float(b), float(b)) for x in _crossings(polynomial, y)]
    inside = [p for p in (*even, *drawn, *ends) if abs(p[0]) <= a + _SAME and abs(p[1]) <= b + _SAME]
    # A drawn point on the border stands there twice, as it is also computed: where it is alone, the way is closed.
    border = sorted(p for p in inside if abs(p[0]) > a - _SAME or abs(p[1]) > b - _SAME)
    while len(border) < 2:
        border.append(_on_border(half, u))
    within = sorted(p for p in inside if abs(p[0]) <= a - _SAME and abs(p[1]) <= b - _SAME)
    return [border[0], *within, border[-1]]


def _crossings(polynomial: FloatArray, y: float) -> list[float]:
    """Where the polynomial is `y`, if it is as often as its order."""
    roots = np.roots(np.polysub(polynomial, [y]))
    return [float(x) for x in roots.real] if (np.abs(roots.imag) < _SAME).all() else []


def _on_border(half: tuple[int, int], u: Iterator[float]) -> _Point:
    across, side, place = (next(u) for _ in range(3))
    first = 0 if across < 0.5 else 1
    ends = (-half[first] if side < 0.5 else half[first], half[1 - first] * (2.0 * place - 1.0))
    return (ends[0], ends[1]) if first == 0 else (ends[1], ends[0])


def _times(points: Sequence[_Point], kind: Kind, u: Iterator[float]) -> list[float]:
    """When a cylinder is at each of them, s."""
    low, high = kind.speed
    speeds = low + STEP * np.arange(round((high - low) / STEP))
    mean = round((low + (high - low) * next(u)) / STEP) * STEP
    spread = max(kind.spread[0] + (kind.spread[1] - kind.spread[0]) * next(u), 0.01)
    share = np.exp(-0.5 * ((speeds - mean) / spread) ** 2)
    upto = np.cumsum(share / share.sum())
    times = [0.0]
    for p, q in itertools.pairwise(points):
        speed = speeds[min(int(np.searchsorted(upto, next(u))), len(speeds) - 1)]
        times.append(times[-1] + math.dist(p, q) / float(speed))
    return times


def _whole(u: float, between: tuple[int, int]) -> int:
    """One of the whole numbers from the first to the last, each as likely, by `u` from (0, 1)."""
    return between[0] + int(u * (between[1] - between[0] + 1))

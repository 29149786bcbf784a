"""Small plans of the floor for print: A to B from left to right, to scale, labels in metres from A and to the left."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from clearway.geometry.shapes import Circle, Polygon, Shape, rectangle
from clearway.recordings.lab.test_plan import PlacedSpec, TestPlan
from clearway.recordings.protocol.line import Line, metres
from clearway.scenarios.scenario import RunSpec

WIDTH, HEIGHT = 118.0, 52.0
"""Room for a sketch, mm."""
MARGIN = 9.0
"""Room around everything in a sketch, mm."""
LARGEST = 30.0
"""mm of paper for a metre of floor, at most."""
SMALLEST = 0.9
"""Edge of the smallest obstacle that can be seen in print, mm."""


@dataclass(frozen=True, slots=True)
class Mark:
    """Something in a sketch. Lengths are mm on paper, y down.

    Attributes:
        kind: `body`, `way` or `way back`.
        points: Its polygon or line, as SVG writes points.
        x: Where it stands or starts, mm.
        y: Where it stands or starts, mm.
        label: What is written beside it.
        label_x: Where the label is anchored, mm.
        label_y: Where the label is anchored, mm.
        anchor: Whether the label begins there, has its middle there or ends there, as SVG's `text-anchor`.
    """

    kind: str
    points: str
    x: float
    y: float
    label: str
    label_x: float
    label_y: float
    anchor: str


@dataclass(frozen=True, slots=True)
class Sketch:
    """A small plan of the floor. Lengths are mm on paper, y down.

    Attributes:
        width: Its width, mm.
        height: Its height, mm.
        a: Where A lies, mm.
        b: Where B lies, mm.
        marks: What is on it.
        metre: Length of a metre on it, mm.
    """

    width: float
    height: float
    a: tuple[float, float]
    b: tuple[float, float]
    marks: tuple[Mark, ...]
    metre: float


def sketch(plan: TestPlan, line: Line, placed: Sequence[PlacedSpec], runs: Sequence[tuple[str, RunSpec]]) -> Sketch:
    """A to B from left to right, to scale; labels are metres from A and to the left."""
    bodies = []
    for o in placed:
        assert o.pose is not None
        spec = plan.bodies[o.body].shape
        bodies.append((line.seen(o.pose), math.radians(line.turned(o.pose[2])), None if spec is None else spec.shape()))
    ways = [[line.seen(p) for p in run.path] for _, run in runs]
    seen = [(0.0, 0.0), line.seen(line.b), *(at for at, _, _ in bodies), *(p for way in ways for p in way)]
    x0, x1 = min(p[0] for p in seen), max(p[0] for p in seen)
    y0, y1 = min(p[1] for p in seen), max(p[1] for p in seen)
    scale = min((WIDTH - 2 * MARGIN) / max(x1 - x0, 0.1), (HEIGHT - 2 * MARGIN) / max(y1 - y0, 0.1), LARGEST)
    width, height = (x1 - x0) * scale + 2 * MARGIN, (y1 - y0) * scale + 2 * MARGIN

    def to_page(p: tuple[float, float]) -> tuple[float, float]:
        return round((p[0] - x0) * scale + MARGIN, 2), round((y1 - p[1]) * scale + MARGIN, 2)

    marks = []
    for i, (at, turned, shape) in enumerate(bodies):
        outline = _outline(shape, SMALLEST / scale)
        c, s = math.cos(turned), math.sin(turned)
        corners = [to_page((at[0] + c * x - s * y, at[1] + s * x + c * y)) for x, y in outline]
        x, y = to_page(at)
        reach = max(max(abs(u - x), abs(v - y)) for u, v in corners)
        below = _beside((x, y), reach, [to_page(b[0]) for b in bodies], i)
        marks.append(Mark("body", _points(corners), x, y, place(at), *below))
    for (_, run), way in zip(runs, ways, strict=True):
        x, y = to_page(way[0])
        anchor = "start" if x < 2 * MARGIN else "end" if x > width - 2 * MARGIN else "middle"
        aside = {"start": -1.2, "middle": 0.0, "end": 1.2}[anchor]
        southern = way[0][1] < way[-1][1] - 1e-6
        label_y = y + 4.0 if southern else y - 2.0
        marks.append(
            Mark("way", _points(map(to_page, way)), x, y, f"{run.leg}: {place(way[0])}", x + aside, label_y, anchor)
        )
    a, b = to_page((0.0, 0.0)), to_page(line.seen(line.b))
    return Sketch(round(width, 1), round(height, 1), a, b, tuple(marks), round(scale, 3))


def place(at: Sequence[float]) -> str:
    """Metres from A and to the left, as they stand on paper."""
    return f"{metres(at[0])} | {metres(at[1])}".replace("-", "\N{MINUS SIGN}")


def _beside(
    at: tuple[float, float], reach: float, everything: Sequence[tuple[float, float]], i: int
) -> tuple[float, float, str]:
    """Where the label of the i-th obstacle goes: below it; away from its neighbours; beside it if they stand across."""
    others = [p for j, p in enumerate(everything) if j != i]
    if any(abs(p[0] - at[0]) < 1 for p in others):
        return at[0] + reach + 1.2, at[1] + 1, "start"
    if not others:
        return at[0], at[1] + reach + 3.4, "middle"
    left = all(at[0] < p[0] for p in others)
    return at[0] + (reach if left else -reach), at[1] + reach + 3.4, "end" if left else "start"


def _outline(shape: Shape | None, least: float) -> Sequence[tuple[float, float]]:
    match shape:
        case Polygon(vertices=vertices):
            reach = max(max(abs(x), abs(y)) for x, y in vertices)
            grow = max(1.0, least / 2 / reach)
            return [(x * grow, y * grow) for x, y in vertices]
        case Circle(radius=radius):
            r = max(radius, least / 2)
            return [(r * math.cos(k * math.tau / 24), r * math.sin(k * math.tau / 24)) for k in range(24)]
        case _:
            return rectangle(least, least).vertices


def _points(points: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)

"""What an edge of a route costs: Nav2's edge scorers, whose costs are added up, and their parameters.

Behaviour read from ros-navigation/navigation2: nav2_route/src/edge_scorer.cpp, src/plugins/edge_cost_functions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar, NamedTuple, Protocol

from pydantic import Field

from clearway.errors import ClearwayError, shown
from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.routes.cells import Ground, along_edge
from clearway.navigators.nav2.routes.graph import Edge, Graph
from clearway.quantities import Finite, NonNegative, Positive, Whole


class InvalidUse(Exception):
    """A scorer is asked for what it can't tell."""


class DistanceScorer(Group):
    """`nav2_route::DistanceScorer`: an edge's length, divided by what its metadata say of its speed."""

    speed_tag: str = Field(default="speed_limit", description="name of the speed in an edge's metadata, 1 without it")
    weight: NonNegative = Field(default=1.0, description="by which it is multiplied")


class TimeScorer(Group):
    """`nav2_route::TimeScorer`: how long an edge takes, as its metadata tell, or at its speed."""

    speed_tag: str = Field(default="abs_speed_limit", description="name of the speed in an edge's metadata, m/s")
    time_tag: str = Field(default="abs_time_taken", description="name of the time in an edge's metadata, s")
    weight: NonNegative = Field(default=1.0, description="by which it is multiplied")
    max_vel: Positive = Field(default=0.5, description="speed on edges that have neither, m/s")


class PenaltyScorer(Group):
    """`nav2_route::PenaltyScorer`: what an edge's metadata say."""

    penalty_tag: str = Field(default="penalty", description="name of the penalty in an edge's metadata, 0 without it")
    weight: NonNegative = Field(default=1.0, description="by which it is multiplied")


class CostmapScorer(Group):
    """`nav2_route::CostmapScorer`: the highest or the mean cost of the global costmap along an edge."""

    use_maximum: bool = Field(default=True, description="whether the highest cost counts, and not the mean")
    invalid_on_collision: bool = Field(default=True, description="whether an edge with `max_cost` on it is closed")
    invalid_off_map: bool = Field(default=True, description="whether an edge that ends off the costmap is closed")
    max_cost: Positive = Field(default=253.0, description="cost that counts as 1; 255 closes no edge")
    check_resolution: Whole = Field(default=2, ge=1, description="of how many cells along an edge one is looked at")
    weight: NonNegative = Field(default=1.0, description="by which it is multiplied")

    IGNORED: ClassVar[dict[str, str]] = {"costmap_topic": "edges are looked up on the global costmap"}


class DynamicEdgesScorer(Group):
    """`nav2_route::DynamicEdgesScorer`: edges that are closed or priced by a service, which nobody calls: it adds nothing."""


class _OrientationScorer(Group):
    orientation_tolerance: Finite = Field(default=math.pi / 2.0, description="turn from which on it is closed, rad")
    orientation_weight: NonNegative = Field(default=1.0, description="by which the turn is multiplied, 1/rad")
    use_orientation_threshold: bool = Field(default=False, description="whether an edge may be closed")


class GoalOrientationScorer(_OrientationScorer):
    """`nav2_route::GoalOrientationScorer`: how far an edge to the last node is turned from the goal's heading."""


class StartPoseOrientationScorer(_OrientationScorer):
    """`nav2_route::StartPoseOrientationScorer`: how far an edge from the first node is turned from the start's heading."""


class Ask(NamedTuple):
    """What a route is asked for.

    Attributes:
        first: Index of its first node.
        last: Index of its last node.
        start: (3,) the pose that it begins at, None: nodes are given.
        goal: (3,) the pose that it ends at, likewise.
        ground: The costmap with the graph's nodes.
    """

    first: int
    last: int
    start: FloatArray | None
    goal: FloatArray | None
    ground: Ground


class Scorer(Protocol):
    """Part of an edge's cost."""

    def score(self, edge: Edge, ask: Ask) -> float | None:
        """Its part, not below 0; None: the edge is closed."""


class _Fixed:
    """Costs that depend on nothing but the graph."""

    def __init__(self, costs: Iterable[float]) -> None:
        self._costs = tuple(costs)

    def score(self, edge: Edge, ask: Ask) -> float | None:
        """See `Scorer`."""
        return self._costs[edge.number]


class _OnCostmap:
    def __init__(self, parameters: CostmapScorer) -> None:
        self._parameters = parameters

    def score(self, edge: Edge, ask: Ask) -> float | None:
        """See `Scorer`."""
        p = self._parameters
        closing = p.max_cost if p.invalid_on_collision and p.max_cost != 255.0 else math.inf
        (ax, ay), (bx, by) = ask.ground.places[edge.start], ask.ground.places[edge.end]
        count, highest, total = along_edge(
            ask.ground.cost, ask.ground.frame, ax, ay, bx, by, p.check_resolution, closing
        )
        if count < 0:
            return None
        if count == 0:
            return None if p.invalid_off_map else 0.0
        return p.weight * (highest if p.use_maximum else total / count) / p.max_cost


class _Turned:
    """How far the first or the last edge is turned from a pose."""

    def __init__(self, parameters: _OrientationScorer, graph: Graph, *, at_goal: bool) -> None:
        self._parameters, self._places, self._at_goal = parameters, graph.places, at_goal

    def score(self, edge: Edge, ask: Ask) -> float | None:
        """See `Scorer`.

        Raises:
            InvalidUse: nodes are given, which have no heading.
        """
        p, pose = self._parameters, ask.goal if self._at_goal else ask.start
        if pose is None:
            raise InvalidUse(f"{type(p).__name__} needs poses, and the route is asked for between nodes")
        last = edge.start != ask.first and edge.end == ask.last  # an edge from the first node counts as the first alone
        if not (last if self._at_goal else edge.start == ask.first):
            return 0.0
        dx, dy = self._places[edge.end] - self._places[edge.start]
        turn = abs(turn_between(math.atan2(dy, dx), float(pose[2])))
        if p.use_orientation_threshold and turn > p.orientation_tolerance:
            return None
        return p.orientation_weight * turn


def make_scorer(group: Group, graph: Graph) -> Scorer | None:
    """The scorer whose parameters these are, None if it adds nothing.

    Raises:
        ClearwayError: what an edge's metadata say for it is wrong.
        TypeError: they are those of something else.
    """
    match group:
        case DistanceScorer():
            speeds = (_told(graph, edge, group.speed_tag, least=1e-6) for edge in graph.edges)
            return _Fixed(
                group.weight * graph.length(edge) / (1.0 if speed is None else speed)
                for edge, speed in zip(graph.edges, speeds, strict=True)
            )
        case PenaltyScorer():
            return _Fixed(group.weight * (_told(graph, edge, group.penalty_tag) or 0.0) for edge in graph.edges)
        case TimeScorer():
            return _Fixed(group.weight * _time(group, graph, edge) for edge in graph.edges)
        case CostmapScorer():
            return _OnCostmap(group)
        case GoalOrientationScorer():
            return _Turned(group, graph, at_goal=True)
        case StartPoseOrientationScorer():
            return _Turned(group, graph, at_goal=False)
        case DynamicEdgesScorer():
            return None
    raise TypeError(f"{type(group).__name__} is no group of an edge scorer")


def _time(group: TimeScorer, graph: Graph, edge: Edge) -> float:
    if taken := _told(graph, edge, group.time_tag):
        return taken
    return graph.length(edge) / (_told(graph, edge, group.speed_tag) or group.max_vel)


def _told(graph: Graph, edge: Edge, tag: str, *, least: float = 0.0) -> float | None:
    """A number in an edge's metadata, None without it. As in Nav2 it has a point: a whole number there is another type.

    Raises:
        ClearwayError: it is none, or below `least`.
    """
    if tag not in edge.metadata:
        return None
    value = edge.metadata[tag]
    field = f"{edge.field}.metadata.{tag}"
    if isinstance(value, int) and not isinstance(value, bool):
        raise ClearwayError(
            f"is {value}; Nav2 takes a number with a point here, {float(value)}", file=graph.file, field=field
        )
    if not isinstance(value, float) or not least <= value < math.inf:
        right = "above 0" if least else "not below 0"
        raise ClearwayError(
            f"is {shown(value)}; it is to be a number {right}, such as 1.5", file=graph.file, field=field
        )
    return value

"""Nav2's route server: a route over a graph of places, as nodes and as a path, when it is asked.

It answers one control period later, as the planner server does. Behaviour read from ros-navigation/navigation2:
nav2_route/src/route_server.cpp, goal_intent_extractor.cpp.
"""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.frames import inverse, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.paths import moved
from clearway.navigators.nav2.behavior_tree.routes import Routed, RouteRequest
from clearway.navigators.nav2.behavior_tree.servers import Error, Job
from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.parameters import routes as parameters
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.routes.cells import Ground, in_reach
from clearway.navigators.nav2.routes.dense import Shape, dense
from clearway.navigators.nav2.routes.graph import Edge, Graph, NoNode, read_graph
from clearway.navigators.nav2.routes.scorers import Ask, InvalidUse, Scorer, make_scorer
from clearway.navigators.nav2.routes.search import NoRoute, Pruning, Route, TookTooLong, nearest, pruned, search
from clearway.reading import is_there

_ANY = 2**62
_POSES = 100_000
"""Of a route's path, at most: 5 km, 0.05 m from one to the next."""


class RouteServer:
    """Plans routes.

    Args:
        branch: Its parameters, with those of its scorers.
        file: That these stand in, None for a preset: the graph is named from there.
        costmap: The global one.
    """

    def __init__(self, branch: Branch, file: Path | None, costmap: Costmap) -> None:
        self._parameters = cast("parameters.RouteServer", branch.group)
        self._graph, self._scorers = read_routes(branch, file)
        self._scored = bool(self._parameters.edge_cost_functions)
        self._costmap = costmap
        self._job: Job | None = None

    def send(self, request: RouteRequest) -> Job:
        """Have a route planned."""
        self._job = Job(request)
        return self._job

    def cancel(self) -> None:
        """Don't."""
        self._job = None

    def think(self, pose: FloatArray, frame: FloatArray) -> None:
        """Plan, if a route is asked for and the costmap is current.

        Args:
            pose: (3,) of the robot in the map.
            frame: (3,) pose of the costmap's frame in the map.
        """
        job = self._job
        if job is None or not self._costmap.current:
            return
        self._job = None
        try:
            job.succeed(self._routed(job.request, pose, frame))
        except NoRoute as failure:
            job.abort(Error.NO_VALID_ROUTE, str(failure))
        except TookTooLong as failure:
            job.abort(Error.ROUTE_TIMEOUT, str(failure))
        except InvalidUse as failure:
            job.abort(Error.INVALID_EDGE_SCORER_USE, str(failure))
        except NoNode as failure:
            job.abort(Error.ROUTE_UNKNOWN, str(failure))

    def _routed(self, request: RouteRequest, pose: FloatArray, frame: FloatArray) -> Routed:
        """The route and its path.

        Raises:
            NoRoute: nothing leads there.
            TookTooLong: the search does.
            InvalidUse: a scorer can't tell of this request.
            NoNode: a node that is named is not there.
        """
        p, graph = self._parameters, self._graph
        ground = self._ground(frame)
        start, goal = request.start if request.start is not None else pose, request.goal
        if goal is None:
            first, last = graph.node(request.start_id), graph.node(request.goal_id)
            ask = Ask(first, last, None, None, ground)
        else:
            first = self._node(start, frame, ground, p.max_nn_search_iterations)
            last = self._node(goal, frame, ground, _ANY)
            ask = Ask(first, last, start, goal, ground)
        route = Route(first, ())
        if first != last:
            most = p.max_iterations if p.max_iterations > 0 else _ANY
            route, _ = search(graph, first, last, lambda edge: self._cost(edge, ask), most)
        if goal is not None:
            pruning = Pruning(
                p.prune_goal, p.max_prune_dist_from_edge, p.min_prune_dist_from_start, p.min_prune_dist_from_goal
            )
            route = pruned(route, graph, start, goal, pruning)
        if sum(map(graph.length, route.edges)) / p.path_density + len(route.edges) > _POSES:
            raise NoRoute(f"the path of the route would have more than {_POSES:,} poses; path_density may be greater")
        places = graph.places[list(route.nodes)]
        shape = Shape(p.path_density, p.smoothing_radius if p.smooth_corners else 0.0, p.smoothing_angle_threshold)
        return Routed(places, dense(places, shape))

    def _ground(self, frame: FloatArray) -> Ground:
        view, places = self._costmap.view(), self._graph.places
        there = moved(np.column_stack((places, np.zeros(len(places)))), inverse(frame))
        return Ground(view.cost, view.frame, np.ascontiguousarray(there[:, :2]))

    def _node(self, pose: FloatArray, frame: FloatArray, ground: Ground, most: int) -> int:
        """Index of the node at which a route from or to a pose begins or ends."""
        nodes = nearest(self._graph, pose, self._parameters.num_nearest_nodes)
        if not self._parameters.enable_nn_search or self._parameters.num_nearest_nodes == 1:
            return int(nodes[0])
        x, y, _ = relative(frame, pose)
        return int(nodes[in_reach(ground.cost, ground.frame, x, y, ground.places[nodes], most)])

    def _cost(self, edge: Edge, ask: Ask) -> float | None:
        """Of an edge: that of the file, or of all scorers together; None: one of them says that it is closed."""
        if not (edge.overridable and self._scored):
            return edge.cost
        total = 0.0
        for scorer in self._scorers:
            part = scorer.score(edge, ask)
            if part is None:
                return None
            total += part
        return total


def read_routes(branch: Branch, file: Path | None) -> tuple[Graph, tuple[Scorer, ...]]:
    """The graph that a route server's parameters name, and what scores its edges.

    Args:
        branch: The parameters.
        file: That they stand in, None for a preset.

    Raises:
        ClearwayError: it is not there, or something in it is wrong.
    """
    p = cast("parameters.RouteServer", branch.group)
    field = "route_server.graph_filepath"
    if not p.graph_filepath:
        raise ClearwayError(
            "is missing, and the behaviour tree asks for routes; write the path of a GeoJSON file, as Nav2's launch files fill it in",
            file=file,
            field=field,
        )
    path = Path(p.graph_filepath) if file is None else file.parent / p.graph_filepath
    if not is_there(path):
        raise ClearwayError(
            f"there is no file {p.graph_filepath}; write the path of a GeoJSON file, absolute or beside that of the parameters",
            file=file,
            field=field,
        )
    graph = read_graph(path)
    groups = [branch.children[name].group for name in p.edge_cost_functions]
    for edge in graph.edges:
        if edge.cost <= 0.0 and not (edge.overridable and groups):
            why = "there is no edge scorer" if edge.overridable else "no scorer may override it"
            raise ClearwayError(
                f"is {edge.cost:g}, and {why}; it is to be above 0", file=path, field=f"{edge.field}.cost"
            )
    scorers = tuple(scorer for group in groups if (scorer := make_scorer(group, graph)) is not None)
    return graph, scorers

"""Nav2's route server: its search against SciPy's, all beside it against a second, plain reading."""

from __future__ import annotations

import copy
import math
from pathlib import Path

import numpy as np
import pytest
import routes_oracle as oracle
from route_features import SQUARE, edge, node, written
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from clearway.errors import ClearwayError
from clearway.navigators.common.costmaps.footprint import Frame
from clearway.navigators.nav2.behavior_tree.routes import RouteRequest
from clearway.navigators.nav2.behavior_tree.servers import Error
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.routes import RouteServer as Parameters
from clearway.navigators.nav2.route_server import RouteServer, read_routes
from clearway.navigators.nav2.routes import scorers
from clearway.navigators.nav2.routes.cells import Ground, along_edge, in_reach
from clearway.navigators.nav2.routes.dense import Shape, dense
from clearway.navigators.nav2.routes.graph import Edge, Graph, read_graph
from clearway.navigators.nav2.routes.search import NoRoute, Pruning, Route, TookTooLong, nearest, pruned, search

ORIGIN = np.zeros(3)


def random_graph(rng, n, m):
    places = rng.uniform(-5.0, 5.0, (n, 2))
    ends = rng.integers(0, n, (m, 2))
    edges = tuple(Edge(k, int(a), int(b), 0.0, True, {}, f"features.{n + k}") for k, (a, b) in enumerate(ends))
    leaving = tuple(tuple(e for e in edges if e.start == k) for k in range(n))
    return Graph(tuple(range(n)), places, edges, leaving, Path("graph.geojson"))


@pytest.mark.parametrize("seed", range(60))
def test_the_search_finds_what_scipys_does(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 40))
    graph = random_graph(rng, n, int(rng.integers(1, 4 * n)))
    costs = rng.uniform(0.1, 3.0, len(graph.edges))
    closed = rng.random(len(graph.edges)) < 0.1
    matrix = np.full((n, n), np.inf)
    for e in graph.edges:
        if not closed[e.number] and e.start != e.end:
            matrix[e.start, e.end] = min(matrix[e.start, e.end], costs[e.number])
    least = dijkstra(csr_array(np.where(np.isinf(matrix), 0.0, matrix)), indices=0)
    cost_of = lambda e: None if closed[e.number] else float(costs[e.number])  # noqa: E731
    for last in range(1, n):
        if math.isinf(least[last]):
            with pytest.raises(NoRoute, match=f"no route leads from node 0 to node {last}"):
                search(graph, 0, last, cost_of, 2**62)
            continue
        route, cost = search(graph, 0, last, cost_of, 2**62)
        assert cost == pytest.approx(least[last], abs=1e-12)
        assert sum(costs[e.number] for e in route.edges) == pytest.approx(cost)
        assert route.nodes == (0, *(e.end for e in route.edges))
        assert [e.start for e in route.edges] == list(route.nodes[:-1])
        assert not closed[[e.number for e in route.edges]].any()


def test_a_search_that_takes_too_long_is_told():
    graph = random_graph(np.random.default_rng(3), 30, 120)
    with pytest.raises(TookTooLong, match="took 3 iterations"):
        search(graph, 0, 29, graph.length, 3)


@pytest.mark.parametrize("seed", range(40))
def test_ends_are_left_out_as_in_the_plain_reading(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    places = np.round(rng.uniform(-3.0, 3.0, (n, 2)), 1)
    edges = tuple(Edge(k, k, k + 1, 0.0, True, {}, "") for k in range(n - 1))
    graph = Graph(tuple(range(n)), places, edges, (), Path())
    limits = (bool(rng.random() < 0.8), *(float(x) for x in rng.choice((0.0, 0.1, 0.5, 1.0, 8.0), 3)))
    for _ in range(50):
        start, goal = np.round(rng.uniform(-3.0, 3.0, (2, 3)), 1)
        route = pruned(Route(0, edges), graph, start, goal, Pruning(*limits))
        nodes = [tuple(map(float, p)) for p in places]
        wanted = oracle.pruned(nodes, (start[0], start[1]), (goal[0], goal[1]), limits)
        assert [tuple(places[k]) for k in route.nodes] == wanted


@pytest.mark.parametrize("seed", range(60))
def test_the_path_is_that_of_the_plain_reading(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    places = np.round(rng.uniform(-3.0, 3.0, (n, 2)), int(rng.integers(0, 3)))
    spacing, radius = float(rng.choice((0.05, 0.3, 10.0))), float(rng.choice((0.2, 1.0)))
    smooth, widest = bool(rng.random() < 0.7), float(rng.choice((2.9, 1.5)))
    found = dense(places, Shape(spacing, radius if smooth else 0.0, widest))
    wanted = np.array(oracle.path([tuple(map(float, p)) for p in places], spacing, radius, widest, smooth=smooth))
    assert found.shape == wanted.shape
    assert np.allclose(found[:, :2], wanted[:, :2], atol=1e-9)
    apart = [abs(math.remainder(a - b, math.tau)) for a, b in zip(found[:, 2], wanted[:, 2], strict=True)]
    assert max(apart) < 1e-5
    steps = np.hypot(*np.diff(found[:, :2], axis=0).T)
    assert (steps <= spacing + 1e-6).all()


def random_cost(rng):
    cost = rng.choice((0, 100, 252, 253, 254, 255), (24, 30), p=(0.5, 0.1, 0.05, 0.1, 0.15, 0.1)).astype(np.uint8)
    return cost, Frame(-1.0, -2.0, 0.1, 24, 30)


@pytest.mark.slow  # compiles
@pytest.mark.parametrize("seed", range(40))
def test_what_is_looked_up_in_the_costmap_is_that_of_the_plain_reading(seed):
    rng = np.random.default_rng(seed)
    cost, frame = random_cost(rng)
    grid = cost.tolist()
    for _ in range(20):
        pose, places = rng.uniform((-1.3, -2.3), (2.3, 0.7)), rng.uniform((-1.3, -2.3), (2.3, 0.7), (5, 2))
        most = int(rng.choice((3, 50, 10_000)))
        points = [(float(x), float(y)) for x, y in places]
        wanted = oracle.reached(grid, (-1.0, -2.0), 0.1, (float(pose[0]), float(pose[1])), points, most)
        assert in_reach(cost, frame, *pose, places, most) == wanted
        ends = [oracle.cell(grid, (-1.0, -2.0), 0.1, p) for p in points[:2]]
        step, closing = int(rng.integers(1, 4)), float(rng.choice((253.0, math.inf)))
        count, highest, total = along_edge(cost, frame, *points[0], *points[1], step, closing)
        if None in ends:
            assert count == 0
            continue
        seen = [grid[y][x] for x, y in list(oracle.line(*ends))[::step]]
        if max(seen) >= closing:
            assert count == -1
        else:
            assert (count, total) == (len(seen), sum(seen))
            assert highest == max((c for c in seen if c != 255), default=0)


def ask(ground=None, first=0, last=2, start=(0.0, 0.0, 0.0), goal=(2.0, 2.0, math.pi / 2)):
    poses = [None if pose is None else np.array(pose) for pose in (start, goal)]
    return scorers.Ask(first, last, *poses, ground)


def scored(tmp_path, group, request, features=SQUARE):
    graph = read_graph(written(tmp_path, features))
    scorer = scorers.make_scorer(group, graph)
    return [scorer.score(e, request) for e in graph.edges]


def test_edges_are_scored_by_length_time_penalty_and_turn(tmp_path):
    long = math.sqrt(8.0)
    features = [copy.deepcopy(f) for f in SQUARE]
    features[4]["properties"]["metadata"] = {"abs_speed_limit": 0.25, "penalty": 4.0}
    features[5]["properties"]["metadata"] = {"abs_time_taken": 7.0, "abs_speed_limit": 9.0}
    told = scored(tmp_path, scorers.DistanceScorer(weight=2.0), ask(), features)
    assert told == pytest.approx([8.0, 4.0, 2 * long, 2 * long])
    told = scored(tmp_path, scorers.TimeScorer(max_vel=0.8), ask(), features)
    assert told == pytest.approx([2.5, 8.0, 7.0, long / 0.8])
    assert scored(tmp_path, scorers.PenaltyScorer(weight=0.5), ask(), features) == [0.0, 2.0, 0.0, 0.0]
    start = scorers.StartPoseOrientationScorer(orientation_weight=2.0)
    assert scored(tmp_path, start, ask()) == pytest.approx([0.0, 0.0, 0.0, math.pi / 2])
    goal = scorers.GoalOrientationScorer()
    assert scored(tmp_path, goal, ask(goal=(2.0, 2.0, 0.0))) == pytest.approx([0.0, math.pi / 2, 0.0, 0.0])
    closing = scorers.GoalOrientationScorer(use_orientation_threshold=True, orientation_tolerance=1.5)
    assert scored(tmp_path, closing, ask(goal=(2.0, 2.0, 0.0))) == [0.0, None, 0.0, 0.0]
    with pytest.raises(scorers.InvalidUse, match="GoalOrientationScorer needs poses"):
        scored(tmp_path, goal, ask(goal=None))
    assert scorers.make_scorer(scorers.DynamicEdgesScorer(), read_graph(written(tmp_path, SQUARE))) is None


@pytest.mark.slow  # compiles
def test_edges_are_scored_by_the_costmap_or_closed(tmp_path):
    cost = np.zeros((30, 30), np.uint8)
    cost[5, 8], cost[12, 25] = 100, 254  # at (0.3, 0) on the first edge, at (2, 0.7) on the second
    places = np.array(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)))
    ground = Ground(cost, Frame(-0.5, -0.5, 0.1, 30, 30), places)
    told = scored(tmp_path, scorers.CostmapScorer(check_resolution=1), ask(ground))
    assert told == pytest.approx([100 / 253, None, 0.0, 0.0])
    told = scored(tmp_path, scorers.CostmapScorer(check_resolution=1, use_maximum=False, weight=2.0), ask(ground))
    assert told[0] == pytest.approx(2.0 * 100 / 21 / 253)
    told = scored(tmp_path, scorers.CostmapScorer(check_resolution=1, invalid_on_collision=False), ask(ground))
    assert told[1] == pytest.approx(254 / 253)
    far = Ground(cost, Frame(2.5, -0.5, 0.1, 30, 30), places)
    assert scored(tmp_path, scorers.CostmapScorer(), ask(far)) == [None, None, None, None]
    off = scorers.CostmapScorer(invalid_off_map=False, check_resolution=1)
    assert scored(tmp_path, off, ask(far)) == [0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (1, r"features.3.properties.metadata.speed_limit: is 1; Nav2 takes a number with a point here, 1\.0"),
        (0.0, "is 0.0; it is to be a number above 0"),
        ("fast", "is 'fast'; it is to be a number above 0"),
        (math.inf, "is inf; it is to be a number above 0"),
    ],
)
def test_metadata_that_a_scorer_cannot_use_are_one_clear_error(tmp_path, value, said):
    features = [*SQUARE[:3], edge(20, 0, 1, metadata={"speed_limit": value})]
    with pytest.raises(ClearwayError, match=said):
        scored(tmp_path, scorers.DistanceScorer(), ask(), features)


def branch_of(folder, features=SQUARE, **table):
    written(folder, features)
    return settle(Parameters, {"graph_filepath": "graph.geojson", **table}, "route_server", None)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"graph_filepath": ""}, "nav2.yaml: route_server.graph_filepath: is missing, and the behaviour tree asks for routes"),
        ({"graph_filepath": "other.geojson"}, r"there is no file other\.geojson; write the path of a GeoJSON file"),
        ({"edge_cost_functions": ()}, "graph.geojson: features.3.properties.cost: is 0, and there is no edge scorer"),
        ({"edge_cost_functions": ("a",), "a": {"plugin": "nav2_route::SemanticScorer"}}, "closest is nav2_route::PenaltyScorer"),
        ({"graph_file_loader": "mine"}, "names 'mine', and nothing says which graph file loader that is"),
        ({"num_nearest_nodes": 0}, "num_nearest_nodes: 0 is wrong"),
    ],
)  # fmt: skip
def test_wrong_parameters_are_one_clear_error(tmp_path, table, said):
    with pytest.raises(ClearwayError, match=said):
        read_routes(branch_of(tmp_path, **table), tmp_path / "nav2.yaml")


def test_an_edge_that_no_scorer_overrides_needs_a_cost(tmp_path):
    branch = branch_of(tmp_path, [*SQUARE[:3], edge(20, 0, 1, overridable=False)])
    with pytest.raises(ClearwayError, match=r"features.3.properties.cost: is 0, and no scorer may override it"):
        read_routes(branch, tmp_path / "nav2.yaml")


ROW = tuple(node(10 + k, 0.5 * k - 1.0, 0.0) for k in range(5)) + tuple(edge(k, 10 + k, 11 + k) for k in range(4))


def routed(tmp_path, costmap, request, frame=ORIGIN, pose=ORIGIN, features=ROW, **table):
    server = RouteServer(branch_of(tmp_path, features, **table), tmp_path / "nav2.yaml", costmap)
    job = server.send(request)
    server.think(pose, frame)
    return job


@pytest.mark.slow  # compiles
def test_a_route_leads_from_node_to_node_or_from_pose_to_pose(tmp_path, costmap):
    job = routed(tmp_path, costmap, RouteRequest(None, None, 10, 13))
    assert job.result.nodes[:, 0].tolist() == [-1.0, -0.5, 0.0, 0.5]  # nothing is left out between nodes
    assert job.result.path[[0, -1]].tolist() == [[-1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
    near, far = np.array((-0.9, 0.1, 0.0)), np.array((0.9, 0.1, 0.0))
    job = routed(tmp_path, costmap, RouteRequest(far, near, 0, 0))
    assert job.result.nodes[:, 0].tolist() == [-0.5, 0.0, 0.5, 1.0]  # the goal is too near to the last node
    job = routed(tmp_path, costmap, RouteRequest(far, None, 0, 0), pose=near, min_prune_dist_from_goal=0.1)
    assert job.result.nodes[:, 0].tolist() == [-0.5, 0.0, 0.5]
    job = routed(tmp_path, costmap, RouteRequest(far, near, 0, 0), prune_goal=False, max_prune_dist_from_edge=0.05)
    assert len(job.result.nodes) == 5
    job = routed(tmp_path, costmap, RouteRequest(far, far, 0, 0))
    assert job.result.path.tolist() == [[1.0, 0.0, 0.0]]


@pytest.mark.slow  # compiles
def test_a_node_behind_a_wall_is_left_for_one_that_is_in_reach(tmp_path, costmap):
    before = costmap.cost.copy()
    try:
        costmap.cost[:] = 0
        costmap.cost[:55, 34:36] = 254  # a wall at x = 0.2 up to y = 1.2, between the pose and its nearest node
        features = [node(0, 0.3, 0.0), node(1, -0.5, -0.5), node(2, 0.3, 1.4), edge(0, 0, 2), edge(1, 1, 2)]
        pose, goal = np.array((0.0, 0.0, 0.0)), np.array((0.3, 1.4, 0.0))
        for table, first in (({}, 1), ({"enable_nn_search": False}, 0), ({"max_nn_search_iterations": 3}, 0)):
            job = routed(
                tmp_path,
                costmap,
                RouteRequest(goal, pose, 0, 0),
                features=features,
                max_prune_dist_from_edge=0.0,
                **table,
            )
            assert job.result.nodes[0].tolist() == features[first]["geometry"]["coordinates"]
        frame = np.array((5.0, 3.0, math.pi / 2))  # the same with a costmap in another frame
        turned = [node(k, 5.0 - y, 3.0 + x) for k, (x, y) in enumerate(((0.3, 0.0), (-0.5, -0.5), (0.3, 1.4)))]
        request = RouteRequest(np.array((3.6, 3.3, 0.0)), np.array((5.0, 3.0, 0.0)), 0, 0)
        job = routed(tmp_path, costmap, request, frame, features=[*turned, *features[3:]], max_prune_dist_from_edge=0.0)
        assert job.result.nodes[0] == pytest.approx((5.5, 2.5))
    finally:
        costmap.cost[:] = before


@pytest.mark.slow  # compiles
@pytest.mark.parametrize(
    ("request_", "table", "error", "said"),
    [
        (RouteRequest(None, None, 13, 10), {}, Error.NO_VALID_ROUTE, "no route leads from node 13 to node 10"),
        (RouteRequest(None, None, 10, 99), {}, Error.ROUTE_UNKNOWN, "the graph has no node 99"),
        (RouteRequest(None, None, 10, 14), {"max_iterations": 2}, Error.ROUTE_TIMEOUT, "took 2 iterations"),
        (RouteRequest(None, None, 10, 14), {"path_density": 1e-6}, Error.NO_VALID_ROUTE, "more than 100,000 poses"),
        (
            RouteRequest(None, None, 10, 14),
            {"edge_cost_functions": ("a",), "a": {"plugin": "nav2_route::GoalOrientationScorer"}},
            Error.INVALID_EDGE_SCORER_USE,
            "GoalOrientationScorer needs poses",
        ),
    ],
)
def test_a_route_that_is_not_found_has_a_code(tmp_path, costmap, request_, table, error, said):
    job = routed(tmp_path, costmap, request_, **table)
    assert job.error is error
    assert said in job.message


@pytest.mark.slow  # compiles
def test_a_route_waits_for_the_costmap_and_is_cancelled(tmp_path, costmap):
    server = RouteServer(branch_of(tmp_path, ROW), tmp_path / "nav2.yaml", costmap)
    costmap.current = False
    job = server.send(RouteRequest(None, None, 10, 13))
    server.think(ORIGIN, ORIGIN)
    assert job.running
    costmap.current = True
    server.cancel()
    server.think(ORIGIN, ORIGIN)
    assert job.running


def test_the_nearest_nodes_come_first():
    graph = random_graph(np.random.default_rng(0), 20, 5)
    found = nearest(graph, ORIGIN, 5)
    apart = np.hypot(*graph.places.T)
    assert found.tolist() == np.argsort(apart)[:5].tolist()

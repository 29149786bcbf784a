"""What the table tells of a behaviour tree, and of the servers that are there only where it asks for them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from clearway.errors import ClearwayError
from clearway.navigators.nav2.navigator import Nav2
from clearway.navigators.nav2.parameters import files
from clearway.navigators.nav2.parameters.table import table
from clearway.robots import load_robot


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        (None, r"default_nav_to_pose_bt_xml: there is no file mine\.xml; unknown behaviour tree 'mine'"),
        ("<root><BehaviorTree ID='A'><Spinn/></BehaviorTree></root>", r"mine\.xml: unknown node type 'Spinn'"),
        ("<root><BehaviorTree ID='A'><Spin/></BehaviorTree></root>", None),
    ],
)
def test_the_table_says_of_the_tree_what_driving_would(tmp_path: Path, tree: str | None, said: str | None) -> None:
    if tree is not None:
        (tmp_path / "mine.xml").write_text(tree)
    text = "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: mine.xml, bt_loop_duration: 20}}"
    found = table(written(tmp_path, text))
    told = {row.name.removeprefix("bt_navigator.") for row in found.rows}
    assert told == {"bt_loop_duration"} | (set() if said else {"default_nav_to_pose_bt_xml"})
    assert len(found.problems) == (0 if said is None else 1)
    assert said is None or re.search(said, str(found.problems[0]))


@pytest.mark.parametrize("asks", [False, True])
def test_a_server_is_read_where_the_tree_asks_for_it_and_else_ignored(tmp_path: Path, asks: bool) -> None:
    node = "<SmoothPath smoother_id='mine'/>" if asks else "<Spin/>"
    (tmp_path / "mine.xml").write_text(
        "<root main_tree_to_execute='A'><BehaviorTree ID='A'><SubTree ID='B'/></BehaviorTree>"
        f"<BehaviorTree ID='B'>{node}</BehaviorTree><BehaviorTree ID='C'><SmoothPath/></BehaviorTree></root>"
    )
    text = (
        "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: mine.xml}}\n"
        "smoother_server: {ros__parameters: {smoother_plugins: [mine, other], costmap_topic: a, plugins: [b], "
        "mine: {plugin: 'nav2_smoother::SimpleSmoother', max_its: 9, maxits: 8}, "
        "other: {plugin: 'nav2_constrained_smoother/ConstrainedSmoother', w_curve: 30.0}}}\n"
    )
    path = written(tmp_path, text)
    found = table(path)
    rows = {row.name: row.status for row in found.rows if row.name.startswith("smoother_server")}
    if not asks:
        assert rows == {"smoother_server": "ignored"}
        assert found.problems == ()
        assert Nav2(str(path)).read_parameters(load_robot("hosbot")).smoother_server is None
        return
    assert rows == {
        "smoother_server.smoother_plugins": "read",
        "smoother_server.costmap_topic": "ignored",
        "smoother_server.plugins": "unknown",
        "smoother_server.mine.plugin": "read",
        "smoother_server.mine.max_its": "read",
        "smoother_server.mine.maxits": "unknown",
        "smoother_server.other": "missing",
    }
    assert "closest is nav2_smoother::SimpleSmoother" in str(found.problems[0])
    with pytest.raises(ClearwayError, match="closest is nav2_smoother::SimpleSmoother"):
        Nav2(str(path)).read_parameters(load_robot("hosbot"))


GRAPH = (
    '{"features": [{"geometry": {"type": "Point", "coordinates": [0, 0]}, "properties": {"id": 1}}, '
    '{"geometry": {"type": "LineString"}, "properties": {"id": 2, "startid": 1, "endid": %d}}]}'
)


def test_the_table_tells_of_routes_what_driving_would(tmp_path: Path) -> None:
    text = (
        "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: navigate_on_route_graph_w_recovery.xml}}\n"
        "route_server: {ros__parameters: {graph_filepath: g.geojson, radius_to_achieve_node: 2.0, smooth_corner: true, "
        "operations: [AdjustSpeedLimit], AdjustSpeedLimit: {plugin: 'nav2_route::AdjustSpeedLimit'}, "
        "edge_cost_functions: [Costs, Classes], Costs: {plugin: 'nav2_route::CostmapScorer', weight: 2.0, wait: 1.0}, "
        "Classes: {plugin: 'nav2_route::SemanticScorer'}}}\n"
    )
    path = written(tmp_path, text)
    found = table(path)
    rows = {row.name.removeprefix("route_server."): row.status for row in found.rows if "route_server." in row.name}
    assert rows == {
        "graph_filepath": "read",
        "radius_to_achieve_node": "ignored",
        "smooth_corner": "unknown",
        "operations": "ignored",
        "AdjustSpeedLimit": "ignored",
        "edge_cost_functions": "read",
        "Costs.plugin": "read",
        "Costs.weight": "read",
        "Costs.wait": "unknown",
        "Classes": "missing",
    }
    (problem,) = found.problems
    assert "the edge scorer 'nav2_route::SemanticScorer' is not built here; closest is nav2_route::PenaltyS" in str(
        problem
    )
    path = written(tmp_path, text.replace("[Costs, Classes]", "[Costs]"))
    (problem,) = table(path).problems
    assert (problem.field, "there is no file g.geojson" in problem.problem) == ("route_server.graph_filepath", True)
    (tmp_path / "g.geojson").write_text(GRAPH % 3)
    (problem,) = table(path).problems
    assert str(problem) == f"{tmp_path / 'g.geojson'}: features.1.properties.endid: is 3; no node has that id"
    assert files(path) == (path, tmp_path / "g.geojson")
    (tmp_path / "g.geojson").write_text(GRAPH % 1)
    assert table(path).problems == ()
    assert Nav2(str(path)).read_parameters(load_robot("hosbot")).route_server is not None
    spaced = written(
        tmp_path, "robot1:\n  " + text.replace("[Costs, Classes]", "[Costs]").replace("\nroute", "\n  route")
    )
    assert files(spaced) == (path, tmp_path / "g.geojson")
    assert Nav2(str(spaced)).read_parameters(load_robot("hosbot")).route_server is not None
    (problem,) = table(written(tmp_path, text.partition("\n")[0])).problems
    assert (problem.field, "is missing" in problem.problem) == ("route_server.graph_filepath", True)
    (problem,) = table(written(tmp_path, text.replace("g.geojson", "g" * 300).replace(", Classes]", "]"))).problems
    assert "there is no file ggg" in problem.problem


def test_a_server_that_is_not_asked_for_may_stand_beside_a_robots_namespace(tmp_path: Path) -> None:
    path = written(tmp_path, "robot1: {bt_navigator: {ros__parameters: {}}}\nroute_server: {ros__parameters: {}}\n")
    assert Nav2(str(path)).read_parameters(load_robot("hosbot")).route_server is None

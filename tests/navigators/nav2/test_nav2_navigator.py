"""The navigator nav2: the whole of it in a small kinematic loop, and in the hospital."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.contract import Goal, Observation, Scan, Task
from clearway.errors import ClearwayError
from clearway.navigators.nav2 import Nav2
from clearway.navigators.nav2.behavior_tree import defaults
from clearway.perception import make_localiser
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome
from clearway.world import simulate
from rooms import floor

pytestmark = pytest.mark.slow  # compiles for long

PURSUIT = Path(__file__).with_name("nav2_pursuit.yaml")
PERIOD = 0.1
ORIGIN = np.zeros(3)


def test_it_drives_through_a_room_to_one_goal_and_the_next(robot):
    navigator = Nav2(params=str(PURSUIT))
    task = Task(PERIOD, 0.6, np.zeros(3), floor())
    navigator.reset(task, robot, np.random.default_rng(0))
    pose, v, omega = np.zeros(3), 0.0, 0.0
    scan = Scan(np.full(8, math.inf), -math.pi, math.pi / 4, 0.05, 10.0, np.zeros(3))
    goals = [Goal(np.array(p), 0.1, 0.05) for p in ((3.0, 0.5, 0.0), (1.0, -0.5, math.pi))]
    done, k = 0, 0
    for k in range(600):
        command = navigator.step(Observation(PERIOD * k, pose, np.array((v, omega)), pose, goals[done], scan))
        assert command.gave_up is None
        if k < 2:
            assert (command.v != 0.0) == (k == 1)  # planned in the first period, followed in the second
        if command.arrived:
            assert math.hypot(*(pose - goals[done].pose)[:2]) < 0.1
            done += 1
            if done == 2:
                break
        v, omega = command.v, command.omega
        pose = pose + np.array((v * math.cos(pose[2]), v * math.sin(pose[2]), omega)) * PERIOD
        pose[2] = math.remainder(pose[2], 2 * math.pi)
    assert done == 2
    assert k < 350
    shown = navigator.diagnostics()
    assert set(shown.polylines) <= {"global plan", "local plan"}


def test_it_stays_a_metre_from_a_point_that_it_follows_until_that_goes_on(tmp_path, robot):
    file = tmp_path / "nav2.yaml"
    file.write_text(
        PURSUIT.read_text() + "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: follow_point.xml}}"
    )
    navigator = Nav2(params=str(file))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot, np.random.default_rng(0))
    pose, v, omega, ends = np.zeros(3), 0.0, 0.0, []
    scan = Scan(np.full(8, math.inf), -math.pi, math.pi / 4, 0.05, 10.0, np.zeros(3))
    goals = [Goal(np.array(p), 0.1, 0.05) for p in ((3.0, 0.5, 0.0), (5.0, -0.5, 0.0))]
    for k in range(300):
        goal = goals[k // 150]
        command = navigator.step(Observation(PERIOD * k, pose, np.array((v, omega)), pose, goal, scan))
        assert command.gave_up is None
        assert not command.arrived
        v, omega = command.v, command.omega
        pose = pose + np.array((v * math.cos(pose[2]), v * math.sin(pose[2]), omega)) * PERIOD
        pose[2] = math.remainder(pose[2], 2 * math.pi)
        if k in (149, 299):
            ends.append((math.hypot(*(pose - goal.pose)[:2]), v))
    for apart, speed in ends:
        assert apart == pytest.approx(1.0, abs=0.15)
        assert speed == pytest.approx(0.0, abs=0.05)


ROUTES = """
bt_navigator: {{ros__parameters: {{default_nav_to_pose_bt_xml: "/opt/ros/share/{tree}.xml"}}}}
smoother_server:
  ros__parameters:
    smoother_plugins: ["route_smoother"]
    route_smoother: {{plugin: "nav2_smoother::SimpleSmoother", refinement_num: 5, enforce_path_inversion: false}}
route_server:
  ros__parameters:
    graph_filepath: rooms.geojson
    smooth_corners: true
    smoothing_radius: 0.3
    edge_cost_functions: ["DistanceScorer", "CostmapScorer"]
    DistanceScorer: {{plugin: "nav2_route::DistanceScorer"}}
    CostmapScorer: {{plugin: "nav2_route::CostmapScorer"}}
"""


def graph_of(places, ways):
    nodes = [({"id": k}, {"type": "Point", "coordinates": place}) for k, place in enumerate(places)]
    both = [way for a, b in ways for way in ((a, b), (b, a))]
    edges = [({"id": 100 + k, "startid": a, "endid": b}, {"type": "LineString"}) for k, (a, b) in enumerate(both)]
    return json.dumps({"features": [{"properties": p, "geometry": g} for p, g in nodes + edges]})


@pytest.mark.parametrize("tree", [defaults.ON_ROUTES, defaults.ALONG_ROUTES])
def test_it_drives_along_the_routes_of_a_graph(tmp_path, robot, tree):
    """Two ways lead past a wall that stands in the middle of the room, the shorter one through it."""
    (tmp_path / "rooms.geojson").write_text(
        graph_of(
            ((0.6, -1.0), (2.5, -1.0), (4.4, -1.0), (0.6, 1.0), (4.4, 1.0)), ((0, 1), (1, 2), (0, 3), (3, 4), (4, 2))
        )
    )
    file = tmp_path / "nav2.yaml"
    file.write_text(PURSUIT.read_text() + ROUTES.format(tree=tree))
    room = floor()
    room.data[:40, 80:100] = 100  # over x from 2 to 3 up to y = 0
    navigator = Nav2(params=str(file))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), room), robot, np.random.default_rng(0))
    pose, v, omega, way = np.array((-0.5, -1.0, 0.0)), 0.0, 0.0, []
    goal, scan = (
        Goal(np.array((5.4, -0.6, 0.0)), 0.1, 0.05),
        Scan(np.full(8, math.inf), -math.pi, math.pi / 4, 0.05, 10.0, np.zeros(3)),
    )
    for k in range(400):
        command = navigator.step(Observation(PERIOD * k, pose, np.array((v, omega)), pose, goal, scan))
        assert command.gave_up is None
        if command.arrived:
            break
        v, omega = command.v, command.omega
        pose = pose + np.array((v * math.cos(pose[2]), v * math.sin(pose[2]), omega)) * PERIOD
        pose[2] = math.remainder(pose[2], 2 * math.pi)
        way.append(pose[:2])
    assert command.arrived
    assert math.hypot(*(pose - goal.pose)[:2]) < 0.1
    across = [y for x, y in way if 2.4 < x < 2.6]
    if tree == defaults.ON_ROUTES:
        assert across == pytest.approx(np.ones(len(across)), abs=0.1)  # on the edge itself
    else:
        assert min(across) > 0.2
    assert {path.name for path in Nav2.files(str(file))} == {"nav2.yaml", "rooms.geojson"}


def test_a_goal_that_no_route_leads_to_is_given_up_with_the_reason(tmp_path, robot):
    (tmp_path / "rooms.geojson").write_text(graph_of(((0.5, 0.0), (4.5, 0.0), (3.0, 0.0)), ((1, 2),)))
    file = tmp_path / "nav2.yaml"
    file.write_text(PURSUIT.read_text() + ROUTES.format(tree=defaults.ON_ROUTES))
    navigator = Nav2(params=str(file))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot, np.random.default_rng(0))
    goal, scan = Goal(np.array((5.0, 0.0, 0.0)), 0.1, 0.05), Scan(np.full(4, 3.0), 0.0, 1.0, 0.1, 9.0, np.zeros(3))
    told = [
        navigator.step(Observation(PERIOD * k, np.zeros(3), np.zeros(2), np.zeros(3), goal, scan)) for k in range(40)
    ]
    said = next(command.gave_up for command in told if command.gave_up is not None)
    assert said == "Goal failed: no route leads from node 0 to node 1"


def test_a_tree_with_routes_needs_a_graph(tmp_path, robot):
    file = tmp_path / "nav2.yaml"
    file.write_text(PURSUIT.read_text() + ROUTES.format(tree=defaults.ON_ROUTES))
    with pytest.raises(ClearwayError, match=r"route_server.graph_filepath: there is no file rooms\.geojson"):
        Nav2(params=str(file)).read_parameters(robot)
    (tmp_path / "rooms.geojson").write_text("{}")
    with pytest.raises(ClearwayError, match=r"rooms\.geojson: features: is missing"):
        Nav2(params=str(file)).read_parameters(robot)


def test_a_goal_off_the_map_is_given_up_with_the_reason(robot):
    navigator = Nav2(params=str(PURSUIT))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot, np.random.default_rng(0))
    goal, scan = Goal(np.array((50.0, 0.0, 0.0)), 0.1, 0.05), Scan(np.full(4, 3.0), 0.0, 1.0, 0.1, 9.0, np.zeros(3))
    told = [
        navigator.step(Observation(PERIOD * k, np.zeros(3), np.zeros(2), np.zeros(3), goal, scan)) for k in range(4)
    ]
    assert "off the global costmap" in (told[-1].gave_up or "")


@pytest.mark.parametrize(("batch", "configuration"), [("MO", "crossing"), ("SO", "single")])
def test_it_drives_the_hospitals_batches(batch, configuration, robot):
    chosen = Selection(
        batches=(batch,), configurations=(configuration,), speeds=(0.6,), sizes=(0.3,), gaps=(1.0,), repetitions=1
    )
    scenario = load_suite("hospital").build(robot, chosen, 0)[0]
    pilot = compose(Nav2(params=str(PURSUIT)), make_localiser("truth", robot))
    trial = simulate(scenario, robot, pilot, navigator="nav2", localisation="truth", map=granted_map(None, scenario))
    assert trial.outcome is Outcome.REACHED


def test_a_tree_of_the_users_own_is_read_beside_the_file_and_a_wrong_one_told(tmp_path, robot):
    text = PURSUIT.read_text() + "bt_navigator:\n  ros__parameters:\n    default_nav_to_pose_bt_xml: mine.xml\n"
    file = tmp_path / "nav2.yaml"
    file.write_text(text)
    with pytest.raises(ClearwayError, match=r"there is no file mine\.xml; unknown behaviour tree 'mine'"):
        Nav2(params=str(file)).read_parameters(robot)
    (tmp_path / "mine.xml").write_text("<root><BehaviorTree ID='A'><Spinn/></BehaviorTree></root>")
    with pytest.raises(ClearwayError, match=r"mine\.xml: unknown node type 'Spinn'; did you mean 'Spin'"):
        Nav2(params=str(file)).read_parameters(robot)
    (tmp_path / "mine.xml").write_text("<root><BehaviorTree ID='A'><Spin/></BehaviorTree></root>")
    navigator = Nav2(params=str(file))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot, np.random.default_rng(0))
    assert {path.name for path in Nav2.files(str(file))} == {"nav2.yaml", "mine.xml"}
    file.write_text(
        text.replace("mine.xml", "$(find-pkg-share nav2_bt_navigator)/behavior_trees/navigate_w_replanning_time.xml")
    )
    Nav2(params=str(file)).read_parameters(robot)


def test_an_unknown_branch_of_trees_is_one_clear_error():
    with pytest.raises(ClearwayError, match="unknown branch of Nav2 'jazy'; did you mean 'jazzy'"):
        Nav2(trees="jazy")


@pytest.mark.parametrize(("tolerance", "arrives"), [("", False), ("    goal_reached_tol: 1.1\n", True)])
def test_the_trees_goal_is_reached_within_the_files_tolerance(tmp_path, robot, tolerance, arrives):
    (tmp_path / "mine.xml").write_text("<root><BehaviorTree ID='A'><GoalReached goal='{goal}'/></BehaviorTree></root>")
    file = tmp_path / "nav2.yaml"
    ours = f"bt_navigator:\n  ros__parameters:\n    default_nav_to_pose_bt_xml: mine.xml\n{tolerance}"
    file.write_text(PURSUIT.read_text() + ours)
    navigator = Nav2(params=str(file))
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot, np.random.default_rng(0))
    goal, scan = Goal(np.array((1.0, 0.0, 0.0)), 0.1, 0.05), Scan(np.full(4, 3.0), 0.0, 1.0, 0.1, 9.0, np.zeros(3))
    told = navigator.step(Observation(0.0, np.zeros(3), np.zeros(2), np.zeros(3), goal, scan))
    assert (told.arrived, told.gave_up is None) == (arrives, arrives)

"""The navigator nav2: its servers with scripted plug-ins, the whole of it in a small kinematic loop, and in the hospital."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.contract import Goal, Observation, Scan, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.navigators.nav2 import Nav2
from clearway.navigators.nav2.behavior_tree import defaults
from clearway.navigators.nav2.behavior_tree.actions import FollowRequest, MoveRequest, PlanRequest, ThroughRequest
from clearway.navigators.nav2.behavior_tree.servers import Error, Validity
from clearway.navigators.nav2.behaviors import BehaviorServer
from clearway.navigators.nav2.command_chain import CommandChain
from clearway.navigators.nav2.controller_server import ControllerServer
from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.parameters import read
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.monitor import CollisionMonitorParameters
from clearway.navigators.nav2.planner_server import PlannerServer
from clearway.navigators.nav2.seams import ControllerFailed, GoalOccupied, NoPath, NoValidControl, Velocity
from clearway.navigators.nav2.velocity_smoother import VelocitySmootherParameters
from clearway.perception import make_localiser
from clearway.robots import load_robot
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome
from clearway.world import simulate

pytestmark = pytest.mark.slow  # compiles for long

PURSUIT = Path(__file__).with_name("nav2_pursuit.yaml")
PERIOD = 0.1
ORIGIN = np.zeros(3)


def floor():
    """A room of 9 x 4 m around (2.5, 0)."""
    data = np.zeros((80, 180), np.int8)
    data[[0, -1]] = 100
    data[:, [0, -1]] = 100
    return OccupancyGrid(data, 0.05, (-2.0, -2.0))


@pytest.fixture(scope="module")
def robot():
    return load_robot("hosbot")


@pytest.fixture(scope="module")
def parameters(robot):
    return read(PURSUIT, robot)


@pytest.fixture
def local(parameters, robot):
    costmap = Costmap("local_costmap", parameters.local_costmap, robot, None)
    costmap.update(ORIGIN, ORIGIN)
    return costmap


class Controller:
    """Gives the commands that it is told, raises what it is told; then drives at 0.3 m/s."""

    trajectory = np.empty((0, 2))

    def __init__(self, *answers):
        self.answers, self.plans, self.resets = list(answers), [], 0

    def reset(self):
        self.resets += 1

    def set_plan(self, path):
        self.plans.append(path)

    def set_speed_limit(self, limit, percentage):
        self.limit = limit

    def compute(self, now, pose, velocity, path, goal, tolerances, view):
        answer = self.answers.pop(0) if self.answers else Velocity(0.3, 0.0, 0.0)
        if isinstance(answer, Exception):
            raise answer
        self.velocity = velocity
        return answer


def following(parameters, controller, path=None):
    server = ControllerServer(parameters.controller_server, np.random.default_rng(0), math.inf)
    server._controllers = {"FollowPath": controller}
    path = np.array(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0))) if path is None else path
    return server, server.send(FollowRequest(path, "", "", "", ""), 0.0)


def cycles(server, local, n, pose=ORIGIN, begin=0.0, current=True):
    view = local.view()
    still = Velocity(0.0, 0.0, 0.0)
    return [server.step(begin + PERIOD * k, pose, still, ORIGIN, view, current=current) for k in range(n)]


def test_a_controller_that_finds_nothing_is_waited_for_as_long_as_the_file_says(parameters, local):
    controller = Controller(Velocity(0.2, 0.0, 0.1), *[NoValidControl("stuck")] * 9)
    server, job = following(parameters, controller)
    told = cycles(server, local, 7)
    assert told[0] == (0.2, 0.0, 0.1)
    assert told[1] == told[2] == told[3] == told[4] == (0.0, 0.0, 0.0)
    assert (job.running, job.error) == (False, Error.PATIENCE_EXCEEDED)
    assert told[5] is None
    assert controller.resets == 1


def test_without_a_progress_checker_the_robot_may_stand_as_long_as_it_likes(parameters, local):
    given = {**parameters.controller_server.table, "progress_checker_plugins": ()}
    branch = settle(type(parameters.controller_server.group), given, "controller_server", None)
    without = dataclasses.replace(parameters, controller_server=branch)
    server, job = following(without, Controller())
    assert len(cycles(server, local, 200)) == 200  # longer than a progress checker takes
    assert job.running
    server, _ = following(without, Controller())
    server.cancel()
    assert server.send(FollowRequest(np.zeros((2, 3)), "", "", "mine", ""), 0.0).error is Error.INVALID_CONTROLLER


def test_a_controller_that_says_that_it_is_over_is_not_waited_for(parameters, local):
    server, job = following(parameters, Controller(ControllerFailed("no")))
    assert cycles(server, local, 1) == [(0.0, 0.0, 0.0)]
    assert job.error is Error.CONTROLLER_UNKNOWN
    assert job.message == "no"


def test_a_robot_that_does_not_get_on_fails_after_its_allowance(parameters, local):
    server, job = following(parameters, Controller())
    told = cycles(server, local, 103)
    assert job.error is Error.FAILED_TO_MAKE_PROGRESS
    assert sum(t == (0.3, 0.0, 0.0) for t in told) == 101  # movement_time_allowance is 10 s


def test_a_goal_that_is_reached_ends_following(parameters, local):
    server, job = following(parameters, Controller())
    cycles(server, local, 2)
    assert job.running
    assert cycles(server, local, 1, np.array((1.0, 0.02, 0.0)), 0.2) == [(0.0, 0.0, 0.0)]
    assert job.succeeded
    assert not server.running


def test_a_new_path_is_taken_at_the_next_cycle_and_following_goes_on(parameters, local):
    controller = Controller()
    server, job = following(parameters, controller)
    cycles(server, local, 1)
    other = np.array(((0.0, 0.0, 0.0), (0.0, 1.0, 1.5)))
    assert server.send(FollowRequest(other, "", "", "", ""), 0.1) is job
    assert len(controller.plans) == 1
    cycles(server, local, 1, begin=0.1)
    assert controller.plans[-1] is other
    assert job.running
    assert math.isclose(job.feedback.heading, math.pi / 2)
    assert job.feedback.position == 0.0


def test_following_waits_for_a_costmap_that_was_cleared_and_stops_when_it_is_cancelled(parameters, local):
    server, job = following(parameters, Controller())
    assert cycles(server, local, 1, current=False) == [None]
    assert cycles(server, local, 1, begin=0.1) == [(0.3, 0.0, 0.0)]
    server.cancel()
    assert cycles(server, local, 2, begin=0.2) == [(0.0, 0.0, 0.0), None]
    assert job.succeeded


def test_a_path_that_is_sent_again_far_from_its_beginning_is_not_found_as_in_nav2(parameters, local):
    x = np.linspace(-5.0, 0.0, 101)
    path = np.column_stack((x, np.zeros((101, 2))))
    server, job = following(parameters, Controller(), path)
    cycles(server, local, 1, np.array((-0.4, 0.0, 0.0)))
    assert job.error is Error.INVALID_PATH
    assert job.message == "nothing of the path is on the local costmap"


def test_an_unknown_plug_in_and_an_empty_path_abort(parameters):
    server = ControllerServer(parameters.controller_server, np.random.default_rng(0), math.inf)
    path = np.zeros((2, 3))
    assert server.send(FollowRequest(path, "Other", "", "", ""), 0.0).error is Error.INVALID_CONTROLLER
    assert server.send(FollowRequest(path[:0], "", "", "", ""), 0.0).error is Error.INVALID_PATH


def moved(server, local, action, request, seconds=12.0):
    """What a behaviour makes a robot do that obeys at once: the job, and the poses."""
    pose, now = np.zeros(3), 0.0
    job = server.send(action, request, now, pose)
    poses, command = [pose], Velocity(0.0, 0.0, 0.0)
    while job.running and now < seconds:
        told = server.step(now, pose, local.view())
        command = command if told is None else told
        step = np.array((command.v_x * math.cos(pose[2]), command.v_x * math.sin(pose[2]), command.omega)) * PERIOD
        pose, now = pose + step, now + PERIOD
        poses.append(pose)
    return job, np.array(poses)


def test_behaviours_turn_go_and_wait_as_far_as_they_are_told(parameters, local):
    server = BehaviorServer(parameters.behavior_server)
    job, poses = moved(server, local, "spin", MoveRequest(-1.57, allowance=10.0))
    assert job.succeeded
    assert abs(poses[-1, 2] + 1.57) < 0.05
    job, poses = moved(server, local, "backup", MoveRequest(0.3, 0.15, 10.0))
    assert job.succeeded
    assert -0.32 < poses[-1, 0] < -0.3
    job, poses = moved(server, local, "drive_on_heading", MoveRequest(0.4, 0.2, 10.0))
    assert job.succeeded
    assert 0.4 < poses[-1, 0] < 0.43
    job, poses = moved(server, local, "wait", MoveRequest(2.0))
    assert job.succeeded
    assert len(poses) == 22
    assert not poses.any()


def test_the_signs_of_a_behaviours_limits_dont_count(parameters, local):
    told = []
    for sign in (1.0, -1.0):
        back = {"acceleration_limit": 0.4 * sign, "deceleration_limit": -0.3 * sign}
        given = {**parameters.behavior_server.table, "backup": {"plugin": "nav2_behaviors::BackUp"} | back}
        server = BehaviorServer(settle(type(parameters.behavior_server.group), given, "behavior_server", None))
        told.append(moved(server, local, "backup", MoveRequest(0.3, 0.15, 10.0))[1])
    assert np.array_equal(*told)


def test_behaviours_fail_in_front_of_an_obstacle_when_late_and_on_signs_that_differ(parameters, local):
    server = BehaviorServer(parameters.behavior_server)
    assert moved(server, local, "drive_on_heading", MoveRequest(0.4, -0.2))[0].error is Error.DRIVE_INVALID_INPUT
    assert moved(server, local, "spin", MoveRequest(3.0, allowance=1.0))[0].error is Error.SPIN_TIMEOUT
    row, column = (int(c) for c in (np.array((0.0, -0.5)) - local.origin[::-1]) / local.resolution)
    local.cost[row - 4 : row + 5, column] = 254  # a wall half a metre behind
    job, poses = moved(server, local, "backup", MoveRequest(1.0, 0.3, 10.0))
    assert job.error is Error.BACKUP_COLLISION_AHEAD
    assert poses[-1, 0] > -0.1
    assert moved(server, local, "backup", MoveRequest(1.0, 0.3, 10.0, blind=True))[0].succeeded


class Planner:
    """Plans straight ahead, or fails as it is told, each time anew."""

    def __init__(self, *fails):
        self.fails = list(fails)

    def reset(self):
        pass

    def plan(self, start, goal, view):
        if self.fails and (failure := self.fails.pop(0)) is not None:
            raise failure
        return np.array((start, goal))


def test_commands_pass_the_smoother_at_its_own_rate_and_then_the_collision_monitor():
    smoother = {"smoothing_frequency": 20.0, "max_accel": (1.0, 0.0, 2.0), "max_decel": (-2.0, 0.0, -2.0)}
    stop = {"type": "polygon", "points": "[[0.4, 0.2], [0.4, -0.2], [-0.2, -0.2], [-0.2, 0.2]]", "action_type": "stop"}
    monitor = {"polygons": ("Stop",), "observation_sources": ("scan",), "Stop": stop, "scan": {"type": "scan"}}
    chain = CommandChain(
        settle(VelocitySmootherParameters, smoother, "velocity_smoother", None),
        settle(CollisionMonitorParameters, monitor, "collision_monitor", None),
    )
    free, still, go = Scan(np.full(4, 3.0), 0.0, 1.57, 0.1, 9.0, np.zeros(3)), Velocity(0, 0, 0), Velocity(0.4, 0, 0)
    outline = np.zeros((3, 2))
    told = [chain.hand_on(PERIOD * k, go, still, free, outline) for k in range(4)]
    # one cycle at the first command, then two a period of 0.05 m/s each
    assert np.allclose([t.v_x for t in told], (0.05, 0.15, 0.25, 0.35))
    near = Scan(np.full(12, 0.3), -0.3, 0.05, 0.1, 9.0, np.zeros(3))
    assert chain.hand_on(0.4, go, still, near, outline) == still
    assert chain.zone == "Stop"
    assert chain.hand_on(0.5, None, still, free, outline).v_x == 0.4
    assert chain.zone == ""
    assert CommandChain(None, None).hand_on(0.0, go, still, free, outline) == go


def test_a_path_is_planned_when_the_costmap_is_current_and_errors_have_their_codes(parameters, robot):
    costmap = Costmap("global_costmap", parameters.global_costmap, robot, floor())
    costmap.update(ORIGIN, ORIGIN)
    server = PlannerServer(parameters.planner_server, costmap)
    server._planners = {"GridBased": Planner()}
    goal = np.array((3.0, 0.0, 0.0))
    costmap.clear((), ORIGIN, None, around=False)
    job = server.send("compute_path_to_pose", PlanRequest(goal, None, ""))
    server.think(ORIGIN, ORIGIN)
    assert job.running
    costmap.update(ORIGIN, ORIGIN)
    server.think(ORIGIN, ORIGIN)
    assert job.succeeded
    assert np.array_equal(job.result[-1], goal)
    for request, error in (
        (PlanRequest(np.array((99.0, 0.0, 0.0)), None, ""), Error.GOAL_OUTSIDE_MAP),
        (PlanRequest(goal, np.array((-9.0, 0.0, 0.0)), ""), Error.START_OUTSIDE_MAP),
        (PlanRequest(goal, None, "Other"), Error.INVALID_PLANNER),
    ):
        job = server.send("compute_path_to_pose", request)
        server.think(ORIGIN, ORIGIN)
        assert job.error is error
    for failure, error in ((NoPath("walled in"), Error.NO_VALID_PATH), (GoalOccupied("a bed"), Error.GOAL_OCCUPIED)):
        server._planners = {"GridBased": Planner(failure)}
        job = server.send("compute_path_to_pose", PlanRequest(goal, None, ""))
        server.think(ORIGIN, ORIGIN)
        assert (job.error, job.message) == (error, str(failure))


@pytest.mark.parametrize(
    ("failures", "partly", "error", "length", "reached"),
    [
        ((), False, Error.NONE, 5, -1),
        ((None, None, NoPath("walled in")), False, Error.THROUGH_NO_VALID_PATH, 0, -1),
        ((None, None, NoPath("walled in")), True, Error.NONE, 3, 1),
        ((GoalOccupied("a bed"),), True, Error.THROUGH_GOAL_OCCUPIED, 0, -1),
    ],
)
def test_a_path_leads_through_goals_one_after_another(parameters, robot, failures, partly, error, length, reached):
    costmap = Costmap("global_costmap", parameters.global_costmap, robot, floor())
    costmap.update(ORIGIN, ORIGIN)
    given = {**parameters.planner_server.table, "allow_partial_planning": partly}
    server = PlannerServer(settle(type(parameters.planner_server.group), given, "planner_server", None), costmap)
    server._planners = {"GridBased": Planner(*failures)}
    goals = np.array(((1.0, 0.5, 0.0), (2.0, -0.5, 0.0), (3.0, 0.0, 0.0), (4.0, 0.0, 0.0)))
    job = server.send("compute_path_through_poses", ThroughRequest(goals, None, ""))
    alone = server.send("compute_path_to_pose", PlanRequest(goals[0], None, ""))
    server.think(ORIGIN, ORIGIN)
    assert job.error is error
    assert not alone.running  # the two actions don't end each other
    if job.succeeded:
        assert job.result.last_reached == reached
        assert np.array_equal(job.result.path, np.vstack((ORIGIN, goals))[:length])
    job = server.send("compute_path_through_poses", ThroughRequest(goals[:0], None, ""))
    server.think(ORIGIN, ORIGIN)
    assert job.error is Error.NO_VIAPOINTS_GIVEN


def test_a_path_is_valid_until_something_stands_on_what_is_left_of_it(parameters, robot):
    costmap = Costmap("global_costmap", parameters.global_costmap, robot, floor())
    costmap.update(ORIGIN, ORIGIN)
    server = PlannerServer(parameters.planner_server, costmap)
    path = np.stack((np.arange(0.0, 4.0, 0.1), np.zeros(40), np.zeros(40)), axis=1)
    ask = Validity(path, 254, False, "", -1.0, False)
    assert server.invalid_poses(ask, ORIGIN, ORIGIN) == []
    row, column = int(2.0 / 0.05), int(4.0 / 0.05)  # at (2, 0)
    costmap.cost[row, column] = 254
    bad = server.invalid_poses(ask, ORIGIN, ORIGIN)
    assert bad
    assert min(abs(path[i, 0] - 2.0) for i in bad) < 0.35
    assert server.invalid_poses(ask, np.array((3.0, 0.0, 0.0)), ORIGIN) == []  # it lies behind
    assert server.invalid_poses(ask._replace(lookahead=1.0), ORIGIN, ORIGIN) == []
    assert server.invalid_poses(ask._replace(layer="nothing"), ORIGIN, ORIGIN) is None
    longer = ((1.0, 0.1), (1.0, -0.1), (-0.1, -0.1), (-0.1, 0.1))  # a metre ahead
    bad = server.invalid_poses(ask._replace(outline=longer), ORIGIN, ORIGIN)
    assert bad
    assert path[bad[0], 0] == pytest.approx(1.0, abs=0.1)


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

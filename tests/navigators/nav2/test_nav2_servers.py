"""The servers of the navigator nav2, with scripted plug-ins."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from clearway.contract import Scan
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
from rooms import floor

pytestmark = pytest.mark.slow  # compiles for long

PURSUIT = Path(__file__).with_name("nav2_pursuit.yaml")
PERIOD = 0.1
ORIGIN = np.zeros(3)


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

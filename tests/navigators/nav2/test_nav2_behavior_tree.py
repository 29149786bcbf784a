"""The interpreter of behaviour trees: sequences of ticks worked out by hand from the sources' rules."""

from __future__ import annotations

import numpy as np
import pytest
from scripted_servers import F, R, S, World, rooted, run, tree

from clearway.navigators.nav2.behavior_tree import defaults
from clearway.navigators.nav2.behavior_tree.nodes import Status
from clearway.navigators.nav2.behavior_tree.reader import KINDS, parse_trees
from clearway.navigators.nav2.behavior_tree.routes import RouteRequest
from clearway.navigators.nav2.behavior_tree.servers import Error


def test_a_sequence_goes_on_where_it_ran_and_a_reactive_one_begins_anew():
    plain = World(wait=[R], spin=[R])
    told = run(tree("<Sequence><Wait/><Spin/></Sequence>", plain), plain, 5)
    assert told == [(R, ["wait"]), (R, []), (R, ["spin"]), (R, []), (S, [])]
    reactive = World(spin=[R])
    told = run(
        tree("<ReactiveSequence><ValidatePath path='{p}'/><Spin/></ReactiveSequence>", reactive, p=np.ones((1, 3))),
        reactive,
        3,
    )
    assert told == [(R, ["validate", "spin"]), (R, ["validate"]), (S, ["validate"])]


def test_a_reactive_sequence_halts_what_runs_when_an_earlier_child_fails():
    world = World(spin=[R, R, R])
    root = tree("<ReactiveSequence><ValidatePath path='{p}'/><Spin/></ReactiveSequence>", world, p=np.ones((1, 3)))
    run(root, world, 2)
    world.bad = [0]
    assert run(root, world, 1) == [(F, ["validate", "cancel spin"])]
    assert root.status is F
    assert root.children[1].status is Status.IDLE


def test_a_sequence_with_memory_goes_on_with_the_child_that_failed_a_plain_one_with_the_first():
    for kind, second in (("SequenceWithMemory", ["spin"]), ("Sequence", ["clear global_costmap", "spin"])):
        world = World(spin=[Error.SPIN_COLLISION_AHEAD])
        root = tree(f"<{kind}><ClearEntireCostmap/><Spin/></{kind}>", world)
        assert [told[0] for told in run(root, world, 2)] == [R, F]
        assert run(root, world, 2) == [(R, second), (S, [])]


def test_a_fallback_takes_the_next_child_and_an_inverter_turns_the_answer_round():
    world = World(spin=[Error.SPIN_TIMEOUT])
    told = run(tree("<Fallback><Spin/><Inverter><Wait/></Inverter></Fallback>", world), world, 3)
    assert told == [(R, ["spin"]), (R, ["wait"]), (F, [])]


def test_a_pipeline_asks_the_earlier_children_while_a_later_one_runs():
    world = World(follow_path=[R, R])
    body = "<PipelineSequence><ValidatePath path='{p}'/><FollowPath path='{p}'/></PipelineSequence>"
    told = run(tree(body, world, p=np.ones((2, 3))), world, 4)
    assert told == [(R, ["validate", "follow_path"]), (R, ["validate"]), (R, ["validate"]), (S, ["validate"])]


def test_a_pipeline_goes_past_an_earlier_child_that_runs_again():
    """The second planning runs, yet the controller is asked in the same tick (last_child_ticked_)."""
    world = World(compute_path_to_pose=[S, R, S], follow_path=[R] * 9)
    body = (
        "<PipelineSequence><RateController hz='2'><ComputePathToPose goal='{goal}' path='{path}'/></RateController>"
        "<FollowPath path='{path}'/></PipelineSequence>"
    )
    told = run(tree(body, world, goal=np.zeros(3)), world, 9)
    assert [asked for _, asked in told[:2]] == [["compute_path_to_pose"], ["follow_path"]]
    assert told[6] == (R, ["compute_path_to_pose"])  # 0.5 s after the first path came at 0.1 s
    assert told[8] == (R, ["follow_path"])  # the controller is handed the new path


def test_a_recovery_node_tries_again_so_many_times():
    world = World(spin=[Error.SPIN_TIMEOUT] * 9)
    root = tree(
        "<RecoveryNode number_of_retries='2'><Spin/><ClearEntireCostmap service_name='local_costmap/x'/></RecoveryNode>",
        world,
    )
    again = ["clear local_costmap", "spin"]
    assert run(root, world, 4) == [(R, ["spin"]), (R, again), (R, again), (F, [])]
    assert run(root, world, 2)[0] == (R, ["spin"])  # it begins anew


def test_a_recovery_node_fails_when_the_recovery_does():
    world = World(spin=[Error.SPIN_TIMEOUT], wait=[Error.SPIN_TIMEOUT])
    told = run(tree("<RecoveryNode number_of_retries='5'><Spin/><Wait/></RecoveryNode>", world), world, 3)
    assert [answer for answer, _ in told] == [R, R, F]


@pytest.mark.parametrize(("wrap", "last", "again"), [("true", S, ["spin"]), ("false", F, ["spin"])])
def test_a_round_robin_takes_turns_and_ends_behind_its_last_child_unless_it_wraps(wrap, last, again):
    world = World()
    root = tree(f"<RoundRobin wrap_around='{wrap}'><Spin/><Wait/></RoundRobin>", world)
    assert run(root, world, 4) == [(R, ["spin"]), (S, []), (R, ["wait"]), (last, [])]
    assert run(root, world, 1) == [(R, again)]


def test_a_round_robin_asks_the_next_child_at_once_after_a_failure():
    world = World(spin=[Error.SPIN_COLLISION_AHEAD])
    root = tree("<RoundRobin><Spin/><Wait/><BackUp/></RoundRobin>", world)
    assert run(root, world, 3) == [(R, ["spin"]), (R, ["wait"]), (S, [])]


def test_a_rate_controller_counts_from_the_last_success():
    world = World(wait=[R] * 99)
    body = (
        "<PipelineSequence><RateController hz='1.0'><ComputePathToPose goal='{goal}' path='{path}'/></RateController>"
        "<Wait wait_duration='99'/></PipelineSequence>"
    )
    root = tree(body, world, goal=np.zeros(3))
    asked = [i for i, (_, log) in enumerate(run(root, world, 30)) if "compute_path_to_pose" in log]
    assert asked == [0, 11, 22]  # a success one tick later, then 1.0 s


def test_distance_and_speed_controllers_and_a_goal_that_changes():
    for kind, port in (("DistanceController", "distance='1.0'"), ("GoalUpdatedController", "")):
        world = World(wait=[R] * 99)
        body = (
            f"<PipelineSequence><{kind} {port}><ComputePathToPose goal='{{goal}}' path='{{path}}'/></{kind}>"
            "<Wait/></PipelineSequence>"
        )
        root = tree(body, world, goal=np.zeros(3))
        asked = []
        for i in range(40):
            world.pose = np.array((0.1 * i, 0.0, 0.0))
            if i == 25:
                root.board.set("goal", np.ones(3))
            root.execute()
            if "compute_path_to_pose" in world.take():
                asked.append(i)
            world.step()
        assert asked == ([0, 11, 22, 33] if kind == "DistanceController" else [0, 25])
    world = World(wait=[R] * 99)
    body = (
        "<PipelineSequence><SpeedController min_rate='0.5' max_rate='1.0' max_speed='1.0'><AlwaysSuccess/></SpeedController>"
        "<Wait/></PipelineSequence>"
    )
    root = tree(body, world, goal=np.zeros(3))
    controller = root.children[0]
    for i in range(60):
        world.now, world.speed = 0.1 * i, 0.0
        root.execute()
    assert controller._period == 2.0  # it stands: the slowest rate


def test_the_goal_is_new_the_first_time_for_one_condition_and_not_for_the_other():
    world = World()
    new = tree("<GlobalUpdatedGoal/>", world, goal=np.zeros(3))
    assert [new.execute(), new.execute()] == [S, F]
    new.board.set("goal", np.ones(3))
    assert new.execute() is S
    inside = tree("<Sequence><Inverter><GoalUpdated/></Inverter><Wait/></Sequence>", world, goal=np.zeros(3))
    assert inside.execute() is R
    for kind in ("GoalUpdated", "GlobalUpdatedGoal"):
        assert "goal" in KINDS[kind].PORTS


def test_what_is_left_of_a_path_and_whether_it_is_near():
    world = World()
    path = np.stack((np.arange(0.0, 10.1, 0.5), np.zeros(21), np.zeros(21)), axis=1)
    world.pose = np.array((5.2, 0.3, 0.0))
    cut = tree(
        "<TruncatePathLocal input_path='{path}' output_path='{rest}' distance_forward='-1' distance_backward='0'/>",
        world,
        path=path,
    )
    assert cut.execute() is S
    assert np.array_equal(cut.board.get("rest"), path[10:])
    both = tree(
        "<TruncatePathLocal input_path='{path}' output_path='{rest}' distance_forward='1.2' distance_backward='1.2'/>",
        world,
        path=path,
    )
    both.execute()
    assert np.array_equal(both.board.get("rest"), path[8:13])
    for threshold, answer in (("5.1", S), ("5.0", F)):
        near = tree(f"<IsGoalNearby path='{{path}}' proximity_threshold='{threshold}'/>", world, path=path)
        assert near.execute() is answer
    slow = tree(
        "<IsGoalNearby path='{path}' proximity_threshold='9.5' max_robot_pose_search_dist='1.5'/>", world, path=path
    )
    assert slow.execute() is S  # it looks 1.5 m ahead of the path's begin, then from there
    assert slow._where._begin == 3


def test_the_default_tree_plans_at_1_hz_far_from_the_goal_and_recovers_in_turn():
    world = World(follow_path=[R] * 30)
    root = rooted(defaults.shipped(defaults.DEFAULT), world, goal=np.array((9.0, 0.0, 0.0)))
    told = run(root, world, 25)
    assert [i for i, (_, log) in enumerate(told) if "compute_path_to_pose" in log] == [0, 11, 22]
    assert told[1][1] == ["follow_path"]

    stuck = World(follow_path=[Error.FAILED_TO_MAKE_PROGRESS] * 99)
    root = rooted(defaults.shipped(defaults.DEFAULT, "jazzy"), stuck, goal=np.array((9.0, 0.0, 0.0)))
    asked = [
        what for _, log in run(root, stuck, 60) for what in log if what not in ("compute_path_to_pose", "validate")
    ]
    first = ["follow_path", "clear local_costmap", "follow_path"]
    assert asked[:5] == [*first, "clear local_costmap", "clear global_costmap"]
    turns = [what for what in asked if what in ("spin", "wait", "backup")]
    assert turns[:3] == ["spin", "wait", "backup"]


def test_an_error_that_recovery_cannot_cure_fails_the_goal_at_once():
    world = World(compute_path_to_pose=[Error.GOAL_OUTSIDE_MAP] * 9)
    root = rooted(defaults.shipped(defaults.DEFAULT), world, goal=np.zeros(3))
    assert run(root, world, 2) == [(R, ["compute_path_to_pose"]), (F, [])]


def test_a_halted_planning_leaves_no_path():
    world = World(compute_path_to_pose=[R] * 9)
    root = tree("<ComputePathToPose goal='{goal}' path='{path}'/>", world, goal=np.zeros(3), path=np.ones((4, 3)))
    root.execute()
    root.halt()
    assert world.take() == ["compute_path_to_pose", "cancel compute_path_to_pose"]
    assert len(root.board.get("path")) == 0


def test_a_path_through_goals_is_given_and_taken_back():
    body = (
        "<ComputePathThroughPoses goals='{goals}' path='{path}' last_reached_index='{last}' error_code_id='{error}'/>"
    )
    world, goals = World(), np.arange(6.0).reshape(2, 3)
    root = tree(body, world, goals=goals)
    assert [answer for answer, _ in run(root, world, 2)] == [R, S]
    assert np.array_equal(world.jobs["compute_path_through_poses"].request.goals, goals)
    assert np.array_equal(root.board.get("path"), ((0.0, 0.0, 0.0), (9.0, 0.0, 0.0)))
    assert (root.board.get("last"), root.board.get("error")) == (0, 0)
    world = World(compute_path_through_poses=[Error.THROUGH_NO_VALID_PATH])
    root = tree(f"<Fallback>{body}<WouldAPlannerRecoveryHelp error_code='{{error}}'/></Fallback>", world, path=goals)
    assert [answer for answer, _ in run(root, world, 2)] == [R, S]
    assert (len(root.board.get("path")), root.board.get("last")) == (0, -1)


def test_a_route_is_asked_for_between_poses_or_nodes_and_taken_back():
    body = "<ComputeRoute goal='{goal}' use_poses='true' route='{route}' path='{path}' error_code_id='{error}'/>"
    world, goal = World(), np.array((9.0, 0.0, 0.0))
    nodes = "<ExtractRouteNodesAsGoals route='{route}' goals='{goals}'/>"
    root = tree(f"<Sequence>{body}{nodes}</Sequence>", world, goal=goal)
    assert [answer for answer, _ in run(root, world, 2)] == [R, S]
    assert world.jobs["compute_route"].request == RouteRequest(goal, None, 0, 0)
    assert np.array_equal(root.board.get("path"), root.board.get("goals"))
    assert root.board.get("error") == 0
    world = World(compute_route=[R, Error.NO_VALID_ROUTE])
    helps = "<WouldARouteRecoveryHelp error_code='{error}'/>"
    root = tree(f"<Fallback>{body}{helps}</Fallback>", world, goal=goal, path=1)
    assert [answer for answer, _ in run(root, world, 3)] == [R, R, S]
    assert root.board.get("route") is None
    assert len(root.board.get("path")) == 0
    assert tree(nodes, world).execute() is F
    world = World(compute_route=[R] * 9)
    root = tree("<ComputeRoute start_id='3' goal_id='{last}' start='{goal}' goal='{goal}'/>", world, goal=goal, last=7)
    root.execute()
    assert world.jobs["compute_route"].request == RouteRequest(None, None, 3, 7)
    root.halt()
    assert world.take() == ["compute_route", "cancel compute_route"]
    root = tree("<ComputeRoute start='{here}' goal='{goal}' use_start='1' use_poses='1'/>", world, goal=goal, here=goal)
    root.execute()
    assert world.jobs["compute_route"].request.start is goal


def test_the_tree_on_a_route_has_it_joined_smoothed_and_followed():
    world = World(follow_path=[R] * 40)
    root = rooted(defaults.shipped(defaults.ON_ROUTES), world, goal=np.array((9.0, 0.0, 0.0)))
    told = run(root, world, 30)
    asked = [what for _, log in told for what in log]
    assert asked[:5] == ["compute_route", "compute_path_to_pose", "compute_path_to_pose", "smooth_path", "follow_path"]
    assert set(asked[5:]) == {"validate"}  # each tick: the recovery node resets the rate of 0.5 Hz below it
    request = world.jobs["smooth_path"].request
    assert np.array_equal(request.path[:, 0], (0.0, 9.0, 1.0, 8.0, 0.0, 9.0))  # to the route, along it, on from it
    assert request.smoother == "route_smoother"


@pytest.mark.parametrize(("goal", "answer"), [(9.0, R), (8.05, F)])
def test_the_tree_on_a_route_fails_as_in_nav2_where_the_goal_is_at_the_routes_end(goal, answer):
    world = World(follow_path=[R] * 40)
    root = rooted(defaults.shipped(defaults.ON_ROUTES), world, goal=np.array((goal, 0.0, 0.0)))
    answers = [told for told, _ in run(root, world, 5)]
    assert (F if F in answers else R) is answer


def test_the_tree_along_a_route_plans_through_its_next_nodes():
    world = World(follow_path=[R] * 60)
    root = rooted(defaults.shipped(defaults.ALONG_ROUTES), world, goal=np.array((9.0, 0.0, 0.0)))
    told = run(root, world, 30)
    asked = [what for _, log in told for what in log if what != "validate"]
    assert asked[:3] == ["compute_route", "compute_path_through_poses", "follow_path"]
    assert asked.count("compute_route") == 1
    assert asked.count("compute_path_through_poses") == 3  # at 1 Hz
    goals = world.jobs["compute_path_through_poses"].request.goals
    assert np.array_equal(goals[:, 0], (8.0, 9.0))  # the node at 1 m is passed


def test_a_subtree_has_a_blackboard_of_its_own():
    world = World()
    trees = parse_trees(
        "<root main_tree_to_execute='A'><BehaviorTree ID='A'><SubTree ID='B' mine='{yours}' said='0.7'/></BehaviorTree>"
        "<BehaviorTree ID='B'><Sequence><Spin spin_dist='{said}' error_code_id='{mine}'/><Wait error_code_id='{other}'/></Sequence>"
        "</BehaviorTree></root>",
        "two.xml",
    )
    root = rooted(trees, world)
    told = run(root, world, 3)
    assert [answer for answer, _ in told] == [R, R, S]
    assert root.board.get("yours") == 0
    assert root.board.get("other") is None


@pytest.mark.parametrize("name", [name for name in defaults.names() if name != defaults.FOLLOW_POINT])
@pytest.mark.parametrize("version", ["main", "jazzy"])
def test_every_shipped_tree_reaches_a_goal_that_nothing_hinders(name, version):
    world = World(follow_path=[R] * 4)
    root = rooted(defaults.shipped(name, version), world, goal=np.array((9.0, 0.0, 0.0)))
    answers = [answer for answer, _ in run(root, world, 12)]
    assert S in answers
    assert F not in answers[: answers.index(S)]


def test_poses_of_paths_and_of_the_robot_and_paths_joined():
    world, path = World(), np.arange(12.0).reshape(4, 3)
    world.pose = np.array((1.0, 2.0, 0.5))
    for index, answer in (("0", 0), ("-1", 3), ("3", 3), ("-4", 0), ("4", None), ("-5", None)):
        taken = tree(f"<GetPoseFromPath path='{{path}}' index='{index}' pose='{{pose}}'/>", world, path=path)
        assert taken.execute() is (F if answer is None else S)
        assert answer is None or np.array_equal(taken.board.get("pose"), path[answer])
    assert tree("<GetPoseFromPath path='{path}' pose='{pose}'/>", world, path=path[:0]).execute() is F
    here = tree("<GetCurrentPose current_pose='{here}'/>", world)
    assert here.execute() is S
    assert np.array_equal(here.board.get("here"), world.pose)
    joined = tree("<ConcatenatePaths input_path1='{a}' input_path2='{b}' output_path='{a}'/>", world, a=path, b=path)
    assert joined.execute() is S
    assert np.array_equal(joined.board.get("a"), np.vstack((path, path)))  # the pose where they meet stays twice
    joined.board.set("a", None)
    joined.execute()
    assert np.array_equal(joined.board.get("a"), path)
    joined.board.set("b", path[:0])
    joined.board.set("a", path[:0])
    assert joined.execute() is F


@pytest.mark.parametrize(("tolerance", "answer"), [("0.5", S), ("-0.5", S), ("0.49", F)])
def test_poses_are_near_each_other_up_to_the_tolerance(tolerance, answer):
    near = f"<ArePosesNear ref_pose='{{a}}' target_pose='{{b}}' tolerance='{tolerance}'/>"
    assert tree(near, World(), a=np.zeros(3), b=np.array((0.3, 0.4, 3.0))).execute() is answer
    assert tree(near, World(), a=np.zeros(3)).execute() is F


def test_goals_are_appended_removed_when_passed_and_taken_from_the_front():
    world = World()
    goals = np.array(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (4.0, 0.0, 0.0)))
    more = tree(
        "<AppendGoalPoseToGoals input_goals='{goals}' goal_pose='{goal}' output_goals='{goals}'/>",
        world,
        goals=goals[:2],
        goal=goals[2],
    )
    assert more.execute() is S
    assert np.array_equal(more.board.get("goals"), goals)
    passed = tree("<RemovePassedGoals input_goals='{goals}' output_goals='{left}' radius='1.0'/>", world, goals=goals)
    assert passed.execute() is S
    assert np.array_equal(passed.board.get("left"), goals[2:])
    world.pose = np.array((1.5, 0.0, 0.0))  # the second is near, but the first isn't passed
    passed.execute()
    assert np.array_equal(passed.board.get("left"), goals)
    passed.board.set("goals", goals[:1])
    world.pose = np.zeros(3)
    passed.execute()
    assert np.array_equal(passed.board.get("left"), goals[:1])  # the last stays
    few = tree("<GetNextFewGoals input_goals='{goals}' num_goals='2' output_goals='{few}'/>", world, goals=goals)
    assert few.execute() is S
    assert np.array_equal(few.board.get("few"), goals[:2])
    few.board.set("goals", goals[2:])
    few.execute()
    assert np.array_equal(few.board.get("few"), goals[2:])
    few.board.set("goals", goals[:0])
    assert few.execute() is F


def test_a_goal_updater_hands_its_goal_on_at_each_tick():
    world = World(wait=[R])
    root = tree(
        "<GoalUpdater input_goal='{goal}' output_goal='{now}'><Wait/></GoalUpdater>", world, goal=np.ones(3), now=None
    )
    assert root.execute() is R
    assert np.array_equal(root.board.get("now"), np.ones(3))
    root.board.set("goal", np.zeros(3))
    assert [answer for answer, _ in run(root, world, 3)] == [R, R, S]
    assert np.array_equal(root.board.get("now"), np.zeros(3))
    assert root.child.status is Status.IDLE


@pytest.mark.parametrize("version", ["main", "jazzy"])
def test_the_tree_that_follows_a_point_plans_at_1_hz_and_never_arrives(version):
    world = World(follow_path=[R, R, S, R, R, Error.FAILED_TO_MAKE_PROGRESS])
    root = rooted(defaults.shipped(defaults.FOLLOW_POINT, version), world, goal=np.array((9.0, 0.0, 0.0)))
    told = run(root, world, 9)
    assert [answer for answer, _ in told] == [R] * 8 + [F]
    assert [i for i, (_, log) in enumerate(told) if "follow_path" in log] == [1, 5]
    world = World(follow_path=[R] * 99)
    root = rooted(defaults.shipped(defaults.FOLLOW_POINT, version), world, goal=np.array((9.0, 0.0, 0.0)))
    told = run(root, world, 25)
    assert [i for i, (_, log) in enumerate(told) if "compute_path_to_pose" in log] == [0, 11, 22]
    assert [i for i, (_, log) in enumerate(told) if "follow_path" in log] == [1, 12, 23]  # each time with the new path

"""What a file of behaviour trees may not hold."""

from __future__ import annotations

import pytest
from scripted_servers import World, tree

from clearway.errors import ClearwayError
from clearway.navigators.nav2.behavior_tree.reader import parse_trees


def _nested(depth: int, times: int) -> str:
    """Of a tree that has the next one as often inside, and so on."""
    inside = [f"<SubTree ID='T{i + 1}'/>" * times for i in range(depth)]
    trees = [f"<BehaviorTree ID='T{i}'><Sequence>{text}</Sequence></BehaviorTree>" for i, text in enumerate(inside)]
    return f"<root main_tree_to_execute='T0'>{''.join(trees)}<BehaviorTree ID='T{depth}'><Spin/></BehaviorTree></root>"


@pytest.mark.parametrize(
    ("depth", "times", "words"),
    [
        (14, 2, "65,533 nodes once its subtrees are written out; at most 10,000"),
        (15, 100, "at most 10,000"),
        (20, 1, "deeper"),
    ],
)
def test_subtrees_are_no_bomb(depth: int, times: int, words: str) -> None:
    with pytest.raises(ClearwayError, match=words):
        parse_trees(_nested(depth, times), "mine.xml")
    parse_trees(_nested(5, 4), "mine.xml")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("<Spinn/>", ["unknown node type 'Spinn'", "did you mean 'Spin'"]),
        ("<ComputeAndTrackRoute/>", ["'ComputeAndTrackRoute'", "not built", "closest"]),
        ("<Spin spin_dst='1'/>", ["unknown attribute 'spin_dst'", "spin_dist"]),
        ("<Spin spin_dist='far'/>", ["'far'", "a number"]),
        ("<Spin spin_dist='nan'/>", ["'nan'", "a number"]),
        ("<Spin path='/etc/passwd'/>", ["unknown attribute 'path'"]),
        ("<FollowPath path='here'/>", ["'here'", "{path}"]),
        ("<RecoveryNode><Spin/></RecoveryNode>", ["RecoveryNode", "1 children", "takes 2"]),
        ("<RateController hz='1'><Spin/><Wait/></RateController>", ["2 children", "takes 1"]),
        ("<Spin><Wait/></Spin>", ["1 children", "takes none"]),
        ("<Sequence/>", ["0 children"]),
        ("<Spin _skipIf='1 == 1'/>", ["_skipIf", "script"]),
        ("<SubTree ID='T'/>", ["stands in itself"]),
        ("<SubTree ID='U'/>", ["unknown tree 'U'"]),
        ("<SpeedController max_rate='0'><Spin/></SpeedController>", ["max_rate", "'0'; it is to be a number above 0"]),
        (
            "<SpeedController min_speed='0.5'><Spin/></SpeedController>",
            ["SpeedController", "min_speed and max_speed are both 0.5"],
        ),
        ("<GetNextFewGoals/>", ["num_goals is missing", 'num_goals="2"']),
        ("<GetNextFewGoals num_goals='0'/>", ["num_goals is 0; it is to be 1 or more"]),
        ("<ValidatePath footprint='[[0.1, 0.2]]'/>", ["footprint", "it is to be an outline such as"]),
        ("<Spin/><Wait/>", ["2 outermost nodes"]),
        ("<Inverter>" * 40 + "<Spin/>" + "</Inverter>" * 40, ["deeper"]),
    ],
)
def test_what_a_tree_may_not_hold_is_one_clear_error(body, words):
    with pytest.raises(ClearwayError) as told:
        tree(body, World())
    for word in ("T.xml", *words):
        assert word in str(told.value)


@pytest.mark.parametrize(
    "kind",
    [
        "CancelAssistedTeleop",
        "CancelComputeAndTrackRoute",
        "CancelFollowObject",
        "CheckPoseOccupancy",
        "CheckStopStatus",
        "ClearCostmapAroundPose",
        "DockRobot",
        "FollowObject",
        "NavigateToPose",
        "PauseResumeController",
        "RemoveInCollisionGoals",
        "UndockRobot",
    ],
)
def test_a_node_of_nav2s_that_is_not_there_is_said_by_name_with_what_is_closest(kind):
    with pytest.raises(ClearwayError, match=f"the node type '{kind}' .* is not built here; closest: "):
        tree(f"<{kind}/>", World())


def test_attributes_of_nav2s_that_change_nothing_here_may_stand():
    tree("<ValidatePath path='{p}' service_name='is_path_valid' footprint=''/>", World())
    tree("<IsPathValid path='{p}' service_name='is_path_valid'/>", World())
    tree("<WouldAPlannerRecoveryHelp error_code='{e}' error_codes_to_check='208'/>", World())


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<root", "not XML"),
        ("<tree/>", "<root>"),
        ("<root/>", "no <BehaviorTree>"),
        ("<root><include path='x.xml'/></root>", "<include>"),
        ("<!DOCTYPE a [<!ENTITY b 'cc'>]><root>&b;</root>", "no document type"),
        ("<root main_tree_to_execute='X'><BehaviorTree ID='A'><Spin/></BehaviorTree></root>", "unknown tree 'X'"),
    ],
)
def test_a_file_that_is_no_tree_is_one_clear_error(text, word):
    with pytest.raises(ClearwayError, match=word):
        parse_trees(text, "some.xml")

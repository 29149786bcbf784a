"""The trees that Nav2 ships for one goal, in words of our own (nav2_bt_navigator/behavior_trees, their files' names).

RecoveryNode, 6 times
 |- PipelineSequence
 |   |- which plug-ins
 |   |- at a rate: a path, if the old one won't do; else the global costmap is cleared, once
 |   `- the path followed; else the local costmap is cleared, once
 `- one after another: costmaps cleared, a turn, a wait, a step back
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from clearway.errors import ClearwayError, unknown
from clearway.navigators.nav2.behavior_tree.reader import Spec, Trees, check, node, read_trees

Version = Literal["main", "jazzy"]
"""A branch of Nav2."""

DEFAULT = "navigate_to_pose_w_replanning_and_recovery"
"""The tree that runs where a file names none."""

FOLLOW_POINT = "follow_point"
"""The tree that never arrives: it stays a metre from the goal until the goal moves on."""


def _plan(goal: str = "{goal}") -> Spec:
    return node(
        "ComputePathToPose",
        goal=goal,
        path="{path}",
        planner_id="{selected_planner}",
        error_code_id="{compute_path_error_code}",
        error_msg="{compute_path_error_msg}",
    )


def _follow(path: str = "{path}") -> Spec:
    return node(
        "FollowPath",
        path=path,
        controller_id="{selected_controller}",
        error_code_id="{follow_path_error_code}",
        error_msg="{follow_path_error_msg}",
        tracking_feedback="{tracking_feedback}",
    )


def _clear(costmap: str) -> Spec:
    return node("ClearEntireCostmap", service_name=f"{costmap}_costmap/clear_entirely_{costmap}_costmap")


def _select(what: str, kind: str, default: str) -> Spec:
    ports = {f"selected_{what}": f"{{selected_{what}}}", f"default_{what}": default}
    return node(f"{kind}Selector", **ports)


def _selected() -> tuple[Spec, Spec]:
    return _select("controller", "Controller", "FollowPath"), _select("planner", "Planner", "GridBased")


def _helps(who: str, code: str) -> Spec:
    return node(f"WouldA{who}RecoveryHelp", error_code=f"{{{code}_error_code}}")


def _once_more(task: Spec, costmap: str, helps: Spec | None) -> Spec:
    """A task, tried once more after its costmap was cleared, if that may help."""
    cure = _clear(costmap)
    if helps is not None:
        cure = node("Sequence", helps, cure)
    return node("RecoveryNode", task, cure, number_of_retries="1")


def _recoveries() -> Spec:
    return node(
        "ReactiveFallback",
        node("GoalUpdated"),
        node(
            "RoundRobin",
            node("Sequence", _clear("local"), _clear("global")),
            node("Spin", spin_dist="1.57", error_code_id="{spin_error_code}", error_msg="{spin_error_msg}"),
            node("Wait", wait_duration="5.0", error_code_id="{wait_error_code}", error_msg="{wait_error_msg}"),
            node(
                "BackUp",
                backup_dist="0.30",
                backup_speed="0.15",
                error_code_id="{backup_error_code}",
                error_msg="{backup_error_msg}",
            ),
        ),
    )


def _same_goal() -> Spec:
    return node("Inverter", node("GlobalUpdatedGoal"))


def _rest_is_free() -> tuple[Spec, Spec]:
    ahead = node(
        "TruncatePathLocal",
        input_path="{path}",
        output_path="{remaining_path}",
        distance_forward="-1",
        distance_backward="0.0",
    )
    return ahead, node("ValidatePath", path="{remaining_path}")


def _near() -> Spec:
    return node("IsGoalNearby", path="{path}", proximity_threshold="4.0", max_robot_pose_search_dist="1.5")


def _unless(*holds: Spec) -> Spec:
    """A new path, unless all of this holds of the old one."""
    return node("Fallback", node("ReactiveSequence", *holds), _plan())


def _pipeline(planning: Spec, following: Spec, selected: tuple[Spec, ...] | None = None) -> Spec:
    return node("PipelineSequence", *(_selected() if selected is None else selected), planning, following)


def _recovering(pipeline: Spec, recoveries: Spec) -> Spec:
    return node("RecoveryNode", pipeline, recoveries, number_of_retries="6")


def _at(hz: str, task: Spec) -> Spec:
    return node("RateController", task, hz=hz)


def _default(version: Version) -> Spec:
    planner, controller = _helps("Planner", "compute_path"), _helps("Controller", "follow_path")
    plan = _plan()
    selected: tuple[Spec, ...] = _selected()
    if version == "main":
        plan = _unless(_same_goal(), _near(), *_rest_is_free())
        selected = (
            _select("progress_checker", "ProgressChecker", "progress_checker"),
            _select("goal_checker", "GoalChecker", "general_goal_checker"),
            _select("path_handler", "PathHandler", "PathHandler"),
            *_selected(),
        )
    planning = _at("1.0", _once_more(plan, "global", planner))
    following = _once_more(_follow(), "local", controller)
    recoveries = node("Sequence", node("Fallback", controller, planner), _recoveries())
    return _recovering(_pipeline(planning, following, selected), recoveries)


def _patient(version: Version) -> Spec:
    plan = _unless(_same_goal(), _near(), *_rest_is_free()) if version == "main" else _plan()
    waiting = node("SequenceWithMemory", node("CancelControl"), node("Wait", wait_duration="5.0"))
    watch = node(
        "PathLongerOnApproach",
        node("RetryUntilSuccessful", waiting, num_attempts="1"),
        path="{path}",
        prox_len="3.0",
        length_factor="2.0",
    )
    following = node("ReactiveSequence", watch, _once_more(_follow(), "local", None))
    return _recovering(_pipeline(_at("1.0", _once_more(plan, "global", None)), following), _recoveries())


def _consistent(version: Version) -> Spec:
    young = node("Inverter", node("PathExpiringTimer", seconds="10", path="{path}"))
    if version == "main":
        plan = _unless(*_rest_is_free(), _same_goal(), node("Fallback", _near(), young))
    else:
        plan = _unless(young, _same_goal(), node("ValidatePath", path="{path}"))
    pipeline = _pipeline(_at("2.0", _once_more(plan, "global", None)), _once_more(_follow(), "local", None))
    return _recovering(pipeline, _recoveries())


def _if_invalid() -> Spec:
    return _unless(_same_goal(), node("ValidatePath", path="{path}"))


def _if_invalid_recovering() -> Spec:
    planning = _at("1.0", _once_more(_if_invalid(), "global", None))
    return _recovering(_pipeline(planning, _once_more(_follow(), "local", None)), _recoveries())


def _bounds() -> Spec:
    near = node(
        "IsWithinPathTrackingBounds",
        max_error_left="0.2",
        max_error_right="0.2",
        max_error_heading="3.14",
        tracking_feedback="{tracking_feedback}",
    )
    return node("Sequence", _plan(), node("ReactiveSequence", near, _follow()))


def _point() -> Spec:
    plan = node("GoalUpdater", _plan("{updated_goal}"), input_goal="{goal}", output_goal="{updated_goal}")
    short = node("TruncatePath", distance="1.0", input_path="{path}", output_path="{truncated_path}")
    following = node("KeepRunningUntilFailure", _follow("{truncated_path}"))
    return _pipeline(_at("1.0", node("Sequence", plan, short)), following)


_SPEEDS = {"min_rate": "0.1", "max_rate": "1.0", "min_speed": "0.0", "max_speed": "0.26"}


def names() -> tuple[str, ...]:
    """The trees that are there, by the stems of Nav2's files."""
    return tuple(_all("main"))


def _all(version: Version) -> dict[str, Spec]:
    return {
        DEFAULT: _default(version),
        "navigate_to_pose_w_replanning_goal_patience_and_recovery": _patient(version),
        "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid": _consistent(version),
        "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid": _if_invalid_recovering(),
        "navigate_w_replanning_only_if_path_becomes_invalid": _pipeline(_at("1.0", _if_invalid()), _follow()),
        "navigate_w_replanning_only_if_goal_is_updated": _pipeline(node("GoalUpdatedController", _plan()), _follow()),
        "navigate_w_replanning_distance": _pipeline(node("DistanceController", _plan(), distance="1.0"), _follow()),
        "navigate_w_replanning_speed": _pipeline(node("SpeedController", _plan(), **_SPEEDS), _follow()),
        "navigate_w_replanning_time": _pipeline(_at("1.0", _plan()), _follow()),
        "navigate_to_pose_w_bounds_check": _bounds(),
        FOLLOW_POINT: _point(),
    }


def shipped(name: str, version: Version = "main") -> Trees:
    """A tree that Nav2 ships, as in a branch of it.

    Raises:
        ClearwayError: It ships none of that name for one goal.
    """
    trees = _all(version)
    if name not in trees:
        raise unknown("behaviour tree", name, trees, field="bt_navigator.default_nav_to_pose_bt_xml")
    found = Trees(name, {name: trees[name]}, f"{name}.xml")
    check(trees[name], found)
    return found


def named(text: str, params: Path | None, version: Version = "main") -> Trees:
    """The tree that `default_nav_to_pose_bt_xml` names: a file beside that of the parameters or from here, or one that Nav2 ships.

    Args:
        text: What stands there.
        params: The file of the parameters, None for a preset.
        version: Of which branch the trees are that ship.

    Raises:
        ClearwayError: There is no such tree, or it can't be read, or asks for a node that is not there.
    """
    beside = [Path(text)] if params is None else [params.parent / text, Path(text)]
    for path in beside:
        if path.is_file():
            return read_trees(path)
    stem = text.rpartition("/")[2].removesuffix(".xml")
    try:
        return shipped(stem or DEFAULT, version)
    except ClearwayError as error:
        raise ClearwayError(f"there is no file {text}; {error.problem}", file=params, field=error.field) from error

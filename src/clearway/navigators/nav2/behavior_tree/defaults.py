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
from clearway.reading import is_there

Version = Literal["main", "jazzy"]
"""A branch of Nav2."""

DEFAULT = "navigate_to_pose_w_replanning_and_recovery"
"""The tree that runs where a file names none."""

FOLLOW_POINT = "follow_point"
"""The tree that never arrives: it stays a metre from the goal until the goal moves on."""

ON_ROUTES = "navigate_on_route_graph_w_recovery"
"""The tree that follows a route itself, with paths to its first node and from its last."""

ALONG_ROUTES = "navigate_w_routing_global_planning_and_control_w_recovery"
"""The tree that plans from node to node of a route."""


def _plan(goal: str = "{goal}", path: str = "{path}", **start: str) -> Spec:
    return node(
        "ComputePathToPose",
        goal=goal,
        path=path,
        **start,
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


def _recoveries(*, turning: bool = True) -> Spec:
    spin = node("Spin", spin_dist="1.57", error_code_id="{spin_error_code}", error_msg="{spin_error_msg}")
    return node(
        "ReactiveFallback",
        node("GoalUpdated"),
        node(
            "RoundRobin",
            node("Sequence", _clear("local"), _clear("global")),
            *((spin,) if turning else ()),
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


def _route() -> Spec:
    return node(
        "ComputeRoute",
        goal="{goal}",
        path="{route_path}",
        route="{route}",
        use_poses="true",
        error_code_id="{compute_route_error_code}",
        error_msg="{compute_route_error_msg}",
    )


def _joined(first: str, then: str) -> Spec:
    return node("ConcatenatePaths", input_path1=first, input_path2=then, output_path="{route_path}")


def _pose_of_route(index: str, pose: str) -> Spec:
    return node("GetPoseFromPath", path="{route_path}", index=index, pose=pose)


def _far(pose: str, other: str, tolerance: str) -> Spec:
    return node("Inverter", node("ArePosesNear", ref_pose=pose, target_pose=other, tolerance=tolerance))


def _first_mile() -> Spec:
    return node(
        "ReactiveSequence",
        node("GetCurrentPose", current_pose="{current_pose}"),
        _pose_of_route("0", "{route_start_pose}"),
        _far("{current_pose}", "{route_start_pose}", "0.3"),
        _plan("{route_start_pose}", "{first_mile_path}"),
        _joined("{first_mile_path}", "{route_path}"),
    )


def _last_mile() -> Spec:
    return node(
        "ReactiveSequence",
        _pose_of_route("-1", "{route_end_pose}"),
        _far("{goal}", "{route_end_pose}", "0.1"),
        _plan(path="{last_mile_path}", start="{route_end_pose}"),
        _joined("{route_path}", "{last_mile_path}"),
    )


def _unless_valid(path: str, *tasks: Spec) -> Spec:
    """Tasks every two seconds, unless the goal is the same and a path still free."""
    holds = node("ReactiveSequence", _same_goal(), node("ValidatePath", path=path))
    return _at("0.5", node("Fallback", holds, node("Sequence", *tasks)))


def _routing(task: Spec, *helps: Spec) -> Spec:
    return _once_more(task, "global", node("Fallback", *helps))


def _following_routes(*planning: Spec) -> Spec:
    """What both trees with routes do with what was planned."""
    controller = _helps("Controller", "follow_path")
    pipeline = node("PipelineSequence", *_selected(), *planning, _once_more(_follow(), "local", controller))
    helps = node("Fallback", controller, _helps("Planner", "compute_route"))
    return _recovering(pipeline, node("Sequence", helps, _recoveries(turning=False)))


def _on_route_graph() -> Spec:
    smooth = node(
        "SmoothPath",
        unsmoothed_path="{route_path}",
        smoothed_path="{path}",
        smoother_id="route_smoother",
        error_code_id="{smoother_error_code}",
        error_msg="{smoother_error_msg}",
    )
    planning = _unless_valid("{path}", _route(), _first_mile(), _last_mile(), smooth)
    return _following_routes(_routing(planning, _helps("Route", "compute_route"), _helps("Planner", "compute_path")))


def _along_route() -> Spec:
    goals = "{route_goals}"
    routing = _unless_valid(
        "{route_path}",
        _route(),
        node("ExtractRouteNodesAsGoals", route="{route}", goals=goals),
        node("AppendGoalPoseToGoals", input_goals=goals, output_goals=goals, goal_pose="{goal}"),
    )
    plan = node(
        "ComputePathThroughPoses",
        goals="{planning_goals}",
        path="{path}",
        planner_id="{selected_planner}",
        error_code_id="{compute_path_error_code}",
        error_msg="{compute_path_error_msg}",
    )
    planning = node(
        "Sequence",
        node("RemovePassedGoals", input_goals=goals, output_goals=goals, radius="3.0"),
        node("GetNextFewGoals", input_goals=goals, num_goals="2", output_goals="{planning_goals}"),
        plan,
    )
    return _following_routes(
        _routing(routing, _helps("Route", "compute_route")),
        _at("1.0", _once_more(planning, "global", _helps("Planner", "compute_path"))),
    )


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
        ON_ROUTES: _on_route_graph(),
        ALONG_ROUTES: _along_route(),
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
        if is_there(path):
            return read_trees(path)
    stem = text.rpartition("/")[2].removesuffix(".xml")
    try:
        return shipped(stem or DEFAULT, version)
    except ClearwayError as error:
        raise ClearwayError(f"there is no file {text}; {error.problem}", file=params, field=error.field) from error

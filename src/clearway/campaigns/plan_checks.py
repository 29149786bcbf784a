"""Everything that can be wrong with a campaign, looked at before its first trial runs."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.campaigns.drawing import drawn
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.campaigns.robot_tables import in_file_of, unread_tables
from clearway.campaigns.tuning import tuned_on
from clearway.errors import ClearwayError
from clearway.navigators.registry import check_parameters, make_navigator
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario


def check_plan(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> None:
    """Look at everything that can be wrong before the first trial runs; of scenarios that are drawn, at the first of a kind.

    Raises:
        ClearwayError: the first thing that is wrong.
    """
    seen: set[tuple[str, str, str, bool]] = set()
    checked: set[tuple[str, str]] = set()
    for spec in specs:
        scenario, robot = spec.scenario, load_robot(spec.robot)
        content = (spec.robot, scenario.model_dump_json(exclude={"name", "seed", "labels"}))  # repetitions are alike
        if content not in checked:
            checked.add(content)
            for problem in check_scenario(drawn(plan, spec).scenario, robot):
                file = spec.suite if spec.suite.endswith(".toml") else problem.file
                raise ClearwayError(problem.problem, file=file, field=f"{scenario.name}: {problem.field}")
        has_map = granted_map(plan.map, scenario) is not None
        combination = (spec.robot, spec.navigator, spec.localisation, has_map)
        if combination not in seen:
            seen.add(combination)
            _check_combination(plan, spec, has_map)


def _check_combination(plan: CampaignPlan, spec: TrialSpec, has_map: bool) -> None:
    """Whether the robot, with what it is told, can do what its navigator and its localiser take."""
    robot = load_robot(spec.robot)
    navigator = make_navigator(spec.navigator, **plan.options.get(spec.navigator, {}))
    with in_file_of(spec.robot, robot):
        for problem in unread_tables(robot):
            raise problem
        make_localiser(spec.localisation, robot)
        check_parameters(spec.navigator, navigator, robot)
    tuned_on(spec.navigator, navigator)
    needs: frozenset[str] = getattr(navigator, "needs", frozenset())
    if "obstacles" in needs:
        make_tracker(spec.tracking, robot)
    if "scan" in needs and robot.lidar is None:
        raise ClearwayError(f"navigator {spec.navigator!r} needs scans, and the robot {spec.robot!r} has no lidar")
    if spec.localisation == "amcl" and (robot.lidar is None or not has_map):
        lacks = (
            f"the robot {spec.robot!r} has no lidar"
            if robot.lidar is None
            else f"{spec.scenario.floor_plan!r} has no map"
        )
        raise ClearwayError(f"localisation 'amcl' cannot work: {lacks}; use 'odometry' or 'truth'")

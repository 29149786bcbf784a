"""One trial in this process, without a results directory: to step through it in a debugger, or to look at it at once."""

from __future__ import annotations

from typing import Any

from clearway.campaigns.objects import names_of, suite_name
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.worker import all_drawn, run_trials
from clearway.errors import ClearwayError
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Trial


def one_trial(scenario: Any, robot: Any, navigator: Any, *, name: str | None = None, **plan: Any) -> Trial:
    """Run one trial, as a campaign of it alone would; errors of the navigator are raised, and no decision takes too long.

    Of a scenario with several robots it is the trial of the first.

    Args:
        scenario: A `Scenario`; a scenario's file; or a suite by name, of which `name` says which scenario.
        robot: A `Robot`, or a robot's name or file.
        navigator: A navigator's class or a function that makes one, or its name or address.
        name: Which scenario of a suite; None: it has but one.
        **plan: Other fields of the `CampaignPlan`, as `localisation="truth"`.

    Raises:
        ClearwayError: something that was given is wrong, or it is several scenarios.
    """
    suite = suite_name(scenario if isinstance(scenario, Scenario | str) else str(scenario))
    selection = Selection(scenarios=() if name is None else (name,))
    asked = CampaignPlan(
        suites=(suite,), robots=names_of(robot, "robots"), navigators=names_of(navigator, "navigators"),
        selection=selection, decision_limit=None, **plan,
    )  # fmt: skip
    specs = asked.specs()
    runs = dict.fromkeys(spec.run for spec in specs)
    if len(runs) > 1:
        some = ", ".join(dict.fromkeys(spec.scenario.name for spec in specs[:3]))
        raise ClearwayError(
            f"{load_suite(suite).name!r} has {len(runs)} scenarios ({some}, ...); say which one", field="name"
        )
    return run_trials(asked, all_drawn(asked, specs), check_plan(asked, specs), raise_errors=True)[0]

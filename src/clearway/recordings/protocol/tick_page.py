"""The run sheet's page for a browser in the lab: the operator ticks what happened, and saves it as JSON for `score`. One file."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from clearway.recordings.lab.test_plan import TestPlan
from clearway.recordings.protocol.run_sheet import groups_of, page
from clearway.scenarios.scenario import Scenario

DEFAULT = "ticks.json"
"""What it saves, where the plan names no JSON."""


def tick_page(plan: TestPlan, path: Path, scenarios: Iterable[Scenario] = ()) -> str:
    """The page of a plan, as one HTML file without anything from elsewhere.

    What is ticked stays in the browser, by the plan's path: a page that is made anew of a plan that has grown finds it again.

    Args:
        plan: The test plan.
        path: Its file; where it has none, the page's.
        scenarios: Where the trials come from, as for the run sheet.
    """
    ticks = plan.test.ticks or ""
    return page(
        "tick_page.html",
        plan=plan,
        groups=groups_of(plan, scenarios),
        file=Path(ticks).name if ticks.endswith(".json") else DEFAULT,
        key="clearway ticks " + hashlib.sha256(str(path.absolute()).encode()).hexdigest()[:16],
    )

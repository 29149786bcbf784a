"""Draws a campaign's scenarios on all its workers: one takes half a second, and there may be hundreds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.pool import Pool
from clearway.campaigns.progress import ProgressCallback
from clearway.scenarios.suites import load_suite


def draw_scenarios(plan: CampaignPlan, pool: Pool, tell: ProgressCallback) -> None:
    """Draw what the plan takes from its suites' generators; `plan.specs()` then finds it drawn.

    Raises:
        ClearwayError: a suite is unknown, a seed gives no scenario, or a worker died.
    """
    generators = [g for g in (load_suite(name).generator for name in plan.suites) if g is not None]
    calls = [(i, g.draw, arguments) for i, g in enumerate(generators) for arguments in g.missing(plan.selection)]
    for done, (i, arguments, drawn) in enumerate(pool.each(_draw, calls), 1):
        generators[i].drawn[arguments] = drawn
        tell(done, len(calls), "drawing scenarios" if done < len(calls) else "scenarios drawn")


def _draw(which: int, draw: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[int, tuple[Any, ...], Any]:
    return which, arguments, draw(*arguments)

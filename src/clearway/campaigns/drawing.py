"""Draws a campaign's scenarios ahead, on all its workers: one takes half a second, and there may be hundreds."""

from __future__ import annotations

from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.worker import settle
from clearway.scenarios.suites import load_suite

Turns = Callable[..., Generator[Any]]


def draw_ahead(plan: CampaignPlan, workers: int, out: Path, tell: Callable[..., None], in_turn: Turns) -> None:
    """Draw what `plan` takes from its suites' generators; `plan.specs()` then finds it drawn.

    Args:
        workers: processes. out: named if one dies. tell: told how far it is. in_turn: runs calls in processes.

    Raises:
        ClearwayError: a suite is unknown, a seed gives no scenario, or a worker died.
    """
    if plan.selection.seeds is None:
        return
    generators = [g for g in (load_suite(name).generator for name in plan.suites) if g is not None]
    calls = [(i, arguments) for i, g in enumerate(generators) for arguments in g.calls(plan.selection)]
    if not calls:
        return
    drawn = in_turn([(_draw, (i, generators[i].draw, a)) for i, a in calls], min(workers, len(calls)), out)
    for done, (i, arguments, value) in enumerate(drawn, 1):
        generators[i].keep(value, *arguments)
        tell(done, len(calls), "drawing scenarios" if done < len(calls) else "scenarios drawn")


def _draw(
    which: int, draw: Callable[..., Any], arguments: tuple[Any, ...], parent: int | None = None
) -> tuple[int, tuple[Any, ...], Any]:
    if parent is not None:
        settle(parent)
    return which, arguments, draw(*arguments)

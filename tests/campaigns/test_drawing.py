"""Scenarios drawn by other processes are those that `plan.specs()` would have drawn itself, and are not drawn twice."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from clearway.campaigns.drawing import draw_scenarios
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.pool import pool
from clearway.errors import ClearwayError
from clearway.scenarios import sar_draws
from clearway.scenarios.suites import Selection, load_suite


@pytest.fixture(autouse=True)
def nothing_drawn() -> None:
    """Without what other tests have drawn."""
    forget()


def forget() -> None:
    for suite in ("sar-case1", "sar-case2", "sar-stress", "sar-confined"):
        generator = load_suite(suite).generator
        assert generator is not None
        generator.drawn.clear()


def draw(plan: CampaignPlan, workers: int = 1, tell: Any = lambda *what: None) -> None:
    with pool(workers, Path()) as work:
        draw_scenarios(plan, work, tell)


@pytest.mark.parametrize("workers", [1, 2])
def test_drawn_by_the_workers(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = CampaignPlan(("sar-case1", "sar-stress"), selection=Selection(seeds=(40, 43)))
    expected = [s.scenario for s in plan.specs()]
    forget()
    told: list[tuple[int, int, str]] = []
    draw(plan, workers, lambda *what: told.append(what))
    assert [t[:2] for t in told] == [(k, 6) for k in range(1, 7)]
    monkeypatch.setattr(sar_draws, "examine", lambda *_: pytest.fail("drawn again"))
    assert [s.scenario for s in plan.specs()] == expected
    draw(dataclasses.replace(plan, seed=1), tell=lambda *_: pytest.fail("drawn again"))


def test_nothing_to_draw() -> None:
    def never(*_: object) -> None:
        pytest.fail("nothing was to be drawn")

    for plan in (CampaignPlan(("sar-case1",)), CampaignPlan(("sar-case1",), selection=Selection(seeds=(7, 7)))):
        draw(plan, tell=never)
    only = CampaignPlan(("sar-confined",), selection=Selection(seeds=(3, 4), batches=("case 1 confined",)))
    told: list[int] = []
    draw(only, tell=lambda done, *_: told.append(done))
    assert told == [1]


def test_what_a_seed_cannot_give_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sar_draws, "DRAWS", 1)
    plan = CampaignPlan(("sar-case2",), selection=Selection(seeds=(0, 9)))
    with pytest.raises(ClearwayError, match=r"case 2, seed [0-9]: none of 1 draws makes a solvable scenario"):
        draw(plan)

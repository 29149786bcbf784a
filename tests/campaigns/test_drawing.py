"""Scenarios drawn ahead by other processes are those that `plan.specs()` would have drawn itself, and are not drawn twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.campaigns.campaign import finished_in_turn
from clearway.campaigns.drawing import draw_ahead
from clearway.campaigns.plan import CampaignPlan
from clearway.errors import ClearwayError
from clearway.scenarios import sar_draws
from clearway.scenarios.suites import Selection

HERE = Path()


@pytest.mark.parametrize("workers", [1, 2])
def test_drawn_ahead(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = CampaignPlan(("sar-case1", "sar-stress"), selection=Selection(seeds=(40, 43)))
    monkeypatch.setattr(sar_draws, "_AHEAD", {})  # without what other tests have left there
    sar_draws.generate.cache_clear()
    expected = [s.scenario for s in plan.specs()]
    sar_draws.generate.cache_clear()
    told: list[tuple[int, int, str]] = []
    draw_ahead(plan, workers, HERE, lambda *what: told.append(what), finished_in_turn)
    assert [t[:2] for t in told] == [(k, 6) for k in range(1, 7)]
    sar_draws.generate.cache_clear()
    if workers == 2:  # what was drawn has travelled here
        monkeypatch.setattr(sar_draws, "examine", lambda *_: pytest.fail("drawn again"))
    assert [s.scenario for s in plan.specs()] == expected
    assert sar_draws._AHEAD == {}


def test_nothing_to_draw() -> None:
    def never(*_: object) -> None:
        pytest.fail("nothing was to be drawn")

    for plan in (CampaignPlan(("sar-case1",)), CampaignPlan(("sar-case1",), selection=Selection(seeds=(7, 7)))):
        draw_ahead(plan, 1, HERE, never, finished_in_turn)
    only = CampaignPlan(("sar-confined",), selection=Selection(seeds=(3, 4), batches=("case 1 confined",)))
    told: list[int] = []
    draw_ahead(only, 1, HERE, lambda done, *_: told.append(done), finished_in_turn)
    assert told == [1]


def test_what_a_seed_cannot_give_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sar_draws, "DRAWS", 1)
    sar_draws.generate.cache_clear()
    plan = CampaignPlan(("sar-case2",), selection=Selection(seeds=(0, 9)))
    with pytest.raises(ClearwayError, match=r"case 2, seed [0-9]: none of 1 draws makes a solvable scenario"):
        draw_ahead(plan, 1, HERE, lambda *_: None, finished_in_turn)

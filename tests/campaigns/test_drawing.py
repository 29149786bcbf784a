"""Scenarios from seeds: outlines before the first trial, each drawn once when a trial needs it, and kept."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.drawing import KEPT, drawn
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.provenance import asked_of_plan
from clearway.campaigns.rerun import rerun
from clearway.errors import ClearwayError
from clearway.robots import load_robot
from clearway.scenarios import sar_draws
from clearway.scenarios.suites import Selection, load_suite

PLAN = CampaignPlan(("sar-case1", "sar-stress"), selection=Selection(seeds=(40, 43)))


@pytest.fixture(autouse=True)
def nothing_drawn() -> None:
    """Without what other tests have drawn."""
    forget()


def forget() -> None:
    for suite in ("sar-case1", "sar-case2", "sar-stress", "sar-confined"):
        generator = load_suite(suite).generator
        assert generator is not None
        generator.drawn.clear()


def never(*_: object) -> None:
    pytest.fail("something was drawn")


def test_a_plan_of_many_seeds_draws_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sar_draws, "examine", never)
    many = dataclasses.replace(PLAN, selection=Selection(seeds=(0, 2000)))
    specs = many.specs()
    assert len({spec.id for spec in specs}) == 4000
    assert specs[7].scenario.name == "case-1-seed-7-v1-r1"
    assert len(set(asked_of_plan(many, specs)["tasks"].values())) == 4000
    far = dataclasses.replace(many, selection=Selection(seeds=(0, 500_000), scenarios=("case-1-seed-499999-v1-r1",)))
    assert [spec.scenario.name for spec in far.specs()] == ["case-1-seed-499999-v1-r1"]
    for wrong in ("case-1-seed-2000-v1-r1", "case-1-seed-07-v1-r1", "case-2-seed-7-v1-r1"):
        with pytest.raises(ClearwayError, match=r"no scenario of .* has the name"):
            dataclasses.replace(many, selection=Selection(seeds=(0, 2000), scenarios=(wrong,))).specs()


@pytest.mark.slow
def test_what_is_drawn_is_what_the_suite_builds_and_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    specs = PLAN.specs()
    whole = [drawn(PLAN, spec, tmp_path) for spec in specs]
    expected = [s for suite in PLAN.suites for s in load_suite(suite).build(load_robot("rescue"), PLAN.selection, 0)]
    assert [spec.scenario for spec in whole] == expected
    assert all(len(spec.scenario.obstacles) == n for spec, n in zip(whole, [11] * 3 + [16] * 3, strict=True))
    forget()
    with monkeypatch.context() as patched:
        patched.setattr(sar_draws, "examine", never)
        assert [drawn(PLAN, spec, tmp_path) for spec in specs] == whole
    (kept, *_) = sorted((tmp_path / KEPT).iterdir())
    kept.write_bytes(kept.read_bytes().replace(b"0", b"1"))  # damaged: drawn again
    forget()
    assert [drawn(PLAN, spec, tmp_path) for spec in specs] == whole


def test_frozen_ones_are_as_they_are() -> None:
    plan = CampaignPlan(("sar-case1",))
    (spec, *_) = plan.specs()
    assert len(spec.scenario.obstacles) == 11
    assert drawn(plan, spec) is spec


@pytest.mark.slow
def test_a_campaign_a_resume_and_a_rerun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = CampaignPlan(("sar-case1",), navigators=("move-base", "colregs-apf"), selection=Selection(seeds=(40, 42)))
    drawings: list[int] = []
    examine = sar_draws.examine

    def counting(*arguments: object) -> object:
        found = examine(*arguments)  # type: ignore[arg-type]
        if not isinstance(found, str):
            drawings.append(1)
        return found

    monkeypatch.setattr(sar_draws, "examine", counting)

    def stop(done: int, total: int, note: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(BaseException, match="stopped after 2 of 4"):
        run_campaign(plan, tmp_path / "out", workers=0, progress=stop)
    assert len(drawings) == 2
    forget()
    results = run_campaign(plan, tmp_path / "out", workers=0, resume=True)
    assert len(drawings) == 3  # one to check the plan; the others were kept
    assert [len(t.attempt.bodies) for t in results] == [11] * 4
    assert not (tmp_path / "out/.partial").exists()
    again = rerun(results, 3)
    assert again.difference is None
    assert not again.changed


def test_what_a_seed_cannot_give_is_said_before_anything_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sar_draws, "DRAWS", 1)
    plan = CampaignPlan(("sar-case2",), selection=Selection(seeds=(0, 9)))
    with pytest.raises(ClearwayError, match=r"case 2, seed 0: none of 1 draws makes a solvable scenario"):
        run_campaign(plan, tmp_path / "out", workers=0)
    assert not (tmp_path / "out/campaign.json").exists()

"""`--navigator all`: every registered one that can drive a campaign's trials, and why the others don't."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import clearway
from benchmark_modules import load_benchmark
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import able
from clearway.errors import ClearwayError
from clearway.navigators.registry import navigator_names
from clearway.scenarios.suites import Selection


def test_everybody_drives_or_is_told_why_not() -> None:
    can, why = able(CampaignPlan(("hospital",), ("tiago",), selection=Selection(batches=("NO",))))
    assert sorted((*can, *why)) == navigator_names()
    assert {"move-base", "hp-st", "hp-tmpc", "hl-rrt", "colregs-apf", "orca", "social-force", "nav2"} <= set(can)
    assert why["hp-st-foresight"] == "it is told the future"


def test_who_needs_a_lidar_or_another_base_is_left_out() -> None:
    can, why = able(CampaignPlan(("crowd",), ("crowdnav-disc",), selection=Selection(configurations=("case-0",))))
    assert {"orca", "hp-st"} <= set(can)
    assert "lidar" in why["nav2"]
    assert "omnidirectional" in why["colregs-apf"]


def test_who_plans_on_a_map_is_left_out_where_there_is_none(tmp_path: Path) -> None:
    campaign = CampaignPlan(
        ("replayed",), ("tiago",), selection=Selection(configurations=("time-1",)), localisation="odometry"
    )
    can, why = able(campaign)
    assert {"hp-st", "nav2"} <= set(can)  # whose presets do without
    assert "static layer, which needs a map" in why["move-base"]
    nav2 = tmp_path / "nav2.yaml"
    layer = '{plugins: [static_layer], static_layer: {plugin: "nav2_costmap_2d::StaticLayer"}}'
    nav2.write_text(f"local_costmap: {{local_costmap: {{ros__parameters: {layer}}}}}")
    asked = {"navigators": [f"nav2[params={nav2}]"], "configurations": ["time-1"], "localisation": "odometry"}
    with pytest.raises(ClearwayError, match="local_costmap has a static layer"):
        clearway.run("replayed", robots=["tiago"], **asked)


def test_of_those_that_are_named_too_and_by_robot() -> None:
    campaign = CampaignPlan(("crowd",), ("crowdnav-disc",), selection=Selection(configurations=("case-0",)))
    can, why = able(campaign, ["crowdnav-disc=orca", "tiago=orca", "hp-tmpc", "hp-st-foresight"])
    assert can == ("crowdnav-disc=orca", "hp-st-foresight")  # who names one that is told the future means it
    assert "omnidirectional" in why["hp-tmpc"]
    assert "does not say who drives the robot 'crowdnav-disc'" in why["tiago=orca"]


@pytest.mark.slow
@pytest.mark.parametrize("able_too", [["--navigator", "orca"], []])
def test_the_contest_says_below_its_table_why_one_that_is_named_cannot_drive(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], able_too: list[str]
) -> None:
    asked = ["--suite", "crowd", "--scenarios", "1", "--workers", "0", *able_too, "--navigator", "hp-tmpc"]
    monkeypatch.setattr(sys, "argv", ["contest.py", *asked])
    load_benchmark("contest").main()
    said = capsys.readouterr().out
    [row] = [line for line in said.splitlines() if line.startswith("| crowd |")]
    *others, barred = row.split(" | ")[2:-1]
    assert ([cell[:3] for cell in others], barred) == (["1/1"] if able_too else [], "–")
    assert "\n– in crowd: without hp-tmpc: " in said


def test_what_is_wrong_whoever_drives_is_told_as_ever() -> None:
    with pytest.raises(ClearwayError, match="hospita"):
        clearway.run("hospita", navigators=["all"])

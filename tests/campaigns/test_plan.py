"""What a campaign is asked to do: which plans are refused, which trials follow from one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from campaigns.own_plans import plan
from clearway.campaigns import CampaignPlan
from clearway.campaigns.drawing import drawn
from clearway.campaigns.plan import TrialSpec
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.pool import Pool
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection, load_suite


@pytest.mark.parametrize("change", [{"suites": ()}, {"robots": ("tiago", "tiago")}])
def test_a_plan_without_sense_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ClearwayError, match=r"at least one|stands twice"):
        CampaignPlan(**({"suites": ("hospital",)} | change))


def test_a_suite_has_its_usual_robots(tmp_path: Path) -> None:
    assert CampaignPlan(("hospital",)).robots == ("hosbot", "tiago")
    assert CampaignPlan(("barn",)).robots == ("jackal",)
    corridor = Path(__file__).parents[2] / "examples" / "my_corridor.toml"
    with pytest.raises(ClearwayError, match="say which robot"):
        CampaignPlan((str(corridor),))
    own = tmp_path / "own.toml"
    own.write_text(f'name = "own"\nrobots = ["tiago"]\nfiles = ["{corridor}"]\n')
    assert CampaignPlan((str(own),)).robots == ("tiago",)


def test_a_plan_survives_json() -> None:
    asked = plan("Drives", seed=7, setups=("5 iterations", "1"), options={"a": {"b": [1, 2]}}, map="m.yaml")
    assert CampaignPlan.from_json(json.loads(json.dumps(asked.to_json()))) == asked


@pytest.mark.parametrize(
    ("change", "field", "message"),
    [
        ({"suites": 5}, "plan.suites", "5 is none of a campaign's plan"),
        ({"selection": {"repetitions": True}}, "plan.selection.repetitions", "True is none of"),
        ({"selection": {"speeds": ["x"]}}, "plan.selection.speeds.0", "'x' is none of"),
        ({"options": {"move-base": 3}}, "plan.options.move-base", "3 is none of"),
        ({"worlds": []}, "plan", "'worlds' is no field"),
        ({"selection": {"obstacles": []}}, "plan.selection", "'obstacles' is no field"),
        ({"seed": None}, "plan.seed", "None is none of"),
        ({"navigators": ["hp-st[without=" + "x" * 1000 + "]"]}, "navigators", "more than 1000 characters"),
    ],
)
def test_what_is_no_plan_is_told(change: dict[str, Any], field: str, message: str) -> None:
    values = json.loads(json.dumps(plan("Drives").to_json()))
    for key, value in change.items():
        values[key] = values[key] | value if key == "selection" else value
    with pytest.raises(ClearwayError, match=message) as told:
        CampaignPlan.from_json(values)
    assert told.value.field == field


def test_a_plan_misses_nothing() -> None:
    values = plan("Drives").to_json()
    for missing in ("seed", "selection"):
        with pytest.raises(ClearwayError, match=f"'{missing}' is missing"):
            CampaignPlan.from_json({k: v for k, v in values.items() if k != missing})


def test_what_is_selected_twice_runs_once() -> None:
    twice = CampaignPlan(("barn",), ("jackal",), selection=Selection(worlds=(4, 4), speeds=(0.5, 0.5), repetitions=1))
    assert len(twice.specs()) == 1


def test_the_whole_protocol_is_672_trials() -> None:
    specs = CampaignPlan(("hospital",)).specs()
    assert len(specs) == 672
    assert [s.index for s in specs] == list(range(672))
    assert len({s.id for s in specs}) == 672
    assert isinstance(specs[0], TrialSpec)
    by_name: dict[str, set[int]] = {}
    for s in specs:
        by_name.setdefault(s.scenario.name, set()).add(s.scenario.seed)
    assert all(len(seeds) == 1 for seeds in by_name.values())  # both robots meet the same seeds


def test_scenarios_by_name() -> None:
    every = CampaignPlan(("hospital", "sar-case1"), robots=("tiago",)).specs()
    names = ("MO-passing-v0.6-o0.6-r2", "case-1-scenario-4-v1-r1")
    some = CampaignPlan(("hospital", "sar-case1"), robots=("tiago",), selection=Selection(scenarios=names)).specs()
    assert [s.scenario for s in some] == [s.scenario for s in every if s.scenario.name in names]
    assert [s.index for s in some] == [0, 1]
    with pytest.raises(ClearwayError, match=r"'case-1-scenario-40-v1-r1'; did you mean 'case-1-scenario-4-v1-r1'\?"):
        CampaignPlan(("sar-case1",), selection=Selection(scenarios=("case-1-scenario-40-v1-r1",))).specs()
    with pytest.raises(ClearwayError, match=r"that is selected has the name 'NO-v0\.6-r1'$"):
        CampaignPlan(("sar-case1",), selection=Selection(scenarios=("NO-v0.6-r1",))).specs()


def test_a_drawn_scenario_by_name_is_drawn_alone() -> None:
    generator = load_suite("sar-case1").generator
    assert generator is not None
    generator.drawn.clear()
    selection = Selection(seeds=(0, 100), scenarios=("case-1-seed-17-v1-r1",))
    plan = CampaignPlan(("sar-case1",), selection=selection)
    (spec,) = plan.specs()
    assert spec.scenario.labels.configuration == "seed-17"
    assert not generator.drawn
    assert len(drawn(plan, spec).scenario.obstacles) == 11
    assert [seed for _, seed in generator.drawn] == [17]


def test_a_navigator_that_may_take_longer_than_a_decision_is_allowed_is_refused() -> None:
    for limit in (10.0, None):
        asked = plan("Patient", decision_limit=limit)
        assert len(check_plan(asked, asked.specs())) == 1
    asked = plan("Patient", decision_limit=9.0)
    with pytest.raises(
        ClearwayError, match=r"^decision_limit: 9 s are no longer than .*Patient' .* 9\.5 s; allow 11 s"
    ):
        check_plan(asked, asked.specs())


def test_what_drives_one_robot_at_a_time_is_refused_to_drive_two() -> None:
    asked = plan("Alone", "Drives")
    for workers in (0, 1):
        assert len(check_plan(asked, asked.specs(), Pool(workers, Path()))) == 2
    with pytest.raises(
        ClearwayError, match=r"^workers: 2 robots would drive at once, .*Alone' drives one, by the only stack"
    ):
        check_plan(asked, asked.specs(), Pool(2, Path()))
    team = CampaignPlan(
        ("meeting-points",), navigators=asked.navigators[:1],
        selection=Selection(batches=("swap",), team=("tiago", "hosbot"), repetitions=1),
    )  # fmt: skip
    with pytest.raises(
        ClearwayError, match=r"drives by the only stack there is, and so does .* give each robot its own"
    ):
        check_plan(team, team.specs())

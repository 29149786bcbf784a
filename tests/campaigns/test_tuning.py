"""How near to a trial's test its navigator's parameters were chosen: declared by navigators, told beside every result."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import clearway
from clearway.campaigns import CampaignPlan
from clearway.campaigns.tuning import TUNED_ON_COMMENT, declaration, in_words, tuned, tuned_on
from clearway.errors import ClearwayError
from clearway.navigators.registry import make_navigator
from clearway.reports import head_to_head, text
from clearway.reports.findings import Findings
from clearway.reports.outcomes import batches, trial_columns
from clearway.reports.same_tests import same_tests
from clearway.reports.tuning import declarations
from clearway.reports.verdicts import verdicts
from clearway.scenarios.suites import Selection
from clearway.tuning import Tuned, TunedOn

HERE = Path(__file__).with_name("own_navigators.py")
ON_HALL, FROZEN, DRAWN = (
    Selection(speeds=(0.6,), repetitions=1, batches=("NO",)),
    Selection(),
    Selection(seeds=(99, 101)),
)


def words(navigator: str, suite: str, robot: str, selection: Selection, seed: int = 0) -> list[str]:
    plan = CampaignPlan((suite,), (robot,), (navigator,), selection, seed)
    said = tuned_on(navigator, make_navigator(navigator))
    return list(dict.fromkeys(tuned(said, plan, spec).value for spec in plan.specs()))


@pytest.mark.parametrize(
    ("navigator", "suite", "robot", "selection", "seed", "expected"),
    [
        ("hp-st", "hospital", "tiago", ON_HALL, 3, ["on this scenario"]),
        ("hp-st[guarantee=none]", "hospital", "hosbot", ON_HALL, 3, ["on this scenario"]),
        ("hp-st", "hospital", "tiago", ON_HALL, 11, ["on this geometry"]),
        ("hp-st", "hospital", "hosbot:vendor", ON_HALL, 3, ["on this scenario"]),
        ("hp-st", "hospital", "tiago", replace(ON_HALL, floor_plan="ward"), 3, ["on other scenarios of this suite"]),
        ("hp-st", "hospital-held-out", "tiago", Selection(batches=("NO",)), 3, ["no"]),
        ("hp-st", "sar-stress", "rescue", FROZEN, 0, ["on other scenarios of this suite"]),
        ("hp-st-foresight", "sar-case2", "rescue:lidar", Selection(seeds=(299, 301)), 0,
         ["on this scenario", "on other scenarios of this suite"]),
        ("hp-st[guarantee=passive]", "sar-misspecified", "rescue", FROZEN, 0, [""]),
        ("hp-st", "sar-misspecified", "rescue", FROZEN, 0, ["on other scenarios of this suite"]),
        ("hp-tmpc", "hospital", "tiago", ON_HALL, 0, ["on this scenario"]),
        ("hp-tmpc", "hospital", "tiago", replace(ON_HALL, speeds=(1.0,)), 0, ["on this geometry"]),
        ("hp-tmpc", "hospital", "hosbot", ON_HALL, 0, ["on this geometry"]),
        ("hp-tmpc", "sar-case2", "rescue", DRAWN, 0, ["on other scenarios of this suite"]),
        ("colregs-apf", "sar-case1", "rescue", FROZEN, 0, ["on other scenarios of this suite"]),
        ("colregs-apf", "sar-case1", "rescue", Selection(seeds=(10_049, 10_051)), 0,
         ["on this scenario", "on other scenarios of this suite"]),
        ("colregs-apf-retuned", "sar-case1", "rescue", FROZEN, 0, ["on this scenario"]),
        ("colregs-apf[gains=retuned]", "sar-case2", "rescue", FROZEN, 0, ["on this scenario"]),
        ("colregs-apf-retuned", "sar-case1", "rescue", FROZEN, 1, ["on this geometry"]),
        ("colregs-apf-retuned", "sar-case1", "rescue", DRAWN, 0, ["on other scenarios of this suite"]),
        ("hl-rrt", "hospital", "tiago", ON_HALL, 0, ["no"]),
        ("ppo", "crowd", "crowdnav-disc", Selection(configurations=("case-0",)), 0, ["on other scenarios of this suite"]),
        ("ppo", "crowd", "crowdnav-disc", DRAWN, 0, ["on other scenarios of this suite"]),
        ("move-base", "hospital", "tiago", ON_HALL, 0, ["no"]),
        ("oracle", "sar-case1", "rescue", FROZEN, 0, ["no"]),
        (f"{HERE}:Drives", "hospital", "tiago", ON_HALL, 0, [""]),
    ],
)  # fmt: skip
def test_every_navigator_is_labelled(
    navigator: str, suite: str, robot: str, selection: Selection, seed: int, expected: list[str]
) -> None:
    assert words(navigator, suite, robot, selection, seed) == expected


def test_a_file_that_options_name_declares_for_them(tmp_path: Path) -> None:
    file = tmp_path / "nav2.yaml"
    text = (Path(__file__).parents[1] / "navigators" / "nav2" / "nav2_pursuit.yaml").read_text("utf-8")
    file.write_text(text, "utf-8")
    assert words(f"nav2[params={file}]", "hospital-held-out", "tiago", Selection(batches=("NO",))) == [""]
    said = json.dumps([declaration(TunedOn("hospital", seeds=(0,)))])
    file.write_text(f"{TUNED_ON_COMMENT}{said}\n{text}", "utf-8")
    assert words(f"nav2[params={file}]", "hospital-held-out", "tiago", Selection(batches=("NO",))) == ["no"]
    assert words(f"nav2[params={file}]", "hospital", "tiago", ON_HALL) == ["on this scenario"]


def test_retuned_gains_are_labelled_where_there_are_some() -> None:
    """What the label says of the frozen scenarios is what the navigator does there: it knows each by its obstacles."""
    from clearway.navigators.colregs_apf.retuned import _entries

    known = {entry["scenario"] for entry in _entries()}
    for suite in ("sar-case1", "sar-case2"):
        plan = CampaignPlan((suite,), ("rescue",), ("colregs-apf-retuned",))
        assert {spec.scenario.name for spec in plan.specs()} <= known


def test_a_navigator_of_ones_own_says_it_and_tables_tell_it(tmp_path: Path) -> None:
    """A run of the held-out suite, and one of the suite that was tuned on, side by side."""
    navigators = [f"{HERE}:Tuned", f"{HERE}:Drives"]
    results = clearway.run(
        "hospital", "hospital-held-out", robots=["tiago"], navigators=navigators,
        scenarios=["NO-v0.6-r1", "NO-v0.8-r1"], localisation="truth", out=tmp_path / "out", workers=1,
    )  # fmt: skip
    found = {(r["suite"], r["navigator"]): r["tuned"] for r in results.trials.to_pylist()}
    assert found == {
        ("hospital", navigators[0]): "on this geometry", ("hospital-held-out", navigators[0]): "no",
        ("hospital", navigators[1]): "", ("hospital-held-out", navigators[1]): "",
    }  # fmt: skip
    lines = text.headline(results.trials).splitlines()
    marked = [line for line in lines if ":Tuned‡" in line]
    assert len(marked) == 1
    rows = results.trials.to_pylist()
    assert marked[0].split()[2:6] == ["hospital", "NO", "0.6", "1"]
    assert f"{rows[0]['CT']:.2f}" in marked[0].split()
    assert lines[-1].startswith("On what parameters were chosen: ‡ on this geometry (")
    f = Findings(results)
    lines = [line for group in same_tests(f) for line in verdicts(f, group).lines]
    assert sorted(line.tuned for line in lines) == ["", "parameters chosen on this geometry in 1 of 2 trials"]
    assert [row[0].text for row in batches(f, f.systems[0]).rows] == ["hospital NO‡", "hospital-held-out NO"]
    assert "tuned" in [column["key"] for column in trial_columns(f)]
    duels = head_to_head.comparisons(f)
    assert duels
    for line in head_to_head.verdicts(f, duels):
        first, second = line.partition(": ")[0].split(" against ") if " against " in line else ("", "")
        assert first.endswith("Tuned‡") != first.endswith("Drives")
        assert second.endswith("Tuned‡") != second.endswith("Drives")
    assert text.tuned({"out": results.trials}) == {
        "out": {navigators[0]: "parameters chosen on this geometry in 1 of 2 trials"}
    }
    assert declarations(results.campaign) == [
        (navigators[0], "hospital, in hall, seed 5 (its speed)"), (navigators[1], "says nothing"),
    ]  # fmt: skip
    again = clearway.rerun(results.path, 0)
    assert again.difference is None
    assert again.now.attempt.tuned is Tuned.GEOMETRY
    assert results.trial(0).attempt.tuned is Tuned.GEOMETRY


def test_what_is_no_declaration_is_refused_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(
        ClearwayError, match=r"Mistaken'?: `tuned_on` is 'hospital'; it must be a tuple of clearway\.tuning"
    ):
        clearway.run(
            "hospital", robots=["tiago"], navigators=[f"{HERE}:Mistaken"], batches=["NO"], out=tmp_path / "out"
        )
    assert not (tmp_path / "out").exists()


def test_a_declaration_in_words() -> None:
    names = ("hp-tmpc", "oracle", f"{HERE}:Drives")
    said = {name: in_words(tuned_on(name, make_navigator(name))) for name in names}
    assert said["hp-tmpc"] == [
        "sar-case1, nobody kept which scenarios, with rescue (stand-ins)",
        "sar-case2, nobody kept which scenarios, with rescue (stand-ins)",
        "hospital, in hall, at 0.6 m/s, seed 0, with tiago (horizon and reference speed)",
        "hospital-blind, in hall, at 0.6 m/s, seed 0, with tiago (horizon and reference speed)",
    ]
    assert said["oracle"] == []
    assert said[f"{HERE}:Drives"] is None
    assert str(TunedOn("sar-case1", draws=range(100))) == "sar-case1, draws 0:100"

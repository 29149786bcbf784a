"""The report's files: what the tables say is what statistics says; figures are the same each time; nothing half-written."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from synthetic_results import write_campaign

from clearway.errors import ClearwayError
from clearway.indicators import HEADLINE
from clearway.reports import figure, theme, write_replay, write_report
from clearway.reports.conditions import deviations, vehicle
from clearway.reports.findings import Findings
from clearway.reports.grid import num, p_value, percent
from clearway.reports.outcomes import beside, breakdown, correlations, normality, significance, why
from clearway.reports.parameters import every_parameter, source, table_3
from clearway.reports.replays import in_turn
from clearway.reports.selection import representative
from clearway.reports.text import comparison
from clearway.reports.theme import themed, to_svg
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection
from clearway.statistics import compare_all, describe
from clearway.trials import Trial
from clearway.trials.store import Results, open_results
from html_outline import outline


def test_the_page_is_whole_and_refers_to_nothing_outside(report: Path) -> None:
    found = outline(report.read_text(encoding="utf-8"))
    ids = [a["id"] for _, a in found if "id" in a]
    assert len(ids) == len(set(ids))
    refs = [a.get(k) for _, a in found for k in ("href", "src", "xlink:href", "data") if a.get(k)]
    assert all(r.startswith(("#", "tables/")) for r in refs if r)
    inner = {r[1:] for r in refs if r and r.startswith("#")}
    replays = {r for r in inner if re.fullmatch(r"replay-\d+", r)}
    assert inner - replays <= set(ids)
    assert replays <= {f"replay-{i.removeprefix('trial-')}" for i in ids if i.startswith("trial-")}
    assert "url(" not in re.sub(r"url\(#[\w-]+\)", "", report.read_text(encoding="utf-8"))
    assert report.stat().st_size < 30e6


def test_files_stand_beside_the_page(report: Path, results: Results) -> None:
    names = {p.name for p in (report.parent / "figures").iterdir()}
    assert names == {
        "layout.svg", "correlations.svg", "trajectories-hosbot-move-base.svg", "trajectories-tiago-move-base.svg",
        "bars-hosbot-move-base.svg", "bars-tiago-move-base.svg",
        *(f"strips-{n}.svg" for n in ("ct", "pl", "de-max", "oe-max", "mdo", "tcs")),
    }  # fmt: skip
    with open(report.parent / "tables" / "trials.csv", encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(results)
    with open(report.parent / "tables" / "breakdown.csv", encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            parts = sum(float(row[f"T_{p}"]) for p in ("acceleration", "cruise", "approach", "rotation"))
            assert parts == pytest.approx(float(row["CT"]), abs=1e-6)


def test_the_means_on_the_page_are_those_of_statistics(report: Path, results: Results) -> None:
    rows = describe(results.trials, ["CT"]).to_pylist()
    text = report.read_text(encoding="utf-8")
    for r in rows:
        if r["n"] > 1:
            assert f">{r['mean']:.2f} ± {r['sd']:.2f}<" in text


@pytest.mark.slow
def test_the_report_is_the_same_each_time(results: Results, report: Path) -> None:
    out = results.path
    before = {
        p.relative_to(out): p.read_bytes() for p in report.parent.rglob("*") if p.is_file() and p.suffix != ".pdf"
    }
    (report.parent / "stray.txt").write_text("old")
    assert write_report(out) == report
    after = {p.relative_to(out): p.read_bytes() for p in report.parent.rglob("*") if p.is_file() and p.suffix != ".pdf"}
    assert before == after
    assert not list(out.glob(".report-*"))


def test_a_report_that_fails_leaves_the_old_one(
    results: Results, monkeypatch: pytest.MonkeyPatch, report: Path
) -> None:
    before = report.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("clearway.reports.page._figures", lambda *_: {})  # they take long
    monkeypatch.setattr("clearway.reports.page.write_tables", full)
    with pytest.raises(ClearwayError, match="No space left on device"):
        write_report(results.path)
    assert report.read_bytes() == before
    assert not list(results.path.glob(".report-*"))


def test_a_hostile_name_is_only_text(hostile: Results) -> None:
    page = write_report(hostile.path)
    found = outline(page.read_text(encoding="utf-8"))
    assert not [t for t, _ in found if t in ("img", "iframe")]
    assert not [a for _, a in found for k in a if k.startswith("on")]
    for svg in (page.parent / "figures").glob("*.svg"):
        assert "<img" not in svg.read_text(encoding="utf-8")
    assert all(re.fullmatch(r"[\w.-]+", p.name) for p in page.parent.rglob("*"))


def test_a_figure_is_the_same_svg_each_time(results: Results) -> None:
    one, two = (to_svg(figure(results, "trajectories", robot="tiago", batch="SO"), "x") for _ in range(2))
    assert one == two
    assert "<dc:date>" not in one
    inline = themed(one, "title")
    assert inline.startswith("<svg")
    assert "var(--robot)" in inline
    assert "#1f6098" not in inline


def test_figures_by_name_and_selection(results: Results) -> None:
    assert len(figure(results, "layout", batch="SO").axes) == 3
    assert len(figure(results, "bars", robot="hosbot").axes) == 4
    assert len(figure(results, "correlations").axes) == 3
    assert figure(results, "clearance", trial=5).axes[0].get_ylabel() == "clearance (m)"
    assert figure(results, "trial", trial=[5]).axes[0].get_title(loc="left").startswith("Trial 5")
    for name, selection, message in (
        ("bar", {}, "did you mean 'bars'"),
        ("layout", {"batsch": "MO"}, "did you mean 'batch'"),
        ("layout", {"batch": "XX"}, "there is CE, MO, NO, SO"),
        ("bars", {}, "select one of hosbot with move-base, tiago with move-base"),
    ):
        with pytest.raises(ClearwayError, match=re.escape(message)):
            figure(results, name, **selection)


def _rows(batch: str, configuration: str, *values: dict[str, Any]) -> list[dict[str, Any]]:
    plain: dict[str, Any] = {"batch": batch, "configuration": configuration, "speed": 0.2, "success": True, "CT": 50.0}
    blank: dict[str, Any] = {"size": None, "obstacle_speed": None, "gap": None}
    return [plain | blank | {"trial": i} | v for i, v in enumerate(values)]


def test_the_representative_trial_has_the_median_time() -> None:
    rows = _rows(
        "NO", "free", {}, {"CT": 48.0}, {"CT": 49.5, "success": False}, {"CT": 49.0}, {"CT": 17.0, "speed": 0.6}, {"CT": 51.0}
    )  # fmt: skip
    found = representative(rows)
    assert found is not None
    assert found["trial"] == 3  # of 48, 49, 50, 51 the lower one in the middle is 49
    assert representative([]) is None
    assert representative([r | {"success": False} for r in rows]) == rows[0] | {"success": False}


def test_the_representative_trial_is_one_that_figure_5_shows() -> None:
    cases: list[tuple[str, str, dict[str, Any], dict[str, Any]]] = [
        ("SO", "single", {"size": 0.03}, {"size": 0.15}),
        ("SO", "parallel", {"size": 0.6}, {"size": 0.03}),
        ("SO", "perpendicular", {"size": 0.15}, {"size": 0.03}),
        ("MO", "passing", {"obstacle_speed": 0.2}, {"obstacle_speed": 0.6}),
        ("MO", "crossing", {"obstacle_speed": 0.2}, {"obstacle_speed": 0.6}),
        ("CE", "complex", {"obstacle_speed": 0.6, "size": 0.3}, {"obstacle_speed": 0.6, "size": 0.15}),
    ]
    for batch, configuration, other, wanted in cases:
        found = representative(_rows(batch, configuration, other, wanted, other))
        assert found is not None
        assert found["trial"] == 1
        failed = representative(_rows(batch, configuration, other, wanted | {"success": False}))
        assert failed is not None
        assert failed["trial"] == 1  # a failure isn't hidden behind another condition
        elsewhere = representative(_rows(batch, configuration, other))
        assert elsewhere is not None  # what was not run can't be shown


def test_a_missed_goal_is_told_in_figures(results: Results) -> None:
    row = next(r for r in results.trials.to_pylist() if r["success"] and r["batch"] == "SO")
    attempt = results.trial(row["trial"]).attempt
    allowed = attempt.legs[0].xy_tolerance
    missed = row | {
        "success": False,
        "failure": "DE+OE",
        "DE_forth": allowed / 2,
        "DE_back": allowed + 0.0131,
        "OE_forth": 9.0,
    }
    said = why(missed, attempt)
    assert f"back: {allowed + 0.0131:.3f} m off, {allowed:g} allowed" in said
    assert "forth: 9.000 rad off" in said
    assert said.count("off") == 2
    assert (
        why(missed | {"DE_max": allowed + 0.0131, "OE_max": 9.0}, None)
        == f"{allowed + 0.0131:.3f} m off; 9.000 rad off"
    )
    assert why(row | {"reason": "Traceback\n  x\nValueError: no"}, attempt) == "ValueError: no"
    assert why(row, attempt) == ""


def test_motors_and_wheels_are_told_where_the_robot_s_file_does(
    results: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    f = Findings(results)
    assert "motors and wheels" not in dict(vehicle(f, "hosbot"))
    monkeypatch.setitem(f.robots, "hosbot", load_robot("husky:slipping"))
    assert dict(vehicle(f, "hosbot"))["motors and wheels"] == "lag 0.24 s, slip 4.1 % of the way, 18 % of turns"


def test_deviations_name_what_was_not_run_and_what_table_3_prints(results: Results) -> None:
    found = deviations(Findings(results))
    short = next(line for line in found if line.startswith("TIAGo: not the whole protocol"))
    run = [r["batch"] for r in results.trials.to_pylist() if r["robot"] == "tiago"]
    for batch, whole in (("NO", 9), ("SO", 252), ("CE", 48)):
        assert f"{batch} {run.count(batch)} of {whole}" in short
    changed = next(line for line in found if line.startswith("HOSBOT: not as the paper's Table 3"))
    assert "local obstacle range 3 m (printed: 0.3 m)" in changed
    assert "tolerance in reaching goal orientation 0.05 rad (printed: 0.01 rad)" in changed
    assert "raytrace" not in changed
    hosbot = [r for r in results.trials.to_pylist() if r["robot"] == "hosbot"]
    met = sum(r["success"] and r["OE_max"] <= 0.01 for r in hosbot)
    assert f"by the 0.01 rad of Table 3, {met} would be" in " ".join(found)
    assert not any(line.startswith("TIAGo: judged by") for line in found)


def test_a_lane_reaches_as_far_as_any_trial_shows_it(results: Results) -> None:
    crossing = figure(results, "layout", batch="MO", configuration="crossing", robot="tiago").axes[0]
    low, high = crossing.get_ylim()
    arrows: list[Any] = [t for t in crossing.texts if getattr(t, "arrow_patch", None) is not None]
    lane = next(a for a in arrows if abs(a.get_position()[0]) < 0.05)  # through the midpoint, across the whole panel
    assert lane.get_position()[1] == pytest.approx(high, abs=0.05)
    assert lane.xy[1] == pytest.approx(low, abs=0.05)
    words = figure(results, "layout", batch="SO", robot="tiago").axes[1].get_xlabel()
    assert words.startswith("S2, S3 0.15, 0.3 m")


def test_what_moves_on_later_legs_alone_is_in_the_layout(tmp_path: Path) -> None:
    def later(trial: Trial) -> Trial:
        away = (trial.leg == 0)[:, None, None]
        return replace(trial, moving_obstacles=np.where(away, np.nan, trial.moving_obstacles))

    one = Selection(batches=("MO",), configurations=("crossing",), speeds=(0.6,), repetitions=1)
    crossing = figure(write_campaign(tmp_path, ("tiago",), one, later), "layout").axes[0]
    lanes = [t for t in crossing.texts if (arrow := getattr(t, "arrow_patch", None)) and _coloured(arrow, theme.MOVING)]
    assert len(lanes) == 1


def _coloured(patch: Any, colour: str) -> bool:
    return bool(to_hex(patch.get_edgecolor()) == to_hex(colour))


def test_a_comparison_without_values_has_no_empty_table(results: Results) -> None:
    [found] = compare_all({"before": results.trials, "after": results.trials})
    assert "effect:" in comparison(found)
    nothing = comparison(replace(found, differences=found.differences.slice(0, 0)))
    assert nothing.endswith("no indicator has a value on both sides of a pair, as where one of the two never finished")
    assert "effect:" not in nothing


def test_normality_is_counted_over_the_batches(results: Results) -> None:
    f = Findings(results)
    samples = [r for r in f.described if r["indicator"] in HEADLINE and r["shapiro_p"] is not None]
    rejected = sum(r["shapiro_p"] <= 0.05 for r in samples)
    assert f"rejected at 0.05 in {rejected} of {len(samples)} samples" in normality(f)


def test_the_breakdown_stands_beside_the_papers_number(results: Results) -> None:
    grid = breakdown(Findings(results))
    assert grid is not None
    cells = {(r[0].text, r[1].text): [c.text for c in r] for r in grid.rows}
    mean = describe(results.trials.filter(_mask(results, "tiago", "NO", 0.6)), ["CT"]).to_pylist()[0]["mean"]
    assert cells["TIAGo", "0.6"][3] == "22.50 ± 1.02"
    assert cells["TIAGo", "0.6"][4] == percent(mean, 22.50)
    assert cells["TIAGo", "1"][3] == "–"  # not printed


def test_table_4_shows_what_the_paper_printed_and_what_is_significant_here(results: Results) -> None:
    f = Findings(results)
    tiago = next(s for s in f.systems if s.robot == "tiago")
    grid = significance(f, tiago)
    assert grid is not None
    rows = {(r[0].text, r[1].text, r[2].text): r for r in grid.rows}
    assert rows["PL", "SO", "0.6 → 1"][-1].text == "0.012"  # the paper's 1.17e-2
    assert rows["CT", "SO", "0.6 → 1"][-1].text == "–"
    assert rows["CT", "SO", "0.6 → 1"][6].strong


def test_no_number_of_the_paper_stands_beside_the_held_out_suite(tmp_path: Path) -> None:
    few = Selection(sizes=(0.225, 0.45), gaps=(1.25,), repetitions=2)
    results = write_campaign(tmp_path / "out", ("hosbot",), few, suite="hospital-held-out")
    f = Findings(results)
    [system] = f.systems
    assert beside(f) is None
    grids = [breakdown(f), significance(f, system), correlations(f)[0]]
    for grid in grids:
        assert grid is not None
        assert not [c.name for c in grid.columns if "paper" in c.name or c.name == "difference"]
        assert {len(row) for row in grid.rows} == {len(grid.columns)}
    page = write_report(results.path).read_text(encoding="utf-8")
    assert "Hospital navigation benchmark, held out" in page
    for said in ("Beside the paper", "Table 4", "not the whole protocol", "judged by a heading tolerance", "0 of 0"):
        assert said not in page


def _mask(results: Results, robot: str, batch: str, speed: float) -> list[bool]:
    return [(r["robot"], r["batch"], r["speed"]) == (robot, batch, speed) for r in results.trials.to_pylist()]


def test_table_3_marks_what_differs_and_names_the_source(results: Results) -> None:
    grid = table_3(Findings(results), "hosbot")
    assert grid is not None
    rows = {r[0].text: r for r in grid.rows}
    assert rows["Local raytrace range"][2].text == "5.5 m"
    assert not rows["Local raytrace range"][2].strong
    assert rows["Local obstacle range"][1].text == "0.3 m"
    assert rows["Local obstacle range"][2].strong
    assert len(rows) == 16


def test_every_parameter_has_the_source_of_its_longest_prefix() -> None:
    robot = load_robot("tiago").model_copy(update={"sources": {"drive": "a", "drive.v_max": "b"}})
    assert source(robot, "drive.v_max") == "b"
    assert source(robot, "drive.v_min") == "a"
    assert source(robot, "lidar.beams") == "–"
    assert ("drive.v_max", "1", "b") in every_parameter(robot)


def test_one_trial_as_a_page(results: Results) -> None:
    page = write_replay(results, 3)
    outline(page.read_text(encoding="utf-8"))
    assert 'id="trial-3"' in page.read_text(encoding="utf-8")
    with pytest.raises(ClearwayError, match="there is no trial 9999"):
        write_replay(results, 9999)


def test_json_in_the_page_is_what_it_was(report: Path, results: Results) -> None:
    text = report.read_text(encoding="utf-8")
    rows = json.loads(text.split('id="trial-rows">')[1].split("</script>")[0])["rows"]
    assert [r[0] for r in rows] == list(range(len(results)))
    assert [r[-1] for r in rows] == [not s for s in open_results(results.path).trials["success"].to_pylist()]


def test_numbers_as_text() -> None:
    assert num(-1.234) == "−1.23"
    assert num(None) == num(float("nan")) == "–"
    assert p_value(3.36e-15) == "3.4·10⁻¹⁵"
    assert p_value(0.0406) == "0.041"
    assert p_value(0.5) == "0.50"
    assert percent(51.0, 50.0) == "+2.0 %"


def test_the_sample_of_a_page_takes_failures_first_of_each_batch_in_turn() -> None:
    def row(trial: int, batch: str, success: bool | None) -> dict[str, object]:
        return {
            "trial": trial,
            "robot": "r",
            "navigator": "n",
            "setup": None,
            "suite": "s",
            "batch": batch,
            "success": success,
        }

    rows = [row(0, "A", True), row(1, "A", False), row(2, "A", False), row(3, "B", None), row(4, "A", False)]
    rows += [row(5, "B", False), row(6, "A", True), row(7, "B", True), row(8, "B", True)]
    assert [r["trial"] for r in in_turn(rows, rows[6])] == [6, 1, 5, 2, 4, 0, 3, 7, 8]
    assert [r["trial"] for r in in_turn(rows, None)][:2] == [1, 5]

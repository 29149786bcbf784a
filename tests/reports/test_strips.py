"""Every trial in its own unit, all systems on one scale; paper A's normalised bars only as its own figure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from synthetic_results import write_campaign

from clearway.reports import charts, figure, write_report
from clearway.reports.findings import Findings
from clearway.reports.outcomes import beside, trial_columns
from clearway.reports.strips import MOST_POINTS, strips
from clearway.scenarios.suites import Selection
from clearway.trials.store import Results


def test_all_systems_stand_on_one_scale_with_every_trial_as_a_dot(results: Results) -> None:
    f = Findings(results)
    drawn = strips(f.rows, f.name, ("DE_max",), f.tolerances)
    assert drawn is not None
    (ax,) = drawn.axes
    values = sorted(float(x) for dots in ax.collections for x, _ in dots.get_offsets().data)  # type: ignore[attr-defined]
    assert values == sorted(r["DE_max"] for r in f.rows if r["DE_max"] is not None)
    labels = [t.get_text() for t in ax.get_yticklabels()]
    assert [n for n in labels if n.startswith("SO")] == ["SO  HOSBOT", "SO  TIAGo"]
    assert ax.get_xlim()[0] == 0
    ends = {float(line.get_xdata()[0]) for line in ax.lines}  # type: ignore[index]
    assert {0.1, 0.2} <= ends  # both robots' tolerances
    n = [r for r in f.rows if (r["batch"], r["robot"]) == ("SO", "tiago")]
    assert f"{sum(r['DE_max'] is not None for r in n)}/{len(n)}" in [t.get_text() for t in ax.texts]


def test_many_trials_are_drawn_by_their_quantiles(results: Results) -> None:
    f = Findings(results)
    one = next(r for r in f.rows if r["CT"] is not None)
    many = [dict(one) | {"CT": float(i)} for i in range(MOST_POINTS + 1)]
    drawn = strips(many, f.name, ("CT",))
    assert drawn is not None
    assert not drawn.axes[0].collections
    assert len(figure(results, "strips", robot="tiago").axes) == 6


def test_below_five_trials_there_is_no_bar(results: Results) -> None:
    f = Findings(results)
    data = f.bars(f.systems[0])
    few = [dict(r) | {"n": 4} for r in data.descriptions], [dict(r) | {"n": 4} for r in data.rates]
    assert any(ax.patches for ax in charts.bars(data).axes)
    assert not any(ax.patches for ax in charts.bars(charts.Bars(*few, data.tests)).axes)


def test_the_papers_figure_is_named_so_and_stands_in_its_section(report: Path, results: Results) -> None:
    page = report.read_text(encoding="utf-8")
    assert page.index("The paper's Fig. 6, for each robot by itself") > page.index('id="paper"')
    grid = beside(Findings(results))
    assert grid is not None
    rates = [row for row in grid.rows if row[2].text == "SR"]
    assert [row[4].text for row in rates] == ["“a very high success rate”, no number"] * 2


def test_a_suite_without_a_paper_has_no_section_of_one(tmp_path: Path) -> None:
    out = tmp_path / "out"
    few = Selection(batches=("NO",), repetitions=1)
    write_campaign(out, robots=("tiago",), selection=few, suite="hospital-held-out")
    report = write_report(out)
    page = report.read_text(encoding="utf-8")
    assert "Fig. 6" not in page
    assert 'id="correlations"' not in page  # too few trials
    assert not list((report.parent / "figures").glob("bars-*"))


def test_how_a_trial_failed_is_the_second_column(results: Results) -> None:
    columns: list[dict[str, Any]] = trial_columns(Findings(results))
    keys = [c["key"] for c in columns]
    assert keys[:3] == ["trial", "verdict", "reason"]
    assert keys[keys.index("DE") + 1] == "DE_max"


def test_a_line_says_what_the_lines_differ_in(results: Results) -> None:
    rows = [r for r in Findings(results).rows if r["CT"] is not None and r["robot"] == "tiago"]

    def labels(rows: list[Any]) -> list[str]:
        drawn = strips(rows, lambda s: f"A robot of a long name · {s.navigator}", ("CT",))
        assert drawn is not None
        return [t.get_text() for t in drawn.axes[0].get_yticklabels()]

    one = [r for r in rows if r["batch"] == "SO"]
    assert labels(one) == ["SO"]
    assert labels([dict(r) | {"navigator": n} for n in ("x", "y") for r in one]) == ["x", "y"]
    assert "SO  y" in labels([dict(r) | {"navigator": n} for n in ("x", "y") for r in rows])

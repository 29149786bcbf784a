"""A suite whose figures somebody published: the page begins with whose it is, and sets them beside what was run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from synthetic_results import asked_of, write_campaign

from clearway.reports import write_report
from clearway.reports.findings import Findings
from clearway.reports.page import first_screen
from clearway.reports.published import published
from clearway.reports.suites import suites_of
from clearway.reports.text import beside_published
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials.store import Results

CASES = tuple(f"case-{k}" for k in range(24))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    selection = Selection(batches=("circle-invisible", "square-visible"), configurations=CASES)
    return write_campaign(tmp_path_factory.mktemp("crowd") / "r", ("crowdnav-disc",), selection, suite="crowd")


def test_what_is_published_stands_beside_what_was_run(results: Results) -> None:
    (table,) = published(Findings(results))
    rows = [[cell.plain for cell in row] for row in table.rows]
    assert [row[0] for row in rows] == ["circle-invisible"] * 3 + ["square-visible"] * 2
    assert rows[0][1:] == ["ORCA, as the authors print it published", "500", "0.430", "0.570", "10.86"]
    assert rows[3][2:] == ["500", "1.000", "0.000", "8.90"]
    ours = [r for r in results.trials.to_pylist() if r["batch"] == "circle-invisible"]
    reached = [r for r in ours if r["success"]]
    assert 0 < len(reached) < len(ours) == 24
    assert rows[2][2:4] == ["24", f"{len(reached) / 24:.3f} [0.789, 0.999]"]
    assert rows[2][5] == f"{sum(r['CT'] for r in reached) / len(reached):.2f}"
    assert "beside what is published" in beside_published(results)


def test_the_page_begins_with_whose_it_is(results: Results) -> None:
    assert load_suite("crowd").source in first_screen(results)["said"].tested
    page = write_report(results.path).read_text("utf-8")
    assert page.index("Chen, Liu, Kreiss and Alahi (2019)") < page.index('id="layout"') < page.index('id="published"')


def test_suites_without_published_figures_show_none(tmp_path: Path) -> None:
    results = write_campaign(tmp_path / "r", ("crowdnav-disc",), Selection(batches=("circle-visible",), configurations=CASES[:2]), suite="crowd-held-out")  # fmt: skip
    assert published(Findings(results)) == []
    assert "source" not in asked_of("hospital")["suites"]["hospital"]


@pytest.mark.parametrize(
    "told", [{"batch": "a"}, 3, {"batch": "a", "who": "b", "trials": 1, "success": 1.0, "more": 2}]
)
def test_what_is_no_published_figure_is_left_out(told: Any) -> None:
    assert suites_of({"suites": {"x": {"title": "X", "published": [told]}}}, ["x"])["x"].published == ()

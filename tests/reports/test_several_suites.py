"""Suites whose batches have the same names, in one campaign: nowhere are they taken together."""

from __future__ import annotations

import csv
from types import SimpleNamespace
from typing import Any

import pytest

import clearway
from clearway.reports import encounters, outcomes, paper, summary, text, write_report
from clearway.reports.findings import Findings
from clearway.reports.grid import span
from clearway.reports.selection import System
from clearway.statistics import compare, success_interval
from clearway.trials.store import Results

SUITES = ("crowd", "crowd-held-out")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Two cases of each, all of a batch that both have."""
    return clearway.run(
        *SUITES, navigators=["orca"], batches=["circle-visible"], configurations=["case-0", "case-1"], workers=0,
        out=tmp_path_factory.mktemp("suites") / "out",
    )  # fmt: skip


def counted(results: Results) -> dict[str, int]:
    """How many trials each suite has, by the name that its batch has in tables."""
    rows = results.trials["suite"].to_pylist()
    return {f"{suite} circle-visible": rows.count(suite) for suite in SUITES}


def test_each_suite_has_its_own_row_in_every_table(results: Results) -> None:
    f = Findings(results)
    (table,) = [outcomes.batches(f, system) for system in f.systems]
    near = encounters.people(f)[0]
    driving = encounters.driving(f)
    assert driving is not None
    for grid, batch, n in ((table, 0, 2), (near, 1, 2), (driving, 1, 2)):
        found = {row[batch].text: int(row[n].text) for row in grid.rows}
        assert found == counted(results)
    lines = text.headline(results.trials).splitlines()
    assert [line.split()[2] for line in lines[1:3]] == list(SUITES)
    means = {r["suite"]: r["CT"] for r in results.summary().to_pylist()}
    for suite, mean in means.items():
        own = [r["CT"] for r in results.trials.to_pylist() if r["suite"] == suite and r["CT"] is not None]
        assert mean == pytest.approx(sum(own) / len(own))


def test_the_page_and_its_tables_tell_them_apart(results: Results) -> None:
    page = write_report(results.path)
    written = page.read_text("utf-8")
    assert all(written.count(f"{suite} circle-visible") >= 4 for suite in SUITES)
    with open(page.parent / "tables" / "success.csv", encoding="utf-8", newline="") as file:
        assert {row["suite"]: int(row["n"]) for row in csv.DictReader(file)} == dict.fromkeys(SUITES, 2)
    with open(page.parent / "tables" / "summary.csv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["indicator"] in ("person_distance", "jerk")]
    assert [row["suite"] for row in rows] == [suite for suite in SUITES for _ in range(2)]


def test_a_comparison_has_a_part_for_each_batch_of_each_suite(results: Results) -> None:
    found = compare(results.trials, results.trials)
    assert list(found.success) == [None, *counted(results)]
    assert found.pairs == 4


@pytest.fixture(scope="module")
def protocols(tmp_path_factory: pytest.TempPathFactory) -> Findings:
    """A test of batch NO of the paper's protocol and of the held-out one, with speeds that both have."""
    return Findings(
        clearway.run(
            "hospital", "hospital-held-out", robots=["tiago"], navigators=["orca"], batches=["NO"], repetitions=1,
            localisation="truth", workers=0, out=tmp_path_factory.mktemp("protocols") / "out",
        )
    )  # fmt: skip


def test_the_rows_of_batch_no_say_of_which_suite_they_are(protocols: Findings) -> None:
    table = outcomes.breakdown(protocols)
    assert table is not None
    assert {row[0].small for row in table.rows} == {"hospital", "hospital-held-out"}


def test_beside_the_paper_stands_its_own_protocol_alone(protocols: Findings) -> None:
    table = outcomes.beside(protocols)
    assert table is not None
    (shown,) = [row[3] for row in table.rows if row[2].text == "SR"]
    own = [r["success"] for r in protocols.rows if r["suite"] == "hospital"]
    sure = success_interval(sum(own), len(own))
    assert (shown.text, shown.small) == (f"{100 * sure.estimate:.1f} %", span(100 * sure.low, 100 * sure.high, 1))


def test_trials_of_another_suite_make_no_protocol_whole() -> None:
    system = System("tiago", "orca", None)
    suites = [["hospital"] * (n - 1) + ["hospital-held-out"] for n in paper.PROTOCOL.values()]
    rows = [{"suite": s, "batch": b} for b, own in zip(paper.PROTOCOL, suites, strict=True) for s in own]
    f: Any = SimpleNamespace(asked=lambda _: ["hospital"], of=lambda _: rows)
    assert summary._short(f, system)
    f.of = lambda _: [row | {"suite": "hospital"} for row in rows]
    assert not summary._short(f, system)

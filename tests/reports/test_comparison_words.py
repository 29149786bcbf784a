"""What comparisons, and the table in the terminal, say of their own numbers, on tables made by hand."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pyarrow as pa

from clearway.indicators import row_schema
from clearway.reports import comparison_page, head_to_head, text
from clearway.reports.selection import System
from clearway.statistics import Comparison, compare, compare_all

PLAIN: Mapping[str, Any] = dict.fromkeys(row_schema().names) | {
    "suite": "s", "batch": "SO", "robot": "tiago", "speed": 0.6, "repetition": 1, "outcome": "reached", "reason": "", "failure": "",
    "success": True, "success_self": True, "not_computable": "{}", "tuned": "",
}  # fmt: skip


def system(navigator: str, succeeded: int, *, n: int = 32, alike: int = 1, times: Any = lambda i: 20.0) -> pa.Table:
    """Tests of which the first few succeeded, so many in a row repetitions of one, with a time each."""
    return pa.Table.from_pylist(
        [
            {
                **PLAIN,
                "navigator": navigator,
                "scenario": f"t{i}",
                "configuration": f"c{i // alike}",
                "repetition": 1 + i % alike,
                "success": i < succeeded,
                "CT": times(i),
            }
            for i in range(n)
        ],
        schema=row_schema(),
    )


def of_one(found: Comparison) -> str:
    """The sentence of the report's page."""
    f: Any = SimpleNamespace(of=lambda system: [])
    (said,) = head_to_head.verdicts(f, [(System("r", "x", None), System("r", "y", None), found)])
    return said


def test_intervals_are_told_by_the_confidence_that_was_asked_for() -> None:
    found = compare(system("x", 32), system("y", 32, times=lambda i: 21.0 + i), confidence=0.8)
    said = text.comparison(found)
    assert "difference (80 %)" in said
    assert "95 %" not in said
    assert comparison_page.indicator_table([found]).caption.startswith("Intervals: 80 %.")
    assert "its 80 % interval" in comparison_page.success_table([found]).caption


def test_a_long_title_stays_within_its_figure() -> None:
    named = {"results/2026-11-30-tiago-ward-3": system("x", 32), "results/2026-12-01-tiago-ward-4": system("y", 32)}
    (found,) = compare_all(named)
    figure = comparison_page.differences(found)
    figure.draw_without_rendering()
    box = figure.texts[0].get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width
    assert figure.axes[0].get_window_extent().y1 < box.y0 < box.y1 <= figure.bbox.height


def test_repetitions_of_a_test_are_told_where_pairs_are_counted() -> None:
    found = compare(system("x", 32, alike=2), system("y", 20, alike=2))
    said = "32 pairs are of 16 tests: repetitions of one are alike, so the intervals are rather too narrow, and p too small."
    assert said in text.comparison(found)
    assert said[:-1] in comparison_page.summary([found]).limits
    assert "repetitions" not in text.comparison(compare(system("x", 32), system("y", 20)))


def test_success_of_many_pairs_is_held_to_holms_correction() -> None:
    tables = {"a": system("a", 26), "b": system("b", 32), "c": system("c", 32), "d": system("d", 32)}
    alone = compare_all({name: tables[name] for name in "ab"})
    assert comparison_page.summary(alone).result == (
        "b against a, on the same 32 tests: 32 against 26 of 32 succeeded; in no indicator a difference is shown."
    )
    found = compare_all(tables)
    row = comparison_page.success_table(found).rows[0]
    assert [cell.text for cell in row[-2:]] == ["0.031", "0.19"]  # 2 / 2^6, times 6
    assert "Some intervals leave out 0 and yet nothing is shown" in comparison_page.success_table(found).caption
    (said, _), *_ = [
        (comparison_page._said(pair, p), p) for pair, p in zip(found, comparison_page.success_ps(found), strict=True)
    ]
    assert "32 against 26 of 32 succeeded (no difference shown)" in said


def test_a_mean_whose_interval_holds_0_is_told_where_ranks_show_a_difference() -> None:
    found = compare(system("x", 32), system("y", 32, times=lambda i: 22.0 if i else -40.0))
    (row,) = [r for r in found.differences.to_pylist() if r["indicator"] == "CT" and r["batch"] is None]
    assert row["boot_low"] < 0 < row["boot_high"]
    assert row["favours"] == "A"
    assert "Some intervals hold 0 and yet a difference is shown" in comparison_page.summary([found]).limits
    table = head_to_head.indicator_table([(System("r", "x", None), System("r", "y", None), found)])
    assert table is not None
    assert "Some intervals hold 0" in table.caption


def test_nobody_is_better_by_nothing() -> None:
    found = compare(system("x", 60, n=60), system("y", 60, n=60, times=lambda i: 20.0 if i < 48 else 15.0))
    assert "B is better in CT, by 1.000 s on average (0." in of_one(found)
    by_rank = of_one(compare(system("x", 9, n=9), system("y", 9, n=9, times=lambda i: 15.0 + i / 10)))
    assert "by 4.600 s (4.350 to 4.850)" in by_rank


def test_the_terminals_means_say_whom_they_leave_out() -> None:
    whole = system("x", 30)
    assert "leave out" not in text.headline(whole)
    some = pa.Table.from_pylist([r | ({} if r["success"] else {"CT": None}) for r in whole.to_pylist()], row_schema())
    assert text.headline(some).endswith("such as those that did not finish: CT 2")


def test_every_interval_of_a_share_says_of_which_kind_it_is() -> None:
    """Clopper and Pearson's beside SR; the page's first table has Wilson's, which says so too (`test_first_screen`)."""
    told = text.headline(system("x", 16))
    assert "SR [%] (95 %, exact)" in told
    assert "50 (32-68)" in told


def test_a_navigator_is_named_once_beside_what_it_was_tuned_on() -> None:
    assert text.tuned_lines({"tiago, hp-st": {"hp-st": "none"}, "hp-st": {"hp-st": "none"}}) == [
        "tiago, hp-st: none",
        "hp-st: none",
    ]
    assert text.tuned_lines({"results/a": {"hp-st": "none"}}) == ["results/a, hp-st: none"]

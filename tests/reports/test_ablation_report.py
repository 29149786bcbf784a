"""What each ingredient brings: from made-up trials whose counts and differences can be worked out on paper."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_results import asked_of

from clearway.geometry.shapes import Circle
from clearway.indicators import row_schema, score_row
from clearway.reports import ablation, head_to_head, rescue, write_report
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE
from clearway.reports.selection import System
from clearway.reports.text import beside_published, numbers
from clearway.robots import DriveLimits
from clearway.statistics import mcnemar
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Span, Trial
from clearway.trials.store import Results, TrialStore, write_partial

pytestmark = pytest.mark.slow

FULL, VARIANT, OTHER = "hp-st[guarantee=none]", "hp-st[guarantee=none,without=reverse]", "hp-tmpc"


def trial(navigator: str, number: int, time: float, *, fails: bool = False, assumptions: int = 0) -> Trial:
    """Straight over 10 m in `time` [s], where the best is 10 s; or into a disc that comes from ahead, half way."""
    n = 21 if fails else 41
    t = np.linspace(0.0, time, 41)[:n]
    pose = np.column_stack([np.linspace(0.0, 10.0, 41)[:n], np.zeros(n), np.zeros(n)])
    moving_obstacles = np.full((n, 1, 3), 50.0)
    if fails:
        moving_obstacles[:, 0] = pose[-1] + np.outer(0.6 + np.linspace(3.0, 0.0, n), [1.0, 0.0, 0.0])
    leg = Leg("way", pose[0], np.array([10.0, 0.0, 0.0]), 0.2, math.inf)
    attempt = Attempt(
        Labels("sar-case1", "case 1", f"seed-{number}", 1.0), "rescue", navigator, "truth", Circle(0.25), (leg,),
        (Body("moving-1", "moving obstacle", Circle(0.35), None),), 1.0, 0.15, scenario=f"case-1-{number}", seed=number, optimal_time=10.0,
        shortest_path=10.0, limits=DriveLimits(-1.0, 1.0, math.inf, math.inf, 1.5, math.inf, math.inf), sight=4.0,
    )  # fmt: skip
    velocity, end = np.tile([0.5, 0.0], (n, 1)), float(t[-1])
    events = [Event(0.0, "assumption", "obstacle 1: faster than 4.4 m/s")] * assumptions
    events += [Event(end, "contact", "moving obstacle 'moving-1' at 0.3 m/s, robot at 0.5 m/s", 0)] if fails else []
    return Trial(
        attempt, t, pose, velocity, pose, velocity, np.zeros(n, np.int64), moving_obstacles, (Span(0, 0.0, end, not fails),),
        tuple(events), Outcome.COLLISION if fails else Outcome.REACHED, "contact" if fails else "",
    )  # fmt: skip


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Twelve tests: the full one succeeds in all, in 11 s; without `reverse` seven times, in 12 s."""
    made = [trial(FULL, i, 11.0, assumptions=2 * (i == 3)) for i in range(12)]
    made += [trial(VARIANT, i, 12.0, fails=i < 5) for i in range(12)]
    made += [trial(OTHER, i, 20.0) for i in range(12)]
    with TrialStore(
        tmp_path_factory.mktemp("ablation") / "out", asked_of("sar-case1"), len(made), row_schema()
    ) as store:
        for i, t in enumerate(made):
            write_partial(store.partial, store.key, i, t, score_row(t))
        return store.finish()


def test_a_variant_is_known_by_its_name() -> None:
    assert ablation.variant_of(VARIANT) == (FULL, "reverse")
    assert ablation.variant_of("hp-st[without=a+b]") == ("hp-st", "a+b")
    assert ablation.variant_of("hp-st") is ablation.variant_of("hp-tmpc[solver=genetic]") is None
    assert ablation.variant_of("a/[without=b]/file.py:Own") is None
    systems = [System("r", n, s) for s in ("1", "2") for n in (FULL, VARIANT, "x[without=y]")]
    assert ablation.whole(systems) == [System("r", n, s) for s in ("1", "2") for n in (FULL, "x[without=y]")]


def test_what_the_ingredient_brings(results: Results) -> None:
    f = Findings(results)
    (table,) = ablation.tables(f)
    first, second = table.rows
    assert [c.text for c in first[1:]] == ["all", "12", "12", NONE, NONE, NONE, "1.000", "1.100", "0"]
    p = f"{mcnemar(0, 5):.3f}"
    assert p == "0.062"
    assert [c.text for c in second[1:]] == [
        "without reverse", "12", "7 : 12", "41.7", p, p, "0.000", "−0.100", "5"
    ]  # fmt: skip
    assert second[8].small == "n 7"  # too few for an interval
    low, high = (float(x) for x in second[4].small.replace("−", "-").strip("[]").split(","))
    assert 0 < low < 41.7 < high < 72


def test_variants_are_not_compared_with_everybody(results: Results) -> None:
    f = Findings(results)
    assert [(a.navigator, b.navigator) for a, b, _ in head_to_head.comparisons(f)] == [(FULL, OTHER)]


def test_failures_have_their_class_and_assumptions_are_counted(results: Results) -> None:
    """A disc at 0.6 m/s that is seen from 4 m away: 0.75 s before the contact one may still back off or turn aside."""
    f = Findings(results)
    table = rescue.failures(f, "sar-case1")
    assert table is not None
    assert [c.name for c in table.columns][2:] == [
        "no way out once seen",
        "way out when first seen",
        "way out 0.75 s before",
    ]
    assert [row[4].trials for row in table.rows] == [(12, 13, 14, 15, 16)]
    rows = {row[0].text: row for row in rescue.summary(f, "sar-case1").rows}
    assert [c.plain for c in rows[FULL][-2:]] == ["0", "1 2 times"]
    assert [c.plain for c in rows[OTHER][-2:]] == ["0", "0"]
    assert VARIANT not in rows, "it stands in the ablation"


@pytest.fixture(scope="module")
def page(results: Results) -> Path:
    return write_report(results.path)


def test_page_and_terminal_show_it(results: Results, page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert 'id="ablation"' in text
    assert '<a href="#replay-12"' in text
    said = beside_published(results)
    assert "without reverse" in said
    assert "5 #12 #13 #14 #15 #16" in said
    assert "without reverse" in numbers(results)


@pytest.mark.browser
@pytest.mark.slow
def test_a_failed_trial_opens_its_replay_by_one_click(browser: Any, page: Path) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    browser.get(page.as_uri())
    link = browser.find_element("css selector", '#rescue a[href="#replay-14"]')
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", link)
    link.click()
    opened = "return document.getElementById('player').dataset.trial === '14'"
    WebDriverWait(browser, 20, poll_frequency=0.05).until(lambda b: b.execute_script(opened))
    facts = browser.find_element("css selector", "#facts").text
    assert "0.75 s before, a way out was left" in facts
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")


def test_without_variants_there_is_no_table(tmp_path: Path) -> None:
    made = [trial(OTHER, i, 20.0) for i in range(2)]
    made += [replace(t, attempt=replace(t.attempt, navigator="x[without=y]")) for t in made]
    with TrialStore(tmp_path / "out", asked_of("sar-case1"), len(made), row_schema()) as store:
        for i, t in enumerate(made):
            write_partial(store.partial, store.key, i, t, score_row(t))
        f = Findings(store.finish())
    assert ablation.tables(f) == []
    assert rescue.failures(f, "sar-case1") is None

"""The page of recordings in a real browser: every kind of recording replays without a complaint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from recorded_results import LACKS, write_recorded
from test_page_in_browser import cells, complaints, find, heading, load, wait

from clearway.reports import write_report

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(write_recorded(tmp_path_factory.mktemp("recorded") / "out").path)


def test_every_kind_of_recording_replays(browser: Any, page: Path) -> None:
    load(browser, page)
    for number in range(len(LACKS)):
        browser.execute_script("Replay.show(arguments[0])", number)
        wait(browser, f"return document.getElementById('player').dataset.trial === '{number}'")
        for t in (0.0, 3.4, 9.0, 1e3):
            browser.execute_script("Replay.seek(arguments[0])", t)
    assert complaints(browser) == []


def test_a_gap_shows_no_robot_and_a_robot_without_heading_is_shown(browser: Any, page: Path) -> None:
    load(browser, page, "#replay-1")
    pose = "Replay.seek(arguments[0]); return Replay.state().now.pose"
    assert browser.execute_script(pose, 3.4) is None
    assert browser.execute_script(pose, 5.0) is not None
    load(browser, page, "#replay-2")
    assert browser.execute_script(pose, 5.0)[:2] != [0, 0]
    load(browser, page, "#replay-6")  # not recorded
    assert browser.execute_script(pose, 0.0) is None
    assert find(browser, "#verdict").text == "not recorded"


def test_values_stand_with_their_uncertainty_and_empty_cells_say_why(browser: Any, page: Path) -> None:
    load(browser, page)
    de, mdo = heading(browser, "DE"), heading(browser, "MDO")
    assert cells(browser, de)[0].endswith(" ± 0.003")
    why = "return document.querySelectorAll('#trial-table tbody tr')[0].cells[arguments[0]].title"
    assert browser.execute_script(why, mdo) == "not computable: the test has no obstacle"
    assert browser.execute_script(why, de) == ""
    link = find(browser, '#recordings a[href="#replay-5"]')
    browser.execute_script("arguments[0].click()", link)
    wait(browser, "return document.getElementById('player').dataset.trial === '5'")

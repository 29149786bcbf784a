"""The run sheet's page: what is ticked in a browser stays there, and what it saves is what `score` reads."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.protocol.tick_page import tick_page

pytestmark = pytest.mark.slow

EVIL = "</script><script>document.title='pwned'</script>"
PLAN = f"""
test = {{ suite = "own \\"{EVIL}", ticks = "ticks.json" }}
robot.track = "trajectory"
[[trial]]
configuration = "<b>narrow</b>"
speed = 0.5
[[trial]]
speed = 0.8
[[trial]]
speed = 0.8
repetition = 2
"""


@pytest.fixture
def page(tmp_path: Path, browser: Any) -> Path:
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    behaviour = {"behavior": "allow", "downloadPath": str(tmp_path)}
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", behaviour)
    return opened(tmp_path, browser)


def opened(folder: Path, browser: Any) -> Path:
    plan = folder / "plan.toml"
    (folder / "ticks.html").write_text(tick_page(load_test_plan(plan), plan), encoding="utf-8")
    browser.get(f"file://{folder / 'ticks.html'}")
    return folder / "ticks.html"


def part(browser: Any, trial: int, what: str) -> Any:
    return browser.find_element("css selector", f"#t{trial} {what}")


def stand(browser: Any) -> str:
    return str(browser.find_element("id", "stand").text)


def comes_to_stand(browser: Any, text: str) -> bool:
    """What a page kept may reach one that is opened at once, by another process of the browser, only when it is opened again."""
    end = time.monotonic() + 60
    while not soon(lambda: stand(browser) == text, 3.0) and time.monotonic() < end:
        browser.refresh()
    return stand(browser) == text


def soon(holds: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.05)
    return holds()


def saved(folder: Path, browser: Any) -> Any:
    file = folder / "ticks.json"
    file.unlink(missing_ok=True)
    browser.find_element("id", "save").click()
    assert soon(file.exists, 30.0)
    return json.loads(file.read_text(encoding="utf-8"))


def test_a_day_is_ticked_kept_and_saved(page: Path, browser: Any):
    assert stand(browser) == "0 of 3 driven, 0 touched; next: no. 1"
    part(browser, 1, ".now").click()
    part(browser, 1, "[data-tick=touched][value=no]").click()
    part(browser, 2, "[data-tick=touched][value=yes]").click()
    part(browser, 2, "[data-tick='person helped']").click()
    part(browser, 2, ".remark").send_keys(f"caught at the sill {EVIL}")
    assert stand(browser) == "2 of 3 driven, 1 touched; next: no. 3; not saved yet"
    browser.refresh()
    assert comes_to_stand(browser, "2 of 3 driven, 1 touched; next: no. 3; not saved yet")
    rows = saved(page.parent, browser)
    assert stand(browser) == "2 of 3 driven, 1 touched; next: no. 3"
    start = rows[0]["start"]
    assert rows == [
        {"trial": 1, "person helped": "no", "start": start, "touched": "no"},
        {"trial": 2, "person helped": "yes", "touched": "yes", "remark": f"caught at the sill {EVIL}"},
    ]
    one, two, three = load_test_plan(page.parent / "plan.toml").trials
    assert (one.contact, one.start, one.intervention) == (False, start, False)
    assert [t.helped for t in (one, two, three)] == [0, 1, None]
    assert (two.contact, two.intervention, two.note) == (True, True, f"caught at the sill {EVIL}")
    assert three.contact is None
    assert browser.title.startswith("Ticks: own")
    assert browser.get_log("browser") == []


def test_a_tick_can_be_taken_back(page: Path, browser: Any):
    part(browser, 1, "[data-tick=touched][value=yes]").click()
    part(browser, 1, "[data-tick=touched][value=yes]").click()
    part(browser, 2, "[data-tick=stopped]").click()
    part(browser, 2, "[data-tick=stopped]").click()
    assert stand(browser) == "0 of 3 driven, 0 touched; next: no. 1"
    assert saved(page.parent, browser) == []


def test_a_plan_that_has_grown_keeps_its_ticks_and_a_changed_trial_has_none(page: Path, browser: Any):
    part(browser, 1, ".now").click()
    part(browser, 3, ".now").click()
    more = PLAN.replace("repetition = 2", "repetition = 3") + "[[trial]]\nspeed = 1.0\n"
    (page.parent / "plan.toml").write_text(more, encoding="utf-8")
    opened(page.parent, browser)
    assert comes_to_stand(browser, "1 of 4 driven, 0 touched; next: no. 2; not saved yet")
    assert [r["trial"] for r in saved(page.parent, browser)] == [1]


def test_what_another_browser_saved_is_loaded(page: Path, browser: Any):
    other = page.parent / "other.json"
    other.write_text('[{"trial": 2, "touched": "yes"}]', encoding="utf-8")
    browser.find_element("id", "load").send_keys(str(other))
    assert soon(lambda: part(browser, 2, "[data-tick=touched][value=yes]").is_selected(), 20.0)
    other.write_text("nothing", encoding="utf-8")
    browser.find_element("id", "load").send_keys(str(other))
    end = time.monotonic() + 5
    while not browser.find_element("id", "told").text and time.monotonic() < end:
        time.sleep(0.05)
    assert browser.find_element("id", "told").text == "other.json is no file that this page saved."
    assert stand(browser).startswith("1 of 3 driven, 1 touched")


def test_it_needs_nothing_from_elsewhere_and_fits_a_telephone(page: Path, browser: Any):
    assert "http" not in page.read_text(encoding="utf-8").replace("http-equiv", "")
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        assert browser.execute_script("return document.documentElement.scrollWidth <= innerWidth")
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

"""The report in a real browser: it loads nothing, runs nothing foreign, sorts, filters, and replays."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from clearway.reports import replays, write_replay, write_report
from clearway.trials.store import Results

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def load(browser: Any, file: Path, fragment: str = "") -> None:
    browser.get("about:blank")
    browser.get_log("browser")
    browser.get(file.as_uri() + fragment)
    wait(browser, "return document.getElementById('player').dataset.trial !== undefined")


def wait(browser: Any, condition: str) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(browser, 20, poll_frequency=0.05).until(lambda b: b.execute_script(condition))


def complaints(browser: Any) -> list[str]:
    return [entry["message"] for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]


def find(browser: Any, selector: str) -> Any:
    return browser.find_element("css selector", selector)


def cells(browser: Any, column: int) -> list[str]:
    script = (
        "return [...document.querySelectorAll('#trial-table tbody tr')].map(r => r.cells[arguments[0]].textContent)"
    )
    return list(browser.execute_script(script, column))


def heading(browser: Any, name: str) -> int:
    names = [
        th.text.split(" (")[0] for th in browser.find_elements("css selector", "#trial-table thead tr:first-child th")
    ]
    return names.index(name)


def test_loads_alone_and_without_a_complaint(browser: Any, report: Path) -> None:
    load(browser, report)
    assert complaints(browser) == []
    fetched = browser.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
    assert fetched == []
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    assert (
        len(browser.find_elements("css selector", "figure svg")) == 12
    )  # layout, 2 trajectories, 6 strips, 2 bars, correlations


PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
LETTERS = """
  const small = [];
  for (const text of document.querySelectorAll("text, p, td, th, li, small, a, button, summary, caption")) {
    if (!text.textContent.trim() || !text.checkVisibility()) continue;
    const svg = text.closest("svg[viewBox]");
    const scale = svg ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
    const size = parseFloat(getComputedStyle(text).fontSize) * scale;
    if (size < 10.9) small.push([text.textContent.slice(0, 20), size]);
  }
  return small;
"""


@pytest.fixture
def phone(browser: Any) -> Iterator[Any]:
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", PHONE)
    yield browser
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_on_a_telephone_all_can_be_read(phone: Any, report: Path) -> None:
    load(phone, report)
    phone.execute_script("for (const d of document.querySelectorAll('details')) d.open = true")
    assert phone.execute_script(LETTERS) == []
    assert phone.execute_script("return document.documentElement.scrollWidth") <= 390


def test_on_a_telephone_the_sections_are_a_menu(phone: Any, report: Path) -> None:
    load(phone, report)
    bar = "return document.querySelector('nav').getBoundingClientRect().height"
    assert phone.execute_script(bar) < 60
    button, link = find(phone, "#menu"), find(phone, '#sections a[href="#trials"]')
    assert not link.is_displayed()
    phone.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", button)
    button.click()
    assert (button.get_attribute("aria-expanded"), link.is_displayed()) == ("true", True)
    phone.execute_script("arguments[0].click()", link)
    assert not link.is_displayed()
    assert phone.execute_script("return location.hash") == "#trials"


def test_a_cause_leads_to_the_replay_of_a_typical_trial(browser: Any, report: Path) -> None:
    load(browser, report)
    link = find(browser, "#fix a")
    number = int(link.get_attribute("href").rpartition("-")[2])
    browser.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", link)
    link.click()
    wait(browser, f"return Replay.state().trial === {number}")
    assert find(browser, "#verdict").text != "success"


@pytest.mark.parametrize(("scheme", "rules"), [("light", {}), ("dark", {"runOnly": ["color-contrast"]})])
def test_an_accessibility_checker_finds_nothing(
    browser: Any, report: Path, scheme: str, rules: dict[str, list[str]]
) -> None:
    accessibility = pytest.importorskip("axe_core_python.selenium", reason="axe-core-python is not installed")
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    )
    try:
        load(browser, report)
        browser.execute_script("for (const closed of document.querySelectorAll('details')) closed.open = true")
        browser.set_script_timeout(300)
        axe = accessibility.Axe()
        assert violations(axe.run(browser, "body", rules or None)) == []
        browser.execute_script("document.getElementById('verdict').innerHTML = '<button></button>'")
        assert violations(axe.run(browser, "#player")) == ["critical button-name"]
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def violations(found: Any) -> list[str]:
    return [f"{rule['impact']} {rule['id']}" for rule in found["violations"]]


def test_on_paper_no_table_is_cut_off(browser: Any, report: Path) -> None:
    load(browser, report)
    a4_landscape = {"width": 1032, "height": 703, "deviceScaleFactor": 1, "mobile": False}  # within 12 mm margins
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", a4_landscape)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        widest = browser.execute_script(
            "return Math.max(...[...document.querySelectorAll('table')].map(t => t.getBoundingClientRect().right))"
        )
        assert widest <= 1033
        assert not find(browser, "#replay").is_displayed()
        assert find(browser, ".sign").is_displayed()
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_table_sorts_and_filters_as_the_rows_say(browser: Any, report: Path, results: Results) -> None:
    load(browser, report)
    rows = results.trials.to_pylist()
    column = heading(browser, "CT")
    head = browser.find_elements("css selector", "#trial-table thead th button")[column]
    head.click()
    head.click()
    slowest = sorted((r["CT"] for r in rows if r["CT"] is not None), reverse=True)[:50]
    assert cells(browser, column) == [f"{v:.2f}" for v in slowest]
    fields = browser.find_elements("css selector", "#trial-table .filter")
    fields[heading(browser, "v")].send_keys(">0.8")
    fields[heading(browser, "batch")].send_keys("SO")
    expected = [r["trial"] for r in rows if r["speed"] > 0.8 and r["batch"] == "SO"]
    assert browser.execute_script("return Trials.count()") == len(expected)
    find(browser, "#failures-only").click()
    failed = [r["trial"] for r in rows if r["speed"] > 0.8 and r["batch"] == "SO" and not r["success"]]
    assert sorted(int(c) for c in cells(browser, 0)) == failed
    assert failed


def test_thousands_of_rows_stay_fast(browser: Any, report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    start = text.index('id="trial-rows">') + len('id="trial-rows">')
    end = text.index("</script>", start)
    data = json.loads(text[start:end])
    data["rows"] = [[i, *data["rows"][i % len(data["rows"])][1:]] for i in range(6000)]
    many = report.with_name("many.html")
    many.write_text(text[:start] + json.dumps(data).replace("<", "\\u003c") + text[end:], encoding="utf-8")
    load(browser, many)
    took = browser.execute_script(
        "const s = document.getElementById('search'), t = performance.now(); s.value = 'so parallel';"
        "s.dispatchEvent(new Event('input')); return performance.now() - t"
    )
    assert took < 500
    many.unlink()


def test_numbers_on_an_axis_have_no_exponent(browser: Any, report: Path) -> None:
    load(browser, report)
    said = browser.execute_script("return [1430.6, 99.7, 63, 0.6, -0.0742].map(Stage.short)")
    assert said == ["1431", "100", "63", "0.60", "-0.074"]


def test_a_replay_plays_pauses_and_scrubs(browser: Any, report: Path, results: Results) -> None:
    index = next(r["trial"] for r in results.trials.to_pylist() if r["batch"] == "CE" and r["success"])
    load(browser, report, f"#replay-{index}")
    wait(browser, f"return Replay.state().trial === {index}")
    assert browser.execute_script("return Replay.state().playing") is False
    find(browser, "#play").click()
    wait(browser, "return Replay.state().time > 0.5")
    find(browser, "#play").click()
    paused = browser.execute_script("return Replay.state().time")
    assert browser.execute_script("return Replay.state().playing") is False
    trial = results.trial(index)
    browser.execute_script(
        "const s = document.getElementById('scrub'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))", 7.3
    )
    state = browser.execute_script("return Replay.state()")
    assert state["time"] == pytest.approx(7.3) != paused
    sample = round(7.3 / trial.attempt.period)
    assert state["now"]["pose"] == pytest.approx(trial.pose[sample].tolist(), abs=1e-3)
    assert state["now"]["estimate"] == pytest.approx(trial.estimate[sample].tolist(), abs=1e-3)
    assert complaints(browser) == []


def test_the_canvas_shows_the_robot_where_it_is(browser: Any, report: Path) -> None:
    load(browser, report, "#replay-0")
    count = (
        "const c = document.getElementById('stage'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        "let n = 0; for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 0) n++; return n"
    )
    drawn = browser.execute_script(count)
    for name in ("scan", "plan", "path", "estimate"):
        find(browser, f"#show-{name}").click()
    assert 200 < browser.execute_script(count) < drawn


def test_the_keyboard_does_it_all(browser: Any, report: Path) -> None:
    from selenium.webdriver.common.keys import Keys

    load(browser, report, "#replay-0")
    scrub = find(browser, "#scrub")
    for key, expected in ((Keys.ARROW_RIGHT, 0.1), (Keys.ARROW_RIGHT, 0.2), (Keys.ARROW_LEFT, 0.1)):
        scrub.send_keys(key)
        assert browser.execute_script("return Replay.state().time") == pytest.approx(expected, abs=1e-3)
    scrub.send_keys(Keys.END)
    assert browser.execute_script("return Replay.state().time === Number(document.getElementById('scrub').max)")
    scrub.send_keys("n")
    wait(browser, "return Replay.state().trial === 1")
    scrub.send_keys(" ")
    wait(browser, "return Replay.state().playing")
    scrub.send_keys(" ")
    assert browser.execute_script("return Replay.state().playing") is False


def test_the_table_leads_to_the_replay(browser: Any, report: Path) -> None:
    load(browser, report)
    find(browser, "#search").send_keys("collision")
    link = find(browser, "#trial-table tbody a")
    number = int(link.text)
    browser.execute_script("arguments[0].click()", link)
    wait(browser, f"return Replay.state().trial === {number}")
    assert find(browser, "#verdict").text == "collision"


def test_the_scan_of_the_replay_meets_the_walls(browser: Any, report: Path) -> None:
    load(browser, report)
    hits = browser.execute_script(
        "const lidar = {beams: 3, from: -Math.PI / 2, to: Math.PI / 2, near: 0.05, far: 10, mount: [0.2, 0, 0]};"
        "const wall = {p: [[0, -5], [0.1, -5], [0.1, 5], [0, 5]], at: [3, 0, 0]}, disc = {r: 0.5, at: [0.2, 2, 0]};"
        "return Lidar.scan(lidar, [0, 0, 0], [Lidar.scene([wall, disc])])"
    )
    right, ahead, left = hits["hits"]
    assert right[2] is False
    assert ahead == [pytest.approx(3.0), pytest.approx(0.0), True]
    assert left == [pytest.approx(0.2), pytest.approx(1.5), True]


def test_a_link_shows_its_trial_again_though_its_address_is_in_the_bar(browser: Any, report: Path) -> None:
    load(browser, report, "#replay-1")
    wait(browser, "return Replay.state().trial === 1")
    browser.execute_script("document.getElementById('next').click()")
    wait(browser, "return Replay.state().trial !== 1")
    browser.execute_script("document.querySelector('a[href=\"#replay-1\"]').click()")
    wait(browser, "return Replay.state().trial === 1")


def test_on_a_telephone_a_link_leads_to_the_replay_and_what_plays_it_stands_below_the_picture(
    phone: Any, report: Path
) -> None:
    load(phone, report, "#replay-1")
    wait(phone, "return Math.abs(document.getElementById('replay').getBoundingClientRect().top) < 100")
    box = "document.getElementById('{}').getBoundingClientRect()"
    below = phone.execute_script(f"return {box.format('play')}.top - {box.format('stage')}.bottom")
    assert 0 < below < 400


def test_hostile_names_stay_text(browser: Any, hostile: Results) -> None:
    file = write_report(hostile.path)
    load(browser, file)
    browser.execute_script("location.hash = '#replay-1'")
    wait(browser, "return Replay.state().trial === 1")
    assert browser.title == "Hospital navigation benchmark: test report"
    assert browser.execute_script("return document.querySelectorAll('img, iframe, object, embed').length") == 0
    assert "onerror" in find(browser, ".verdicts tbody th").text
    assert complaints(browser) == []
    load(browser, write_replay(hostile, 2))
    assert browser.title != "pwned"
    assert browser.execute_script("return document.images.length") == 0


def test_the_policy_stops_what_would_slip_through(browser: Any, report: Path) -> None:
    load(browser, report)
    browser.execute_script(
        "const s = document.createElement('script'); s.textContent = 'window.pwned = 1'; document.body.append(s);"
        "const i = document.createElement('img'); i.setAttribute('onerror', 'window.pwned = 1');"
        "i.src = 'data:nothing'; document.body.append(i)"
    )
    wait(browser, "return document.images[0].complete")
    assert browser.execute_script("return window.pwned") is None
    assert any("Content Security Policy" in c for c in complaints(browser))


def test_a_large_campaign_keeps_its_replays_beside_the_page(
    browser: Any, results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(replays, "MOST_INSIDE", 40_000)
        patch.setattr(replays, "MOST_LISTED", 6)
        file = write_report(shutil.copytree(results.path, tmp_path / "many", ignore=shutil.ignore_patterns("report")))
        outside = sorted(int(f.stem) for f in (file.parent / "replay").glob("[0-9]*.js"))
        load(browser, file)
        ids = browser.execute_script("return [...document.querySelectorAll('script[id^=trial-]')].map((s) => s.id)")
        in_page = {int(i.removeprefix("trial-")) for i in ids if i != "trial-rows"}
        inside = len(in_page)
        assert 0 < inside <= 6
        assert outside == list(range(len(results)))
        assert f"Of {len(results)} trials {inside} replays are in this page itself" in file.read_text("utf-8")
        last, table = max(set(outside) - in_page), "return document.querySelector('#trial-table tbody').rows.length"
        assert browser.execute_script(table) == 6
        browser.execute_script("document.getElementById('every-trial').click()")
        wait(browser, f"return Trials.count() === {len(results)}")
        browser.execute_script("document.getElementById('page-on').click()")  # 50 a page
        browser.execute_script(f"document.querySelector('#trial-table a[href=\"#replay-{last}\"]').click()")
        wait(browser, f"return Replay.state().trial === {last}")
        assert browser.execute_script(
            "return document.getElementById('pick').selectedOptions[0].textContent"
        ).startswith(f"{last}  ")
        browser.execute_script("document.getElementById('previous').click()")
        wait(browser, f"return Replay.state().trial === {last - 1}")
        assert complaints(browser) == []
        assert file.stat().st_size < 1_500_000


def test_of_a_very_large_campaign_the_page_says_how_to_see_what_it_has_no_file_for(
    browser: Any, results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        for limit, number in (("MOST_LISTED", 6), ("MOST_WRITTEN", 8)):
            patch.setattr(replays, limit, number)
        file = write_report(shutil.copytree(results.path, tmp_path / "more", ignore=shutil.ignore_patterns("report")))
    written = {int(f.stem) for f in (file.parent / "replay").glob("[0-9]*.js")}
    assert len(written) == 8
    other = min(set(range(len(results))) - written)
    load(browser, file)
    browser.execute_script("document.getElementById('every-trial').click()")
    wait(browser, f"return Trials.count() === {len(results)}")
    browser.execute_script(f"window.location.hash = 'replay-{other}'")
    wait(browser, "return !document.getElementById('replay-problem').hidden")
    said = browser.execute_script("return document.getElementById('replay-problem').textContent")
    assert f"clearway replay {tmp_path / 'more'} --trial N makes a page of any other" in said
    assert "The first 8 in that order open from replay/ beside it." in file.read_text("utf-8")


def test_one_trial_as_a_page(browser: Any, results: Results) -> None:
    load(browser, write_replay(results, 3))
    assert browser.execute_script("return Replay.state().trial") == 3
    assert complaints(browser) == []

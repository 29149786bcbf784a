"""A synthetic campaign, its report, and a headless browser to look at it with."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from synthetic_results import write_campaign

from clearway.contract import EventKind
from clearway.scenarios.suites import Selection
from clearway.trials import Trial
from clearway.trials.store import Results

HOSTILE = "</script><img src=x onerror=\"document.title='pwned'\"> $\\frac{$"


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Both robots, every configuration, two sizes and speeds."""
    selection = Selection(speeds=(0.6, 1.0), sizes=(0.15, 0.3), gaps=(1.0,), repetitions=2)
    return write_campaign(tmp_path_factory.mktemp("results") / "out", selection=selection)


@pytest.fixture(scope="session")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Names that try to break out of the page, everywhere that a name can stand."""

    def poison(trial: Trial) -> Trial:
        a = trial.attempt
        labels = replace(a.labels, configuration=a.labels.configuration + HOSTILE)
        bodies = tuple(replace(b, name=HOSTILE) for b in a.bodies)
        attempt = replace(
            a, labels=labels, robot=HOSTILE, navigator=HOSTILE, floor_plan=HOSTILE, scenario=HOSTILE, bodies=bodies
        )
        return replace(trial, attempt=attempt, reason=HOSTILE, events=(*trial.events, _event(HOSTILE)))

    out = tmp_path_factory.mktemp("hostile") / "out"
    return write_campaign(
        out, robots=("tiago",), selection=Selection(batches=("NO", "MO"), speeds=(0.6,)), change=poison
    )


def _event(text: str) -> Any:
    from clearway.trials import Event

    return Event(1.0, EventKind.STATUS, text)


@pytest.fixture(scope="session")
def report(results: Results) -> Path:
    from clearway.reports import write_report

    return write_report(results.path)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Headless Chromium that cannot reach any host."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("no Chromium or no chromedriver on this machine")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", "--no-first-run", "--window-size=1280,1000",
        "--host-resolver-rules=MAP * ~NOTFOUND", "--force-prefers-reduced-motion",
    ):  # fmt: skip
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    chrome = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield chrome
    chrome.quit()

"""What all tests share, a headless browser among it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

# Both cores have a process of tests already. Before anything loads NumPy; the processes of xdist inherit it.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

# A kernel compiles at its first call, and a machine may stand still for a second: no test fails for its time. The same examples every time.
settings.register_profile(
    "clearway", deadline=None, derandomize=True, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("clearway")


LONGEST = ("hp_st", "test_guard", "test_a_day", "hl_rrt", "conformance", "hp_tmpc", "test_people", "tests/reports")
"""Parts of the names of files, those first whose tests take longest, so that none of them is left when all else is done."""
IN_DEPTH = (
    "tests/navigators/test_hp_st", "tests/navigators/hp_tmpc", "tests/navigators/hl_rrt", "tests/navigators/colregs_apf", "tests/navigators/nav2",
    "tests/oracles/test_rrt_oracle", "tests/forecasts/test_avoidance", "tests/learning", "tests/clairvoyant", "tests/identifying",
    "tests/reports/test_several_suites",
)  # fmt: skip
"""Rooms that few changes touch, and navigators that each compile for long: `make slow` tests them, as it does whether they keep the contract."""
TOGETHER = ("hp_st", "hp_tmpc", "hl_rrt", "move_base", "colregs_apf", "nav2", "mpc_cbf", "mppi_forecast", "test_people")
"""Navigators, and people, that compile for long."""


class _ByFile(LoadScopeScheduling):  # type: ignore[misc]
    """The tests of one file run in one process, and so do all those of what compiles for long, whether a navigator keeps
    the contract among them: else both processes compile it, at the same time."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        told = nodeid.replace("-", "_") if "tests/conformance" in file else file
        return next((name for name in TOGETHER if name in told), file)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    config.option.loadscopereorder = False  # as they stand, not by how many tests a file has
    return _ByFile(config, log)


@pytest.hookimpl(tryfirst=True)  # before those that are slow are left out
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.nodeid.startswith(IN_DEPTH):
            item.add_marker(pytest.mark.slow)

    def rank(item: pytest.Item) -> int:
        return next((i for i, name in enumerate(LONGEST) if name in item.nodeid.partition("::")[0]), len(LONGEST))

    items.sort(key=rank)


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

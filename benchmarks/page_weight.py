"""How heavy the reports of results are, and how soon one can be used: bytes, and times of a headless Chromium.

python benchmarks/page_weight.py RESULTS [...]
python benchmarks/page_weight.py --smoke

`--smoke` makes a small campaign of its own. Without Chromium and its chromedriver it says so and ends.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Any

from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

import clearway

LOADS = 9
TIMES = {
    "document interactive": "performance.getEntriesByType('navigation')[0].domInteractive",
    "loaded": "performance.getEntriesByType('navigation')[0].loadEventEnd",
}


def line(browser: Any, page: Path) -> str:
    """Of one page, loaded nine times."""
    found: dict[str, list[float]] = {name: [] for name in TIMES}
    for _ in range(LOADS):
        browser.get(page.resolve().as_uri())
        WebDriverWait(browser, 60).until(
            lambda b: b.execute_script("return document.getElementById('player')?.dataset.trial !== undefined")
        )
        for name, script in TIMES.items():
            found[name].append(browser.execute_script(f"return {script}"))
    middle = ", ".join(f"{name} after {statistics.median(values):.0f} ms" for name, values in found.items())
    return f"{page}: {page.stat().st_size:,} bytes; {middle} (median of {LOADS})"


def main() -> None:
    """Load and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="*", type=Path)
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    pages = [folder / "report" / "index.html" for folder in asked.results]
    if missing := [str(page) for page in pages if not page.exists()]:
        parser.error(f"{missing[0]} does not exist: write it by `clearway report`")
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        parser.exit(0, "no Chromium or no chromedriver on this machine\n")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"):
        options.add_argument(argument)
    with tempfile.TemporaryDirectory() as folder:
        if asked.smoke:
            results = clearway.run(
                "hospital", robots=["tiago"], batches=["NO"], speeds=[1.0], repetitions=1, out=folder
            )
            pages.append(results.report())
        browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver") or ""))
        try:
            for page in pages:
                print(line(browser, page))
        finally:
            browser.quit()


if __name__ == "__main__":
    main()

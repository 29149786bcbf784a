"""How heavy the reports of results are, and how soon one can be used: bytes, and times of a headless Chromium.

python benchmarks/page_weight.py RESULTS [...]
"""

import statistics
import sys
from pathlib import Path

from selenium import webdriver

LOADS = 9
TIMES = {
    "document interactive": "performance.getEntriesByType('navigation')[0].domInteractive",
    "loaded": "performance.getEntriesByType('navigation')[0].loadEventEnd",
}

options = webdriver.ChromeOptions()
for argument in ("--headless", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"):
    options.add_argument(argument)
browser = webdriver.Chrome(options=options)
for folder in sys.argv[1:]:
    page = Path(folder) / "report" / "index.html"
    found: dict[str, list[float]] = {name: [] for name in TIMES}
    for _ in range(LOADS):
        browser.get(page.resolve().as_uri())
        while browser.execute_script("return document.getElementById('player')?.dataset.trial === undefined"):
            pass
        for name, script in TIMES.items():
            found[name].append(browser.execute_script(f"return {script}"))
    middle = ", ".join(f"{name} after {statistics.median(values):.0f} ms" for name, values in found.items())
    print(f"{page}: {page.stat().st_size:,} bytes; {middle} (median of {LOADS})")
browser.quit()

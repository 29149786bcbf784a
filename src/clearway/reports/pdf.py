"""The report's first screen on one sheet of A4, printed by a Chromium that is installed on this machine."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.placing import placed
from clearway.reports.page import first_screen, page_of
from clearway.trials.store import open_results

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
"""Programs that can print a page, in the order in which they are looked for."""
SHEET = "summary.pdf"
_SCALES = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4)
_PATIENCE = 60.0
"""s that printing may take."""


def printing_browser() -> str:
    """The path of the browser that prints.

    Raises:
        ClearwayError: none is installed.
    """
    for name in BROWSERS:
        if found := shutil.which(name):
            return found
    raise ClearwayError(
        f"a PDF needs a browser that prints: install Chromium (none of {', '.join(BROWSERS)} is on the PATH), or print "
        "the report's page from any browser"
    )


def write_pdf(path: str | os.PathLike[str]) -> Path:
    """Print the first screen of the results directory `path` into `report/summary.pdf`, as large as one A4 page allows.

    Raises:
        ClearwayError: `path` holds no results, no browser is installed that could print, or it fails.
    """
    browser = printing_browser()
    results = open_results(Path(path))
    content = first_screen(results)
    file = results.path / "report" / SHEET
    with tempfile.TemporaryDirectory() as scratch:
        page, sheet = Path(scratch) / "page.html", Path(scratch) / SHEET
        for scale in _SCALES:
            page.write_text(page_of("sheet.html", scale=scale, **content), encoding="utf-8", errors="replace")
            _print(browser, page, sheet)
            if _pages(sheet) == 1:
                break
        with placed(file.parent) as new:
            shutil.copyfile(sheet, new / SHEET)
    return file


def _print(browser: str, page: Path, sheet: Path) -> None:
    """Have the browser print a page; it runs nothing and reaches nothing, as the page has no script and loads nothing."""
    command = [
        browser, "--headless=new", "--disable-gpu", "--no-sandbox", f"--user-data-dir={page.parent / 'profile'}",
        "--no-pdf-header-footer", f"--print-to-pdf={sheet}", page.as_uri(),
    ]  # fmt: skip
    sheet.unlink(missing_ok=True)
    try:
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ClearwayError(f"{browser} could not print: {error}") from error
    if not sheet.is_file():
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise ClearwayError(f"{browser} printed nothing: {said[-1] if said else f'it ended with {done.returncode}'}")


def _pages(sheet: Path) -> int:
    return len(re.findall(rb"/Type\s*/Page\b", sheet.read_bytes()))

"""The first screen on one sheet of A4."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from clearway.errors import ClearwayError
from clearway.reports import printing_browser, write_pdf
from clearway.reports.pdf import BROWSERS
from clearway.trials.store import Results


@pytest.mark.browser
@pytest.mark.slow
def test_it_is_one_page_of_a4(browser: object, results: Results) -> None:
    sheet = write_pdf(results.path).read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", sheet)) == 1
    found = re.search(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)", sheet)
    assert found is not None
    assert sorted(map(float, found.groups())) == pytest.approx([595, 842], abs=1)


def test_without_a_browser_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ClearwayError, match="install Chromium"):
        printing_browser()


def test_a_browser_that_fails_is_told(tmp_path: Path, results: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / BROWSERS[0]
    broken.write_text("#!/bin/sh\necho no display >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(ClearwayError, match="printed nothing: no display"):
        write_pdf(results.path)

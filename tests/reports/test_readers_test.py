"""Every place that docs/readers-test.md names is on a generated page, says something, and can be read in light and dark."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from test_page_in_browser import load

DOCS = Path(__file__).parents[2] / "docs"
ROWS = re.findall(
    r"^\| (\d+) \| (.+?) \| .+ \| `([^`]+)` \|$", (DOCS / "readers-test.md").read_text("utf-8"), re.MULTILINE
)
TEXTS = ("ink", "muted", "link", "good", "bad")


@pytest.mark.browser
@pytest.mark.slow
def test_ten_questions_have_their_places_and_all_but_the_last_are_above_the_sections(
    browser: Any, report: Path
) -> None:
    assert [int(number) for number, *_ in ROWS] == list(range(1, 11))
    load(browser, report)
    for number, question, place in ROWS:
        found = browser.find_elements("css selector", place)
        assert found, f"{question} {place}"
        assert found[0].text.strip(), question
        above = "return arguments[0].closest('header.top') !== null"
        assert browser.execute_script(above, found[0]) == (number != "10"), question


def test_text_stands_out_from_what_it_stands_on_in_light_and_dark() -> None:
    """The contrast of WCAG 2.2, 1.4.3: at least 4.5 for text of this size."""
    style = (resources.files("clearway.reports") / "templates" / "page.css").read_text("utf-8")
    light, dark = (
        dict(re.findall(r"--([\w-]+): (#\w{6})", block)) for block in re.findall(r":root \{([^}]+--ink[^}]+)\}", style)
    )
    for scheme in (light, light | dark):
        pairs = [(text, "paper") for text in TEXTS] + [(text, "panel") for text in ("ink", "muted", "link")]
        for text, ground in [
            *pairs,
            ("ink", "bad-panel"),
            ("bad", "bad-panel"),
            ("ink", "good-panel"),
            ("paper", "link"),
        ]:
            assert contrast(scheme[text], scheme[ground]) >= 4.5, (text, ground)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b

"""A requirement as a page: three sentences, the curve, what was tried, and a map coloured by it."""

from __future__ import annotations

from html import escape
from pathlib import Path

from markupsafe import Markup

from clearway.reports import theme
from clearway.reports.grid import Grid, Heads, Rows, grid, num, span, text
from clearway.reports.page import PAGE, page_of
from clearway.reports.passable import Passable
from clearway.reports.requirement import CURVE, Requirement
from clearway.reports.summary import Summary
from clearway.statistics.proportions import wilson_interval

MAP = "map.svg"
"""The map's file."""


def write_page(found: Requirement, folder: Path, coloured: Passable | None = None) -> Path:
    """Write `index.html` and the figures into a folder; returns the page's path.

    Args:
        found: What came of the search.
        folder: Where its numbers stand.
        coloured: A map that is coloured by it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    figures = [(CURVE, "Success", found.figure())]
    figures += [] if coloured is None else [(MAP, "Map", coloured.figure())]
    drawn = []
    for name, title, figure in figures:
        svg = theme.to_svg(figure, f"requirement {found.offer} {title}")
        (folder / name).write_text(svg, encoding="utf-8")
        drawn.append(Markup(theme.themed(svg, escape(title))))
    page = page_of(
        "requirement.html", title=f"{found.robot}: {found.quantity.partition(',')[0]}", said=_summary(found, coloured), curve=drawn[0],
        values=_values(found), map=drawn[1] if coloured is not None else None,
    )  # fmt: skip
    (folder / PAGE).write_text(page, encoding="utf-8", errors="replace")
    return folder / PAGE


def _summary(found: Requirement, coloured: Passable | None) -> Summary:
    low, high = sorted((found.hardest, found.easiest))
    tested = (
        f"{found.robot} with {found.navigator} at {found.speed:g} m/s: {found.quantity.partition(',')[0]} from {low:g} to "
        f"{high:g}{found.unit}; {sum(found.trials)} simulated trials at {len(found.values)} values, most where it is decided."
    )
    result, easiest = str(found), found.values.index(max(found.values) if found.eases else min(found.values))
    lost, many = found.trials[easiest] - found.successes[easiest], found.trials[easiest]
    if lost:
        result += (
            f" At {found.values[easiest]:g}{found.unit}, the easiest value that was tried, {lost} of {many} trials still failed"
            f"{f' (most often: {found.why[easiest]})' if found.why[easiest] else ''}."
        )
    limits = (
        "The robot is simulated, so this says how it would do as far as its model holds; it is an answer for this family of tests: another "
        "approach, another floor, another speed have other answers; what holds with confidence are the ends of the interval, the number "
        "before it is an estimate."
    )
    if coloured is not None:
        result += f" On the map, {coloured.reached}."
        limits += (
            f" On the map each passage counts as one of these tests, several in a row are no harder than the narrowest, and a width is known to "
            f"a cell, {coloured.grid.resolution:g} m."
        )
    return Summary(tested, result, limits)


def _values(found: Requirement) -> Grid:
    rows: Rows = []
    for i in sorted(range(len(found.values)), key=lambda i: found.values[i]):
        share = wilson_interval(found.successes[i], found.trials[i], found.confidence)
        interval = span(100 * share.low, 100 * share.high, 0)
        said = " ".join(
            word
            for word, at in (("shown to be enough", found.passes), ("shown to be too little", found.fails))
            if at == found.values[i]
        )
        rows.append(
            [f"{found.values[i]:g}", f"{found.successes[i]} of {found.trials[i]}", f"{num(100 * share.estimate, 0)} {interval}",
             num(100 * found.curve[i], 0), said, found.why[i]]
        )  # fmt: skip
    heads: Heads = [
        found.quantity,
        "successes",
        "%, with its interval",
        "isotonic, %",
        text("asked for"),
        text("failed most often as it"),
    ]
    return grid(
        f"What was tried; the intervals are Wilson's, of {100 * found.confidence:g} %, each by itself.", heads, rows
    )

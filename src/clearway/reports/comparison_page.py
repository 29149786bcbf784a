"""Comparisons as a page of their own with a figure and tables, in a folder that the user names."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from clearway.errors import ClearwayError
from clearway.reports import head_to_head, sharing, theme
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, counted, grid, num, p_value, span, text
from clearway.reports.page import PAGE, page_of
from clearway.reports.side_by_side import Found, mark, repetitions, taken_otherwise, uncertainty, unlike
from clearway.reports.summary import Summary
from clearway.statistics import FEWEST_RESAMPLED, Comparison, ConfigurationComparison, holm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TITLE = 90
"""Characters of a figure's title that fit into a line."""
_NOT_SHOWN, _TOO_FEW = "no difference shown", "too few to show any"


def write_comparison(found: Sequence[Found], folder: Path) -> Path:
    """Write `index.html`, a figure of the differences a pair (SVG) and `differences.csv` into a folder; returns the page's path.

    Raises:
        ClearwayError: the folder holds something else, or can't be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()) and not (folder / "differences.csv").exists():
            raise ClearwayError("is not empty and holds no comparison; choose another directory", file=folder)
        figures = []
        for number, pair in enumerate(found, 1):
            with theme.style():
                drawn = differences(pair)
            name = f"{pair.b} against {pair.a}"
            svg = theme.to_svg(drawn, name)
            (folder / f"differences-{number}.svg").write_text(svg, encoding="utf-8")
            figures.append((name, Markup(theme.themed(svg, escape(name)))))
        _csv(found, folder / "differences.csv")
        page = page_of("comparison.html", title=_title(found), figures=figures, said=summary(found), each=[_said(pair, p) for pair, p in zip(found, success_ps(found), strict=True)],
                       success=success_table(found), indicators=indicator_table(found))  # fmt: skip
        (folder / PAGE).write_text(page, encoding="utf-8", errors="replace")
    except OSError as error:
        raise ClearwayError(f"the comparison cannot be written: {error.strerror or error}", file=folder) from error
    return folder / PAGE


def _title(found: Sequence[Found]) -> str:
    kinds = {pair.kind if isinstance(pair, ConfigurationComparison) else "" for pair in found}
    return kind.capitalize() if len(kinds) == 1 and (kind := kinds.pop()) else "Side by side"


def _sides(pair: Found) -> tuple[str, str]:
    """The names of B and A, with where their trials come from if that is known."""
    if isinstance(pair, Comparison):
        return pair.b, pair.a
    return f"{pair.b} ({pair.source_b})", f"{pair.a} ({pair.source_a})"


def summary(found: Sequence[Found]) -> Summary:
    """What the page says first."""
    systems = list(dict.fromkeys(name for pair in found for name in _sides(pair)))
    least = min(pair.pairs if isinstance(pair, Comparison) else pair.configurations for pair in found)
    matched = [pair for pair in found if isinstance(pair, ConfigurationComparison)]
    tests = counted(least, "configuration" if matched else "test")
    each = f"{tests} in common" if len(found) == 1 else f"{len(found)} pairs with {tests} or more in common"
    result = (
        _said(found[0], success_ps(found)[0]) if len(found) == 1 else "Of each pair a line below says what is shown."
    )
    every = [r for pair in found for r in _rows(pair)]
    doubts = [f"With {tests} small differences stay hidden: where none is shown there may be one"]
    if every and all(r["least_p"] > 0.05 for r in every):
        p, after = p_value(_smallest_p(max(r["n"] for r in every))), p_value(min(r["least_p"] for r in every))
        doubts = [
            f"With {tests} no difference in any indicator can be shown, however large: the smallest p that can come out is {p}, {after} "
            "after Holm's correction"
        ]
    if len(matched) < len(found):
        doubts.append("an indicator is compared on those that both finished, success on all")
    if matched:
        doubts.append("the repetitions of a configuration are averaged first")
        doubts += dict.fromkeys(said for pair in matched for said in repetitions(pair))
    if any(map(taken_otherwise, found)):
        doubts.append("part of the difference in the times, marked *, is how they were taken")
    doubts += dict.fromkeys(said for pair in found if (said := unlike(pair)))
    if alike := sharing.repeated(found):
        doubts.append(alike.strip(" ."))
    if left := sum(pair.only_a + pair.only_b for pair in found):
        one = "configuration" if matched else "test"
        doubts.append(f"{counted(left, one)} that only one side ran {'is' if left == 1 else 'are'} left out")
    return Summary(f"{', '.join(systems)}: {each}.", result, f"{'; '.join(doubts)}.{_doubt(found)}")


def _smallest_p(n: int) -> float:
    """Of an exact two-sided test of n pairs, McNemar's or Wilcoxon's: where all of them differ in the same direction."""
    return 2.0 ** (1 - n)


def success_ps(found: Sequence[Found]) -> list[tuple[float, float]]:
    """Of each pair McNemar's p of all batches after Holm's correction over the pairs, and the smallest that could come out; NaN where
    there is none."""
    paired = [pair.success.get(None) if isinstance(pair, Comparison) else None for pair in found]
    ps = holm([np.nan if s is None else s.p for s in paired]).tolist()
    least = holm([np.nan if s is None else _smallest_p(s.n) for s in paired]).tolist()
    return list(zip(ps, least, strict=True))


def _rows(pair: Found) -> list[dict[str, Any]]:
    """The differences over all batches, each with the smallest p after Holm that so many tests of each indicator can give, whatever
    comes out: `least_p`."""
    rows = [r for r in pair.differences.to_pylist() if r["batch"] is None and r["n"]]
    least = holm([_smallest_p(r["n"]) for r in rows]).tolist()
    return [r | {"least_p": p} for r, p in zip(rows, least, strict=True)]


def _said(pair: Found, success: tuple[float, float]) -> str:
    """What came out of a pair, in a sentence; `success`: its two of `success_ps`."""
    s: Any = pair.success.get(None)
    parts = []
    b, a = _sides(pair)
    if isinstance(pair, Comparison):
        on = f"on the same {pair.pairs} tests" if pair.pairs != 1 else "on the same test"
        if s is not None:
            p, least = success
            shown = "" if p <= 0.05 else f" ({_NOT_SHOWN if least <= 0.05 else _TOO_FEW})"
            parts.append(f"{s.both + s.only_b} against {s.both + s.only_a} of {s.n} succeeded{shown}")
    else:
        on = f"{pair.kind} over {counted(pair.configurations, 'configuration')} in common"
        if s is not None:
            shown = f" ({_NOT_SHOWN})" if s.difference.low <= 0.0 <= s.difference.high else ""
            parts.append(f"{s.successes_b} of {s.trials_b} succeeded against {s.successes_a} of {s.trials_a}{shown}")
    rows = _rows(pair)
    for r in rows:
        if r["favours"]:
            unit = f" {r['unit']}" if r["unit"] else ""
            by = f"{num(abs(r['mean_difference']), 3)}{unit}"
            parts.append(
                f"{pair.a if r['favours'] == 'A' else pair.b} is better in {r['indicator']}, by {by} on average"
            )
    if rows and all(r["least_p"] > 0.05 for r in rows):
        parts.append("so few can show no difference in any indicator")
    elif not any(r["favours"] for r in rows):
        parts.append("in no indicator a difference is shown")
    return f"{b} against {a}, {on}: {'; '.join(parts)}."


def _level(found: Sequence[Found]) -> str:
    """The confidence of the intervals: of all the same."""
    return f"{100 * found[0].confidence:g} %"


def _doubt(found: Sequence[Found]) -> str:
    """What has to be said where intervals of indicators and what is shown are at odds; empty if none are."""
    return head_to_head.at_odds(r for pair in found for r in _rows(pair))


def differences(pair: Found) -> Figure:
    """Mean differences with their intervals over all batches, a panel an indicator, each in its own unit and with its zero."""
    rows = _rows(pair)
    figure = theme.new_figure(7.2, 0.55 * max(len(rows), 1) + 0.5)
    panels = figure.subplots(max(len(rows), 1), 1, squeeze=False)[:, 0]
    for axes, row in zip(panels, rows, strict=False):
        mean, low, high = row["mean_difference"], row["boot_low"], row["boot_high"]
        axes.axvline(0.0, color=theme.INK, linewidth=0.8)
        if row.get("rep_low") is not None:
            axes.plot([row["rep_low"], row["rep_high"]], [0.0, 0.0], color=theme.RULE, linewidth=5.0, zorder=0.5)
        if low is not None and high is not None:
            axes.plot([low, high], [0.0, 0.0], color=theme.INK, linewidth=1.4)
        axes.plot([mean], [0.0], "o", color=theme.INK, markersize=4)
        unit = f" [{row['unit']}]" if row["unit"] else ""
        name = f"{row['indicator']}{mark(pair, row['indicator'])}{unit}\nn = {row['n']}"
        axes.set_ylabel(name, rotation=0, ha="right", va="center", fontsize=8)
        axes.set_yticks([])
        axes.margins(x=0.15)
        axes.tick_params(labelsize=8)
    broad = "; broad: over repetitions" if any(row.get("rep_low") is not None for row in rows) else ""
    said = f"{pair.b} minus {pair.a}: mean of the differences, with its interval where there is one{broad}"
    figure.suptitle(textwrap.fill(said, _TITLE), fontsize=9)
    return figure


def success_table(found: Sequence[Found]) -> Grid:
    """Success over all batches, a row a pair."""
    lines: Rows = []
    for c, (p, _) in zip(found, success_ps(found), strict=True):
        s: Any = c.success.get(None)
        if s is None:
            continue
        d = s.difference
        paired = isinstance(c, Comparison)
        ours, theirs = (
            (f"{s.both + s.only_b} of {s.n}", f"{s.both + s.only_a} of {s.n}")
            if paired
            else (f"{s.successes_b} of {s.trials_b}", f"{s.successes_a} of {s.trials_a}")
        )
        difference = Cell(num(100 * d.estimate, 1), span(100 * d.low, 100 * d.high, 1))
        lines.append(
            [Cell(c.b, strong=True), c.a, ours, theirs, difference, *map(p_value, (s.p, p) if paired else (None, None))]
        )
    heads: Heads = [text("System"), text("against"), "successes", "against's", "difference (points)", "p", "p (Holm)"]
    doubt = head_to_head.rates_at_odds(
        (c.success.get(None), p)
        for c, (p, _) in zip(found, success_ps(found), strict=True)
        if isinstance(c, Comparison) and c.confidence == 0.95
    )
    return grid(
        f"Success: difference of the rates with its {_level(found)} interval; McNemar's exact test where the trials are pairs, Holm's "
        f"correction over all rows.{doubt}{sharing.of_pairs(found)}",
        heads,
        lines,
    )


def indicator_table(found: Sequence[Found]) -> Grid:
    """Every indicator over all batches, a row a pair and indicator; over repetitions and U where trials are no pairs."""
    lines: Rows = []
    matched = any(isinstance(c, ConfigurationComparison) for c in found)
    for c in found:
        for r in _rows(c):
            unit = f" ({r['unit']})" if r["unit"] else ""
            difference = Cell(num(r["mean_difference"], 3), span(r["boot_low"], r["boot_high"], 3))
            better = {"A": c.a, "B": c.b}.get(r["favours"], _NOT_SHOWN if r["least_p"] <= 0.05 else _TOO_FEW)
            trials, more = [], []
            if matched:
                u = uncertainty(r)
                trials = [f"{r['trials_b']} : {r['trials_a']}" if "trials_a" in r else NONE]
                more = [span(r.get("rep_low"), r.get("rep_high"), 3) or NONE, NONE if u is None else f"{u:.2g}"]
            lines.append([
                Cell(c.b, strong=True), c.a, f"{r['indicator']}{mark(c, r['indicator'])}{unit}", str(r["n"]), *trials,
                num(r["mean_b"], 3), num(r["mean_a"], 3), difference, *more, p_value(r["p_holm"]), better,
            ])  # fmt: skip
    counted, spread = (["trials"], ["over repetitions", "U"]) if matched else ([], [])
    heads: Heads = [text("System"), text("against"), text("indicator"), "n", *counted, "mean", "against's mean", "difference",
                    *spread, "p (Holm)", text("better")]  # fmt: skip
    notes = [f"Intervals: {_level(found)}."]
    notes += [_OF_PAIRS] if any(isinstance(c, Comparison) for c in found) else []
    notes += [_OF_CONFIGURATIONS] if matched else []
    notes += dict.fromkeys(filter(None, map(taken_otherwise, found)))
    return grid(" ".join(notes) + sharing.of_pairs(found), heads, lines)


_OF_PAIRS = (
    "Indicators over the tests that both finished, so that who fails the hard ones is not punished here: read it with the "
    "success above. Mean of the differences with its bootstrap interval, Wilcoxon's test, Holm's correction over the "
    "indicators of one pair."
)
_OF_CONFIGURATIONS = (
    "Indicators over the configurations of which both sides have a value (n; trials: of each side), the repetitions of each averaged first: read it with the "
    f"success above. Mean of the differences with its bootstrap interval over configurations (from {FEWEST_RESAMPLED} on), Wilcoxon's test, "
    "Holm's correction over the indicators of one pair. Over repetitions: the interval of what repeating these very configurations would give, each indicator for "
    "itself; – where none was repeated on one of the sides. U: how far off the measured means may be together (k = 2); it comes on top of the intervals."
)


def _csv(found: Sequence[Found], file: Path) -> None:
    rows = [{"a": c.a, "b": c.b} | r for c in found for r in c.differences.to_pylist()]
    with open(file, "w", newline="", encoding="utf-8") as out:
        writer = csv.DictWriter(out, list(dict.fromkeys(name for row in rows for name in row)) or ["a", "b"])
        writer.writeheader()
        writer.writerows(rows)

"""Comparisons as a page of their own with a figure and tables, in a folder that the user names."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from clearway.errors import ClearwayError
from clearway.reports import sharing, theme
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, p_value, span, text
from clearway.reports.page import PAGE, page_of
from clearway.reports.summary import Summary
from clearway.statistics import Comparison, ConfigurationComparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Found = Comparison | ConfigurationComparison


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
        page = page_of("comparison.html", title="Side by side", figures=figures, said=summary(found), each=[_said(pair) for pair in found],
                       success=success_table(found), indicators=indicator_table(found))  # fmt: skip
        (folder / PAGE).write_text(page, encoding="utf-8", errors="replace")
    except OSError as error:
        raise ClearwayError(f"the comparison cannot be written: {error.strerror or error}", file=folder) from error
    return folder / PAGE


def summary(found: Sequence[Found]) -> Summary:
    """What the page says first."""
    systems = list(dict.fromkeys(name for pair in found for name in (pair.b, pair.a)))
    least = min(pair.pairs if isinstance(pair, Comparison) else pair.configurations for pair in found)
    kind = "test" if all(isinstance(pair, Comparison) for pair in found) else "configuration"

    def many(n: int) -> str:
        return f"{n} {kind}{'' if n == 1 else 's'}"

    each = f"{many(least)} in common" if len(found) == 1 else f"{len(found)} pairs with {many(least)} or more in common"
    result = _said(found[0]) if len(found) == 1 else "Of each pair a line below says what is shown."
    doubts = [
        f"With {many(least)} small differences stay hidden: where none is shown there may be one",
        "an indicator is compared on those that both finished, success on all",
    ]
    if left := sum(pair.only_a + pair.only_b for pair in found):
        doubts.append(f"{many(left)} that only one side ran {'is' if left == 1 else 'are'} left out")
    return Summary(f"{', '.join(systems)}: {each}.", result, f"{'; '.join(doubts)}.{_doubt(found)}")


def _said(pair: Found) -> str:
    """What came out of a pair, in a sentence."""
    s: Any = pair.success.get(None)
    parts = []
    if isinstance(pair, Comparison):
        on = f"on the same {pair.pairs} tests" if pair.pairs != 1 else "on the same test"
        if s is not None:
            shown = "" if s.p <= 0.05 else " (no difference shown)"
            parts.append(f"{s.both + s.only_b} against {s.both + s.only_a} of {s.n} succeeded{shown}")
    else:
        on = f"over {pair.configurations} configurations in common"
    if isinstance(pair, ConfigurationComparison) and s is not None:
        parts.append(f"{s.successes_b} of {s.trials_b} succeeded against {s.successes_a} of {s.trials_a}")
    rows = [r for r in pair.differences.to_pylist() if r["batch"] is None and r["n"]]
    for r in rows:
        if r["favours"]:
            unit = f" {r['unit']}" if r["unit"] else ""
            by = f"{num(abs(r['mean_difference']), 3)}{unit}"
            parts.append(
                f"{pair.a if r['favours'] == 'A' else pair.b} is better in {r['indicator']}, by {by} on average"
            )
    if not any(r["favours"] for r in rows):
        parts.append("in no indicator a difference is shown")
    return f"{pair.b} against {pair.a}, {on}: {'; '.join(parts)}."


def _doubt(found: Sequence[Found]) -> str:
    """What has to be said where an indicator's interval leaves out 0 and yet no difference is shown; empty if none does."""
    rows = [r for pair in found for r in pair.differences.to_pylist() if r["batch"] is None and r["n"]]
    if not any(r["boot_low"] is not None and not r["favours"] and r["boot_low"] * r["boot_high"] > 0 for r in rows):
        return ""
    return (
        " Some intervals leave out 0 and yet no difference is shown: each interval stands for itself, and of many some leave it out by "
        "chance, for which Holm's correction makes up."
    )


def differences(pair: Found) -> Figure:
    """Mean differences with their intervals over all batches, a panel an indicator, each in its own unit and with its zero."""
    rows = [r for r in pair.differences.to_pylist() if r["batch"] is None and r["n"] > 0]
    figure = theme.new_figure(7.2, 0.55 * max(len(rows), 1) + 0.5)
    panels = figure.subplots(max(len(rows), 1), 1, squeeze=False)[:, 0]
    for axes, row in zip(panels, rows, strict=False):
        mean, low, high = row["mean_difference"], row["boot_low"], row["boot_high"]
        axes.axvline(0.0, color=theme.INK, linewidth=0.8)
        if low is not None and high is not None:
            axes.plot([low, high], [0.0, 0.0], color=theme.INK, linewidth=1.4)
        axes.plot([mean], [0.0], "o", color=theme.INK, markersize=4)
        unit = f" [{row['unit']}]" if row["unit"] else ""
        axes.set_ylabel(f"{row['indicator']}{unit}\nn = {row['n']}", rotation=0, ha="right", va="center", fontsize=8)
        axes.set_yticks([])
        axes.margins(x=0.15)
        axes.tick_params(labelsize=8)
    figure.suptitle(
        f"{pair.b} minus {pair.a}: mean of the differences, with its interval where there is one", fontsize=9
    )
    return figure


def success_table(found: Sequence[Found]) -> Grid:
    """Success over all batches, a row a pair."""
    lines: Rows = []
    for c in found:
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
        lines.append([Cell(c.b, strong=True), c.a, ours, theirs, difference, p_value(s.p) if paired else NONE])
    heads: Heads = [text("System"), text("against"), "successes", "against's", "difference (points)", "p"]
    return grid(
        "Success: difference of the rates with its interval; McNemar's exact test where the trials are pairs."
        + sharing.of_pairs(found),
        heads,
        lines,
    )


def indicator_table(found: Sequence[Found]) -> Grid:
    """Every indicator over all batches, a row a pair and indicator."""
    lines: Rows = []
    for c in found:
        for r in c.differences.to_pylist():
            if r["batch"] is not None or not r["n"]:
                continue
            unit = f" ({r['unit']})" if r["unit"] else ""
            difference = Cell(num(r["mean_difference"], 3), span(r["boot_low"], r["boot_high"], 3))
            better = {"A": c.a, "B": c.b}.get(r["favours"], "no difference shown")
            cells: list[Cell | str] = [
                str(r["n"]),
                num(r["mean_b"], 3),
                num(r["mean_a"], 3),
                difference,
                p_value(r["p_holm"]),
                better,
            ]
            lines.append([Cell(c.b, strong=True), c.a, f"{r['indicator']}{unit}", *cells])
    heads: Heads = [text("System"), text("against"), text("indicator"), "n", "mean", "against's mean", "difference",
                    "p (Holm)", text("better")]  # fmt: skip
    return grid(
        "Indicators over the tests that both finished, so that who fails the hard ones is not punished here: read it with the "
        "success above. Mean of the differences with its bootstrap interval, Wilcoxon's test, Holm's correction."
        + sharing.of_pairs(found),
        heads, lines,
    )  # fmt: skip


def _csv(found: Sequence[Found], file: Path) -> None:
    rows = [{"a": c.a, "b": c.b} | r for c in found for r in c.differences.to_pylist()]
    with open(file, "w", newline="", encoding="utf-8") as out:
        writer = csv.DictWriter(out, list(dict.fromkeys(name for row in rows for name in row)) or ["a", "b"])
        writer.writeheader()
        writer.writerows(rows)

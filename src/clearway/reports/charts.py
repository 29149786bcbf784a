"""Charts of what statistics found: normalised bars (paper A's Fig. 6) and correlation matrices (Fig. 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.indicators import HEADLINE
from clearway.reports import theme
from clearway.reports.grid import num
from clearway.reports.selection import at_speed, by_speed
from clearway.statistics import FEWEST, describe, success_rates, wilcoxon_between_speeds
from clearway.statistics.correlation import Correlations

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = ("CT", "PL", "DE", "OE", "SR", "MDO", "TCS")
"""Paper A's seven, in its order."""
FEWEST_FOR_A_BAR = 5
"""Values below which a mean is a point, not a bar."""
_SAME, _ABOVE, _BELOW = (
    "#f3f5f7",
    "#c8590c",
    "#1f6099",
)  # a step off the theme's inks: cells keep their colour in the dark
_DARK_TEXT, _LIGHT_TEXT = "#10181f", "#ffffff"


@dataclass(frozen=True, slots=True, eq=False)
class Bars:
    """What the bars of one robot with one navigator show.

    Attributes:
        descriptions: Rows of `describe`.
        rates: Rows of `success_rates`.
        tests: Rows of the tests between speeds.
    """

    descriptions: Sequence[Mapping[str, Any]]
    rates: Sequence[Mapping[str, Any]]
    tests: Sequence[Mapping[str, Any]]

    @classmethod
    def of(cls, table: Any) -> Bars:
        """Compute them from rows of the trials' table."""
        return cls(
            describe(table, HEADLINE).to_pylist(),
            success_rates(table).to_pylist(),
            wilcoxon_between_speeds(table).to_pylist(),
        )

    def of_batch(self, suite: str, batch: str) -> Bars:
        """What they show of one batch of a suite."""
        parts = (self.descriptions, self.rates, self.tests)
        return Bars(*([r for r in rows if (r["suite"], r["batch"]) == (suite, batch)] for rows in parts))


def bars(data: Bars) -> Figure:
    """A panel a batch: each indicator at each set speed, normalised by its range over the batch, 95 % intervals."""
    batches = list(dict.fromkeys((r["suite"], r["batch"]) for r in data.rates))
    several = len({suite for suite, _ in batches}) > 1
    speeds = sorted({r["speed"] for r in data.rates}, key=by_speed)
    colours = shades(len(speeds))
    lines = -(-len(batches) // 2)
    figure = theme.new_figure(10.0, 0.45 + 2.3 * lines)
    figure.get_layout_engine().set(hspace=0.1)  # type: ignore[union-attr,call-arg]
    top = 1.1
    for i, (suite, batch) in enumerate(batches):
        shown = data.of_batch(suite, batch)
        ax = figure.add_subplot(lines, min(2, len(batches)), i + 1)
        theme.panel_grid(ax)
        for k, name in enumerate(SHOWN):
            top = max(top, _group(ax, k, name, speeds, colours, shown))
        ax.set_title(f"{f'{suite} ' if several else ''}{batch}   n = {_counts(shown, speeds)}")
        ax.set(xlim=(-0.55, len(SHOWN) - 0.45), xticks=range(len(SHOWN)), yticks=[0, 0.5, 1.0])
        ax.set_xticklabels(SHOWN, color=theme.INK)
        ax.spines["left"].set_visible(False)
    for ax in figure.axes:
        ax.set_ylim(0, top + 0.04)
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=c, label=at_speed(s)) for s, c in zip(speeds, colours, strict=True)]
    figure.legend(handles=handles, loc="outside upper right", ncols=len(speeds), handlelength=1, handleheight=1)
    return figure


def shades(count: int) -> Sequence[str]:
    """A colour for each of so many set speeds, slow to fast."""
    return theme.SPEEDS[1:2] if count == 1 else (theme.SPEEDS * (1 + count // len(theme.SPEEDS)))[:count]


def _counts(data: Bars, speeds: Sequence[float | None]) -> str:
    found = {r["speed"]: r["n"] for r in data.rates}
    return ", ".join(str(found[s]) for s in speeds if s in found)


def _group(
    ax: Axes, place: int, name: str, speeds: Sequence[float | None], colours: Sequence[str], data: Bars
) -> float:
    """Draw an indicator's bars; returns how high they and their asterisks reach."""
    width = 0.78 / len(speeds)
    at = {s: place + (i - (len(speeds) - 1) / 2) * width for i, s in enumerate(speeds)}
    tops: dict[float | None, float] = {}
    for speed, colour in zip(speeds, colours, strict=True):
        found = _bar(name, speed, data)
        if found is None:
            continue
        mean, low, high, n = found
        if n < FEWEST_FOR_A_BAR:
            ax.plot(at[speed], mean, "o", color=colour, markersize=4, zorder=2)
            tops[speed] = mean
            continue
        ax.bar(at[speed], max(mean, 0.008), width * 0.9, color=colour, zorder=2)
        ends = [max(low, 0.0), min(high, 1.12)]
        ax.plot([at[speed]] * 2, ends, color=theme.PAPER, linewidth=2.0, zorder=3)  # so that it shows on a dark bar
        ax.plot([at[speed]] * 2, ends, color=theme.INK, linewidth=0.8, zorder=3)
        tops[speed] = min(max(high, mean), 1.12)
    if not tops:
        ax.text(place, 0.03, "n/a", ha="center", color=theme.MUTED, fontsize=theme.SMALLEST)
        return 0.0
    level = max(tops.values()) + 0.05
    for a, b in combinations(sorted(s for s in tops if s is not None), 2):
        test = next((t for t in data.tests if _is(t, name, a, b)), None)
        if test is None or not test["stars"]:
            continue
        kept = bool(test["stars_holm"])
        colour = theme.INK if kept else theme.MUTED
        ax.plot([at[a], at[a], at[b], at[b]], [level - 0.015, level, level, level - 0.015], color=colour, linewidth=0.6)
        ax.text(
            (at[a] + at[b]) / 2,
            level - 0.012,
            test["stars"],
            ha="center",
            va="bottom",
            fontsize=theme.SMALLEST,
            color=colour,
        )
        level += 0.085
    return level


def _bar(name: str, speed: float | None, data: Bars) -> tuple[float, float, float, int] | None:
    if name == "SR":
        rate = next((r for r in data.rates if r["speed"] == speed), None)
        if rate is None or rate["SR"] is None:
            return None
        return rate["SR"] / 100, rate["low"] / 100, rate["high"] / 100, rate["n"]
    row = next((r for r in data.descriptions if (r["speed"], r["indicator"]) == (speed, name)), None)
    if row is None or row["norm_mean"] is None or row["range_low"] == row["range_high"]:
        return None  # one value, or all alike: there is no range to normalise by
    mean = row["norm_mean"]
    return (
        mean,
        mean if row["norm_low"] is None else row["norm_low"],
        mean if row["norm_high"] is None else row["norm_high"],
        row["n"],
    )


def _is(test: Mapping[str, Any], name: str, a: float, b: float) -> bool:
    return test["analysis"] == "complete pairs" and (
        (test["indicator"], test["speed_a"], test["speed_b"]) == (name, a, b)
    )


def correlations(
    matrices: Mapping[tuple[str, str, str | None], Correlations], titles: Mapping[str, str] | None = None
) -> Figure:
    """A matrix a panel: r with n below it; stronger is darker, blue is negative, orange positive; without a colour where
    there are fewer than `FEWEST` trials."""
    from matplotlib.colors import LinearSegmentedColormap

    shades = LinearSegmentedColormap.from_list("r", [_BELOW, _SAME, _ABOVE])
    columns = min(3, len(matrices))
    lines = -(-len(matrices) // columns)
    figure = theme.new_figure(10.0, 3.45 * lines if columns > 1 else 5.0)
    several = len({key[1:] for key in matrices}) > 1
    for i, ((robot, navigator, setup), matrix) in enumerate(matrices.items()):
        ax = figure.add_subplot(lines, columns, i + 1)
        ax.set_title((titles or {}).get(robot, robot) + (f", {navigator} {setup or ''}".rstrip() if several else ""))
        _matrix(ax, matrix, shades)
    return figure


def _matrix(ax: Axes, matrix: Correlations, shades: Any) -> None:
    there = [i for i in range(len(matrix.indicators)) if matrix.n[i].sum() - matrix.n[i, i] > 0] or [0, 1]
    names, r, n = [matrix.indicators[i] for i in there], matrix.r[np.ix_(there, there)], matrix.n[np.ix_(there, there)]
    k = len(names)
    for row in range(1, k):
        for column in range(row):
            value = float(r[row, column])
            known = np.isfinite(value) and n[row, column] >= FEWEST
            colour = shades(0.5 + value / 2) if known else _SAME
            ax.add_patch(_square(column, row, colour))
            text = _LIGHT_TEXT if known and abs(value) > 0.55 else _DARK_TEXT
            ax.text(column, row - 0.08, num(value), ha="center", va="center", color=text, fontsize=8)
            ax.text(
                column, row + 0.28, f"n {n[row, column]}", ha="center", va="center", color=text, fontsize=theme.SMALLEST
            )
    ax.set(xlim=(-0.5, k - 1.5), ylim=(k - 0.5, 0.5), aspect="equal", xticks=range(k - 1), yticks=range(1, k))
    ax.set_xticklabels(names[:-1], color=theme.INK)
    ax.set_yticklabels(names[1:], color=theme.INK)
    ax.tick_params(length=0)
    for side in ax.spines.values():
        side.set_visible(False)


def _square(x: float, y: float, colour: Any) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, facecolor=colour, edgecolor="none")


def agreement(points: Sequence[tuple[str, float, float]], x: str, y: str, title: str) -> Figure:
    """Each course's (name, published, ours), shares of runs, against the line where both agree."""
    figure = theme.new_figure(5.2, 4.6)
    ax = figure.add_subplot()
    theme.panel_grid(ax)
    ax.grid(axis="x")
    a, b = np.array([[p, q] for _, p, q in points]).T
    low, high, pad = 0.0, max(1.0, float(a.max()), float(b.max())), 0.04
    ax.plot([low, high], [low, high], color=theme.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    ax.scatter(a, b, s=22, color=theme.ROBOT, alpha=0.55, edgecolors="none", zorder=3)
    ax.set(title=title, xlabel=x, ylabel=y, xlim=(low - pad, high + pad), ylim=(low - pad, high + pad), aspect="equal")
    return figure

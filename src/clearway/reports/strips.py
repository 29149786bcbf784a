"""Every trial's indicators in their own units, all systems on one scale: a strip of points a system and batch, no bars of means."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.indicators import INDICATORS
from clearway.reports import theme
from clearway.reports.charts import shades
from clearway.reports.selection import Row, System, at_speed, by_speed, system_of
from clearway.statistics import batch_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = {
    "CT": "completion time", "PL": "path length", "DE_max": "position, worst end", "OE_max": "heading, worst end",
    "MDO": "least distance to obstacles", "TCS": "time at cruise speed",
}  # fmt: skip
"""Indicators with their titles. Of the errors the worst end of a trial, by which it is judged."""
MOST_POINTS = 60
"""Values of a strip that are drawn one by one; of more their quantiles."""
FEWEST = 5
"""Values below which no median is drawn."""
_LINE, _WIDTH, _FONT = 0.19, 3.25, theme.SMALLEST


def strips(
    rows: Sequence[Row], name_of: Callable[[System], str], indicators: Sequence[str],
    tolerances: Mapping[tuple[System, str], float] | None = None,
) -> Figure | None:  # fmt: skip
    """A panel an indicator; None if none of the trials has any of them.

    Args:
        rows: The trials.
        name_of: A system's name for people.
        indicators: Names of `SHOWN`.
        tolerances: How large an error may be, by system and indicator.
    """
    known = [n for n in indicators if any(r.get(n) is not None for r in rows)]
    if not known:
        return None
    lines = _lines(rows)
    speeds = sorted({r["speed"] for r in rows}, key=by_speed)
    figure = theme.new_figure(_WIDTH, len(known) * (0.75 + _LINE * max(2, len(lines))))
    names = _names(list(lines), name_of)
    for i, name in enumerate(known):
        ax = figure.add_subplot(len(known), 1, i + 1)
        unit = INDICATORS[name].unit
        title = f"{name}: {SHOWN[name]}{f' ({unit})' if unit else ''}"
        if len(known) == 1:  # from the figure's edge on: above the panel alone it would not fit
            figure.suptitle(title, fontsize=_FONT + 0.8, x=0.01, ha="left", weight="bold")
        else:
            ax.set_title(title, fontsize=_FONT + 0.8)
        _panel(ax, name, lines, speeds, tolerances or {})
        ax.set_yticks(range(len(lines)), [n if len(n) <= 32 else f"{n[:31]}…" for n in names], fontsize=_FONT)
    if len(speeds) > 1:
        from matplotlib.lines import Line2D

        handles = [
            Line2D([], [], color=c, marker="o", linestyle="", markersize=4, label=at_speed(s))
            for s, c in zip(speeds, shades(len(speeds)), strict=True)
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=3, fontsize=_FONT, handletextpad=0.1)
    return figure


def _lines(rows: Sequence[Row]) -> dict[tuple[str, System], list[Row]]:
    """The trials of each batch and system, batch by batch; a batch with its suite before it where there are several suites."""
    found: dict[str, dict[System, list[Row]]] = {}
    for batch, r in zip(batch_names(rows), rows, strict=True):
        found.setdefault(batch, {}).setdefault(system_of(r), []).append(r)
    return {(batch, system): own for batch, systems in found.items() for system, own in systems.items()}


def _names(lines: Sequence[tuple[str, System]], name_of: Callable[[System], str]) -> list[str]:
    """Batch and system of each line, as far as lines differ in them."""
    batches, others = {batch for batch, _ in lines}, {system for _, system in lines}
    named = {system: name_of(system).split(" · ") for system in others}
    alike = len({parts[0] for parts in named.values()}) == 1 and len(others) > 1
    names = {system: " · ".join(parts[1:] if alike and len(parts) > 1 else parts) for system, parts in named.items()}
    shown = [[str(batch)] * (len(batches) > 1) + [names[system]] * (len(others) > 1) for batch, system in lines]
    return ["  ".join(parts) or str(batch) for parts, (batch, _) in zip(shown, lines, strict=True)]


def _panel(
    ax: Axes, name: str, lines: Mapping[tuple[str, System], Sequence[Row]], speeds: Sequence[float | None],
    tolerances: Mapping[tuple[System, str], float],
) -> None:  # fmt: skip
    ax.grid(axis="x")
    ax.set_axisbelow(True)
    height = 0.8 / len(speeds)
    batches = [batch for batch, _ in lines]
    for y, ((batch, system), own) in enumerate(lines.items()):
        there = 0
        for k, (speed, colour) in enumerate(zip(speeds, shades(len(speeds)), strict=True)):
            here = [r for r in own if r["speed"] == speed and r.get(name) is not None]
            there += len(here)
            at = y + (k - (len(speeds) - 1) / 2) * height
            _strip(ax, name, here, at, height, colour)
        allowed = tolerances.get((system, name))
        if allowed is not None and there:
            ax.plot([allowed] * 2, [y - 0.45, y + 0.45], color=theme.INK, linewidth=1.2, zorder=4)
        ax.text(
            1.01,
            y,
            f"{there}/{len(own)}",
            transform=ax.get_yaxis_transform(),
            va="center",
            fontsize=_FONT,
            color=theme.MUTED,
        )
        if y and batches[y - 1] != batch:
            ax.axhline(y - 0.5, color=theme.RULE, linewidth=0.8)
    ax.set(ylim=(len(lines) - 0.4, -0.6), xlim=(0, None))
    ax.set_xlim(right=1.04 * ax.get_xlim()[1])
    ax.tick_params(labelsize=_FONT, length=0, axis="y")
    ax.tick_params(labelsize=_FONT, axis="x")


def _strip(ax: Axes, name: str, rows: Sequence[Row], at: float, height: float, colour: Any) -> None:
    """Points, those of failed trials apart; or their quantiles, where they are many."""
    if len(rows) > MOST_POINTS:
        low, first, third, high = np.quantile([r[name] for r in rows], (0.05, 0.25, 0.75, 0.95))
        ax.plot([low, high], [at, at], color=colour, linewidth=1.0, zorder=2)
        ax.plot([first, third], [at, at], color=colour, linewidth=4.5, solid_capstyle="butt", zorder=2)
    for failed in (False, True) if 0 < len(rows) <= MOST_POINTS else ():
        values = [r[name] for r in rows if (r["success"] is False) == failed]
        jitter = [(0.618 * i % 1 - 0.5) * 0.55 * height for i in range(len(values))]
        look: dict[str, Any] = (
            {"marker": "x", "color": theme.BAD, "linewidths": 0.8}
            if failed
            else {"color": colour, "edgecolors": "none"}
        )
        ax.scatter(values, at + np.array(jitter), s=9, zorder=3, **look)
    if len(rows) >= FEWEST:
        middle = float(np.median([r[name] for r in rows]))
        ax.plot([middle] * 2, [at - 0.4 * height, at + 0.4 * height], color=theme.PAPER, linewidth=3.0, zorder=4)
        ax.plot([middle] * 2, [at - 0.4 * height, at + 0.4 * height], color=theme.ROBOT, linewidth=1.6, zorder=5)

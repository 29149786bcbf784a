"""Figures of robots among people and among each other: how near they came, and what more of either changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.reports import theme
from clearway.reports.findings import Findings
from clearway.reports.selection import Row
from clearway.statistics import mean_interval, success_interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ZONES = {"intimate": 0.45, "personal": 1.2, "social": 3.6}
"""m."""
COUNTED = {"people": "people", "other_robots": "other robots"}
"""Columns that count who is there, and how they are printed."""
_FOLLOWED = {
    "person_distance": "distance from a person (m)",
    "people_delay": "people's delay (s)",
    "CT": "completion time (s)",
}
_LINES = ("-", "--", "-.", ":")
_COLOURS = (theme.ROBOT, theme.MOVING, theme.MARK, theme.INK)
FEWEST = 5
"""Trials with a distance from which on a system's distribution is drawn."""


def distances(f: Findings) -> Figure | None:
    """In what share of the trials a robot stayed at least how far from people, system by system, of the trials
    that finished or touched one; None without enough of them."""
    drawn: dict[str, FloatArray] = {}
    for system in f.systems:
        among = [r for r in f.of(system) if r.get("people") or r.get("person_distance") is not None]
        if len(known := _known(among, "person_distance")) >= FEWEST:
            drawn[f"{f.name(system)}, {len(known)} of {len(among)}"] = np.sort(known)
    if not drawn:
        return None
    figure = theme.new_figure(6.2, 3.8)
    ax = figure.add_subplot()
    theme.panel_grid(ax)
    for k, (name, values) in enumerate(drawn.items()):
        share = 100.0 * np.arange(len(values), 0, -1) / len(values)
        ax.step([0.0, *values], [100.0, *share], where="pre", label=name, **_style(k))
    right = max(float(values[-1]) for values in drawn.values())
    for name, reach in ZONES.items():
        if reach < right:
            ax.axvline(reach, color=theme.MUTED, linewidth=0.8, linestyle=":")
            ax.text(reach, 2.0, f" {name}", color=theme.MUTED, fontsize=theme.SMALLEST)
    ax.set(
        xlabel="smallest distance from a person (m)", ylabel="trials at least so far (%)", xlim=(0, None), ylim=(0, 104)
    )
    ax.legend(loc="upper right", fontsize=theme.SMALLEST)
    return figure


def by_number(f: Findings, suite: str, column: str) -> Figure | None:
    """Success and what it takes in a suite by how many are there, with 95 % intervals; None where there are always as many."""
    from matplotlib.ticker import MaxNLocator

    own = [r for r in f.rows if r["suite"] == suite]
    counts = sorted({int(r[column]) for r in own if r.get(column) is not None})
    if len(counts) < 2:
        return None
    there = [
        name
        for name in _FOLLOWED
        if len({r[column] for r in own if r.get(column) is not None and r.get(name) is not None}) > 1
    ]
    figure = theme.new_figure(8.6, 3.3 * (1 + len(there) // 2))
    panels = [figure.add_subplot(1 + len(there) // 2, 2, k + 1) for k in range(1 + len(there))]
    for k, system in enumerate(f.systems):
        rows = {n: [r for r in f.of(system) if r["suite"] == suite and r.get(column) == n] for n in counts}
        shift = 0.015 * (counts[-1] - counts[0]) * (k - 0.5 * (len(f.systems) - 1))
        _curve(panels[0], {n + shift: _rate(some) for n, some in rows.items()}, f.name(system), k)
        for ax, name in zip(panels[1:], there, strict=True):
            _curve(ax, {n + shift: _interval(_known(some, name)) for n, some in rows.items()}, f.name(system), k)
    for ax, title in zip(panels, ("success (%)", *(_FOLLOWED[name] for name in there)), strict=True):
        theme.panel_grid(ax)
        ax.set(xlabel=COUNTED[column], ylabel=title)
        if title != _FOLLOWED["people_delay"]:
            ax.set_ylim(bottom=0.0)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=3, fontsize=theme.SMALLEST)
    return figure


def _known(rows: Sequence[Row], name: str) -> list[float]:
    return [float(r[name]) for r in rows if r.get(name) is not None]


def _rate(rows: Sequence[Row]) -> list[float]:
    """Share of successes and its exact 95 % interval, %; nothing where nobody knows."""
    known = [bool(r["success"]) for r in rows if r["success"] is not None]
    if not known:
        return []
    found = success_interval(sum(known), len(known))
    return [100.0 * x for x in (found.estimate, found.low, found.high)]


def _interval(values: Sequence[float]) -> list[float]:
    """Mean and its 95 % interval; NaN where that is unknown, nothing without values."""
    found = mean_interval(np.array(values))
    return [found.estimate, found.low, found.high] if found else [*values, *(2 * len(values) * [np.nan])]


def _curve(ax: Axes, points: Mapping[float, Sequence[float]], name: str, k: int) -> None:
    x = [n for n, point in points.items() if len(point)]
    y = np.array([points[n] for n in x]).reshape(-1, 3)
    if len(x):
        ends = np.nan_to_num(np.abs(y[:, 1:] - y[:, :1])).T
        ax.errorbar(np.array(x), y[:, 0], ends, marker="o", markersize=3, capsize=2, label=name, **_style(k))


def _style(k: int) -> dict[str, Any]:
    return {"linestyle": _LINES[k % 4], "color": _COLOURS[k % 4], "linewidth": 1.4}

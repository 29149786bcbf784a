"""What a tuning found as a page: three sentences, what it gained on the held-out trials, the parameters, the Pareto front."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from clearway.errors import shown
from clearway.improving.objective import Goal
from clearway.reports import theme
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, span, text
from clearway.reports.page import PAGE, page_of
from clearway.reports.summary import Summary
from clearway.robots import load_robot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from clearway.improving.search import Candidate
    from clearway.improving.task import Task
    from clearway.improving.tuning import Tuning

FRONT = "front.svg"
"""The figure's file."""


def write_page(found: Tuning, asked: Task, goals: Sequence[Goal], tried: Sequence[Candidate], training: int) -> Path:
    """Write `index.html` and the figure of the candidates into the tuning's folder; returns the page's path.

    Args:
        found: What came of it.
        asked: What was to be tuned.
        goals: What is better, the most important first.
        tried: All candidates; the first one came in.
        training: How many training trials there are.
    """
    with theme.style():
        drawn = front(found, goals, tried, training)
    svg = theme.to_svg(drawn, "candidates")
    (found.path / FRONT).write_text(svg, encoding="utf-8")
    robot = load_robot(asked.robot).title
    page = page_of(
        "tuning.html", title=f"{robot} with {asked.navigator.partition('[')[0]}, tuned", said=_summary(found, asked, robot, training),
        gains=_gains(found), parameters=_parameters(found, asked), figure=Markup(theme.themed(svg, escape("Candidates"))),
        held_out=found.comparison is not None,
    )  # fmt: skip
    (found.path / PAGE).write_text(page, encoding="utf-8", errors="replace")
    return found.path / PAGE


def _summary(found: Tuning, asked: Task, robot: str, training: int) -> Summary:
    many = len(asked.variables)
    what = "1 parameter" if many == 1 else f"{many} parameters"
    tested = f"{robot} with {asked.navigator}: {what}, chosen on {training} tests of {asked.training.suites[0]} in {found.trials} trials"
    limits = [
        *found.warnings,
        "the robot is simulated, so this says what is better as far as its model holds",
        "elsewhere, and for other tasks than these, other parameters may be better",
    ]
    if found.comparison is None:
        return Summary(f"{tested}.", "Nothing was found that is better than what came in.", _sentence(limits))
    tested += f"; what came in and what was found compared on {found.comparison.pairs} tests of {asked.held_out.suites[0]}, held out."
    broken = [f"{limit} is broken" for limit, _, _, holds in found.limits if not holds]
    return Summary(tested, f"{'; '.join([*map(str, found.gains), *broken])}.", _sentence(limits))


def _sentence(parts: Sequence[str]) -> str:
    joined = "; ".join(parts)
    return f"{joined[0].upper()}{joined[1:]}."


def _gains(found: Tuning) -> Grid:
    rows: Rows = []
    for gain in found.gains:
        said = {1: "better", -1: "worse", 0: "no difference shown"}[gain.verdict]
        unit = f" ({gain.unit})" if gain.unit else ""
        difference = Cell(_number(gain.difference), span(gain.low, gain.high, 3))
        rows.append(
            [Cell(f"{gain.indicator}{unit}", strong=True), _number(gain.before), _number(gain.after), difference, said]
        )
    for limit, was, now, holds in found.limits:
        rows.append([limit, _number(was), _number(now), NONE, "holds" if holds else Cell("broken", strong=True)])
    heads: Heads = [text("on the held-out tests"), "before", "after", "paired difference", text("shown")]
    return grid(
        "Means over the trials that have a value, and the difference over pairs of which both have one, with its 95 % interval where there "
        "are pairs enough for one: of success by McNemar's test, of all others by Wilcoxon's with Holm's correction.",
        heads, rows,
    )  # fmt: skip


def _parameters(found: Tuning, asked: Task) -> Grid:
    rows: Rows = []
    for v in asked.variables:
        ends = (
            ", ".join(map(shown, v.choices))
            if v.choices
            else f"{v.low:g} to {v.high:g}{', logarithmic' if v.log else ''}"
        )
        was, now = found.before[v.name], found.after[v.name]
        rows.append([v.name, NONE if was is None else shown(was), Cell(shown(now), strong=was != now), ends])
    heads: Heads = [text("parameter"), "came in", "found", text("searched")]
    return grid("What was tuned.", heads, rows)


def front(found: Tuning, goals: Sequence[Goal], tried: Sequence[Candidate], training: int) -> Figure:
    """The candidates by two goals, or by their order where there is one: light on some trials, dark on all; the front joined.

    A panel a goal behind the first one.
    """
    panels = max(len(goals) - 1, 1)
    figure = theme.new_figure(4.0 * panels + 1.8, 3.3)
    row = figure.subplots(1, panels, squeeze=False)[0]
    for axes, k in zip(row, range(1, panels + 1), strict=True):
        _panel(axes, found, goals, tried, training, k if len(goals) > 1 else None)
    figure.legend(*row[0].get_legend_handles_labels(), loc="outside right upper")
    return figure


def _panel(
    axes: Axes, found: Tuning, goals: Sequence[Goal], tried: Sequence[Candidate], training: int, k: int | None
) -> None:
    def place(one: Candidate) -> tuple[float, float]:
        return (one.number if k is None else one.score.goals[k]), one.score.goals[0]

    def kept(one: Candidate) -> bool:
        return one.score.excess == 0.0 and not any(map(math.isnan, one.score.goals))

    def draw(which: Sequence[Candidate], label: str, **how: Any) -> None:
        if points := [place(one) for one in which]:
            axes.scatter([x for x, _ in points], [y for _, y in points], label=label, **how)

    whole = [c for c in tried if c.score.trials >= training]
    draw([c for c in tried if c.score.trials < training and kept(c)], "on a part of the tests", s=9, color=theme.RULE)
    draw([c for c in whole if kept(c)], f"on all {training} tests", s=22, color=theme.SPEEDS[1])
    draw([c for c in whole if not kept(c)], "breaks a constraint", s=22, marker="x", color=theme.BAD)
    if k is not None:
        line = sorted(map(place, found.front))
        axes.plot([x for x, _ in line], [y for _, y in line], color=theme.SPEEDS[1], lw=0.9, label="Pareto front")
    draw(tried[:1], "came in", s=60, marker="s", color=theme.INK, zorder=3)
    if found.comparison is not None:
        chosen = [c for c in whole if c.values == dict(found.after)]
        draw(chosen, "chosen", s=60, marker="*", color=theme.MOVING, zorder=3)
    axes.set(xlabel="candidate" if k is None else _named(goals[k]), ylabel=_named(goals[0]))


def _named(goal: Goal) -> str:
    return f"{goal.indicator} ({'less' if goal.sign == 1 else 'more'} is better)"


def _number(value: float) -> str:
    return NONE if math.isnan(value) else f"{value:.4g}".replace("-", "−")

"""Figures of floors: how each configuration was set up, and how it went in it (paper A's Figs. 2 and 5)."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clearway.contract import PLACED
from clearway.geometry.shapes import FloatArray
from clearway.reports import paper, theme
from clearway.reports.floor_drawing import (
    around,
    draw_bodies,
    draw_lanes,
    draw_robot,
    draw_set_up,
    draw_tracks,
    floor,
    frame,
    known_positions,
)
from clearway.reports.selection import (
    Row,
    configuration_of,
    configurations,
    distinct,
    is_recorded,
    label,
    representative,
    verdict,
)
from clearway.trials import Outcome, Trial
from clearway.trials.store import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 12
"""Configurations drawn in one figure; of more, a sample spread evenly."""
MOST_LANES = 60
"""Trials of a configuration that are read to see how far its moving obstacle goes."""
MOST_ENDS = 24
"""Trials of a configuration that failed on their way whose end is marked; of more, a sample spread evenly."""
_ROOMIEST = 1.5
"""Area of a box that all panels share over that which the largest needs, at most."""
_ENDED = (
    ({Outcome.COLLISION}, "x", "\N{MULTIPLICATION SIGN} touched something"),
    ({Outcome.TIMEOUT, Outcome.LIVELOCK, Outcome.ABORTED}, "s", "\N{WHITE SQUARE} out of time or given up"),
)


def layout(results: Results, rows: Sequence[Row]) -> Figure:
    """Every configuration as it was set up: A, B, obstacles in all their sizes, the moving obstacle's lane (Fig. 2)."""
    panels = spread(configurations(rows))
    figure, axes = _panels(panels, results, rows, 4, setting=True)
    for ax, key in zip(axes, panels, strict=True):
        chosen = [r for r in rows if configuration_of(r) == key]
        gaps, sizes = distinct(chosen, "gap"), distinct(chosen, "size")
        gap = gaps[len(gaps) // 2] if gaps else None
        there = [results.remains(r["trial"]) for r in [r for r in chosen if r["gap"] == gap][:24]]
        trial = max(there, key=lambda t: (known_positions(t.pose).any(), _shown(t)))  # an attempt may be unrecorded
        draw_set_up(ax, trial, theme.FIXTURE)
        lanes = [results.remains(r["trial"]) for r in chosen[:MOST_LANES] if r["obstacle_speed"] is not None]
        if not sizes:
            draw_bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])
        for size in reversed(sizes):
            row = next((r for r in chosen if r["gap"] == gap and r["size"] == size), None)
            if row is not None:
                nested = results.remains(row["trial"]).attempt.bodies
                draw_bodies(ax, [b for b in nested if b.kind in PLACED], alpha=0.25 + 0.75 / len(sizes))
        draw_lanes(ax, lanes or [trial])
        for leg in trial.attempt.legs[:1]:
            draw_robot(ax, trial, leg.start)
        ax.set_title(_titled(*key, panels))
        notes = []
        if sizes:
            notes.append(f"{_named('S', sizes, paper.EDGES) or 'edge'} {_join(sizes)} m")
        if gaps:
            drawn = f" (drawn: {gap:g})" if len(gaps) > 1 else ""
            notes.append(f"{_named('d', gaps, paper.GAPS) or 'gap'} {_join(gaps)} d_base{drawn}")
        if not sizes and not distinct(chosen, "obstacle_speed"):
            ways = [float(np.hypot(*(leg.goal[:2] - leg.start[:2]))) for leg in trial.attempt.legs[:1]]
            said = [f"A–B {round(way, 2):g} m" for way in ways if np.isfinite(way)]
            speeds = distinct(chosen, "speed")
            notes.append(", ".join([*said, *([f"v {_join(speeds)} m/s"] if speeds else [])]))
        if distinct(chosen, "obstacle_speed"):
            notes.append(f"obstacle {_join(distinct(chosen, 'obstacle_speed'))} m/s")
        _note(ax, "\n".join(notes))
    return figure


def trajectories(results: Results, rows: Sequence[Row]) -> Figure:
    """A representative trial of each configuration: the path with footprints at intervals, the moving obstacle's track (Fig. 5);
    and where others of it failed on their way."""
    panels = spread(configurations(rows))
    ends = [_ends(results, [r for r in rows if configuration_of(r) == key]) for key in panels]
    figure, axes = _panels(panels, results, rows, 2, ends=[[at for _, _, at in found] for found in ends])
    columns = axes[0].get_subplotspec().get_gridspec().ncols  # type: ignore[union-attr]
    for ax, key, found in zip(axes, panels, ends, strict=True):
        row = _representative(results, rows, key)
        trial = results.remains(row["trial"])
        draw_set_up(ax, trial, theme.FIXTURE)
        draw_bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])
        draw_tracks(ax, trial)
        ended = "" if row["success"] else f" ({verdict(row)})"
        ax.set_title(_titled(*key, panels))
        ended += "" if results.kept(row) else ", not kept"
        words = [f"trial {row['trial']}: {label(row).partition(', ')[2]}{ended}"]
        for marker, said, at in found:
            for colour, width in ((theme.PAPER, 4.0), (theme.BAD, 1.8)):  # seen among the ways of a crowd
                ax.plot(
                    *at.T,
                    linestyle="",
                    marker=marker,
                    markersize=7,
                    color=colour,
                    fillstyle="none",
                    markeredgewidth=width,
                    zorder=8,
                )
            words += [said] if said else []
        _note(ax, "\n".join(textwrap.fill(line, 38 if columns > 2 else 90) for line in words))
    return figure


def one_trial(trial: Trial, title: str) -> Figure:
    """One trial's trajectory, large."""
    figure = theme.new_figure(8.0, 4.8)
    ax = figure.add_subplot()
    floor(ax, trial, around([trial]))
    draw_tracks(ax, trial)
    ax.set_title(title)
    return figure


def clearance(trial: Trial, title: str) -> Figure:
    """Edge-to-edge clearance over time of one trial."""
    from clearway.reports.replay_encoding import broken, clearance_over_time

    trial = broken(trial)
    figure = theme.new_figure(8.0, 2.6)
    ax = figure.add_subplot()
    theme.panel_grid(ax)
    values = clearance_over_time(trial)
    if values is None:
        ax.text(0.5, 0.5, "nothing to stay clear of, or footprint unknown", ha="center", transform=ax.transAxes)
    else:
        ax.plot(trial.t, values, color=theme.ROBOT, linewidth=1.2)
        ax.set_ylim(0, max(0.2, min(3.0, float(np.nanmax(values, initial=0.0)))))
    for span in trial.spans:
        name = trial.attempt.legs[span.leg].name
        ax.axvline(span.start, color=theme.RULE, linewidth=0.8)
        ax.text(span.start, 1.0, f" {name}", transform=ax.get_xaxis_transform(), va="top", color=theme.MUTED)
    ax.set(title=title, xlabel="time (s)", ylabel="clearance (m)")
    return figure


def spread(panels: Sequence[tuple[str, str, str]], most: int = MOST_PANELS) -> list[tuple[str, str, str]]:
    """At most `most` of the configurations, evenly spread over their order."""
    if len(panels) <= most:
        return list(panels)
    return [panels[int(i)] for i in np.linspace(0, len(panels) - 1, most).round()]


def _representative(results: Results, rows: Sequence[Row], panel: tuple[str, str, str]) -> Row:
    """The trial to show of a configuration, among those that were kept if any was."""
    there = [r for r in rows if configuration_of(r) == panel]
    row = representative([r for r in there if results.kept(r)] or there)
    assert row is not None
    return row


def _panels(
    panels: Sequence[tuple[str, str, str]],
    results: Results,
    rows: Sequence[Row],
    columns: int,
    *,
    setting: bool = False,
    ends: Sequence[Sequence[FloatArray]] = (),
) -> tuple[Figure, list[Axes]]:
    """A figure with a panel for each, all of one scale: of the stretch of floor that the trials need, with `ends` (n, 2), or the `setting`."""
    samples = []
    for key in panels:
        row = _representative(results, rows, key)
        samples.append(results.remains(row["trial"]))
    boxes = _boxes(samples, ends or [()] * len(samples), driven=not setting)
    x0, y0, x1, y1 = boxes[0]
    tall = (y1 - y0) / (x1 - x0)
    columns = min(max(columns, 6 if tall > 1.5 else 4 if tall > 0.72 or len(panels) > 4 else 2), max(len(panels), 2))
    if len(panels) == 1 and tall < 0.6:
        columns = 1
    lines, width = -(-len(panels) // columns), 10.0
    figure = theme.new_figure(width, lines * (0.62 + width / columns * (y1 - y0) / (x1 - x0)))
    axes = [figure.add_subplot(lines, columns, i + 1) for i in range(len(panels))]
    for ax, box in zip(axes, boxes, strict=True):
        frame(ax, box)
    return figure, axes


def _boxes(
    samples: Sequence[Trial], ends: Sequence[Sequence[FloatArray]], *, driven: bool
) -> list[tuple[float, float, float, float]]:
    """A box (x0, y0, x1, y1) [m] a trial, all of one size: the same place for all where that takes little more, else each its own."""
    own = np.array([around([s], also=also, driven=driven) for s, also in zip(samples, ends, strict=True)])
    every = np.array(around(samples, also=[at for also in ends for at in also], driven=driven))
    size = (own[:, 2:] - own[:, :2]).max(0)
    if np.prod(every[2:] - every[:2]) <= _ROOMIEST * np.prod(size):
        return [tuple(every.tolist())] * len(samples)
    middle = (own[:, :2] + own[:, 2:]) / 2
    return [tuple(box) for box in np.hstack([middle - size / 2, middle + size / 2]).tolist()]


def _titled(suite: str, batch: str, configuration: str, panels: Sequence[tuple[str, str, str]]) -> str:
    """A panel's title: its suite and its batch, of which there are several, and its configuration."""
    suites, batches = ({panel[k] for panel in panels} for k in (0, 1))
    alone = configuration in (batch, "free")
    words = ([batch] if alone or len(batches) > 1 else []) + ([] if alone else [configuration])
    return "\n".join([*([suite] if len(suites) > 1 else []), " ".join(words)])


def _shown(trial: Trial) -> float:
    """How far the moving obstacle came on the first leg, m: the trial with most shows its lane best."""
    track = trial.moving_obstacles[np.asarray(trial.leg) == 0][:, :, :2].reshape(-1, 2)
    known = track[np.isfinite(track).all(1)]
    return float(np.ptp(known, axis=0).sum()) if len(known) else 0.0


def _ends(results: Results, rows: Sequence[Row]) -> list[tuple[str, str, FloatArray]]:
    """Of each way in which simulated trials failed before their last goal: its mark, how many did so where there are several, and where
    (n, 2) at most `MOST_ENDS` of them."""
    found = []
    for outcomes, marker, said in _ENDED:
        there = [r for r in rows if r["outcome"] in outcomes and not is_recorded(r)]
        if there:
            kept = [r["trial"] for r in there if results.kept(r)]
            some = np.linspace(0, len(kept) - 1, min(len(kept), MOST_ENDS)).round().astype(int)
            at = np.array([results.remains(kept[i]).pose[-1, :2] for i in some]).reshape(-1, 2)
            few = "" if len(at) == len(there) else f", {len(at)} marked"
            found.append((marker, f"{said}: {len(there)} of {len(rows)}{few}" if len(rows) > 1 else "", at))
    return found


def _note(ax: Axes, text: str) -> None:
    ax.set_xlabel(text, fontsize=theme.SMALLEST, loc="left", color=theme.MUTED)


def _named(letter: str, values: Sequence[float], all_of_them: Sequence[float]) -> str:
    """What the paper calls these values, such as `S1–S4`; empty if it has no name for one of them."""
    places = [i + 1 for v in values for i, w in enumerate(all_of_them) if abs(v - w) < 1e-9]
    if len(places) != len(values):
        return ""
    together = len(places) > 2 and places == list(range(places[0], places[-1] + 1))
    return f"{letter}{places[0]}–{letter}{places[-1]}" if together else ", ".join(f"{letter}{p}" for p in places)


def _join(values: Sequence[float]) -> str:
    return ", ".join(f"{v:g}" for v in values)

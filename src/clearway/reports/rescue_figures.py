"""Paper B's figures: paths among the obstacles with the distance to the nearest one over time (Figs. 4-9), and what a
navigator thought at an instant: belts, trees, potentials (Figs. 2 and 10).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.contract import PLACED
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.reports import theme
from clearway.reports.selection import Row, label, verdict
from clearway.trials import Body, Snapshot, Trial
from clearway.trials.store import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LINES = ("-.", "-", "--", ":")
_COLOURS = (theme.ROBOT, theme.MARK, theme.MOVING, theme.INK)


def paths(results: Results, rows: Sequence[Row], title: str) -> Figure:
    """The same test under each set-up: paths on the left, distance to the nearest obstacle on the right (Figs. 4-9).

    Distances are from centre to centre, as in the paper; the dashed line is where robot and obstacle touch.
    """
    trials = [(r, results.remains(r["trial"])) for r in rows]
    figure = theme.new_figure(10.0, 4.6)
    ax, distance = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    first = trials[0][1]
    _arena(ax, first)
    theme.panel_grid(distance)
    for k, (row, trial) in enumerate(trials):
        line: dict[str, Any] = {"linestyle": _LINES[k % 4], "color": _COLOURS[k % 4], "linewidth": 1.5}
        name = f"set-up {row['setup']}" if row["setup"] else row["navigator"]
        name += "" if row["success"] else f" ({row['cause'] or verdict(row)})"
        name += "" if results.kept(row) else " (not kept)"
        ax.plot(*trial.pose[:, :2].T, label=name, zorder=6, **line)
        if not row["success"]:
            ax.plot(*trial.pose[-1, :2], marker="x", color=theme.BAD, markersize=7, zorder=8)
        nearest, touching = centre_distance(trial)
        if nearest is not None:
            distance.plot(trial.t, nearest, label=name, **line)
            distance.axhline(touching, color=theme.INK, linestyle="--", linewidth=0.9)
    ax.set_title(title)
    ax.legend(loc="upper left", fontsize=theme.SMALLEST)
    distance.set(title="Distance to the nearest obstacle", xlabel="time (s)", ylabel="centre to centre (m)")
    distance.set_ylim(bottom=0)
    return figure


def thought(results: Results, row: Row, at: float | None = None) -> Figure:
    """What the navigator of one trial showed of its thinking at `at` [s] (default: where it shows most; Figs. 2 and 10)."""
    trial = results.trial(row["trial"])
    figure = theme.new_figure(6.2, 6.0)
    ax = figure.add_subplot()
    snapshot = chosen(trial, at)
    if snapshot is None:
        ax.text(0.5, 0.5, "the navigator showed nothing", ha="center", transform=ax.transAxes)
        return figure
    i = min(int(np.searchsorted(trial.t, snapshot.t + 1e-9)), len(trial.t)) - 1
    _arena(ax, trial, at=i)
    _snapshot(ax, snapshot)
    if trial.attempt.footprint is not None:
        outline = theme.outline(trial.attempt.footprint, trial.pose[i]).T
        ax.fill(*outline, facecolor=theme.ROBOT, alpha=0.5, zorder=7)
        ax.plot(*outline, color=theme.ROBOT, linewidth=1.0, zorder=7)
    ax.plot(*trial.pose[: i + 1, :2].T, color=theme.ROBOT, linewidth=1.2, zorder=6)
    status = f", {snapshot.diagnostics.status}" if snapshot.diagnostics.status else ""
    ax.set_title(f"{row['navigator']}, {label(row)}, at {snapshot.t:.1f} s{status}")
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="upper left", fontsize=theme.SMALLEST)
    return figure


def chosen(trial: Trial, at: float | None = None) -> Snapshot | None:
    """The snapshot at or before `at` [s]; without `at` the one that shows most; None if there is none."""
    if not trial.snapshots:
        return None
    if at is not None:
        before = [s for s in trial.snapshots if s.t <= at + 1e-9]
        return before[-1] if before else trial.snapshots[0]

    def content(s: Snapshot) -> int:
        d = s.diagnostics
        drawn = sum(map(len, d.circles.values())) + (0 if d.tree is None else len(d.tree))
        return drawn + sum(map(len, d.polylines.values())) + (0 if d.field is None else 1)

    return max(trial.snapshots, key=content)


def centre_distance(trial: Trial) -> tuple[FloatArray | None, float]:
    """(n,) distance between the centres of the robot and of the nearest obstacle [m], and that at which two touch."""
    obstacles = [b for b in trial.attempt.bodies if b.kind in PLACED]
    if not obstacles or trial.attempt.footprint is None:
        return None, 0.0
    out, k = np.full(len(trial.t), np.inf), 0
    for body in obstacles:
        if body.pose is None:
            at, k = trial.moving_obstacles[:, k, :2], k + 1
        else:
            at = np.broadcast_to(body.pose[:2], (len(trial.t), 2))
        gap = np.hypot(*(trial.pose[:, :2] - at).T)
        out = np.fmin(out, gap)
    reach = circumscribed_radius(trial.attempt.footprint) + max(circumscribed_radius(b.shape) for b in obstacles)
    return out, reach


def _arena(ax: Axes, trial: Trial, at: int | None = None) -> None:
    """Start, goal, static obstacles, and the moving ones: their ways, or where they are at sample `at`."""
    leg = trial.attempt.legs[0]
    ends = np.array([leg.start[:2], leg.goal[:2]])
    low, high = ends.min(0) - 2.0, ends.max(0) + 2.0
    if (high - low).min() < 6.0:
        middle = (low + high) / 2
        low, high = np.minimum(low, middle - 3.0), np.maximum(high, middle + 3.0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    ax.plot(*ends[0], marker="o", color=theme.MARK, markersize=4, zorder=8)
    ax.plot(*ends[1], marker="*", color=theme.MARK, markersize=9, zorder=8)
    k = 0
    for body in trial.attempt.bodies:
        if body.pose is not None:
            colour = theme.INK if body.kind in PLACED else theme.FIXTURE
            ax.fill(*theme.outline(body.shape, body.pose).T, facecolor=colour, zorder=3)
            continue
        track = trial.moving_obstacles[:, k]
        k += 1
        _moving_obstacle(ax, body, track, at)


def _moving_obstacle(ax: Axes, body: Body, track: FloatArray, at: int | None) -> None:
    known = track[np.isfinite(track).all(1)]
    if not len(known):
        return
    if at is None:
        ax.plot(*known[:, :2].T, color=theme.BAD, linewidth=0.6, alpha=0.6, zorder=2)
        ax.fill(*theme.outline(body.shape, known[0]).T, facecolor=theme.BAD, alpha=0.75, zorder=3)
    elif np.isfinite(track[at]).all():
        ax.plot(*track[: at + 1, :2].T, color=theme.BAD, linewidth=0.6, alpha=0.5, zorder=2)
        ax.fill(*theme.outline(body.shape, track[at]).T, facecolor=theme.BAD, alpha=0.85, zorder=3)


def _snapshot(ax: Axes, snapshot: Snapshot) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    d = snapshot.diagnostics
    if d.field is not None:
        grid = d.field
        rows, columns = grid.data.shape
        x, y = grid.origin[0], grid.origin[1]
        box = (x, x + columns * grid.resolution, y, y + rows * grid.resolution)
        ax.imshow(grid.data, origin="lower", extent=box, cmap="Blues", alpha=0.7, zorder=1, interpolation="bilinear")
        ax.set_aspect("equal")
    if d.tree is not None and len(d.tree):
        segments = [[(a[0], a[1]), (a[2], a[3])] for a in d.tree]
        ax.add_collection(LineCollection(segments, colors=theme.FIXTURE, linewidths=0.5, zorder=4), autolim=False)
    for k, (name, discs) in enumerate(sorted(d.circles.items())):
        colour = (theme.MOVING, theme.MARK, theme.MUTED)[k % 3]
        for j, (x, y, r) in enumerate(discs):
            ax.add_patch(
                Circle((x, y), r, fill=False, edgecolor=colour, linewidth=0.8, label="" if j else name, zorder=5)
            )
    for x, y, r in d.tube if d.tube is not None else ():
        ax.add_patch(Circle((x, y), r, facecolor=theme.ROBOT, edgecolor="none", alpha=0.12, zorder=4))
    for k, (name, line) in enumerate(sorted(d.polylines.items())):
        colour = (theme.MARK, theme.MOVING, theme.INK, theme.MUTED)[k % 4]
        ax.plot(*np.asarray(line).T, color=colour, linestyle=_LINES[1 + k % 3], linewidth=1.3, label=name, zorder=6)

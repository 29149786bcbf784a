"""Draws floors: what stands and moves in a trial, where it was to go, and how it went (paper A's Figs. 2 and 5)."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clearway.contract import PLACED, BodyKind
from clearway.geometry.shapes import Circle, FloatArray, circumscribed_radius
from clearway.reports import paper, theme
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
from clearway.trials import Body, Outcome, Trial
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
SLIMMEST = 0.42
"""Short side of a panel over its long one, at least."""
FOOTPRINT_EVERY = 0.6
"""m of path between two footprints drawn."""
_ROOMIEST = 1.5
"""Area of a box that all panels share over that which the largest needs, at most."""
_PIECE = 0.15
"""Radius of a piece of wall, m, of which a course is built."""
_APART = 0.3
"""Ends of legs that are nearer to each other are one place, m."""
_ENDED = (
    ({Outcome.COLLISION}, "x", "\N{MULTIPLICATION SIGN} touched something"),
    ({Outcome.TIMEOUT, Outcome.LIVELOCK, Outcome.ABORTED}, "s", "\N{WHITE SQUARE} out of time or given up"),
)
_FILLS = {BodyKind.WALL: theme.FIXTURE, BodyKind.FURNITURE: theme.FURNITURE} | dict.fromkeys(PLACED, theme.OBSTACLE)


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
        _set_up(ax, trial, theme.FIXTURE)
        lanes = [results.remains(r["trial"]) for r in chosen[:MOST_LANES] if r["obstacle_speed"] is not None]
        if not sizes:
            _bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])
        for size in reversed(sizes):
            row = next((r for r in chosen if r["gap"] == gap and r["size"] == size), None)
            if row is not None:
                nested = results.remains(row["trial"]).attempt.bodies
                _bodies(ax, [b for b in nested if b.kind in PLACED], alpha=0.25 + 0.75 / len(sizes))
        _lanes(ax, lanes or [trial])
        for leg in trial.attempt.legs[:1]:
            _robot_at(ax, trial, leg.start)
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
        _set_up(ax, trial, theme.FIXTURE)
        _bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])
        _tracks(ax, trial)
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
    _tracks(ax, trial)
    ax.set_title(title)
    return figure


def floor(ax: Axes, trial: Trial, box: tuple[float, float, float, float]) -> None:
    """What stands in a trial, within `box` (x0, y0, x1, y1) [m]."""
    _frame(ax, box)
    _set_up(ax, trial, theme.FIXTURE)
    _bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])


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
        _frame(ax, box)
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


def around(
    trials: Iterable[Trial], margin: float = 0.8, *, also: Iterable[FloatArray] = (), driven: bool = True
) -> tuple[float, float, float, float]:
    """Box around where robots, goals and obstacles of the test were, m, and `also` these places (n, 2); and of the moving obstacles' lanes,
    cut short; where nothing bounds the floor, who moves begins anywhere around, and half of the robot's way to either side is shown of it."""
    points, moving_obstacles, open_floor = [], [], True
    for trial in trials:
        points += [trial.pose[:, :2]] if driven else []
        points += [*(np.array([leg.start[:2], leg.goal[:2]]) for leg in trial.attempt.legs)]
        points += [np.atleast_2d(b.pose[:2]) for b in trial.attempt.bodies if b.pose is not None and _belongs(b)]
        moving_obstacles.append(trial.moving_obstacles[:, :, :2].reshape(-1, 2))
        open_floor &= not any(b.kind is BodyKind.WALL for b in trial.attempt.bodies)
    inner = np.vstack([np.empty((0, 2)), *also, *points])
    inner = inner[np.isfinite(inner).all(1)]
    if not len(inner):
        inner = np.zeros((1, 2))  # nothing was recorded, and nobody knows where the goals were
    low, high = inner.min(0), inner.max(0)
    lanes, beside = np.vstack(moving_obstacles), max(1.1, 0.5 * float((high - low).max()) if open_floor else 0.0)
    lanes = np.clip(lanes[np.isfinite(lanes).all(1)], low - beside, high + beside)
    every = np.vstack([inner, lanes])
    low, high = every.min(0) - margin, every.max(0) + margin
    more = np.maximum(SLIMMEST * (high - low).max() - (high - low), 0.0) / 2
    (x0, y0), (x1, y1) = (low - more).tolist(), (high + more).tolist()
    return x0, y0, x1, y1


def _belongs(body: Body) -> bool:
    """Whether a body that stands is of the test itself: an obstacle, or a piece of a course built of small ones (BARN's)."""
    small = body.kind is BodyKind.WALL and circumscribed_radius(body.shape) < _PIECE
    return body.kind in PLACED or small


def _frame(ax: Axes, box: tuple[float, float, float, float]) -> None:
    x0, y0, x1, y1 = box
    ax.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xticks=[], yticks=[])
    for side in ax.spines.values():
        side.set_visible(True)
    at = (x0 + 0.05 * (x1 - x0), y0 + 0.05 * (y1 - y0))
    ax.plot([at[0], at[0] + 1], [at[1], at[1]], color=theme.MUTED, linewidth=1.2, zorder=9)
    ax.text(
        at[0] + 0.5, at[1] + 0.03 * (y1 - y0), "1 m", color=theme.MUTED, fontsize=theme.SMALLEST, ha="center", zorder=9
    )


def _set_up(ax: Axes, trial: Trial, edge: str) -> None:
    """Walls and furniture, the lines between the ends of the legs, and the ends' names: A where the first begins, B where it ends, C the
    next place that is none of these."""
    _bodies(ax, [b for b in trial.attempt.bodies if b.kind not in PLACED], edge)
    footprint, legs = trial.attempt.footprint, trial.attempt.legs
    beyond = 0.2 + (circumscribed_radius(footprint) if footprint is not None else 0.15)
    letters, places, lines = iter(ascii_uppercase), dict[str, FloatArray](), set[frozenset[str]]()
    if legs and not known_positions(legs[0].start):
        next(letters)
    for leg in legs:
        ends = [end[:2] for end in (leg.start, leg.goal) if known_positions(end)]
        along = ends[1] - ends[0] if len(ends) > 1 else np.array([1.0, 0.0])
        beside = np.array([along[1], -along[0]]) / max(float(np.hypot(*along)), 1e-9)  # one may come along the line
        names = []
        for end in ends:
            name = next((n for n, place in places.items() if np.hypot(*(place - end)) < _APART), None)
            if name is None and (name := next(letters, None)) is not None:
                places[name] = end
                x, y = (end + beyond * beside).tolist()
                ax.plot(*end, marker="o", markersize=3.5, color=theme.MARK, zorder=6)
                ax.text(x, y, name, color=theme.MARK, weight="bold", ha="center", va="center", zorder=8)
            names += [] if name is None else [name]
        if len(line := frozenset(names)) > 1 and line not in lines:
            lines.add(line)
            ax.plot(*np.transpose(ends), color=theme.MARK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)


def _bodies(ax: Axes, bodies: Iterable[Body], edge: str = theme.OBSTACLE, alpha: float = 1.0) -> None:
    from matplotlib.collections import PolyCollection

    groups: dict[BodyKind, list[FloatArray]] = {}
    for body in bodies:
        if body.pose is None or not known_positions(body.pose):
            continue
        if not has_outline(body, body.pose):
            _cross(ax, body.pose, edge)
        else:
            groups.setdefault(body.kind, []).append(theme.outline(body.shape, upright(body.pose)))
    x, y = ax.get_xlim(), ax.get_ylim()
    for kind, outlines in groups.items():
        shown = [
            o
            for o in outlines
            if o[:, 0].max() > x[0] and o[:, 0].min() < x[1] and o[:, 1].max() > y[0] and o[:, 1].min() < y[1]
        ]
        ax.add_collection(
            PolyCollection(shown, facecolors=_FILLS.get(kind, theme.FURNITURE), edgecolors=edge, linewidths=0.5, alpha=alpha, zorder=3),
            autolim=False,
        )  # fmt: skip
        if kind in PLACED:
            small = np.array([o.mean(0) for o in shown if np.ptp(o, axis=0).max() < 0.1]).reshape(-1, 2)
            ax.plot(*small.T, linestyle="", marker="s", markersize=2.2, color=edge, zorder=7)  # S1 would be lost


def _shown(trial: Trial) -> float:
    """How far the moving obstacle came on the first leg, m: the trial with most shows its lane best."""
    track = trial.moving_obstacles[np.asarray(trial.leg) == 0][:, :, :2].reshape(-1, 2)
    known = track[np.isfinite(track).all(1)]
    return float(np.ptp(known, axis=0).sum()) if len(known) else 0.0


def _lanes(ax: Axes, trials: Sequence[Trial]) -> None:
    """Each moving obstacle's way on the first leg on which it is there as an arrow, with its shape where the arrow begins.

    A trial that ended early shows a part of the way, so the farthest ends over all `trials` count.
    """
    for m, body in enumerate(b for b in trials[0].attempt.bodies if b.pose is None):
        tracks = [track for trial in trials if len(track := _first_way(trial, m)) > 1]
        if not tracks:
            continue
        longest = max(tracks, key=lambda t: float(np.hypot(*(t[-1, :2] - t[0, :2]))))
        start, way = longest[0, :2], longest[-1, :2] - longest[0, :2]
        along = way / max(float(np.hypot(*way)), 1e-9)
        aside = (longest[:, :2] - start) @ np.array([-along[1], along[0]])
        if np.abs(aside).max() > 0.05:  # not straight: as far as this one trial shows it
            ax.plot(*longest[:, :2].T, color=theme.MOVING, linewidth=1.2, zorder=5)
            _moving_obstacle_at(ax, body, _first_within(ax, body, longest))
            continue
        ends = np.concatenate([(t[[0, -1], :2] - start) @ along for t in tracks])
        x, y = ax.get_xlim(), ax.get_ylim()
        points = start + np.linspace(ends.min(), ends.max(), 400)[:, None] * along
        inside = points[(points[:, 0] > x[0]) & (points[:, 0] < x[1]) & (points[:, 1] > y[0]) & (points[:, 1] < y[1])]
        if len(inside) < 2:
            continue
        style = {"arrowstyle": "-|>", "color": theme.MOVING, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", xy=tuple(inside[-1]), xytext=tuple(inside[0]), arrowprops=style, zorder=5)
        _moving_obstacle_at(ax, body, np.array([*inside[len(inside) // 10], longest[0, 2]]), edge=theme.MOVING)


def _first_within(ax: Axes, body: Body, track: FloatArray) -> FloatArray:
    """The first pose of a track (n, 3) at which the body is within the panel, or its first."""
    reach = circumscribed_radius(body.shape)
    low, high = (np.array(ends) for ends in zip(ax.get_xlim(), ax.get_ylim(), strict=True))
    within = ((track[:, :2] > low + reach) & (track[:, :2] < high - reach)).all(1)
    pose: FloatArray = track[int(np.argmax(within))]
    return pose


def _moving_obstacle_at(ax: Axes, body: Body, pose: FloatArray, edge: str | None = None) -> None:
    """A moving obstacle's shape at a pose, or a cross where nobody knows its outline."""
    if not has_outline(body, pose):
        _cross(ax, pose, theme.MOVING)
        return
    more: dict[str, Any] = {} if edge is None else {"edgecolor": edge}
    ax.fill(*theme.outline(body.shape, upright(pose)).T, facecolor=theme.MOVING, alpha=0.55, zorder=5, **more)


def _cross(ax: Axes, pose: FloatArray, colour: str) -> None:
    ax.plot(*pose[:2], linestyle="", marker="x", markersize=5, markeredgewidth=1.2, color=colour, zorder=7)


def known_positions(poses: FloatArray) -> npt.NDArray[np.bool_]:
    """Of which of the poses (..., 3) the position is known."""
    return np.asarray(np.isfinite(poses[..., :2]).all(axis=-1))


def has_outline(body: Body, pose: FloatArray) -> bool:
    """Whether it is known how the body lies at a pose (3,) whose position is known."""
    return body.outlined and (isinstance(body.shape, Circle) or bool(np.isfinite(pose[2])))


def upright(pose: FloatArray) -> FloatArray:
    """The pose (3,) with heading 0 where it is unknown: only for a disc, to which it makes no difference."""
    return pose if np.isfinite(pose[2]) else np.array([pose[0], pose[1], 0.0])


def _first_way(trial: Trial, m: int) -> FloatArray:
    """Where moving obstacle `m` was on the first leg on which it was there, poses (k, 3); none if this trial has fewer moving_obstacles."""
    if m >= trial.moving_obstacles.shape[1]:
        return np.empty((0, 3))
    track, leg = trial.moving_obstacles[:, m], np.asarray(trial.leg)
    there = known_positions(track)
    way: FloatArray = track[there & (leg == leg[there].min(initial=len(trial.attempt.legs)))]
    return way


def _robot_at(ax: Axes, trial: Trial, pose: FloatArray) -> None:
    if not known_positions(pose):
        return
    robot = robot_of(trial)
    if robot is not None and has_outline(robot, pose):
        points = theme.outline(robot.shape, upright(pose)).T
        ax.fill(*points, facecolor=theme.ROBOT, alpha=0.35, zorder=4)
        ax.plot(*points, color=theme.ROBOT, linewidth=1.0, zorder=5)
    if not np.isfinite(pose[2]):
        return
    ahead = pose[:2] + 0.45 * np.array([np.cos(pose[2]), np.sin(pose[2])])
    ax.annotate(
        "", xy=tuple(ahead), xytext=tuple(pose[:2]), arrowprops={"arrowstyle": "-|>", "color": theme.ROBOT}, zorder=6
    )


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


def _tracks(ax: Axes, trial: Trial) -> None:
    from clearway.reports.replay_encoding import broken

    trial = broken(trial)
    for m, body in enumerate(b for b in trial.attempt.bodies if b.pose is None):
        for leg in range(len(trial.attempt.legs)):
            track = trial.moving_obstacles[(np.asarray(trial.leg) == leg), m]
            ax.plot(track[:, 0], track[:, 1], color=theme.MOVING, linewidth=1.3, zorder=4)
            _prints(ax, body, track, theme.MOVING, 3 * FOOTPRINT_EVERY)
    ax.plot(trial.pose[:, 0], trial.pose[:, 1], color=theme.ROBOT, linewidth=1.4, zorder=6)
    if (robot := robot_of(trial)) is not None:
        _prints(ax, robot, trial.pose, theme.ROBOT, FOOTPRINT_EVERY)


def robot_of(trial: Trial) -> Body | None:
    """The robot as a body; None if nobody knows its footprint."""
    footprint = trial.attempt.footprint
    return None if footprint is None else Body("robot", BodyKind.MOVING_OBSTACLE, footprint, None)


def _prints(ax: Axes, body: Body, track: FloatArray, colour: str, every: float) -> None:
    """The body's outline wherever it had moved `every` metres."""
    known = track[known_positions(track)]
    if not len(known):
        return
    if not body.outlined:
        _cross(ax, known[0], colour)
        return
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(known[:, :2], axis=0).T))))
    at = np.unique(np.searchsorted(way, np.arange(0.0, way[-1] + every, every)).clip(0, len(known) - 1))
    for pose in (p for p in known[at] if has_outline(body, p)):
        ax.plot(*theme.outline(body.shape, upright(pose)).T, color=colour, linewidth=0.5, alpha=0.55, zorder=5)


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

"""A floor drawn: what stands and moves in a trial, where the robot was to go, and how it went."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clearway.contract import PLACED, BodyKind
from clearway.geometry.shapes import Circle, FloatArray, circumscribed_radius
from clearway.reports import theme
from clearway.trials import Body, Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SLIMMEST = 0.42
"""Short side of a panel over its long one, at least."""
FOOTPRINT_EVERY = 0.6
"""m of path between two footprints drawn."""
_PIECE = 0.15
"""Radius of a piece of wall, m, of which a course is built."""
_APART = 0.3
"""Ends of legs that are nearer to each other are one place, m."""
_FILLS = {BodyKind.WALL: theme.FIXTURE, BodyKind.FURNITURE: theme.FURNITURE} | dict.fromkeys(PLACED, theme.OBSTACLE)


def floor(ax: Axes, trial: Trial, box: tuple[float, float, float, float]) -> None:
    """What stands in a trial, within `box` (x0, y0, x1, y1) [m]."""
    frame(ax, box)
    draw_set_up(ax, trial, theme.FIXTURE)
    draw_bodies(ax, [b for b in trial.attempt.bodies if b.kind in PLACED])


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


def frame(ax: Axes, box: tuple[float, float, float, float]) -> None:
    x0, y0, x1, y1 = box
    ax.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xticks=[], yticks=[])
    for side in ax.spines.values():
        side.set_visible(True)
    at = (x0 + 0.05 * (x1 - x0), y0 + 0.05 * (y1 - y0))
    ax.plot([at[0], at[0] + 1], [at[1], at[1]], color=theme.MUTED, linewidth=1.2, zorder=9)
    ax.text(
        at[0] + 0.5, at[1] + 0.03 * (y1 - y0), "1 m", color=theme.MUTED, fontsize=theme.SMALLEST, ha="center", zorder=9
    )


def draw_set_up(ax: Axes, trial: Trial, edge: str) -> None:
    """Walls and furniture, the lines between the ends of the legs, and the ends' names: A where the first begins, B where it ends, C the
    next place that is none of these."""
    draw_bodies(ax, [b for b in trial.attempt.bodies if b.kind not in PLACED], edge)
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


def draw_bodies(ax: Axes, bodies: Iterable[Body], edge: str = theme.OBSTACLE, alpha: float = 1.0) -> None:
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


def draw_lanes(ax: Axes, trials: Sequence[Trial]) -> None:
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


def _first_way(trial: Trial, m: int) -> FloatArray:
    """Where moving obstacle `m` was on the first leg on which it was there, poses (k, 3); none if this trial has fewer moving_obstacles."""
    if m >= trial.moving_obstacles.shape[1]:
        return np.empty((0, 3))
    track, leg = trial.moving_obstacles[:, m], np.asarray(trial.leg)
    there = known_positions(track)
    way: FloatArray = track[there & (leg == leg[there].min(initial=len(trial.attempt.legs)))]
    return way


def _moving_obstacle_at(ax: Axes, body: Body, pose: FloatArray, edge: str | None = None) -> None:
    """A moving obstacle's shape at a pose, or a cross where nobody knows its outline."""
    if not has_outline(body, pose):
        _cross(ax, pose, theme.MOVING)
        return
    more: dict[str, Any] = {} if edge is None else {"edgecolor": edge}
    ax.fill(*theme.outline(body.shape, upright(pose)).T, facecolor=theme.MOVING, alpha=0.55, zorder=5, **more)


def _cross(ax: Axes, pose: FloatArray, colour: str) -> None:
    ax.plot(*pose[:2], linestyle="", marker="x", markersize=5, markeredgewidth=1.2, color=colour, zorder=7)


def draw_robot(ax: Axes, trial: Trial, pose: FloatArray) -> None:
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


def draw_tracks(ax: Axes, trial: Trial) -> None:
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


def robot_of(trial: Trial) -> Body | None:
    """The robot as a body; None if nobody knows its footprint."""
    footprint = trial.attempt.footprint
    return None if footprint is None else Body("robot", BodyKind.MOVING_OBSTACLE, footprint, None)


def known_positions(poses: FloatArray) -> npt.NDArray[np.bool_]:
    """Of which of the poses (..., 3) the position is known."""
    return np.asarray(np.isfinite(poses[..., :2]).all(axis=-1))


def has_outline(body: Body, pose: FloatArray) -> bool:
    """Whether it is known how the body lies at a pose (3,) whose position is known."""
    return body.outlined and (isinstance(body.shape, Circle) or bool(np.isfinite(pose[2])))


def upright(pose: FloatArray) -> FloatArray:
    """The pose (3,) with heading 0 where it is unknown: only for a disc, to which it makes no difference."""
    return pose if np.isfinite(pose[2]) else np.array([pose[0], pose[1], 0.0])

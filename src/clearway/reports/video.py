"""A trial as a video, or two of the same test side by side on one clock."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.contract import BodyKind
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reports import theme
from clearway.reports.findings import Findings
from clearway.reports.floor_drawing import around, floor, known_positions, robot_of, upright
from clearway.reports.replay_encoding import unwrapped
from clearway.reports.selection import label, verdict
from clearway.trials import Body, Trial
from clearway.trials.store import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAMES_A_SECOND = 15
MOST_FRAMES = 1500
"""Of a video; a longer trial is played faster."""
ENDINGS = (".gif", ".mp4", ".webm")


def check_video(file: Path) -> None:
    """See that a video can be written to `file`.

    Raises:
        ClearwayError: its ending is none that is known, or takes a program that isn't there.
    """
    from matplotlib.animation import FFMpegWriter

    ending = file.suffix.lower()
    if ending not in ENDINGS:
        raise ClearwayError(f"{file.suffix or 'no ending'!r} is no video; {', '.join(ENDINGS)} are", file=file)
    if ending != ".gif" and not FFMpegWriter.isAvailable():
        raise ClearwayError(f"{ending} takes the program ffmpeg, which is not installed; .gif takes nothing", file=file)


def write_video(
    results: Results,
    trials: Sequence[int],
    file: Path,
    speed: float = 4.0,
    tell: Callable[[int, int], None] | None = None,
) -> Path:
    """Write trials side by side as a video.

    Args:
        results: Where they are.
        trials: Their numbers, one or two.
        file: Where to; its ending says which kind.
        speed: How many times faster than it was.
        tell: Told how many frames of how many are drawn.

    Raises:
        ClearwayError: there is no such trial, or the file can't be written.
    """
    from matplotlib.animation import FFMpegWriter, PillowWriter

    check_video(file)
    rows = {row["trial"]: row for row in Findings(results).rows}
    for number in trials:
        if number not in rows:
            raise ClearwayError(f"there is no trial {number}; it holds 0 to {len(results) - 1}", file=results.path)
    shown = [results.trial(number) for number in trials]
    end = max(float(trial.t[-1]) for trial in shown)
    frames = min(MOST_FRAMES, max(1, math.ceil(end / speed * FRAMES_A_SECOND)) + 1)
    figure = theme.new_figure(6.4 * len(shown), 5.2)
    panels = []
    for k, (number, trial) in enumerate(zip(trials, shown, strict=True)):
        ax = figure.add_subplot(1, len(shown), k + 1)
        floor(ax, trial, around(shown))
        row = rows[number]
        ax.set_title(f"{row['navigator']}: {verdict(row)}\n{label(row)}", fontsize=9)
        panels.append(_Panel(ax, trial))
    made = PillowWriter(fps=FRAMES_A_SECOND) if file.suffix.lower() == ".gif" else FFMpegWriter(fps=FRAMES_A_SECOND)
    new = file.with_name(f".{os.getpid()}-{file.name}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with made.saving(figure, str(new), dpi=90):
            for k in range(frames):
                t = end * k / max(frames - 1, 1)
                for panel in panels:
                    panel.at(t)
                made.grab_frame()
                if tell is not None:
                    tell(k + 1, frames)
        os.replace(new, file)
    except OSError as error:
        raise ClearwayError(f"cannot be written: {error.strerror or error}", file=file) from error
    finally:
        new.unlink(missing_ok=True)
        _close(figure)
    return file


def _close(figure: Figure) -> None:
    import matplotlib.pyplot as plt

    plt.close(figure)


class _Panel:
    """One trial's floor, with what moves on it."""

    def __init__(self, ax: Axes, trial: Trial) -> None:
        self._ax, self._trial, self._turned = ax, trial, _columns(trial.pose)
        self._others = [_columns(trial.moving_obstacles[:, m]) for m in range(trial.moving_obstacles.shape[1])]
        self._moving = [body for body in trial.attempt.bodies if body.pose is None]
        (self._path,) = ax.plot([], [], color=theme.ROBOT, linewidth=1.4, zorder=6)
        self._clock = ax.text(0.98, 0.03, "", transform=ax.transAxes, ha="right", color=theme.MUTED, zorder=9)
        self._drawn: list[Any] = []

    def at(self, t: float) -> None:
        """Draw the instant `t` [s]; beyond the trial's end its last one."""
        for artist in self._drawn:
            artist.remove()
        trial, ax = self._trial, self._ax
        t = min(t, float(trial.t[-1]))
        k = int(np.searchsorted(trial.t, t, side="right"))
        self._path.set_data(trial.pose[:k, 0], trial.pose[:k, 1])
        self._drawn = []
        for snapshot in [s for s in trial.snapshots if s.t <= t + 1e-6][-1:]:
            for points in snapshot.diagnostics.polylines.values():
                self._drawn += ax.plot(*np.asarray(points).T, color=theme.MARK, linewidth=1.0, alpha=0.8, zorder=5)
        for body, poses in zip(self._moving, self._others, strict=True):
            self._body(body, _between(trial.t, poses, t), theme.MOVING)
        if (robot := robot_of(trial)) is not None:
            self._body(robot, _between(trial.t, self._turned, t), theme.ROBOT)
        self._clock.set_text(f"{t:.1f} s")

    def _body(self, body: Body, pose: FloatArray, colour: str) -> None:
        if not known_positions(pose) or not body.outlined:
            return
        points = theme.outline(body.shape, upright(pose)).T
        self._drawn += self._ax.fill(*points, facecolor=colour, edgecolor=colour, alpha=0.55, zorder=7)
        if np.isfinite(pose[2]) and body.kind in (BodyKind.PERSON, BodyKind.ROBOT, BodyKind.MOVING_OBSTACLE):
            ahead = pose[:2] + 0.25 * np.array([np.cos(pose[2]), np.sin(pose[2])])
            self._drawn += self._ax.plot(
                [pose[0], ahead[0]], [pose[1], ahead[1]], color=colour, linewidth=1.4, zorder=8
            )


def _columns(poses: FloatArray) -> tuple[FloatArray, ...]:
    """x, y and the heading without jumps of a turn, of poses (n, 3)."""
    return (*poses[:, :2].T, unwrapped(poses[:, 2]))


def _between(t: FloatArray, columns: tuple[FloatArray, ...], at: float) -> FloatArray:
    """The pose (3,) at time `at` [s], of the columns of poses at the times `t` (n,)."""
    return np.array([np.interp(at, t, column) for column in columns])

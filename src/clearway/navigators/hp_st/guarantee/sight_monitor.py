"""Which assumptions about perception did not hold at a look, in words: what appears where it must have been seen before.

Whatever can explain an appearance does: it may have come in across the edge of sight at the assumed speed, a track that
is out of view may be it, and what touches something that a lidar showed before is more of the same surface. So a text
is never a false alarm. That something was hidden explains nothing: the theorem assumes that nothing is.
"""

from __future__ import annotations

import math
from itertools import repeat

import numpy as np
import numpy.typing as npt

from clearway.contract import Obstacles
from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.sight import Sight, depth

ROUNDING = 1e-9
"""A bound counts as exceeded from here on, m, s."""

_MANY = 2000
"""Beyond so many, those that are remembered for too long are forgotten."""


class SightMonitor:
    """Compares what is perceived with what was perceived at the look before.

    Args:
        sight: What is seen.
        unseen_speed: Bound on the speed of what comes from outside of it, in m/s.
        start: (3,) bounds on the error of the perceived pose, see `tube.tube`.
        memory: How long what is out of view is remembered, in seconds.
        surfaces: Whether what stands is perceived in pieces, as a lidar does, rather than one disc an obstacle.
    """

    def __init__(
        self, sight: Sight, unseen_speed: float, start: FloatArray, memory: float, surfaces: bool
    ) -> None:  # fmt: skip
        self._sight, self._speed, self._start = sight, unseen_speed, start
        self._memory, self._surfaces = memory, surfaces
        self.reset()

    def reset(self) -> None:
        """Begin a new trial: nothing has been seen yet."""
        self._t = math.nan
        self._pose = np.zeros(3)
        self._known: dict[int, tuple[float, bool]] = {}  # identity: when it was perceived last, and whether as moving
        self._discs, self._moving = np.zeros((0, 3)), np.zeros(0, dtype=np.bool_)

    def seen(self, t: float, pose: FloatArray, obstacles: Obstacles, forecast: Forecast) -> tuple[str, ...]:
        """What the look at time `t` [s] from `pose` (3,) shows to be untrue, one text each; nothing at the first look.

        Args:
            t: Time in seconds.
            pose: (3,) as perceived, in the frame of the obstacles.
            obstacles: What is perceived.
            forecast: Of these at `t`; what it holds beside them is out of view.
        """
        discs = np.column_stack((obstacles.position, obstacles.radius + obstacles.error))
        moving, names, error = obstacles.moving, obstacles.identity, obstacles.error
        if not np.isfinite(discs).all():
            good = np.isfinite(discs).all(axis=1)
            discs, moving, names, error = discs[good], moving[good], names[good], error[good]
        if not t >= self._t:
            self.reset()
        known, most = self._known, self._memory + ROUNDING
        who, move = names.tolist(), moving.tolist()
        texts, pieces = [], []
        for j, (name, moves) in enumerate(zip(who, move, strict=True) if t > self._t else ()):
            before = known.get(name)
            if before is not None and t - before[0] > most:
                before = None
            if before is not None and (before[1] or not moves):
                continue
            standing, within = self._appeared(t - self._t, discs[j], float(error[j]), moves, forecast)
            if moves and (standing or before is not None):
                texts.append(f"obstacle {name}: moves, but was perceived as standing")
            elif not within > ROUNDING:
                continue
            elif moves:
                deeper = f"{within:.2f} m deeper than it can have come since the last look"
                texts.append(f"obstacle {name}: appeared within sight, {deeper}")
            elif self._surfaces:
                pieces.append(within)
            else:
                texts.append(f"obstacle {name}: stands {within:.2f} m within sight and was not perceived before")
        if pieces:
            texts.append(f"surface: stands {max(pieces):.2f} m within sight and was not perceived before")
        known.update(zip(who, zip(repeat(t), move, strict=False), strict=True))
        if len(known) > _MANY:
            self._known = {n: k for n, k in known.items() if t - k[0] <= most}
        self._t, self._pose, self._discs, self._moving = t, np.array(pose, dtype=np.float64), discs, moving
        return tuple(texts)

    def _appeared(
        self, dt: float, disc: FloatArray, error: float, moving: bool, forecast: Forecast
    ) -> tuple[bool, float]:
        """Whether `disc` (3,) was perceived as standing at the last look, `dt` [s] ago, and how far [m] it lies within
        what was seen then; not above 0: that is explained."""
        x, y, size = disc.tolist()
        away = math.hypot(x - self._pose[0], y - self._pose[1])
        misread = math.hypot(self._start[0], self._start[1]) + float(self._start[2]) * away
        doubt = 2.0 * misread  # the pose now, by which a lidar places what it sees, and the pose then
        if self._surfaces:
            touching, standing = _touches(self._discs, self._moving, x, y, size, doubt)
            if touching:
                return standing, 0.0
        if moving:
            unseen = forecast.age > 0.0
            off = np.hypot(forecast.centre[unseen, 0, 0] - x, forecast.centre[unseen, 0, 1] - y)
            if (off <= forecast.reach[unseen, 0] + error).any():
                return False, 0.0
        came = self._speed * dt if moving else 0.0
        return False, depth(self._sight, self._pose, x, y) + size - 2.0 * error - doubt - came


@light
def _touches(
    discs: FloatArray, moving: npt.NDArray[np.bool_], x: float, y: float, size: float, doubt: float
) -> tuple[bool, bool]:  # fmt: skip
    """Whether a disc of radius `size` [m] at (x, y) comes within `doubt` [m] of any of `discs` (n, 3), and of one that isn't `moving`."""
    any_touches = False
    for k in range(len(discs)):
        if math.hypot(discs[k, 0] - x, discs[k, 1] - y) <= discs[k, 2] + size + doubt:
            if not moving[k]:
                return True, True
            any_touches = True
    return any_touches, False

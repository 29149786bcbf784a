"""The clairvoyant's way: the shortest time to a goal among discs whose whole future is known.

A holonomic point (the caller inflates the obstacles by the robot's radius) that moves at up to `v_max`, in any
direction, and may wait.
"""

from __future__ import annotations

from typing import NamedTuple

from clearway.geometry.shapes import FloatArray


class SpaceTimePath(NamedTuple):
    """A way through space and time.

    Attributes:
        time: when it arrives, less when it starts, s. length: of the way, m. error: bound on the relative error of
        `time`: no way is faster than (1 - error) time (see `shortest`). points: (k, 3) t [s], x, y [m]; straight at
        constant speed between two of them; the first is the start, the last is within the goal's radius.
    """

    time: float
    length: float
    error: float
    points: FloatArray


def shortest(
    start: FloatArray,
    goal: FloatArray,
    *,
    goal_radius: float,
    v_max: float,
    static: FloatArray,
    moving: FloatArray,
    radii: FloatArray,
    dt: float,
    area: tuple[float, float, float, float] | None = None,
    horizon: float = 60.0,
    start_time: float = 0.0,
    bound: bool = True,
) -> SpaceTimePath | None:
    """The fastest way from `start` to within `goal_radius` of `goal`.

    Args:
        start, goal: (2,) m. goal_radius: m. v_max: m/s.
        static: (n, 3) x, y, R [m] of discs that stand, already inflated.
        moving: (T, m, 2) centres [m] of discs at the times 0, dt, 2 dt, ... s; straight at constant speed between;
        NaN: absent (then also in the interval before and after). After the last sample nothing is known: no way goes on
        beyond it unless m = 0. radii: (m,) m, already inflated. dt: s.
        area: x_min, y_min, x_max, y_max [m] of where the point may be; None: anywhere.
        horizon: latest arrival, s after `start_time`. start_time: when it starts, on the clock of `moving`, s.
        bound: False skips the bound on the error (`error` is then NaN): for a navigator that only wants the way.

    Returns:
        The way; None if there is none within the horizon (or the start is inside a disc).

    Raises:
        ValueError: an array of the wrong shape, a number that isn't finite, or a speed, radius or dt that isn't positive.
    """
    raise NotImplementedError

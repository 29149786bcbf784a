"""What is expected of the obstacles, and what is certain: the arrays that planners and certificates read."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.shapes import FloatArray


class Forecast(NamedTuple):
    """The obstacles at the instants t, t + step, ..., t + K step; map frame, m, s. All arrays C-contiguous.

    Attributes:
        step: Time between two instants, s.
        still: (s, 3) x, y, R of those perceived as standing; R is the radius and the bound of the position's error.
        path: (n, H, K + 1, 2) centres of those that move (or can), by up to H hypotheses.
        sigma: (n, H, K + 1) standard deviation along either axis of the centre's error under each hypothesis.
        weight: (n, H) probability of each hypothesis, in descending order; 0: not used. Sums to 1.
        radius: (n,) of those that move, m.
        centre: (n, K + 1, 2) m, centre of the disc in which the obstacle's centre is for sure at each instant, as long
            as the assumed bounds of speed, acceleration and error of perception hold.
        reach: (n, K + 1) m, radius of that disc.
        speed: (n,) m/s, bound that the obstacle's speed keeps over the whole window, for what happens between instants.
        identity: (n,) int64, the same over time for the same obstacle.
        age: (n,) s since it was last perceived.
    """

    step: float
    still: FloatArray
    path: FloatArray
    sigma: FloatArray
    weight: FloatArray
    radius: FloatArray
    centre: FloatArray
    reach: FloatArray
    speed: FloatArray
    identity: npt.NDArray[np.int64]
    age: FloatArray

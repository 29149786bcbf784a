"""What is expected of the obstacles, and what is certain: the arrays that planners and certificates read."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
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


def later(forecast: Forecast, time: float, acceleration: float) -> Forecast:
    """The forecast from `time` [s] on: at the instants time, time + step, ... of it, as far as they go.

    Between two instants places, errors and discs lie on lines; a disc grows by what an obstacle may leave its chord by.

    Args:
        forecast: From now on; returned as it is where `time` is 0.
        time: Not below 0, s.
        acceleration: Bound on that of the obstacles, m/s^2; inf: the bound of their speed alone counts.
    """
    if time <= 0.0:
        return forecast
    step = forecast.step
    whole = math.floor(time / step + 1e-9)
    share = max(time / step - whole, 0.0)
    path, sigma, centre, reach = forecast.path, forecast.sigma, forecast.centre, forecast.reach
    if share <= 1e-9:
        found = path[:, :, whole:], sigma[:, :, whole:], centre[:, whole:], reach[:, whole:]
    else:
        bow = 2.0 * forecast.speed * step * share * (1.0 - share)
        if math.isfinite(acceleration):
            bow = np.minimum(bow, 0.5 * acceleration * step * step * share * (1.0 - share))
        found = _between(path, sigma, centre, reach, bow, whole, share)
    path, sigma, centre, reach = map(np.ascontiguousarray, found)
    return forecast._replace(path=path, sigma=sigma, centre=centre, reach=reach)


@kernel
def _between(
    path: FloatArray, sigma: FloatArray, centre: FloatArray, reach: FloatArray, bow: FloatArray, whole: int, share: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """The arrays of a forecast of that name a `share` of a step after each instant but the last, from number `whole` on; `bow` (n,) is
    added to `reach`."""
    n, most, count = sigma.shape[0], sigma.shape[1], reach.shape[1] - whole - 1
    paths, sigmas = np.empty((n, most, count, 2)), np.empty((n, most, count))
    centres, reaches = np.empty((n, count, 2)), np.empty((n, count))
    for i in range(n):
        for k in range(count):
            a, b = whole + k, whole + k + 1
            for c in range(2):
                centres[i, k, c] = (1.0 - share) * centre[i, a, c] + share * centre[i, b, c]
                for h in range(most):
                    paths[i, h, k, c] = (1.0 - share) * path[i, h, a, c] + share * path[i, h, b, c]
            for h in range(most):
                sigmas[i, h, k] = (1.0 - share) * sigma[i, h, a] + share * sigma[i, h, b]
            reaches[i, k] = (1.0 - share) * reach[i, a] + share * reach[i, b] + bow[i]
    return paths, sigmas, centres, reaches

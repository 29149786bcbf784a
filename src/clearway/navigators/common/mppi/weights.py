"""What the costs make of the samples: their weights, and the weighted mean of their controls.

G. Williams, P. Drews, B. Goldfain, J. M. Rehg, E. A. Theodorou, "Information-theoretic model predictive control: theory and
applications to autonomous driving", IEEE Transactions on Robotics 34(6), 2018: the weights are its information-theoretic
importance weights, the least cost taken off all for the sake of rounding.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ONE, ZERO, Floats

_LANES = 16


@kernel
def softmax(costs: Floats, temperature: np.float32) -> Floats:
    """(B,) weights that sum to one."""
    batch = costs.shape[0]
    least = costs[0]
    for b in range(1, batch):
        least = min(least, costs[b])
    weights, sharpness, total = np.empty(batch, np.float32), ONE / temperature, 0.0
    for b in range(batch):
        weights[b] = np.float32(math.exp(-sharpness * (costs[b] - least)))
        total += weights[b]
    scale = np.float32(1.0 / total)
    for b in range(batch):
        weights[b] *= scale
    return weights


@kernel
def weighted_mean(mean: Floats, controls: Floats, weights: Floats) -> None:
    """The weighted mean of each row, in several sums side by side."""
    steps, batch = controls.shape
    sums = np.empty(_LANES, np.float32)
    blocks = batch // _LANES
    for t in range(steps):
        row = controls[t]
        for lane in range(_LANES):
            sums[lane] = ZERO
        for k in range(blocks):
            begin = k * _LANES
            for lane in range(_LANES):
                sums[lane] += row[begin + lane] * weights[begin + lane]
        for b in range(blocks * _LANES, batch):
            sums[0] += row[b] * weights[b]
        total = ZERO
        for lane in range(_LANES):
            total += sums[lane]
        mean[t] = total

"""The tube: by how much the constraints are tightened, (4) and (5), and what the closed loop really needs.

(4) is a scalar tube: s+ = (1 - xi) s + w_bar bounds the distance of the robot from its nominal motion. Whether it does
depends on the ancillary gain; `deviation` tells what the linearised closed loop needs at worst, `damping` the largest
xi with which (4) covers that.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.ancillary import gain, linearise

DIRECTIONS = 32
"""In which the worst case is looked for; a maximum between two of them is missed by less than 0.5 %."""


@kernel
def tightening(bound: float, xi: float, steps: int, start: float) -> FloatArray:
    """(4) or (5): w_k for k = 0 .. `steps` [m], with w_0 = `start`: the error that is known to be there already.

    Args:
        bound: w-bar, m a period. xi: damping in [0, 1]. steps: N^P. start: m; 0 in the paper.
    """
    w = np.empty(steps + 1)
    w[0] = start
    for k in range(steps):
        w[k + 1] = (1.0 - xi) * w[k] + bound
    return w


@kernel
def deviation(
    poses: FloatArray, inputs: FloatArray, c: float, poles: FloatArray, most: float, position: float, heading: float
) -> FloatArray:
    """The largest distance [m] from a nominal motion that bounded disturbances can cause, by the linearised closed loop.

    Args:
        poses: (n + 1, 3) nominal. inputs: (n, 2) nominal v, omega. c: period, s. poles, most: of `ancillary.gain`.
        position: bound on the displacement a period (a disc), m. heading: bound on the turn a period, rad.

    Returns:
        (n + 1,) at each step, over all sequences of disturbances; the errors at the start are zero.
    """
    n = len(inputs)
    loops = np.empty((n, 3, 3))
    for k in range(n):
        a_k, b_k = linearise(poses[k, 2], inputs[k, 0], inputs[k, 1], c, False)
        loops[k] = a_k + b_k @ gain(poses[k, 2], inputs[k, 0], inputs[k, 1], c, False, poles, most)
    worst = np.zeros(n + 1)
    row = np.empty(3)
    for k in range(1, n + 1):
        for i in range(DIRECTIONS):
            angle = math.pi * i / DIRECTIONS
            row[0], row[1], row[2] = math.cos(angle), math.sin(angle), 0.0
            total = 0.0
            for j in range(k - 1, -1, -1):  # the disturbance of period j passes through the loops j + 1 .. k - 1
                total += position * math.hypot(row[0], row[1]) + heading * abs(row[2])
                row = row @ loops[j]
            worst[k] = max(worst[k], total)
    return worst


@kernel
def damping(worst: FloatArray, bound: float) -> float:
    """The largest xi in [0, 1] with which (4) covers `worst` (n + 1,) at every step; NaN where even xi = 0 does not."""
    low, high = 0.0, 1.0
    if not _covers(worst, bound, low):
        return math.nan
    for _ in range(50):
        middle = 0.5 * (low + high)
        if _covers(worst, bound, middle):
            low = middle
        else:
            high = middle
    return low


@kernel
def _covers(worst: FloatArray, bound: float, xi: float) -> bool:
    short = worst > tightening(bound, xi, len(worst) - 1, 0.0) + 1e-12
    return not short.any()

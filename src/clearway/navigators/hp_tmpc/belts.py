"""Moving obstacles in the heuristic planner: the dynamic steps 1 to 5 of paper B, and the reference that comes of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

ITERATIONS = 10
"""Most rounds of steps 1 to 4."""


class Reference(NamedTuple):
    """What the tracking system follows.

    Attributes:
        status: sum of the flags in `planner`; 0: all is well.
        points: (count + 1, 3) x_ref, y_ref [m], theta_ref [rad] at steps 0 (the robot's pose itself) to `count`,
            equidistant in time; they stand still at the path's end.
        inputs: (count, 2) v_ref [m/s], omega_ref [rad/s] that lead from point k to k + 1.
        path: (k, 2) polyline of the whole path [m]. other: (k2, 2) that of the rejected side, empty if none.
        belts: (m, 3) the predicted discs that were united into belts: x, y, inflated radius [m].
        length: m, exact length of the path. target: (2,) where the path was asked to end (the goal, or the temporary
            target). rounds: iterations of steps 1 to 4.
    """

    status: int
    points: FloatArray
    inputs: FloatArray
    path: FloatArray
    other: FloatArray
    belts: FloatArray
    length: float
    target: FloatArray
    rounds: int


@kernel
def predict(
    position: FloatArray, velocity: FloatArray, radius: FloatArray, margin: FloatArray, period: float
) -> FloatArray:
    """(m, N + 1, 3) x, y, radius [m] of m obstacles at constant velocity, k = 0..N periods [s] from now.

    Args:
        position, velocity: (m, 2) m, m/s. radius: (m,) inflated, rho_rob + rho_obs + margin, m.
        margin: (m, N + 1) what uncertainty adds at step k, m: w_k^dyn (eq. 5) + w_k^rob (eq. 4).
    """
    return np.zeros((len(position), margin.shape[1], 3))


@kernel
def plan_reference(
    pose: FloatArray,
    goal: FloatArray,
    static: FloatArray,
    predicted: FloatArray,
    area: FloatArray,
    perception: float,
    speed: float,
    period: float,
    count: int,
    draw: float,
    exact: bool,
) -> Reference:
    """The reference towards `goal` that avoids static discs, and moving ones over their predicted window (steps 1-5).

    Args:
        pose: (3,) of the robot. goal: (2,) or (3,) (its heading is not used). static: (n, 3) x, y, inflated radius [m].
        predicted: (m, N + 1, 3) x, y, inflated radius of the moving discs at steps 0..N (see `predict`); N = N^P >= 1.
        area: (4,) x_min, y_min, x_max, y_max of where the centre may be; infinite: anywhere.
        perception: radius of the perception field, m (inf: no temporary targets).
        speed: v_ref, m/s (see `reference_speed`), > 0. period: c, s. count: how many steps to give, >= 1 (may exceed N).
        draw: uniform in [0, 1), decides ties. exact: the tangent graph instead of the greedy rule.
    """
    return Reference(
        0, np.zeros((count + 1, 3)), np.zeros((count, 2)), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 3)), 0.0,
        goal[:2].copy(), 0,
    )  # fmt: skip


@kernel
def reference_speed(v_min: float, v_max: float) -> float:
    """v_ref [m/s]: the larger of v_max / 2 and the midpoint (v_min + v_max) / 2 of the robot's range of speeds."""
    return max(0.5 * v_max, 0.5 * (v_min + v_max))

"""A second, plain reading of nav2_mppi_controller's motion models and update: in doubles, from the C++ sources alone.

Arrays here are (samples, time steps), as there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def predict(
    model: dict[str, Any], noises: dict[str, Array], control: dict[str, Array], speed: dict[str, float]
) -> tuple[Any, Any]:
    """motion_models.hpp, predict, with what optimizer.cpp does before it; velocities and controls of vx, vy, wz.

    Args:
        model: dt, holonomic, clamp_raw, and of each axis its (min, max) acceleration, delay [s], past commands (the latest last).
        noises: (B, T) of each axis.
        control: (T,) of each axis.
        speed: Of each axis.
    """
    velocities, controls = {}, {}
    for axis in ("vx", "wz", *(("vy",) if model["holonomic"] else ())):
        slower, faster = (model["dt"] * a for a in model["accelerations"][axis])
        c = noises[axis] + control[axis][None, :]
        v = np.zeros_like(c)
        v[:, 0] = speed[axis]
        for i in range(len(v)):
            for t in range(1, v.shape[1]):
                last = v[i, t - 1]
                if axis == "wz":
                    low, high = last - faster, last + faster
                elif last > 0:
                    low, high = last + slower, last + faster
                else:
                    low, high = last - faster, last - slower
                v[i, t] = min(max(c[i, t - 1], low), high)
                if model["clamp_raw"]:
                    c[i, t - 1] = v[i, t]
        offset = math.floor(model["delays"][axis] / model["dt"] + 0.5)
        if offset > 0:
            past = model["commands"][axis][-offset:]
            shifted = v.copy()
            for t in range(1, v.shape[1]):
                shifted[:, t] = past[t] if t < offset else v[:, t - offset + 1]
            v = shifted
        velocities[axis], controls[axis] = v, c
    if not model["holonomic"]:
        velocities["vy"] = np.zeros_like(velocities["vx"])
    return velocities, controls


def integrate(velocities: dict[str, Array], pose: Array, dt: float) -> tuple[Array, Array, Array]:
    """optimizer.cpp, integrateStateVelocities."""
    yaw = pose[2] + np.cumsum(velocities["wz"] * dt, axis=1)
    before = np.column_stack((np.full(len(yaw), pose[2]), yaw[:, :-1]))
    vx, vy = velocities["vx"], velocities["vy"]
    x = pose[0] + np.cumsum((vx * np.cos(before) - vy * np.sin(before)) * dt, axis=1)
    y = pose[1] + np.cumsum((vx * np.sin(before) + vy * np.cos(before)) * dt, axis=1)
    return x, y, yaw


def clamp_by_acceleration(last: float, value: float, slower: float, faster: float) -> float:
    """utils.hpp, clampVelocityByAccel."""
    low, high = (last + slower, last + faster) if last >= 0 else (last - faster, last - slower)
    return min(high, max(value, low))


def update(
    s: dict[str, Any], control: dict[str, Array], controls: dict[str, Array], costs: Array, history: Array
) -> dict[str, Array]:
    """optimizer.cpp, updateControlSequence; `history` (4, 3) is overwritten.

    Args:
        s: gamma, temperature, dt, period, shift, sgf_order, radius (0: none), speed; of each axis std, bounds, accelerations.
    """
    axes = list(controls)
    costs = costs.copy()
    for axis in axes:
        if axis != "wz" or s["std"]["wz"] > 0:
            mean = control[axis][None, :]
            costs += s["gamma"] / s["std"][axis] ** 2 * ((controls[axis] - mean) * mean).sum(axis=1)
    weights = np.exp(-(costs - costs.min()) / s["temperature"])
    weights /= weights.sum()
    new = {axis: controls[axis].T @ weights for axis in axes}
    steps = len(new["vx"])
    coefficients = np.full(9, 1 / 9) if s["sgf_order"] == 1 else np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21]) / 231
    if steps - 1 >= 20:
        for column, axis in enumerate(("vx", "vy", "wz")):
            if axis in new:
                padded = np.concatenate((history[:, column], new[axis], np.full(4, new[axis][-1])))
                new[axis] = np.append([coefficients @ padded[i : i + 9] for i in range(steps - 1)], new[axis][-1])
        sent = 1 if s["shift"] else 0
        history[:3] = history[1:].copy()
        history[3] = [new[a][sent] if a in new else 0.0 for a in ("vx", "vy", "wz")]

    def steer() -> None:
        if s["radius"] > 0:
            most = np.abs(new["vx"]) / s["radius"]
            new["wz"] = np.minimum(np.maximum(new["wz"], -most), most)

    steer()
    for axis in axes:
        least, most = s["bounds"][axis]
        last = s["speed"][axis]
        if s["shift"]:
            new[axis][0] = last
        for t in range(steps):
            dt = s["period"] if t == 0 else s["dt"]
            slower, faster = (dt * a for a in s["accelerations"][axis])
            last = clamp_by_acceleration(last, min(most, max(new[axis][t], least)), slower, faster)
            new[axis][t] = last
    steer()
    return new

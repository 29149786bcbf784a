"""Constant-velocity Kalman filters, one an obstacle, as compiled kernels on arrays.

The two axes are alike and independent, so a filter is its state (4,) x, y, v_x, v_y and a covariance (3,) of position,
position with velocity, velocity, which both axes share. Acceleration is white from period to period with standard
deviation q: Q = q^2 [T^4/4, T^3/2, T^2] (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2, the discrete white noise
acceleration model, where 0.5 a_max <= q <= a_max is the advice; we take the lower end).
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SIGMAS = 3.0
"""Of a bound."""

SPREAD = 0.5
"""Standard deviation of the acceleration over its bound."""

SHARPEST = 0.25
"""No measurement is taken to be more exact than so much of q T^2, m: of exact ones alone the model makes a velocity that errs to
the other side at each step, for ever, once somebody's has changed at once."""


@kernel
def predict(state: FloatArray, spread: FloatArray, dt: float, q: FloatArray) -> None:
    """Move filters `state` (n, 4), `spread` (n, 3) on by `dt` [s]; `q` (n,): standard deviation of acceleration, m/s^2."""
    for i in range(state.shape[0]):
        state[i, 0] += dt * state[i, 2]
        state[i, 1] += dt * state[i, 3]
        pp, pv, vv = spread[i, 0], spread[i, 1], spread[i, 2]
        spread[i, 0] = pp + dt * (2.0 * pv + dt * vv) + 0.25 * (q[i] * dt * dt) ** 2
        spread[i, 1] = pv + dt * vv + 0.5 * q[i] * q[i] * dt**3
        spread[i, 2] = vv + (q[i] * dt) ** 2


@kernel
def correct(state: FloatArray, spread: FloatArray, i: int, x: float, y: float, variance: float) -> None:
    """Take in a position (x, y) whose error has `variance` [m^2] along either axis into filter `i`."""
    s = spread[i, 0] + variance
    if s <= 0.0:  # nothing to weigh: two exact positions
        state[i, 0], state[i, 1] = x, y
        return
    kp, kv = spread[i, 0] / s, spread[i, 1] / s
    ex, ey = x - state[i, 0], y - state[i, 1]
    state[i, 0] += kp * ex
    state[i, 1] += kp * ey
    state[i, 2] += kv * ex
    state[i, 3] += kv * ey
    pp, pv, vv = spread[i, 0], spread[i, 1], spread[i, 2]
    spread[i, 0] = (1.0 - kp) * pp
    spread[i, 1] = (1.0 - kp) * pv
    spread[i, 2] = max(0.0, vv - kv * pv)


@kernel
def begin(state: FloatArray, spread: FloatArray, i: int, x: float, y: float, variance: float, fastest: float) -> None:
    """Start filter `i` at a first position; of its velocity only a bound `fastest` [m/s] is known (3 sigma)."""
    state[i, 0], state[i, 1], state[i, 2], state[i, 3] = x, y, 0.0, 0.0
    spread[i, 0], spread[i, 1], spread[i, 2] = variance, 0.0, (fastest / SIGMAS) ** 2


@kernel
def nearest_pairs(
    a: FloatArray, reach_a: FloatArray, b: FloatArray, reach_b: FloatArray
) -> np.ndarray:  # fmt: skip
    """For each of `b` (m, 2 or more) the index of its partner in `a` (n, 2 or more), or -1: the nearest pair first, each used once.

    A pair must lie within `reach_a[i] + reach_b[j]` [m].
    """
    n, m = a.shape[0], b.shape[0]
    partner = np.full(m, -1, dtype=np.int64)
    count = 0
    for pas in range(2):  # count, then fill
        if pas == 1:
            far, rows, columns = np.empty(count), np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
            count = 0
        for i in range(n):
            for j in range(m):
                dx, dy = a[i, 0] - b[j, 0], a[i, 1] - b[j, 1]
                reach = reach_a[i] + reach_b[j]
                d = dx * dx + dy * dy
                if d <= reach * reach:
                    if pas == 1:
                        far[count], rows[count], columns[count] = d, i, j
                    count += 1
    used = np.zeros(n, dtype=np.uint8)
    for k in np.argsort(far, kind="mergesort"):
        i, j = rows[k], columns[k]
        if partner[j] < 0 and not used[i]:
            partner[j], used[i] = i, 1
    return partner


@kernel
def find(ids: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Where each of `wanted` (m,) stands in the sorted `ids` (n,): (m,) int64, -1 where it doesn't."""
    place = np.full(wanted.shape[0], -1, dtype=np.int64)
    n = ids.shape[0]
    for j in range(wanted.shape[0]):
        i = np.searchsorted(ids, wanted[j])
        if i < n and ids[i] == wanted[j]:
            place[j] = i
    return place


@kernel
def advance(
    ids: np.ndarray, state: FloatArray, spread: FloatArray, seen: FloatArray,
    identity: np.ndarray, position: FloatArray, bound: FloatArray, fastest: float,
    t: float, dt: float, q: float, memory: float,
) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray, np.ndarray]:  # fmt: skip
    """One period of the filters of obstacles that are told by identity.

    Args:
        ids: (n,) identities of the filters, sorted.
        state: (n, 4) x, y [m], vx, vy [m/s] of each.
        spread: (n, 3) covariance of each along an axis: of position, of both, of velocity.
        seen: (n,) when each was last corrected, s.
        identity: (m,) of what is measured now.
        position: (m, 2) of what is measured now, m.
        bound: (m,) m; the error is uniform in a disc of this radius, whose variance is bound^2 / 4 along an axis.
        fastest: Bound on the speed of an obstacle, m/s.
        t: Now, s.
        dt: Time since the last period, s.
        q: Standard deviation of the acceleration, m/s^2.
        memory: A filter that went unseen for longer is dropped, s.

    Returns:
        The filters, sorted by identity again, and which of them belongs to each measurement (m,).
    """
    predict(state, spread, dt, np.full(state.shape[0], q))
    place = find(ids, identity)
    kept, fresh = 0, 0
    hit = np.zeros(ids.shape[0], dtype=np.uint8)
    for j in range(identity.shape[0]):
        if place[j] >= 0:
            hit[place[j]] = 1
        else:
            fresh += 1
    for i in range(ids.shape[0]):
        if hit[i] or t - seen[i] <= memory:
            kept += 1
    total = kept + fresh
    new_ids = np.empty(total, dtype=np.int64)
    new_state, new_spread, new_seen = np.empty((total, 4)), np.empty((total, 3)), np.empty(total)
    k = 0
    for i in range(ids.shape[0]):
        if hit[i] or t - seen[i] <= memory:
            new_ids[k], new_state[k], new_spread[k], new_seen[k] = ids[i], state[i], spread[i], seen[i]
            k += 1
    for j in range(identity.shape[0]):
        if place[j] < 0:
            new_ids[k], new_seen[k] = identity[j], t
            begin(new_state, new_spread, k, position[j, 0], position[j, 1], 0.25 * bound[j] ** 2, fastest)
            k += 1
    if fresh > 0:
        order = np.argsort(new_ids, kind="mergesort")
        new_ids, new_state, new_spread, new_seen = new_ids[order], new_state[order], new_spread[order], new_seen[order]
    at = find(new_ids, identity)
    for j in range(identity.shape[0]):
        if place[j] >= 0:
            variance = max(0.25 * bound[j] ** 2, (SHARPEST * q * dt * dt) ** 2)
            correct(new_state, new_spread, at[j], position[j, 0], position[j, 1], variance)
            new_seen[at[j]] = t
    return new_ids, new_state, new_spread, new_seen, at


@kernel
def report(
    state: FloatArray, spread: FloatArray, at: np.ndarray, position: FloatArray, bound: FloatArray, moving: np.ndarray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """What is told of measured obstacles: position (m, 2), velocity (m, 2), and bounds of both errors (m,).

    The position's bound is 3 sigma, or what follows from the measurement's own bound where that is less; of one that
    does not move, the measurement and zeros.
    """
    m = at.shape[0]
    where, velocity, error, velocity_error = position.copy(), np.zeros((m, 2)), np.zeros(m), np.zeros(m)
    for j in range(m):
        i = at[j]
        if not moving[j]:
            error[j] = bound[j]
            continue
        where[j] = state[i, :2]
        velocity[j] = state[i, 2:]
        off = math.hypot(state[i, 0] - position[j, 0], state[i, 1] - position[j, 1])
        error[j] = min(SIGMAS * math.sqrt(spread[i, 0]), off + bound[j])
        velocity_error[j] = SIGMAS * math.sqrt(spread[i, 2])
    return where, velocity, error, velocity_error

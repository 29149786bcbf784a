"""Where an obstacle is for sure: discs that hold its place and its velocity, as long as the assumptions hold.

The assumptions: |velocity| <= V, |acceleration| <= A, each measured position off by at most its own bound. A disc of
places and one of velocities are moved on by what these allow and met with what each measurement allows (set-membership
estimation, Schweppe 1968); where two discs meet, the smallest disc around the common part goes on. Two places T
apart tell the velocity at the second of them up to (error + error) / T + A T / 2.
"""

from __future__ import annotations

import math

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

RECENT = 3
"""So many places before the last one tell the velocity."""
HELD, TOO_FAST, BENT = 0, 1, 2
"""What a measurement says of the assumptions."""
_SLACK = 1e-9  # m: rounding


@kernel
def meet(
    x: float, y: float, r: float, a: float, b: float, s: float
) -> tuple[float, float, float]:  # fmt: skip
    """x, y, radius of the smallest disc that holds what is common to the discs (x, y, r) and (a, b, s).

    Of two that have nothing in common: the smaller one.
    """
    dx, dy = a - x, b - y
    d = math.hypot(dx, dy)
    if s > r:
        x, y, r, a, b, s, dx, dy = a, b, s, x, y, r, -dx, -dy  # r is the larger now
    if d >= r + s or r * r >= d * d + s * s:  # nothing in common; or more than half of the smaller one
        return a, b, s
    along = (d * d + r * r - s * s) / (2.0 * d)
    return x + dx * along / d, y + dy * along / d, math.sqrt(max(0.0, r * r - along * along)) + _SLACK


@kernel
def start(x: float, y: float, error: float, speed: float, disc: FloatArray, recent: FloatArray) -> None:
    """One place is known and no velocity: `disc` (6,) x, y, r, vx, vy, rv and `recent` (RECENT, 4) t, x, y, r, filled."""
    disc[0], disc[1], disc[2], disc[3], disc[4], disc[5] = x, y, error, 0.0, 0.0, speed
    for i in range(RECENT):
        recent[i, 0] = math.nan


@kernel
def move(dt: float, speed: float, acceleration: float, disc: FloatArray) -> None:
    """Move `disc` on by `dt` [s]."""
    x, y, r, vx, vy, rv = disc[0], disc[1], disc[2], disc[3], disc[4], disc[5]
    disc[0], disc[1], disc[2] = meet(
        x + vx * dt, y + vy * dt, r + rv * dt + 0.5 * acceleration * dt * dt, x, y, r + speed * dt
    )
    disc[3], disc[4], disc[5] = meet(vx, vy, rv + acceleration * dt, 0.0, 0.0, speed)


@kernel
def excess(x: float, y: float, error: float, disc: FloatArray) -> float:
    """How far a measured place lies outside of where it had to be, m; at most 0: it doesn't."""
    return float(math.hypot(x - disc[0], y - disc[1]) - disc[2] - error - _SLACK)


@kernel
def take(
    t: float, x: float, y: float, error: float, speed: float, acceleration: float, disc: FloatArray, recent: FloatArray
) -> bool:
    """Meet `disc` with a place measured at `t` [s], which lies within its reach.

    Returns:
        Whether the velocities that the recent places allow have something in common.
    """
    disc[0], disc[1], disc[2] = meet(disc[0], disc[1], disc[2], x, y, error)
    good = True
    for i in range(RECENT):
        dt = t - recent[i, 0]
        if not dt > 0.0:
            continue
        vx, vy = (disc[0] - recent[i, 1]) / dt, (disc[1] - recent[i, 2]) / dt
        rv = (disc[2] + recent[i, 3]) / dt + 0.5 * acceleration * dt + _SLACK
        if math.hypot(vx - disc[3], vy - disc[4]) > rv + disc[5] + _SLACK:
            good = False
            disc[3], disc[4], disc[5] = 0.0, 0.0, speed
            break
        disc[3], disc[4], disc[5] = meet(disc[3], disc[4], disc[5], vx, vy, rv)
    for i in range(RECENT - 1, 0, -1):
        for j in range(4):
            recent[i, j] = recent[i - 1, j]
    recent[0, 0], recent[0, 1], recent[0, 2], recent[0, 3] = t, disc[0], disc[1], disc[2]
    if not good:
        for i in range(1, RECENT):
            recent[i, 0] = math.nan
    return good


@kernel
def take_velocity(vx: float, vy: float, error: float, disc: FloatArray) -> None:
    """Meet `disc` with a measured velocity [m/s] and the bound of its error, if the two have something in common."""
    if math.hypot(vx - disc[3], vy - disc[4]) <= error + disc[5]:  # NaN: not measured
        disc[3], disc[4], disc[5] = meet(disc[3], disc[4], disc[5], vx, vy, error)


@kernel
def reach(
    disc: FloatArray, step: float, speed: float, acceleration: float, centre: FloatArray, radius: FloatArray
) -> float:
    """Fill where it is for sure at the instants 0, step, ...: `centre` (K + 1, 2), `radius` (K + 1,) [m].

    Returns:
        The speed that it keeps below until the last of them, m/s.
    """
    x, y, r, vx, vy, rv = disc[0], disc[1], disc[2], disc[3], disc[4], disc[5]
    fast = min(speed, math.hypot(vx, vy) + rv)
    n = radius.shape[0]
    for j in range(n):
        t = j * step
        rise = min(t, (speed - fast) / acceleration)  # until it is as fast as it can be
        far = fast * rise + 0.5 * acceleration * rise * rise + speed * (t - rise)
        centre[j, 0], centre[j, 1], radius[j] = meet(
            x + vx * t, y + vy * t, r + rv * t + 0.5 * acceleration * t * t, x, y, r + far
        )
    return float(min(speed, fast + acceleration * step * (n - 1)))


def words(kind: int, name: int, amount: float, dt: float, speed: float, acceleration: float) -> str:
    """What a measurement says against the assumptions; amount: m that it lies outside of its bound, dt: s since the last."""
    if kind == TOO_FAST:
        return f"obstacle {name}: faster than {speed:g} m/s ({amount:.2f} m too far in {dt:.2f} s)"
    off = f" ({amount:.2f} m outside of its bound)" if amount > 0.0 else ""
    return f"obstacle {name}: accelerates by more than {acceleration:g} m/s^2{off}"

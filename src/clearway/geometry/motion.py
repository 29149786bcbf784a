"""Exact motion of a body with constant velocity in its own frame: an arc, or a line where it doesn't turn."""

from __future__ import annotations

import math

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import light


@light
def arc(x: float, y: float, theta: float, v: float, omega: float, dt: float) -> tuple[float, float, float]:
    """Where a body ends that drives `dt` [s] from (x, y, theta) with `v` [m/s] and `omega` [rad/s]; theta is wrapped.

    The chord of the arc has length v dt sin(a)/a and direction theta + a, with a = omega dt / 2: no case distinction
    at omega = 0 is needed beyond sin(a)/a.
    """
    half = 0.5 * omega * dt
    chord = v * dt * sinc(half)
    return x + chord * math.cos(theta + half), y + chord * math.sin(theta + half), wrap(theta + 2.0 * half)


@light
def slide(
    x: float, y: float, theta: float, v: float, v_y: float, omega: float, dt: float
) -> tuple[float, float, float]:
    """As `arc`, of a body that also moves to its left, with `v_y` [m/s]: still an arc, not along its heading.

    Without that the bits are those of `arc`.
    """
    if v_y == 0.0:
        return arc(x, y, theta, v, omega, dt)
    half = 0.5 * omega * dt
    c, s, chord = math.cos(theta + half), math.sin(theta + half), dt * sinc(half)
    return x + chord * (v * c - v_y * s), y + chord * (v * s + v_y * c), wrap(theta + 2.0 * half)


@light
def sinc(a: float) -> float:
    """sin(a) / a, to the last digit near 0 as well."""
    if abs(a) < 1e-4:
        return 1.0 - a * a / 6.0
    return math.sin(a) / a


@light
def ramp(now: float, target: float, faster: float, slower: float, dt: float) -> tuple[float, float]:
    """A velocity that heads for `target` from `now` during `dt` [s], with bounded acceleration.

    `faster` [m/s^2 or rad/s^2] bounds the growth of its magnitude, `slower` its decline; to change its sign it slows
    down to zero first and speeds up in what remains of `dt`.

    Returns:
        The velocity at the end, and its mean over `dt`; in no time at all it stays what it is.
    """
    if dt <= 0.0:
        return now, now
    if now * target < 0.0:
        stop = abs(now) / slower
        if stop >= dt:
            return _approach(now, 0.0, slower, dt)
        end, mean = _approach(0.0, target, faster, dt - stop)
        return end, (0.5 * now * stop + mean * (dt - stop)) / dt
    return _approach(now, target, faster if abs(target) > abs(now) else slower, dt)


@light
def _approach(now: float, target: float, rate: float, dt: float) -> tuple[float, float]:
    """`ramp` with one acceleration `rate` throughout."""
    gap = target - now
    if abs(gap) <= rate * dt:  # there in time: at the target from then on
        return target, target - 0.5 * gap * abs(gap) / (rate * dt)
    end = now + math.copysign(rate * dt, gap)
    return end, 0.5 * (now + end)

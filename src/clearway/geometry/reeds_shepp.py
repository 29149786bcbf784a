"""Shortest paths of a car that drives forwards and backwards (J. A. Reeds, L. A. Shepp 1990).

Equations are numbered as in section 8 of the paper: each gives the arcs of one word that begins left and forwards; the
others follow by driving the other way (x, yaw turn round), by the mirror (y, yaw turn round), and by going from the end
to the beginning.
"""

from __future__ import annotations

import math
from typing import Any

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.dubins import Pieces

_ZERO = 1e-14
_QUARTER = 0.5 * math.pi

(_LSL, _LSR, _LRL, _LRLR_OUT, _LRLR_IN, _LRSL, _LRSR, _LRSLR, _LRL_BACK, _LRSL_BACK, _LRSR_BACK) = range(11)


@kernel
def _lrl(xi: float, eta: float, yaw: float, best: float) -> Any:
    """(8.3) and (8.4): left, back right, left. Its length, infinite if it leads nowhere or is not below `best`, and arcs."""
    reach = math.sqrt(xi * xi + eta * eta)
    if reach > 4:
        return math.inf, 0.0, 0.0, 0.0
    u = -2 * math.asin(0.25 * reach)
    if -u >= best:
        return math.inf, 0.0, 0.0, 0.0
    t = wrap(math.atan2(eta, xi) + 0.5 * u + math.pi)
    v = wrap(yaw - t + u)
    return (t - u + abs(v) if t >= -_ZERO else math.inf), t, u, v


@kernel
def _lrsl(xi: float, eta: float, yaw: float, best: float) -> Any:
    """(8.9): left, back a quarter right, straight, left, all but the first backwards; likewise."""
    reach = math.sqrt(xi * xi + eta * eta)
    r = math.sqrt(max(0.0, reach * reach - 4))
    if reach < 2 or r - 2 + _QUARTER >= best:
        return math.inf, 0.0, 0.0, 0.0
    t, u = wrap(math.atan2(eta, xi) + math.atan2(r, -2.0)), 2 - r
    v = wrap(yaw - _QUARTER - t)
    return (t - u - v + _QUARTER if t >= -_ZERO and u <= _ZERO and v <= _ZERO else math.inf), t, u, v


@kernel
def _lrsr(xi: float, eta: float, yaw: float, best: float) -> Any:
    """(8.10): left, back a quarter right, straight, right, all but the first backwards; likewise."""
    reach = math.sqrt(xi * xi + eta * eta)
    if reach < 2 or reach - 2 + _QUARTER >= best:
        return math.inf, 0.0, 0.0, 0.0
    t, u = math.atan2(xi, -eta), 2 - reach
    v = wrap(t + _QUARTER - yaw)
    return (t - u - v + _QUARTER if t >= -_ZERO and u <= _ZERO and v <= _ZERO else math.inf), t, u, v


@kernel
def _tau_omega(u: float, v: float, xi: float, eta: float, yaw: float) -> Any:
    """The outer arcs of four, of which `u` and `v` are the inner ones."""
    delta = wrap(u - v)
    a, b = math.sin(u) - math.sin(delta), math.cos(u) - math.cos(delta) - 1
    t = math.atan2(eta * a - xi * b, xi * a + eta * b)
    turned = 2 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3
    tau = wrap(t + math.pi) if turned < 0 else wrap(t)
    return tau, wrap(tau - u + v - yaw)


@kernel
def _least(x: float, y: float, yaw: float) -> Any:
    """The shortest word's length, number, three arcs, and the signs of driving and of turning with which it is read."""
    best, word, bt, bu, bv, drive, mirror = math.inf, 0, 0.0, 0.0, 0.0, 1.0, 1.0
    s, c = math.sin(yaw), math.cos(yaw)
    back_x, back_y = x * c + y * s, x * s - y * c
    for way in range(4):
        f = 1.0 if way < 2 else -1.0  # which way it drives
        m = 1.0 if way % 2 == 0 else -1.0  # and to which side it turns
        px, py, p, sine = f * x, m * y, f * m * yaw, f * m * s
        same_x, same_y = px - sine, py - 1 + c  # centre of the last circle, if it is left
        other_x, other_y = px + sine, py - 1 - c  # if it is right
        # (8.1) left, straight, left
        u = math.sqrt(same_x * same_x + same_y * same_y)
        t = math.atan2(same_y, same_x) if u < best else -1.0
        if t >= -_ZERO:
            v = wrap(p - t)
            if v >= -_ZERO and t + u + v < best:
                best, word, bt, bu, bv, drive, mirror = t + u + v, _LSL, t, u, v, f, m
        square = other_x * other_x + other_y * other_y
        if square >= 4:
            # (8.2) left, straight, right
            r = math.sqrt(square - 4)
            if r < best:
                t = wrap(math.atan2(other_y, other_x) + math.atan2(2.0, r))
                v = wrap(t - p)
                if t >= -_ZERO and v >= -_ZERO and t + r + v < best:
                    best, word, bt, bu, bv, drive, mirror = t + r + v, _LSR, t, r, v, f, m
            # (8.11) left, back a quarter right, straight, a quarter left, forwards right
            u = 4 - r
            if u <= _ZERO and math.pi - u < best:
                t = wrap(math.atan2(r * other_x - 2 * other_y, -2 * other_x - r * other_y))
                v = wrap(t - p)
                if t >= -_ZERO and v >= -_ZERO and t - u + v + math.pi < best:
                    best, word, bt, bu, bv, drive, mirror = t - u + v + math.pi, _LRSLR, t, u, v, f, m
        # (8.7) left, right, back left, right
        if square <= 4:
            u = math.acos(0.25 * (2 + math.sqrt(square)))
            if 2 * u < best:
                t, v = _tau_omega(u, -u, other_x, other_y, p)
                if t >= -_ZERO and v <= _ZERO and t + 2 * u - v < best:
                    best, word, bt, bu, bv, drive, mirror = t + 2 * u - v, _LRLR_OUT, t, u, v, f, m
        # (8.8) left, back right, left, forwards right
        if 4 <= square <= 20:
            u = -math.acos((20 - square) / 16)
            if u >= -_QUARTER and -2 * u < best:
                t, v = _tau_omega(u, u, other_x, other_y, p)
                if t >= -_ZERO and v >= -_ZERO and t - 2 * u + v < best:
                    best, word, bt, bu, bv, drive, mirror = t - 2 * u + v, _LRLR_IN, t, u, v, f, m
        total, t, u, v = _lrl(same_x, same_y, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRL, t, u, v, f, m
        total, t, u, v = _lrsl(same_x, same_y, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRSL, t, u, v, f, m
        total, t, u, v = _lrsr(other_x, other_y, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRSR, t, u, v, f, m
        # from the end to the beginning
        px, py = f * back_x, m * back_y
        total, t, u, v = _lrl(px - sine, py - 1 + c, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRL_BACK, t, u, v, f, m
        total, t, u, v = _lrsl(px - sine, py - 1 + c, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRSL_BACK, t, u, v, f, m
        total, t, u, v = _lrsr(px + sine, py - 1 - c, p, best)
        if total < best:
            best, word, bt, bu, bv, drive, mirror = total, _LRSR_BACK, t, u, v, f, m
    return best, word, bt, bu, bv, drive, mirror


@light
def distance(x: float, y: float, yaw: float) -> float:
    """Length of the shortest path from the origin, facing +x, to a pose, in turning radii."""
    least: float = _least(x, y, yaw)[0]
    return least


@kernel
def reeds_shepp(x: float, y: float, yaw: float) -> Pieces:
    """The shortest path from the origin, facing +x, to a pose, in turning radii."""
    _, word, t, u, v, f, m = _least(x, y, yaw)
    t, u, v, q = f * t, f * u, f * v, f * _QUARTER
    if word == _LSL:
        return Pieces(t, u, v, 0.0, 0.0, m, 0.0, m, 0.0, 0.0)
    if word == _LSR:
        return Pieces(t, u, v, 0.0, 0.0, m, 0.0, -m, 0.0, 0.0)
    if word == _LRL:
        return Pieces(t, u, v, 0.0, 0.0, m, -m, m, 0.0, 0.0)
    if word == _LRLR_OUT:
        return Pieces(t, u, -u, v, 0.0, m, -m, m, -m, 0.0)
    if word == _LRLR_IN:
        return Pieces(t, u, u, v, 0.0, m, -m, m, -m, 0.0)
    if word == _LRSL:
        return Pieces(t, -q, u, v, 0.0, m, -m, 0.0, m, 0.0)
    if word == _LRSR:
        return Pieces(t, -q, u, v, 0.0, m, -m, 0.0, -m, 0.0)
    if word == _LRSLR:
        return Pieces(t, -q, u, -q, v, m, -m, 0.0, m, -m)
    if word == _LRL_BACK:
        return Pieces(v, u, t, 0.0, 0.0, m, -m, m, 0.0, 0.0)
    if word == _LRSL_BACK:
        return Pieces(v, u, -q, t, 0.0, m, 0.0, -m, m, 0.0)
    return Pieces(v, u, -q, t, 0.0, -m, 0.0, -m, m, 0.0)

"""The tube: where the robot can be while it follows a plan, given what can disturb it. A bound, in between samples too.

The error of the closed loop about the nominal motion obeys, with exact arcs, e+ = (A_j + B_j K_j) e + w + l: A_j, B_j
linearise the chord of a period, w is the disturbance, l what linearising leaves out, for which Lagrange's form of the
remainder gives a box in the chord's frame (`_remainder`). The set of all e is a sum of linear images of discs and
segments, which are carried along one by one, so that its support is known exactly in any direction; nothing is merged.

K_j is the pole placement of `common.tracking.ancillary`, which looks at period j alone: the tube of a plan's first k periods
does not depend on what follows. Each row is scaled down until its correction fits into what the input limits leave, so
that no correction is ever cut off and the bound holds for whatever plan. docs/guarantee.md has the proof.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.steering import steered
from clearway.navigators.common.tracking.ancillary import chord, gain
from clearway.robots.drive_limits import DriveLimits, immediate, possible

POLES = (0.3, 0.3, 0.3)
"""Of the error along, left, and of the heading (benchmarks/certified_tube.py tells how tight a tube they make)."""
STEER = 60.0
"""Bound on the gain from the error to the left to omega, rad/s/m for each m/s that the robot drives: at low speed an
error to the side is cheaper than the turns that would make it good."""
DIRECTIONS = 12
"""Supporting lines on half the circle; the circle around their polygon is the radius, at most 0.9 % too large."""
_COS = np.cos(np.pi * np.arange(DIRECTIONS) / DIRECTIONS)
_SIN = np.sin(np.pi * np.arange(DIRECTIONS) / DIRECTIONS)
_CORNER = 1.0 / math.cos(0.5 * math.pi / DIRECTIONS)
_STEEPEST = 0.4362  # the largest slope of sin(a) / a


class Plan(NamedTuple):
    """M periods of nominal motion, map frame.

    Attributes:
        states: (M + 1, 3) poses at the samples, in metres and radians.
        inputs: (M, 2) mean v and omega of each period, in m/s and rad/s.
        swings: (M, 2) by how much v and omega change within each period, as the base's acceleration is bounded; zeros
            for a base that takes up a command at once.
        velocities: (M + 1, 2) v and omega at the samples; without bounds on the acceleration, those of the period before.
        commands: (M, 2) v and omega that the base is told for each period.
    """

    states: FloatArray
    inputs: FloatArray
    swings: FloatArray
    velocities: FloatArray
    commands: FloatArray


@light
def stands(plan: Plan, j: int) -> bool:
    """Whether the base stands all through period `j` of `plan`."""
    still = plan.inputs[j, 0] == 0.0 and plan.inputs[j, 1] == 0.0
    return bool(still and plan.swings[j, 0] == 0.0 and plan.swings[j, 1] == 0.0)


class Tube(NamedTuple):
    """Bounds on where the robot is about a plan of M periods.

    Attributes:
        radius: (M + 1,) bounds on the distance from the plan at the samples, in metres.
        heading: (M + 1,) bounds on the deviation of the heading at the samples, in radians.
        around: (M,) bounds on the distance from the arc of inputs[j] out of states[j] at all times of period j, its ends
            included, in metres.
        turned: (M,) the same of the heading, in radians.
        gains: (M, 2, 3) K_j: the command is inputs[j] + K_j (pose - states[j]), the heading's difference wrapped.
        margin: (M, 2) the largest |K_j (pose - states[j])| in m/s and rad/s; never beyond `room`.
    """

    radius: FloatArray
    heading: FloatArray
    around: FloatArray
    turned: FloatArray
    gains: FloatArray
    margin: FloatArray


@kernel
def drive(state: FloatArray, commands: FloatArray, limits: DriveLimits, period: float) -> Plan:
    """The nominal motion that follows `commands`.

    Args:
        state: (5,) x, y, theta, v, omega now.
        commands: (M, 2) v and omega for each period, in m/s and rad/s; they are cut to the limits.
        limits: Limits of the base.
        period: Control period in seconds.
    """
    n = len(commands)
    faster, slower = limits.acceleration, limits.deceleration
    turn_faster, turn_slower = limits.angular_acceleration, limits.angular_deceleration
    states, inputs, swings = np.empty((n + 1, 3)), np.empty((n, 2)), np.empty((n, 2))
    velocities, told = np.empty((n + 1, 2)), np.empty((n, 2))
    states[0, 0], states[0, 1], states[0, 2] = state[0], state[1], state[2]
    velocities[0, 0], velocities[0, 1] = state[3], state[4]
    for j in range(n):
        told[j, 0], told[j, 1], _ = possible(limits, commands[j, 0], commands[j, 1], 0.0)
        if limits.wheelbase > 0.0:
            velocities[j + 1, 0], inputs[j, 0], velocities[j + 1, 1], inputs[j, 1] = steered(
                limits, velocities[j, 0], velocities[j, 1], told[j, 0], told[j, 1], period
            )
        else:
            velocities[j + 1, 0], inputs[j, 0] = ramp(velocities[j, 0], told[j, 0], faster, slower, period)
            velocities[j + 1, 1], inputs[j, 1] = ramp(velocities[j, 1], told[j, 1], turn_faster, turn_slower, period)
        swings[j, 0] = abs(velocities[j + 1, 0] - velocities[j, 0]) if math.isfinite(faster + slower) else 0.0
        swings[j, 1] = abs(velocities[j + 1, 1] - velocities[j, 1]) if math.isfinite(turn_faster + turn_slower) else 0.0
        states[j + 1, 0], states[j + 1, 1], states[j + 1, 2] = arc(
            states[j, 0], states[j, 1], states[j, 2], inputs[j, 0], inputs[j, 1], period
        )
    return Plan(states, inputs, swings, velocities, told)


@kernel
def room(plan: Plan, limits: DriveLimits) -> FloatArray:
    """(M, 2) how far v and omega may be corrected either way without touching the base's `limits`.

    None where an acceleration is bounded: such a base follows its plan without feedback.
    """
    left = np.zeros(plan.inputs.shape)
    if not immediate(limits):
        return left
    for j in range(len(left)):
        left[j, 0] = max(0.0, min(limits.v_max - plan.inputs[j, 0], plan.inputs[j, 0] - limits.v_min))
        left[j, 1] = max(0.0, limits.omega_max - abs(plan.inputs[j, 1]))
    return left


@kernel
def tube(
    plan: Plan, room: FloatArray, period: float, disturbance: FloatArray, start: FloatArray, standing: bool
) -> Tube:
    """The tube about `plan`.

    Args:
        plan: M periods of motion, as `drive` makes it.
        room: (M, 2) how far its inputs may be corrected, see `room`.
        period: Control period in seconds.
        disturbance: (5,) bounds for each period: displacement [m] (a disc) and turn [rad], which grow evenly over the
            period; deviation of v [m/s] and omega [rad/s]; and 1.0 where it also moves a robot that stands, else 0.0.
        start: (3,) bounds on |x|, |y| [m], |theta| [rad] of the perceived pose's error, now and at each later sample.
        standing: Whether the base stands now, and did in the period before.

    Returns:
        The bounds. The gain is zero where the input is, and in the first period, as the plan begins where the robot is
        perceived.
    """
    n, c = len(plan.inputs), period
    radius, heading = np.empty(n + 1), np.empty(n + 1)
    around, turned = np.empty(n), np.empty(n)
    gains, margin = np.zeros((n, 2, 3)), np.zeros((n, 2))
    parts = Parts(np.zeros((2 * n, 3)), np.zeros((6 * n + 3, 3)))  # the set of all errors, as a sum
    discs, rods = 0, 3
    for i in range(3):
        parts.rods[i, i] = start[i]
    radius[0], heading[0] = math.hypot(start[0], start[1]), start[2]
    poles, loop, b, row = np.array(POLES), np.empty((3, 3)), np.zeros((3, 2)), np.zeros(3)
    reach = np.empty(DIRECTIONS)
    for j in range(n):
        v, w, k = plan.inputs[j, 0], plan.inputs[j, 1], gains[j]
        still = stands(plan, j)
        if still and standing and disturbance[4] == 0.0:  # nothing moves it
            radius[j + 1], heading[j + 1], around[j], turned[j] = radius[j], heading[j], radius[j], heading[j]
            continue
        standing = still
        length, turn, g_v, g_w, b_w = chord(v, w, c, False)
        cos, sin = math.cos(plan.states[j, 2] + turn), math.sin(plan.states[j, 2] + turn)
        b[0, 0], b[1, 0] = g_v * cos, g_v * sin
        b[0, 1], b[1, 1], b[2, 1] = g_w * cos - b_w * sin, g_w * sin + b_w * cos, c

        if j > 0 and not still and room[j, 0] + room[j, 1] > 0.0 and heading[j] + start[2] < math.pi:
            wished = gain(plan.states[j, 2], v, w, c, False, poles, STEER * abs(v))
            for i in range(2):
                wanted = _support(parts, discs, rods, wished[i]) + _misread(wished[i], start)
                share = min(1.0, room[j, i] / wanted) if wanted > 0.0 else 1.0
                margin[j, i] = min(wanted, room[j, i])
                for m in range(3):
                    k[i, m] = share * wished[i, m]
        d_v, d_w = margin[j, 0] + disturbance[2], margin[j, 1] + disturbance[3]
        row[0], row[1], row[2] = 0.5 * c * k[1, 0], 0.5 * c * k[1, 1], 1.0 + 0.5 * c * k[1, 2]
        d_phi = _support(parts, discs, rods, row) + 0.5 * c * (_misread(k[1], start) + disturbance[3])
        linear = _remainder(length, turn, v, c, g_v, g_w, d_v, d_w, d_phi)
        bent, bulge, twist = _ramping(
            abs(v) + disturbance[2], abs(w) + disturbance[3], plan.swings[j, 0], plan.swings[j, 1], c
        )

        for i in range(3):  # A + B K
            for m in range(3):
                loop[i, m] = b[i, 0] * k[0, m] + b[i, 1] * k[1, m] + (1.0 if i == m else 0.0)
        loop[0, 2] -= length * sin
        loop[1, 2] += length * cos
        _carry(loop, parts.discs, 2 * discs)
        _carry(loop, parts.rods, rods)
        parts.discs[2 * discs, 0] = parts.discs[2 * discs + 1, 1] = disturbance[0] + linear + bent
        discs += 1
        if disturbance[1] > 0.0:
            parts.rods[rods, 2] = disturbance[1]
            rods += 1
        for i in range(2):
            if disturbance[2 + i] > 0.0:
                for m in range(3):
                    parts.rods[rods, m] = b[m, i] * disturbance[2 + i]
                rods += 1
        for m in range(3):  # what the feedback misreads
            if start[m] > 0.0 and (k[0, m] != 0.0 or k[1, m] != 0.0):
                for i in range(3):
                    parts.rods[rods, i] = (b[i, 0] * k[0, m] + b[i, 1] * k[1, m]) * start[m]
                rods += 1

        radius[j + 1] = _radius(parts, discs, rods, reach)
        row[0], row[1], row[2] = 0.0, 0.0, 1.0
        heading[j + 1] = _support(parts, discs, rods, row)
        turned[j] = max(heading[j], heading[j + 1])
        bow = d_v * (abs(w) + d_w) + abs(v) * d_w + abs(v * w) * min(2.0, turned[j])  # bound on |e''|, m/s^2
        around[j] = max(radius[j], radius[j + 1]) + bow * c * c / 8.0 + bulge
        turned[j] += twist
    return Tube(radius, heading, around, turned, gains, margin)


class Parts(NamedTuple):
    """A set of errors (x, y, theta): a sum of linear images of discs and of segments.

    Attributes:
        discs: (2 n, 3) two axes of each disc.
        rods: (m, 3) half of each segment.
    """

    discs: FloatArray
    rods: FloatArray


@light
def _support(parts: Parts, discs: int, rods: int, row: FloatArray) -> float:
    """The largest row @ e over the first `discs` and `rods` of the sum."""
    most = 0.0
    for i in range(discs):
        p, q = _along(row, parts.discs, 2 * i), _along(row, parts.discs, 2 * i + 1)
        most += math.sqrt(p * p + q * q)
    for i in range(rods):
        most += abs(_along(row, parts.rods, i))
    return most


@light
def _along(row: FloatArray, axes: FloatArray, i: int) -> float:
    return float(row[0] * axes[i, 0] + row[1] * axes[i, 1] + row[2] * axes[i, 2])


@light
def _radius(parts: Parts, discs: int, rods: int, reach: FloatArray) -> float:
    """Radius [m] of a disc that holds all (x, y) of the sum; `reach` (DIRECTIONS,) is filled with how far that goes each way."""
    reach[:] = 0.0
    for i in range(discs):  # the directions innermost: they run on vector registers
        px, py, qx, qy = (
            parts.discs[2 * i, 0],
            parts.discs[2 * i, 1],
            parts.discs[2 * i + 1, 0],
            parts.discs[2 * i + 1, 1],
        )
        for a in range(DIRECTIONS):
            p, q = _COS[a] * px + _SIN[a] * py, _COS[a] * qx + _SIN[a] * qy
            reach[a] += math.sqrt(p * p + q * q)
    for i in range(rods):
        px, py = parts.rods[i, 0], parts.rods[i, 1]
        for a in range(DIRECTIONS):
            reach[a] += abs(_COS[a] * px + _SIN[a] * py)
    most = 0.0
    for a in range(DIRECTIONS):
        most = max(most, reach[a])
    return most * _CORNER


@light
def _carry(loop: FloatArray, axes: FloatArray, count: int) -> None:
    """axes[i] <- loop @ axes[i] for the first `count`."""
    for i in range(count):
        x, y, t = axes[i, 0], axes[i, 1], axes[i, 2]
        for m in range(3):
            axes[i, m] = loop[m, 0] * x + loop[m, 1] * y + loop[m, 2] * t


@light
def _misread(row: FloatArray, start: FloatArray) -> float:
    """The largest row @ error of the perceived pose."""
    return float(abs(row[0]) * start[0] + abs(row[1]) * start[1] + abs(row[2]) * start[2])


@light
def _remainder(
    length: float, turn: float, v: float, c: float, g_v: float, g_w: float, d_v: float, d_w: float, d_phi: float
) -> float:
    """By how much [m] a chord misses its linearisation at most, where v, omega and its direction deviate by d_v, d_w, d_phi.

    |sin(a)/a|'' <= 1/3, and |sin(a)/a|' <= min(|a|/3, 0.4362).
    """
    d_a = 0.5 * c * d_w
    stretch = c * abs(v) * d_a * d_a / 6.0 + c * d_v * d_a * min(_STEEPEST, (abs(turn) + d_a) / 3.0)
    longer = g_v * d_v + abs(g_w) * d_w + stretch
    along = 0.5 * (abs(length) + longer) * d_phi * d_phi + stretch
    across = abs(length) * d_phi**3 / 6.0 + longer * d_phi
    return math.hypot(along, across)


@light
def _ramping(v: float, w: float, dv: float, dw: float, c: float) -> tuple[float, float, float]:
    """How far a period with v and omega that change monotonically by `dv`, `dw` is from the arc of their means, |v| and |w|.

    Returns:
        Bounds on the distance at its end [m], on that at any time [m], and on the heading at any time [rad]. A monotone
        change gets ahead of its mean by at most a quarter of dv c, and by an eighth of dv c^2 integrated.
    """
    bent = c * c * (dv * w + (v + dv) * dw) / 8.0
    return bent, 0.25 * c * dv + bent, 0.25 * c * dw

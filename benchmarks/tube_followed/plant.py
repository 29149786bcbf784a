"""A plant that follows a plan with its tube's gains and knows nothing of the tube: steps of at most `STEP`, ramps, and disturbance on or
within its bounds, at random or by adversaries, who push to one side, in zigzag, along the error, or as is worst to first order for a
chosen step and direction."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import uniform
from clearway.navigators.common.tracking.ancillary import linearise
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube
from clearway.robots import DriveLimits, load_robot

KINDS = (
    "random",
    "on the boundary",
    "to one side",
    "twisted back",
    "zigzag",
    "along the error",
    "worst to first order",
)
STEP = 0.01
NAMES = ("radius", "heading", "around", "turned", "correction of v", "correction of omega", "radius at the end")
BASES = {  # period, disturbance (5,), error of the perceived pose (3,)
    "rescue": ((0.01, 0.01, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
    "rescue:unlimited": ((0.01, 0.01, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "rescue:unlimited, disturbed at rest as well, and in its speeds": (
        (0.005, 0.005, 0.03, 0.05, 1.0),
        (0.0, 0.0, 0.0),
    ),
    "rescue:unlimited, misreading its pose": ((0.005, 0.005, 0.0, 0.0, 0.0), (0.005, 0.005, 0.005)),
    "tiago": ((0.005, 0.01, 0.01, 0.02, 0.0), (0.03, 0.03, 0.02)),
    "hosbot": ((0.005, 0.01, 0.01, 0.02, 0.0), (0.03, 0.03, 0.02)),
}


def limits_of(name: str) -> DriveLimits:
    """What the base of a robot can do."""
    return load_robot(name).limits()


def random_commands(limits: DriveLimits, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 2) commands that are held for 1 to 6 periods each: anything within the limits, at them, turns, rest."""
    held: list[tuple[float, float]] = []
    while len(held) < count:
        v, w = rng.uniform(limits.v_min, limits.v_max), rng.uniform(-limits.omega_max, limits.omega_max)
        ways = ((0.0, 0.0), (0.0, w), (v, 0.0), (v, 0.0), (limits.v_max, w), *[(v, w)] * 5)
        held += [ways[rng.integers(10)]] * int(rng.integers(1, 7))
    return np.array(held[:count])


def worst_case(plan: Plan, tube: Tube, period: float, target: int, angle: float) -> FloatArray:
    """(M + 1, 5): row j says how much what happens up to sample j adds in direction `angle` at sample `target`, linearly:
    an error of x, y, theta; and a deviation of v and omega in period j.
    """
    rows = np.zeros((len(plan.inputs) + 1, 5))
    rows[target, :2] = math.cos(angle), math.sin(angle)
    for j in range(target - 1, -1, -1):
        a, b = linearise(plan.states[j, 2], plan.inputs[j, 0], plan.inputs[j, 1], period, False)
        rows[j, :3] = rows[j + 1, :3] @ (a + b @ tube.gains[j])
        rows[j, 3:] = rows[j + 1, :3] @ b
    return rows


def follow(
    plan: Plan, tube: Tube, limits: DriveLimits, period: float, disturbance: FloatArray, start: FloatArray, kind: int,
    key: np.uint64, run: int, path: FloatArray, worst: FloatArray,
) -> None:  # fmt: skip
    """Follow `plan` with the tube's gains, disturbed in the manner KINDS[kind].

    Args:
        path: (M n + 1, 5) filled with x, y, theta, and the v and omega that the wheels have, n steps a period.
        worst: (7,) raised to the largest share seen of each of the bounds NAMES.
    """
    m = len(plan.inputs)
    target = 1 + int(m * uniform(key, run, 1)) if run % 2 else m
    rows = (
        worst_case(plan, tube, period, target, math.tau * uniform(key, run, 2)) if kind == 6 else np.zeros((m + 1, 5))
    )
    _follow(plan, tube, limits, period, disturbance, start, kind, key, run, rows, path, worst)


@kernel
def _follow(
    plan: Plan, tube: Tube, limits: DriveLimits, period: float, disturbance: FloatArray, start: FloatArray, kind: int,
    key: np.uint64, run: int, rows: FloatArray, path: FloatArray, worst: FloatArray,
) -> None:  # fmt: skip
    m, n = len(plan.inputs), max(1, math.ceil(period / STEP - 1e-9))
    h = period / n
    side = 1.0 if uniform(key, run, 0) < 0.5 else -1.0
    pushed, off, u = np.empty(4), np.empty(3), np.empty(2)
    for i in range(3):
        off[i] = start[i] * (2.0 * uniform(key, run, 3 + i) - 1.0)
        if kind == 6:
            off[i] = math.copysign(start[i], rows[0, i])
        elif kind >= 1:
            off[i] = math.copysign(start[i], off[i])
    x, y, t = plan.states[0, 0] + off[0], plan.states[0, 1] + off[1], plan.states[0, 2] + off[2]
    v, w = plan.velocities[0, 0], plan.velocities[0, 1]
    path[0, 0], path[0, 1], path[0, 2], path[0, 3], path[0, 4] = x, y, t, v, w
    for j in range(m):
        theta = plan.states[j, 2]
        off[0], off[1], off[2] = x - plan.states[j, 0], y - plan.states[j, 1], wrap(t - theta)
        for i in range(2):
            u[i] = 0.0
        for i in range(3):
            misread = start[i] * (2.0 * uniform(key, run, 16 * j + 16 + i) - 1.0)
            if kind >= 1:
                misread = math.copysign(start[i], misread)
            if kind == 6:
                misread = math.copysign(
                    start[i], rows[j, 3] * tube.gains[j, 0, i] + rows[j, 4] * tube.gains[j, 1, i]
                )  # fmt: skip
            for r in range(2):
                u[r] += tube.gains[j, r, i] * (off[i] + misread)
        for r in range(2):
            if abs(u[r]) > 1e-12:
                worst[4 + r] = max(worst[4 + r], abs(u[r]) / (tube.margin[j, r] + 1e-12))
            u[r] += plan.commands[j, r]

        angle, radius = 2.0 * math.pi * uniform(key, run, 16 * j + 20), disturbance[0]
        for i in range(1, 4):
            pushed[i] = disturbance[i] * (2.0 * uniform(key, run, 16 * j + 20 + i) - 1.0)
            if kind >= 1:
                pushed[i] = math.copysign(disturbance[i], pushed[i])
        if kind == 0:
            radius *= math.sqrt(uniform(key, run, 16 * j + 24))
        elif kind == 6:
            angle = math.atan2(rows[j + 1, 1], rows[j + 1, 0])
            pushed[1] = math.copysign(disturbance[1], rows[j + 1, 2])
            pushed[2], pushed[3] = math.copysign(disturbance[2], rows[j, 3]), math.copysign(disturbance[3], rows[j, 4])
        elif kind >= 2:
            now = side * (-1.0 if kind == 4 and j % 2 else 1.0)
            angle = theta + 0.5 * math.pi * now
            back = -1.0 if kind == 3 else 1.0
            pushed[1], pushed[2], pushed[3] = now * disturbance[1] * back, now * disturbance[2], now * disturbance[3]
            if kind == 5:
                angle = math.atan2(off[1], off[0])
                across = math.cos(theta) * off[1] - math.sin(theta) * off[0]
                pushed[1] = math.copysign(disturbance[1], across * plan.inputs[j, 0])
        if u[0] == 0.0 and u[1] == 0.0 and v == 0.0 and w == 0.0 and disturbance[4] == 0.0:
            radius = pushed[1] = pushed[2] = pushed[3] = 0.0

        nx, ny, nt = x, y, t
        goal_v, goal_w = (
            min(max(u[0], limits.v_min), limits.v_max),
            min(max(u[1], -limits.omega_max), limits.omega_max),
        )
        for i in range(n):
            v, mean_v = ramp(v, goal_v, limits.acceleration, limits.deceleration, h)
            w, mean_w = ramp(w, goal_w, limits.angular_acceleration, limits.angular_deceleration, h)
            nx, ny, nt = arc(nx, ny, nt, mean_v + pushed[2], mean_w + pushed[3], h)
            share = (i + 1.0) / n
            x, y = nx + share * radius * math.cos(angle), ny + share * radius * math.sin(angle)
            t = nt + share * pushed[1]
            bx, by, bt = arc(
                plan.states[j, 0], plan.states[j, 1], theta, plan.inputs[j, 0], plan.inputs[j, 1], (i + 1) * h
            )
            apart, turned = math.hypot(x - bx, y - by), abs(wrap(t - bt))
            worst[2] = max(worst[2], apart / (tube.around[j] + 1e-12))
            worst[3] = max(worst[3], turned / (tube.turned[j] + 1e-12))
            k = j * n + i + 1
            path[k, 0], path[k, 1], path[k, 2], path[k, 3], path[k, 4] = x, y, t, v, w
        apart = math.hypot(x - plan.states[j + 1, 0], y - plan.states[j + 1, 1])
        worst[0] = max(worst[0], apart / (tube.radius[j + 1] + 1e-12))
        worst[1] = max(worst[1], abs(wrap(t - plan.states[j + 1, 2])) / (tube.heading[j + 1] + 1e-12))
        if j + 1 == m:
            worst[6] = max(worst[6], apart / (tube.radius[m] + 1e-12))

"""Is hp-st's tube true, and how tight? Closed-loop runs at random and by adversaries against its bounds; and what it costs.

Random plans (sharp turns, reverse, stops, ramps, then braking to rest) are followed with the tube's gains by a plant that
knows nothing of the tube: steps of at most 0.01 s, ramps, disturbance on or within its bounds. The adversaries push to one
side, in zigzag, along the error, or as is worst to first order for a chosen step and direction. Printed per base: the
largest share of each bound that was seen (above 100 %: the bound is wrong), and the median of the worst shares of a plan
(tightness). Then: time of a tube, of a certificate, of the search for the longest certified part, with 16 obstacles.

    python benchmarks/certified_tube.py [--plans N] [--runs N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.footprint import Footprint, footprint, gap
from clearway.geometry.frames import compose
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray, Shape
from clearway.geometry.streams import stream, uniform
from clearway.navigators.common.tracking.ancillary import linearise
from clearway.navigators.hp_st.certificate import Rules, Safety, certify, longest_certified, stopped_after
from clearway.navigators.hp_st.sight import Sight, sight_of
from clearway.navigators.hp_st.tube import Plan, Tube, drive, room, tube
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


def stopping(state: FloatArray, commands: FloatArray, limits: DriveLimits, period: float, rest: int) -> Plan:
    """The plan that follows `commands`, brakes as hard as it can, and stands for `rest` periods more."""
    whole = stopped_after(drive(state, commands, limits, period), len(commands), limits, period)
    return drive(state, np.concatenate([whole.commands, np.zeros((rest, 2))]), limits, period)


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


def shares(
    limits: DriveLimits, period: float, disturbance: FloatArray, start: FloatArray, plans: int, runs: int, count: int,
    key: np.uint64,
) -> FloatArray:  # fmt: skip
    """(plans, kinds, 7) worst shares of the bounds over `runs` of each kind along each of `plans` random plans."""
    out, rng = np.zeros((plans, 7, 7)), np.random.default_rng(int(key))
    n = max(1, math.ceil(period / STEP - 1e-9))
    for p in range(plans):
        state = np.array([0.0, 0.0, rng.uniform(0, 6.28), 0.0, 0.0])
        plan = stopping(state, random_commands(limits, count, rng), limits, period, 2)
        about = tube(plan, room(plan, limits), period, disturbance, start, True)
        path = np.empty((len(plan.inputs) * n + 1, 5))
        for kind in range(7):
            for run in range(runs):
                number = (p * 7 + kind) * runs + run
                follow(plan, about, limits, period, disturbance, start, kind, key, number, path, out[p, kind])
    return out


@kernel
def chase(
    path: FloatArray, h: float, body: Footprint, moving_obstacle: FloatArray, rim: float, acceleration: float, speed: float,
    manner: int, key: np.uint64, run: int,
) -> float:  # fmt: skip
    """The least gap [m] while the robot's wheels move to a disc that does what it can to touch it.

    Args:
        path: of `follow`, `h` s apart. moving_obstacle: (4,) x, y, vx, vy at first. rim: its radius, m. acceleration, speed: its
        bounds. manner: 0: straight at the robot; 1: to where it will be soon; 2: any one way; 3: zigzag.
    """
    x, y, vx, vy = moving_obstacle[0], moving_obstacle[1], moving_obstacle[2], moving_obstacle[3]
    any_way = 2.0 * math.pi * uniform(key, run, 11)
    ahead = 1.5 * uniform(key, run, 12)
    least, n = math.inf, len(path)
    for i in range(n):
        if path[i, 3] != 0.0 or path[i, 4] != 0.0:
            g = gap(body.vertices, body.radius, path[i, 0], path[i, 1], path[i, 2], x, y) - rim
            least = min(least, g)
        soon = ahead if manner == 1 else 0.0
        k = min(n - 1, i + int(soon / h))
        dx, dy = path[k, 0] - x - vx * soon, path[k, 1] - y - vy * soon
        if manner == 2:
            dx, dy = math.cos(any_way), math.sin(any_way)
        if manner == 3:
            side = 1.0 if i % 20 < 10 else -1.0
            dx, dy = dx - side * dy, dy + side * dx
        size = math.hypot(dx, dy)
        if size > 0.0:
            nx, ny = vx + acceleration * h * dx / size, vy + acceleration * h * dy / size
            scale = min(1.0, speed / max(math.hypot(nx, ny), 1e-12))
            nx, ny = nx * scale, ny * scale
        else:
            nx, ny = vx, vy
        x, y = x + 0.5 * (vx + nx) * h, y + 0.5 * (vy + ny) * h
        vx, vy = nx, ny
    return least


@kernel
def to_discs(path: FloatArray, body: Footprint, discs: FloatArray) -> float:
    """The least gap [m] along `path` to standing discs (s, 3), at any time."""
    least = math.inf
    for i in range(len(path)):
        for k in range(len(discs)):
            g = gap(body.vertices, body.radius, path[i, 0], path[i, 1], path[i, 2], discs[k, 0], discs[k, 1])
            least = min(least, g - discs[k, 2])
    return least


def scene(rng: np.random.Generator, instants: int, step: float, bounds: tuple[float, float]) -> tuple[Forecast, Any]:
    """Standing and moving obstacles near the origin, and how far off their perceived places and velocities may be.

    `bounds`: of their acceleration [m/s^2] and speed [m/s].
    """
    n, t = 4, np.arange(instants + 1) * step
    direction = rng.uniform(0, 2 * math.pi, n)
    at = (rng.uniform(0.8, 5.0, n) * (np.cos(direction), np.sin(direction))).T
    velocity = rng.uniform(-0.5, 0.5, (n, 2)) * bounds[1]
    off, slip = 0.02, 0.1 * bounds[1]
    centre = np.ascontiguousarray(at[:, None] + velocity[:, None] * t[None, :, None])
    reach = np.ascontiguousarray(np.tile(off + slip * t + 0.5 * bounds[0] * t * t, (n, 1)))
    none, zeros = np.zeros((n, 1, instants + 1, 2)), np.zeros((n, 1, instants + 1))
    still = np.column_stack([rng.uniform(-3, 3, (3, 2)), np.full(3, 0.35)])
    forecast = Forecast(
        step, still, none, zeros, np.ones((n, 1)), np.full(n, 0.35), centre, reach, np.full(n, bounds[1]),
        np.arange(n), np.zeros(n),
    )  # fmt: skip
    return forecast, (at, velocity, off, slip)


def certificates(
    name: str, plans: int, runs: int, shape: Shape | None = None, count: int = 10, beyond: float = 1.0
) -> dict[str, float]:
    """Certified plans of a base are driven, disturbed, among obstacles that are after it: the least gaps ever seen, m.

    Everything happens within the assumed bounds: of the disturbance, the error of perception, the obstacles' speed and
    acceleration, and of what comes from beyond the range of sight at top speed; or at `beyond` times these bounds.
    """
    robot = name.split(",")[0]
    limits, period, body = limits_of(robot), load_robot(robot).period, footprint(shape or load_robot(robot).shape)
    bounds, start = (np.array(a) for a in BASES[name])
    rng, key = np.random.default_rng(7), stream(3, f"certificates {name}")
    sight = sight_of(load_robot(robot), 4.0)
    n = max(1, math.ceil(period / STEP - 1e-9))
    seen = {
        "certified": 0.0,
        "refused": 0.0,
        "standing": math.inf,
        "moving": math.inf,
        "unseen": math.inf,
        "area": math.inf,
    }
    for p in range(plans):
        pursuit = (float(rng.uniform(0.2, 2.0)), float(rng.uniform(0.3, 2.5)))
        forecast, (at, velocity, off, slip) = scene(rng, 12, float(rng.choice((period, 0.2))), pursuit)
        half = rng.uniform(1.0, 4.0)
        rules = Rules(
            pursuit[0] if p % 2 else math.inf, np.array([-half, -half, half, half]),
            sight._replace(range=float(rng.uniform(2.0, 5.0))), pursuit[1],
        )  # fmt: skip
        state = np.array([0.0, 0.0, rng.uniform(0, 6.28), 0.0, 0.0])
        plan = drive(state, random_commands(limits, count, rng), limits, period)
        k, whole, about = longest_certified(plan, body, forecast, rules, Safety(limits, period, bounds, start), True, 1)
        seen["certified" if k > 0 else "refused"] += 1
        if k < 0:
            continue
        path = np.empty((len(whole.inputs) * n + 1, 5))
        for run in range(runs):
            number = p * runs + run
            follow(whole, about, limits, period, beyond * bounds, start, run % 7, key, number, path, np.zeros(7))
            seen["standing"] = min(seen["standing"], to_discs(path, body, forecast.still))
            seen["area"] = min(seen["area"], half - float(np.abs(path[:, :2]).max()))
            for i in range(len(at)):
                shift, slide = rng.normal(size=2), rng.normal(size=2)
                v0 = velocity[i] + slip * slide / np.hypot(*slide)
                v0 *= min(1.0, pursuit[1] / np.hypot(*v0))
                moving_obstacle = np.concatenate([at[i] + off * shift / np.hypot(*shift), v0])
                g = chase(
                    path,
                    period / n,
                    body,
                    moving_obstacle,
                    0.35,
                    *(beyond * np.array(pursuit)),
                    (run + i) % 4,
                    key,
                    number,
                )
                seen["moving"] = min(seen["moving"], g)
            x, y, _ = compose(path[0, :3], np.array([sight.x, sight.y, 0.0]))
            middle = float(path[0, 2]) + sight.middle
            angle = turn_between(middle, math.atan2(path[-1, 1] - y, path[-1, 0] - x))
            if run % 2 or abs(angle) > sight.half:
                angle = rng.uniform(-sight.half, sight.half)
            away = np.array([math.cos(middle + angle), math.sin(middle + angle)])
            rim = np.array([x, y]) + (rules.sight.range + 0.35) * away
            moving_obstacle = np.concatenate([rim, -beyond * rules.unseen * away])
            g = chase(path, period / n, body, moving_obstacle, 0.35, 1e9, beyond * rules.unseen, 0, key, number)
            seen["unseen"] = min(seen["unseen"], g)
    return seen


def crowd(count: int, periods: int, period: float) -> tuple[Forecast, Rules]:
    """Obstacles around the origin, at the rescue cases' speeds, and the rules there."""
    rng = np.random.default_rng(2)
    t = np.arange(periods + 1) * period
    at, velocity = rng.uniform(-4, 4, (count, 2)), rng.normal(0, 0.8, (count, 2))
    centre = np.ascontiguousarray(at[:, None] + velocity[:, None] * t[None, :, None])
    reach = np.ascontiguousarray(np.tile(0.02 + 0.1 * t + 0.9 * t * t, (count, 1)))
    none, zeros = np.zeros((count, 1, periods + 1, 2)), np.zeros((count, 1, periods + 1))
    still = np.column_stack([rng.uniform(-4, 4, (12, 2)), np.full(12, 0.35)])
    still = np.ascontiguousarray(still[np.hypot(still[:, 0], still[:, 1]) > 1.0])
    forecast = Forecast(
        period, still, none, zeros, np.ones((count, 1)), np.full(count, 0.35), centre, reach, np.full(count, 4.4),
        np.arange(count), np.zeros(count),
    )  # fmt: skip
    return forecast, Rules(1.8, np.array([-7.0, -7.0, 7.0, 7.0]), Sight(4.0), 4.4)


def costs(repeats: int) -> dict[str, float]:
    """Microseconds, called from Python, on plans of 20 periods of a base that takes feedback: the worst of 30 plans."""
    limits, period = limits_of("rescue:unlimited"), load_robot("rescue").period
    bounds, start = (np.array(a) for a in BASES["rescue:unlimited"])
    safety = Safety(limits, period, bounds, start)
    body = footprint(load_robot("rescue").shape)
    forecast, rules = crowd(16, 30, period)
    endless = rules._replace(sight=Sight(math.inf))
    worst = {"tube": 0.0, "certificate": 0.0, "longest certified": 0.0}
    rng = np.random.default_rng(1)
    for _ in range(30):
        plan = drive(np.zeros(5), random_commands(limits, 20, rng), limits, period)
        left = room(plan, limits)
        about = tube(plan, left, period, bounds, start, True)
        calls: tuple[tuple[str, Callable[..., Any], tuple[Any, ...]], ...] = (
            ("tube", tube, (plan, left, period, bounds, start, True)),
            ("certificate", certify, (plan, about, period, body, forecast, endless)),
            ("longest certified", longest_certified, (plan, body, forecast, endless, safety, True, 0)),
        )
        for name, call, args in calls:
            times = []
            for _ in range(repeats):
                began = time.perf_counter()
                call(*args)
                times.append((time.perf_counter() - began) * 1e6)
            worst[name] = max(worst[name], min(times))
    return worst


def measure(plans: int, runs: int, count: int = 20) -> list[dict[str, Any]]:
    """One row a base: worst share of each bound, by kind of disturbance too, and the median over plans."""
    rows = []
    for name, (bounds, start) in BASES.items():
        robot = name.split(",")[0]
        found = shares(
            limits_of(robot), load_robot(robot).period, np.array(bounds), np.array(start), plans, runs, count,
            stream(0, name),
        )  # fmt: skip
        rows.append(
            {
                "base": name,
                "rollouts": plans * runs * len(KINDS),
                "worst": dict(zip(NAMES, found.max((0, 1)).tolist(), strict=True)),
                "median": dict(zip(NAMES, np.median(found.max(1), axis=0).tolist(), strict=True)),
                "by kind": dict(zip(KINDS, found[:, :, 6].max(0).tolist(), strict=True)),
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=400, help="random plans per base")
    parser.add_argument("--runs", type=int, default=25, help="runs per plan and kind of disturbance")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a small run")
    options = parser.parse_args()
    plans, runs, repeats = (10, 3, 2) if options.smoke else (options.plans, options.runs, 100)
    rows, spent = measure(plans, runs), costs(repeats)
    proven = {name: certificates(name, plans * (1 if options.smoke else 5), 14) for name in BASES}
    if options.json:
        print(json.dumps({"bases": rows, "certificates": proven, "microseconds": spent}, indent=1))
    else:
        for row in rows:
            print(f"{row['base']}: {row['rollouts']} runs")
            for name in NAMES:
                print(
                    f"  {name:20s} worst seen {100 * row['worst'][name]:6.2f} %  median {100 * row['median'][name]:6.2f} %"
                )
            print(
                "  radius at the end, by kind: " + ", ".join(f"{k} {100 * s:.1f} %" for k, s in row["by kind"].items())
            )
        for name, seen in proven.items():
            gaps = ", ".join(f"{k} {seen[k]:.4f} m" for k in ("standing", "moving", "unseen", "area"))
            print(f"{name}: {seen['certified']:.0f} plans certified, {seen['refused']:.0f} refused; least gaps: {gaps}")
        print("Cost, worst of 30 plans of 20 periods: " + ", ".join(f"{k} {us:.0f} us" for k, us in spent.items()))
    if any(share > 1.0 + 1e-9 for row in rows for share in row["worst"].values()):
        raise SystemExit("a bound was exceeded")
    if any(seen[k] <= 0.0 for seen in proven.values() for k in ("standing", "moving", "unseen", "area")):
        raise SystemExit("a certified plan met something")


if __name__ == "__main__":
    main()

"""Do hp-st's certified plans touch nothing, and what does a certificate cost? Random plans, certified, driven among pursuers.

The longest certified part of each plan, with braking behind it, is followed by a disturbed plant (`tube_followed/plant.py`) among
what stands, obstacles that are after it, and what comes from beyond its sight; all within the bounds that are assumed. Printed
per base: how many plans were certified, and the least gaps ever seen. Then the time of a tube, of a certificate, and of the
search for the longest certified part, with 16 obstacles.

    python benchmarks/certificates.py [--plans N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from tube_followed.plant import BASES, STEP, follow, limits_of, random_commands

from clearway.forecasts.forecast import Forecast
from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.footprint import Footprint, footprint, gap
from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray, Shape
from clearway.geometry.streams import stream, uniform
from clearway.navigators.hp_st.environment.sight import Sight, sight_of
from clearway.navigators.hp_st.guarantee.certificate import Rules, Safety, certify, longest_certified
from clearway.navigators.hp_st.guarantee.tube import drive, room, tube
from clearway.robots import load_robot

RUNS = 14
"""Of each plan: each manner of disturbance twice."""


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=2000, help="random plans per base")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a small run")
    options = parser.parse_args()
    plans, repeats = (10, 2) if options.smoke else (options.plans, 100)
    proven, spent = {name: certificates(name, plans, RUNS) for name in BASES}, costs(repeats)
    if options.json:
        print(json.dumps({"certificates": proven, "microseconds": spent}, indent=1))
    else:
        for name, seen in proven.items():
            gaps = ", ".join(f"{k} {seen[k]:.4f} m" for k in ("standing", "moving", "unseen", "area"))
            print(f"{name}: {seen['certified']:.0f} plans certified, {seen['refused']:.0f} refused; least gaps: {gaps}")
        print("Cost, worst of 30 plans of 20 periods: " + ", ".join(f"{k} {us:.0f} us" for k, us in spent.items()))
    if any(seen[k] <= 0.0 for seen in proven.values() for k in ("standing", "moving", "unseen", "area")):
        raise SystemExit("a certified plan met something")


if __name__ == "__main__":
    main()

"""How much longer the heuristic planner's paths are than the shortest ones, and what both cost.

Length: random scenes of the size and density of cases 1 and 2 (6 + 5 and 8 + 8 discs, all standing still and seen), and
denser ones, between the start and the goal of the rescue cases. Time: scenes of case 2's density in squares that grow
with the number of discs, greedy and exact in turns, in one process; each time is the least of the repeats, the median
is over scenes. Belts: a whole plan with 8 standing and 8 moving obstacles within the perception field.

    python benchmarks/planner.py [--scenes 2000] [--repeats 3] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from clearway.navigators.hp_tmpc.heuristic_planner.belts import plan_reference, predict, reference_speed
from clearway.navigators.hp_tmpc.heuristic_planner.planner import FALLBACK, LIMITED, NO_PATH, UNREACHABLE, plan_path
from clearway.navigators.hp_tmpc.tube_mpc.tube import tightening
from clearway.stand_ins import stand_ins

ANYWHERE = np.array([-math.inf, -math.inf, math.inf, math.inf])
ALL_SEEN = np.array([0.0, 0.0, math.inf])
COUNTS = (8, 16, 64, 256)


def inflated() -> float:
    robot, obstacles, own = stand_ins("robot"), stand_ins("obstacles"), stand_ins("hp-tmpc")
    return float(robot["footprint"]["radius"] + obstacles["radius"] + own["safe_margin"])


def scene(rng: np.random.Generator, count: int, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Start, goal, discs (count, 3) in a square of `size`, none over start or goal; bodies may overlap, as a crowd of
    moving ones' predictions does."""
    edge, radius = stand_ins("obstacles")["region"][0], inflated()
    start, goal = np.full(2, 1.75), np.full(2, size - 1.75)
    discs = np.empty((count, 3))
    for i in range(count):
        while True:
            x, y = rng.uniform(edge, size - edge, 2)
            if min(math.hypot(x - start[0], y - start[1]), math.hypot(x - goal[0], y - goal[1])) > radius:
                break
        discs[i] = x, y, radius
    return start, goal, discs


def lengths(count: int, scenes: int) -> dict[str, float]:
    """Of the greedy path over the shortest, where a straight line does not do."""
    rng = np.random.default_rng(count)
    ratios, straight, fallback, shut = [], 0, 0, 0
    for _ in range(scenes):
        start, goal, discs = scene(rng, count, stand_ins("task")["size"])
        draw = rng.uniform()
        greedy = plan_path(start, goal, discs, ANYWHERE, ALL_SEEN, draw, False, 0.0)
        if greedy.status & (NO_PATH | UNREACHABLE):
            shut += 1
        elif greedy.side == 0:
            straight += 1
        else:
            fallback += bool(greedy.status & FALLBACK)
            ratios.append(greedy.length / plan_path(start, goal, discs, ANYWHERE, ALL_SEEN, draw, True, 0.0).length)
    over = 100 * (np.array(ratios) - 1)
    return {
        "obstacles": count, "paths": len(over), "straight": straight, "shut off": shut, "fallback": fallback,
        "mean": float(over.mean()), "p95": float(np.percentile(over, 95)), "p99": float(np.percentile(over, 99)),
        "max": float(over.max()), "shortest found": float(100 * (over < 1e-7).mean()), "min": float(over.min()),
    }  # fmt: skip


def least(what: Callable[[], Any], repeats: int) -> float:
    """us"""
    best = math.inf
    for _ in range(repeats):
        before = time.perf_counter()
        what()
        best = min(best, time.perf_counter() - before)
    return 1e6 * best


def times(count: int, scenes: int, repeats: int) -> dict[str, float]:
    rng = np.random.default_rng(count)
    size = 3.0 + 11.0 * math.sqrt(count / 16)
    greedy, exact, limited = [], [], 0
    for _ in range(scenes):
        start, goal, discs = scene(rng, count, size)
        for mode, taken in ((False, greedy), (True, exact)):
            taken.append(least(partial(plan_path, start, goal, discs, ANYWHERE, ALL_SEEN, 0.3, mode, 0.0), repeats))
        limited += bool(plan_path(start, goal, discs, ANYWHERE, ALL_SEEN, 0.3, True, 0.0).status & LIMITED)
    return {
        "discs": count, "greedy": float(np.median(greedy)), "greedy p99": float(np.percentile(greedy, 99)),
        "exact": float(np.median(exact)), "exact p99": float(np.percentile(exact, 99)), "limited": limited,
    }  # fmt: skip


def belts(scenes: int, repeats: int) -> dict[str, float]:
    """One whole plan: 8 standing and 8 moving obstacles, N^P and the tube's sums as they ship."""
    rng = np.random.default_rng(0)
    robot = stand_ins("robot")
    own = stand_ins("hp-tmpc") | robot["navigators"]["hp-tmpc"]
    n, c, radius, seen = own["prediction_horizon"], robot["period"], inflated(), robot["camera"]["range"]
    margin = tightening(own["w_rob"], own["xi_rob"], n, 0.0) + tightening(own["w_dyn"], own["xi_dyn"], n, 0.0)
    speed = reference_speed(0.0, robot["drive"]["v_max"], 0.5)
    pose, goal = np.zeros(3), np.array([10.0, 3.0])
    taken: dict[bool, list[float]] = {False: [], True: []}
    rounds = []
    for _ in range(scenes):
        static = np.empty((8, 3))
        for i in range(8):
            while True:
                x, y = rng.uniform(-seen, seen, 2)
                if radius < math.hypot(x, y) < seen:
                    break
            static[i] = x, y, radius
        moving = rng.uniform(-seen, seen, (8, 2))
        predicted = predict(moving, rng.uniform(-1, 1, (8, 2)), np.full(8, radius), np.tile(margin, (8, 1)), c)
        for mode in (False, True):
            arguments = (pose, goal, static, predicted, ANYWHERE, seen, speed, c, n, 0.3, mode, 0.0)
            taken[mode].append(least(partial(plan_reference, *arguments), repeats))
        rounds.append(
            plan_reference(pose, goal, static, predicted, ANYWHERE, seen, speed, c, n, 0.3, False, 0.0).rounds
        )
    return {
        "greedy": float(np.median(taken[False])), "greedy p99": float(np.percentile(taken[False], 99)),
        "exact": float(np.median(taken[True])), "exact p99": float(np.percentile(taken[True], 99)),
        "with belts": float(100 * np.mean(np.array(rounds) > 1)), "most rounds": max(rounds),
    }  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="few scenes: only to see that it runs")
    options = parser.parse_args()
    if options.smoke:
        options.scenes, options.repeats = 60, 1
    few = max(20, options.scenes // 10)
    belts(5, 1)  # compiles
    result = {
        "longer_percent": [lengths(count, options.scenes) for count in (11, 16, 32, 48)],
        "microseconds": [times(count, few, options.repeats) for count in COUNTS],
        "reference_microseconds": belts(few, options.repeats),
    }
    if options.json:
        print(json.dumps(result))
        return 0
    print("How much longer than the shortest path, in %, where discs are in the way (14 m x 14 m):")
    names = ("obstacles", "paths", "straight", "shut off", "fallback", "shortest found", "mean", "p95", "p99", "max")
    print("  " + "".join(f"{name:>15}" for name in names))
    for row in result["longer_percent"]:
        print("  " + "".join(f"{row[name]:>15.4g}" for name in names))
        assert row["min"] > -1e-7, "a heuristic path is shorter than the exact one"
    print("One path, us (x: times that of 8 discs), at the density of case 2:")
    first = result["microseconds"][0]
    for row in result["microseconds"]:
        cells = "   ".join(
            f"{mode} {row[mode]:7.1f} (x {row[mode] / first[mode]:.1f}), p99 {row[mode + ' p99']:7.1f}"
            for mode in ("greedy", "exact")
        )
        print(f"  {row['discs']:>4} discs: {cells}   exact / greedy {row['exact'] / row['greedy']:.2f}"
              f"   limited {row['limited']}")  # fmt: skip
    row = result["reference_microseconds"]
    print(f"One reference with belts, 8 standing + 8 moving, us: greedy {row['greedy']:.1f}, p99 {row['greedy p99']:.1f};"
          f" exact {row['exact']:.1f}, p99 {row['exact p99']:.1f}; belts in {row['with belts']:.0f} % of the scenes,"
          f" at most {row['most rounds']} rounds")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())

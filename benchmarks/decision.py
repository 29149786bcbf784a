"""How long one decision takes: of HP+TMPC (tracker, plan, belts, tightening, tracking problem, ancillary gain) or of HP-ST
(tracker, forecasts, search, tracking problems, certificate).

Obstacles (half of them standing, the others like those of case 2) in the square of the rescue cases, denser the more
there are; the robot perceives them within its 4 m and drives from corner to corner as in a trial. One core, warm. The
time is the thread's own, so that other work on the machine doesn't count; the share of it that the tracker took stands
beside. `obstacles` are in the square, `seen` is how many are perceived on average.

    python benchmarks/decision.py [--navigator hp-tmpc|hp-st] [--decisions N] [--repeats N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from functools import partial
from time import thread_time
from typing import Any

import numpy as np

from clearway.contract import Goal, Navigator, Observation, Obstacles, Sensing, Task
from clearway.geometry.motion import arc
from clearway.geometry.oscillator import trajectory
from clearway.navigators import HpTmpc
from clearway.navigators.hp_st import HpSt
from clearway.perception import make_tracker
from clearway.robots import load_robot

Make = Callable[[], Navigator]


def lines(navigator: str) -> list[tuple[int, str, Make]]:
    """Obstacles, what it is told, and how to make it."""
    if navigator == "hp-st":
        return [(n, g, partial(HpSt, guarantee=g)) for g in HpSt.GUARANTEES for n in (16, 8, 64, 256)]
    grid = [(16, 5), (16, 10), (16, 15), (16, 20), (8, 5), (64, 5), (256, 5)]
    return [(n, f"N^P = {h}", partial(HpTmpc, prediction_horizon=h)) for n, h in grid]


def world(n: int, steps: int, seed: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Positions (n, steps + 1, 2) [m] and radii (n,): 0.35 m, less where they are too many to fit."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(1.5, 12.5, (n, 2))
    tracks = np.repeat(start[:, None], steps + 1, axis=1)
    for i in range(n // 2, n):
        attraction, eta = rng.uniform(1.5, 12.5, 2), rng.uniform()
        stiffness = 0.2 * (1 + 4 * eta) / (2 + math.dist(start[i], attraction))
        tracks[i] = trajectory(start[i], rng.uniform(-0.5, 0.5, 2), attraction, np.full(2, stiffness), 0.15, steps)[
            :, :2
        ]
    return tracks, np.full(n, min(0.35, 1.4 / math.sqrt(n)))


def measure(n: int, make: Make, decisions: int, seed: int) -> tuple[list[float], list[float], float]:
    """Seconds of each decision, of the tracker in it, and how many obstacles were seen on average."""
    robot = load_robot("rescue")
    assert robot.camera is not None
    tracks, radius = world(n, decisions, seed)
    navigator, tracker = make(), make_tracker("difference", robot)
    pose, corners = np.array((1.75, 1.75, 0.8)), [(12.25, 12.25), (1.75, 1.75)]
    task = Task(robot.period, 1.0, pose, area=(0.25, 0.25, 13.75, 13.75))
    navigator.reset(task, robot, np.random.default_rng(seed))
    tracker.reset(task, robot, np.random.default_rng(seed))
    rng, moving = np.random.default_rng(seed + 1), np.arange(n) >= n // 2
    goal, velocity, took, tracked, seen = Goal(np.array((*corners[0], 0.0)), 0.2, math.pi), np.zeros(2), [], [], 0
    for k in range(decisions):
        if math.dist(pose[:2], goal.pose[:2]) < 0.2:
            corners.reverse()
            goal = Goal(np.array((*corners[0], 0.0)), 0.2, math.pi)
        visible = np.flatnonzero(np.hypot(*(tracks[:, k] - pose[:2]).T) - radius <= robot.camera.range)
        m = len(visible)
        seen += m
        noise = np.where(moving[visible], robot.camera.error, 0.0)
        measured = Obstacles(
            tracks[visible, k] + noise[:, None] * rng.uniform(-0.7, 0.7, (m, 2)), np.full((m, 2), np.nan),
            radius[visible], noise, np.full(m, np.inf), visible, moving[visible],
        )  # fmt: skip
        t = k * robot.period
        sensing = Sensing(t, pose, velocity, None, measured, goal, pose)
        began = thread_time()
        obstacles = tracker.update(sensing, pose)
        between = thread_time()
        command = navigator.step(Observation(t, pose, velocity, pose, goal, obstacles=obstacles))
        took.append(thread_time() - began)
        tracked.append(between - began)
        pose = np.array(arc(*pose, command.v, command.omega, robot.period))
        velocity = np.array((command.v, command.omega))
    return took, tracked, seen / decisions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--navigator", choices=("hp-tmpc", "hp-st"), help="both, if not given")
    parser.add_argument("--decisions", type=int, default=2000, help="of each line")
    parser.add_argument("--repeats", type=int, default=3, help="the least of them counts, decision by decision")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a small run")
    options = parser.parse_args()
    decisions, repeats = (60, 1) if options.smoke else (options.decisions, options.repeats)
    rows = []
    for name in (options.navigator,) if options.navigator else ("hp-tmpc", "hp-st"):
        measure(16, lines(name)[0][2], 20, 0)  # compiles
        for n, told, make in lines(name):
            measure(n, make, 5, 0)
            runs = [measure(n, make, decisions, 3) for _ in range(repeats)]
            times = np.min([r[0] for r in runs], axis=0)
            rows.append(
                {
                    "navigator": name,
                    "obstacles": n,
                    "seen": runs[0][2],
                    "options": told,
                    "median": 1e3 * float(np.median(times)),
                    "p99": 1e3 * float(np.quantile(times, 0.99)),
                    "max": 1e3 * float(times.max()),
                    "tracker": 1e3 * float(np.median(np.min([r[1] for r in runs], axis=0))),
                }
            )
    if options.json:
        print(json.dumps(rows, indent=1))
        return
    print("navigator  options   obstacles   seen   median       p99       max   of it tracker (median)")
    for r in rows:
        print(
            f"{r['navigator']:10s} {r['options']:8s} {r['obstacles']:10d} {r['seen']:6.1f} {r['median']:5.3f} ms"
            f" {r['p99']:6.2f} ms {r['max']:6.2f} ms {r['tracker']:15.3f} ms"
        )


if __name__ == "__main__":
    main()

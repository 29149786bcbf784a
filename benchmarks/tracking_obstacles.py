"""How well and how fast the trackers follow obstacles: `kalman` beside `difference` (no memory), in one run.

Three places. Paper B's: a camera and oscillating obstacles (suite `sar-case2`'s rules), a robot that stands. The hospital:
a robot's lidar, AMCL, the moving robot of batch MO, while the robot winds its way along the line. People: the same lidar among
the walkers of the suite `people`, of whom it sees the legs if it looks low.

Printed for each: the root mean square errors of a moving obstacle's place (as the robot sees it: its own is not counted) and velocity, the shares of
errors within the tracker's own bounds, the largest speed that it gives to anything that stands, and the time a period. Ratios are
kalman's over difference's.

    python benchmarks/tracking_obstacles.py [--robot NAME] [--seeds N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from clearway.contract import Goal, Obstacles, Sensing, Task
from clearway.geometry.frames import compose, relative
from clearway.geometry.shapes import FloatArray
from clearway.perception import TRACKERS, make_localiser, make_tracker
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import Selection, load_suite
from clearway.world.behaviours.registry import behaviours_of
from clearway.world.bodies import bodies_of, moving_obstacles_of
from clearway.world.tracks import tracks
from clearway.world.traffic import Traffic
from clearway.world.world import World

GOAL = Goal(np.zeros(3), 0.2, 0.2)
NEAR = 0.6
"""m: a disc so near to where a body truly is belongs to it."""
SETTLED = 1.5
"""s that a tracker is given before its errors count; it counts each obstacle from when it comes into view."""


class Step(NamedTuple):
    """One period: what was sensed, the estimated and the true pose, and the truth about what moves (NaN: absent)."""

    sensing: Sensing
    pose: FloatArray
    true: FloatArray
    position: FloatArray
    velocity: FloatArray


class Figures(NamedTuple):
    """What one tracker did on one series."""

    off: list[float]
    near: list[bool]
    errors: list[float]
    held: list[bool]
    phantom: float
    times: list[float]
    discs: int


def arena(count: int, periods: int, seed: int, robot: Robot) -> list[Step]:
    """Oscillating discs (eqs. 6-7 in closed form) by a camera that sees them all."""
    rng = np.random.default_rng(seed)
    assert robot.camera is not None
    attraction, start = rng.uniform(1.5, 12.5, (2, count, 2))
    first = rng.uniform(-0.5, 0.5, (count, 2))
    stiffness = 0.2 * (1 + 4 * rng.uniform(size=(count, 1))) / (2 + np.linalg.norm(start - attraction, axis=1)[:, None])
    w, steps = np.sqrt(stiffness), []
    for k in range(periods):
        t = k * robot.period
        x = attraction + (start - attraction) * np.cos(w * t) + first / w * np.sin(w * t)
        v = -(start - attraction) * w * np.sin(w * t) + first * np.cos(w * t)
        angle, r = rng.uniform(0, 2 * math.pi, count), robot.camera.error * np.sqrt(rng.uniform(size=count))
        noisy = x + np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
        unknown = np.full(count, np.nan)
        seen = Obstacles(
            noisy, np.full((count, 2), np.nan), np.full(count, 0.35), np.full(count, robot.camera.error), unknown,
            np.arange(count), np.ones(count, dtype=np.bool_),
        )  # fmt: skip
        steps.append(
            Step(Sensing(t, np.zeros(3), np.zeros(2), None, seen, GOAL, np.zeros(3)), np.zeros(3), np.zeros(3), x, v)
        )
    return steps


def winding(scenario: Scenario, robot: Robot, periods: int) -> Iterator[Step]:
    """The robot winds along the line while others move as the test has it."""
    plan = load_floor_plan(scenario.floor_plan)
    legs, bodies, start = (
        [leg.name for leg in scenario.legs],
        bodies_of(plan.fixtures, scenario),
        np.array(scenario.start),
    )
    laid = tracks(moving_obstacles_of(scenario), legs, periods * robot.period, len(scenario.people))
    traffic = Traffic(laid, behaviours_of(scenario, bodies), legs)
    world = World(robot, start, scenario.speed, bodies, traffic, scenario.seed, latency=0.0)
    traffic.start()
    world.begin()
    localiser = make_localiser("amcl", robot)
    localiser.reset(
        Task(robot.period, scenario.speed, start, map=plan.map), robot, np.random.default_rng(scenario.seed)
    )
    before = world.moving_obstacles.copy()
    for k in range(periods):
        t = k * robot.period
        sensing = world.sensing(t, GOAL)
        velocity = (world.moving_obstacles - before)[:, :2] / robot.period
        yield Step(
            sensing, localiser.update(sensing), world.motion[:3].copy(), world.moving_obstacles[:, :2].copy(), velocity
        )
        before = world.moving_obstacles.copy()
        world.send(0.25, 0.6 * math.sin(0.8 * t), t)
        if traffic.decided:
            traffic.see(world.member, t, robot.period, world.rehearse(t))
            traffic.decide_until(t + robot.period)
        driven, touched = world.drive(t)
        if touched is not None:
            return
        world.keep(t, driven)


def follow(name: str, robot: Robot, steps: list[Step], task: Task) -> Figures:
    """Let the tracker `name` see all `steps`."""
    tracker = make_tracker(name, robot)
    tracker.reset(task, robot, np.random.default_rng(0))
    off, close, errors, held, times, phantom, discs = [], [], [], [], [], 0.0, 0
    since = np.full(len(steps[0].position), np.nan)
    for step in steps:
        before = time.perf_counter()
        out = tracker.update(step.sensing, step.pose)
        times.append(time.perf_counter() - before)
        discs = max(discs, len(out))
        free = np.ones(len(out), dtype=np.bool_)
        for i, (x, v) in enumerate(zip(step.position, step.velocity, strict=True)):
            if not (math.isfinite(x[0]) and math.isfinite(v[0])):
                since[i] = np.nan
                continue
            near = np.linalg.norm(out.position - x, axis=1) < NEAR
            free &= np.linalg.norm(out.position - x, axis=1) >= NEAR + 0.4
            told = np.flatnonzero(near & out.moving)
            if not near.any():
                since[i] = np.nan
                continue
            since[i] = step.sensing.t if math.isnan(since[i]) else since[i]
            if step.sensing.t < since[i] + SETTLED:
                continue
            if len(told) == 0:  # taken for something that stands
                errors.append(float(np.linalg.norm(v)))
                held.append(bool(errors[-1] <= out.velocity_error[near].max()))
                continue
            best = told[np.argmin(np.linalg.norm(out.position[told] - x, axis=1))]
            seen = compose(step.true, relative(step.pose, np.append(out.position[best], 0.0)))[:2]
            off.append(float(np.linalg.norm(seen - x)))
            close.append(bool(off[-1] <= out.error[best]))
            errors.append(float(np.linalg.norm(out.velocity[best] - v)))
            held.append(bool(errors[-1] <= out.velocity_error[best]))
        phantom = max(phantom, float(np.linalg.norm(out.velocity[free], axis=1).max(initial=0.0)))
    return Figures(off, close, errors, held, phantom, times, discs)


def table(series: list[list[Step]], robot: Robot, task: list[Task], everything: bool) -> dict[str, dict[str, float]]:
    """Both trackers on the same series; printed by `main`."""
    rows = {}
    for name in sorted(TRACKERS):
        follow(name, robot, series[0][:20], task[0])  # compiles
        found = [follow(name, robot, steps, t) for steps, t in zip(series, task, strict=True)]
        errors = [e for f in found for e in f.errors]
        times = [t for f in found for t in f.times]
        off = [e for f in found for e in f.off]
        rows[name] = {
            "off": math.sqrt(statistics.fmean(e * e for e in off)) if off else math.nan,
            "near": statistics.fmean(n for f in found for n in f.near) if off else math.nan,
            "rmse": math.sqrt(statistics.fmean(e * e for e in errors)) if errors else math.nan,
            "held": statistics.fmean(h for f in found for h in f.held) if errors else math.nan,
            "phantom": math.nan if everything else max(f.phantom for f in found),
            "median": statistics.median(times),
            "p99": float(np.percentile(times, 99)),
            "discs": max(f.discs for f in found),
        }
    rows["ratio"] = {key: rows["kalman"][key] / rows["difference"][key] for key in ("off", "rmse", "median")}
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tiago", help="of the hospital")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="little: only to see that it runs")
    options = parser.parse_args()
    seeds, periods = (1, 40) if options.smoke else (options.seeds, 200)

    rescue, robot = load_robot("rescue"), load_robot(options.robot)
    nothing = Task(rescue.period, 1.0, np.zeros(3))
    places = {}
    for count in (8, 16, 256):
        series = [arena(count, periods, seed, rescue) for seed in range(seeds)]
        places[f"arena, {count} obstacles"] = table(series, rescue, [nothing] * seeds, True)
    for place, suite, batches in (("hospital", "hospital-blind", ("MO",)), ("people", "people", ())):
        scenarios = [
            s for seed in range(seeds)
            for s in load_suite(suite).build(robot, Selection(batches=batches, repetitions=1), seed)
            if s.people or suite != "people"
        ]  # fmt: skip
        scenarios = scenarios[: 2 if options.smoke else None]
        series = [list(winding(s, robot, periods)) for s in scenarios]
        tasks = [
            Task(robot.period, s.speed, np.array(s.start), map=load_floor_plan(s.floor_plan).map) for s in scenarios
        ]
        places[f"{place}, {robot.name}"] = table(series, robot, tasks, False)

    if options.json:
        print(json.dumps(places))
        return 0
    print(
        f"{'place':<22} {'tracker':<11} {'RMSE m':>7} {'in bound':>9} {'RMSE m/s':>9} {'in bound':>9} {'standing':>9} {'median us':>10} {'p99 us':>8} {'discs':>6}"
    )
    for place, rows in places.items():
        for name in sorted(TRACKERS):
            r = rows[name]
            print(
                f"{place:<22} {name:<11} {r['off']:>7.3f} {r['near']:>9.1%} {r['rmse']:>9.3f} {r['held']:>9.1%} {r['phantom']:>9.2f} "
                f"{r['median'] * 1e6:>10.0f} {r['p99'] * 1e6:>8.0f} {r['discs']:>6.0f}"
            )
        print(
            f"{place:<22} {'ratio':<11} {rows['ratio']['off']:>7.2f} {'':>9} {rows['ratio']['rmse']:>9.2f} {'':>9} {'':>9} {rows['ratio']['median']:>10.2f}"
        )
    print("standing: largest speed [m/s] given to a disc that belongs to nothing that moves")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Whether `clearway identify` finds what a robot's file says of its base, and whether its 95 % intervals hold it.

Each robot is driven in the simulated world for about two minutes by steps, ahead, turning, back, at two speeds, in an order of each seed's own,
with its latency, lag and its odometry's noise, and read each 0.03 to 0.07 s, in no step with its commands. From these and the commands alone its
latency, lag and accelerations are found again. The odometry's own scale is left out: a base is told by its odometry, so that an error of 1 % is
one of the accelerations, too, and in no interval. The simulated odometry measures at an instant; a real one averages over a while, half of which
is in the latency.

    python benchmarks/identification.py [--robot NAME ...] [--seeds N] [--json] [--smoke]    # about 10 minutes on one core
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from clearway.contract import Command, Decision, Sensing, Task
from clearway.geometry.shapes import FloatArray
from clearway.identifying import Estimate, Identified, fit, identify
from clearway.robots import Robot, load_robot
from clearway.scenarios.scenario import LegSpec, Scenario
from clearway.world import simulate

ROBOTS = ("hosbot", "tiago", "jackal", "husky", "turtlebot4", "mir100")
STEPS = ((0.8, 0.0), (0.4, 0.0), (-0.8, 0.0), (0.0, 0.8), (0.0, -0.8), (0.0, 0.4), (0.5, 0.5), (0.5, -0.5))
"""Shares of the robot's speed, at most 0.8 m/s, and of its yaw rate, at most 1.2 rad/s; each is followed by standing."""
HOLDS, STANDS, ROUNDS = 2.0, 1.5, 4
"""s, s, and how often all are driven."""


TICK = 0.01
"""s, the period in which it is simulated."""


class Joystick:
    """Drives by a list of steps, and keeps what it commanded and sensed."""

    def __init__(self, robot: Robot, seed: int) -> None:
        limits, rng = robot.limits(), np.random.default_rng(seed)
        v, omega = min(0.8, limits.v_max), min(1.2, limits.omega_max)
        shares = [STEPS[i] for _ in range(ROUNDS) for i in rng.permutation(len(STEPS))]
        self.plan = [(a * v if a > 0.0 else a * min(v, -limits.v_min), b * omega) for a, b in shares]
        self.period, self.told, self.sensed = robot.period, list[tuple[float, float, float]](), list[Sensing]()
        self.lasts = len(self.plan) * (HOLDS + STANDS)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, sensing: Sensing) -> Decision:
        t = len(self.sensed) * self.period
        step, within = divmod(t, HOLDS + STANDS)
        v, omega = self.plan[int(step)] if within < HOLDS and step < len(self.plan) else (0.0, 0.0)
        self.sensed.append(sensing)
        self.told.append((t, v, omega))
        return Decision(Command(v, omega), sensing.truth)


def found(robot: Robot, seed: int) -> Identified:
    """What is identified of the robot, driven so."""
    right = robot.odometry.model_copy(update={"scale": 0.0, "turn_scale": 0.0, "curvature": 0.0})
    robot = robot.model_copy(update={"period": TICK, "odometry": right, "lidar": None})
    pilot = Joystick(robot, seed)
    leg = LegSpec(name="steps", goal=(90.0, 0.0, 0.0), yaw_tolerance=math.inf, time_limit=pilot.lasts)
    scenario = Scenario(
        name="steps", floor_plan="arena", start=(7.0, 7.0, 0.0), legs=(leg,), speed=5.0, seed=seed, placement_xy=0.0, placement_yaw=0.0
    )  # fmt: skip
    simulate(scenario, robot, pilot, navigator="joystick", localisation="truth", map=None)
    told = np.array(pilot.told)
    changed = np.flatnonzero(np.diff(told[:, 1:], axis=0, prepend=-1.0).any(axis=1))
    told = told[changed]
    read = np.cumsum(np.random.default_rng(seed).integers(3, 8, len(pilot.sensed) // 7))
    at, first = np.unique([pilot.sensed[i].t for i in read], return_index=True)
    measured = np.array([pilot.sensed[i].odom_velocity[:2] for i in read])[first]
    return identify(told[:, 0].copy(), told[:, 1:].copy(), at, measured)


def judged(robots: tuple[str, ...], seeds: int) -> list[dict[str, Any]]:
    """Of each robot and each of its values, what was found over the seeds."""
    rows = []
    for name in robots:
        robot = load_robot(name)
        limits, every = robot.limits(), [found(robot, 1000 + k) for k in range(seeds)]
        wanted: dict[str, tuple[float, Callable[[Identified], Estimate | None]]] = {
            "latency.command (s)": (robot.latency.command, lambda f: f.latency),
            "drive.lag (s)": (robot.drive.lag, lambda f: f.lag),
            "acceleration (m/s^2)": (limits.acceleration, lambda f: f.answers[0].acceleration),
            "deceleration (m/s^2)": (limits.deceleration, lambda f: f.answers[0].deceleration),
            "angular acceleration (rad/s^2)": (limits.angular_acceleration, lambda f: f.answers[1].acceleration),
            "angular deceleration (rad/s^2)": (limits.angular_deceleration, lambda f: f.answers[1].deceleration),
        }
        for what, (true, of) in wanted.items():
            shown = [x for f in every if (x := of(f)) is not None]
            held = sum(x.low <= true <= x.high for x in shown) + (len(every) - len(shown)) * (true == 0.0)
            values: FloatArray = np.array([x.value for x in shown])
            rows.append({
                "robot": name, "what": what, "file": true, "shown": len(shown), "of": len(every), "held": held,
                "median": float(np.median(values)) if len(values) else None,
                "least": float(values.min()) if len(values) else None, "most": float(values.max()) if len(values) else None,
            })  # fmt: skip
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", action="append", default=[])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one robot, one seed, few draws")
    asked = parser.parse_args()
    if asked.smoke:
        fit.DRAWS = 10
    rows = judged(("hosbot",) if asked.smoke else tuple(asked.robot) or ROBOTS, 1 if asked.smoke else asked.seeds)
    if asked.json:
        print(json.dumps(rows, indent=2))
        return
    print("| robot | | its file | found, median (least to most) | shown in | interval holds it |")
    print("|---|---|---|---|---|---|")
    for r in rows:
        said = "none shows" if r["median"] is None else f"{r['median']:.3g} ({r['least']:.3g} to {r['most']:.3g})"
        print(
            f"| {r['robot']} | {r['what']} | {r['file']:g} | {said} | {r['shown']} of {r['of']} | {r['held']} of {r['of']} |"
        )


if __name__ == "__main__":
    main()

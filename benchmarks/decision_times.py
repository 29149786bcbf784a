"""How long a decision of each navigator takes, all in one test: a crossing of the hospital protocol, by lidar and AMCL.

What is timed is `step`, what a navigator makes of an observation: without the world, the localiser and the tracker. The time is the
thread's own, so that other work on the machine doesn't count; a first run of the test compiles, and of those after it the least time counts,
decision by decision, as they are the same. `nav2` is Nav2's own file with MPPI, fitted to the robot, where the robot has no Nav2 file of
its own.

    python benchmarks/decision_times.py [--robot hosbot] [--navigator NAME]... [--repeats 3] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
from time import thread_time
from typing import Any

import numpy as np

import clearway
from clearway.contract import Command, Observation
from clearway.navigators.registry import drives_of, navigator_class, navigator_names
from clearway.robots import load_robot

SCENARIO = "MO-crossing-v0.6-o0.6-r1"


def timed(name: str, times: list[float]) -> type:
    """The navigator's class, whose every decision adds its seconds to `times`."""
    base: Any = navigator_class(name)

    class Timed(base):  # type: ignore[misc]
        def step(self, observation: Observation) -> Command:
            begin = thread_time()
            try:
                found: Command = super().step(observation)
            finally:
                times.append(thread_time() - begin)
            return found

    return Timed


def measure(robot: str, name: str, repeats: int) -> dict[str, Any]:
    """What the decisions of one trial took."""
    times: list[float] = []
    navigator = timed(name, times)
    runs = []
    for _ in range(1 + repeats):
        times.clear()
        trial = clearway.simulate("hospital", robot, navigator, name=SCENARIO)
        runs.append(1e3 * np.array(times))
    t = np.min(runs[1:], axis=0)
    return {
        "navigator": name,
        "median": float(np.median(t)),
        "p99": float(np.quantile(t, 0.99)),
        "decisions": len(t),
        "outcome": trial.outcome.value,
    }


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="hosbot")
    parser.add_argument(
        "--navigator", action="append", choices=navigator_names(), help="default: all that drive its kind of base"
    )
    parser.add_argument("--repeats", type=int, default=3, help="the least of them counts, decision by decision")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one navigator: only to see that it runs")
    given = parser.parse_args()
    kind = load_robot(given.robot).drive.kind
    able = [name for name in navigator_names() if kind in drives_of(name, navigator_class(name))]
    names = ["orca"] if given.smoke else given.navigator or able
    found = [measure(given.robot, name, 1 if given.smoke else given.repeats) for name in names]
    if given.json:
        print(json.dumps(found))
        return
    print("| navigator | median (ms) | p99 (ms) | decisions | outcome |")
    print("|---|---|---|---|---|")
    for r in found:
        print(f"| {r['navigator']} | {r['median']:.2f} | {r['p99']:.2f} | {r['decisions']} | {r['outcome']} |")


if __name__ == "__main__":
    main()

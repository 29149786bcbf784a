"""What a control period costs with a ROS 2 stack in lockstep: everything said, a command heard, between two processes over DDS.

The stack is the tests' stand-in for Nav2, which thinks for some microseconds of Python; so this is what DDS, the messages and two
switches of processes cost, and no statement about Nav2. Prints the times of a period and the real-time factor of the trials, which
holds the world too, with what is compiled left out (a first trial that isn't counted).

    python benchmarks/ros2_speed.py [--trials N] [--smoke]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import clearway
from clearway.robots import load_robot

STAND_IN = Path(__file__).parents[1] / "tests" / "live" / "nav2_stand_in.py"
DOMAIN = 20 + os.getpid() % 80


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--smoke", action="store_true", help="one trial: only to see that it runs")
    asked = parser.parse_args()
    stack = subprocess.Popen([sys.executable, str(STAND_IN), str(DOMAIN), "stamped"])
    took, simulated, wall = [], 0.0, 0.0
    try:
        for k in range(1 if asked.smoke else 1 + asked.trials):
            with tempfile.TemporaryDirectory() as folder:
                found = clearway.live_ros2(
                    "hospital", robot="tiago", scenarios=["NO-v0.6-r1"], domain=DOMAIN, stamped=True, patience=5.0,
                    out=Path(folder) / "out",
                )  # fmt: skip
                trial = found.results.trial(0)
            assert trial.outcome == "reached", trial.reason
            if k or asked.smoke:
                took.append(trial.thinking[np.isfinite(trial.thinking)])
                simulated, wall = simulated + float(trial.t[-1]), wall + trial.timing["wall"]
    finally:
        stack.kill()
        stack.wait()
    all_of_them = 1e3 * np.concatenate(took)
    lidar = load_robot("tiago").lidar
    assert lidar is not None
    print(f"a period, {lidar.beams} beams: median {np.median(all_of_them):.2f} ms, 99 % {np.percentile(all_of_them, 99):.2f} ms "
          f"({len(all_of_them)} periods); real-time factor {simulated / wall:.1f}")  # fmt: skip


if __name__ == "__main__":
    main()

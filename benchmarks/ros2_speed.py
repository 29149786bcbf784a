"""What a control period costs with a ROS 2 stack in lockstep: everything said, a command heard, between two processes over DDS or Zenoh.

The stack is the tests' stand-in for Nav2, which thinks for some microseconds of Python; so this is what the middleware, the messages and
two switches of processes cost, and no statement about Nav2. Prints the times of a period and the real-time factor of the trials, which
holds the world too, with what is compiled left out (a first trial that isn't counted). Zenoh's router runs in this process.

    python benchmarks/ros2_speed.py [--rmw zenoh] [--trials N] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import clearway
from clearway.robots import load_robot

STAND_IN = Path(__file__).parents[1] / "tests" / "live" / "nav2_stand_in.py"
DOMAIN = 20 + os.getpid() % 80
ROUTER = f"tcp/127.0.0.1:{17000 + os.getpid() % 10000}"


def begun(at: str) -> Any:
    """A Zenoh router."""
    import zenoh

    config = {"mode": "router", "listen": {"endpoints": [at]}, "scouting": {"multicast": {"enabled": False}}}
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rmw", choices=("cyclonedds", "zenoh"), default="cyclonedds")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--smoke", action="store_true", help="one trial: only to see that it runs")
    asked = parser.parse_args()
    where: dict[str, Any] = {"domain": DOMAIN}
    if asked.rmw == "zenoh":
        where = {"rmw": "zenoh", "router": ROUTER}
        router = begun(ROUTER)
    stack = subprocess.Popen(
        [sys.executable, str(STAND_IN), str(where.get("router", DOMAIN)), "stamped"], stdout=subprocess.PIPE
    )
    took, simulated, wall = [], 0.0, 0.0
    try:
        assert stack.stdout is not None
        stack.stdout.readline()
        for k in range(1 if asked.smoke else 1 + asked.trials):
            with tempfile.TemporaryDirectory() as folder:
                found = clearway.live_ros2(
                    "hospital", robot="tiago", scenarios=["NO-v0.6-r1"], stamped=True, patience=5.0,
                    out=Path(folder) / "out", **where,
                )  # fmt: skip
                trial = found.results.trial(0)
            assert trial.outcome == "reached", trial.reason
            if k or asked.smoke:
                took.append(trial.thinking[np.isfinite(trial.thinking)])
                simulated, wall = simulated + float(trial.t[-1]), wall + trial.timing["wall"]
    finally:
        stack.kill()
        stack.wait()
        if asked.rmw == "zenoh":
            router.close()
    all_of_them = 1e3 * np.concatenate(took)
    lidar = load_robot("tiago").lidar
    assert lidar is not None
    print(f"a period, {lidar.beams} beams: median {np.median(all_of_them):.2f} ms, 99 % {np.percentile(all_of_them, 99):.2f} ms "
          f"({len(all_of_them)} periods); real-time factor {simulated / wall:.1f}")  # fmt: skip


if __name__ == "__main__":
    main()

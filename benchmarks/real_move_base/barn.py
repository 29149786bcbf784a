"""The real move_base in Clearway's own BARN worlds, over `ros1:` in lockstep, beside Clearway's: the same parameters, seeds and noise.

`build.sh` builds the real one. It is started anew for each world, with the parameters of the robot's file put on the master
as its authors' YAML has them.

    python benchmarks/real_move_base/barn.py BUILT [--worlds 0 60 144] [--repetitions 3] [--real-time] [--out DIR]
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import clearway
from clearway.robots import load_robot

DEADLINE = 0.2
"""s of wall clock that a period's command is waited for; while it plans, the real one gives none."""
LASER = {
    "sensor_frame": "laser", "data_type": "LaserScan", "topic": "/scan", "marking": True, "clearing": True,
    "min_obstacle_height": -2.0, "max_obstacle_height": 2.0,
}  # fmt: skip


def parameters(robot: str) -> dict[str, Any]:
    """What is on the parameter server below `/move_base`: the groups of the robot's file, layers as ROS names them."""
    groups: Mapping[str, Any] = load_robot(robot).navigators["move-base"]
    found: dict[str, Any] = {name: dict(group) for name, group in groups.items()}
    tree = found.pop("move_base") | found
    footprint = [list(corner) for corner in load_robot(robot).planner_footprint.vertices]  # type: ignore[union-attr]
    for name in ("global_costmap", "local_costmap"):
        costmap = tree[name]
        obstacles, inflation = dict(costmap.pop("obstacle_layer")), costmap.pop("inflation_layer")
        layer = obstacles.pop("name", "obstacles")
        tree[name] = costmap | {
            "robot_base_frame": "base_link", "footprint": footprint, "static_map": False,
            "plugins": [
                {"name": layer, "type": "costmap_2d::ObstacleLayer"},
                {"name": "inflater_layer", "type": "costmap_2d::InflationLayer"},
            ],
            layer: {"observation_sources": "scan", "scan": LASER | obstacles},
            "inflater_layer": dict(inflation),
        }  # fmt: skip
    return tree


@contextmanager
def real(built: Path, robot: str, log: Path) -> Iterator[str]:
    """A master and the real move_base with a robot's parameters; the master's address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    uri = f"http://127.0.0.1:{port}"
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS"))}
    environment = kept | {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_HOME": str(log.parent)}
    node = f". '{built}/install_isolated/setup.sh' && exec '{built}/install_isolated/lib/move_base/move_base' __name:=move_base"
    with log.open("ab") as says:
        running = [
            subprocess.Popen(["rosmaster", "--core", "-p", str(port)], env=environment, stdout=says, stderr=says)
        ]
        try:
            master = xmlrpc.client.ServerProxy(uri)
            until = time.monotonic() + 20.0
            while True:
                with suppress(OSError):
                    master.setParam("/clearway", "/use_sim_time", True)
                    break
                if time.monotonic() > until:
                    sys.exit(f"no rosmaster at {uri}; {log} says why")
                time.sleep(0.05)
            master.setParam("/clearway", "/move_base", parameters(robot))  # type: ignore[arg-type]
            running.append(subprocess.Popen(["sh", "-c", node], env=environment, stdout=says, stderr=says))
            yield uri
        finally:
            for process in reversed(running):
                process.terminate()
                try:
                    process.wait(5.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("built", type=Path, help="where build.sh has built it")
    parser.add_argument("--worlds", type=int, nargs="+", default=[0, 60, 144])
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--suite", default="barn-2022")
    parser.add_argument("--robot", default="jackal")
    parser.add_argument(
        "--real-time", action="store_true", help="/clock keeps to the wall clock, and waits for nothing"
    )
    parser.add_argument(
        "--fastest", type=float, default=1000.0, help="times real time that /clock goes at most, in lockstep"
    )
    parser.add_argument("--out", type=Path, help="keep the results there, a directory for each world")
    asked = parser.parse_args()
    if not (asked.built / "install_isolated" / "lib" / "move_base" / "move_base").is_file():
        sys.exit(f"{asked.built}: no move_base is built there; benchmarks/real_move_base/build.sh does it")
    out = asked.out or Path(tempfile.mkdtemp())
    out.mkdir(parents=True, exist_ok=True)
    print("world  who   reached  times of the reached (s); how the others ended", flush=True)
    for world in asked.worlds:
        with real(asked.built.resolve(), asked.robot, out / f"world_{world}.log") as master:
            pace = "lockstep=false" if asked.real_time else f"deadline={DEADLINE},fastest={asked.fastest:g}"
            names = [f"ros1:{master}[{pace},patience=30]", "move-base"]
            results = clearway.run(
                asked.suite, robots=[asked.robot], navigators=names, worlds=[world], repetitions=asked.repetitions,
                workers=1, decision_limit=60.0, out=out / f"world_{world}",
            )  # fmt: skip
        for who, name in zip(("real", "ours"), names, strict=True):
            rows = [row for row in results.trials.to_pylist() if row["navigator"] == name]
            took = sorted(row["CT"] for row in rows if row["outcome"] == "reached")
            other = [row["reason"] or row["outcome"] for row in rows if row["outcome"] != "reached"]
            said = " ".join(f"{t:.1f}" for t in took)
            print(f"{world:5}  {who}  {len(took):3} of {len(rows):2}  {said}; {', '.join(other)}", flush=True)
    print(f"results: {out}")


if __name__ == "__main__":
    main()

"""How fast a robot's full stack is: simulated seconds per second of one core, and where the time goes.

Runs whole trials of the hospital protocol (world with exact contact, lidar, odometry; AMCL; both costmaps, global and
local planner) after one that compiles and warms up, and measures the CPU time of the thread, so that other work on the
machine does not count. `mppi` and `rpp` are `nav2` with Nav2's own file fitted to the robot, with MPPI as it is there (2,000
samples) or Regulated Pure Pursuit with its defaults in its place; `nav2` has the robot's own file.

    python benchmarks/full_stack.py [--robot NAME] [--navigator move-base|nav2|mppi|rpp]... [--batch NO --batch SO] [--speed 0.6]
                                    [--trials N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time
from typing import Any

import yaml

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.navigators.move_base import MoveBase
from clearway.navigators.nav2 import Nav2
from clearway.navigators.nav2.parameters.nav2_parameters import ALL
from clearway.navigators.nav2.presets.preset import fitted
from clearway.perception import make_localiser
from clearway.robots import Robot, load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.world import simulate

AIMS = {"move-base": 100.0, "mppi": 30.0, "rpp": 100.0}
"""Simulated seconds per second that the project aims for, by navigator."""

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def clock(owner: Any, name: str, part: str, spent: dict[str, float]) -> None:
    """Replace the method `name` of `owner` by one that adds its time to `spent[part]`."""
    method: Callable[..., Any] = getattr(owner, name)

    def timed(*args: Any, **kwargs: Any) -> Any:
        begin = thread_time()
        try:
            return method(*args, **kwargs)
        finally:
            spent[part] += thread_time() - begin

    setattr(owner, name, timed)


def make(name: str, robot: Robot, folder: str) -> MoveBase | Nav2:
    """A navigator, its file of parameters in `folder` if it needs one."""
    if name == "move-base":
        return MoveBase()
    if name == "nav2":
        return Nav2()
    tables = fitted(robot).tables
    if name == "rpp":
        server = tables["controller_server"]
        tables = {**tables, "controller_server": server | {"FollowPath": {"plugin": RPP}}}
    return Nav2(params=write_parameters(tables, Path(folder) / f"{name}.yaml"))


def write_parameters(tables: Mapping[str, dict[str, Any]], file: Path) -> str:
    """A file of ROS 2 parameters of what each server is given; its path."""
    nodes = {ALL[server][0]: {"ros__parameters": _plain(table)} for server, table in tables.items()}
    file.write_text(yaml.safe_dump(nodes))
    return str(file)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inside) for key, inside in value.items()}
    return list(value) if isinstance(value, tuple) else value


def timed(navigator: MoveBase | Nav2, spent: dict[str, float]) -> None:
    """Clock the parts of a navigator, each time that it is prepared for a trial."""
    prepare = navigator.reset

    def reset(*args: Any) -> None:
        prepare(*args)
        if isinstance(navigator, MoveBase):
            clock(navigator._local, "update", "local costmap", spent)
            clock(navigator._global, "update", "global costmap", spent)
            clock(navigator._controller, "compute", "local planner", spent)
            clock(navigator._planner, "plan", "global planner", spent)
        else:
            clock(navigator.local_costmap, "update", "local costmap", spent)
            clock(navigator.global_costmap, "update", "global costmap", spent)
            clock(navigator.controller_server, "step", "local planner", spent)
            clock(navigator.planner_server, "think", "global planner", spent)

    navigator.reset = reset  # type: ignore[assignment, method-assign]
    clock(navigator, "step", "navigator", spent)


def measure(robot_name: str, name: str, batches: tuple[str, ...], speed: float, trials: int) -> dict[str, Any]:
    """Run the first `trials` trials of each batch with a navigator and return what they took."""
    robot = load_robot(robot_name)
    suite = load_suite("hospital")
    chosen = []
    for batch in batches:
        chosen += suite.build(robot, Selection(batches=(batch,), speeds=(speed,)), 0)[:trials]
    spent: dict[str, float] = defaultdict(float)
    simulated, periods, total, outcomes = 0.0, 0, 0.0, []

    for i, scenario in enumerate([chosen[0], *chosen]):
        localiser = make_localiser(scenario.localisation, robot)
        with TemporaryDirectory() as folder:
            navigator = make(name, robot, folder)
            timed(navigator, spent)
            clock(localiser, "update", scenario.localisation, spent)
            pilot = compose(navigator, localiser)
            begin = thread_time()
            trial = simulate(
                scenario,
                robot,
                pilot,
                navigator=name,
                localisation=scenario.localisation,
                map=granted_map(None, scenario),
            )
        if i == 0:
            spent.clear()
            continue
        total += thread_time() - begin
        simulated += float(trial.t[-1])
        periods += len(trial.t)
        outcomes.append(trial.outcome.value)
    inner = sum(spent[p] for p in ("local costmap", "global costmap", "local planner", "global planner"))
    rest = spent.pop("navigator")
    parts = dict(spent) | {"rest of the navigator": rest - inner}
    parts["world, recording, glue"] = total - sum(parts.values())
    return {
        "robot": robot_name,
        "navigator": name,
        "trials": len(chosen),
        "outcomes": {o: outcomes.count(o) for o in sorted(set(outcomes))},
        "simulated_s": simulated,
        "cpu_s": total,
        "simulated_s_per_s": simulated / total,
        "aim": AIMS.get(name),
        "ms_per_period": {k: 1e3 * v / periods for k, v in sorted(parts.items(), key=lambda e: -e[1])},
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tiago")
    parser.add_argument("--navigator", action="append", choices=("move-base", "nav2", "mppi", "rpp"), help="move-base")
    parser.add_argument("--batch", action="append", help="of the suite hospital; default: NO, SO, MO, CE")
    parser.add_argument("--speed", type=float, default=0.6, help="set speed, m/s")
    parser.add_argument("--trials", type=int, default=2, help="trials of each batch")
    parser.add_argument("--json", action="store_true")
    parser.add_argument(
        "--smoke", action="store_true", help="one trial each of two navigators: only to see that they run"
    )
    given = parser.parse_args()
    if given.smoke:
        given.batch, given.trials, given.navigator = ["NO"], 1, ["move-base", "rpp"]
    batches = tuple(given.batch or ("NO", "SO", "MO", "CE"))
    found = [measure(given.robot, n, batches, given.speed, given.trials) for n in given.navigator or ["move-base"]]
    if given.json:
        print(json.dumps(found))
        return
    for result in found:
        print(
            f"{result['robot']}, {result['navigator']}: {result['trials']} trials ({result['outcomes']}), "
            f"{result['simulated_s']:.0f} s simulated"
        )
        aim = f" (aim: {result['aim']:.0f})" if result["aim"] else ""
        print(f"{result['simulated_s_per_s']:.0f} simulated seconds per second of one core{aim}")
        for part, ms in result["ms_per_period"].items():
            print(f"  {part:24s} {ms:6.3f} ms per control period")


if __name__ == "__main__":
    main()

"""How fast a robot's full stack is: simulated seconds per second of one core, and where the time goes.

Runs whole trials of the hospital protocol (world with exact contact, lidar, odometry; AMCL; both costmaps, global and
local planner) after one that compiles and warms up, and measures the CPU time of the thread, so that other work on the
machine does not count.

    python benchmarks/full_stack.py [--robot NAME] [--batch NO --batch SO] [--speed 0.6] [--trials N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Callable
from time import thread_time
from typing import Any

AIM = 100.0
"""Simulated seconds per second that the project aims for, on TIAGo."""


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


def measure(robot_name: str, batches: tuple[str, ...], speed: float, trials: int) -> dict[str, Any]:
    """Run the first `trials` trials of each batch and return what they took."""
    from clearway.campaigns.pilot import compose
    from clearway.campaigns.plan import granted_map
    from clearway.navigators.move_base import MoveBase
    from clearway.perception import make_localiser
    from clearway.robots import load_robot
    from clearway.scenarios.suites import Selection, load_suite
    from clearway.world import simulate

    robot = load_robot(robot_name)
    suite = load_suite("hospital")
    chosen = []
    for batch in batches:
        chosen += suite.build(robot, Selection(batches=(batch,), speeds=(speed,)), 0)[:trials]
    spent: dict[str, float] = defaultdict(float)
    simulated, periods, total, outcomes = 0.0, 0, 0.0, []

    for i, scenario in enumerate([chosen[0], *chosen]):
        navigator, localiser = MoveBase(), make_localiser(scenario.localisation, robot)
        prepare = navigator.reset

        def reset(*args: Any, navigator: MoveBase = navigator, prepare: Callable[..., Any] = prepare) -> None:
            prepare(*args)
            clock(navigator._local, "update", "local costmap", spent)
            clock(navigator._global, "update", "global costmap", spent)
            clock(navigator._controller, "compute", "local planner", spent)
            clock(navigator._planner, "plan", "global planner", spent)

        navigator.reset = reset  # type: ignore[method-assign]
        clock(navigator, "step", "navigator", spent)
        clock(localiser, "update", scenario.localisation, spent)
        pilot = compose(navigator, localiser, scenario.localisation)
        begin = thread_time()
        trial = simulate(
            scenario,
            robot,
            pilot,
            navigator="move-base",
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
    parts = dict(spent) | {"rest of move_base": rest - inner}
    parts["world, recording, glue"] = total - sum(parts.values())
    return {
        "robot": robot_name,
        "trials": len(chosen),
        "outcomes": {o: outcomes.count(o) for o in sorted(set(outcomes))},
        "simulated_s": simulated,
        "cpu_s": total,
        "simulated_s_per_s": simulated / total,
        "aim": AIM,
        "ms_per_period": {k: 1e3 * v / periods for k, v in sorted(parts.items(), key=lambda e: -e[1])},
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tiago")
    parser.add_argument("--batch", action="append", help="of the suite hospital; default: NO, SO, MO, CE")
    parser.add_argument("--speed", type=float, default=0.6, help="set speed, m/s")
    parser.add_argument("--trials", type=int, default=2, help="trials of each batch")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one trial: only to see that it runs")
    given = parser.parse_args()
    if given.smoke:
        given.batch, given.trials = ["NO"], 1
    result = measure(given.robot, tuple(given.batch or ("NO", "SO", "MO", "CE")), given.speed, given.trials)
    if given.json:
        print(json.dumps(result))
        return
    print(
        f"{result['robot']}: {result['trials']} trials ({result['outcomes']}), {result['simulated_s']:.0f} s simulated"
    )
    print(f"{result['simulated_s_per_s']:.0f} simulated seconds per second of one core (aim: {AIM:.0f})")
    for part, ms in result["ms_per_period"].items():
        print(f"  {part:24s} {ms:6.3f} ms per control period")


if __name__ == "__main__":
    main()

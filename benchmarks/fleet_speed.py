"""How fast several robots are simulated: TIAGos with their lidars, driven by `orca`, that change places on a circle.

Prints Markdown, a line a number of robots: simulated time until the last trial is over; real-time factor (simulated time over processor
time); processor time for each robot and control period in which it is under way; the real-time factor that this makes with all of them under way,
since who has touched something or is there stops thinking; how many got there. One process; kernels are compiled before.

    python benchmarks/fleet_speed.py [--robots N ...] [--robot NAME] [--navigator NAME] [--smoke]
"""

from __future__ import annotations

import argparse
import time

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.worker import run_trials
from clearway.robots import load_robot
from clearway.scenarios.suite import Selection


def line(robot: str, navigator: str, number: int) -> str:
    """Of one simulation with so many robots."""
    chosen = Selection(batches=("circle",), repetitions=1, team=(robot,) * number)
    plan = CampaignPlan(("meeting-points",), navigators=(navigator,), selection=chosen)
    specs = plan.specs()
    known = check_plan(plan, specs)
    began = time.process_time()
    trials = run_trials(plan, specs, known, raise_errors=True)
    took, simulated = time.process_time() - began, max(float(trial.t[-1]) for trial in trials)
    periods = sum(len(trial.t) for trial in trials)
    together = load_robot(robot).period * periods / (number * took)
    reached = sum(trial.outcome.value == "reached" for trial in trials)
    cells = (
        number,
        f"{simulated:.1f}",
        f"{simulated / took:.1f}",
        f"{1e3 * took / periods:.2f}",
        f"{together:.1f}",
        f"{reached}/{number}",
    )
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 8, 20, 32])
    parser.add_argument("--robot", default="tiago")
    parser.add_argument("--navigator", default="orca")
    parser.add_argument("--smoke", action="store_true", help="two robots only")
    asked = parser.parse_args()
    load_robot(asked.robot)
    line(asked.robot, asked.navigator, 2)
    print(
        "| robots | simulated [s] | real-time factor | a robot's period [ms] | with all under way | reached |\n|---|---|---|---|---|---|"
    )
    for number in [2] if asked.smoke else asked.robots:
        print(line(asked.robot, asked.navigator, number), flush=True)


if __name__ == "__main__":
    main()

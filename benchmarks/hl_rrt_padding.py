"""What HL-RRT*'s padding (how far it keeps from obstacles that it does not predict) and speed do for its success.

On scenarios that the generators of `sar-case1` and `sar-case2` draw from seeds of their own (from 30,000 on; neither the
frozen ones nor those held out), each setting is tried on the same ones.

    python benchmarks/hl_rrt_padding.py [--workers N] [--count N] [--padding P ...] [--speed V ...]   # about 10 minutes
"""

from __future__ import annotations

import argparse
import itertools
import math

import numpy as np
from joblib import Parallel, delayed

from clearway.campaigns.pilot import compose
from clearway.navigators.hl_rrt import HlRrt
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Outcome
from clearway.world import simulate

SUITES = ("sar-case1", "sar-case2")
SEED = 30_000
PADDINGS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)


def attempt(scenario: Scenario, padding: float, speed: float) -> tuple[str, float]:
    """How it ended, and after how long [s]."""
    robot = load_robot("rescue")
    navigator, tracker = HlRrt(padding=padding, speed=speed), make_tracker(scenario.tracking, robot)
    pilot = compose(navigator, make_localiser("truth", robot), tracker=tracker)
    trial = simulate(
        scenario, robot, pilot, navigator="hl-rrt", localisation="truth", map=None, tracking=scenario.tracking
    )
    return str(trial.outcome), float(trial.t[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--count", type=int, default=30, help="scenarios of each suite")
    parser.add_argument("--padding", type=float, nargs="+", default=PADDINGS, help="m")
    parser.add_argument("--speed", type=float, nargs="+", default=(0.5,), help="m/s")
    parser.add_argument("--smoke", action="store_true")
    options = parser.parse_args()
    if options.smoke:
        options.count, options.padding = 1, (0.05,)
    robot, seeds = load_robot("rescue"), (SEED, SEED + options.count)
    drawn = {s: load_suite(s).build(robot, Selection(seeds=seeds), 0) for s in SUITES}
    with Parallel(n_jobs=options.workers) as pool:
        for padding, speed in itertools.product(options.padding, options.speed):
            row, total, times = [], 0, []
            for suite in SUITES:
                ends = pool(delayed(attempt)(scenario, padding, speed) for scenario in drawn[suite])
                reached = [t for outcome, t in ends if outcome == Outcome.REACHED]
                hit = sum(outcome == Outcome.COLLISION for outcome, _ in ends)
                row.append(f"{suite}: {len(reached)}/{len(ends)} reached, {hit} collisions")
                total, times = total + len(reached), times + reached
            mean = float(np.mean(times)) if times else math.nan
            print(
                f"padding {padding:4.2f} m, {speed:4.2f} m/s   {'   '.join(row)}   together {total}, {mean:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()

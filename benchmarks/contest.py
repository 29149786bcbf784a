"""Every navigator in every suite: who arrives how often, and how long a suite takes.

Prints Markdown, a line a suite: of each navigator how many of the tested robots succeed, with the exact 95 % interval in points and
the reports' sign (†, ‡, §) where some of its parameters were chosen on these tests or others of the suite; the seconds that all of
it took; below the table why a navigator can't drive somewhere. Of each suite some scenarios are taken, evenly over all that it has;
every navigator meets the same, with the same seeds. Robots of one scenario are no independent samples: where there are several, the
intervals claim too much.

    python benchmarks/contest.py [--suite NAME ...] [--navigator NAME ...] [--scenarios N] [--out DIR] [--workers N] [--smoke]

With `--out` the campaigns are kept, and a second call goes on where the first one stopped.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import clearway
from clearway.errors import ClearwayError
from clearway.reports import tuning
from clearway.robots import load_robot
from clearway.scenarios.suites import load_suite, suite_names
from clearway.statistics import success_interval

NAVIGATORS = ("hp-st", "hp-tmpc", "hl-rrt", "colregs-apf", "orca", "social-force", "move-base")


def some(suite: str, most: int) -> tuple[str, list[str]]:
    """The robot that drives a suite, and the names of `most` of its scenarios, evenly over all."""
    found = load_suite(suite)
    robot = (found.robots or ("tiago",))[0]
    names = [scenario.name for scenario in found.build(load_robot(robot))]
    count = min(most, len(names))
    return robot, [names[(2 * k + 1) * len(names) // (2 * count)] for k in range(count)]


def cell(suite: str, robot: str, navigator: str, names: list[str], folder: Path, workers: int | None) -> str:
    """How a navigator fares.

    Raises:
        ClearwayError: it can't drive there.
    """
    out = folder / f"{suite}-{navigator}"
    results = clearway.run(
        suite, robots=[robot], navigators=[navigator], scenarios=names, out=out, resume=out.exists(), workers=workers
    )
    rows = results.trials.to_pylist()
    won = sum(bool(row["success"]) for row in rows)
    share = success_interval(won, len(rows))
    return f"{won}/{len(rows)}{tuning.sign(rows)} ({100 * share.low:.0f}-{100 * share.high:.0f})"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", action="append", default=[])
    parser.add_argument("--navigator", action="append", default=[])
    parser.add_argument("--scenarios", type=int, default=5, help="of each suite")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    suites, navigators = asked.suite or suite_names(), asked.navigator or NAVIGATORS
    if asked.smoke:
        suites, navigators, asked.scenarios = ["crowd", "barn"], ["orca", "colregs-apf"], 1
    print(f"| suite | robot | {' | '.join(navigators)} | seconds |\n|{'---|' * (len(navigators) + 3)}")
    unable: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for suite in suites:
            robot, names = some(suite, asked.scenarios)
            before, cells = time.perf_counter(), []
            for navigator in navigators:
                try:
                    cells.append(cell(suite, robot, navigator, names, asked.out or Path(scratch), asked.workers))
                except ClearwayError as error:
                    cells.append("–")
                    unable.setdefault(f"{navigator}: {error.problem}", []).append(suite)
            print(f"| {suite} | {robot} | {' | '.join(cells)} | {time.perf_counter() - before:.0f} |", flush=True)
    for why, where in unable.items():
        print(f"\n– in {', '.join(where)}: {why}")


if __name__ == "__main__":
    main()

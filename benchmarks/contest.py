"""Every navigator in every suite: who arrives how often, who is shown to be worse than the best, and how long a suite takes.

Prints Markdown, a line a suite: of each navigator how many of the tested robots succeed, with the exact 95 % interval in per cent and
the reports' sign (†, ‡, §) where some of its parameters were chosen on these tests or others of the suite; in square brackets how many
say that they have arrived, where that is another number (a tolerance wider than the task's, an estimate beside the truth); ↓ where it
succeeds less often than the best of the line, by McNemar's exact test on the same trials, Holm-adjusted over the whole table; the seconds
that all of it took; below the table why a navigator can't drive somewhere. Of each suite some scenarios are taken, evenly over all that
it has; every navigator meets the same, with the same seeds. Robots of one scenario are no independent samples: where there are several,
intervals and tests claim too much.

    python benchmarks/contest.py [--suite NAME ...] [--navigator NAME ...] [--scenarios N] [--robots N] [--out DIR] [--workers N] [--smoke]

By default all registered navigators but those that are told the future. With `--out` the campaigns are kept, each with its page
(`clearway report DIR/SUITE`), and a second call goes on where the first one stopped.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import clearway
from clearway.campaigns.by_robot import is_by_robot
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import able
from clearway.navigators.registry import navigator_class, navigator_names
from clearway.reports import tuning
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite, suite_names
from clearway.statistics import success_interval
from clearway.statistics.multiple import holm
from clearway.statistics.proportions import mcnemar

Row = dict[str, Any]


def some(suite: str, scenarios: int, robots: int) -> tuple[str, list[str]]:
    """The robot that drives a suite, and the names of `scenarios` at most of its scenarios for `robots` at most, evenly over all."""
    found = load_suite(suite)
    robot = (found.robots or ("tiago",))[0]
    names = [s.name for s in found.build(load_robot(robot)) if len(list(s.tested())) <= robots]
    count = min(scenarios, len(names))
    return robot, [names[(2 * k + 1) * len(names) // (2 * count)] for k in range(count)]


def fought(
    suite: str,
    robot: str,
    navigators: list[str],
    names: list[str],
    folder: Path,
    workers: int | None,
    why: dict[str, str],
) -> dict[str, list[Row]]:
    """The rows of each navigator that can drive there, in the same order; `why` is told of each other one why it can't."""
    out, selection = folder / suite, Selection(scenarios=tuple(names))
    can, unable = able(CampaignPlan((suite,), (robot,), selection=selection), navigators)
    why |= unable
    if not can:
        return {}
    results = clearway.run(
        suite, robots=[robot], navigators=can, scenarios=names, out=out, resume=out.exists(), workers=workers,
    )  # fmt: skip
    found: dict[str, list[Row]] = {}
    for row in results.trials.to_pylist():
        found.setdefault(row["navigator"], []).append(row)
    return found


def cell(rows: list[Row]) -> str:
    """How often a navigator succeeds, and how often it says that it has arrived."""
    won, said = sum(bool(row["success"]) for row in rows), sum(row["outcome"] == "reached" for row in rows)
    share = success_interval(won, len(rows))
    arrivals = f" [{said}]" * (said != won)
    return f"{won}/{len(rows)}{tuning.sign(rows)} ({100 * share.low:.0f}-{100 * share.high:.0f}){arrivals}"


def against_the_best(found: dict[str, list[Row]]) -> dict[str, float]:
    """Of each navigator but the best the probability of its losses if it were as good."""
    if not found:
        return {}
    best = max(found, key=lambda name: sum(bool(row["success"]) for row in found[name]))
    chances = {}
    for name, rows in found.items():
        if name != best:
            pairs = [(bool(a["success"]), bool(b["success"])) for a, b in zip(found[best], rows, strict=True)]
            chances[name] = mcnemar(pairs.count((True, False)), pairs.count((False, True)))
    return chances


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", action="append", default=[])
    parser.add_argument("--navigator", action="append", default=[])
    parser.add_argument("--scenarios", type=int, default=5, help="of each suite")
    parser.add_argument("--robots", type=int, default=1000, help="scenarios of more are left out")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    suites = asked.suite or suite_names()
    named = list(dict.fromkeys(asked.navigator)) or [
        n for n in navigator_names() if not getattr(navigator_class(n), "privileged", False)
    ]
    if asked.smoke:
        suites, named, asked.scenarios = ["sar-case1"], ["orca", "colregs-apf"], 1
    for name in named:
        if not is_by_robot(name):
            navigator_class(name)  # a misspelt one is told before anything runs
    unable: dict[tuple[str, str], list[str]] = {}
    lines: list[tuple[str, str, dict[str, list[Row]], float]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for suite in suites:
            robot, names = some(suite, asked.scenarios, asked.robots)
            before, why = time.perf_counter(), dict[str, str]()
            found = fought(suite, robot, named, names, asked.out or Path(scratch), asked.workers, why)
            lines.append((suite, robot, found, time.perf_counter() - before))
            for one in why.items():
                unable.setdefault(one, []).append(suite)
            print(f"{suite}: {lines[-1][3]:.0f} s", flush=True)
    chances = [(suite, name, p) for suite, _, found, _ in lines for name, p in against_the_best(found).items()]
    worse = {c[:2] for c, p in zip(chances, holm([p for *_, p in chances]), strict=True) if p < 0.05}
    print(f"\n| suite | robot | {' | '.join(named)} | seconds |\n|{'---|' * (len(named) + 3)}")
    for suite, robot, found, seconds in lines:
        cells = [f"{cell(found[n])}{' ↓' * ((suite, n) in worse)}" if n in found else "–" for n in named]
        print(f"| {suite} | {robot} | {' | '.join(cells)} | {seconds:.0f} |")
    for (name, reason), where in unable.items():
        print(f"\n– in {', '.join(where)}: without {name}: {reason}")


if __name__ == "__main__":
    main()

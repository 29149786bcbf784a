"""How many trials `clearway break` takes to the first break, on each suite, beside random search; it may be interrupted at any time.

What is finished stands in `--out`, a line each, and is not run again: the same command goes on, with more repetitions or trials adds
to it, and prints the table of all that is there. A case is a suite and who is to be broken. Each repetition of the search goes on to
its first break, `--most` trials at the latest; random search is one long run, as its trials know nothing of each other, and is printed
with its share of breaks: where it finds one in ten trials, no search can be ten times as fast. How many times fewer trials: 1 over
that share, over the mean of the search (those without a break counted in full, so that it is rather too few), with a 95 % interval by
resampling both. The search's constants were chosen on the cases whose names begin with `tuning`, and on formulas.

    python benchmarks/breaking.py [--only CASE ...] [--method METHOD] [--repetitions N] [--most N] [--random N] [--out FILE] [--workers N]
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.pool import pool
from clearway.scenarios.suite import Selection
from clearway.searching.breaks import bench_of
from clearway.searching.candidates import Bench
from clearway.searching.failures import MOVING, TIMEOUT, failure_named
from clearway.searching.search import FamilySpace, search
from clearway.searching.strategies import METHODS, strategy_named

EXAMPLE = Path(__file__).parents[1] / "examples" / "my_family.toml"
BLOCK = 50
"""Trials of random search that are run and kept at once."""


@dataclass(frozen=True)
class Case:
    """Who is to be broken, where."""

    suite: str
    robot: str
    navigator: str
    failure: str = MOVING
    batches: tuple[str, ...] = ()

    def bench(self, work: object) -> Bench:
        """Where its candidates are tried."""
        chosen = Selection(batches=self.batches)
        plan = CampaignPlan(suites=(self.suite,), robots=(self.robot,), navigators=(self.navigator,), selection=chosen)
        return bench_of(plan, failure_named(self.failure), work)


CASES = {
    "tuning-orca": Case(str(EXAMPLE), "rescue", "orca"),
    "tuning-social-force": Case(str(EXAMPLE), "rescue", "social-force"),
    "example": Case(str(EXAMPLE), "rescue", "colregs-apf"),
    "example-retuned": Case(str(EXAMPLE), "rescue", "colregs-apf-retuned"),
    "example-hp-tmpc": Case(str(EXAMPLE), "rescue", "hp-tmpc"),
    "example-mpc-cbf": Case(str(EXAMPLE), "rescue", "mpc-cbf"),
    "hospital": Case("hospital", "tiago", "move-base", batches=("MO",)),
    "hospital-blind": Case("hospital-blind", "tiago", "move-base", batches=("MO",)),
    "sar-stress": Case("sar-stress", "rescue", "hp-st[guarantee=none]"),
    "sar-stress-passive": Case("sar-stress", "rescue", "hp-st[guarantee=passive]"),
    "sar-case1": Case("sar-case1", "rescue", "hp-st[guarantee=none]"),
    "sar-case2": Case("sar-case2", "rescue", "hp-st[guarantee=none]"),
    "sar-case3": Case("sar-case3", "rescue", "hp-st[guarantee=none]"),
    "sar-confined": Case("sar-confined", "rescue", "hp-st[guarantee=none]"),
    "sar-misspecified": Case("sar-misspecified", "rescue", "hp-st[guarantee=none]"),
    "sar-team": Case("sar-team", "rescue", "hp-st"),
    "people": Case("people", "tiago", "move-base"),
    "replayed": Case("replayed", "tiago", "hp-st"),
    "crowd": Case("crowd", "crowdnav-disc", "hp-st"),
    "meeting-points": Case("meeting-points", "tiago", "move-base"),
    "dynabarn": Case("dynabarn", "jackal:wide", "hp-st"),
    "barn": Case("barn", "jackal", "move-base", TIMEOUT),
    "ward-day": Case("ward-day", "tiago", "move-base"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=list(CASES), help="repeatable; default: all")
    parser.add_argument(
        "--method", choices=[m for m in METHODS if m != "random"], default="screen", help="of the search"
    )
    parser.add_argument("--repetitions", type=int, default=5, help="of the search")
    parser.add_argument("--most", type=int, default=200, help="trials of one of them")
    parser.add_argument("--random", type=int, default=1000, help="trials of random search")
    parser.add_argument("--out", type=Path, default=Path("results/breaking.jsonl"))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--smoke", action="store_true", help="the example, once")
    asked = parser.parse_args()
    if asked.smoke:
        asked.only, asked.repetitions, asked.most, asked.random = ["example"], 1, 30, BLOCK
        asked.out = Path(tempfile.mkdtemp()) / "breaking.jsonl"
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    lines = asked.out.read_text("utf-8").splitlines() if asked.out.exists() else []
    known = [json.loads(line) for line in lines]
    try:
        for name in asked.only or CASES:
            measure(name, asked, known)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on", file=sys.stderr)
    print(table(known))


def measure(name: str, asked: argparse.Namespace, known: list[dict[str, Any]]) -> None:
    """Run what is missing of a case."""
    there = {(k["method"], k["seed"]) for k in known if k["case"] == name and k["most"] in (asked.most, BLOCK)}
    wanted = [(asked.method, seed, asked.most) for seed in range(asked.repetitions)]
    wanted += [("random", seed, BLOCK) for seed in range(asked.random // BLOCK)]
    wanted = [(method, seed, most) for method, seed, most in wanted if (method, seed) not in there]
    if not wanted:
        return
    with tempfile.TemporaryDirectory() as scratch, pool(asked.workers, Path(scratch)) as work:
        bench = CASES[name].bench(work)
        for method, seed, most in wanted:
            began = time.perf_counter()
            strategy = strategy_named(method, FamilySpace(bench), max(1, asked.workers), seed)
            done = search(bench, strategy, most, most if method == "random" else 1, lambda *_: None)
            broken = [k for k, one in enumerate(done, 1) if one.tried.broken]
            trials = broken[0] if broken and method != "random" else len(done)
            breaks = len(broken) if method == "random" else min(1, len(broken))
            found = {"case": name, "method": method, "seed": seed, "most": most, "trials": trials, "breaks": breaks}
            known.append(found)
            with asked.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
            each = (time.perf_counter() - began) / len(done)
            print(
                f"{name} {method} {seed}: {breaks} in {trials} trials, {each:.2f} s a trial",
                file=sys.stderr,
                flush=True,
            )


def table(known: list[dict[str, Any]]) -> str:
    """All that was measured, a row a case."""
    rows = [
        "| case | who | method | trials to the first break, median (least to most) | found one | random: trials that break | times fewer (95 %) |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, method in itertools.product(CASES, METHODS):
        done, chance = ([k for k in known if k["case"] == name and k["method"] == m] for m in (method, "random"))
        if not done or method == "random":
            continue
        trials = np.array([k["trials"] for k in done])
        found = sum(k["breaks"] for k in done)
        n, hits = sum(k["trials"] for k in chance), sum(k["breaks"] for k in chance)
        share = f" ({100 * hits / n:.2g} %)" if n else ""
        rows.append(
            f"| {name} | {CASES[name].navigator}, {CASES[name].failure} | {method} "
            f"| {np.median(trials):.0f} ({trials.min()} to {trials.max()}) "
            f"| {found} of {len(done)} | {hits} of {n:,}{share} | {_fewer(trials, found, n, hits)} |"
        )
    return "\n".join(rows)


def _fewer(trials: np.ndarray, found: int, n: int, hits: int) -> str:
    """How many times as many trials random search takes, with an interval: Jeffreys' posterior of its share, the repetitions resampled."""
    if not found or not n:
        return "–"
    rng = np.random.default_rng(0)
    means = rng.choice(trials, (4000, len(trials))).mean(axis=1)
    low, high = np.quantile(1.0 / rng.beta(hits + 0.5, n - hits + 0.5, 4000) / means, (0.025, 0.975))
    return f"{n / hits / trials.mean():.1f} ({low:.1f} to {high:.1f})" if hits else f"over {low:.1f}"


if __name__ == "__main__":
    main()

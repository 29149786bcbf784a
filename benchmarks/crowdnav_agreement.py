"""How often `orca` on `crowdnav-disc` ends CrowdNav's test cases as CrowdNav's own ORCA robot did, case by case.

What that did in the even cases lies in tests/scenarios/crowdnav, recorded from the authors' code; so every figure is over the 250 even
cases of a batch of the suite `crowd`: how many have the same outcome, how many of those that both reach take the same time, success
with its exact 95 % interval there and here, mean time of those reached. Cases that end otherwise are named.

    python benchmarks/crowdnav_agreement.py [--cases N] [--json] [--smoke]

`--cases`: only the even ones of the first N cases (500). `--smoke`: ten.
"""

from __future__ import annotations

import argparse
import gzip
import json
from collections import defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from clearway.campaigns.pilot import compose
from clearway.navigators.orca import Orca
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.suites import load_suite
from clearway.statistics import success_interval
from clearway.world import simulate

RECORDED = Path(__file__).parents[1] / "tests" / "scenarios" / "crowdnav" / "orca_even_cases.jsonl.gz"


@dataclass(frozen=True, slots=True)
class End:
    """How a case ended.

    Attributes:
        case: Its number.
        theirs: Outcome there.
        ours: Outcome here.
        their_time: s, there.
        our_time: s, here.
    """

    case: int
    theirs: str
    ours: str
    their_time: float
    our_time: float


def ends(cases: int) -> dict[str, list[End]]:
    """How the even ones of the first `cases` ended, by batch."""
    robot, found = load_robot("crowdnav-disc"), defaultdict(list)
    named = {(s.labels.batch, s.labels.configuration): s for s in load_suite("crowd").build(robot)}
    with gzip.open(RECORDED, "rt", encoding="utf-8") as lines:
        rows = [row for row in map(json.loads, lines) if row["case"] < cases]
    for row in rows:
        batch = f"{row['rule'].partition('_')[0]}-{row['robot']}"
        tracker, localiser = make_tracker("difference", robot), make_localiser("truth", robot)
        pilot = compose(Orca(), localiser, tracker=tracker)
        trial = simulate(
            named[batch, f"case-{row['case']}"], robot, pilot, navigator="orca", localisation="truth", raise_errors=True
        )
        found[batch].append(End(row["case"], row["outcome"], trial.outcome.value, row["time"], float(trial.t[-1])))
    return found


def share(outcomes: list[str]) -> str:
    """Success in per cent, with its exact 95 % interval."""
    told = success_interval(outcomes.count("reached"), len(outcomes))
    return f"{100 * told.estimate:.1f} ({100 * told.low:.1f}-{100 * told.high:.1f})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    found = ends(20 if given.smoke else given.cases)
    if given.json:
        print(json.dumps({batch: [asdict(end) for end in some] for batch, some in found.items()}))
        return
    print(
        "| batch | cases | same outcome | same time, of both reached | success there (%) | here (%) | time there (s) | here (s) |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for batch, some in found.items():
        same, both = sum(e.ours == e.theirs for e in some), [e for e in some if e.ours == e.theirs == "reached"]
        timely = sum(abs(e.our_time - e.their_time) < 1e-6 for e in both)
        times = [
            np.mean([time for outcome, time in rows if outcome == "reached"])
            for rows in ([(e.theirs, e.their_time) for e in some], [(e.ours, e.our_time) for e in some])
        ]
        print(
            f"| {batch} | {len(some)} | {100 * same / len(some):.1f} % | {timely} of {len(both)} | {share([e.theirs for e in some])} |"
            f" {share([e.ours for e in some])} | {times[0]:.2f} | {times[1]:.2f} |"
        )
    for batch, some in found.items():
        for e in some:
            if e.ours != e.theirs:
                print(
                    f"{batch}, case {e.case}: {e.theirs} at {e.their_time:g} s there, {e.ours} at {e.our_time:.2f} s here"
                )


if __name__ == "__main__":
    main()

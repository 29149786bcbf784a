"""The clairvoyant's search on the frozen rescue scenarios: how long it takes, and how sharp its limit is.

python benchmarks/oracle.py            # ten scenarios of each case
python benchmarks/oracle.py --smoke    # two of each
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from clearway.clairvoyant.space_time import TARGET, SpaceTimePath, shortest
from clearway.scenarios import sar_rules as rules
from clearway.scenarios.sar import frozen
from clearway.scenarios.sar_draws import CASES, Case, inflated
from clearway.scenarios.sar_rules import Layout


def search(layout: Layout, case: Case) -> SpaceTimePath:
    """The clairvoyant's way, from the same arguments as in the generator."""
    way = shortest(
        rules.START, rules.GOAL, goal_radius=rules.TOLERANCE, v_max=case.speed, static=inflated(layout.static),
        moving=np.ascontiguousarray(layout.motion(case.seconds)[:, :, :2]), radii=np.full(len(layout.start), rules.APART),
        dt=rules.SAMPLE, area=rules.AREA, horizon=case.seconds,
    )  # fmt: skip
    assert way is not None
    return way


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="two scenarios of each case")
    smoke = parser.parse_args().smoke
    cases = frozen()
    began = time.perf_counter()
    search(cases["case 1"][0].layout, CASES["case 1"])
    print(f"first search, with compiling where nothing is cached: {time.perf_counter() - began:.1f} s\n")
    for case in ("case 1", "case 2"):
        spent, errors = [], []
        for drawn in cases[case][: 2 if smoke else None]:
            began = time.perf_counter()
            way = search(drawn.layout, CASES[case])
            spent.append(time.perf_counter() - began)
            errors.append(way.error)
            print(
                f"{case}, {drawn.seed}: time {way.time:7.3f} s (stored {drawn.optimal.time:7.3f} s)  "
                f"path {way.length:7.3f} m  error {100 * way.error:5.3f} %  in {1e3 * spent[-1]:6.1f} ms"
            )
        print(
            f"{case}: median {1e3 * np.median(spent):.1f} ms, worst {1e3 * max(spent):.1f} ms; "
            f"largest error {100 * max(errors):.3f} % (target {100 * TARGET:g} %)\n"
        )


if __name__ == "__main__":
    main()

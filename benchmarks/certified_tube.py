"""Is hp-st's tube true, and how tight? Closed-loop runs at random and by adversaries against its bounds.

Random plans (sharp turns, reverse, stops, ramps, then braking to rest) are followed with the tube's gains by a plant that
knows nothing of the tube (`tube_followed/plant.py`). Printed per base: the largest share of each bound that was seen (above
100 %: the bound is wrong), and the median of the worst shares of a plan (tightness). What is certified of such plans tells
`certificates.py`.

    python benchmarks/certified_tube.py [--plans N] [--runs N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np
from tube_followed.plant import BASES, KINDS, NAMES, STEP, follow, limits_of, random_commands

from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream
from clearway.navigators.hp_st.guarantee.certificate import stopped_after
from clearway.navigators.hp_st.guarantee.tube import Plan, drive, room, tube
from clearway.robots import DriveLimits, load_robot


def stopping(state: FloatArray, commands: FloatArray, limits: DriveLimits, period: float, rest: int) -> Plan:
    """The plan that follows `commands`, brakes as hard as it can, and stands for `rest` periods more."""
    whole = stopped_after(drive(state, commands, limits, period), len(commands), limits, period)
    return drive(state, np.concatenate([whole.commands, np.zeros((rest, 2))]), limits, period)


def shares(
    limits: DriveLimits, period: float, disturbance: FloatArray, start: FloatArray, plans: int, runs: int, count: int,
    key: np.uint64,
) -> FloatArray:  # fmt: skip
    """(plans, kinds, 7) worst shares of the bounds over `runs` of each kind along each of `plans` random plans."""
    out, rng = np.zeros((plans, 7, 7)), np.random.default_rng(int(key))
    n = max(1, math.ceil(period / STEP - 1e-9))
    for p in range(plans):
        state = np.array([0.0, 0.0, rng.uniform(0, 6.28), 0.0, 0.0])
        plan = stopping(state, random_commands(limits, count, rng), limits, period, 2)
        about = tube(plan, room(plan, limits), period, disturbance, start, True)
        path = np.empty((len(plan.inputs) * n + 1, 5))
        for kind in range(7):
            for run in range(runs):
                number = (p * 7 + kind) * runs + run
                follow(plan, about, limits, period, disturbance, start, kind, key, number, path, out[p, kind])
    return out


def measure(plans: int, runs: int, count: int = 20) -> list[dict[str, Any]]:
    """One row a base: worst share of each bound, by kind of disturbance too, and the median over plans."""
    rows = []
    for name, (bounds, start) in BASES.items():
        robot = name.split(",")[0]
        found = shares(
            limits_of(robot), load_robot(robot).period, np.array(bounds), np.array(start), plans, runs, count,
            stream(0, name),
        )  # fmt: skip
        rows.append(
            {
                "base": name,
                "rollouts": plans * runs * len(KINDS),
                "worst": dict(zip(NAMES, found.max((0, 1)).tolist(), strict=True)),
                "median": dict(zip(NAMES, np.median(found.max(1), axis=0).tolist(), strict=True)),
                "by kind": dict(zip(KINDS, found[:, :, 6].max(0).tolist(), strict=True)),
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=400, help="random plans per base")
    parser.add_argument("--runs", type=int, default=25, help="runs per plan and kind of disturbance")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a small run")
    options = parser.parse_args()
    rows = measure(10, 3) if options.smoke else measure(options.plans, options.runs)
    if options.json:
        print(json.dumps(rows, indent=1))
    for row in rows if not options.json else ():
        print(f"{row['base']}: {row['rollouts']} runs")
        for name in NAMES:
            print(
                f"  {name:20s} worst seen {100 * row['worst'][name]:6.2f} %  median {100 * row['median'][name]:6.2f} %"
            )
        print("  radius at the end, by kind: " + ", ".join(f"{k} {100 * s:.1f} %" for k, s in row["by kind"].items()))
    if any(share > 1.0 + 1e-9 for row in rows for share in row["worst"].values()):
        raise SystemExit("a bound was exceeded")


if __name__ == "__main__":
    main()

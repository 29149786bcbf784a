"""Does a longer look ahead or more thinking help HP+TMPC? Success on case 2 by prediction horizon and solver budget.

Paper B's discussion says that both mitigate the failures of case 2, at the cost of time. This prints the success with its
exact 95 % interval for every pair, on scenarios outside the ten frozen ones, and how long a decision takes.

    python benchmarks/horizon_sweep.py [--seeds 1000:1050] [--horizon 5 ...] [--iterations 10 ...] [--smoke]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

HORIZONS, ITERATIONS = (3, 5, 8, 12, 20), (5, 20, 80)


def sweep(seeds: tuple[int, int], horizons: list[int], iterations: list[int], out: Path) -> list[dict[str, Any]]:
    """One row a pair: horizon, iterations a decision, successes, trials, interval and median time of a decision [ms]."""
    import numpy as np

    import clearway
    from clearway.statistics import success_interval

    names = {n: f"hp-tmpc[prediction_horizon={n},control_horizon={n}]" for n in horizons}
    results = clearway.run(
        "sar-case2",
        navigators=list(names.values()),
        setups=[f"{i} iterations" for i in iterations],
        seeds=seeds,
        out=out,
    )
    rows = []
    table = results.trials.to_pylist()
    for n, name in names.items():
        for i in iterations:
            own = [r for r in table if (r["navigator"], r["setup"]) == (name, f"{i} iterations")]
            wins = sum(bool(r["success"]) for r in own)
            rate = success_interval(wins, len(own))
            times = [1e3 * results.trial(r["trial"]).timing["decide_p50"] for r in own]
            rows.append({"horizon": n, "iterations": i, "wins": wins, "trials": len(own), "low": rate.low, "high": rate.high,
                         "ms": float(np.median(times))})  # fmt: skip
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000:1050", help="A:B, drawn by the generator of case 2")
    parser.add_argument("--horizon", type=int, action="append", help="N^P and N^c, periods")
    parser.add_argument("--iterations", type=int, action="append", help="of the interior point, a decision")
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    first, _, end = asked.seeds.partition(":")
    seeds = (1000, 1001) if asked.smoke else (int(first), int(end))
    horizons = asked.horizon or ([5] if asked.smoke else list(HORIZONS))
    iterations = asked.iterations or ([20] if asked.smoke else list(ITERATIONS))
    with tempfile.TemporaryDirectory() as folder:
        rows = sweep(seeds, horizons, iterations, Path(folder) / "sweep")
    print(f"success on case 2, seeds {seeds[0]} to {seeds[1] - 1}, % [exact 95 % interval], median decision")
    print("N^P  " + "  ".join(f"{i:>4} iterations a decision    " for i in iterations))
    for n in horizons:
        cells = [r for r in rows if r["horizon"] == n]
        print(f"{n:>3}  " + "  ".join(
            f"{100 * r['wins'] / r['trials']:5.1f} [{100 * r['low']:5.1f}, {100 * r['high']:5.1f}] {r['ms']:6.2f} ms" for r in cells
        ))  # fmt: skip


if __name__ == "__main__":
    main()

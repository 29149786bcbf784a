"""How hard, and how trivial, the generator's search-and-rescue scenarios are, case by case.

python benchmarks/sar_draws.py                       # seeds 0 to 199 of every case
python benchmarks/sar_draws.py --seeds 0:50 --case "case 2"
python benchmarks/sar_draws.py --smoke               # a few seeds
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.scenarios import sar_rules as rules
from clearway.scenarios.sar_draws import CASES, Case, Drawn, generate, static_path
from clearway.scenarios.suite import seed_range

SHARE = 0.75
"""Of the set speed: so fast a blind robot follows the static way to find out whether anything moving is in it."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:200", metavar="A:B")
    parser.add_argument("--case", action="append", choices=list(CASES), help="repeatable; default: all")
    parser.add_argument("--smoke", action="store_true", help="three seeds of the two literal cases")
    asked = parser.parse_args()
    seeds = range(*seed_range("0:3" if asked.smoke else asked.seeds))
    names = asked.case or (["case 1", "case 2"] if asked.smoke else list(CASES))
    generate(CASES["case 2"], 2**62)  # compiles
    for name in names:
        began = time.perf_counter()
        drawn = [generate(CASES[name], seed) for seed in seeds]
        report(CASES[name], drawn, (time.perf_counter() - began) / len(drawn))


def conflict(layout: rules.Layout, path: FloatArray, speed: float) -> bool:
    """Whether a robot that follows `path` (n, 2) at `speed` [m/s], come what may, hits something that moves."""
    way = rules.length(path)
    moving = layout.motion(way / speed)[:, :, :2]
    p = rules.along(path, speed * rules.SAMPLE * np.arange(len(moving), dtype=np.float64))
    return bool((np.hypot(*(moving - p[:, None]).transpose(2, 0, 1)) < rules.APART).any())


def report(case: Case, drawn: Sequence[Drawn], seconds: float) -> None:
    """Print what the scenarios of one case are like."""
    draws = sum(d.draws for d in drawn)
    refused: Counter[str] = Counter()
    for d in drawn:
        refused.update(d.refused)
    paths = [static_path(d.layout) for d in drawn]
    free = [p is not None and not conflict(d.layout, p, SHARE * case.speed) for d, p in zip(drawn, paths, strict=True)]
    peaks = np.concatenate([np.hypot(*d.layout.motion(120.0)[:, :, 2:].transpose(2, 0, 1)).max(0) for d in drawn])
    leaving = np.concatenate([rules.leavers(d.layout) for d in drawn])
    static = [(rules.length(p) - rules.TOLERANCE) / case.speed for p in paths if p is not None]
    later = np.array([d.optimal.time for d in drawn]) - static
    error = 100 * np.array([d.optimal.error for d in drawn])
    median, p90 = np.quantile(peaks, [0.5, 0.9])
    print(f"{case.name}: {len(drawn)} scenarios, {case.static} static + {case.moving} moving, {seconds:.2f} s each")
    print(f"  draws refused          {100 * (1 - len(drawn) / draws):5.1f} % of {draws}"
          + "".join(f"; {why} {100 * n / draws:.1f} %" for why, n in refused.most_common()))  # fmt: skip
    print(
        f"  no conflict            {100 * np.mean(free):5.1f} % of the scenarios, on the static way at {SHARE * case.speed:g} m/s"
    )
    print(f"  peak speed             {median:5.2f} m/s median, {p90:.2f} m/s p90 of the moving obstacles, within 120 s")
    print(f"  leave the square       {100 * leaving.mean():5.1f} % of the moving obstacles, sooner or later")
    print(f"  the clairvoyant        {100 * np.mean(later < 0.01):5.1f} % of the scenarios as fast as if nothing moved (at"
          f" {case.speed:g} m/s); else {later[later >= 0.01].sum() / max(1, (later >= 0.01).sum()):.2f} s later, {later.max():.2f} s at most")  # fmt: skip
    print(f"  error of its time      {error.max():5.2f} % at most, above 0.5 % in {(error > 0.5).sum()} of {len(drawn)}"
          + "".join(f"; seed {d.seed}: {e:.2f} %" for d, e in zip(drawn, error, strict=True) if e > 0.5))  # fmt: skip


if __name__ == "__main__":
    main()

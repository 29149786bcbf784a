"""Whether what a kernel reads is there: the same trials compiling, from the cache, and with every index checked.

A kernel that reads beyond an array's end, or an element that nothing has written, takes what happens to lie there: other
bits in the process that compiled than in those that load its code. Here each row runs three times in fresh processes:
with an empty cache, with the cache so filled, and compiled anew with Numba's bounds checks. All three must write the same
bytes, and no trial of the third may end in an IndexError.

    python benchmarks/bounds.py [--row NAME ...] [--smoke]
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

_HELD_OUT = {"scenarios": ["MO-crossing-v0.8-o0.4-r1"]}
ROWS: dict[str, tuple[str, dict[str, Any]]] = {
    "polygon": ("hospital-held-out-blind", {"robots": ["hosbot"], "navigators": ["hp-st"], **_HELD_OUT}),
    "polygon, rivals": (
        "hospital-held-out-blind",
        {"robots": ["hosbot"], "navigators": ["hp-tmpc", "hl-rrt", "colregs-apf", "move-base"], **_HELD_OUT},
    ),
    "Nav2": ("hospital-held-out", {"robots": ["hosbot", "tiago"], "navigators": ["nav2"], **_HELD_OUT}),
    "people": (
        "people",
        {
            "robots": ["tiago"],
            "navigators": ["mpc-cbf", "mppi-forecast", "orca", "social-force", "hp-st"],
            "configurations": ["crossing"],
        },
    ),
    "operator": ("hospital-held-out", {"robots": ["hosbot"], "navigators": ["move-base"], **_HELD_OUT}),
    "disc": (
        "sar-stress",
        {
            "navigators": ["hp-st", "hp-st-foresight", "hp-tmpc", "hl-rrt", "colregs-apf", "oracle"],
            "configurations": ["scenario-1"],
        },
    ),
    "lidar": ("sar-stress", {"robots": ["rescue:lidar"], "navigators": ["hp-st"], "configurations": ["scenario-2"]}),
    "BARN": ("barn", {"navigators": ["hp-st", "move-base"], "worlds": [72]}),
}
SMOKE = {"smoke": ("sar-case1", {"navigators": ["colregs-apf"], "configurations": ["scenario-1"]})}


def run(suite: str, options: dict[str, Any], cache: str, checked: bool) -> dict[str, Any]:
    """Run a row in a process of its own; the digest of what it wrote, its trials' outcomes, and how long it took, s.

    Args:
        cache: Folder of what is compiled; empty: the usual one.
        checked: Whether every index is.
    """
    began = time.perf_counter()
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "1" if checked else "0"}
    if cache:
        environment["NUMBA_CACHE_DIR"] = cache
    with tempfile.TemporaryDirectory() as folder:
        asked = json.dumps([suite, options, str(Path(folder) / "results")])
        said = subprocess.DEVNULL
        subprocess.run([sys.executable, __file__, "--here", asked], check=True, env=environment, stdout=said)
        seconds = time.perf_counter() - began
        return {"seconds": seconds, **_written(Path(folder) / "results")}


def _written(results: Path) -> dict[str, Any]:
    """A digest of what doesn't depend on the clock, and the reasons of failed trials."""
    import pyarrow.parquet as pq

    seen = hashlib.sha256()
    files = [results / "trials.parquet", *sorted((results / "trajectories").rglob("*.parquet"))]
    for file in files:
        seen.update(file.read_bytes())
    rows = pq.read_table(results / "trials.parquet").to_pylist()
    return {"digest": seen.hexdigest()[:12], "trials": len(rows), "failed": [r["reason"] for r in rows if r["reason"]]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--row", action="append", choices=list(ROWS), help="only this; may be repeated")
    parser.add_argument("--smoke", action="store_true", help="one trial that needs few kernels, from the usual cache")
    parser.add_argument("--here", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.here:
        import clearway

        suite, options, out = json.loads(asked.here)
        clearway.run(suite, **options, workers=1, decision_limit=None, out=Path(out))
        return
    rows = SMOKE if asked.smoke else {name: ROWS[name] for name in asked.row or ROWS}
    print(f"{'row':16} {'trials':>6} {'compiling':>12} {'loading':>12} {'checked':>12}   seconds")
    bad = 0
    for name, (suite, options) in rows.items():
        with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as other:
            own = "" if asked.smoke else cache  # the one that there is already
            runs = [run(suite, options, *way) for way in ((own, False), (own, False), (other, True))]
        digests, beyond = [r["digest"] for r in runs], [f for f in runs[2]["failed"] if "IndexError" in f]
        wrong = len(set(digests)) > 1 or bool(beyond)
        bad += wrong
        seconds = " ".join(f"{r['seconds']:5.0f}" for r in runs)
        told = "  ".join([*beyond, "DIFFERENT" if len(set(digests)) > 1 else ""])
        print(f"{name:16} {runs[0]['trials']:6d} {' '.join(digests)}   {seconds}   {told}", flush=True)
    if bad:
        sys.exit(f"{bad} of {len(rows)} rows read what isn't there")


if __name__ == "__main__":
    main()

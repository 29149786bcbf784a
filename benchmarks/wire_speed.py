"""What a navigator that is a process costs a step: from the observation to its command, without a world between.

One answers without reading what it is told, which leaves the wire alone: packing, two switches of processes, unpacking. The others are those of
`examples/08_wire`, who read a scan and turn to a goal. Those for which there is no compiler here are named.

    python benchmarks/wire_speed.py [--steps N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from clearway.contract import Goal, Observation, Obstacles, Scan, Task
from clearway.examples_place import examples_folder
from clearway.navigators.registry import make_navigator
from clearway.robots import load_robot

EXAMPLES = examples_folder() / "08_wire"
BEAMS = (180, 720)
PEOPLE = 16
DEAF = r"""
#include <cstdio>
static unsigned char held[1 << 20];
static void say(const char* said, char bytes) { const char length[4] = {0, 0, 0, bytes}; fwrite(length, 1, 4, stdout); fwrite(said, 1, bytes, stdout); fflush(stdout); }
int main() {
  say("\x83\xa4type\xa5hello\xa7version\x01\xa5needs\x92\xa4scan\xa9obstacles", 43);
  while (fread(held, 1, 4, stdin) == 4) {
    const size_t length = held[1] << 16 | held[2] << 8 | held[3];
    if (fread(held, 1, length, stdin) < length || held[7] == 'b') break;  // the first letter of the type
    if (held[7] == 'r') say("\x81\xa4type\xa5ready", 12);
    else say("\x83\xa4type\xa7" "command\xa1v\x01\xa5omega\x01", 24);
  }
}
"""


def built(folder: Path) -> dict[str, str | None]:
    """Name -> address of each planner; None where there is no compiler for it."""
    (folder / "deaf.cpp").write_text(DEAF)
    made: dict[str, str | None] = {}
    for name, words in {
        "answers only (C++)": ["g++", "-O2", "-o", "deaf", "deaf.cpp"],
        "planner.cpp": ["g++", "-O2", "-std=c++17", "-o", "cpp", str(EXAMPLES / "planner.cpp")],
        "planner.rs": ["rustc", "-O", "-o", "rs", str(EXAMPLES / "planner.rs")],
    }.items():
        made[name] = None
        if shutil.which(words[0]):
            subprocess.run(words, cwd=folder, check=True, capture_output=True)
            made[name] = f"exec:{folder / words[words.index('-o') + 1]}"
    return made | {"planner.py (JSON)": f"exec:{sys.executable} {EXAMPLES / 'planner.py'}"}


def observation(k: int, beams: int) -> Observation:
    """One of a lidar and of people."""
    rng = np.random.default_rng([k % 10, beams])
    scan = Scan(rng.uniform(1.0, 20.0, beams), -1.7, 3.4 / beams, 0.05, 25.0, np.zeros(3))
    near, two = np.full(PEOPLE, 0.3), np.zeros((PEOPLE, 2))
    people = Obstacles(two, two, near, near, near, np.arange(PEOPLE), np.ones(PEOPLE, np.bool_))
    return Observation(0.1 * k, np.array([0.0, 0.0, 0.01 * (k % 10)]), np.zeros(2), np.zeros(3), GOAL, scan, people)


GOAL = Goal(np.array([5.0, 1.0, 0.0]), 0.2, math.inf)


def measured(address: str, beams: int, steps: int) -> dict[str, float]:
    """What a step takes, us of wall clock; of its first tenth nothing is counted."""
    made: Any = make_navigator(address)
    made.reset(Task(0.1, 0.6, np.zeros(3)), load_robot("tiago"), np.random.default_rng(0))
    seen, taken = [observation(k, beams) for k in range(10)], np.zeros(steps)
    for k in range(steps):
        before = time.perf_counter()
        made.step(seen[k % 10])
        taken[k] = time.perf_counter() - before
    made.close()
    median, late = np.quantile(1e6 * taken[steps // 10 :], (0.5, 0.99))
    return {"median": float(median), "99 % within": float(late)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    steps = 50 if asked.smoke else asked.steps
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, address in built(Path(folder)).items():
            found[name] = {b: measured(address, b, steps) for b in BEAMS} if address else "no compiler"
    if asked.json:
        print(json.dumps(found, indent=2))
        return
    for name, row in found.items():
        texts = (
            [f"{b} beams {r['median']:7.1f} us (99 % {r['99 % within']:.0f})" for b, r in row.items()]
            if row != "no compiler"
            else [row]
        )
        print(f"{name:20}  {'   '.join(texts)}")


if __name__ == "__main__":
    main()

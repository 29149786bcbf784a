"""How long a newcomer waits: seconds to install from a fresh clone, to compile, and to run.

python benchmarks/first_run.py            # clones, installs into a new environment, runs one trial cold and warm
python benchmarks/first_run.py --smoke    # the warm run only, in this environment
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
TRIAL = [
    "run",
    "hospital",
    "--robot",
    "tiago",
    "--batch",
    "NO",
    "--speed",
    "1.0",
    "--repetitions",
    "1",
    "--workers",
    "1",
]


def timed(what: str, *words: str | Path, folder: Path) -> float:
    """Run a command with nothing of this environment's modules and caches, say how long it took [s], and return that."""
    newcomers = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "NUMBA_CACHE_DIR")}
    began = time.perf_counter()
    subprocess.run(list(map(str, words)), cwd=folder, check=True, stdout=subprocess.DEVNULL, env=newcomers)
    took = time.perf_counter() - began
    print(f"{took:7.1f} s  {what}", flush=True)
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="only the warm run, with what is installed here")
    smoke = parser.parse_args().smoke
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        clearway = Path(sys.executable).with_name("clearway")
        if not smoke:
            timed("clone", "git", "clone", "--quiet", REPOSITORY, place / "clone", folder=place)
            timed("install (with downloads)", "make", "--silent", "install", folder=place / "clone")
            clearway = place / "clone" / ".venv" / "bin" / "clearway"
            cold = timed("first trial: compile, run, report", clearway, *TRIAL, "--out", place / "cold", folder=place)
        warm = timed("the same again, compiled", clearway, *TRIAL, "--out", place / "warm", folder=place)
        if not smoke:
            print(f"{cold - warm:7.1f} s  of the first trial went into compiling")


if __name__ == "__main__":
    main()

"""Trains the learnt navigator that comes with Clearway, `ppo`: proximal policy optimisation on its own worlds.

    python benchmarks/train_ppo.py discs|lidar [--seeds 5] [--first 0] [--minutes M | --steps N] [--workers 2] [--out FOLDER] [--smoke]

Each seed is a training of its own, in a process with one core, for so many minutes of processor time; five of ten minutes by
two workers are over within half an hour. What comes of each is written as FOLDER/TASK-SEED.npz, and beside it TASK-SEED.json: how its success
grew on what it was trained on, and its success in 1,024 drawn cases after it (--episodes 16 in 64 lanes), without noise. `clearway run`
drives by the one for discs as `-n npz:FILE`, by the one for TIAGo's lidar as `-n 'ppo[policy=FILE]'`: the rest of `guiding.py` belongs to it.
Training takes numpy alone; how many steps ten minutes are depends on the machine, so `--steps` stands where the same bits are wanted;
`--steps 0` writes what has learnt nothing.
`ppo/tasks.py` says what is learnt where, `ppo/learner.py` how.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from ppo.learner import Learner, Settings
from ppo.tasks import TASKS, worlds

from clearway.campaigns.worker_process import end_with
from clearway.navigators.learnt.encoding import Acting, Seeing
from clearway.navigators.learnt.policy import write_npz
from clearway.trials import Outcome

HELD = 1_000_000
"""Environments' seeds from here on are of episodes that no training meets."""


def train(name: str, seed: int, minutes: float, steps: int | None, episodes: int, out: Path) -> dict[str, Any]:
    """Train one seed, and write what came of it."""
    settings, rng = Settings(), np.random.default_rng([seed, *name.encode()])
    lanes, task = settings.lanes, TASKS[name]
    learner = Learner(worlds(name, lanes, rng), rng, seed * lanes, settings)
    began, done, curve = time.process_time(), 0, []
    while True:
        spent = (time.process_time() - began) / (60.0 * minutes) if steps is None else done / steps if steps else 1.0
        if spent >= 1.0:
            break
        learner.improve(spent)
        done += lanes * settings.periods
        success = sum(end == Outcome.REACHED for end in learner.ends) / max(len(learner.ends), 1)
        curve.append((done, round(success, 3)))
        if len(curve) % 50 == 0:
            print(f"{name} seed {seed}: {done:,} steps, {100 * success:.1f} % of the last arrived", flush=True)
    seconds = time.process_time() - began
    told = {
        "seed": seed, "steps": done, "minutes": round(seconds / 60.0, 2), "success": learner.success(HELD + seed * lanes, episodes),
        "training": curve[:: max(len(curve) // 100, 1)],
    }  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{name}-{seed}.npz"
    length = f"--steps {steps}" if steps is not None else f"--minutes {minutes:g}"
    about = {"command": f"benchmarks/train_ppo.py {name} --first {seed} --seeds 1 {length}", "steps": done}
    write_npz(file, Seeing(task.beams, task.obstacles), Acting(), learner.perceptron(), about)
    file.with_suffix(".json").write_text(json.dumps(told))
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS], default="discs")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--minutes", type=float, default=10.0, help="of processor time, a seed")
    parser.add_argument("--steps", type=int, help="instead of the minutes; 0: nothing is learnt")
    parser.add_argument(
        "--episodes", type=int, default=16, help="of each of 64 lanes, by which a policy's success is told"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("results/ppo"))
    parser.add_argument("--smoke", action="store_true")
    args = parser.parse_args()
    if args.smoke:
        args.seeds, args.steps, args.workers = 1, 2 * Settings.lanes * Settings.periods, 1
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # one core a training: its processes inherit it
    seeds = range(args.first, args.first + args.seeds)
    with ProcessPoolExecutor(args.workers, get_context("spawn"), end_with, (os.getpid(),)) as pool:
        runs = [
            pool.submit(train, args.task, seed, args.minutes, args.steps, args.episodes, args.out) for seed in seeds
        ]
        for run in runs:
            print(run.result(), flush=True)


if __name__ == "__main__":
    main()

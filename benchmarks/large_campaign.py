"""What do many trials cost beside the trials themselves? Processor time and memory of each phase of a large campaign.

A campaign of short trials (a metre through a square, past one obstacle that is drawn from a seed) is run, its headline
numbers are computed, its report is written: each in a process of its own. Of each phase: processor time of the parent and
of the workers, wall clock, and the peak memory of the largest of these processes. The trials themselves, simulated and
scored, are timed on a sample in one process.

    python benchmarks/large_campaign.py [--trials 10000] [--workers 2] [--out DIR] | --smoke
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import clearway
from clearway.contract import Command, Observation, Task
from clearway.robots import Robot
from clearway.scenarios.scenario import DiscSpec, LabelSpec, LegSpec, ObstacleSpec, Scenario
from clearway.scenarios.suite import Generator, Section, Selection, Suite, draw, scenario_seed

HERE = Path(__file__).resolve()
BATCHES, SPEEDS = ("clear", "beside"), (0.4, 0.8)
A_SEED = len(BATCHES) * len(SPEEDS)
"""Trials of each seed."""
SAMPLE = 200
"""Trials that are timed one by one."""


def place(seed: int) -> float:
    """How far beside the way the obstacle of a seed stands, m: it is touched by a trial in twenty or so."""
    return 0.3 + 1.2 * draw(seed, "aside")


def build(robot: Robot, selection: Selection, seed: int, place: Callable[[int], float | None]) -> list[Scenario]:
    """Each seed's obstacle, met in each batch at each speed; without it where `place` gives none."""
    return [
        scenario(robot, batch, number, speed, seed, place(number))
        for (number,) in calls(selection)
        for batch in BATCHES
        for speed in SPEEDS
    ]


def calls(selection: Selection) -> list[tuple[int]]:
    """The seeds to draw from, only those of the names that are asked for."""
    seeds = range(*(selection.seeds or (0, 1)))
    if not selection.scenarios:
        return [(seed,) for seed in seeds]
    return [(seed,) for seed in sorted({int(name.split("-")[2]) for name in selection.scenarios}) if seed in seeds]


def scenario(robot: Robot, batch: str, number: int, speed: float, seed: int, aside: float | None) -> Scenario:
    """A metre straight on, past a disc that stands `aside` [m] of the way; farther off in the batch `clear`."""
    name = f"{batch}-seed-{number}-v{speed:g}"
    discs = [] if aside is None else [(7.1, 7.0 + aside + (0.5 if batch == "clear" else 0.0), 0.0)]
    return Scenario(
        name=name,
        floor_plan="arena",
        start=(6.5, 7.0, 0.0),
        legs=(LegSpec(name="way", goal=(7.5, 7.0, 0.0), yaw_tolerance=math.inf, time_limit=10.0),),
        speed=speed,
        obstacles=tuple(ObstacleSpec(name="disc", shape=DiscSpec(kind="disc", radius=0.1), pose=at) for at in discs),
        labels=LabelSpec(suite="", batch=batch, configuration=f"seed-{number}", repetition=1),
        localisation="truth",
        tracking="difference",
        placement_xy=0.05,
        seed=scenario_seed(seed, name),
    )


GENERATOR = Generator(calls, place, partial(build, place=lambda seed: None))
SUITE = Suite(
    "large",
    "Many short trials",
    "a metre past one obstacle",
    BATCHES,
    (),
    partial(build, place=GENERATOR),
    robots=("rescue",),
    report=(Section.MANOEUVRING_SPACE,),
    generator=GENERATOR,
)


class Straight:
    """Turns towards the goal and drives there."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.speed = task.speed_limit

    def step(self, observation: Observation) -> Command:
        dx, dy = observation.goal.pose[:2] - observation.pose[:2]
        error = math.remainder(math.atan2(dy, dx) - observation.pose[2], math.tau)
        return Command(min(self.speed, math.hypot(dx, dy)) * max(0.0, math.cos(error)), 2.0 * error)


def campaign(trials: int) -> dict[str, Any]:
    """What `clearway.run` is asked for."""
    return {
        "navigators": [f"{HERE}:Straight"],
        "seeds": (0, -(-trials // A_SEED)),
        "decision_limit": None,
    }


# --- phases, each in a process of its own ----------------------------------------------------------------------------


@dataclass
class Children:
    """Watches the processes that this one has started: their processor time [s] and their largest peak memory [MB]."""

    seconds: dict[int, float] = field(default_factory=dict)
    peak: float = 0.0

    def watch(self) -> None:
        threading.Thread(target=self._run, daemon=True).start()

    def look(self) -> float:
        """Processor time of all of them so far."""
        for status in Path("/proc").glob("[0-9]*/stat"):
            try:
                after = status.read_text().rpartition(")")[2].split()
                if self._ours(int(after[1])):
                    self.seconds[int(status.parent.name)] = (int(after[11]) + int(after[12])) / os.sysconf("SC_CLK_TCK")
                    lines = (status.parent / "status").read_text().splitlines()
                    peaks = [int(line.split()[1]) / 1e3 for line in lines if line.startswith("VmHWM")]
                    self.peak = max(self.peak, *peaks) if peaks else self.peak
            except (OSError, IndexError):
                continue  # it has ended meanwhile
        return sum(self.seconds.values())

    def _ours(self, parent: int) -> bool:
        return parent == os.getpid() or parent in self.seconds

    def _run(self) -> None:
        while True:
            self.look()
            time.sleep(0.5)


class Phases:
    """Notes what each phase took, with the peak memory up to its end."""

    def __init__(self) -> None:
        self.children = Children()
        self.rows: list[dict[str, Any]] = []
        self.children.watch()
        self._last = self._now()

    def end(self, name: str) -> None:
        now = self._now()
        parent, workers, wall = (b - a for a, b in zip(self._last, now, strict=True))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        self.rows.append(
            {"phase": name, "parent": parent, "workers": workers, "wall": wall, "peak": peak,
             "worker": self.children.peak}
        )  # fmt: skip
        self._last = now

    def _now(self) -> tuple[float, float, float]:
        return time.process_time(), self.children.look(), time.monotonic()


def trials_alone(out: Path, trials: int) -> list[dict[str, Any]]:
    """A sample of the trials in this process: simulated, scored, kept."""
    from clearway.campaigns.drawing import drawn
    from clearway.campaigns.plan import CampaignPlan
    from clearway.campaigns.plan_checks import check_plan
    from clearway.campaigns.worker import run_trials
    from clearway.indicators import score_row
    from clearway.trials.store import write_partial

    asked = campaign(min(trials, SAMPLE)) | {"navigators": tuple(campaign(0)["navigators"])}
    plan = CampaignPlan(
        (f"{HERE}:SUITE",),
        navigators=asked["navigators"],
        selection=Selection(seeds=asked["seeds"]),
        decision_limit=None,
    )
    specs = [drawn(plan, spec) for spec in plan.specs()]
    known = check_plan(plan, specs)
    run_trials(plan, specs[:1], known)  # compiles, or loads what is compiled
    (last,) = run_trials(plan, specs[-1:], known)
    write_partial(out, "", specs[-1].index, last, {"id": specs[-1].id} | score_row(last))
    taken = dict.fromkeys(("simulated", "scored", "kept"), 0.0)
    for spec in specs:
        times = [time.process_time()]
        (trial,) = run_trials(plan, [spec], known)
        times.append(time.process_time())
        row = score_row(trial)
        times.append(time.process_time())
        write_partial(out, "", spec.index, trial, {"id": spec.id} | row)
        times.append(time.process_time())
        for name, a, b in zip(taken, times, times[1:], strict=False):
            taken[name] += (b - a) / len(specs)
    return [{"phase": name, "each": seconds} for name, seconds in taken.items()]


def run(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """The campaign, without its report."""
    phases = Phases()

    def progress(done: int, total: int, note: str = "") -> None:
        if not phases.rows:
            phases.end("before the first trial")
        if done == total:
            phases.end("trials run and kept")

    clearway.run(f"{HERE}:SUITE", **campaign(trials), workers=workers, out=out, progress=progress)
    phases.end("assembled")
    return phases.rows


def headline(out: Path) -> list[dict[str, Any]]:
    """What the terminal shows."""
    from clearway.reports.text import beside_published, headline

    phases = Phases()
    results = clearway.open_results(out)
    phases.end("opened")
    assert headline(results.trials)
    beside_published(results)
    phases.end("headline")
    return phases.rows


def report(out: Path) -> list[dict[str, Any]]:
    """The page with its files."""
    phases = Phases()
    clearway.open_results(out).report()
    phases.end("report")
    return phases.rows


def measure(trials: int, workers: int, folder: Path) -> None:
    """Run every phase and print the table."""
    trials = A_SEED * -(-trials // A_SEED)
    out = folder / "results"
    sample = folder / "sample"
    sample.mkdir(parents=True)
    alone = {r["phase"]: r["each"] for r in _phase("alone", sample, trials, workers)}
    rows = [r for phase in ("run", "headline", "report") for r in _phase(phase, out, trials, workers)]
    print(f"{trials} trials, {workers} workers; a trial alone: " + ", ".join(
        f"{name} {1e3 * seconds:.2f} ms" for name, seconds in alone.items()
    ))  # fmt: skip
    print(f"{'phase':26}{'parent, s':>12}{'workers, s':>12}{'wall, s':>10}{'peak, MB':>10}{'a worker, MB':>14}")
    for r in rows:
        print(
            f"{r['phase']:26}{r['parent']:12.1f}{r['workers']:12.1f}{r['wall']:10.1f}{r['peak']:10.0f}{r['worker']:14.0f}"
        )
    total = sum(r["parent"] + r["workers"] for r in rows)
    themselves = trials * (alone["simulated"] + alone["scored"])
    print(
        f"processor time {total:.0f} s, of which the trials themselves {themselves:.0f} s: beyond them {total - themselves:.0f} s"
    )
    page, report = out / "report" / "index.html", out / "report"
    print(
        f"page {page.stat().st_size / 1e6:.1f} MB; report {_megabytes(report):.0f} MB in {_files(report)} files; "
        f"results without it {_megabytes(out) - _megabytes(report):.0f} MB"
    )


def _phase(name: str, out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    command = [
        sys.executable,
        str(HERE),
        "--phase",
        name,
        "--out",
        str(out),
        "--trials",
        str(trials),
        "--workers",
        str(workers),
    ]
    said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    rows: list[dict[str, Any]] = json.loads(said.splitlines()[-1])
    return rows


def _megabytes(folder: Path) -> float:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) / 1e6


def _files(folder: Path) -> int:
    return sum(file.is_file() for file in folder.rglob("*"))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=10_000, help="how many, rounded up to whole seeds")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, help="a directory to keep the campaign in; default: none is kept")
    parser.add_argument("--smoke", action="store_true", help="forty trials")
    parser.add_argument("--phase", choices=["alone", "run", "headline", "report"], help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.phase:
        rows = {
            "alone": lambda: trials_alone(options.out, options.trials),
            "run": lambda: run(options.out, options.trials, options.workers),
            "headline": lambda: headline(options.out),
            "report": lambda: report(options.out),
        }[options.phase]()
        print(json.dumps(rows))
    elif options.out:
        measure(40 if options.smoke else options.trials, options.workers, options.out)
    else:
        with tempfile.TemporaryDirectory() as folder:
            measure(40 if options.smoke else options.trials, options.workers, Path(folder))


if __name__ == "__main__":
    main()

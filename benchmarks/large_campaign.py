"""How many trials can a campaign have? Memory, disk and processor time of each phase of a campaign of the shortest trials there are.

The trials are over at once: their navigator says that it has arrived. A campaign of them is run and stopped shortly before its
end, gone on with, opened, and reported on, each in a process of its own. While trials run: the memory of the parent and of its
largest worker, and the journals. Beside it a journal of `--heads` trials that were never run is read, as resuming does.

    python benchmarks/large_campaign.py [--trials 10000] [--workers 1] [--heads 1000000] [--report] | --smoke
"""

from __future__ import annotations

import argparse
import contextlib
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
from pathlib import Path
from typing import Any

import numpy as np

import clearway
from clearway.campaigns import CampaignInterrupted, run_campaign
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.worker import run_and_keep, run_trials
from clearway.contract import Command, Observation, Task
from clearway.indicators import score_row
from clearway.reports.text import beside_published, headline
from clearway.robots import Robot
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import Selection, Suite, scenario_seed, without_drawing
from clearway.trials import journal
from clearway.trials.store_results import PARTIAL

HERE = Path(__file__).resolve()
A_SEED = 4
"""Trials of each seed."""
SAMPLE = 400
"""Trials that are timed in this process."""
LEFT = 10
"""Trials that are left to do when the campaign is stopped."""


def build(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
    """A step straight on, at each of four speeds, from each seed."""
    return [
        Scenario(
            name=(name := f"step-{number}-v{speed:g}"),
            floor_plan="arena",
            start=(6.5, 7.0, 0.0),
            legs=(LegSpec(name="way", goal=(6.6, 7.0, 0.0), yaw_tolerance=math.inf, time_limit=10.0),),
            speed=speed,
            labels=LabelSpec(suite="", batch="step", configuration=f"seed-{number}", repetition=1),
            localisation="truth",
            tracking="difference",
            seed=scenario_seed(seed, name),
        )
        for number in range(*(selection.seeds or (0, 1)))
        for speed in (0.2, 0.4, 0.6, 0.8)
    ]


SUITE = Suite(
    "scale",
    "Very many very short trials",
    "one step",
    ("step",),
    (),
    build,
    robots=("rescue",),
    generator=without_drawing(build),
)


class There:
    """Has arrived wherever it is."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def step(self, observation: Observation) -> Command:
        return Command(0.0, 0.0, arrived=True)


def plan(trials: int) -> CampaignPlan:
    """The campaign."""
    return CampaignPlan(
        (f"{HERE}:SUITE",),
        navigators=(f"{HERE}:There",),
        selection=Selection(seeds=(0, trials // A_SEED)),
        decision_limit=None,
    )


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


def alone(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """What a trial takes in this process: simulated and scored, and with the journal too."""
    asked, folder = plan(SAMPLE), out.parent / "alone"
    folder.mkdir()
    specs = asked.specs()
    known = check_plan(asked, specs)
    score_row(run_trials(asked, specs[:1], known)[0])  # compiles, or loads what is compiled
    times = [time.process_time()]
    for spec in specs:
        score_row(run_trials(asked, [spec], known)[0])
    times.append(time.process_time())
    for spec in specs:
        run_and_keep(asked, [spec], known, folder, "")
    times.append(time.process_time())
    each = np.diff(times) / len(specs) * 1e3
    return [
        {
            "simulated and scored (ms)": each[0],
            "with the journal (ms)": each[1],
            "journal (kB)": _size(folder) / len(specs) / 1e3,
        }
    ]


def run(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """The campaign but for its last few trials, with what it takes while it runs."""
    phases, rows, began = Phases(), list[dict[str, Any]](), time.monotonic()

    def tell(done: int, total: int, note: str = "") -> None:
        if done >= len(rows) * (total - LEFT) / 10:
            phases.children.look()
            row = {
                "trials": done,
                "after (s)": time.monotonic() - began,
                "parent (MB)": _memory(),
                "largest worker (MB)": phases.children.peak,
            }
            rows.append(row | {"journals (MB)": _size(out / PARTIAL) / 1e6})
        if done >= total - LEFT:
            phases.end("run")
            raise KeyboardInterrupt

    with contextlib.suppress(CampaignInterrupted):
        run_campaign(plan(trials), out, workers, progress=tell)
    took = phases.rows[-1]
    return [
        *rows,
        {
            "parent, a trial (ms)": took["parent"] / trials * 1e3,
            "workers, a trial (ms)": took["workers"] / trials * 1e3,
        },
    ]


def resume(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """Going on: until the first trial is run, and the rest, which puts the files together."""
    phases, begun = Phases(), list[float]()

    def tell(done: int, total: int, note: str = "") -> None:
        if not begun:
            begun.append(time.monotonic())
            phases.end("until the first trial")

    run_campaign(plan(trials), out, workers, resume=True, progress=tell)
    phases.end("put together")
    return _told(phases)


def opened(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """The finished directory: digests, the table, a trial in the middle, and what the terminal shows."""
    phases = Phases()
    results = clearway.open_results(out)
    phases.end("opened")
    assert len(results.trials) == trials
    phases.end("table read")
    results.trial(trials // 2)
    phases.end("a trial read")
    assert headline(results.trials)
    beside_published(results)
    phases.end("headline numbers")
    return _told(phases)


def report(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """The page with its files."""
    phases = Phases()
    clearway.open_results(out).report()
    phases.end("report")
    return [
        _told(phases)[0]
        | {"page (MB)": (out / "report/index.html").stat().st_size / 1e6, "files (MB)": _size(out / "report") / 1e6}
    ]


def heads(out: Path, trials: int, workers: int) -> list[dict[str, Any]]:
    """A journal of as many trials as wanted, read for what it holds. Only the first of its trials is a true one."""
    asked, folder = plan(A_SEED), out.parent / "heads"
    folder.mkdir()
    (spec, *_) = asked.specs()
    run_and_keep(asked, [spec], check_plan(asked, [spec]), folder, "")
    (file,) = folder.glob(journal.JOURNALS)
    body = file.read_bytes()[journal._LONG :]
    with open(file, "wb") as journals:
        for index in range(trials):
            head = journal._HEAD.pack(journal._MARK, journal._owner(""), index, len(body), len(body), bytes(32))
            journals.write(head + journal._CHECK.pack(journal.zlib.crc32(head)) + body)
    phases = Phases()
    assert journal.Journals(folder, "", trials).done() == trials
    phases.end(f"heads of {trials} trials, {_size(folder) / 1e6:.0f} MB")
    return _told(phases)


PHASES: dict[str, Callable[[Path, int, int], list[dict[str, Any]]]] = {
    phase.__name__: phase for phase in (alone, run, resume, opened, report, heads)
}


def _told(phases: Phases) -> list[dict[str, Any]]:
    return [
        {"phase": r["phase"], "wall (s)": r["wall"], "parent (s)": r["parent"], "peak (MB)": r["peak"]}
        for r in phases.rows
    ]


def _memory() -> float:
    """Of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def _show(rows: Sequence[dict[str, Any]]) -> None:
    for i, row in enumerate(rows):
        if i == 0 or row.keys() != rows[i - 1].keys():
            print("\n| " + " | ".join(row) + " |\n" + "|---" * len(row) + "|")
        print(
            "| " + " | ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()) + " |", flush=True
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=10_000, help="how many, rounded down to whole seeds")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--heads", type=int, default=1_000_000, help="trials of the journal that is only read")
    parser.add_argument("--report", action="store_true", help="the report too")
    parser.add_argument("--smoke", action="store_true", help="forty trials")
    parser.add_argument("--phase", choices=PHASES, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    trials, read = (40, 1000) if asked.smoke else (asked.trials // A_SEED * A_SEED, asked.heads)
    if asked.phase:
        print(json.dumps(PHASES[asked.phase](asked.out, asked.trials, asked.workers)))
        return
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "results"
        for phase in PHASES:
            if phase == "report" and not (asked.report or asked.smoke):
                continue
            command = [sys.executable, str(HERE), "--phase", phase, "--out", str(out), "--workers", str(asked.workers)]
            command += ["--trials", str(read if phase == "heads" else trials)]
            _show(
                json.loads(
                    subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()[-1]
                )
            )
            if phase == "opened":
                print(f"\nresults of {trials} trials: {_size(out) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()

"""How long decisions took on the machine that ran the trials, and who couldn't have kept up with its control period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow.compute as pc

from clearway.geometry.shapes import FloatArray
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, text
from clearway.reports.selection import System
from clearway.trials import LATE
from clearway.trials.store import Results

_NAMES = ("decide_count", "decide_p50", "decide_p99", "decide_max", "decide_overrun")


@dataclass(frozen=True, slots=True)
class DecisionTime:
    """How long a system's decisions took: localiser, tracker and navigator together, but for a trial's first.

    Attributes:
        trials: In how many trials it was measured.
        median: Median over the trials of each trial's median, in s.
        p99: Median over the trials of each trial's 99th percentile, in s.
        longest: The longest of all, in s.
        overrun: Share of all decisions that took longer than a control period.
        period: The robot's control period, in s; None: nobody knows.
    """

    trials: int
    median: float
    p99: float
    longest: float
    overrun: float
    period: float | None

    def __str__(self) -> str:
        period = "" if self.period is None else f" of {num(1e3 * self.period, 0)} ms"
        return (
            f"{num(1e3 * self.median, 2)} ms, {num(1e3 * self.p99, 2)} ms; {num(100 * self.overrun, 2)} % longer than the control "
            f"period{period}"
        )

    @property
    def kept_up(self) -> bool:
        """Whether a robot could have driven by them."""
        return self.overrun <= LATE


def decision_times(f: Findings) -> dict[System, DecisionTime]:
    """Of each system whose trials were simulated."""
    figures, found = _figures(f.results), {}
    for system in f.systems:
        own = figures[[r["trial"] for r in f.of(system)]]
        count, p50, p99, longest, overrun = own[own[:, 0] > 0].T
        if not len(count):
            continue
        robot = f.robots.get(system.robot)
        found[system] = DecisionTime(
            len(count), float(np.median(p50)), float(np.median(p99)), float(longest.max()),
            float(np.average(overrun, weights=count)), None if robot is None else robot.period,
        )  # fmt: skip
    return found


def table(f: Findings) -> Grid | None:
    """A row a system; None where nothing was simulated."""
    heads: Heads = [
        text("System"), text("Navigator"), "trials", "median (ms)", "99 % within (ms)", "longest (ms)", "period (ms)",
        "periods overrun",
    ]  # fmt: skip
    rows: Rows = []
    for system, took in decision_times(f).items():
        period = NONE if took.period is None else num(1e3 * took.period, 0)
        share = f"{num(100 * took.overrun, 2)} %"
        rows.append([
            Cell(f.title(system.robot), strong=True), system.navigator, str(took.trials), num(1e3 * took.median, 2),
            num(1e3 * took.p99, 2), num(1e3 * took.longest, 1), period,
            Cell(share, "" if took.kept_up else "could not have kept up", strong=not took.kept_up),
        ])  # fmt: skip
    if not rows:
        return None
    return grid(
        "Decision times on the machine that ran the trials, in wall clock: localiser, tracker and navigator together, without "
        "each trial's first decision, which may load or compile code. Median and 99th percentile: of each trial, then the "
        "median over the trials. In simulation the world waits for a decision; a robot would not.",
        heads, rows,
    )  # fmt: skip


def warnings(f: Findings) -> dict[System, str]:
    """A sentence for each system that couldn't have kept up."""
    said = {}
    for system, took in decision_times(f).items():
        if not took.kept_up:
            said[system] = (
                f"{f.name(system)} could not have kept up on this machine: {num(100 * took.overrun, 1)} % of its decisions took "
                f"longer than the control period{'' if took.period is None else f' of {num(1e3 * took.period, 0)} ms'} "
                f"(median {num(1e3 * took.median, 0)} ms), and the simulated world waited for them"
            )
    return said


def _figures(results: Results) -> FloatArray:
    """(n, 5) of each trial how many decisions, median, 99th percentile and longest [s], share that overran; none: zeros."""
    timing = results.timing
    trial, value = timing["trial"].to_numpy(), timing["value"].to_numpy()
    found = np.zeros((len(results), len(_NAMES)))
    for column, name in enumerate(_NAMES):
        these = pc.equal(timing["name"], name).to_numpy()
        found[trial[these], column] = value[these]
    return found

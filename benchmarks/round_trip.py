"""Round trip: simulated trials out to every format, in again and scored; how far each indicator is off.

Hospital trials of both robots and all batches (truth localisation). The capture layouts get made-up markers as a lab
would record them: eight on the robot, four on each obstacle, 0.5 mm of noise, 2 % gaps, two markers that change names
for a while, 2 s before and after, a frame of the capture's own that only holds on A and B tie to the map, millimetres
(Motive: metres, y up). The other formats hold the trial as it is. Each is scored with the legs' spans given, and with the
legs to be found. Found legs miss what can't be seen from outside: that the goal was sent a moment before the robot moved,
that it was called reached a moment after the robot stood; so their CT is also held against that of an observer who sees
the true motion without any error (`CT seen`). Where the robot went on to the next leg without a rest, nobody outside can tell
when it called the goal reached; the trial says so, and stands in a line of its own (`no rest`). A trial that ended in a contact or was given up has no CT; whether it counts
as a success has to agree.

    python benchmarks/round_trip.py [--formats vicon,c3d] [--trials N] [--noise M] [--rate HZ] [--keep FOLDER]
                                    [--verbose] [--json] [--smoke]

Aims: CT within one sample, PL within 1 %, DE and MDO within 5 mm, OE within 0.01 rad, or a reported reason.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).parents[1] / "tests" / "recordings"))  # for `synthetic_session`

INDICATORS = ("CT", "CT seen", "PL", "DE", "MDO", "OE")
NO_REST = "no rest"
UNITS = {"CT": "s", "CT seen": "s", "PL": "%", "DE": "mm", "MDO": "mm", "OE": "mrad"}
SCALE = {"CT": 1.0, "CT seen": 1.0, "PL": 1.0, "DE": 1e3, "MDO": 1e3, "OE": 1e3}
AIMS = {"PL": 1.0, "DE": 0.005, "MDO": 0.005, "OE": 0.01}
ROBOTS = ("tiago", "hosbot")
CHOSEN: dict[str, tuple[str, dict[str, Any]]] = {
    "NO": ("move-base", {}),
    "SO": ("move-base", {"speeds": (0.6,), "sizes": (0.15, 0.6)}),
    "MO": ("hp-tmpc", {}),
    "CE": ("hp-tmpc", {"speeds": (0.6,), "sizes": (0.15, 0.6)}),
}
"""60 trials: batch -> who drives, and which of its tests."""
SESSIONS: dict[Path, Any] = {}
"""What was written already, by folder."""


@dataclass
class Tally:
    """What came of one format, with the legs given or found."""

    worst: dict[str, tuple[float, str]] = field(default_factory=dict)
    sums: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    beyond: Counter[str] = field(default_factory=Counter)
    compared: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    covered: Counter[str] = field(default_factory=Counter)
    told: Counter[str] = field(default_factory=Counter)
    agree: int = 0
    trials: int = 0
    sample: float = 0.01

    def add(self, was: dict[str, Any], now: dict[str, Any], name: str) -> None:
        """One trial's row before and after."""
        self.trials += 1
        self.agree += was["success"] == now["success"]
        if was["success"] != now["success"]:
            self.reasons[f"success: {was['success']} became {now['success']} ({now['failure'] or now['reason']})"] += 1
        why = json.loads(now["not_computable"])
        for indicator in INDICATORS:
            column = indicator.split()[0]
            if was[indicator] is None:
                continue
            if now[column] is None:
                self.reasons[f"{column}: {why.get(column, '?')}"] += column == indicator
                continue
            off = abs(now[column] - was[indicator])
            if indicator == "PL":
                off *= 100 / was[indicator]
            self.compared[indicator] += 1
            if (u := now.get(f"{indicator}_U")) is not None:
                self.told[indicator] += 1
                self.covered[indicator] += abs(now[column] - was[indicator]) <= u + 1e-9
            self.sums[indicator].append(off)
            aim = self.sample + 1e-6 if column == "CT" else AIMS[indicator]
            self.beyond[indicator] += off > aim
            if off >= self.worst.get(indicator, (-1.0, ""))[0]:
                self.worst[indicator] = (off, name)


def simulate(folder: Path, count: int | None) -> list[Any]:
    """The trials, with their row of indicators."""
    import clearway

    found = []
    for batch, (navigator, selection) in CHOSEN.items():
        place = folder / f"simulated-{batch}"
        if place.exists():
            results = clearway.open_results(place)
        else:
            results = clearway.run(
                "hospital", robots=ROBOTS, navigators=[navigator], batches=[batch], repetitions=1,
                localisation="truth", out=place, **selection,
            )  # fmt: skip
        found += list(zip(results, results.trials.to_pylist(), strict=True))
    if count is None:
        return found
    few = found[:: max(1, len(found) // count)][:count]
    return few


def seen_time(trial: Any) -> float | None:
    """CT [s] by an observer of the true motion, who doesn't hear when goals are sent and called reached."""
    import numpy as np

    from clearway.recordings.exports.synthetic import robot_at
    from clearway.recordings.lab.legs import find_legs
    from clearway.recordings.motion.motion import Motion, Quality

    t = np.arange(0.0, float(trial.t[-1]) + 4.0, 0.01) - 2.0
    pose = robot_at(trial, t)
    step = np.gradient(pose, t, axis=0)
    velocity = np.column_stack([step[:, 0] * np.cos(pose[:, 2]) + step[:, 1] * np.sin(pose[:, 2]), step[:, 2]])
    found = find_legs(Motion(t, pose, velocity, None, Quality(100.0, 1.0)), trial.attempt.legs)
    scored = [f for f in found if trial.attempt.legs[f.leg].scored]
    if len(scored) < sum(leg.scored for leg in trial.attempt.legs) or not all(f.reached for f in scored):
        return None
    return sum(f.end - f.start for f in scored)


def score(folder: Path, trials: list[Any], to: str, system: Any, spans: bool) -> tuple[list[dict[str, Any]], float]:
    """The rows of the trials after the way through `to`, in their order, with what was told of the legs; s of scoring."""
    from synthetic_session import record

    import clearway

    rows: list[dict[str, Any]] = [{} for _ in trials]
    took = 0.0
    for who in sorted({(trial.attempt.robot, trial.attempt.navigator) for trial, _ in trials}):
        own = [i for i, (trial, _) in enumerate(trials) if (trial.attempt.robot, trial.attempt.navigator) == who]
        place = folder / to / "-".join(who)
        session = SESSIONS.get(place) or record(place, [trials[i][0] for i in own], to, system)
        SESSIONS[place] = session
        plan = session.write_plan("given.toml" if spans else "found.toml", spans=spans)
        began = time.perf_counter()
        results = clearway.score(plan, out=place / plan.stem)
        took += time.perf_counter() - began
        for i, row, scored in zip(own, results.trials.to_pylist(), results, strict=True):
            rows[i] = row | {"legs": "; ".join(scored.provenance.get("legs", ()))}
    return rows, took


def main() -> int:
    from clearway.errors import ClearwayError
    from clearway.recordings.exports.export import CAPTURES, TARGETS
    from clearway.recordings.exports.synthetic import LAB

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--formats", help="some of: " + ", ".join(TARGETS))
    parser.add_argument("--trials", type=int, help="only so many of the 60")
    parser.add_argument("--noise", type=float, default=LAB.noise, help="m")
    parser.add_argument("--rate", type=float, default=LAB.rate, help="Hz")
    parser.add_argument(
        "--keep", type=Path, help="a folder for everything that is written; trials in it are used again"
    )
    parser.add_argument("--verbose", action="store_true", help="every trial of which something is beyond its aim")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="two trials, two formats: only to see that it runs")
    options = parser.parse_args()
    if options.smoke:
        options.trials, options.formats = 2, options.formats or "c3d,csv"
        CHOSEN.clear()
        CHOSEN["NO"] = "move-base", {"speeds": (0.6,)}
    wanted = options.formats.split(",") if options.formats else list(TARGETS)
    system = replace(LAB, noise=options.noise, rate=options.rate)
    folder = options.keep or Path(tempfile.mkdtemp())
    tallies: dict[tuple[str, str], Tally] = {}
    failed: dict[str, str] = {}
    try:
        trials = simulate(folder, options.trials)
        seen = [seen_time(trial) for trial, _ in trials]
        outcomes = Counter(str(trial.outcome) for trial, _ in trials)
        if not options.json:
            print(f"{len(trials)} trials: " + ", ".join(f"{n} {o}" for o, n in outcomes.most_common()), flush=True)
        for to in wanted:
            for legs in ("given", "found"):
                sample = 1 / system.rate if to in CAPTURES else trials[0][0].attempt.period
                both = {legs: Tally(sample=sample), NO_REST: Tally(sample=sample)}
                try:
                    rows, took = score(folder, trials, to, system, legs == "given")
                except ClearwayError as error:
                    failed[f"{to}, legs {legs}"] = str(error)
                    continue
                for i, ((_, was), now) in enumerate(zip(trials, rows, strict=True)):
                    was["CT seen"] = None if legs == "given" else seen[i]
                    which = NO_REST if legs == "found" and "without a rest" in now["legs"] else legs
                    both[which].add(was, now, f"{i} {was['robot']} {was['scenario']}")
                for which, tally in both.items():
                    if tally.trials:
                        tallies[to, which] = tally
                        if not options.json:
                            _line(to, which, tally, took / len(trials))
            if not options.keep:
                shutil.rmtree(folder / to, ignore_errors=True)
                SESSIONS.clear()
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    if options.json:
        print(json.dumps({f"{to}, legs {legs}": _plain(t) for (to, legs), t in tallies.items()} | {"failed": failed}))
        return bool(failed)
    _rest(tallies, failed, options.verbose)
    return int(bool(failed))


_began = False


def _line(to: str, legs: str, tally: Tally, took: float) -> None:
    """One line of the table: the worst error over the trials; `*`: beyond its aim."""
    global _began
    if not _began:
        _began = True
        heads = "".join(f"{f'{i} [{UNITS[i]}]':>12}" for i in INDICATORS)
        print(f"\n{'format':<12} {'legs':<8}{heads}{'success':>9}{'no value':>10}{'within U':>10}{'s/trial':>9}")
    cells = []
    for i in INDICATORS:
        off = tally.worst.get(i, (math.nan, ""))[0] * SCALE[i]
        cells.append(f"{off:>11.3f}{'*' if tally.beyond[i] else ' '}" if tally.compared[i] else f"{'-':>11} ")
    missing = sum(n for reason, n in tally.reasons.items() if not reason.startswith("success"))
    agree = f"{tally.agree}/{tally.trials}"
    told = sum(tally.told.values())
    within = f"{sum(tally.covered.values()) / told:.0%}" if told else "-"
    print(
        f"{to:<12} {legs:<8}{''.join(cells)}{agree:>9}{missing:>10}{within:>10}{took:>9.2f}",
        flush=True,
    )


def _rest(tallies: dict[tuple[str, str], Tally], failed: dict[str, str], verbose: bool) -> None:
    print(
        "\nWorst error over the trials; *: beyond its aim in one trial or more. 'no value': lost, with a reason. 'within U': "
        "share of DE, MDO and OE that are off by no more than their stated uncertainty (k = 2, about 95 %)."
    )
    for (to, legs), tally in tallies.items():
        for i in INDICATORS:
            if tally.beyond[i]:
                name = tally.worst[i][1]
                print(
                    f"  {to}, legs {legs}: {i} beyond its aim in {tally.beyond[i]} of {tally.compared[i]}; the median is off by "
                    f"{sorted(tally.sums[i])[len(tally.sums[i]) // 2] * SCALE[i]:.3g} {UNITS[i]}; the worst is trial {name}"
                )
        for reason, n in tally.reasons.most_common(None if verbose else 6):
            print(f"  {to}, legs {legs}: {n} x {reason}")
    for what, why in failed.items():
        print(f"  {what}: FAILED: {why}")


def _plain(tally: Tally) -> dict[str, Any]:
    return {
        "worst": {i: {"value": v, "trial": name} for i, (v, name) in tally.worst.items()},
        "beyond": dict(tally.beyond),
        "compared": dict(tally.compared),
        "within_uncertainty": {i: [tally.covered[i], n] for i, n in tally.told.items()},
        "success_agrees": tally.agree,
        "trials": tally.trials,
        "reasons": dict(tally.reasons),
    }


if __name__ == "__main__":
    sys.exit(main())

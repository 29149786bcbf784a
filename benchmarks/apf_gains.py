"""Chooses the gains of COLREGS APF: once for all (`fixed`), and for each scenario of paper B's cases (`retuned`).

`fixed`: candidates spread over a range by a Sobol sequence (and the first by hand), on scenarios that the generators of
`sar-case1` and `sar-case2` draw from seeds from 10,000 on; not one of them is among the ten or the held-out ones.
In rounds, each on more scenarios than the one before, the candidates that reach the goal most often stay (then: the
lowest mean time). The winner is printed as it stands in `stand_ins.toml`, with its success on seeds of a last, fresh set.

`retuned`: for each frozen scenario the gains that reach its goal soonest, of the same candidates, then of others around
the best; written to `retuned.json` beside the navigator. Gains that were tuned on the scenario that they are judged by
show what tuning can do (paper B's Fig. 10a), not how good the method is.

    python benchmarks/apf_gains.py [--workers N] [--smoke]            # about 5 minutes on one core
    python benchmarks/apf_gains.py --retune [--workers N] [--smoke]   # as long again
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import qmc

from clearway.campaigns.pilot import compose
from clearway.contract import Command, Observation
from clearway.navigators.colregs_apf import ColregsApf
from clearway.navigators.colregs_apf.retuned import FILE, first_sight
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import Selection, load_suite
from clearway.stand_ins import stand_ins
from clearway.trials import Outcome
from clearway.world import simulate

SUITES = ("sar-case1", "sar-case2")
SEEDS = 10_000
"""The first of those that gains are chosen on."""
ROUNDS = ((64, 5), (20, 20), (6, 50))
"""How many candidates, and on how many scenarios of each suite."""
LAST = 50
"""Fresh scenarios of each suite to judge the winner by."""
NEIGHBOURS = 32
"""Further candidates around the best, for `--retune`."""

Gains = dict[str, float]

BY_HAND: Gains = {
    "eta_d": 0.3, "eta_e": 1.0, "eta_s": 0.2, "rho_0": 4.0, "rho_s": 1.0, "d_safe": 0.3, "velocity_term": 0.0,
    "goal_cap": 1.0,
}  # fmt: skip
"""The first candidate: what the reconstruction began with. epsilon is 1: only ratios matter."""

RANGES = {
    "eta_d": (0.03, 10.0), "eta_e": (0.03, 10.0), "eta_s": (0.003, 1.0), "rho_0": (1.0, 5.0), "rho_s": (0.2, 1.2),
    "d_safe": (0.05, 0.6), "velocity_term": (0.05, 2.0),
}  # fmt: skip
"""Searched on a logarithmic scale; rho_s ends where the arena's border would be felt at the start."""


class Watched(ColregsApf):
    """Remembers what it saw first."""

    seen: tuple[tuple[float, float], ...] | None = None

    def step(self, observation: Observation) -> Command:
        if self.seen is None and observation.obstacles is not None and len(observation.obstacles):
            self.seen = tuple((round(x, 3), round(y, 3)) for x, y in first_sight(observation.obstacles).tolist())
        return super().step(observation)


def candidates(count: int, around: Gains | None = None, seed: int = 2019) -> list[Gains]:
    """Sets of gains: by hand and then spread over the ranges; or spread over a third of them around a set."""
    unit = qmc.Sobol(len(RANGES) + 1, seed=seed).random(1 << (count - 1).bit_length())[:count]
    found = []
    for *row, last in unit.tolist():
        gains = {}
        for (name, (low, high)), u in zip(RANGES.items(), row, strict=True):
            if around is None:
                value = low * (high / low) ** u
            else:
                value = min(max(max(around[name], low) * (high / low) ** ((u - 0.5) / 3.0), low), high)
            gains[name] = float(f"{value:.3g}")
        gains["goal_cap"] = (1.0 if last < 0.75 else math.inf) if around is None else around["goal_cap"]
        found.append(gains)
    return [BY_HAND, *found[:-1]] if around is None else found


def scenarios(suite: str, seeds: tuple[int, int] | None) -> list[Scenario]:
    return load_suite(suite).build(load_robot("rescue"), Selection(seeds=seeds), 0)


def attempt(scenario: Scenario, gains: Gains) -> tuple[bool, float, str, Any]:
    """Whether it reached the goal, after how long [s], the outcome, and what it saw first."""
    robot, navigator = load_robot("rescue"), Watched(**gains)
    localiser, tracker = make_localiser("truth", robot), make_tracker(scenario.tracking, robot)
    pilot = compose(navigator, localiser, tracker=tracker)
    trial = simulate(
        scenario, robot, pilot, navigator="colregs-apf", localisation="truth", map=None, tracking=scenario.tracking
    )
    return trial.outcome == Outcome.REACHED, float(trial.t[-1]), str(trial.outcome), navigator.seen


def score(results: Sequence[tuple[bool, float, str, Any]]) -> tuple[int, float]:
    """How often it reached the goal, and minus the mean time of that [s]: more is better."""
    times = [t for reached, t, *_ in results if reached]
    return len(times), -float(np.mean(times)) if times else -math.inf


def choose(pool: Parallel, smoke: bool) -> None:
    """Print the gains that do best, and how well they do on fresh scenarios."""
    rounds = ((4, 1), (2, 2)) if smoke else ROUNDS
    need = max(n for _, n in rounds)
    drawn = {s: scenarios(s, (SEEDS, SEEDS + need)) for s in SUITES}
    field = candidates(rounds[0][0])
    for keep, count in rounds:
        field = field[:keep]
        tests = [s for suite in SUITES for s in drawn[suite][:count]]
        flat = pool(delayed(attempt)(s, g) for g in field for s in tests)
        scores = [score(flat[i * len(tests) : (i + 1) * len(tests)]) for i in range(len(field))]
        order = sorted(range(len(field)), key=lambda i: (*scores[i], -i), reverse=True)
        print(f"{len(field)} candidates on {len(tests)} scenarios; the best three, and by hand:", flush=True)
        for i in [*order[:3], *([field.index(BY_HAND)] if BY_HAND in field else [])]:
            print(f"  {scores[i][0]:3d} reached, {-scores[i][1]:5.1f} s  {field[i]}", flush=True)
        field = [field[i] for i in order]
    best = field[0]
    print("\n[colregs-apf]\nepsilon = 1.0")
    for name, value in best.items():
        print(f"{name} = {value}")
    fresh = 2 if smoke else LAST
    for suite in SUITES:
        results = pool(delayed(attempt)(s, best) for s in scenarios(suite, (SEEDS + need, SEEDS + need + fresh)))
        n, t = score(results)
        print(f"# on {fresh} fresh scenarios of {suite}: {n} reached, mean {-t:.1f} s; {tally(results)}")


def tally(results: Sequence[tuple[bool, float, str, Any]]) -> str:
    """How trials ended."""
    outcomes = [r[2] for r in results]
    return ", ".join(f"{outcomes.count(o)} {o}" for o in sorted(set(outcomes)))


def retune(pool: Parallel, smoke: bool) -> None:
    """Write the gains that do best on each frozen scenario."""
    rows, fixed = [], {k: v for k, v in stand_ins("colregs-apf").items() if k in BY_HAND}
    for suite in SUITES:
        for scenario in scenarios(suite, None)[: 1 if smoke else None]:
            field = [fixed, *candidates(4 if smoke else ROUNDS[0][0])]
            results = pool(delayed(attempt)(scenario, g) for g in field)
            before = results[0]
            best = max(range(len(field)), key=lambda i: (*score(results[i : i + 1]), -i))
            field = [field[best], *candidates(4 if smoke else NEIGHBOURS, field[best], 2025)]
            results = [results[best], *pool(delayed(attempt)(scenario, g) for g in field[1:])]
            best = max(range(len(field)), key=lambda i: (*score(results[i : i + 1]), -i))
            reached, t, outcome, seen = results[best]
            print(
                f"{scenario.name}: fixed {before[2]} at {before[1]:.1f} s, retuned {outcome} at {t:.1f} s", flush=True
            )
            gains = {name: "inf" if math.isinf(value) else value for name, value in field[best].items()}  # strict JSON
            rows.append({"scenario": scenario.name, "reached": reached, "seen": seen, "gains": gains})
    if smoke:
        return
    lines = ",\n".join(json.dumps(row) for row in rows)
    about = (
        "Gains of colregs-apf tuned on each scenario itself, by benchmarks/apf_gains.py --retune; stand-ins, as all."
    )
    FILE.write_text(f'{{"about": {json.dumps(about)}, "scenarios": [\n{lines}\n]}}\n', encoding="utf-8")
    print(f"{sum(r['reached'] for r in rows)} of {len(rows)} reached; written to {FILE.name}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retune", action="store_true", help="tune for each frozen scenario")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--smoke", action="store_true", help="a few candidates on a few scenarios; writes nothing")
    asked = parser.parse_args()
    with Parallel(n_jobs=asked.workers) as pool:
        (retune if asked.retune else choose)(pool, asked.smoke)


if __name__ == "__main__":
    main()

"""How well `clearway break --rarity` knows the probability of a failure: events whose probability is known by a formula, many times.

Printed for each: the mean of the estimates (their bias), their spread, how many lie within a factor of 1.5, how many intervals
of 95 % hold the truth, how many limits do that rest on draws by chance alone, and the trials beside those that plain sampling takes
for the same spread. It fails if an interval (a limit alone, of events that margins don't lead to) holds the truth more seldom than it
says, beyond chance.

    python benchmarks/rarity.py [--repetitions N] [--trials N] [--smoke]
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import special, stats

from clearway.searching.candidates import NOISES, Candidate
from clearway.searching.rarity import CONFIDENCE, rarity

Floats = npt.NDArray[np.float64]
FACTOR = 1.5


@dataclass(frozen=True)
class Event:
    """A failure whose probability is known."""

    name: str
    probability: float
    sizes: tuple[int, ...]
    margin: Callable[[Floats, int, Floats], Floats]
    """Of normal coordinates (k, n), the family and the noise (k,), normal too."""
    led: bool = True
    """Whether small margins lead to it, as the interval assumes."""

    def __len__(self) -> int:
        return len(self.sizes)

    def size(self, base: int) -> int:
        """How many numbers vary."""
        return self.sizes[base]

    def judge(self, asked: Sequence[Candidate]) -> list[float]:
        """The margins."""
        found = np.empty(len(asked))
        for base in {c.base for c in asked}:
            those = [i for i, c in enumerate(asked) if c.base == base]
            normal = special.ndtri(np.array([asked[i].point for i in those]))
            noise = special.ndtri((np.array([_mixed(asked[i].noise) for i in those]) + 0.5) / NOISES)
            found[those] = self.margin(normal, base, noise)
        return found.tolist()


def _mixed(noise: int) -> int:
    """One-to-one, and without order: neighbouring draws of noise have nothing in common."""
    for _ in range(3):
        noise = (noise * 0x9E375 + 0x1F123) % NOISES
        noise ^= noise >> 9
    return noise


def along(probability: float, share: float = 0.0) -> Callable[[Floats, int, Floats], Floats]:
    """Too far along the diagonal; a share of the variance is the noise's."""
    limit = -special.ndtri(probability)

    def margin(u: Floats, base: int, noise: Floats) -> Floats:
        return limit - math.sqrt(1.0 - share) * u.sum(axis=1) / math.sqrt(u.shape[1]) - math.sqrt(share) * noise

    return margin


def at_once(
    probability: float, otherwise: Callable[[Floats, int, Floats], Floats]
) -> Callable[[Floats, int, Floats], Floats]:
    """Of that probability by one number, which no margin tells of before."""
    limit = -special.ndtri(probability)
    return lambda u, base, noise: np.where(u[:, 1] > limit, -0.5, otherwise(u, base, noise))


def events(p: float) -> list[Event]:
    """Those of probability `p`, and more frequent ones."""
    third, ten = -special.ndtri(p / 2), along(10 * p)
    return [
        Event("a plane among 6 numbers", p, (6,), along(p)),
        Event("a plane among 40 numbers", p, (40,), along(p)),
        Event("a corner of 4 numbers", p, (4,), lambda u, _, __: special.ndtr(u).max(axis=1) - p**0.25),
        Event("two opposite ends", p, (6,), lambda u, _, __: third - np.abs(u[:, 0])),
        Event("a third of it noise", p, (6,), along(p, 1 / 3)),
        Event(
            "one of 10 scenarios", p, (6,) * 10, lambda u, base, n: ten(u, base, n) if base == 3 else 1.0 + u[:, 0] ** 2
        ),
        *(Event("a plane among 6 numbers", q, (6,), along(q)) for q in (0.003, 0.01, 0.03, 0.3)),
        *(
            Event(
                "at once, all others 0.1 m away",
                q,
                (6,),
                at_once(q, lambda u, _, __: 0.1 + special.ndtr(u[:, 0])),
                False,
            )
            for q in (p, 10 * p)
        ),
        Event(
            "one of 10 scenarios, the others nearer",
            p,
            (6,) * 10,
            lambda u, base, n: ten(u, base, n) if base == 3 else 0.3 + 0.1 * np.abs(u[:, 0]),
            False,
        ),
        Event("a plane of p / 100, all else at once", 1.01 * p, (6,), at_once(p, along(p / 100)), False),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--trials", type=int, default=12_000, help="of each estimate")
    parser.add_argument("--smoke", action="store_true", help="ends in seconds")
    asked = parser.parse_args()
    repetitions, trials = (3, 1000) if asked.smoke else (asked.repetitions, asked.trials)
    print(
        "| event | p | mean of the estimates | spread | within 1.5 times | intervals that hold p | limits that do | trials | of plain sampling's | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    wrong = 0
    for event in events(1e-4):
        began = time.perf_counter()
        found = [rarity("", event, event.judge, trials, seed, lambda *_: None) for seed in range(repetitions)]
        estimates = np.array([r.probability for r in found])
        holds = sum(r.low <= event.probability <= r.high for r in found)
        limits = sum(event.probability <= r.limit for r in found)
        near = np.mean((estimates > event.probability / FACTOR) & (estimates < event.probability * FACTOR))
        spread = estimates.std() / event.probability
        mean, error = estimates.mean(), estimates.std() / math.sqrt(repetitions)
        took = float(np.mean([r.trials for r in found]))
        plain = (1.0 - event.probability) / (event.probability * max(spread, 1e-9) ** 2)
        print(
            f"| {event.name} | {event.probability:g} | {mean:.3g} ± {error:.1g} | {100 * spread:.0f} % | {100 * near:.0f} % "
            f"| {holds} of {repetitions} | {limits} of {repetitions} | {took:,.0f} | {100 * took / plain:.1f} % | {time.perf_counter() - began:.0f} |",
            flush=True,
        )
        wrong += int(stats.binom.cdf(holds if event.led else limits, repetitions, CONFIDENCE) < 0.001)
    sys.exit(min(wrong, 1))


if __name__ == "__main__":
    main()

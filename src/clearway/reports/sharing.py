"""Trials of robots that shared a simulation: they met each other, so what one did is no independent sample beside the other's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from clearway.reports.grid import counted
from clearway.reports.selection import Row, system_of
from clearway.statistics import Comparison, ConfigurationComparison


def sharing(rows: Iterable[Row]) -> tuple[int, int]:
    """How many of these trials share a simulation with another one of the same system, and how many such simulations there are."""
    counts = Counter((system_of(r), run) for r in rows if (run := r.get("run")))
    shared = [n for n in counts.values() if n > 1]
    return sum(shared), len(shared)


def footnote(rows: Iterable[Row]) -> str:
    """What that does to intervals over these trials, in a sentence that ends a caption; empty if none of them share one."""
    trials, runs = sharing(rows)
    if not trials:
        return ""
    return f" {trials} of the trials are of robots that met each other in {counted(runs, 'simulation')}: {_SO}"


def of_pairs(found: Iterable[Comparison | ConfigurationComparison]) -> str:
    """The same of the pairs of trials that were compared."""
    pairs = [c for c in found if isinstance(c, Comparison)]
    together, n = sum(c.together for c in pairs), sum(c.pairs for c in pairs)
    return (
        f" {together} of the {n} pairs are of robots that met each other in one simulation: {_SO}" if together else ""
    )


def repeated(found: Iterable[Comparison | ConfigurationComparison]) -> str:
    """What has to be said of pairs that repeat one another's test, in a sentence; empty if none do."""
    pairs = [c for c in found if isinstance(c, Comparison) and c.tests < c.pairs]
    each = dict.fromkeys(f"{c.pairs} pairs are of {counted(c.tests, 'test')}" for c in pairs)
    return (
        f" {'; '.join(each)}: repetitions of one are alike, so the intervals are rather too narrow, and p too small."
        if each
        else ""
    )


_SO = "they are not independent, and intervals and p, which take them as such, claim too much."

"""Systems that met the same tests, trial beside trial: the only trials from which they may be compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

from clearway.reports.findings import Findings
from clearway.reports.selection import Row, System

LEAST_SHARED = 0.5
"""Share of a group's tests that a system must have run to be compared in it: an unfinished one would shrink them to a few."""
LABELS = ("batch", "configuration", "speed", "obstacle_speed", "size", "gap", "repetition")
"""What a test is, beside its suite; the same but for the last is the same test again."""


@dataclass(frozen=True, slots=True, eq=False)
class SameTests:
    """Systems with their trials of the tests that all of them ran.

    Attributes:
        systems: Who was tested, in the campaign's order.
        rows: The trials of each, the same test at the same place.
        left_out: How many of their trials are of tests that not all of them ran.
    """

    systems: tuple[System, ...]
    rows: Mapping[System, Sequence[Row]]
    left_out: int

    @property
    def n(self) -> int:
        """Number of tests."""
        return len(self.rows[self.systems[0]])


def same_tests(f: Findings) -> list[SameTests]:
    """The systems in groups of those that ran the same tests; one that shares too few stands alone."""
    tests = {system: _by_test(f.of(system)) for system in f.systems}
    groups: list[tuple[list[System], dict[Hashable, None]]] = []
    for system, own in tests.items():
        for members, common in groups:
            both = {test: None for test in common if test in own}
            if len(both) >= LEAST_SHARED * len(common) and both:
                members.append(system)
                common.clear()
                common.update(both)
                break
        else:
            groups.append(([system], dict.fromkeys(own)))
    return [
        SameTests(
            tuple(members),
            {s: [tests[s][test] for test in common] for s in members},
            sum(len(tests[s]) - len(common) for s in members),
        )
        for members, common in groups
    ]


def _by_test(rows: Sequence[Row]) -> dict[Hashable, Row]:
    """The rows by what was asked, and of which robot among several; a recording that names no scenario by its labels, alike ones in the order of the plan."""
    seen: Counter[Hashable] = Counter()
    found: dict[Hashable, Row] = {}
    for row in rows:
        what = (row["suite"], row["scenario"] or tuple(row[name] for name in LABELS), row.get("member") or "")
        seen[what] += 1
        found[what, seen[what]] = row
    return found

"""Which results stand side by side in a comparison: several directories, or the systems of one; and what has to be said of two
sides that were not measured alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from clearway.errors import ClearwayError, unknown
from clearway.indicators import TIMED
from clearway.reports.findings import Findings
from clearway.reports.grid import counted
from clearway.reports.selection import System
from clearway.statistics import Comparison, ConfigurationComparison
from clearway.trials.store import Results

Found = Comparison | ConfigurationComparison
"""Two sides, B against A."""


def tables_of(results: Sequence[Results], between: Iterable[str] = ()) -> dict[str, Any]:
    """Name -> table of trials of each side of a comparison, in its order.

    Args:
        results: Several, each a side; or one, each of whose systems (a robot with a navigator and a set-up) is one.
        between: Of one, only the systems of these robots, navigators or set-ups, in this order; empty: all.

    Raises:
        ClearwayError: one holds a single system, has none of a name, or `between` is said of several.
    """
    wanted = list(between)
    if len(results) != 1:
        if wanted:
            raise ClearwayError("parts one results directory, and several are compared as they are", field="between")
        return {str(one.path): one.trials for one in results}
    f = Findings(results[0])
    systems: list[System] = f.systems
    for name in wanted:
        if not any(name in _names(system) for system in systems):
            raise unknown(
                "system", name, {n for s in systems for n in _names(s)}, file=results[0].path, field="between"
            )
    chosen = [s for name in wanted for s in systems if name in _names(s)] if wanted else systems
    chosen = list(dict.fromkeys(chosen))
    if len(chosen) < 2 <= len(systems):
        others = {n for s in systems if s not in chosen for n in _names(s)} - {n for s in chosen for n in _names(s)}
        raise ClearwayError(
            f"leaves a single system; name another one too: {', '.join(sorted(others))}",
            file=results[0].path,
            field="between",
        )
    if len(chosen) < 2:
        raise ClearwayError(
            "holds a single system, which has nothing to be compared with; name another results directory too, or run "
            "several robots, navigators or set-ups",
            file=results[0].path,
        )
    return {_title(system, chosen): f.table(system) for system in chosen}


def _names(system: System) -> set[str]:
    return {system.robot, system.navigator, *(() if system.setup is None else (system.setup,))}


def _title(system: System, among: Sequence[System]) -> str:
    """What tells a system from the others: robot, navigator and set-up as far as they differ."""
    parts = [("robot", system.robot), ("navigator", system.navigator), ("setup", system.setup)]
    told = [str(value) for name, value in parts if len({getattr(s, name) for s in among}) > 1 and value is not None]
    return ", ".join(told) or system.navigator


def repetitions(found: ConfigurationComparison) -> list[str]:
    """How many trials of each side there are of each configuration."""
    said = []
    for name, times in ((found.a, found.repetitions_a), (found.b, found.repetitions_b)):
        each = f"{times.fewest}" if times.fewest == times.most else f"{times.fewest} to {times.most}"
        said.append(f"{name}: {times.trials} trials, {each} of each configuration")
    return said


def mark(found: Found, indicator: str) -> str:
    """`*` at a time that was taken otherwise on one side than on the other: there alone legs were found by the robot's motion."""
    apart = isinstance(found, ConfigurationComparison) and bool(found.by_motion_a) != bool(found.by_motion_b)
    return "*" if apart and indicator in TIMED else ""


def taken_otherwise(found: Found) -> str:
    """What has to be said of what has that mark; empty if nothing that was compared has it."""
    if not any(r["n"] and mark(found, r["indicator"]) for r in found.differences.to_pylist()):
        return ""
    assert isinstance(found, ConfigurationComparison)
    who, count = (found.a, found.by_motion_a) if found.by_motion_a else (found.b, found.by_motion_b)
    return (
        f"* {who}: the legs of {counted(count, 'trial')} were found by the robot's motion. The thinking before it moves off and the "
        "wait before a goal is called reached are not seen there, a few tenths of a second a leg: part of this difference "
        "is how the time was taken. Record the goals, or give the legs' spans in the test plan."
    )


def uncertainty(row: Mapping[str, Any]) -> float | None:
    """How far off both means of a row may be together (k = 2); None where that is unknown or nothing was measured."""
    a, b = row.get("u_a"), row.get("u_b")
    return None if a is None or b is None else math.hypot(a, b) or None


def unlike(found: Found) -> str:
    """In what else than the systems the two trials of pairs differ, in words; empty if in nothing, or if there are no pairs."""
    differ = found.differ_in if isinstance(found, Comparison) else ()
    return f"the pairs differ in {' and in '.join(differ)}" if differ else ""

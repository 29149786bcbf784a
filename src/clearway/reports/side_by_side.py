"""Which results stand side by side in a comparison: several directories, or the systems of one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from clearway.errors import ClearwayError, unknown
from clearway.reports.findings import Findings
from clearway.reports.selection import System
from clearway.trials.store import Results


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

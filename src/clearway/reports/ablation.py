"""What each ingredient of a navigator brings: the navigator against itself without it, on the same tests.

A variant is known by its name: `hp-st[without=reverse]` is `hp-st` without the ingredient `reverse`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.reports import sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, p_value, span, text
from clearway.reports.selection import Row, System, moving_at_contact, table_of
from clearway.statistics import Comparison, compare, holm

_OPTION = "without="


def variant_of(navigator: str) -> tuple[str, str] | None:
    """The navigator that a variant is made from and what it leaves out; None for one that leaves out nothing."""
    name, bracket, inside = navigator.removesuffix("]").partition("[")
    options = [part.strip() for part in inside.split(",")]
    left_out = next((o.removeprefix(_OPTION) for o in options if o.startswith(_OPTION)), None)
    if not (bracket and navigator.endswith("]") and left_out):
        return None
    others = ",".join(o for o in options if not o.startswith(_OPTION))
    return (f"{name}[{others}]" if others else name), left_out


def pairs(systems: Iterable[System]) -> list[tuple[System, str, System]]:
    """Each system with what a variant leaves out of it and that variant, where both were run."""
    there = list(systems)
    found = []
    for variant in there:
        made = variant_of(variant.navigator)
        if made and (full := System(variant.robot, made[0], variant.setup)) in there:
            found.append((full, made[1], variant))
    return sorted(found, key=lambda p: there.index(p[0]))


def whole(systems: Iterable[System]) -> list[System]:
    """The systems that are not a variant of another one."""
    there = list(systems)
    variants = {variant for _, _, variant in pairs(there)}
    return [s for s in there if s not in variants]


def tables(f: Findings) -> list[Grid]:
    """A table a suite in which variants were run."""
    suites = dict.fromkeys(r["suite"] for r in f.rows)
    return [g for suite in suites if (g := table(f, suite)) is not None]


def table(f: Findings, suite: str) -> Grid | None:
    """For each ingredient what it brings in success, path and time; None if no variant was run."""
    rows = [r for r in f.rows if r["suite"] == suite]
    relative = any(r["CT_optimal"] is not None for r in rows)
    path, time = ("PL_shortest", "CT_optimal") if relative else ("PL", "CT")
    found = [(p, c) for p in pairs(f.systems) if (c := _compared(f, rows, *p, (path, time))) is not None]
    if not found:
        return None
    lines: Rows = []
    groups: list[int] = []
    for full in dict.fromkeys(p[0] for p, _ in found):
        groups.append(len(lines))
        own = full.of(rows)
        lines.append([
            Cell(f.name(full) + tuning.sign(own), strong=True), "all", str(len(own)), str(sum(bool(r["success"]) for r in own)), NONE, NONE, NONE,
            _mean(own, path, relative), _mean(own, time, relative), str(_moving(own)),
        ])  # fmt: skip
        mine = [(without, variant, c) for (of, without, variant), c in found if of == full]
        wins = [c.success.get(None) for _, _, c in mine]
        adjusted = holm([np.nan if w is None else w.p for w in wins]).tolist()
        for (without, variant, c), win, p in zip(mine, wins, adjusted, strict=True):
            differences = {r["indicator"]: r for r in c.differences.to_pylist() if r["batch"] is None}
            counts = [NONE, NONE, NONE, NONE] if win is None else [
                f"{win.both + win.only_a} : {win.both + win.only_b}",
                Cell(f"{num(100 * win.difference.estimate, 1)}", span(100 * win.difference.low, 100 * win.difference.high, 1)),
                p_value(win.p), p_value(p),
            ]  # fmt: skip
            lines.append([
                Cell(f.name(full) + tuning.sign(own), strong=True), f"without {without}", str(c.pairs), *counts,
                *(_difference(differences.get(name), c.pairs, relative) for name in (path, time)), str(_moving(variant.of(rows))),
            ])  # fmt: skip
    of = (" / shortest", " / clairvoyant's") if relative else (" (m)", " (s)")
    heads: Heads = [
        text("System"), text("Ingredients"), "tests", "successes, without : with", "brought (points)", "p", "p (Holm)",
        f"path{of[0]}", f"time{of[1]}", "moving at contact",
    ]  # fmt: skip
    return grid(
        f"{suite}: what each ingredient brings, with it minus without it on the same seeds. Success: difference of the rates with "
        "Newcombe's 95 % interval, McNemar's exact test, Holm's correction over the ingredients. Path and time: the first line their "
        "mean, the others the mean of the paired differences over the tests that both finished, with its 95 % bootstrap interval "
        "(negative: shorter with the ingredient). Moving at contact: trials of this line."
        + sharing.footnote(rows) + tuning.footnote(rows),
        heads, lines, groups,
    )  # fmt: skip


def _compared(
    f: Findings, rows: list[Row], full: System, without: str, variant: System, indicators: tuple[str, str]
) -> Comparison | None:
    """The full navigator (B) against the variant (A)."""
    own, other = full.of(rows), variant.of(rows)
    if not own or not other:
        return None
    try:
        return compare(
            table_of(f.results, other), table_of(f.results, own), names=(without, "all"), indicators=indicators
        )
    except ClearwayError:
        return None  # they have no test in common


def _mean(rows: list[Row], name: str, relative: bool) -> str:
    values = [r[name] for r in rows if r["success"] and r[name] is not None]
    return num(sum(values) / len(values), 3 if relative else 2) if values else NONE


def _difference(row: Any, pairs: int, relative: bool) -> Cell:
    if row is None or not row["n"]:
        return Cell(NONE)
    digits = 3 if relative else 2
    interval = span(row["boot_low"], row["boot_high"], digits)
    fewer = f"n {row['n']}" if row["n"] < pairs else ""
    return Cell(num(row["mean_difference"], digits), f"{interval} {fewer}".strip())


def _moving(rows: list[Row]) -> int:
    return sum(map(moving_at_contact, rows))

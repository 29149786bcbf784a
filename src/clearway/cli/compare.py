"""`clearway compare`: paired differences between results directories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from clearway.cli._options import Json, tell


def compare(
    directories: Annotated[
        list[Path],
        typer.Argument(
            help="Results directories, each compared with those before it; or a single one, whose systems are compared."
        ),
    ],
    between: Annotated[
        list[str] | None,
        typer.Option("--between", help="Of a single one: only these robots, navigators or set-ups; repeatable."),
    ] = None,
    indicators: Annotated[
        list[str] | None, typer.Option("--indicator", help="Only these indicators; default: paper A's.")
    ] = None,
    confidence: Annotated[float, typer.Option(help="Of the intervals, in (0, 1).")] = 0.95,
    out: Annotated[
        Path | None, typer.Option(help="Write a page with figures, and a CSV table, into this folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare results directories, or the systems of one: paired differences per indicator, with intervals.

    Simulated results are paired test by test. A simulation and a recording (the sim-to-real difference), or two
    recordings (before and after), are matched by configuration, their repetitions averaged first.
    """
    from dataclasses import asdict
    from itertools import combinations

    from clearway.errors import ClearwayError
    from clearway.reports.comparison_page import write_comparison
    from clearway.reports.side_by_side import tables_of
    from clearway.reports.text import comparison, tuned, tuned_lines
    from clearway.statistics import ConfigurationComparison, compare_all
    from clearway.trials.differences import other_robots
    from clearway.trials.store import open_results

    if twice := [path for path in directories if directories.count(path) > 1]:
        raise ClearwayError("is named twice; a comparison needs different results", file=twice[0])
    opened = {str(path): open_results(path) for path in directories}
    tables = tables_of(list(opened.values()), between or ())
    found = compare_all(tables, indicators=indicators, confidence=confidence)
    chosen = tuned(tables)
    page = None if out is None else write_comparison(found, out)
    others = {(c.a, c.b): other_robots(opened[c.a], opened[c.b]) if len(opened) > 1 else [] for c in found}
    if not as_json:
        parts = ["\n".join([comparison(c), *others[c.a, c.b]]) for c in found]
        apart = [(a, b) for a, b in combinations(tables, 2) if (a, b) not in others]
        parts += (
            ["\n".join(f"{a} and {b} have no test in common, and are not compared" for a, b in apart)] if apart else []
        )
        parts += [f"page: {page}"] if page else []
        said = tuned_lines(chosen)
        typer.echo("\n\n".join([*parts, *(["\n".join(said)] if said else [])]))
        return
    whole = []
    for c in found:
        success = {batch or "all": asdict(s) for batch, s in c.success.items()}
        rows = {"differences": c.differences.to_pylist(), "success": success}
        without = {"only_a": c.only_a, "only_b": c.only_b, "tuned_a": chosen[c.a], "tuned_b": chosen[c.b]}
        if isinstance(c, ConfigurationComparison):
            how: dict[str, Any] = {"kind": c.kind, "source_a": c.source_a, "source_b": c.source_b}
            how |= {"matched_by": c.matched_by, "configurations": c.configurations}
            how |= {"repetitions_a": asdict(c.repetitions_a), "repetitions_b": asdict(c.repetitions_b)}
            how |= {"legs_by_motion_a": c.by_motion_a, "legs_by_motion_b": c.by_motion_b}
        else:
            how = {"pairs": c.pairs, "differ_in": list(c.differ_in)}
        whole.append({"a": c.a, "b": c.b, "other_robots": others[c.a, c.b]} | how | without | rows)
    tell(whole, indent=2)

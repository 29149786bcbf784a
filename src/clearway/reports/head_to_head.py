"""Navigators on the same tests: who is better at what, by how much, and how sure that is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.indicators import HEADLINE
from clearway.reports import ablation, sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, p_value, span, text
from clearway.reports.selection import System
from clearway.statistics import Comparison, PairedSuccess, compare, holm

MOST = 12
"""Systems that are compared with each other; with more, the page of every two of them could not be read any more."""


DOUBT = (
    " Where the interval leaves out 0 and p is above 0.05 (or the other way about) the two disagree: so few tests ended differently that "
    "one more would decide it. No difference is shown there."
)
"""What has to be said where `PairedSuccess.doubtful`."""


def rates_at_odds(pairs: Iterable[tuple[PairedSuccess | None, float]]) -> str:
    """What has to be said where the 95 % interval of two success rates and what is shown, by their p after Holm's correction, are at
    odds; empty if they nowhere are."""
    known = [(s, p) for s, p in pairs if s is not None]
    if any(s.doubtful for s, _ in known):
        return DOUBT
    if any(p > 0.05 and (s.difference.low > 0 or s.difference.high < 0) for s, p in known):
        return " Some intervals leave out 0 and yet nothing is shown: each stands for itself, and of many some do by chance."
    return ""


def at_odds(rows: Iterable[Mapping[str, Any]]) -> str:
    """What has to be said where an indicator's interval leaves out 0 and no difference is shown, and where it holds 0 and one is;
    empty if there is none of either."""
    known = [r for r in rows if r["boot_low"] is not None and r["p"] is not None]
    said = ""
    if any(not r["favours"] and r["better"] != "neither" and r["boot_low"] * r["boot_high"] > 0 for r in known):
        said += (
            " Some intervals leave out 0 and yet no difference is shown: each interval stands for itself, and of many some leave it out by "
            "chance, for which Holm's correction makes up."
        )
    if any(r["favours"] and r["boot_low"] * r["boot_high"] <= 0 for r in known):
        said += (
            " Some intervals hold 0 and yet a difference is shown: the interval is that of the mean, which a few large differences move, "
            "while the test goes by ranks, so that most tests went one way."
        )
    return said


def comparisons(f: Findings) -> list[tuple[System, System, Comparison]]:
    """Every two systems that share a robot and met the same tests, the later against the earlier; variants without an
    ingredient are compared in the ablation."""
    systems = ablation.whole(f.systems)
    if not 1 < len(systems) <= MOST:
        return []
    found = []
    for a, b in combinations(systems, 2):
        if a.robot != b.robot or (a.navigator != b.navigator and a.setup != b.setup):
            continue
        try:
            pair = compare(f.table(a), f.table(b), names=(f.name(a), f.name(b)), indicators=_indicators(f))
        except ClearwayError:
            continue  # they have no test in common
        found.append((a, b, pair))
    return found


def _indicators(f: Findings) -> tuple[str, ...]:
    more = [n for n in ("PL_shortest", "CT_optimal", "people_delay") if any(r.get(n) is not None for r in f.rows)]
    return (*HEADLINE, *more)


def table(f: Findings, found: list[tuple[System, System, Comparison]]) -> Grid | None:
    """Success: a row a pair, with McNemar's p and Holm's over all pairs."""
    if not found:
        return None
    wins = [c.success.get(None) for _, _, c in found]
    adjusted = holm([np.nan if s is None else s.p for s in wins]).tolist()
    lines: Rows = []
    groups: list[int] = []
    last = None
    signs = {system: tuning.sign(f.of(system)) for a, b, _ in found for system in (a, b)}
    for (a, b, c), s, p in zip(found, wins, adjusted, strict=True):
        if a != last:
            groups.append(len(lines))
            last = a
        if s is None:
            continue
        d = s.difference
        better = "" if p > 0.05 else (c.b if d.estimate > 0 else c.a)
        lines.append([
            Cell(c.b + signs[b], strong=True), c.a + signs[a], str(s.n), _score(s), _score(c.success_self.get(None)),
            Cell(f"{num(100 * d.estimate, 1)}", span(100 * d.low, 100 * d.high, 1)), p_value(s.p), p_value(p), better or NONE,
        ])  # fmt: skip
    heads: Heads = [
        text("System"),
        text("against"),
        "tests",
        "successes",
        "by the robot's estimate",
        "difference (points)",
        "p",
        "p (Holm)",
        text("better"),
    ]
    doubt = rates_at_odds(zip(wins, adjusted, strict=True))
    return grid(
        "Success on the same tests: difference of the rates with Newcombe's 95 % interval, McNemar's exact test, Holm's "
        f"correction over all rows.{doubt}"
        f"{sharing.of_pairs(c for _, _, c in found)}{tuning.footnote(r for system in signs for r in f.of(system))}",
        heads, lines, groups,
    )  # fmt: skip


def _score(s: PairedSuccess | None) -> str:
    return NONE if s is None else f"{s.both + s.only_b} : {s.both + s.only_a}"


def indicator_table(found: list[tuple[System, System, Comparison]]) -> Grid | None:
    """Every indicator: a row a pair and indicator, over the tests that both finished."""
    lines: Rows = []
    groups: list[int] = []
    for _, _, c in found:
        rows = [r for r in c.differences.to_pylist() if r["batch"] is None and r["n"] > 0]
        if rows:
            groups.append(len(lines))
        lines += [_line(c, r) for r in rows]
    if not lines:
        return None
    heads: Heads = [text("System"), text("against"), text("indicator"), "n", "mean", "against's mean", "difference", "p", "p (Holm)",
             "effect", text("better")]  # fmt: skip
    return grid(
        "Indicators over the tests that both finished (so a navigator that fails the hard ones is not punished here: read it "
        "with the success above; MDO alone counts a contact too, as 0): mean of the paired differences with its 95 % bootstrap interval, Wilcoxon's signed-rank "
        "test, Holm's correction over the indicators of one pair, rank-biserial effect."
        f"{at_odds(r for _, _, c in found for r in c.differences.to_pylist() if r['batch'] is None and r['n'])}"
        f"{sharing.of_pairs(c for _, _, c in found)}",
        heads, lines, groups,
    )  # fmt: skip


def _line(c: Comparison, r: Mapping[str, Any]) -> list[Cell | str]:
    digits = 3 if r["unit"] in ("rad", "") or r["indicator"] in ("DE", "MDO") else 2
    unit = f" ({r['unit']})" if r["unit"] else ""
    return [
        Cell(c.b, strong=True), c.a, f"{r['indicator']}{unit}", str(r["n"]), num(r["mean_b"], digits), num(r["mean_a"], digits),
        Cell(num(r["mean_difference"], digits), span(r["boot_low"], r["boot_high"], digits)), p_value(r["p"]), p_value(r["p_holm"]),
        num(r["effect"], 2), {"A": c.a, "B": c.b}.get(r["favours"], NONE),
    ]  # fmt: skip


def verdicts(f: Findings, found: list[tuple[System, System, Comparison]]) -> list[str]:
    """In a sentence a pair, its systems with their signs (see `tuning`): what is shown with confidence (p after Holm at most
    0.05), by how much, with 95 % intervals: of the success rates Newcombe's, of an indicator that of the median difference,
    which belongs to Wilcoxon's test; where that is nil, of the mean."""
    wins = [c.success.get(None) for _, _, c in found]
    adjusted = holm([np.nan if s is None else s.p for s in wins]).tolist()
    out = []
    for (a, b, c), s, p in zip(found, wins, adjusted, strict=True):
        said = []
        if s is not None and p <= 0.05:
            d, sign = s.difference, 1 if s.difference.estimate > 0 else -1
            low, high = sorted((100 * sign * d.low, 100 * sign * d.high))
            said.append(
                f"{c.b if sign > 0 else c.a} succeeds more often, by {num(100 * abs(d.estimate), 0)} points "
                f"({num(low, 0)} to {num(high, 0)})"
            )
        for r in c.differences.to_pylist():
            if r["batch"] is None and r["favours"]:
                who, sign = {"A": c.a, "B": c.b}[r["favours"]], 1 if r["effect"] > 0 else -1
                unit = f" {r['unit']}" if r["unit"] else ""
                typical = (
                    r["median_difference"] != 0
                )  # where most tests are alike to the last bit only a mean tells how much
                by, ends = (
                    (r["median_difference"], (r["low"], r["high"]))
                    if typical
                    else (r["mean_difference"], (r["boot_low"], r["boot_high"]))
                )
                of = f"by {num(sign * by, 3)}{unit}{'' if typical else ' on average'}"
                if ends[0] is not None:
                    low, high = sorted(sign * end for end in ends)
                    of += f" ({num(low, 3)} to {num(high, 3)})"
                said.append(f"{who} is better in {r['indicator']}, {of}")
        first, second = c.b + tuning.sign(f.of(b)), c.a + tuning.sign(f.of(a))
        out.append(
            f"{first} against {second}: "
            + ("; ".join(said) if said else "no difference is shown with confidence")
            + "."
        )
    return out

"""Paper B's Tables 2 and 3 for the search-and-rescue suites: per scenario, in sum, beside the paper and the clairvoyant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import mean, stdev

from clearway.indicators.avoidable import CLASSES
from clearway.reports import ablation, paper_b, sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, span, text
from clearway.reports.selection import Row, System, distinct, is_recorded, moving_at_contact, system_of
from clearway.scenarios.suite import Section
from clearway.statistics import success_interval

MOST_SCENARIOS = 20
"""Scenarios listed one by one; of more only the sum is shown."""
MOST_LINKS = 12
"""Failed trials of a system and kind that are linked to their replays; all of them are in the table of trials."""


def suites(f: Findings) -> list[str]:
    """The suites that ask for these tables, in the campaign's order."""
    simulated = {r["suite"] for r in f.rows if not is_recorded(r)}
    return [suite for suite in f.asked(Section.RESCUE) if suite in simulated]


def title(f: Findings, suite: str) -> str:
    """A suite's title, with the paper's table that it stands beside."""
    table = paper_b.TABLES.get(suite)
    return f.suites[suite].title + (f" ({table})" if table else "")


def tables(f: Findings) -> list[Grid]:
    """For each suite: scenario by scenario (where they are few), then in sum, then why trials failed."""
    out = []
    for suite in suites(f):
        rows = [r for r in f.rows if r["suite"] == suite]
        if len(distinct(rows, "scenario")) <= MOST_SCENARIOS:
            out += [by_scenario(f, suite, setup) for setup in dict.fromkeys(r["setup"] for r in rows)]
        out.append(summary(f, suite))
        out += [g for g in (causes(f, suite), failures(f, suite)) if g is not None]
    return out


def by_scenario(f: Findings, suite: str, setup: str | None) -> Grid:
    """Path and time of every navigator in every scenario, mean and standard deviation, as the paper lays them out."""
    rows = [r for r in f.rows if (r["suite"], r["setup"]) == (suite, setup)]
    systems = [s for s in ablation.whole(f.systems) if s.setup == setup and s.of(rows)]
    several = len({s.robot for s in systems}) > 1
    heads: Heads = [text("Scenario")]
    for s in systems:
        name = paper_b.METHODS.get(s.navigator, s.navigator) + (f" ({f.title(s.robot)})" if several else "")
        name += (" (privileged)" if s.navigator in f.privileged else "") + tuning.sign(s.of(rows))
        heads += [f"{name} path (m)", "time (s)"]
    lines: Rows = []
    tests = dict.fromkeys((str(r["scenario"]), r.get("member") or "", str(r["configuration"])) for r in rows)
    runs: dict[tuple[System, str, str], Row] = {}
    for r in rows:
        runs.setdefault((system_of(r), str(r["scenario"]), r.get("member") or ""), r)
    named = Counter(configuration for *_, configuration in tests)
    for scenario, member, configuration in tests:
        short = configuration.removeprefix("scenario-") if named[configuration] == 1 else scenario
        line: list[Cell | str] = [Cell(f"{short}, {member}" if member else short, strong=True)]
        for s in systems:
            line += _run(runs.get((s, scenario, member)))
        lines.append(line)
    groups = [len(lines)]
    for name, of in (("Mean", _mean), ("Standard deviation", _sd)):
        line = [Cell(name, strong=True)]
        for s in systems:
            line += [num(of(values), 1) if values else NONE for values in _successes(s.of(rows))]
        lines.append(line)
    printed = {s: paper_b.SUMS.get((suite, str(setup), s.navigator)) for s in systems}
    if any(printed.values()):
        groups.append(len(lines))
        for name, first in (("Mean, paper", 0), ("Standard deviation, paper", 1)):
            line = [Cell(name, strong=True)]
            for s in systems:
                sums = printed[s]
                line += [NONE if sums is None else num(sums[i], 1) for i in (first, first + 2)]
            lines.append(line)
    where = f", set-up {setup}" if setup is not None else ""
    note = " The paper's scenarios are not public, so its rows are of other draws." if any(printed.values()) else ""
    return grid(
        f"{title(f, suite)}{where}: length of the path and time, scenario by scenario; a dash is a failure.{note}"
        f"{tuning.footnote(rows)}",
        heads, lines, groups,
    )  # fmt: skip


def summary(f: Findings, suite: str) -> Grid:
    """Success with exact intervals beside the paper's, path, time, and both relative to the least there can be; the
    clairvoyant and the privileged navigators first, as references."""
    rows = [r for r in f.rows if r["suite"] == suite]
    lines: Rows = []
    if any(r["CT_optimal"] is not None for r in rows):
        lines.append([
            Cell("clairvoyant", strong=True), NONE, Cell("100 %", "by construction"), *[NONE] * 4, "1", *[NONE] * 3,
        ])  # fmt: skip
    for s in sorted(ablation.whole(f.systems), key=lambda s: s.navigator not in f.privileged):
        own = s.of(rows)
        if not own:
            continue
        wins = sum(bool(r["success"]) for r in own)
        rate = success_interval(wins, len(own))
        printed = paper_b.PRINTED.get((suite, str(s.setup), s.navigator))
        theirs = NONE if printed is None else f"{sum(r is not None for r in printed)}/{len(printed)}"
        path, time = _successes(own)
        ratios = [[r[c] for r in own if r["success"] and r[c] is not None] for c in ("PL_shortest", "CT_optimal")]
        cut = [r["cut"] for r in own if r["cut"] is not None]
        privileged = " (privileged)" if s.navigator in f.privileged else ""
        lines.append([
            Cell(s.navigator + privileged + tuning.sign(own), f.title(s.robot), strong=True), s.setup or NONE,
            Cell(f"{wins}/{len(own)}", span(100 * rate.low, 100 * rate.high, 1) + " %"), theirs,
            _pm(path), _pm(time), *(_pm(v, 3) for v in ratios), f"{num(mean(cut), 1)} %" if cut else NONE,
            str(sum(moving_at_contact(r) for r in own)), _violations(own),
        ])  # fmt: skip
    heads: Heads = [text("Navigator"), text("Set-up"), "success", "paper", "path (m)", "time (s)", "path / shortest", "time / clairvoyant's",
             "decisions cut", "moving at contact", "violated assumptions"]  # fmt: skip
    told = [i for i in range(len(heads)) if any(line[i] != NONE for line in lines)]
    heads, lines = [heads[i] for i in told], [[line[i] for i in told] for line in lines]
    return grid(
        f"{title(f, suite)}: successes with the exact 95 % interval; path and time of the successes, mean ± standard deviation, and "
        "relative to the least there can be: the shortest way past what stands, and the time of a clairvoyant, a point with unlimited "
        "acceleration up to the set speed, undisturbed (a push onwards can make a robot 0.2 % faster than that); the share of decisions "
        "that the budget cut short; trials with a contact while the robot moved; trials in which an assumption of the navigator's "
        "guarantee was seen to be untrue, and how often. A privileged navigator is told the obstacles' future."
        f"{sharing.footnote(rows)}{tuning.footnote(rows)}",
        heads, lines,
    )  # fmt: skip


def causes(f: Findings, suite: str) -> Grid | None:
    """Why trials failed, and who moved at contact; None if none failed."""
    rows = [r for r in f.rows if r["suite"] == suite and r["success"] is False]
    if not rows:
        return None
    kinds = [k for k, _ in Counter(r["cause"] or r["failure"] for r in rows).most_common()]
    lines: Rows = []
    for s in f.systems:
        if not (own := s.of(rows)):
            continue
        why = Counter(r["cause"] or r["failure"] for r in own)
        who = Counter(r["moved_at_contact"] for r in own if r["moved_at_contact"])
        lines.append([
            Cell(f.name(s), strong=True), str(len(own)), *(str(why[k]) if why[k] else NONE for k in kinds),
            "; ".join(f"{w} {n}" for w, n in who.most_common()) or NONE,
        ])  # fmt: skip
    heads: Heads = [text("System"), "failures", *kinds, text("moved at contact")]
    return grid(
        f"{title(f, suite)}: why trials failed. Crushing zone: 0.75 s before the contact no manoeuvre within the base's limits was "
        "left that touches nothing for 1.5 s; contact at rest: the robot stood; else the navigator's last word before the contact.",
        heads, lines,
    )  # fmt: skip


def failures(f: Findings, suite: str) -> Grid | None:
    """Which failures could have been avoided, and by what; None if none failed."""
    rows = [r for r in f.rows if r["suite"] == suite and r["success"] is False]
    if not rows:
        return None
    kinds = [*CLASSES, *(k for k in _ELSE if any(_class(r) == k for r in rows))]
    lines: Rows = []
    for s in f.systems:
        if not (own := s.of(rows)):
            continue
        linked = [_linked([r for r in own if _class(r) == k]) for k in kinds]
        lines.append([Cell(f.name(s), strong=True), str(len(own)), *linked])
    heads: Heads = [text("System"), "failures", *(_HEADS.get(k, k) for k in kinds)]
    return grid(
        f"{title(f, suite)}: which failures could have been avoided, each trial a link to its replay. A way out is a manoeuvre of the "
        "base, found by a search among obstacles whose future is known, that touches nothing until 1.5 s after the contact: 0.75 s before "
        "the contact there was one; or not then, but when the touched obstacle was "
        "first seen; no way out once seen: not even then. The search knows how everything will move, so a way out is no reproach.",
        heads, lines,
    )  # fmt: skip


_HEADS = dict(zip(CLASSES, ("no way out once seen", "way out when first seen", "way out 0.75 s before"), strict=True))
_ELSE = ("without contact", "not known")


def _class(row: Row) -> str:
    contact = str(row["failure"]).startswith("collision")
    return row.get("avoidable") or _ELSE[contact]


def _linked(rows: Sequence[Row]) -> Cell:
    """How many, with links to the first of them."""
    more = len(rows) - MOST_LINKS
    numbers = tuple(r["trial"] for r in rows[:MOST_LINKS])
    return Cell(str(len(rows)) if rows else NONE, f"and {more} more" if more > 0 else "", trials=numbers)


def _violations(rows: Sequence[Row]) -> Cell:
    """In how many trials an assumption was violated, and how often."""
    counts = [n for r in rows if (n := r.get("violations"))]
    return Cell(str(len(counts)), f"{sum(counts)} times" if counts else "")


def text_summary(f: Findings) -> list[Grid]:
    """What a terminal shows: the sums, the causes and what could have been avoided."""
    found = [(summary(f, s), causes(f, s), failures(f, s)) for s in suites(f)]
    return [g for pair in found for g in pair if g is not None]


def shown(f: Findings, suite: str, system: System) -> Row | None:
    """The scenario to draw for a navigator: of its successes that with the median time, else its first trial."""
    own = [r for r in f.of(system) if r["suite"] == suite]
    good = sorted((r for r in own if r["success"]), key=lambda r: (r["CT"], r["trial"]))
    return good[(len(good) - 1) // 2] if good else (own[0] if own else None)


def _successes(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    good = [r for r in rows if r["success"]]
    return [r["PL"] for r in good], [r["CT"] for r in good]


def _run(row: Row | None) -> list[Cell | str]:
    if row is None:
        return ["", ""]
    if not row["success"]:
        return [Cell(NONE, str(row["cause"] or row["failure"] or "")), NONE]
    return [num(row["PL"], 1), num(row["CT"], 1)]


def _mean(values: Sequence[float]) -> float | None:
    return mean(values) if values else None


def _sd(values: Sequence[float]) -> float | None:
    return stdev(values) if len(values) > 1 else None


def _pm(values: Sequence[float], digits: int = 1) -> str:
    if not values:
        return NONE
    spread = f" ± {num(_sd(values), digits)}" if len(values) > 1 else ""
    return num(mean(values), digits) + spread

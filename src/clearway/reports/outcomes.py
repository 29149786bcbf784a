"""The report's tables of what came out: headline, per batch, completion time taken apart, space, speeds, correlations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clearway.indicators import HEADLINE, INDICATORS, SLACK, shown_digits
from clearway.reports import paper, recordings, sharing, tuning
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, p_value, percent, span, text
from clearway.reports.selection import Row, System, placed_in_contact, table_of, verdict
from clearway.reports.words import contact
from clearway.scenarios.suite import Section
from clearway.statistics import FEWEST, GROUP, PAPER_A, POOLED, SYSTEM, reduced_set, success_rates
from clearway.trials import Attempt

SLACK_WORDS = f"{100 * SLACK[0]:g} cm and {SLACK[1]:g} rad"
JUDGED = ("CT", "PL", "DE", "DE_max", "OE", "OE_max", "MDO", "TCS")
"""The six indicators, and beside the two errors, which are means of a trial's ends, the worst end, by which it is judged."""
DIGITS = {"CT": 2, "PL": 2, "DE": 3, "OE": 3, "MDO": 3, "TCS": 1}


def batches(f: Findings, system: System) -> Grid:
    """SR and the six indicators per batch and set speed: mean, standard deviation, 95 % interval of the mean."""
    rows: Rows = []
    groups: list[int] = []
    last, own = None, f.of(system)
    names = _judged(f)
    notes = sharing.footnote(own) + tuning.footnote(own)
    for rate in system.of(f.rates):
        if f.batch(rate) != last:
            groups.append(len(rows))
            last = f.batch(rate)
        here = [r for r in own if all(r[c] == rate[c] for c in GROUP)]
        cells: list[Cell | str] = [
            Cell(f"{f.batch(rate)}{tuning.sign(here)}", strong=True),
            Cell(_speed(rate["speed"])),
            Cell(str(rate["n"] + rate["unknown"])),
            Cell(f"{num(rate['SR'], 1)} %", span(rate["low"], rate["high"], 1)),
            *(Cell(NONE if rate[c] is None else f"{num(rate[c], 1)} %") for c in ("SR_self", "SR_slack")),
        ]
        for name in names:
            found, measured = f.mean(rate, name), f.mean(rate, f"{name}_U")
            cells.append(_mean(found, DIGITS[name.removesuffix("_max")], measured))
        rows.append(cells)
    units = {n: INDICATORS[n].unit for n in names}
    columns: Heads = [
        text("Batch"), "v (m/s)", "n", "SR", "SR (robot's estimate)", "SR (with slack)",
        *(f"{n} ({units[n]})" if units[n] else n for n in names),
    ]  # fmt: skip
    return grid(
        f"{f.name(system)}{'.' if notes else ''}{notes}"
        if system != f.systems[0]
        else f"{f.name(system)}: mean ± standard deviation, with the 95 % interval of the mean (t); of SR the exact binomial one. "
        "DE and OE are means of a trial's ends, DE_max and OE_max its worst end, by which it is judged. SR judges the ends by the true pose; beside it by the robot's own estimate, if that is known, and by the true pose with a slack of "
        f"{SLACK_WORDS} for what a robot cannot know: how much its localisation errs. "
        "Trials that did not finish have no CT, PL, DE, OE, TCS; a small number below says how many have one."
        + (" U: mean expanded uncertainty (k = 2, about 95 %) of what was measured; it does not average out." if f.recorded else "")
        + (recordings.BY_MOTION if f.by_motion else "") + notes,
        columns, rows, groups,
    )  # fmt: skip


def _judged(f: Findings) -> list[str]:
    """The indicators of `JUDGED`, without the worst end where every trial has but one, and without those that no simulated trial has."""
    there = {name for name in JUDGED if f.recorded or any(r.get(name) is not None for r in f.rows)}
    alike = {n for n in ("DE_max", "OE_max") if all(r.get(n) == r.get(n.removesuffix("_max")) for r in f.rows)}
    return [name for name in JUDGED if name in there - alike]


def _speed(speed: float | None) -> str:
    return NONE if speed is None else f"{speed:g}"


def _mean(row: Row | None, digits: int, measured: Row | None = None) -> Cell:
    """Mean and spread; below them the interval, how many have a value, and the mean uncertainty if it was `measured`."""
    if row is None or row["mean"] is None:
        return Cell(NONE)
    spread = f" ± {num(row['sd'], digits)}" if row["sd"] is not None else ""
    parts = [span(row["t_low"], row["t_high"], digits)]
    if row["missing"]:
        parts.append(f"n {row['n']}")
    if measured is not None and measured["mean"]:
        parts.append(f"U {num(measured['mean'], shown_digits(measured['mean'], digits))}")
    return Cell(num(row["mean"], digits) + spread, "\n".join(part for part in parts if part))


def breakdown(f: Findings) -> Grid | None:
    """CT of batch NO, beside the paper's where a suite asks for that, and what it is made of."""
    printed_too = bool(f.asked(Section.PAPER_A))
    rows: Rows = []
    groups: list[int] = []
    for system in f.systems:
        free = [rate for rate in system.of(f.rates) if rate["batch"] == "NO"]
        if free:
            groups.append(len(rows))
        for rate in free:
            found = f.mean(rate, "CT")
            printed = next((m for m in _printed(f, rate) if m.indicator == "CT"), None)
            theirs: list[Cell | str] = [
                Cell(NONE) if printed is None else Cell(f"{printed.mean:.2f} ± {printed.spread:.2f}"),
                percent(found["mean"] if found else None, printed.mean if printed else None),
            ]
            parts = [f.mean(rate, f"T_{p}") for p in ("acceleration", "cruise", "approach", "rotation", "turn")]
            rows.append([
                Cell(f.name(system), rate["suite"] if len(f.suites) > 1 else "", strong=True), _speed(rate["speed"]), _mean(found, 2),
                *(theirs if printed_too else []), *(num(p["mean"] if p else None, 2) for p in parts),
            ])  # fmt: skip
    if not rows:
        return None
    columns: Heads = [
        text("Robot"), "v (m/s)", "CT (s)", *(["paper (s)", "difference"] if printed_too else []), "acceleration", "cruise",
        "approach", "final rotation", "turn at B",
    ]  # fmt: skip
    theirs_too = " beside the paper's" if printed_too else ""
    caption = (
        f"Batch NO: completion time{theirs_too}, and its parts in seconds, both legs together (they add up to CT; "
        "the turn at B is apart): acceleration until the robot first is at 90 % of the set speed, cruise until it last is, "
        "approach until it stands within tolerance of the goal, final rotation from there on."
        + (recordings.BY_MOTION if f.by_motion else "")
    )
    return grid(caption, columns, rows, groups)


def _printed(f: Findings, rate: Row) -> list[paper.Mean]:
    """What the paper prints of a system, batch and speed, if it is of its protocol."""
    if rate["suite"] not in f.asked(Section.PAPER_A):
        return []
    about = (rate["robot"].partition(":")[0], rate["batch"], rate["speed"])
    return [m for m in paper.MEANS if (m.robot, m.batch, m.speed) == about]


def beside(f: Findings) -> Grid | None:
    """The paper's other printed means beside ours; None where no suite asks for that."""
    rows: Rows = []
    for system in f.systems:
        for rate in system.of(f.rates):
            for m in _printed(f, rate):
                found = f.mean(rate, m.indicator)
                if m.indicator != "CT" and found is not None:
                    rows.append([
                        Cell(f.name(system), strong=True), f"{f.batch(rate)}, {m.speed:g} m/s", m.indicator,
                        _mean(found, DIGITS[m.indicator]), f"{m.mean:.2f} ± {m.spread:.2f}", percent(found["mean"], m.mean), m.source,
                    ])  # fmt: skip
        own = [r for r in f.of(system) if r["suite"] in f.asked(Section.PAPER_A)]
        if own and system.robot.partition(":")[0] in paper.YAW_TOLERANCE:
            rows.append(_success_beside(f, system, own))
    columns: Heads = [
        text("Robot"),
        text("Where"),
        text("Indicator"),
        "here",
        "paper",
        "difference",
        text("Printed in"),
    ]
    return grid("What else the paper prints, in the indicator's unit", columns, rows) if rows else None


def _success_beside(f: Findings, system: System, own: Sequence[Row]) -> list[Cell | str]:
    """SR over all batches of its `own` trials of the protocol beside what the paper says of it, which is no number."""
    (rate,) = success_rates(table_of(f.results, own), SYSTEM).to_pylist()
    return [
        Cell(f.name(system), strong=True), "all batches", "SR", Cell(f"{num(rate['SR'], 1)} %", span(rate["low"], rate["high"], 1)),
        paper.SUCCESS, NONE, "Results and discussion, text; Fig. 6 draws SR as bars without numbers",
    ]  # fmt: skip


def space(f: Findings) -> Grid | None:
    """The space that manoeuvring takes beside the paper's rule of 10 % of the robot's size."""
    rows: Rows = []
    groups: list[int] = []
    last = None
    suites = f.asked(Section.MANOEUVRING_SPACE)
    for system in f.systems:
        known: dict[tuple[Any, ...], list[Row]] = {}
        for r in f.of(system):
            if r["suite"] in suites and r.get("space_rel") is not None:
                known.setdefault((r["suite"], r["batch"], r["speed"]), []).append(r)
        for rate in system.of(f.rates):
            here = known.get((rate["suite"], rate["batch"], rate["speed"]), [])
            mean = f.mean(rate, "space")
            if not here or mean is None:
                continue
            if system != last:
                groups.append(len(rows))
                last = system
            within = sum(r["space_rel"] <= paper.MANOEUVRING_SHARE for r in here)
            rows.append([
                Cell(f.name(system), strong=True), f.batch(rate), _speed(rate["speed"]), str(len(here)),
                num(100 * mean["mean"], 1), num(100 * max(r["space"] for r in here), 1),
                f"{num(100 * sum(r['space_rel'] for r in here) / len(here), 0)} %",
                f"{num(100 * max(r['space_rel'] for r in here), 0)} %", f"{within} of {len(here)}",
            ])  # fmt: skip
    columns: Heads = [text("Robot"), text("Batch"), "v (m/s)", "n", "mean (cm)", "largest (cm)", "mean / width",
               "largest / width", "within 10 %"]  # fmt: skip
    return grid(
        "How far the footprint reached beyond the strip that it would sweep on the straight line A–B, on the side where it "
        "reached farther. Rondoni et al. 2024 leave 10 % of the robot's size; going around an obstacle takes more by necessity"
        + (", so batch NO is the one to hold against it." if any(r["batch"] == "NO" for r in f.rows) else "."),
        columns, rows, groups,
    ) if rows else None  # fmt: skip


_TEST = ("suite", "indicator", "batch", "speed_a", "speed_b")
"""What a test between speeds is of."""


def significance(f: Findings, system: System) -> Grid | None:
    """Every difference of one system that is significant here, or in paper A's Table 4 where a suite asks for that."""
    tests = {(*(t[c] for c in _TEST), t["analysis"]): t for t in system.of(f.tests)}
    protocol, suites = f.asked(Section.PAPER_A), list(f.suites)
    printed_too = bool(protocol)
    printed = {
        (suite, s.indicator, s.batch, s.slower, s.faster): s.p(system.robot)
        for suite in protocol
        for s in paper.TABLE_4
    }
    rows: Rows = []

    def place(key: tuple[Any, ...]) -> tuple[Any, ...]:
        suite, indicator, batch, *speeds = key
        batches = list(paper.PROTOCOL)
        return suites.index(suite), HEADLINE.index(indicator), batches.index(batch) if batch in batches else 9, *speeds

    for key in sorted(dict.fromkeys(k[:-1] for k in tests), key=place):
        test = tests.get((*key, "complete pairs"))
        theirs = printed.get(key)
        if test is None or ((test["p"] is None or test["p"] > 0.05) and theirs is None):
            continue
        digits, unit = DIGITS[test["indicator"]], test["unit"]
        worst, means = tests.get((*key, "failures ranked worst")), tests.get((*key, "configuration means"))
        rows.append([
            Cell(test["indicator"], strong=True), f.batch(test), f"{test['speed_a']:g} → {test['speed_b']:g}",
            Cell(NONE if test["difference"] is None else f"{num(test['difference'], digits)} {unit}".strip(), span(test["low"], test["high"], digits)),
            num(test["effect"], 2) if test["n"] >= FEWEST else NONE, str(test["n"]),
            Cell(p_value(test["p"]), test["stars"], strong=bool(test["stars"])), Cell(p_value(test["p_holm"]), test["stars_holm"]),
            p_value(test["smallest_p"]), p_value(worst["p"] if worst else None),
            Cell(p_value(means["p"] if means else None), f"n {means['n']}" if means else ""),
            *([p_value(theirs)] if printed_too else []),
        ])  # fmt: skip
    columns: Heads = [text("Indicator"), text("Batch"), "m/s", "median difference", "effect", "n", "p", "p (Holm)", "least p",
               "p, failures worst", "p, config. means", *(["paper's p"] if printed_too else [])]  # fmt: skip
    theirs_too = " or in the paper's Table 4" if printed_too else ""
    return grid(
        f"{f.name(system)}: differences between set speeds that are significant here (p ≤ 0.05)"
        f"{theirs_too}. "
        "Wilcoxon's signed-rank test on complete pairs of (configuration, repetition), two-sided, exact.",
        columns, rows,
    ) if rows else None  # fmt: skip


def normality(f: Findings) -> str:
    """How often Shapiro and Wilk's test rejects that an indicator is normal in a batch at a set speed; empty if untested."""
    tested = [r for r in f.described if r["indicator"] in HEADLINE and r["shapiro_p"] is not None]
    if not tested:
        return ""
    rejected = sum(not r["normal"] for r in tested)
    return (
        f"Normality (Shapiro and Wilk, each indicator in each batch at each set speed): rejected at 0.05 in {rejected} of "
        f"{len(tested)} samples, so ranks are compared, as in the paper; tables/summary.csv has each p."
    )


def correlations(f: Findings) -> tuple[Grid | None, list[str]]:
    """Every pair of indicators per robot and pooled, beside the paper's where a suite asks for that, and which set of
    indicators remains."""
    matrices = f.matrices
    if not matrices:
        return None, []
    printed_too = bool(f.asked(Section.PAPER_A))
    pairs = [(a, b) for i, a in enumerate(HEADLINE) for b in HEADLINE[i + 1 :]]
    pairs = [p for p in pairs if any((c := m.pairs.get(p)) is not None and c.r is not None for m in matrices.values())]
    order = sorted(pairs, key=lambda p: -abs(_paper_r(p) or 0.0))
    rows: Rows = []
    for a, b in order:
        cells: list[Cell | str] = [Cell(f"{a} – {b}", strong=printed_too and _paper_r((a, b)) is not None)]
        for matrix in matrices.values():
            found = matrix.pairs.get((a, b))
            cells.append(
                NONE
                if found is None or found.r is None
                else Cell(
                    num(found.r),
                    f"{found.strength} (n = {found.n})" if found.n < FEWEST else f"{found.strength}, n {found.n}",
                )
            )
        if printed_too:
            cells.append(num(_paper_r((a, b))))
        rows.append(cells)
    several = len({key[1:] for key in matrices}) > 1
    names = [f.name(System(*key)) for key in matrices]
    kept = []
    for name, (key, matrix) in zip(names, matrices.items(), strict=True):
        if len(matrices) > 1 and key[0] != POOLED and not several:
            continue
        counts = [c.n for (a, b), c in matrix.pairs.items() if a != b and c.r is not None]
        if max(counts, default=0) < FEWEST:
            kept.append(f"{name}: too few trials (n = {max(counts, default=0)}) to call an indicator redundant.")
            continue
        left = reduced_set(matrix)
        dropped = "; ".join(f"{gone} (r {num(r)} with {stays})" for gone, stays, r in left.dropped) or "none"
        there = [n for n in left.kept if matrix.pairs[n, n].n]
        kept.append(f"{name}: {', '.join(there)}. Dropped as redundant: {dropped}."
                    + (f" Pairs with fewer than {FEWEST} trials don't count." if min(counts) < FEWEST else ""))  # fmt: skip
    caption = f"Pearson's r with paper A's word for its strength, from {FEWEST} trials on"
    caption += "; the paper prints nine pairs, both robots pooled" if printed_too else ""
    return grid(caption, [text("Pair"), *names, *(["paper"] if printed_too else [])], rows), kept


def _paper_r(pair: tuple[str, str]) -> float | None:
    return PAPER_A.get(pair, PAPER_A.get((pair[1], pair[0])))


def trial_columns(f: Findings) -> list[dict[str, Any]]:
    """The columns of the table of trials, as JSON for its script."""
    labels: list[tuple[str, str, str, int | None]] = [
        ("trial", "no.", "", 0), ("verdict", "result", "", None), ("reason", "how it failed", "", None), ("robot", "robot", "", None), ("navigator", "navigator", "", None), ("setup", "set-up", "", None),
        ("suite", "suite", "", None), ("batch", "batch", "", None), ("configuration", "configuration", "", None), ("speed", "v", "m/s", 1),
        ("obstacle_speed", "v obst.", "m/s", 1), ("size", "size", "m", 2), ("gap", "gap", "", 1), ("repetition", "rep.", "", 0), ("member", "which robot", "", None),
        *((n, n, INDICATORS[n].unit, DIGITS[n.removesuffix("_max")]) for n in _judged(f)),
    ]  # fmt: skip
    if any(r["barn_score"] is not None for r in f.rows):
        labels.append(("barn_score", "score", "", 3))
    if any(r.get("tuned") for r in f.rows):
        labels.append(("tuned", "tuned", "", None))
    labels += [("avoidable", "was there a way out?", "", None)]
    if f.recorded:
        labels.insert([key for key, *_ in labels].index("verdict") + 1, ("to_confirm", "to confirm", "", None))
        labels += [("source", "source", "", None), ("note", "note", "", None)]
    columns = []
    for key, name, unit, digits in labels:
        values = {r[key] for r in f.rows if r.get(key) is not None} if key != "verdict" else set(map(verdict, f.rows))
        if key == "reason":
            values = {r["reason"] or r["failure"] for r in f.rows} - {None, ""}
        if key in ("to_confirm", "note", "avoidable"):
            values -= {""}
        optional = (
            "suite", "navigator", "setup", "obstacle_speed", "size", "gap", "member", "avoidable", "reason", "source", "to_confirm", "note",
        )  # fmt: skip
        if key in optional and len(values - {""}) < 1 + (key in ("suite", "navigator", "source", "member")):
            continue
        column: dict[str, Any] = {"key": key, "name": name, "unit": unit, "number": digits is not None}
        if digits is not None:
            column["digits"] = digits
        if (
            key in ("robot", "navigator", "setup", "suite", "batch", "configuration", "verdict", "source")
            and len(values) <= 60
        ):
            column["choices"] = sorted(map(str, values))
        if key in INDICATORS:
            column["title"] = INDICATORS[key].title
        if key in ("reason", "to_confirm", "note", "avoidable"):
            column["why" if key == "reason" else "words"] = True
        columns.append(column)
    return columns


def why(row: Row, attempt: Attempt | None) -> str:
    """Why a trial failed, in a line: what the world or the navigator said, or by how much which goal was missed.

    Without the `attempt`: by how much one was missed most.
    """
    if str(row["failure"]).startswith("collision"):
        more = "" if placed_in_contact(row) else str(row["reason"] or "")  # says the same
        return "; ".join(part for part in (contact(row), more) if part)
    if row["reason"]:
        return str(row["reason"].strip().splitlines()[-1])
    said = []
    scored = [leg for leg in attempt.legs if leg.scored] if attempt else []
    for name, unit in (("DE", "m"), ("OE", "rad")):
        if name not in str(row["failure"] or "").split("+"):
            continue
        if attempt is None and (worst := row.get(f"{name}_max")) is not None:
            said.append(f"{worst:.3f} {unit} off")
        for leg in scored:
            allowed = leg.xy_tolerance if name == "DE" else leg.yaw_tolerance
            found = row.get(f"{name}_{leg.name}") if len(scored) > 1 else row.get(f"{name}_max")
            if found is not None and allowed is not None and found > allowed:
                where = f"{leg.name}: " if len(scored) > 1 else ""
                said.append(f"{where}{found:.3f} {unit} off, {allowed:g} allowed")
    return "; ".join(said)

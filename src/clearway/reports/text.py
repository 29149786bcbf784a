"""Tables for a terminal: the headline numbers of results, all of the report's tables, and a comparison of two."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pyarrow as pa

from clearway.foreign import printable
from clearway.indicators import HEADLINE, INDICATORS
from clearway.reports import ablation, decision_time, head_to_head, outcomes, rescue, sharing, tuning
from clearway.reports.barn import barn
from clearway.reports.findings import Findings
from clearway.reports.grid import Grid, rate, rate_ends
from clearway.reports.published import published
from clearway.reports.side_by_side import mark, repetitions, taken_otherwise, uncertainty, unlike
from clearway.statistics import (
    FEWEST,
    FEWEST_RESAMPLED,
    GROUP,
    Comparison,
    ConfigurationComparison,
    describe,
    success_rates,
)
from clearway.trials.store import Results


def headline(table: pa.Table) -> str:
    """SR with its exact interval, by the robot's own estimate and with slack, and the mean of each of paper A's indicators,
    per system, batch and speed; a sign says on what the navigator's parameters were chosen."""
    described = describe(table, HEADLINE).to_pylist()
    means = {(*(r[c] for c in GROUP), r["indicator"]): r["mean"] for r in described}
    hidden = {c for c, kinds in (("setup", 0), ("suite", 1)) if len(set(table[c].to_pylist()) - {None, ""}) <= kinds}
    shown = [c for c in GROUP if c not in hidden]
    heads = [{"speed": "v [m/s]", "setup": "set-up"}.get(c, c) for c in shown] + [
        "n",
        "SR [%] (95 %, exact)",
        "robot's estimate",
        "with slack",
    ]
    heads += [f"{name} [{INDICATORS[name].unit}]" for name in HEADLINE]
    rows = []
    trials = table.select([c for c in (*GROUP, "tuned", "run") if c in table.column_names]).to_pylist()
    for r in success_rates(table).to_pylist():
        found = "unknown" if r["SR"] is None else f"{rate(r['SR'])} ({'-'.join(rate_ends(r['low'], r['high']))})"
        others = ["-" if r[c] is None else rate(r[c]) for c in ("SR_self", "SR_slack")]
        numbers = [_number(means.get((*(r[c] for c in GROUP), name))) for name in HEADLINE]
        labels = [f"{r[c]:g}" if isinstance(r[c], float) else str(r[c] or "-") for c in shown]
        labels[shown.index("navigator")] += tuning.sign(t for t in trials if all(t[c] == r[c] for c in GROUP))
        rows.append([*labels, str(r["n"] + r["unknown"]), found, *others, *numbers])
    notes = (_left_out(described), sharing.footnote(trials), tuning.footnote(trials))
    return "\n".join([columns(heads, rows), *(said.strip() for said in notes if said)])


def _left_out(described: Iterable[Mapping[str, Any]]) -> str:
    """How many trials the means leave out; empty where they are of all."""
    lacking: Counter[str] = Counter()
    for r in described:
        lacking[r["indicator"]] += r["missing"]
    said = ", ".join(f"{name} {n}" for name, n in lacking.items() if n)
    return f"means leave out trials without a value, such as those that did not finish: {said}" if said else ""


def numbers(results: Results) -> str:
    """The report's tables: every batch, beside the papers, statistics; for BARN, world by world beside the published runs."""
    f = Findings(results)
    parts = [_text(outcomes.batches(f, system)) for system in f.systems]
    parts += [_text(g) for g in (outcomes.beside(f), outcomes.breakdown(f), outcomes.space(f)) if g]
    parts += [_text(g) for system in f.systems if (g := outcomes.significance(f, system))]
    correlated, notes = outcomes.correlations(f)
    parts += [_text(correlated), *notes] if correlated else []
    parts += [_text(g) for g in (*rescue.tables(f), *ablation.tables(f), decision_time.table(f)) if g]
    duels = head_to_head.comparisons(f)
    parts += [_text(g) for g in (head_to_head.table(f, duels), head_to_head.indicator_table(duels)) if g]
    for system in f.systems:
        if found := barn(f, system):
            parts += [_text(found.table), _text(found.summary), found.agreement]
    return "\n\n".join(parts)


def beside_published(results: Results) -> str:
    """Suites beside what is published of them, BARN beside the published runs and the rescue cases beside paper B, in sum, what each
    ingredient of a navigator brings, and what the navigators' comparison shows; empty where there is none of it."""
    f = Findings(results)
    found = [b for system in f.systems if (b := barn(f, system))]
    parts = [*map(_text, published(f)), *(f"{_text(b.summary)}\n{b.agreement}" for b in found)]
    parts += [_text(g) for g in (*rescue.text_summary(f), *ablation.tables(f))]
    return "\n\n".join([*parts, "\n".join(head_to_head.verdicts(f, head_to_head.comparisons(f)))]).strip()


def decision_times(results: Results) -> str:
    """A line a system: how long its decisions took, and whether it could have kept up; empty where nothing was simulated."""
    f = Findings(results)
    said = decision_time.warnings(f)
    lines = [f"{f.name(system)}: {took}" for system, took in decision_time.decision_times(f).items()]
    warned = [f"warning: {sentence}." for sentence in said.values()]
    return "\n".join(
        [
            *(["decision times, median and 99th percentile (without a trial's first):"] if lines else []),
            *(f"  {line}" for line in lines),
            *warned,
        ]
    )


def _text(table: Grid) -> str:
    rows = [[cell.plain for cell in row] for row in table.rows]
    return f"{textwrap.fill(table.caption, 110)}\n{columns([c.name for c in table.columns], rows)}"


def tuned(tables: Mapping[str, pa.Table]) -> dict[str, dict[str, str]]:
    """For each of these results by name: each of its navigators that says so, with on what its parameters were chosen."""
    found = {}
    for name, table in tables.items():
        trials = table.select([c for c in ("navigator", "tuned") if c in table.column_names]).to_pylist()
        navigators = dict.fromkeys(t["navigator"] for t in trials)
        said = {n: tuning.sentence([t for t in trials if t["navigator"] == n]) for n in navigators}
        found[name] = {n: words for n, words in said.items() if words}
    return found


def tuned_lines(found: Mapping[str, Mapping[str, str]]) -> list[str]:
    """The same in a line each; a navigator that is in the name is not told twice."""
    return [
        f"{name if navigator in name.split(', ') else f'{name}, {navigator}'}: {words}"
        for name, said in found.items()
        for navigator, words in said.items()
    ]


def comparison(found: Comparison | ConfigurationComparison) -> str:
    """Differences of two results, all batches together and batch by batch."""
    return _matched(found) if isinstance(found, ConfigurationComparison) else _paired(found)


def _matched(found: ConfigurationComparison) -> str:
    """Differences of two results whose trials are no pairs, and how they were matched."""
    by = ", ".join(found.matched_by)
    lines = [
        f"{found.b} ({found.source_b}) against {found.a} ({found.source_a}), {found.kind}: {found.configurations} "
        f"configurations in common, {found.only_a} + {found.only_b} without a partner",
        f"  matched by {by}; the repetitions of a configuration are averaged first",
    ]
    lines += [f"  {said}" for said in repetitions(found)]
    for batch, s in _shown(found.success):
        d = s.difference
        lines.append(
            f"  success {batch or 'in all'}: {s.successes_b} of {s.trials_b} against {s.successes_a} of {s.trials_a}, "
            f"difference {100 * d.estimate:+.1f} points ({100 * d.low:+.1f} to {100 * d.high:+.1f}; independent trials)"
        )
    rows, measured, repeated = [], False, True
    for r in _lines(found):
        u = uncertainty(r)
        measured |= u is not None
        repeated &= r["rep_low"] is not None
        cells = [
            r["batch"] or "all",
            f"{r['indicator']} [{r['unit']}]{mark(found, r['indicator'])}",
            str(r["n"]),
            f"{r['trials_a']}/{r['trials_b']}",
        ]
        cells += [_number(r["mean_a"]), _number(r["mean_b"]), _delta(r["mean_difference"])]
        cells += [
            _to(r["boot_low"], r["boot_high"]),
            _to(r["rep_low"], r["rep_high"]),
            "-" if u is None else f"{u:.2g}",
        ]
        rows.append([*cells, _p(r["p"]), _p(r["p_holm"]), _effect(r)])
    heads = ["batch", "indicator", "n", "trials", found.a, found.b, "difference", "over configurations"]
    heads += ["over repetitions", "U", "p", "p Holm", "effect"]
    notes = [
        f"n: configurations; {100 * found.confidence:g} % intervals of the mean difference",
        _EFFECT.format(found.b),
    ]
    if not repeated:
        notes.append("over repetitions -: no configuration was repeated on one of the sides")
    if measured:
        notes.append("U: how far off the measured means may be together (k = 2); it comes on top of the intervals")
    if said := taken_otherwise(found):
        notes.append(said)
    return "\n".join([*lines, columns(heads, rows), *notes])


_EFFECT = f"effect: matched-pairs rank-biserial correlation, -1 ({{}} is always lower) to +1 (always higher), from {FEWEST} pairs on"

_NO_VALUES = "no indicator has a value on both sides of a pair, as where one of the two never finished"


def _shown(by_batch: Mapping[str | None, Any]) -> list[tuple[str | None, Any]]:
    """All batches together and each of them; where there is one only, it says it all."""
    return [(k, v) for k, v in by_batch.items() if k is not None or len(by_batch) != 2]


def _lines(found: Comparison | ConfigurationComparison) -> list[dict[str, Any]]:
    """The rows of differences that are shown."""
    rows: list[dict[str, Any]] = found.differences.to_pylist()
    batches = {r["batch"] for r in rows}
    return [r for r in rows if r["n"] and (r["batch"] is not None or len(batches) != 2)]


def _delta(value: float) -> str:
    """A difference with three digits, but no more than four decimals."""
    return f"{rounded:+.3g}" if (rounded := round(value, 4)) else "0"


def _effect(row: Mapping[str, Any]) -> str:
    return f"{row['effect']:+.2f}" if row["n"] >= FEWEST else "-"


def _to(low: float | None, high: float | None) -> str:
    return "-" if low is None or high is None else f"{_delta(low)} to {_delta(high)}"


def _paired(found: Comparison) -> str:
    heads = [
        "batch",
        "indicator",
        "n",
        found.a,
        found.b,
        f"difference ({100 * found.confidence:g} %)",
        "p",
        "p Holm",
        "effect",
        "favours",
    ]
    rows = []
    for r in _lines(found):
        spread = "" if r["boot_low"] is None else f" ({_to(r['boot_low'], r['boot_high'])})"
        favours = {"A": found.a, "B": found.b}.get(r["favours"], "")
        cells = [r["batch"] or "all", f"{r['indicator']} [{r['unit']}]", str(r["n"])]
        cells += [_number(r["mean_a"]), _number(r["mean_b"]), f"{_delta(r['mean_difference'])}{spread}"]
        rows.append([*cells, _p(r["p"]), _p(r["p_holm"]), _effect(r), favours])
    lines = [
        f"{found.b} against {found.a}: {found.pairs} pairs, {found.only_a} + {found.only_b} trials without a partner"
    ]
    for batch, s in _shown(found.success):
        a, b, d = s.both + s.only_a, s.both + s.only_b, s.difference
        lines.append(
            f"  success {batch or 'in all'}: {b} against {a} of {s.n}, difference {100 * d.estimate:+.1f} points "
            f"({100 * d.low:+.1f} to {100 * d.high:+.1f}), p = {_p(s.p)}"
        )
    doubt = [head_to_head.DOUBT.strip()] if found.doubtful else []
    few = (
        []
        if all(r["boot_low"] is not None for r in _lines(found))
        else [f"no interval: fewer than {FEWEST_RESAMPLED} pairs"]
    )
    shared = [said.strip() for said in (sharing.of_pairs([found]), sharing.repeated([found])) if said]
    table = [columns(heads, rows), *few, _EFFECT.format(found.b)] if rows else [_NO_VALUES]
    apart = [said] if (said := unlike(found)) else []
    return "\n".join([*lines, *doubt, *shared, *table, *apart])


def columns(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Cells under their heads, text to the left and numbers to the right."""
    cells = [list(heads), *([printable(cell) for cell in row] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(heads))]
    right = [all(_numeric(row[i]) for row in cells[1:]) for i in range(len(heads))]
    lines = (
        "  ".join(c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, widths, right, strict=True)) for row in cells
    )
    return "\n".join(line.rstrip() for line in lines)


def _number(value: Any) -> str:
    return "-" if value is None else f"{value:.3f}" if abs(value) < 10 else f"{value:.2f}"


def _p(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"


def _numeric(text: str) -> bool:
    return not text or text[0] in "+-−–0123456789"

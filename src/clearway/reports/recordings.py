"""What the report has to say of trials that were measured: what could not be computed, what a person has to confirm,
how each recording became a trial, and the conditions that the test plan states."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from clearway.indicators import INDICATORS, barn, optimal
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, text
from clearway.reports.selection import BOUNDED, Row, between, is_recorded, label
from clearway.trials.trial import NOT_RECORDED, UNUSABLE

Tree: TypeAlias = "list[tuple[str, str | Tree]]"
"""Something nested, key by key, as text."""

LEFT_OUT = frozenset(i.name for family in (barn, optimal) for i in family.ALL)
"""Indicators of other suites and of simulations: that a recording has none of them says nothing."""
_UNSEEN = (
    "CT, its parts, TCS and the turn's time lack the thinking before the first motion and the wait before a goal is called "
    "reached: a few tenths of a second a leg."
)
BY_MOTION = f" Of recordings whose legs were found by motion, {_UNSEEN}"
"""What has to be said beside such times."""
MOST = 12
"""Entries of a list that are spelled out."""


def recorded(f: Findings) -> list[Row]:
    """The rows of measured trials, attempts without a recording among them."""
    return [r for r in f.rows if is_recorded(r)]


def unrecorded(f: Findings) -> list[Row]:
    """Attempts of which nothing was recorded; they count as attempted."""
    return [r for r in recorded(f) if not r["duration"] and UNUSABLE not in str(r["reason"])]


def unusable(f: Findings) -> list[Row]:
    """Attempts whose recording cannot be used; they count as well."""
    return [r for r in recorded(f) if not r["duration"] and UNUSABLE in str(r["reason"])]


def stated(f: Findings, what: str, robot: str | None = None) -> str:
    """What the test plan says of a condition (`place`, `operator`, `floor`, `load`, `software`, `capture`, `date`), of
    one robot or of all; with the number of trials where they differ; empty if it says nothing."""
    said = Counter(
        str(f.provenance(r).get("conditions", {}).get(what) or "") for r in recorded(f) if robot in (None, r["robot"])
    )
    if set(said) <= {""}:
        return ""
    if len(said) == 1:
        return next(iter(said))
    return "; ".join(f"{words or 'not said'} ({n} trials)" for words, n in said.most_common())


def deviations(f: Findings) -> list[str]:
    """What happened to measured trials that a reader has to know, in sentences."""
    found = []
    there = [r for r in recorded(f) if r["duration"]]
    if count := len(unrecorded(f)):
        found.append(
            f"Of {count} attempts nothing was recorded; they count as attempted and as failed, by what the operator noted."
            if count > 1
            else "Of 1 attempt nothing was recorded; it counts as attempted and as failed, by what the operator noted."
        )
    if count := len(unusable(f)):
        found.append(
            f"The recordings of {count} attempts cannot be used; they count as attempted and as failed, until that is mended."
            if count > 1
            else "The recording of 1 attempt cannot be used; it counts as attempted and as failed, until that is mended."
        )
    ended = [str(r["reason"] or "aborted") for r in recorded(f) if r["outcome"] == "aborted"]
    stops = Counter(words for reason in ended if (words := _noted(reason)))
    for words, n in stops.most_common():
        found.append(
            f"{n} attempt{'s' if n > 1 else ''} ended early ({words}) and count{'' if n > 1 else 's'} as failed."
        )
    if by_motion := sum(bool(r.get("legs_by_motion")) for r in there):
        found.append(
            f"The legs of {by_motion} of {len(there)} recordings were found by motion, not by goals that were sent: {_UNSEEN}"
        )
    if unsure := sum(r["DE_U"] is None and r["DE"] is not None for r in there):
        found.append(
            f"Nobody knows how sure the poses of {unsure} of {len(there)} recordings are; their values stand without an interval."
        )
    return found


def _noted(reason: str) -> str:
    """How an attempt ended by what a person noted, or by what was measured; empty where there is no more than that nothing was."""
    words = reason.partition(f"; {UNUSABLE}")[0].removesuffix(f"; {NOT_RECORDED}")
    return "" if words in ("attempted", f"attempted, {NOT_RECORDED}") else words


# --- what could not be computed ---------------------------------------------------------------------------------------


def missing(f: Findings) -> Grid | None:
    """Per indicator: of how many trials it was computed, and why not of the others; None without measured trials."""
    rows = recorded(f)
    if not rows:
        return None
    told = {r["trial"]: json.loads(r["not_computable"] or "{}") for r in rows}
    alike: dict[tuple[int, tuple[tuple[str, int], ...]], list[str]] = {}
    for name in (n for n in INDICATORS if n not in LEFT_OUT):
        why = Counter(_plain(said[name]) for said in told.values() if name in said)
        if why:
            alike.setdefault((len(rows) - sum(why.values()), tuple(why.most_common())), []).append(name)
    lines: Rows = [
        [
            Cell(", ".join(names), strong=True),
            f"{count} of {len(rows)}",
            "; ".join(f"{words} ({n})" for words, n in why),
        ]
        for (count, why), names in alike.items()
    ]
    heads: Heads = [text("Indicator"), "computed", text("Why not, with the number of trials")]
    return grid(
        "Indicators that a recording could not give. The reason of each trial stands in tables/trials.csv, column "
        "not_computable, and in the table of trials when the pointer rests on an empty cell.",
        heads, lines,
    )  # fmt: skip


NO_OBSTACLE = ("the test has no obstacle", "no obstacle was present")
"""How the reasons begin that say that there was nothing to stay clear of."""


def why_no_distance(rows: Sequence[Row]) -> str:
    """Why none of these trials has an MDO; empty where there was nothing to stay clear of, or nothing is said."""
    said = [json.loads(r["not_computable"] or "{}").get("MDO", "") for r in rows if is_recorded(r)]
    why = Counter(
        _plain(words) for words in said if words and not words.startswith((*NO_OBSTACLE, NOT_RECORDED, UNUSABLE))
    )
    return f"not computable: {why.most_common(1)[0][0]}" if why else ""


def had_obstacles(row: Row) -> bool:
    """Whether there was something to stay clear of, whether or not it is known how near the robot came."""
    why = json.loads(row.get("not_computable") or "{}").get("MDO", "")
    return row["MDO"] is not None or bool(why and not why.startswith(NO_OBSTACLE))


def bounds(f: Findings) -> Grid | None:
    """Trials whose MDO, PL or TCS is known within bounds only, and these; None where there are none."""
    lines: Rows = []
    for r in recorded(f):
        if any(between(r, name) for name in BOUNDED):
            cells = [Cell(between(r, name) or NONE) for name in BOUNDED]
            lines.append([Cell("", trials=(r["trial"],)), str(f.planned(r) or NONE), Cell(label(r)), *cells])
    if not lines:
        return None
    units = [f"{name} ({INDICATORS[name].unit})" for name in BOUNDED]
    return grid(
        "What the indicators are at least and at most where the robot or an obstacle was not seen all of the time. From where they "
        "were last and next seen, and from the largest speed that the robot can drive or was seen to: MDO if both came as near as "
        "that allows, or no nearer than was seen; PL straight on or at that speed; TCS never or always at the set speed. These "
        "trials are in no mean of that indicator.",
        ["trial", "in the plan", text("test"), *units], lines,
    )  # fmt: skip


def _plain(why: str) -> str:
    """A reason without the seconds that differ from trial to trial."""
    return re.sub(r" \(\d+(\.\d+)? s\)$", "", why)


# --- to be confirmed --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Remark:
    """A trial of which something has to be said.

    Attributes:
        trial: Its number in the results.
        planned: Its number in the test plan; None if it has none.
        label: What the trial is, for people.
        what: What there is to say, in sentences.
    """

    trial: int
    planned: int | None
    label: str
    what: tuple[str, ...]


def to_confirm(f: Findings) -> list[Remark]:
    """What a person has to look at, in the campaign's order: possible contacts, and legs whose start or end did not show."""
    return _remarks(f, "to_confirm")


def near_tolerance(f: Findings) -> list[Remark]:
    """Ends within their uncertainty of a tolerance, which nobody can confirm, in the campaign's order."""
    return _remarks(f, "near_tolerance")


def _remarks(f: Findings, column: str) -> list[Remark]:
    there = [r for r in f.rows if r.get(column)]
    return [Remark(r["trial"], f.planned(r), label(r), tuple(r[column].split("; "))) for r in there]


def reader_notes(f: Findings) -> list[str]:
    """What was noticed or done when the recordings were read, in sentences with the trials' numbers: one for all that differ in
    their numbers only."""
    alike: dict[str, list[tuple[int, str]]] = {}
    for r in recorded(f):
        for source in _maps(f.provenance(r).get("sources")).values():
            for note in source.get("notes", ()):
                alike.setdefault(re.sub(r"\d[\d.]*", "0", str(note)), []).append((r["trial"], str(note)))
    found = []
    for same in alike.values():
        numbers = list(dict.fromkeys(str(n) for n, _ in same))
        more = f" and {len(numbers) - MOST} more" if len(numbers) > MOST else ""
        such = " (the first; the others say it of other numbers)" if len({note for _, note in same}) > 1 else ""
        found.append(f"trial{'s' * (len(numbers) > 1)} {', '.join(numbers[:MOST])}{more}: {same[0][1]}{such}")
    return found


# --- where it came from -----------------------------------------------------------------------------------------------


def overview(f: Findings) -> Grid | None:
    """A line a recording: its files, how well the robot was seen, and what was done to the data."""
    rows = [r for r in recorded(f) if r["duration"]]
    if not rows:
        return None
    lines: Rows = []
    for r in rows:
        told = f.provenance(r)
        files = [f"{s.get('file')} ({s.get('format')})" for s in _maps(told.get("sources")).values()]
        robot = _maps(told.get("motion")).get("robot", {})
        gaps = [g for g in robot.get("gaps", ()) if isinstance(g, Mapping) and not g.get("filled")]
        clocks = [_signed(c.get("seconds"), c.get("sigma")) for c in _maps(told.get("clock")).values()]
        lines.append([
            Cell(str(r["trial"])), str(f.planned(r) or NONE), Cell(label(r)), ", ".join(files) or NONE, num(_float(robot.get("rate")), 0),
            _percent(robot.get("seen")), _seconds(gaps), _times(robot.get("residual"), 1000.0, 2), _times(robot.get("cutoff"), 1.0, 1),
            ", ".join(clocks) or NONE,
        ])  # fmt: skip
    heads: Heads = ["no.", "in the plan", text("trial"), text("files"), "rate (Hz)", "robot seen", "open gaps (s)", "residual (mm)", "cut-off (Hz)",
                    "clock offsets (s)"]  # fmt: skip
    return grid(
        "How each recording was made into a trial. No.: the trial's number in these results, from 0, as replay and export take "
        "it; in the plan: its number in the test plan, from 1. Residual: root mean square of the rigid fit to the robot's markers; "
        "cut-off: of the low-pass that the positions went through; clock offset: what was added to the times of the other "
        "files, with its standard uncertainty.",
        heads, lines,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class History:
    """A measured trial with everything that it says of where it came from.

    Attributes:
        trial: Its number in the results.
        planned: Its number in the test plan; None if it has none.
        label: What the trial is, for people.
        told: Where it came from, by headings.
    """

    trial: int
    planned: int | None
    label: str
    told: Tree


def histories(f: Findings) -> list[History]:
    """How every measured trial ended, the operator's note, and its whole provenance."""
    shown = ("sources", "frame", "clock", "motion", "legs", "notes")
    out = []
    for r in recorded(f):
        told = f.provenance(r)
        ended = f"{r['outcome']}: {r['reason']}" if r["reason"] else r["outcome"]
        kept = {"how it ended": ended} | ({"note": r["note"]} if r["note"] else {})
        kept |= {k: told[k] for k in shown if told.get(k)} | {
            k: v for k, v in told.items() if k not in (*shown, "conditions", "note", "clearway", "number") and v
        }
        out.append(History(r["trial"], f.planned(r), label(r), tree(kept)))
    return out


def tree(value: Mapping[str, Any]) -> Tree:
    """A nested mapping as text, key by key."""
    return [(str(k), tree(v) if isinstance(v, Mapping) else _words(v, str(k))) for k, v in value.items()]


_UNITS = {
    "rate": (1.0, "Hz"), "cutoff": (1.0, "Hz"), "residual": (1000.0, "mm"), "residual_max": (1000.0, "mm"), "noise": (1000.0, "mm"),
    "seconds": (1.0, "s"), "sigma": (1.0, "s"), "seen": (100.0, "%"), "swapped": (1.0, "frames"), "refused": (1.0, "frames"),
}  # fmt: skip
"""Of numbers in a provenance: what they are multiplied by, and their unit then."""


def _words(value: Any, key: str = "") -> str:
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float) and key in _UNITS:
        factor, unit = _UNITS[key]
        return f"{factor * value:.4g} {unit}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping) and key == "gaps" and (known := [_float(value.get(k)) for k in ("start", "end")]):
        start, end = (NONE if k is None else f"{k:.2f}" for k in known)
        return f"{start} to {end} s ({'filled by ' + _words(value['filled']) if value.get('filled') else 'left open'})"
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {_words(v)}" for k, v in value.items() if v not in ("", None))
    if isinstance(value, Sequence) and not isinstance(value, str):
        said = [_words(v, key) for v in value[:MOST]]
        more = [f"… and {len(value) - MOST} more"] if len(value) > MOST else []
        return "; ".join([*said, *more]) or "none"
    return str(value).replace("+-", "±")


def _maps(value: Any) -> dict[str, Mapping[str, Any]]:
    """The entries of a mapping that are mappings themselves: provenance is whatever was written into it."""
    if not isinstance(value, Mapping):
        return {}
    return {str(k): v for k, v in value.items() if isinstance(v, Mapping)}


def _float(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _times(value: Any, factor: float, digits: int) -> str:
    number = _float(value)
    return NONE if number is None else num(factor * number, digits)


def _percent(value: Any) -> str:
    share = _float(value)
    return NONE if share is None else f"{num(100 * share, 1)} %"


def _signed(seconds: Any, sigma: Any) -> str:
    offset, spread = _float(seconds), _float(sigma)
    if offset is None:
        return NONE
    return f"{offset:+.3f}".replace("-", "−") + (f" ± {spread:.3f}" if spread is not None else "")


def _seconds(gaps: Sequence[Mapping[str, Any]]) -> str:
    """How long, and how many: `0.8 (2)`."""
    ends = [(_float(g.get("start")), _float(g.get("end"))) for g in gaps]
    lengths = [b - a for a, b in ends if a is not None and b is not None]
    return f"{sum(lengths):.1f} ({len(lengths)})" if lengths else "none"

"""What to fix: the commonest causes of a system's failures, what an engineer would try, and the most typical trial of each.

A cause is put in words for people. Nobody is blamed: a way out that a search among known futures finds is one that the robot may
not have known of.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from clearway.indicators.avoidable import FORESIGHT, PLANNER, TOO_LATE
from clearway.reports.findings import Findings
from clearway.reports.grid import num
from clearway.reports.selection import Row, System, configuration_of, label, placed_in_contact, system_of, verdict
from clearway.reports.words import WAYS_OUT, contact
from clearway.trials.trial import UNUSABLE

MOST = 3
"""Causes that are named."""
_ADVICE = {
    PLANNER: "keep more distance or brake earlier: there still was room to evade",
    FORESIGHT: "look further ahead in time: where it would be could be seen coming",
    TOO_LATE: "drive slower where the view is short, or let it see further",
}
_NOTE = "see the note of the trial"
_ENDS = {
    "timeout": ("ran out of time", "see in the replay where it waits, and what it takes for an obstacle"),
    "livelock": ("went on moving without getting nearer", "look for two plans between which it changes its mind"),
    "navigator_failed": ("the navigator raised an error or gave no valid command", "mend the error"),
    "unfinished": ("did not get to every goal", "look at the replay"),
    "gave up": ("gave up", "see what its last plan was and what stood in its way"),
    "stopped": ("was stopped by the operator", _NOTE),
    "helped": ("a person had to help", _NOTE),
    "not recorded": ("nothing was recorded, nor noted how it ended", _NOTE),
    "recording can't be used": ("the recording can't be used: a fault of the data, not of the robot", "mend the recording"),
    "recording cut off": ("the recording ends while the robot moves", "give all of it, or note in the test plan what happened"),
    "did not finish": ("did not finish", "see in the replay where it stayed"),
}  # fmt: skip
"""By how a trial ended, an aborted one by its `verdict`: in words for people, and what an engineer would try."""
_MISSED = {"DE": "position", "OE": "heading", "DE+OE": "position and heading"}


@dataclass(frozen=True, slots=True)
class Cause:
    """Why some of a system's trials failed.

    Attributes:
        words: What happened.
        count: In how many trials.
        who: Which system has most of it, where the cause is of several; else empty.
        advice: What an engineer would try.
        trial: The number of the most typical one.
        label: That trial's conditions.
    """

    words: str
    count: int
    who: str
    advice: str
    trial: int
    label: str


def causes(f: Findings, system: System) -> list[Cause]:
    """The commonest causes of failure of one system, at most `MOST`."""
    return [_cause(f, system, words, rows, "") for words, rows in _kinds(f.of(system))]


def failures(rows: Iterable[Row]) -> int:
    """How many of these trials failed."""
    return sum(r["success"] is False for r in rows)


def causes_of_all(f: Findings) -> list[Cause]:
    """The commonest causes over all systems, each with the system that has most of it."""
    found = []
    for words, rows in _kinds(f.rows):
        (system, count), *others = Counter(map(system_of, rows)).most_common()
        who = f"{f.name(system)}: {count} of them" if others else f.name(system)
        found.append(_cause(f, system, words, rows, who))
    return found


def _kinds(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """The commonest causes among these trials, each with its trials."""
    kinds: dict[str, list[Row]] = {}
    for r in rows:
        if r["success"] is False:
            kinds.setdefault(what_happened(r), []).append(r)
    return sorted(kinds.items(), key=lambda kind: -len(kind[1]))[:MOST]


def _cause(f: Findings, system: System, words: str, rows: Sequence[Row], who: str) -> Cause:
    own = system.of(rows)
    typical = most_typical(own)
    return Cause(words, len(rows), who, _advice(f, system, own), typical["trial"], label(typical))


def what_happened(row: Row) -> str:
    """How a failed trial failed, in words for people."""
    failure = str(row["failure"] or row["outcome"])
    if failure in _MISSED:
        which, be = _MISSED[failure], "were" if "+" in failure else "was"
        if row["success_self"]:
            return f"took itself to be there, but its true {which} {be} off by more than is allowed"
        return f"ended with its {which} off by more than is allowed"
    if failure.startswith("collision"):
        return contact(row)
    return _ENDS.get(_end(row, failure), (failure.replace("_", " "), ""))[0]


def _end(row: Row, failure: str) -> str:
    return verdict(row) if failure == "aborted" else failure


def most_typical(rows: Sequence[Row]) -> Row:
    """Of the batch and configuration with most of these trials, the one in the middle by how far off, or how long, it was."""
    most, _ = Counter(map(configuration_of, rows)).most_common(1)[0]
    there = [r for r in rows if configuration_of(r) == most]
    ordered = sorted(there, key=lambda r: (r["DE_max"] or 0.0, r["duration"] or 0.0, r["trial"]))
    return ordered[(len(ordered) - 1) // 2]


def _advice(f: Findings, system: System, rows: Sequence[Row]) -> str:
    failure = str(rows[0]["failure"] or rows[0]["outcome"])
    if failure in _MISSED:
        return _of_precision(f, system, rows, failure)
    if placed_in_contact(rows[0]):
        return "start it where what stands or comes leaves it more room than placement_xy and placement_yaw take"
    if failure.startswith("collision"):
        ways = Counter(r.get("avoidable") or "" for r in rows)
        most, count = ways.most_common(1)[0]
        if not most:
            return "look at the replay: whether there was a way out is not known"
        if failure == "collision at rest" and most == PLANNER:
            return f"don't stop in the way of what moves ({count} of {len(rows)}: {WAYS_OUT[most]})"
        return f"{_ADVICE[most]} ({count} of {len(rows)}: {WAYS_OUT[most]})"
    advice = _ENDS.get(_end(rows[0], failure), ("", "look at the replay"))[1]
    said = Counter(filter(None, (_said(r, noted=advice == _NOTE) for r in rows))).most_common(1)
    for words, n in said:
        how = "" if n == len(rows) else "; most often" if n > 1 else "; such as"
        advice += f"{how}: “{words}”"
    return advice


def _of_precision(f: Findings, system: System, rows: Sequence[Row], failure: str) -> str:
    """By how much the goal was missed, and what room the planner's tolerance would have to leave."""
    parts = []
    for name, unit, scale, digits in (("DE", "cm", 100.0, 1), ("OE", "rad", 1.0, 3)):
        if name not in failure.split("+"):
            continue
        off = [r[f"{name}_max"] for r in rows if r[f"{name}_max"] is not None]
        if not off:
            continue
        said = f"the worst end is {num(scale * median(off), digits)} {unit} off (median)"
        for found, words in ((f.tolerances, "allowed"), (f.planner_tolerances, "told to the planner")):
            if (tolerance := found.get((system, f"{name}_max"))) is not None:
                said += f", {num(scale * tolerance, digits)} {words}"
        parts.append(said)
    knew = all(r["success_self"] for r in rows)
    first = (
        "localise better, or tell the planner a smaller tolerance" if knew else "tell the planner a smaller tolerance"
    )
    return "; ".join([first, *parts])


def of_slack(rows: Iterable[Row]) -> int:
    """How many of these failures are ends that the robot took for right and a small slack for its localisation would forgive."""
    return sum(r["success"] is False and bool(r["success_self"] and r.get("success_slack")) for r in rows)


def _said(row: Row, *, noted: bool) -> str:
    """What a person noted of a trial, or the last line of what the world, the navigator or the reader of the recording said."""
    words = str((row["note"] if noted else row["reason"]) or "").rpartition(f"{UNUSABLE}: ")[2]
    return words.strip().rpartition("\n")[2]

"""Tables of what robots had to do with people and things: nearness to people, contacts, smoothness, interventions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from clearway.indicators import INDICATORS
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, span, text
from clearway.reports.recordings import recorded
from clearway.reports.selection import Row, label
from clearway.statistics import mean_interval

_NEARNESS = {
    "person_distance": ("distance (m)", 2), "social_time": ("within 3.6 m (s)", 1), "personal_time": ("within 1.2 m (s)", 1),
    "intimate_time": ("within 0.45 m (s)", 1), "person_speed": ("speed when nearest (m/s)", 2), "person_ttc": ("to collision (s)", 1),
}  # fmt: skip
_COST = {
    "people_delay": ("delay (s)", 2), "people_delay_max": ("delay of the one delayed most (s)", 2), "people_detour": ("detour (m)", 2),
}  # fmt: skip
_SMOOTHNESS = {
    "jerk": ("mean jerk (m/s³)", 2), "jerk_max": ("largest jerk (m/s³)", 1), "stopped_time": ("stopped (s)", 1),
}  # fmt: skip
"""Indicators: how each is printed, with how many digits."""
_MEANS = "Means with their 95 % intervals (t), and the worst trial; below, of how many trials: those that did not finish have none"

_SOONER = (
    " A delay below 0: somebody came sooner with the robot, as it held up who would have been in the way; far below 0, somebody who "
    "without it stands for good before others or what is pushed, which no robot is to be praised for."
)


def people(f: Findings) -> list[Grid]:
    """How near each system came to people and what it cost them, by batch; nothing without people."""
    sooner = _SOONER if any((r.get("people_delay") or 0.0) < 0.0 for r in f.rows) else ""
    tables = (
        _table(
            f, _NEARNESS,
            "People: in how many trials one was touched; the smallest distance from a person, the time within the social (3.6 m), the "
            "personal (1.2 m) and the intimate zone (0.45 m; Hall 1966), the robot's speed when nearest, and the smallest time to collision, "
            f"from outline to outline on the legs. {_MEANS} but for the distance, which is 0 where one was touched; nor have those in which nobody was on a collision course a time to collision.",
        ),
        _table(
            f, _COST,
            "What robots cost people: how much later they arrive, and how much further they walk, than the same people in the same scene "
            "without robots; the mean of a trial's people. Who has not come two minutes after the trial counts as coming then. Means with their "
            f"95 % intervals (t), and the worst trial; below, of how many trials: those that a contact or a failure cut short have none.{sooner}",
        ),
    )  # fmt: skip
    return [table for table in tables if table is not None]


def driving(f: Findings) -> Grid | None:
    """Who moved at contact, and how smoothly each system drove, by batch; None of recordings without contacts."""
    kinds = ("robot", "both", "obstacle", "neither")
    shown = {name: how for name, how in _SMOOTHNESS.items() if any(r.get(name) is not None for r in f.rows)}
    rows: Rows = []
    groups: list[int] = []
    for system in f.systems:
        groups.append(len(rows))
        for batch, there in _by_batch(f, f.of(system)).items():
            who = Counter(r.get("moved_at_contact") for r in there)
            cells: list[Cell | str] = [Cell(f.name(system), strong=True), batch, str(len(there))]
            told = all(r.get("contacts") is not None for r in there)  # of a recording perhaps nobody knows
            cells += [str(who[kind]) if told or who[kind] else NONE for kind in kinds]
            rows.append(cells + [_mean([r.get(name) for r in there], name, how[1]) for name, how in shown.items()])
    contacts = any(r.get("moved_at_contact") for r in f.rows)
    heads: Heads = [
        text("Robot"), text("Batch"), "n", "contacts: robot moved", "both", "the other", "neither", *(head for head, _ in shown.values()),
    ]  # fmt: skip
    jerk = "mean and largest jerk from velocities 0.25 s apart, and " if "jerk" in shown else ""
    smooth = (
        f", and how smoothly it drove: {jerk}the time stopped on the way (Francis et al. 2023). {_MEANS}"
        if shown
        else ""
    )
    return grid(
        "Contacts by who moved (Tsoi et al. 2022 count a robot's and a person's apart; a round robot that only turns does not move)"
        f"{smooth}.", heads, rows, groups,
    ) if contacts or shown else None  # fmt: skip


def _by_batch(f: Findings, rows: Iterable[Row]) -> dict[str, list[Row]]:
    batches: dict[str, list[Row]] = {}
    for r in rows:
        batches.setdefault(f.batch(r), []).append(r)
    return batches


def _table(f: Findings, indicators: Mapping[str, tuple[str, int]], caption: str) -> Grid | None:
    shown = {name: how for name, how in indicators.items() if any(r.get(name) is not None for r in f.rows)}
    rows: Rows = []
    for system in f.systems:
        among = [r for r in f.of(system) if r.get("people") or any(r.get(name) is not None for name in shown)]
        for batch, there in _by_batch(f, among).items():
            touched = sum(r.get("touched") == "person" for r in there)
            cells: list[Cell | str] = [Cell(f.name(system), strong=True), batch, str(len(there)), str(touched)]
            rows.append(cells + [_mean([r.get(name) for r in there], name, how[1]) for name, how in shown.items()])
    heads: Heads = [text("Robot"), text("Batch"), "n", "touched", *(head for head, _ in shown.values())]
    return grid(caption, heads, rows) if rows and shown else None


def _mean(values: Sequence[float | None], name: str, digits: int) -> Cell:
    """The mean of what is known, its interval, the worst, and how many that are if not all."""
    known = np.array([v for v in values if v is not None], dtype=np.float64)
    if not len(known):
        return Cell(NONE)
    about, indicator = [], INDICATORS[name]
    if (interval := mean_interval(known, bounds=indicator.bounds)) is not None:
        about.append(span(interval.low, interval.high, digits))
    about.append(f"worst {num(float(known.min() if indicator.better == 'higher' else known.max()), digits)}")
    if len(known) < len(values):
        about.append(f"of {len(known)}")
    return Cell(num(float(known.mean()), digits), "\n".join(about))


def incidents(f: Findings) -> Grid | None:
    """Recorded trials with a contact or an intervention; None without."""
    rows: Rows = []
    for r in recorded(f):
        if not (r.get("contacts") or r.get("interventions")):
            continue
        cells: list[Cell | str] = [Cell("", trials=(r["trial"],)), str(f.planned(r) or NONE), Cell(label(r))]
        for count, first in (("contacts", "first_contact"), ("interventions", "first_intervention")):
            n = r.get(count)
            cells += ["?" if n is None else str(n), NONE if r.get(first) is None else num(r[first], 1)]
        rows.append(cells)
    heads: Heads = [
        "trial", "in the plan", text("test"), "contacts", "first (s)", "interventions", "first (s)",
    ]  # fmt: skip
    return grid(
        "Contacts, measured or seen by the operator, and interventions of a person, in seconds since the recording's start as far as "
        "somebody said when; ? where nobody knows how many.",
        heads, rows,
    ) if rows else None  # fmt: skip

"""Tables of what robots had to do with people and things: nearness to people, contacts, interventions."""

from __future__ import annotations

from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, Heads, Rows, grid, num, text
from clearway.reports.recordings import recorded
from clearway.reports.selection import Row, label

COMFORT = {"person_distance": 2, "personal_time": 1, "intimate_time": 1, "person_ttc": 1}
"""Indicators of people, with the digits that are shown."""


def people(f: Findings) -> Grid | None:
    """How near each system came to people, by batch; None without people."""
    rows: Rows = []
    for system in f.systems:
        batches: dict[str, list[Row]] = {}
        for r in f.of(system):
            if any(r.get(name) is not None for name in COMFORT):
                batches.setdefault(str(r["batch"]), []).append(r)
        for batch, there in batches.items():
            cells: list[Cell | str] = [Cell(f.name(system), strong=True), batch, str(len(there))]
            for name, digits in COMFORT.items():
                known = [r[name] for r in there if r.get(name) is not None]
                least = name in ("person_distance", "person_ttc")
                worst = (min(known) if least else max(known)) if known else None
                cells += [num(sum(known) / len(known), digits), num(worst, digits)] if known else [NONE, NONE]
            rows.append(cells)
    heads: Heads = [
        text("Robot"), text("Batch"), "n", "distance (m)", "smallest", "within 1.2 m (s)", "longest", "within 0.45 m (s)", "longest",
        "to collision (s)", "smallest",
    ]  # fmt: skip
    return grid(
        "People: the smallest distance from a person, the time within the personal (1.2 m) and the intimate zone (0.45 m; Hall 1966), "
        "and the smallest time to collision, from outline to outline on the legs; the mean of the trials, and the worst. Trials in which "
        "nobody was on a collision course have no time to collision.",
        heads, rows,
    ) if rows else None  # fmt: skip


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
